//! Paths that aim: how bright their targets are, from where they aim, and what they weigh where they arrive.

use std::cmp::Ordering;
use std::ops::Range;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::aim_targets::{AimTargets, Aiming, Facet};
use super::tracer::{Departure, Path, PathTracer};
use super::triangles::point_on;
use super::vertex::{Aim, Vertex};
use crate::bsdf::cosine_hemisphere;
use crate::bvh::{Ray, offset_origin};
use crate::color::{importance, luminance};
use crate::math::Frame;
use crate::sampler::{Sampler, unit_from_bits};
use crate::scene::surface::SurfacePoint;

/// Parts of their area that are looked at, and paths that look at each side of a part.
const PARTS: usize = 64;
const PATHS: u32 = 8;
/// Share of the mean of all parts in what a part counts: few paths are often much brighter or darker.
const SHARE_OF_ALL: f32 = 0.25;
/// Keeps their random numbers apart from others.
const SEED: u32 = 0x7472_616e;

/// Where each facet lies in the area of all, cut into [`PARTS`].
fn spans(facets: &[Facet]) -> Vec<Range<f64>> {
    let total: f64 = facets.iter().map(|facet| f64::from(facet.area.length())).sum();
    let mut end = 0.0;
    let mut span = |facet: &Facet| {
        let start = end;
        end += f64::from(facet.area.length()) / total * PARTS as f64;
        start..end
    };
    facets.iter().map(&mut span).collect()
}

/// Mean radiance that leaves the front and the back of a part of the area, as brightness. A solid's back is inside.
fn radiance_of_part(
    tracer: &PathTracer<'_>,
    facets: &[Facet],
    spans: &[Range<f64>],
    part: usize,
) -> [f32; 2] {
    let mut radiance = [0.0; 2];
    let scene = &tracer.world.scene;
    for path in 0..PATHS {
        let mut sampler = Sampler::new(SEED, part as u32, path);
        let place = part as f64 + f64::from(sampler.next_pair()[0]);
        let is_before = |span: &Range<f64>| span.end.total_cmp(&place) == Ordering::Less;
        let Facet { triangle, area } =
            facets[spans.partition_point(is_before).min(facets.len() - 1)];
        let bits = sampler.next_pair_bits();
        let (position, _) = point_on(&scene.corners(triangle), unit_from_bits(bits[0]), bits[1]);
        let material = &scene.materials[scene.triangle_materials[triangle as usize] as usize];
        let sides = if material.has_inside() { 1 } else { 2 };
        for (side, sum) in radiance.iter_mut().take(sides).enumerate() {
            let normal = area.normalize() * if side == 0 { 1.0 } else { -1.0 };
            let down = cosine_hemisphere(Vec2::from(sampler.next_pair()));
            let direction = -Frame::from_z(normal).world_from_local(down);
            let origin = offset_origin(position, normal);
            let ray = Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
            *sum += importance(tracer.radiance(ray, sampler.clone()).radiance) / PATHS as f32;
        }
    }
    radiance
}

impl<'a> PathTracer<'a> {
    /// What paths may aim at in the scene, weighed by the light that is found on it; `None` if there is nothing.
    pub(crate) fn aim_targets(&self) -> Option<AimTargets> {
        let scene = &self.world.scene;
        let facets = AimTargets::facets(scene);
        if facets.is_empty() {
            return None;
        }
        let spans = spans(&facets);
        let of_part = |part: usize| radiance_of_part(self, &facets, &spans, part);
        let of_parts: Vec<[f32; 2]> = (0..PARTS).into_par_iter().map(of_part).collect();
        let mean = |parts: &[[f32; 2]], side: usize| {
            parts.iter().map(|part| part[side]).sum::<f32>() / parts.len() as f32
        };
        let all = [0, 1].map(|side| SHARE_OF_ALL * mean(&of_parts, side));
        let of_facet = |span: &Range<f64>| {
            let first = (span.start as usize).min(PARTS - 1);
            let parts = &of_parts[first..(span.end.ceil() as usize).clamp(first + 1, PARTS)];
            [0, 1].map(|side| all[side] + (1.0 - SHARE_OF_ALL) * mean(parts, side))
        };
        let radiances: Vec<[f32; 2]> = spans.iter().map(of_facet).collect();
        Some(AimTargets::new(scene, &facets, &radiances))
    }

    /// Luminance that a camera path brings back from the first surface that may aim: what of it comes straight from
    /// targets, and all.
    pub(crate) fn light_of_targets(&self, ray: Ray, sampler: Sampler) -> [f32; 2] {
        let mut path = Path::new(self, ray, sampler);
        let (mut of_first, mut of_second) = (None, None);
        let Some(first) = path.next_vertex(&mut of_first) else { return [0.0; 2] };
        path.radiance = Vec3::ZERO;
        let Some(aiming) = self.aiming_from(&first) else { return [0.0; 2] };
        let mut from_targets = 0.0;
        if path.visit(&first) {
            let before = path.radiance;
            let second = path.next_vertex(&mut of_second);
            let is_target = second.as_ref().is_some_and(|vertex| aiming.targets.has(vertex));
            if let Some(second) = second
                && path.visit(&second)
            {
                path.run();
            }
            if is_target {
                from_targets = luminance(path.radiance - before);
            }
        }
        [from_targets, luminance(path.radiance)]
    }

    /// How a path in air aims from a vertex; `None` if it does not.
    pub(super) fn aiming_from(&self, vertex: &Vertex<'_>) -> Option<&'a Aiming> {
        let aiming = self.lights.aiming.as_ref()?;
        vertex.scatterer.surface()?.is_cacheable().then_some(aiming)
    }
}

impl Departure {
    /// Whether the ray is to arrive at one surface and nowhere else.
    pub(super) fn is_aimed(&self) -> bool {
        matches!(self.aim, Aim::At(_))
    }

    /// What a path weighs that may have been aimed where it has arrived, as a factor; `None` if it ends there.
    pub(super) fn weight_at(
        &self,
        point: &SurfacePoint<'_>,
        tracer: &PathTracer<'_>,
    ) -> Option<f32> {
        if matches!(self.aim, Aim::At(target) if target != point.triangle) {
            return None;
        }
        let bsdf_pdf = self.pdf_solid_angle;
        let aiming = tracer.lights.aiming.as_ref();
        let Some(aiming) = aiming.filter(|_| bsdf_pdf.is_finite()) else {
            return Some(1.0);
        };
        let at = (point.triangle, self.receiver.position.distance(point.position));
        let (scene, direction) = (&tracer.world.scene, self.ray.direction);
        let pdf = aiming.pdf_solid_angle(scene, at, &self.receiver, direction, bsdf_pdf);
        Some(aiming.probability_of_bsdf() * bsdf_pdf / pdf)
    }

    /// Probability with which the BSDF chose the direction of the ray, which may have been aimed.
    pub(super) fn probability_of_bsdf(&self, tracer: &PathTracer<'_>) -> f32 {
        let aiming = tracer.lights.aiming.as_ref().filter(|_| self.aim != Aim::None);
        aiming.map_or(1.0, Aiming::probability_of_bsdf)
    }
}
