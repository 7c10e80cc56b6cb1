//! Ray casts without shading, with the same rays on every device: camera rays, and from their hits shadow
//! rays towards the map and rays of a diffuse bounce.

use std::time::Instant;

use glam::{UVec2, Vec2, Vec3};
use rayon::prelude::*;
use serde::Serialize;

use super::place::Place;
use crate::bvh::{Ray, offset_origin};
use crate::error::{Error, Result};
use crate::light_grid::LightGrid;
use crate::math::Frame;
use crate::path::World;
use crate::path::camera::{CameraRays, disk_from_square};
use crate::render::gpu::{Caster, Question, UploadedScene};
use crate::render::{Sampling, View};
use crate::sampler::Sampler;

/// Kind of ray.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum RayKind {
    /// From the camera, neighbours beside one another.
    Primary,
    /// Shadow rays from the hits of primary rays towards the map, importance sampled.
    Shadow,
    /// From the hits of primary rays, cosine-distributed as a diffuse surface reflects.
    Diffuse,
}

impl RayKind {
    /// In the order of measurement.
    pub const ALL: [Self; 3] = [Self::Primary, Self::Shadow, Self::Diffuse];

    fn question(self) -> Question {
        if self == Self::Shadow { Question::Transmittance } else { Question::ClosestHit }
    }
}

/// Speed of a kind of ray.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RayFigures {
    /// The kind.
    pub kind: RayKind,
    /// Number of different rays.
    pub count: usize,
    /// Rays per second.
    pub per_second: f64,
}

/// For each ray the distance and triangle of its hit, or its transmittance and 0.
pub(super) type Answers = Vec<(f32, u32)>;

/// Each kind of ray is traced repeatedly for this many seconds.
const SECONDS: f64 = 0.3;
/// Maximum number of rays of a kind: enough to fill any device.
const MAX_RAYS: u32 = 1 << 21;
/// Side in pixels of the squares in which primary rays are ordered, as kernels order them.
const TILE: u32 = 8;

/// Measures each kind of ray; also returns the hits of the diffuse ones.
pub(super) fn measure(
    place: &Place<'_>,
    uploaded: Option<&UploadedScene>,
) -> Result<(Vec<RayFigures>, Answers)> {
    let world = &place.subject.world;
    // Kernels without environment sampling.
    let view = View { sampling: Sampling::Bsdf, ..place.view((TILE, TILE)) };
    let lit = place.lit();
    let mut caster = uploaded.map(|uploaded| Caster::new(uploaded, lit, &view)).transpose()?;
    let mut figures = Vec::new();
    let mut hits = Vec::new();
    let primary = primary(place);
    for kind in RayKind::ALL {
        let rays = match kind {
            RayKind::Primary => primary.clone(),
            RayKind::Shadow => towards_map(place, &primary),
            RayKind::Diffuse => onward(world, &primary, |_, frame, u| Some(spread(frame, u))),
        };
        if rays.is_empty() {
            continue;
        }
        let (mut seconds, mut rounds, mut found) = (0.0, 0, Vec::new());
        if let Some(caster) = &mut caster {
            caster.put_rays(&rays)?;
            // The first cast compiles, and finds how many rays fit into a dispatch.
            caster.cast(kind.question(), rays.len() as u32)?;
            found = caster.cast_results(rays.len())?;
        }
        while seconds < SECONDS {
            if place.is_cancelled() {
                return Err(Error::new("cancelled"));
            }
            if let Some(caster) = &mut caster {
                seconds += caster.cast(kind.question(), rays.len() as u32)?;
            } else {
                let start = Instant::now();
                found = on_cpu(world, kind.question(), &rays);
                seconds += start.elapsed().as_secs_f64();
            }
            rounds += 1;
        }
        let per_second = rays.len() as f64 * f64::from(rounds) / seconds;
        figures.push(RayFigures { kind, count: rays.len(), per_second });
        if kind == RayKind::Diffuse {
            hits = found;
        }
    }
    Ok((figures, hits))
}

fn on_cpu(world: &World, question: Question, rays: &[Ray]) -> Answers {
    let answer = |ray: &Ray| match question {
        Question::ClosestHit => {
            world.closest_hit(ray, false).map_or((f32::MAX, u32::MAX), |hit| (hit.t, hit.triangle))
        }
        Question::Transmittance => (world.transmittance(ray).max_element(), 0),
    };
    rays.par_iter().map(answer).collect()
}

/// A ray through the middle of each pixel, square after square.
fn primary(place: &Place<'_>) -> Vec<Ray> {
    let view = place.view(place.options.size);
    let camera = CameraRays::new(&view.camera, view.width, view.height);
    let across = view.width.div_ceil(TILE);
    let tiles = across * view.height.div_ceil(TILE);
    let pixels = (0..tiles * TILE * TILE).map(|i| {
        let (tile, lane) = (i / (TILE * TILE), i % (TILE * TILE));
        UVec2::new(tile % across * TILE + lane % TILE, tile / across * TILE + lane / TILE)
    });
    let inside = pixels.filter(|pixel| pixel.x < view.width && pixel.y < view.height);
    let rays = inside.take(MAX_RAYS as usize);
    rays.map(|pixel| camera.ray(pixel.as_vec2() + 0.5, Vec2::ZERO)).collect()
}

/// Continues each ray from its hit in the direction that `direct` chooses. Arguments of `direct`: random bits,
/// the shading frame on the ray's side, and two random numbers.
fn onward(
    world: &World,
    rays: &[Ray],
    direct: impl Fn([u32; 2], Frame, [f32; 2]) -> Option<Vec3> + Sync,
) -> Vec<Ray> {
    let continued = |(index, ray): (usize, &Ray)| {
        let point = world.point(&world.closest_hit(ray, true)?, ray.direction);
        let mut sampler = Sampler::new(1, 0, index as u32);
        let direction = direct(sampler.next_pair_bits(), point.shading_frame, sampler.next_pair())?;
        let normal = point.geometric_normal;
        let is_above = normal.dot(direction) > 0.0;
        let origin = offset_origin(point.position, if is_above { normal } else { -normal });
        Some(Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY })
    };
    rays.par_iter().enumerate().filter_map(continued).collect()
}

/// A cosine-distributed direction.
fn spread(frame: Frame, u: [f32; 2]) -> Vec3 {
    let disk = disk_from_square(u.into());
    let height = (1.0 - disk.length_squared()).max(0.0).sqrt();
    frame.world_from_local(disk.extend(height)).normalize()
}

/// Shadow rays towards importance-sampled directions of the map that lie above the surface.
fn towards_map(place: &Place<'_>, rays: &[Ray]) -> Vec<Ray> {
    let environment = &place.subject.environment;
    let Some(distributions) = LightGrid::whole_map(environment.tile_energies()) else {
        return Vec::new();
    };
    onward(&place.subject.world, rays, |bits, frame, _| {
        let choice = distributions.sample(0, bits);
        let sample = environment.sample_in_tile(choice.tile, [choice.remainder, bits[1]])?;
        (frame.z.dot(sample.direction) > 0.0).then_some(sample.direction)
    })
}
