//! A sensible view of a scene that brings no camera.

use glam::{Mat3A, Vec3, Vec3A};
use rayon::prelude::*;

use super::World;
use crate::bvh::Ray;
use crate::math::direction_from_uv;
use crate::scene::Camera;

/// Vertical field of view of every view chosen here, in radians.
pub const FOV_Y_RADIANS: f32 = 0.87;
/// Share of the picture's width or height that an object fills.
const FILL: f32 = 0.9;
/// A scene is a room if from places in it at least this share of directions shows it from inside.
const SHARE_INSIDE: f32 = 0.6;

/// Triangles that rays from the middle may cross: some 150 each. Where surfaces lie on one another by the
/// thousand each ray takes long, and no place is better than another.
const MAX_CROSSINGS: u32 = 1 << 19;

/// Frames the scene for a picture of `aspect` (width over height): a room from inside, anything else
/// from outside, a little from above and the right, filling the picture.
pub fn frame(world: &World, aspect: f32) -> Camera {
    frame_room(world).unwrap_or_else(|| outside(world, aspect))
}

/// Frames a room from inside; `None` if the scene is none.
pub fn frame_room(world: &World) -> Option<Camera> {
    let is_room = !is_dense(world) && share_inside(world) > SHARE_INSIDE;
    is_room.then(|| inside(world))
}

/// Directions that cover the sphere about evenly.
fn directions(count: u32) -> impl Iterator<Item = Vec3> {
    (0..count).map(move |i| {
        let y = (i as f32 + 0.5) / count as f32;
        let u = (i as f32 * 0.618_034).fract();
        direction_from_uv(glam::Vec2::new(u, (1.0 - 2.0 * y).acos() / std::f32::consts::PI))
    })
}

/// The first surface in a direction.
struct Sight {
    distance: f32,
    /// Whether its triangle faces the viewer; from within an object none does.
    from_front: bool,
}

fn look(world: &World, origin: Vec3, direction: Vec3) -> Option<Sight> {
    let ray = Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
    let hit = world.bvh.closest_hit(&ray, |_| true)?;
    let scene = &world.scene;
    let [a, b, c] = scene.corners(hit.triangle);
    let from_front = (b - a).cross(c - a).dot(direction) < 0.0;
    Some(Sight { distance: hit.t, from_front })
}

/// Whether looking around would take too long. Crossings are counted rather than seconds, in no order: the
/// same scene is framed alike on all machines.
fn is_dense(world: &World) -> bool {
    let mut crossings = 0;
    middle_places(world).any(|origin| {
        directions(128).any(|direction| {
            let ray = Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
            world.bvh.any_hit(&ray, |_| {
                crossings += 1;
                crossings > MAX_CROSSINGS
            })
        })
    })
}

/// Places spread through the middle of the scene.
fn middle_places(world: &World) -> impl Iterator<Item = Vec3> {
    let (low, high) = world.bvh.bounds();
    (0..27).map(move |i| {
        let at = Vec3::new((i % 3) as f32, (i / 3 % 3) as f32, (i / 9) as f32);
        low + (high - low) * (0.3 + 0.2 * at)
    })
}

/// Median share, over places spread through the middle of the scene, of [`share_inside_at`]: furniture and
/// pillars have an inside too.
fn share_inside(world: &World) -> f32 {
    let places: Vec<Vec3> = middle_places(world).collect();
    let mut shares: Vec<f32> =
        places.par_iter().map(|place| share_inside_at(world, *place)).collect();
    shares.sort_by(f32::total_cmp);
    shares[shares.len() / 2]
}

/// Share of directions in which a surface is seen from its front: near 1 in a room, near 0 within an
/// object. Looking down does not count, for an object on a ground plane is not inside anything.
fn share_inside_at(world: &World, place: Vec3) -> f32 {
    let directions = directions(128).filter(|direction| direction.y > -0.2);
    let seen: Vec<_> = directions.map(|direction| look(world, place, direction)).collect();
    let fronts = seen.iter().flatten().filter(|sight| sight.from_front && sight.distance > 0.0);
    fronts.count() as f32 / seen.len() as f32
}

/// Whether a place is in a room, by what is seen from there.
pub fn is_in_room(world: &World, place: Vec3) -> bool {
    share_inside_at(world, place) > SHARE_INSIDE
}

/// The point that the middle of a camera's picture shows; where that is nothing, what is in focus.
pub fn middle(world: &World, camera: &Camera) -> Vec3 {
    let transform = &camera.world_from_camera;
    let origin = Vec3::from(transform.translation);
    let direction = -Vec3::from(transform.matrix3.z_axis.normalize_or(Vec3A::Z));
    let sight = look(world, origin, direction);
    origin + direction * sight.map_or(camera.focus_distance, |sight| sight.distance)
}

/// Looks across the room from the place, at eye height, that sees farthest.
fn inside(world: &World) -> Camera {
    let (low, high) = world.bvh.bounds();
    let size = high - low;
    let eye_height = low.y + (0.5 * size.y).min(0.45 * size.y.max(3.2));
    // The best view from each place; of places, the first of those as good.
    let view_from = |place: u32| {
        let (x, z) = ((place % 7) as f32 / 6.0, (place / 7) as f32 / 6.0);
        let spread = |t: f32| 0.12 + 0.76 * t;
        let eye = Vec3::new(low.x + size.x * spread(x), eye_height, low.z + size.z * spread(z));
        let sights = directions(64).filter_map(|d| look(world, eye, d));
        let nearest = sights.map(|sight| sight.distance).fold(f32::INFINITY, f32::min);
        let mut best = (f32::MIN, eye, Vec3::NEG_Z);
        let crowded = if nearest < 0.04 * size.min_element() { 0.3 } else { 1.0 };
        for step in 0..16 {
            let angle = step as f32 * std::f32::consts::TAU / 16.0;
            let forward = Vec3::new(angle.cos(), -0.1, angle.sin()).normalize();
            // Mean free distance over the picture's width; backs and what is outdoors count nothing.
            let turned = (-4..=4).map(|i| crate::math::rotate_y(forward, i as f32 * 0.15));
            let sights = turned.filter_map(|direction| look(world, eye, direction));
            let fronts = sights.filter(|sight| sight.from_front);
            let score: f32 = fronts.map(|sight| sight.distance).sum();
            if score * crowded > best.0 {
                best = (score * crowded, eye, forward);
            }
        }
        best
    };
    let views: Vec<(f32, Vec3, Vec3)> = (0..49).into_par_iter().map(view_from).collect();
    let best = views.into_iter().reduce(|best, view| if view.0 > best.0 { view } else { best });
    let best = best.unwrap_or((0.0, 0.5 * (low + high), Vec3::NEG_Z));
    Camera::look_at(best.1, best.1 + best.2 * 0.3 * size.length(), FOV_Y_RADIANS)
}

/// Looks at the scene from where it just fits the picture.
fn outside(world: &World, aspect: f32) -> Camera {
    let (low, high) = world.bvh.bounds();
    let size = (high - low).max(Vec3::splat(f32::MIN_POSITIVE));
    // Panels are seen nearly straight on, deep things from the side, flat ones from above.
    let deep = (1.0 - size.x / size.z).max(0.0);
    let flat = (1.0 - size.y / size.x.max(size.z)).max(0.0);
    let panel = (1.0 - size.z / size.x.min(size.y)).max(0.0);
    let side = 0.4 + 0.6 * deep - 0.25 * panel;
    let above = 0.3 + 0.6 * flat * flat - 0.2 * panel;
    let direction = Vec3::new(side, above, 1.0).normalize();
    let centre = 0.5 * (low + high);
    let axes = Camera::look_at(centre + direction, centre, 1.0).world_from_camera.matrix3;
    let eye = centre + fitting_eye(world, centre, axes, aspect);
    let depth = (eye - centre).dot(direction);
    Camera::look_at(eye, eye - direction * depth, FOV_Y_RADIANS)
}

/// Where the eye must be, relative to `centre`, so that a camera with these axes (right, up, back)
/// just sees every corner of the scene. A corner at (x, y, z) in camera axes is seen from (X, Y, Z)
/// if |x - X| <= h (Z - z) and |y - Y| <= v (Z - z), with h and v the slopes of the picture's edges;
/// the four tightest of these decide.
fn fitting_eye(world: &World, centre: Vec3, axes: Mat3A, aspect: f32) -> Vec3 {
    let vertical = FILL * (0.5 * FOV_Y_RADIANS).tan();
    let horizontal = vertical * aspect;
    let camera_from_world = axes.transpose();
    let mut tightest = [f32::MIN; 4];
    for point in world.scene.hull_points(|_| true) {
        let corner = Vec3A::from(point - centre);
        let p = camera_from_world * corner;
        let (across, along) = (horizontal * p.z, vertical * p.z);
        let bounds = [across + p.x, across - p.x, along + p.y, along - p.y];
        tightest.iter_mut().zip(bounds).for_each(|(t, b)| *t = t.max(b));
    }
    let [right, left, top, bottom] = tightest;
    let x = 0.5 * (right - left);
    let y = 0.5 * (top - bottom);
    let z = (0.5 * (right + left) / horizontal).max(0.5 * (top + bottom) / vertical);
    (axes * Vec3A::new(x, y, z)).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Scene};

    /// A room whose walls are there so many times.
    fn room(layers: usize) -> World {
        let corner = |i: u32| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32);
        let walls =
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let triangles = walls.iter().flat_map(|&[a, b, c, d]| [[a, c, b], [a, d, c]]);
        let triangles: Vec<[u32; 3]> = triangles.collect();
        let triangles = triangles.repeat(layers);
        World::new(Scene {
            positions: (0..8).map(|i| 4.0 * corner(i)).collect(),
            triangle_materials: vec![0; triangles.len()],
            triangles,
            materials: vec![Material::default()],
            ..Scene::default()
        })
    }

    #[test]
    fn a_room_is_seen_from_inside_unless_each_ray_would_take_long() {
        let eye = |layers| {
            let world = room(layers);
            let eye = Vec3::from(frame(&world, 1.0).world_from_camera.translation);
            (eye.cmpge(Vec3::ZERO) & eye.cmple(Vec3::splat(4.0))).all()
        };
        assert!(eye(1) && eye(50));
        assert!(!eye(500));
    }
}
