//! What the light of one pixel is made of, and which part of it has the noise.

use glam::Vec2;
use rayon::prelude::*;

use super::view::View;
use crate::color::luminance;
use crate::light_grid::LightGrid;
use crate::path::{Lit, PathLimits, PathTracer};
use crate::sampler::Sampler;

/// Paths traced for a pixel.
const PATHS: u32 = 4096;
/// Keeps their random numbers apart from others.
const SEED: u32 = 0x7061_7274;

/// How light comes to a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LightPart {
    /// From the map or a lamp that the camera sees, in mirrors and through glass, too.
    Seen,
    /// From the map by way of the first surface that scatters it.
    MapDirect,
    /// From lamps by way of that surface.
    LampsDirect,
    /// From the map by way of several surfaces.
    MapReflected,
    /// From lamps by way of several surfaces.
    LampsReflected,
}

impl LightPart {
    /// All of them.
    pub(crate) const ALL: [Self; 5] =
        [Self::Seen, Self::MapDirect, Self::LampsDirect, Self::MapReflected, Self::LampsReflected];
}

/// Parts of a pixel's light, in the order of [`LightPart::ALL`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LightParts {
    /// Mean luminance of each.
    pub(crate) luminance: [f64; 5],
    /// Share of each in the variance of paths: its covariance with the whole over the whole's variance. They add up to
    /// 1, or are 0 where paths do not differ.
    pub(crate) noise: [f64; 5],
    /// Standard deviation of one path's luminance over its mean; 0 for a black pixel.
    pub(crate) spread: f64,
}

impl LightParts {
    /// Traces paths of their own from random points of the pixel at `place`, both coordinates in `[0,1]`, as exact
    /// samples are traced. Each path is traced with no bounce, with one and with all, and again by lamps alone, always
    /// by the same random numbers: the differences are its parts.
    pub(crate) fn measure(
        lit: Lit<'_>,
        view: &View,
        grid: Option<&LightGrid>,
        place: Vec2,
    ) -> Self {
        let (world, environment) = lit;
        let mut black = environment.clone();
        black.set_intensity(0.0);
        let has_lamps = !world.lights.is_empty();
        let rays = view.rays();
        let size = Vec2::new(view.width as f32, view.height as f32);
        let pixel = (place * size).floor().min(size - 1.0);
        let bounces = [0, 1, view.limits.bounces].map(|bounces| bounces.min(view.limits.bounces));
        let [by_all, by_lamps] = [environment, &black].map(|environment| {
            let tracer = view.tracer((world, environment), grid);
            let limits = bounces.map(|bounces| PathLimits { bounces, ..view.limits });
            limits.map(|limits| PathTracer { layers: false, limits, ..tracer })
        });
        let of_path = |path: u32| {
            let mut camera = Sampler::new(SEED, 0, path);
            let [in_pixel, in_lens] = [(); 2].map(|()| Vec2::from(camera.next_pair()));
            let ray = rays.ray(pixel + in_pixel, in_lens);
            let found = |tracer: &PathTracer<'_>| {
                f64::from(luminance(tracer.radiance(ray, Sampler::new(SEED, 1, path)).radiance))
            };
            let all = by_all.each_ref().map(found);
            let lamps = if has_lamps { by_lamps.each_ref().map(found) } else { [0.0; 3] };
            let [direct, reflected] = [1, 2].map(|i| all[i] - all[i - 1]);
            let [direct_lamps, reflected_lamps] = [1, 2].map(|i| lamps[i] - lamps[i - 1]);
            let (direct_map, reflected_map) = (direct - direct_lamps, reflected - reflected_lamps);
            [all[0], direct_map, direct_lamps, reflected_map, reflected_lamps]
        };
        let paths: Vec<[f64; 5]> = (0..PATHS).into_par_iter().map(of_path).collect();
        Self::of_paths(&paths)
    }

    /// Of the parts that each path has found.
    fn of_paths(paths: &[[f64; 5]]) -> Self {
        let count = paths.len() as f64;
        let parts = [0, 1, 2, 3, 4];
        let luminance = parts.map(|part| paths.iter().map(|path| path[part]).sum::<f64>() / count);
        let mean: f64 = luminance.iter().sum();
        let off = |path: &[f64; 5]| path.iter().sum::<f64>() - mean;
        let covariances = parts.map(|part| {
            paths.iter().map(|path| (path[part] - luminance[part]) * off(path)).sum::<f64>() / count
        });
        let variance: f64 = covariances.iter().sum();
        let noise = covariances.map(|part| if variance > 0.0 { part / variance } else { 0.0 });
        let spread = if mean > 0.0 { variance.max(0.0).sqrt() / mean } else { 0.0 };
        Self { luminance, noise, spread }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::environment::{Environment, EnvironmentOptions};
    use crate::image::Image;
    use crate::path::{World, WorldBuilder};
    use crate::scene::{Camera, Material};

    fn measured(world: &World, eye: Vec3, target: Vec3) -> LightParts {
        let map = Image::filled(8, 4, [2.0; 3]);
        let map = Environment::new(map, &EnvironmentOptions::default()).expect("a sound map");
        let limits = PathLimits { bounces: 64, ..PathLimits::default() };
        let view = View { limits, ..View::new(Camera::look_at(eye, target, 0.1), [9, 9]) };
        let grid = LightGrid::whole_map(map.tile_energies());
        LightParts::measure((world, &map), &view, grid.as_ref(), Vec2::splat(0.5))
    }

    fn assert_near(parts: &LightParts, expected: [f64; 5]) {
        for (found, expected) in parts.luminance.iter().zip(expected) {
            assert!((found - expected).abs() < 0.03 * expected.max(0.1), "{parts:?}");
        }
    }

    #[test]
    fn parts_of_known_light_are_found() {
        let [low, high] = [-Vec3::ONE, Vec3::ONE];
        // A floor of albedo 0.5 under a map of radiance 2: direct light of 1. Nothing else is near.
        let floor = WorldBuilder::default().faces(&Material::lambert(0.5), low, high, [3]).build();
        let parts = measured(&floor, Vec3::Y, Vec3::new(0.1, -1.0, 0.0));
        assert_near(&parts, [0.0, 1.0, 0.0, 0.0, 0.0]);
        // A closed room of albedo 0.5 that emits 1: 1 is seen, 0.5 reflected once, 0.5 more often.
        let lamp = Material { emissive: Vec3::ONE, ..Material::lambert(0.5) };
        let room = WorldBuilder::default().faces(&lamp, low, high, 0..6).build();
        let parts = measured(&room, Vec3::ZERO, Vec3::X);
        assert_near(&parts, [1.0, 0.0, 0.5, 0.0, 0.5]);
        assert!(parts.noise[0].abs() < 1e-6, "what is seen is the same for all paths: {parts:?}");
    }

    #[test]
    fn shares_of_noise_add_up_and_go_to_what_varies() {
        // The second part varies alone, the third with the whole.
        let paths = [[1.0, 0.0, 0.0, 0.0, 0.0], [1.0, 4.0, 1.0, 0.0, 0.0]];
        let LightParts { luminance, noise, spread } = LightParts::of_paths(&paths);
        assert_eq!(luminance, [1.0, 2.0, 0.5, 0.0, 0.0]);
        assert_eq!(noise, [0.0, 0.8, 0.2, 0.0, 0.0]);
        // Of 1 and 6.
        assert_eq!(spread, 2.5 / 3.5);
        assert_eq!(LightParts::of_paths(&paths[..1]).noise, [0.0; 5]);
    }
}
