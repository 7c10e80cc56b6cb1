//! A scene made ready for rays: BVH, what may be passed through, and the lights inside it.

use glam::Vec3;

use std::sync::Arc;

use super::lights::{LightChoice, LocalLights};
use super::lit_targets::LitTargets;
use super::materials::{Passing, ReadyMaterial};
use super::ray_clock::RayClock;
use crate::bvh::{Bvh, Hit, Ray, Shared};
use crate::environment::Environment;
use crate::error::Decoded;
use crate::huge_pages::on_huge_pages;
use crate::memory;
use crate::scene::needs::{SceneFeatures, SceneNeeds};
use crate::scene::surface::{SurfacePoint, alpha_at};
use crate::scene::{AlphaMode, Material, PunctualKind, PunctualLight, Scene, TextureImage};

/// A scene and the map that lights it.
pub type Lit<'a> = (&'a World, &'a Environment);

/// Everything about the scene that paths ask for.
pub struct World {
    /// The scene.
    pub scene: Scene,
    /// What it needs.
    pub needs: SceneNeeds,
    /// Its triangles, sorted in space.
    pub bvh: Bvh,
    /// Emissive triangles and punctual lights.
    pub lights: LocalLights,
    /// What paths may aim at.
    pub(crate) targets: LitTargets,
    materials: Vec<ReadyMaterial>,
    /// The same one in all worlds of the same geometry.
    pub(crate) geometry: Arc<()>,
    clock: Option<RayClock>,
}

impl World {
    /// Builds the BVH and the light tables.
    pub fn new(scene: Scene) -> Self {
        let scene = with_huge_pages(scene);
        let instances = scene.instances.for_tree();
        let shared = Shared { meshes: scene.instances.meshes(), instances: &instances };
        let bvh = Bvh::with_instances(&scene.positions, &scene.triangles, shared);
        Self::of_geometry(scene, bvh, Arc::default())
    }

    fn of_geometry(scene: Scene, bvh: Bvh, geometry: Arc<()>) -> Self {
        let materials = scene.materials.iter().map(ReadyMaterial::new).collect();
        let lights = LocalLights::new(&scene, bvh.bounds(), &LightChoice::All);
        let (needs, targets) = (SceneNeeds::of(&scene), LitTargets::default());
        Self { needs, scene, bvh, lights, targets, materials, geometry, clock: None }
    }

    /// The same scene with other materials, as many as it has, and other lights.
    ///
    /// # Errors
    /// If there is no memory for another copy of it: the cause.
    pub(crate) fn with_looks(
        &self,
        materials: Vec<Material>,
        lights: Vec<PunctualLight>,
    ) -> Decoded<Self> {
        memory::check(self.memory_bytes())?;
        let scene = with_huge_pages(Scene { materials, lights, ..self.scene.clone() });
        Ok(Self::of_geometry(scene, self.bvh.clone(), Arc::clone(&self.geometry)))
    }

    /// Whether rays meet the same in both worlds, and as much light gets through: they were made of one
    /// another, and only what surfaces scatter differs.
    pub(crate) fn has_same_visibility(&self, other: &Self) -> bool {
        let materials = self.scene.materials.iter().zip(&other.scene.materials);
        Arc::ptr_eq(&self.geometry, &other.geometry)
            && materials.into_iter().all(|(a, b)| a.lets_pass_like(b))
    }

    /// About what it holds: geometry, textures and tree.
    fn memory_bytes(&self) -> u64 {
        let scene = &self.scene;
        let texels: usize = scene.images.iter().map(|image| image.texels.bytes().len()).sum();
        let bytes = size_of_val(&scene.positions[..])
            + size_of_val(&scene.normals[..])
            + size_of_val(&scene.tangents[..])
            + scene.uvs.iter().map(|uvs| size_of_val(&uvs[..])).sum::<usize>()
            + size_of_val(&scene.colors[..])
            + size_of_val(&scene.triangles[..])
            + size_of_val(&scene.triangle_materials[..])
            + scene.instances.memory_bytes()
            + texels
            + self.bvh.memory_bytes();
        bytes as u64
    }

    /// About the largest radiance of the map and of lamps; 0 without any.
    pub(crate) fn brightest(&self, environment: &Environment) -> f32 {
        let map = environment.rotation_and_intensity().1 / environment.importance_scale;
        let map = if environment.is_black() { 0.0 } else { map };
        let emissive = self.scene.materials.iter().map(|material| material.emissive.max_element());
        let lights = self.scene.lights.iter().map(|light| light.intensity.max_element());
        emissive.chain(lights).fold(map, f32::max)
    }

    /// The same, and what lamps make of surfaces that are no nearer to them than this.
    pub(crate) fn brightest_lit(&self, environment: &Environment, nearest: f32) -> f32 {
        let irradiance = |light: &PunctualLight| {
            let is_distant = light.kind == PunctualKind::Directional;
            light.intensity.max_element() / if is_distant { 1.0 } else { nearest * nearest }
        };
        self.scene.lights.iter().map(irradiance).fold(self.brightest(environment), f32::max)
    }

    /// Times all rays from now on, which slows them down a little.
    pub fn start_ray_clock(&mut self) {
        self.clock = Some(RayClock::default());
    }

    /// Times no more; mean nanoseconds that a ray took of its thread's time. `None` without rays.
    pub fn stop_ray_clock(&mut self) -> Option<f64> {
        self.clock.take()?.nanoseconds_per_ray()
    }

    /// Nearest surface along a ray. A camera ray passes single-sided surfaces from behind.
    pub fn closest_hit(&self, ray: &Ray, from_camera: bool) -> Option<Hit> {
        let _running = self.clock.as_ref().map(RayClock::start);
        if from_camera && self.needs.has(SceneFeatures::SINGLE_SIDED) {
            self.bvh.closest_hit(ray, |hit| self.faces(hit, ray) && self.is_covered(hit))
        } else if self.needs.has(SceneFeatures::BACKED) {
            self.bvh.closest_hit(ray, |hit| !self.is_backed(hit, ray) && self.is_covered(hit))
        } else if self.needs.has(SceneFeatures::ALPHA_MASK) {
            self.bvh.closest_hit(ray, |hit| self.is_covered(hit))
        } else {
            self.bvh.closest_hit(ray, |_| true)
        }
    }

    /// Share of light that arrives along a shadow ray: zero if a surface scatters it all.
    pub fn transmittance(&self, ray: &Ray) -> Vec3 {
        let _running = self.clock.as_ref().map(RayClock::start);
        if self.needs.features.pass_through() {
            return self.transmittance_but_for(ray, |_| false);
        }
        if self.bvh.any_hit(ray, |_| true) { Vec3::ZERO } else { Vec3::ONE }
    }

    /// The same as if there were no smooth solid glass, and whether there is any.
    pub(crate) fn transmittance_but_for_glass(&self, ray: &Ray) -> (Vec3, bool) {
        let _running = self.clock.as_ref().map(RayClock::start);
        let mut meets_glass = false;
        let transmittance = self.transmittance_but_for(ray, |passing| {
            meets_glass |= passing.clear;
            passing.clear
        });
        (transmittance, meets_glass)
    }

    /// The same as if surfaces that `skips` names were not there.
    #[inline(always)]
    fn transmittance_but_for(&self, ray: &Ray, mut skips: impl FnMut(&Passing) -> bool) -> Vec3 {
        let mut transmittance = Vec3::ONE;
        let blocked = self.bvh.any_hit(ray, |hit| {
            let passing = &self.material_of(hit).passing;
            if skips(passing) || self.is_backed(hit, ray) {
                return false;
            }
            if !passing.partial {
                return self.is_covered(hit);
            }
            transmittance *= self.straight_through(&self.point(hit, ray.direction), ray.direction);
            transmittance.max_element() <= 0.0
        });
        if blocked { Vec3::ZERO } else { transmittance }
    }

    /// The surface that a ray along `direction` has hit.
    #[inline(always)]
    pub fn point(&self, hit: &Hit, direction: Vec3) -> SurfacePoint<'_> {
        let shared = &self.material_of(hit).shared;
        SurfacePoint::with_shared(&self.scene, shared, hit.triangle, hit.barycentric, direction)
    }

    /// Share of light that goes straight through a surface: what alpha does not cover, and what
    /// smooth thin glass transmits.
    pub fn straight_through(&self, point: &SurfacePoint<'_>, direction: Vec3) -> Vec3 {
        let material = self.material(point.material);
        if !material.passing.partial {
            return Vec3::ZERO;
        }
        let glass = if point.parameters.transmission > 0.0 {
            let wo = point.shading_frame.local_from_world(-direction);
            material.bsdf(point).straight_transmittance(wo)
        } else {
            Vec3::ZERO
        };
        let coverage = self.coverage(point);
        Vec3::splat(1.0 - coverage) + coverage * glass
    }

    /// Opacity of a surface point in `[0,1]`; 1 unless its material is blended.
    pub fn coverage(&self, point: &SurfacePoint<'_>) -> f32 {
        match self.scene.materials[point.material as usize].alpha_mode {
            AlphaMode::Blend => point.parameters.alpha.clamp(0.0, 1.0),
            AlphaMode::Opaque | AlphaMode::Mask { .. } => 1.0,
        }
    }

    /// Whether part of the light may go straight through surfaces of a material.
    pub(crate) fn may_pass_light(&self, material: usize) -> bool {
        self.materials[material].passing.partial
    }

    pub(super) fn material(&self, index: u32) -> &ReadyMaterial {
        &self.materials[index as usize]
    }

    fn material_of(&self, hit: &Hit) -> &ReadyMaterial {
        self.material(self.scene.material_of(hit.triangle))
    }

    fn is_covered(&self, hit: &Hit) -> bool {
        if !self.material_of(hit).passing.masked {
            return true;
        }
        let material = self.scene.material_of(hit.triangle);
        let alpha_mode = self.scene.materials[material as usize].alpha_mode;
        let AlphaMode::Mask { cutoff } = alpha_mode else { return true };
        alpha_at(&self.scene, hit.triangle, hit.barycentric) >= cutoff
    }

    /// Whether a ray comes from where another surface of the same place is met.
    fn is_backed(&self, hit: &Hit, ray: &Ray) -> bool {
        self.material_of(hit).passing.backed && !self.faces(hit, ray)
    }

    fn faces(&self, hit: &Hit, ray: &Ray) -> bool {
        if !self.material_of(hit).passing.single_sided {
            return true;
        }
        let [a, b, c] = self.scene.corners(hit.triangle);
        (b - a).cross(c - a).dot(ray.direction) <= 0.0
    }
}

/// The scene with its large arrays where rays, which hit here and there, find them soonest.
fn with_huge_pages(scene: Scene) -> Scene {
    let texels_too =
        |image: TextureImage| TextureImage { texels: image.texels.moved(on_huge_pages), ..image };
    Scene {
        positions: on_huge_pages(scene.positions),
        normals: on_huge_pages(scene.normals),
        tangents: on_huge_pages(scene.tangents),
        uvs: scene.uvs.map(on_huge_pages),
        colors: on_huge_pages(scene.colors),
        triangles: on_huge_pages(scene.triangles),
        triangle_materials: on_huge_pages(scene.triangle_materials),
        images: scene.images.into_iter().map(texels_too).collect(),
        ..scene
    }
}
