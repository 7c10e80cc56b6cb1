//! A sensible view of a scene that brings no camera.

use glam::Vec3;

use super::World;
use crate::bvh::Ray;
use crate::math::direction_from_uv;
use crate::scene::Camera;

const FOV_Y_RADIANS: f32 = 0.87;

/// Frames the scene: from inside if its middle is mostly enclosed, else from the front, a little
/// from above and the right.
pub fn frame(world: &World, aspect: f32) -> Camera {
    let (low, high) = world.bvh.bounds();
    let centre = 0.5 * (low + high);
    if enclosure(world, centre) > 0.7 {
        inside(world, low, high)
    } else {
        outside(low, high, aspect)
    }
}

/// Directions that cover the sphere about evenly.
fn directions(count: u32) -> impl Iterator<Item = Vec3> {
    (0..count).map(move |i| {
        let y = (i as f32 + 0.5) / count as f32;
        let u = (i as f32 * 0.618_034).fract();
        direction_from_uv(glam::Vec2::new(u, (1.0 - 2.0 * y).acos() / std::f32::consts::PI))
    })
}

fn free_distance(world: &World, origin: Vec3, direction: Vec3) -> Option<f32> {
    let ray = Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
    world.bvh.closest_hit(&ray, |_| true).map(|hit| hit.t)
}

/// Share of directions from a point that meet a surface, the lower hemisphere counted half, for an
/// object on a ground plane is not inside anything.
fn enclosure(world: &World, point: Vec3) -> f32 {
    let mut sums = (0.0, 0.0);
    for direction in directions(256) {
        let weight = if direction.y < 0.0 { 0.25 } else { 1.0 };
        sums.1 += weight;
        if free_distance(world, point, direction).is_some() {
            sums.0 += weight;
        }
    }
    sums.0 / sums.1
}

/// Looks across the room from the place, at eye height, that sees farthest.
fn inside(world: &World, low: Vec3, high: Vec3) -> Camera {
    let size = high - low;
    let eye_height = low.y + (0.5 * size.y).min(0.45 * size.y.max(3.2));
    let mut best = (f32::MIN, 0.5 * (low + high), Vec3::NEG_Z);
    for (x, z) in (0..49).map(|i| ((i % 7) as f32 / 6.0, (i / 7) as f32 / 6.0)) {
        let spread = |t: f32| 0.12 + 0.76 * t;
        let eye = Vec3::new(low.x + size.x * spread(x), eye_height, low.z + size.z * spread(z));
        let nearest = directions(64)
            .filter_map(|d| free_distance(world, eye, d))
            .fold(f32::INFINITY, f32::min);
        for step in 0..16 {
            let angle = step as f32 * std::f32::consts::TAU / 16.0;
            let forward = Vec3::new(angle.cos(), -0.1, angle.sin()).normalize();
            // Mean free distance over the picture's width; what is outdoors counts little.
            let score: f32 = (-4..=4)
                .map(|i| crate::math::rotate_y(forward, i as f32 * 0.15))
                .map(|d| free_distance(world, eye, d).unwrap_or(0.0).min(size.length()))
                .sum();
            let crowded = if nearest < 0.04 * size.min_element() { 0.3 } else { 1.0 };
            if score * crowded > best.0 {
                best = (score * crowded, eye, forward);
            }
        }
    }
    Camera::look_at(best.1, best.1 + best.2 * 0.3 * size.length(), FOV_Y_RADIANS)
}

fn outside(low: Vec3, high: Vec3, aspect: f32) -> Camera {
    let centre = 0.5 * (low + high);
    let radius = (0.5 * (high - low).length()).max(f32::MIN_POSITIVE);
    let half = (0.5 * FOV_Y_RADIANS).tan() * aspect.min(1.0);
    let distance = radius / half.atan().sin();
    let direction = Vec3::new(0.45, 0.35, 1.0).normalize();
    Camera::look_at(centre + direction * distance, centre, FOV_Y_RADIANS)
}
