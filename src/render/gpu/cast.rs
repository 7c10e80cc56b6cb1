//! Rays alone on the device, without paths: what one walk of the tree takes.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::dispatcher::Dispatcher;
use super::kernel::Kernel;
use super::layout::Work;
use super::progress::{GROUP, MAX_GROUPS};
use super::uploaded_scene::UploadedScene;
use crate::bvh::Ray;
use crate::error::Result;
use crate::path::Lit;
use crate::render::View;
use crate::render::gpu_facts::Question;

/// Twin of `CastRay` in `cast.wgsl`.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(super) struct CastRay {
    pub(super) origin: Vec3,
    pub(super) t_max: f32,
    pub(super) direction: Vec3,
    pub(super) padding: u32,
}

impl Question {
    fn kernel(self) -> Kernel {
        if self == Self::ClosestHit { Kernel::ClosestHits } else { Kernel::ShadowRays }
    }
}

/// Traces rays alone on the device.
pub(crate) struct Caster(Dispatcher);

impl Caster {
    /// For what is uploaded. The view says which lights its kernels have; they are compiled when they are needed.
    ///
    /// # Errors
    /// If something does not fit on the device, with the numbers.
    pub(crate) fn new(uploaded: &UploadedScene, lit: Lit<'_>, view: &View) -> Result<Self> {
        Dispatcher::new(uploaded, lit, view, view.chosen_lights(lit.0).as_ref()).map(Self)
    }

    /// Uploads rays to be traced; they begin where they say, whatever their `t_min`.
    pub(crate) fn put_rays(&mut self, rays: &[Ray]) -> Result<()> {
        let cast = |&Ray { origin, direction, t_max, .. }: &Ray| CastRay {
            origin,
            t_max: t_max.min(f32::MAX),
            direction,
            padding: 0,
        };
        let rays: Vec<CastRay> = rays.iter().map(cast).collect();
        self.0.buffers.put("cast_rays", bytemuck::cast_slice(&rays), "the list of rays")?;
        self.0.buffers.make("cast_results", 8 * rays.len() as u64, "the list of hits")
    }

    /// Traces the first `count` of the uploaded rays; returns the seconds that took on the device.
    pub(crate) fn cast(&mut self, question: Question, count: u32) -> Result<f64> {
        let kernel = question.kernel();
        self.0.settle()?;
        let before = self.0.flights.figures.device_seconds;
        let mut first = 0;
        while first < count {
            let groups = self.0.flights.units(kernel).min(MAX_GROUPS);
            let groups = groups.min(u64::from(count - first).div_ceil(GROUP)) as u32;
            let work = Work { first, count, ..Work::default() };
            self.0.dispatch(&[kernel], &work, (1, groups), u64::from(groups), None)?;
            first += groups * GROUP as u32;
        }
        self.0.settle()?;
        Ok(self.0.flights.figures.device_seconds - before)
    }

    /// What came of each of the first `count` rays: the distance (`f32::MAX` without a hit) and the
    /// triangle, or the share of light in `[0,1]` and nothing.
    pub(crate) fn cast_results(&self, count: usize) -> Result<Vec<(f32, u32)>> {
        let words = self.0.read_words("cast_results", 2 * count)?;
        Ok(words.as_chunks().0.iter().map(|&[x, i]| (f32::from_bits(x), i)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Gpu, RayChoice};
    use super::*;
    use crate::environment::{Environment, EnvironmentOptions};
    use crate::path::World;
    use crate::render::Sampling;
    use crate::render::gpu::parity::fixture;
    use crate::sampler::Sampler;
    use crate::scene::{Scene, builtin};

    /// Rays from anywhere in a scene to anywhere.
    fn rays(world: &World, count: u32) -> Vec<Ray> {
        let (low, high) = world.bvh.bounds();
        let ray = |index| {
            let mut sampler = Sampler::new(3, 1, index);
            let [[x, y], [z, a], [b, _]] = std::array::from_fn(|_| sampler.next_pair());
            let direction = Vec3::new((6.3 * a).cos(), 2.0 * b - 1.0, (6.3 * a).sin());
            let origin = low + (high - low) * Vec3::new(x, y, z);
            Ray { origin, direction: direction.normalize(), t_min: 0.0, t_max: f32::INFINITY }
        };
        (0..count).map(ray).collect()
    }

    /// The same with a back behind each face.
    fn paired(mut scene: Scene) -> Scene {
        scene.materials.iter_mut().for_each(|material| material.double_sided = false);
        let backs: Vec<_> = scene.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
        scene.triangles.extend(backs);
        scene.triangle_materials.extend_from_within(..);
        scene.pair_backs();
        scene
    }

    /// The share of rays of which the device finds another nearest triangle, and of those that it lets
    /// another share of light through.
    fn apart(gpu: &Gpu, world: &World, rays: &[Ray]) -> [f64; 2] {
        let map = crate::environment::sky::build("overcast", 64, 32).expect("a sky");
        let environment = Environment::new(map, &EnvironmentOptions::default()).expect("sound");
        let view = fixture::view_of(world, Sampling::Bsdf);
        let uploaded = UploadedScene::new(gpu, world, &environment).expect("it fits");
        let caster = Caster::new(&uploaded, (world, &environment), &view);
        let mut caster = caster.expect("it fits");
        caster.put_rays(rays).expect("they fit");
        [Question::ClosestHit, Question::Transmittance].map(|question| {
            caster.cast(question, rays.len() as u32).expect("it runs");
            let found = caster.cast_results(rays.len()).expect("they can be read");
            let differs = |(ray, (number, triangle)): (&Ray, (f32, u32))| match question {
                Question::ClosestHit => {
                    let hit = world.closest_hit(ray, false);
                    hit.map_or(u32::MAX, |hit| hit.triangle) != triangle
                }
                Question::Transmittance => {
                    (world.transmittance(ray).max_element() - number).abs() > 1e-3
                }
            };
            rays.iter().zip(found).filter(|pair| differs(*pair)).count() as f64 / rays.len() as f64
        })
    }

    /// Panes, leaves cut out of textures and ten thousands of triangles; the same in instances.
    #[test]
    fn a_device_hits_what_the_cpu_hits() {
        let Some(gpu) = Gpu::for_test() else { return };
        for choice in [RayChoice::Software, RayChoice::Hardware] {
            let gpu = match gpu.clone().with_rays(choice) {
                Ok(gpu) => gpu,
                Err(reason) => {
                    eprintln!("SKIPPED: {reason}");
                    continue;
                }
            };
            let scene = |name: &str| builtin::build(name).expect("built in");
            for (name, scene) in [
                ("living-room", scene("living-room")),
                ("exterior", scene("exterior")),
                ("crack", scene("crack")),
                ("instances", fixture::instanced(scene("living-room"))),
                ("pairs", paired(scene("living-room"))),
            ] {
                let world = World::new(scene);
                let [hits, shares] = apart(&gpu, &world, &rays(&world, 50_000));
                eprintln!("{name}, {choice:?}: {hits:e} of hits and {shares:e} of shares differ");
                // Rays along edges, and surfaces that lie in each other: 1e-4 on an H200.
                assert!(hits < 3e-4 && shares < 2e-4, "{name}, {choice:?}: {hits} {shares}");
            }
        }
    }
}
