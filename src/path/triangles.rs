//! Triangles that a light tree chooses: their moments, points on them and densities.

use glam::{Vec2, Vec3};

use super::light_tree::{Light, LightTree, Moments, Receiver};
use crate::sampler::unit_from_bits;
use crate::scene::Scene;

/// Least intensity of a light relative to that of all.
const MIN_INTENSITY: f32 = 1e-30;

/// Divides the lights' intensities by their sum, which need not be what f32 can hold.
pub(super) fn relate(lights: &mut [Light]) {
    let total: f64 = lights.iter().map(|light| f64::from(light.moments.intensity)).sum();
    for light in lights {
        let share = f64::from(light.moments.intensity) / total;
        light.moments.intensity = (share as f32).max(MIN_INTENSITY);
    }
}

/// A uniform point on a triangle, and its barycentric coordinates: weights of the second and third corner.
pub(super) fn point_on(corners: &[Vec3; 3], u: f32, bits: u32) -> (Vec3, Vec2) {
    let (root, v) = (u.sqrt(), unit_from_bits(bits));
    let barycentric = Vec2::new(root * (1.0 - v), root * v);
    let along = |corner: usize| corners[corner] - corners[0];
    (corners[0] + along(1) * barycentric.x + along(2) * barycentric.y, barycentric)
}

/// Moments of a triangle that shines to its front, of this intensity along its normal.
pub(super) fn facing(corners: &[Vec3; 3], intensity: f32) -> Moments {
    let center = (corners[0] + corners[1] + corners[2]) / 3.0;
    let variance = corners.iter().map(|c| c.distance_squared(center)).sum::<f32>() / 12.0;
    let axis = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
    Moments { intensity, center, variance, axis, aimed: 1.0, around: 0.0 }
}

/// Density in solid angle of a uniform point on a triangle.
pub(super) fn area_to_solid_angle(
    corners: &[Vec3; 3],
    direction: Vec3,
    squared: f32,
) -> Option<f32> {
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    // |normal| is twice the area, so that area * |cos| = |normal . direction| / 2.
    let projected_area = 0.5 * normal.dot(direction).abs();
    let density = squared / projected_area;
    (density.is_finite() && density > 0.0).then_some(density)
}

/// Density in solid angle with which a point of `triangle` is chosen that lies some metres away along a unit direction;
/// 0 if it is none of these.
pub(super) fn solid_angle_pdf(
    (triangles, tree): (&[u32], &LightTree),
    scene: &Scene,
    triangle: u32,
    receiver: &Receiver,
    (direction, distance): (Vec3, f32),
) -> f32 {
    let Ok(index) = triangles.binary_search(&triangle) else { return 0.0 };
    let corners = scene.corners(triangle);
    area_to_solid_angle(&corners, direction, distance * distance)
        .map_or(0.0, |density| tree.probability(receiver, index as u32) * density)
}
