//! Moving the viewpoint: orbit, look, pan, dolly, fly, frame, focus.

use glam::{Quat, Vec2, Vec3};

use super::document::Viewpoint;
use crate::bvh::Ray;
use crate::path::World;

/// Radians of a turn for one point of dragging.
const RADIANS_PER_POINT: f32 = 0.006;
/// Nearest the pivot can be, in metres.
const NEAREST: f32 = 0.02;
/// Share of the picture that framing fills.
const FRAME_FILL: f32 = 0.9;

/// Directions in which one looks for the walls of a room.
const LOOKS: usize = 64;
/// Share of them that meet something in a room.
const ENCLOSED: f32 = 0.85;

/// Whether something is within so many metres.
fn is_met(world: &World, origin: Vec3, direction: Vec3, metres: f32) -> bool {
    let ray = Ray { origin, direction, t_min: 0.0, t_max: metres };
    direction != Vec3::ZERO && world.bvh.any_hit(&ray, |_| true)
}

/// Whether there are walls nearly everywhere around a place.
fn is_in_room(world: &World, place: Vec3) -> bool {
    // A Fibonacci lattice: even, and the same every time.
    let golden_angle = std::f32::consts::PI * (3.0 - 5.0_f32.sqrt());
    let direction = |i: usize| {
        let y = 1.0 - (2 * i + 1) as f32 / LOOKS as f32;
        let (sin, cos) = (golden_angle * i as f32).sin_cos();
        let radius = (1.0 - y * y).sqrt();
        Vec3::new(radius * cos, y, radius * sin)
    };
    let met = (0..LOOKS).filter(|i| is_met(world, place, direction(*i), f32::INFINITY)).count();
    met as f32 >= ENCLOSED * LOOKS as f32
}

impl Viewpoint {
    /// Turns about the pivot: `drag` in points, right and down.
    pub(super) fn orbit(&mut self, drag: Vec2) {
        let pivot = self.pivot();
        self.look_around(drag);
        self.eye = (pivot - self.forward() * self.pivot_distance).to_array();
    }

    /// Orbits, unless a wall is in the way or the way leads out of a room, through a window: then the camera turns where
    /// it is.
    pub(super) fn orbit_within(&mut self, world: Option<&World>, drag: Vec2) {
        let mut moved = self.clone();
        moved.orbit(drag);
        let is_blocked = world.is_some_and(|world| {
            let way = moved.eye() - self.eye();
            // Some room to the wall is kept.
            let margin = 0.1 * way.length() + 0.02 * self.pivot_distance;
            is_met(world, self.eye(), way.normalize_or_zero(), way.length() + margin)
                || is_in_room(world, self.eye()) && !is_in_room(world, moved.eye())
        });
        if is_blocked {
            self.look_around(drag);
        } else {
            *self = moved;
        }
    }

    /// Turns about the eye: `drag` in points, right and down.
    pub(super) fn look_around(&mut self, drag: Vec2) {
        let rotation = self.rotation();
        let yaw = Quat::from_rotation_y(-drag.x * RADIANS_PER_POINT);
        let angle = -drag.y * RADIANS_PER_POINT;
        // Never over the top: up stays up.
        let steepness = self.forward().y.clamp(-1.0, 1.0).asin();
        let limit = 89.0_f32.to_radians();
        let angle = (steepness + angle).clamp(-limit, limit) - steepness;
        let pitch = Quat::from_axis_angle((rotation * Vec3::X).normalize_or(Vec3::X), angle);
        self.rotation = (yaw * pitch * rotation).normalize().to_array();
    }

    /// Moves across the picture so that the pivot follows the pointer: `drag` in points on a
    /// viewport of `height` points.
    pub(super) fn pan(&mut self, drag: Vec2, height: f32) {
        let metres = 2.0 * self.half_extent() / height.max(1.0);
        self.fly(Vec3::new(-drag.x * metres, drag.y * metres, 0.0));
    }

    /// Moves towards the pivot (positive `steps`) or away from it.
    pub(super) fn dolly(&mut self, steps: f32) {
        let factor = 0.9_f32.powf(steps);
        if self.fov_y_degrees.is_none() {
            self.half_height *= factor;
            return;
        }
        let pivot = self.pivot();
        self.pivot_distance = (self.pivot_distance * factor).max(NEAREST);
        self.eye = (pivot - self.forward() * self.pivot_distance).to_array();
    }

    /// Moves freely: `metres` along the camera's right, up and forward axes.
    pub(super) fn fly(&mut self, metres: Vec3) {
        let step = self.rotation() * Vec3::new(metres.x, metres.y, -metres.z);
        self.eye = (self.eye() + step).to_array();
    }

    /// Moves back or forth until the box fits the picture of `aspect` (width over height).
    pub(super) fn frame(&mut self, (low, high): (Vec3, Vec3), aspect: f32) {
        let centre = 0.5 * (low + high);
        let radius = (0.5 * (high - low).length()).max(NEAREST);
        self.pivot_distance = match self.fov_y_degrees {
            Some(degrees) => {
                let half = (0.5 * degrees.to_radians()).tan() * aspect.min(1.0) * FRAME_FILL;
                radius / half.atan().sin()
            }
            None => {
                self.half_height = radius / (FRAME_FILL * aspect.min(1.0));
                2.0 * radius
            }
        };
        self.eye = (centre - self.forward() * self.pivot_distance).to_array();
    }

    /// Makes a world point the one that orbiting turns around, without moving.
    pub(super) fn set_pivot(&mut self, point: Vec3) {
        self.pivot_distance = (point - self.eye()).dot(self.forward()).max(NEAREST);
    }

    /// Makes a world point sharp.
    pub(super) fn focus_on(&mut self, point: Vec3) {
        self.focus_distance = (point - self.eye()).dot(self.forward()).max(NEAREST);
    }

    /// Half the picture's height at the pivot, in metres.
    fn half_extent(&self) -> f32 {
        self.fov_y_degrees.map_or(self.half_height, |degrees| {
            (0.5 * degrees.to_radians()).tan() * self.pivot_distance
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Camera;

    fn viewpoint() -> Viewpoint {
        let camera = Camera::look_at(Vec3::new(0.0, 1.0, 4.0), Vec3::new(0.0, 1.0, 0.0), 1.0);
        Viewpoint::of(&camera, 4.0)
    }

    #[test]
    fn orbiting_keeps_the_pivot_and_up_up() {
        let mut v = viewpoint();
        for drag in [Vec2::new(130.0, 40.0), Vec2::new(-20.0, 4000.0), Vec2::new(900.0, -9000.0)] {
            v.orbit(drag);
            assert!((v.pivot() - Vec3::new(0.0, 1.0, 0.0)).length() < 1e-3, "{v:?}");
            assert!((v.rotation() * Vec3::Y).y > 0.0, "{v:?}");
            assert!((v.rotation() * Vec3::X).y.abs() < 1e-3, "the horizon is level");
        }
    }

    #[test]
    fn panning_moves_the_pivot_with_the_pointer() {
        let mut v = viewpoint();
        // Half the picture's height at the pivot is 4 tan 0.5 m.
        v.pan(Vec2::new(0.0, 50.0), 100.0);
        assert!((v.eye() - Vec3::new(0.0, 1.0 + 4.0 * 0.5_f32.tan(), 4.0)).length() < 1e-4);
    }

    #[test]
    fn dolly_flies_to_the_pivot_but_never_through() {
        let mut v = viewpoint();
        v.dolly(1.0);
        assert!((v.eye().z - 3.6).abs() < 1e-4);
        v.dolly(1000.0);
        assert!(v.eye().z >= NEAREST * 0.99);
        v.fly(Vec3::new(1.0, 2.0, 3.0));
        assert!((v.eye() - Vec3::new(1.0, 3.0, NEAREST - 3.0)).length() < 1e-3);
    }

    #[test]
    fn framing_shows_the_whole_box() {
        for aspect in [0.5, 2.0] {
            let mut v = viewpoint();
            let bounds = (Vec3::new(-1.0, 0.0, -2.0), Vec3::new(3.0, 1.0, 2.0));
            v.frame(bounds, aspect);
            let slope = 0.5_f32.tan();
            for i in 0..8 {
                let pick = |bit: u32, axis: usize| {
                    if i >> bit & 1 == 0 { bounds.0[axis] } else { bounds.1[axis] }
                };
                let corner = Vec3::new(pick(0, 0), pick(1, 1), pick(2, 2));
                let seen = v.rotation().inverse() * (corner - v.eye());
                assert!(seen.z < 0.0 && seen.y.abs() < slope * -seen.z);
                assert!(seen.x.abs() < slope * aspect * -seen.z, "{corner} at {aspect}");
            }
        }
    }

    #[test]
    fn who_orbits_in_a_room_leaves_it_neither_through_walls_nor_windows() {
        for scene in ["office", "living-room", "crack"] {
            let world = World::new(crate::scene::builtin::build(scene).expect("built in"));
            let (low, high) = world.bvh.bounds();
            for camera in &world.scene.cameras {
                for way in [Vec2::X, -Vec2::X, Vec2::new(0.9, 0.4), Vec2::new(-0.6, -0.8)] {
                    let mut viewpoint = Viewpoint::of(camera, 4.0);
                    let before = viewpoint.rotation();
                    for _ in 0..300 {
                        viewpoint.orbit_within(Some(&world), 4.0 * way);
                        let eye = viewpoint.eye();
                        assert!(eye.cmpge(low).all() && eye.cmple(high).all(), "{scene}: {eye}");
                        assert!(is_in_room(&world, eye), "{scene}: {eye} is outside");
                    }
                    assert!(viewpoint.rotation().angle_between(before) > 0.1, "{scene}: it turns");
                }
            }
        }
        // Around a thing one goes as one likes.
        let world = World::new(crate::scene::builtin::build("open").expect("built in"));
        let mut viewpoint = Viewpoint::of(&world.scene.cameras[0], 4.0);
        let mut free = viewpoint.clone();
        for _ in 0..100 {
            viewpoint.orbit_within(Some(&world), Vec2::new(4.0, 0.0));
            free.orbit(Vec2::new(4.0, 0.0));
        }
        assert!(viewpoint.eye().distance(free.eye()) < 1e-3);
    }
}
