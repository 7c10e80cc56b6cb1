//! Light sources inside the scene: emissive triangles and punctual lights.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use crate::color::importance;
use crate::scene::needs::is_emitter;
use crate::scene::surface::SurfacePoint;
use crate::scene::{PunctualKind, PunctualLight, Scene};

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

/// All local lights, chosen by power.
#[derive(Debug, Clone, Default)]
pub struct LocalLights {
    /// Emissive triangles, ascending.
    triangles: Vec<u32>,
    /// Probability of each triangle, then of each punctual light.
    probabilities: Vec<f32>,
    /// Running sums of `probabilities`, ending at 1.
    cumulative: Vec<f32>,
}

/// The arrays of [`LocalLights`], for a GPU.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LightArrays<'a> {
    pub(crate) triangles: &'a [u32],
    pub(crate) probabilities: &'a [f32],
    pub(crate) cumulative: &'a [f32],
}

impl LocalLights {
    /// The arrays.
    pub(crate) fn arrays(&self) -> LightArrays<'_> {
        LightArrays {
            triangles: &self.triangles,
            probabilities: &self.probabilities,
            cumulative: &self.cumulative,
        }
    }

    /// Collects the lights of a scene with bounds `(min, max)`.
    pub fn new(scene: &Scene, bounds: (Vec3, Vec3)) -> Self {
        let emits: Vec<bool> = scene.materials.iter().map(is_emitter).collect();
        let mut triangles = Vec::new();
        let mut powers = Vec::new();
        for (triangle, &material) in scene.triangle_materials.iter().enumerate() {
            if emits[material as usize] {
                let power = triangle_power(scene, triangle as u32);
                if power > 0.0 {
                    triangles.push(triangle as u32);
                    powers.push(f64::from(power));
                }
            }
        }
        let radius = 0.5 * (bounds.1 - bounds.0).length();
        powers.extend(scene.lights.iter().map(|light| f64::from(punctual_power(light, radius))));
        let total: f64 = powers.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return Self::default();
        }
        let probabilities: Vec<f32> = powers.iter().map(|p| (p / total) as f32).collect();
        let mut sum = 0.0;
        let cumulative = powers
            .iter()
            .map(|p| {
                sum += p / total;
                sum as f32
            })
            .collect();
        Self { triangles, probabilities, cumulative }
    }

    /// Whether there is nothing to sample.
    pub fn is_empty(&self) -> bool {
        self.probabilities.is_empty()
    }

    /// Number of emissive triangles.
    pub fn triangle_count(&self) -> usize {
        self.triangles.len()
    }

    /// Samples a light as seen from `position`. `None` where it does not shine that way.
    pub fn sample(&self, scene: &Scene, position: Vec3, u: Vec2) -> Option<LightSample> {
        let index = self.cumulative.partition_point(|&c| c <= u.x).min(self.cumulative.len() - 1);
        let probability = self.probabilities[index];
        if probability <= 0.0 {
            return None;
        }
        if index >= self.triangles.len() {
            let light = &scene.lights[index - self.triangles.len()];
            return sample_punctual(light, position, probability);
        }
        let low = if index == 0 { 0.0 } else { self.cumulative[index - 1] };
        let remainder = ((u.x - low) / probability).clamp(0.0, 1.0);
        let triangle = self.triangles[index];
        let barycentric = sample_triangle(Vec2::new(remainder, u.y));
        let corners = corners(scene, triangle);
        let target = corners[0]
            + (corners[1] - corners[0]) * barycentric.x
            + (corners[2] - corners[0]) * barycentric.y;
        let to_light = target - position;
        let distance = to_light.length();
        let direction = to_light / distance;
        let pdf_solid_angle =
            probability * area_to_solid_angle(&corners, direction, distance * distance)?;
        let point = SurfacePoint::at(scene, triangle, barycentric, direction);
        let radiance = emitted(scene, &point);
        (radiance.max_element() > 0.0).then(|| LightSample {
            direction,
            distance,
            radiance_over_pdf: radiance / pdf_solid_angle,
            pdf_solid_angle,
        })
    }

    /// Density in solid angle with which [`Self::sample`] chooses a point of `triangle` that lies
    /// `distance` metres away along unit `direction`; 0 if it is not a light.
    pub fn sample_pdf_solid_angle(
        &self,
        scene: &Scene,
        triangle: u32,
        direction: Vec3,
        distance: f32,
    ) -> f32 {
        let Ok(index) = self.triangles.binary_search(&triangle) else { return 0.0 };
        let corners = corners(scene, triangle);
        area_to_solid_angle(&corners, direction, distance * distance)
            .map_or(0.0, |density| self.probabilities[index] * density)
    }
}

/// Radiance a surface point sends towards its viewer: as much as alpha covers it.
pub(super) fn emitted(scene: &Scene, point: &SurfacePoint<'_>) -> Vec3 {
    let material = scene.triangle_materials[point.triangle as usize];
    if point.front_face || scene.materials[material as usize].double_sided {
        point.parameters.emissive * point.parameters.alpha
    } else {
        Vec3::ZERO
    }
}

/// Uniform barycentric coordinates (weights of the second and third corner) of a triangle.
fn sample_triangle(u: Vec2) -> Vec2 {
    let root = u.x.sqrt();
    Vec2::new(root * (1.0 - u.y), root * u.y)
}

/// Density in solid angle of a uniform point on a triangle.
fn area_to_solid_angle(corners: &[Vec3; 3], direction: Vec3, squared: f32) -> Option<f32> {
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    // |normal| is twice the area, so that area * |cos| = |normal . direction| / 2.
    let projected_area = 0.5 * normal.dot(direction).abs();
    let density = squared / projected_area;
    (density.is_finite() && density > 0.0).then_some(density)
}

fn corners(scene: &Scene, triangle: u32) -> [Vec3; 3] {
    scene.triangles[triangle as usize].map(|v| scene.positions[v as usize])
}

fn triangle_power(scene: &Scene, triangle: u32) -> f32 {
    let corners = corners(scene, triangle);
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    let area = 0.5 * normal.length();
    let material = &scene.materials[scene.triangle_materials[triangle as usize] as usize];
    // A textured emitter is probed at a few points; the factor's own share keeps it reachable where
    // all of them are dark.
    let probes = [(1.0 / 3.0, 1.0 / 3.0), (0.1, 0.1), (0.8, 0.1), (0.1, 0.8)];
    let probed: f32 = probes
        .iter()
        .map(|&(b1, b2)| SurfacePoint::at(scene, triangle, Vec2::new(b1, b2), -normal))
        .map(|point| importance(point.parameters.emissive))
        .sum::<f32>()
        / probes.len() as f32;
    let sides = if material.double_sided { 2.0 } else { 1.0 };
    area * PI * sides * (probed + 0.02 * importance(material.emissive))
}

fn punctual_power(light: &PunctualLight, scene_radius: f32) -> f32 {
    let solid_angle = match light.kind {
        PunctualKind::Point => 4.0 * PI,
        PunctualKind::Spot { outer_radians, .. } => 2.0 * PI * (1.0 - outer_radians.cos()),
        PunctualKind::Directional => PI * scene_radius * scene_radius,
    };
    solid_angle * importance(light.intensity)
}

fn sample_punctual(light: &PunctualLight, position: Vec3, probability: f32) -> Option<LightSample> {
    if light.kind == PunctualKind::Directional {
        return Some(LightSample {
            direction: -light.direction,
            distance: f32::INFINITY,
            radiance_over_pdf: light.intensity / probability,
            pdf_solid_angle: f32::INFINITY,
        });
    }
    let to_light = light.position - position;
    let distance = to_light.length();
    let direction = to_light / distance;
    let attenuation = spot_attenuation(light, direction) * range_attenuation(light, distance);
    let irradiance = light.intensity * attenuation / (distance * distance);
    (irradiance.is_finite() && irradiance.max_element() > 0.0).then(|| LightSample {
        direction,
        distance,
        radiance_over_pdf: irradiance / probability,
        pdf_solid_angle: f32::INFINITY,
    })
}

/// Smooth cone of `KHR_lights_punctual`.
fn spot_attenuation(light: &PunctualLight, to_light: Vec3) -> f32 {
    let PunctualKind::Spot { inner_radians, outer_radians } = light.kind else { return 1.0 };
    let cosine = light.direction.dot(-to_light);
    let (inner, outer) = (inner_radians.cos(), outer_radians.cos());
    let t = ((cosine - outer) / (inner - outer).max(1e-4)).clamp(0.0, 1.0);
    t * t
}

/// Windowed falloff that `KHR_lights_punctual` recommends for lights with a range.
fn range_attenuation(light: &PunctualLight, distance: f32) -> f32 {
    if light.range.is_finite() {
        (1.0 - (distance / light.range).powi(4)).clamp(0.0, 1.0)
    } else {
        1.0
    }
}
