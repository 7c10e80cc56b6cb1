//! Light sources inside the scene: emissive triangles and punctual lights.

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::aim_targets::Aiming;
use super::light_tree::{Light, LightTree, Moments, Receiver};
use super::triangles::{area_to_solid_angle, facing, point_on, relate, solid_angle_pdf};
use crate::bsdf;
use crate::bvh::Hit;
use crate::color::importance;
use crate::scene::needs::is_emitter;
use crate::scene::surface::SurfacePoint;
use crate::scene::{Material, PunctualKind, PunctualLight, Scene};

/// A sampled point on a light, seen from a shading point.
#[derive(Debug, Clone, Copy)]
pub struct LightSample {
    /// Unit direction to the light.
    pub direction: Vec3,
    /// Metres to the light; infinite for directional lights.
    pub distance: f32,
    /// Radiance over its density in solid angle, or, for a light without size, irradiance on a
    /// facing plane over its probability.
    pub radiance_over_pdf: Vec3,
    /// Density in solid angle; infinite for a light without size.
    pub pdf_solid_angle: f32,
}

/// All local lights. Which of them is sampled depends on the place that is lit: on the lights'
/// intensities, distances and directions.
#[derive(Debug, Clone, Default)]
pub struct LocalLights {
    /// Emissive triangles, ascending: the first lights. Punctual ones follow in the scene's order.
    pub(crate) triangles: Vec<u32>,
    /// Point, spot and directional lights as they count.
    pub(crate) punctual: Vec<PunctualLight>,
    /// How lights are chosen.
    pub(crate) tree: LightTree,
    /// How paths aim at surfaces beside them; `None` where that gains nothing.
    pub(crate) aiming: Option<Aiming>,
    /// Factors on what materials emit, by their numbers; empty where all are 1.
    pub(crate) emission: Vec<f32>,
}

/// Which lights inside a scene count, and how much.
#[derive(Debug, Clone, Default, PartialEq)]
pub enum LightChoice {
    /// All as they are.
    #[default]
    All,
    /// Some.
    Some {
        /// Factors on point, spot and directional lights, and on what materials emit, by their names.
        lamps: Arc<BTreeMap<String, f32>>,
        /// Whether other materials that emit light count; other lights do not.
        surfaces: bool,
    },
}

impl LightChoice {
    /// Factors on what materials emit; none where all are 1.
    fn emission(&self, materials: &[Material]) -> Vec<f32> {
        let Self::Some { lamps, surfaces } = self else { return Vec::new() };
        let of_others = if *surfaces { 1.0 } else { 0.0 };
        let of_one = |material: &Material| lamps.get(&material.name).copied().unwrap_or(of_others);
        materials.iter().map(of_one).collect()
    }

    /// A light as it counts.
    fn applied(&self, light: &PunctualLight) -> PunctualLight {
        let factor = match self {
            Self::All => 1.0,
            Self::Some { lamps, .. } => lamps.get(&light.name).copied().unwrap_or(0.0),
        };
        PunctualLight { intensity: light.intensity * factor, ..light.clone() }
    }
}

impl LocalLights {
    /// Collects the chosen lights of a scene with bounds `(min, max)`.
    pub fn new(scene: &Scene, bounds: (Vec3, Vec3), choice: &LightChoice) -> Self {
        let empty = Self { emission: choice.emission(&scene.materials), ..Self::default() };
        let emits: Vec<bool> = scene.materials.iter().map(is_emitter).collect();
        let mut triangles = Vec::new();
        let mut lights = Vec::new();
        let mut distant = Vec::new();
        let mut total = 0.0;
        // Instances share no lamps: the tree of lights holds places in the world.
        for triangle in scene.own_triangles() {
            let material = scene.triangle_materials[triangle as usize];
            let factor = empty.emission_of(material);
            if emits[material as usize]
                && let Some((moments, power)) = triangle_moments(scene, triangle, factor)
            {
                lights.push(Light { index: triangles.len() as u32, moments });
                triangles.push(triangle);
                total += power;
            }
        }
        let radius = 0.5 * (bounds.1 - bounds.0).length();
        let punctual: Vec<_> = scene.lights.iter().map(|light| choice.applied(light)).collect();
        for (index, light) in (triangles.len() as u32..).zip(&punctual) {
            let power = punctual_power(light, radius);
            if power <= 0.0 {
                continue;
            }
            if light.kind == PunctualKind::Directional {
                distant.push((index, power));
            } else {
                lights.push(Light { index, moments: punctual_moments(light) });
                total += power;
            }
        }
        let everything = total + distant.iter().map(|(_, power)| power).sum::<f64>();
        if !(everything > 0.0 && everything.is_finite()) {
            return Self { punctual, ..empty };
        }
        relate(&mut lights);
        let tree = LightTree::new(lights, total, &distant, triangles.len());
        Self { triangles, punctual, tree, ..empty }
    }

    /// Whether there is nothing to sample.
    pub fn is_empty(&self) -> bool {
        self.tree.is_empty()
    }

    /// Number of emissive triangles.
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Samples a light as seen from a place. `None` where it does not shine that way. `point_at` knows the surface
    /// that a ray along a direction has hit.
    pub fn sample<'a>(
        &self,
        scene: &'a Scene,
        receiver: &Receiver,
        bits: [u32; 2],
        point_at: impl FnOnce(&Hit, Vec3) -> SurfacePoint<'a>,
    ) -> Option<LightSample> {
        let choice = self.tree.sample(receiver, bits[0]);
        let probability = choice.probability;
        let Some(&triangle) = self.triangles.get(choice.light as usize) else {
            let light = &self.punctual[choice.light as usize - self.triangles.len()];
            return sample_punctual(light, receiver.position, probability);
        };
        let corners = scene.corners(triangle);
        let (target, barycentric) = point_on(&corners, choice.remainder, bits[1]);
        let to_light = target - receiver.position;
        let distance = to_light.length();
        let direction = to_light / distance;
        let pdf_solid_angle =
            probability * area_to_solid_angle(&corners, direction, distance * distance)?;
        let point = point_at(&Hit { t: distance, triangle, barycentric }, direction);
        let radiance = self.emitted(scene, &point, -direction);
        let radiance_over_pdf = radiance / pdf_solid_angle;
        let sample = LightSample { direction, distance, radiance_over_pdf, pdf_solid_angle };
        (radiance.max_element() > 0.0).then_some(sample)
    }

    /// Factor on what a material emits.
    pub(super) fn emission_of(&self, material: u32) -> f32 {
        self.emission.get(material as usize).copied().unwrap_or(1.0)
    }

    /// Radiance a surface point sends towards its viewer: as much as alpha covers it, and its coat lets through.
    pub(super) fn emitted(&self, scene: &Scene, point: &SurfacePoint<'_>, to_viewer: Vec3) -> Vec3 {
        let parameters = &point.parameters;
        let is_seen = point.front_face || scene.materials[point.material as usize].double_sided;
        if parameters.unlit || !is_seen {
            return Vec3::ZERO;
        }
        let emitted = parameters.emissive * parameters.alpha * self.emission_of(point.material);
        if parameters.clearcoat == 0.0 {
            return emitted;
        }
        let wo = point.shading_frame.local_from_world(to_viewer);
        emitted * bsdf::left_by_coat(parameters, point.front_face, wo)
    }

    /// Pdf in solid angle of [`Self::sample`] for the point of `triangle` at the end of `way`: a unit direction and a
    /// distance in metres from the receiver. 0 if the triangle is not a light.
    pub fn sample_pdf_solid_angle(
        &self,
        scene: &Scene,
        triangle: u32,
        receiver: &Receiver,
        way: (Vec3, f32),
    ) -> f32 {
        solid_angle_pdf((&self.triangles, &self.tree), scene, triangle, receiver, way)
    }
}

/// Moments and power of an emissive triangle whose light has this factor; `None` if nothing comes from it.
fn triangle_moments(scene: &Scene, triangle: u32, factor: f32) -> Option<(Moments, f64)> {
    let corners = scene.corners(triangle);
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    let area = 0.5 * normal.length();
    let material = &scene.materials[scene.triangle_materials[triangle as usize] as usize];
    // A textured emitter is probed at a few points; the factor's own share keeps it reachable where
    // all of them are dark.
    let probes = [(1.0 / 3.0, 1.0 / 3.0), (0.1, 0.1), (0.8, 0.1), (0.1, 0.8)];
    let probe = |&(b1, b2): &(f32, f32)| {
        let point = SurfacePoint::at(scene, triangle, Vec2::new(b1, b2), -normal);
        importance(point.parameters.emissive)
    };
    let probed = probes.iter().map(probe).sum::<f32>() / probes.len() as f32;
    let mean = factor * (probed + 0.02 * importance(material.emissive));
    let intensity = (area * mean).min(f32::MAX);
    let place = facing(&corners, intensity);
    // What shines on both sides shines half as much in a mean direction as along its normal.
    let (moments, sides) = if material.double_sided {
        (Moments { axis: Vec3::ZERO, aimed: 0.0, around: 0.5, ..place }, 2.0)
    } else {
        (place, 1.0)
    };
    let power = PI * sides * f64::from(intensity);
    (power > 0.0).then_some((moments, power))
}

/// Moments of a point or spot light. A spot counts as a surface that faces its way, which shines
/// about there.
fn punctual_moments(light: &PunctualLight) -> Moments {
    let (axis, aimed, around) = match light.kind {
        PunctualKind::Spot { .. } => (light.direction, 1.0, 0.0),
        PunctualKind::Point | PunctualKind::Directional => (Vec3::ZERO, 0.0, 1.0),
    };
    let intensity = importance(light.intensity).min(f32::MAX);
    Moments { intensity, center: light.position, variance: 0.0, axis, aimed, around }
}

/// In f64: the product may be more than f32 can hold, and a narrow cone less than it can tell from none.
fn punctual_power(light: &PunctualLight, scene_radius: f32) -> f64 {
    let solid_angle = match light.kind {
        PunctualKind::Point => 4.0 * PI,
        PunctualKind::Spot { outer_radians, .. } => {
            4.0 * PI * (0.5 * f64::from(outer_radians)).sin().powi(2)
        }
        PunctualKind::Directional => PI * f64::from(scene_radius).powi(2),
    };
    solid_angle * f64::from(importance(light.intensity).min(f32::MAX))
}

fn sample_punctual(light: &PunctualLight, position: Vec3, probability: f32) -> Option<LightSample> {
    let (direction, distance, irradiance) = if light.kind == PunctualKind::Directional {
        (-light.direction, f32::INFINITY, light.intensity)
    } else {
        let to_light = light.position - position;
        let distance = to_light.length();
        let direction = to_light / distance;
        let attenuation = spot_attenuation(light, direction) * range_attenuation(light, distance);
        let irradiance = light.intensity * attenuation / (distance * distance);
        if !irradiance.is_finite() || irradiance.max_element() <= 0.0 {
            return None;
        }
        (direction, distance, irradiance)
    };
    let radiance_over_pdf = irradiance / probability;
    Some(LightSample { direction, distance, radiance_over_pdf, pdf_solid_angle: f32::INFINITY })
}

/// Smooth cone of `KHR_lights_punctual`.
fn spot_attenuation(light: &PunctualLight, to_light: Vec3) -> f32 {
    let PunctualKind::Spot { inner_radians, outer_radians } = light.kind else { return 1.0 };
    let cosine = light.direction.dot(-to_light);
    let (inner, outer) = (inner_radians.cos(), outer_radians.cos());
    let t = ((cosine - outer) / (inner - outer).max(1e-4)).clamp(0.0, 1.0);
    t * t
}

/// Windowed falloff that `KHR_lights_punctual` recommends for lights with a range; 1 where that is infinite.
fn range_attenuation(light: &PunctualLight, distance: f32) -> f32 {
    (1.0 - (distance / light.range).powi(4)).clamp(0.0, 1.0)
}
