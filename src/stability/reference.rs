//! A reference in f64: direct light on an infinite Lambert floor, from the renderer's random numbers.
//!
//! A twin of the path tracer for one simple scene. Densities come from the map's own weights and not from the
//! table; only the choice of tile and texel, which is exact in integers, uses the table.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3, Vec3};

use super::maps::bilinear;
use crate::color::importance;
use crate::environment::Environment;
use crate::light_grid::{LightGrid, WHOLE_MAP};
use crate::path::camera::CameraRays;
use crate::render::View;
use crate::sampler::Sampler;

/// A floor at height 0 of this reflectance under a map that is neither turned nor scaled.
pub(super) struct FloorReference<'a> {
    pub(super) environment: &'a Environment,
    pub(super) grid: LightGrid,
    pub(super) albedo: f64,
    /// Integral of the map's importance.
    energy: f64,
}

impl<'a> FloorReference<'a> {
    /// `None` for a black map.
    pub(super) fn new(environment: &'a Environment, albedo: f64) -> Option<Self> {
        let grid = LightGrid::whole_map(environment.tile_energies())?;
        Some(Self { environment, grid, albedo, energy: environment.tile_energies().iter().sum() })
    }

    /// Mean luminance of each pixel over its first `samples` samples.
    pub(super) fn picture(&self, view: &View, samples: u32) -> Vec<f64> {
        let rays = CameraRays::new(&view.camera, view.width, view.height);
        let pixel = |index: u32| {
            let sum: f64 = (0..samples)
                .map(|sample| {
                    let place = [index % view.width, index / view.width];
                    let mut sampler = Sampler::of_pixel(view.seed, place, sample);
                    let offset = sampler.next_pair().map(f64::from);
                    let at = DVec2::from(place.map(f64::from)) + DVec2::from(offset);
                    self.radiance(direction(&rays, view, at), sampler)
                })
                .sum();
            sum / f64::from(samples)
        };
        (0..view.width * view.height).map(pixel).collect()
    }

    /// Luminance along a camera ray: light sampling and BSDF sampling by the balance heuristic.
    fn radiance(&self, towards: DVec3, mut sampler: Sampler) -> f64 {
        if towards.y >= 0.0 {
            return self.seen(towards);
        }
        let bits = sampler.next_pair_bits();
        let choice = self.grid.sample(WHOLE_MAP, bits);
        let u = [choice.remainder, bits[1]];
        let mut sum = 0.0;
        if let Some(sample) = self.environment.sample_in_tile(choice.tile, u) {
            let light = sample.direction.as_dvec3().normalize();
            let bsdf_pdf = light.y / PI;
            if light.y > 0.0 {
                sum += self.albedo * bsdf_pdf * self.seen(light) / (self.density(light) + bsdf_pdf);
            }
        }
        let _lobe = sampler.next_pair();
        let [x, y] = sampler.next_pair().map(f64::from);
        let (sin, cos) = (x * TAU).sin_cos();
        // The frame around +Y has its second axis along -Z.
        let bounced = DVec3::new(y.sqrt() * cos, (1.0 - y).sqrt(), -y.sqrt() * sin);
        let bsdf_pdf = bounced.y / PI;
        sum + self.albedo * self.seen(bounced) * bsdf_pdf / (bsdf_pdf + self.density(bounced))
    }

    fn rgb(&self, direction: DVec3) -> DVec3 {
        let map = self.environment.map();
        let u = 0.5 + direction.z.atan2(direction.x) / TAU;
        let v = direction.x.hypot(direction.z).atan2(direction.y) / PI;
        bilinear(map, u * f64::from(map.width) - 0.5, v * f64::from(map.height) - 0.5)
    }

    fn seen(&self, direction: DVec3) -> f64 {
        self.rgb(direction).dot(DVec3::new(0.2126, 0.7152, 0.0722))
    }

    /// Density of light sampling per steradian.
    fn density(&self, direction: DVec3) -> f64 {
        let rgb = self.rgb(direction);
        let importance_of = |axis: Vec3| f64::from(importance(axis));
        rgb.dot(DVec3::from([Vec3::X, Vec3::Y, Vec3::Z].map(importance_of))) / self.energy
    }
}

/// Unit direction through a point of the picture in pixels.
fn direction(rays: &CameraRays, view: &View, at: DVec2) -> DVec3 {
    let ndc = at / DVec2::new(f64::from(view.width), f64::from(view.height)) * 2.0 - 1.0;
    let extent = rays.half_extent.as_dvec2();
    let across = rays.right.as_dvec3() * (ndc.x * extent.x);
    (rays.forward.as_dvec3() + across - rays.up.as_dvec3() * (ndc.y * extent.y)).normalize()
}
