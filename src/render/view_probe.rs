//! What a camera sees, as far as a few rays tell before anything is rendered.

use glam::Vec2;

use super::view::View;
use crate::bsdf::cosine_hemisphere;
use crate::bvh::{Hit, Ray, offset_origin};
use crate::math::Frame;
use crate::path::World;
use crate::path::camera::CameraRays;
use crate::sampler::Sampler;

/// Rays along each axis of the picture.
const LOOKS: u32 = 16;
/// Rays from each place they meet.
const LOOKS_AROUND: u32 = 4;
/// Keeps their random numbers apart from others. All pictures of a view are to look alike, so it is not
/// theirs.
const SEED: u32 = 0x6c6f_6f6b;

/// Metres to what the camera sees, the median over its picture; `None` if it sees no surface.
pub(super) fn middle_distance(world: &World, size: [u32; 2], rays: &CameraRays) -> Option<f32> {
    let mut distances: Vec<f32> = looks(world, size, rays).map(|(_, hit)| hit.t).collect();
    distances.sort_unstable_by(f32::total_cmp);
    distances.get(distances.len() / 2).copied().filter(|distance| *distance > 0.0)
}

/// Least [`enclosure`] of a room.
pub(super) const ROOM_ENCLOSURE: f32 = 0.9;

/// How far what the camera sees is enclosed: the mean share of the cosine-weighted hemisphere over it that
/// surfaces take up, panes as far as they let no light through. 0 where it sees no surface. Of a part of a picture
/// it is the whole's.
pub(super) fn enclosure(world: &World, view: &View) -> f32 {
    let size @ [width, height] = view.whole_size();
    let rays = CameraRays::new(&view.camera, width, height);
    let (mut enclosed, mut all) = (0.0, 0);
    for (index, (ray, hit)) in looks(world, size, &rays).enumerate() {
        let point = world.point(&hit, ray.direction);
        let normal = point.geometric_normal;
        let frame = Frame::from_z(normal);
        let origin = offset_origin(point.position, normal);
        for look in 0..LOOKS_AROUND {
            let u = Sampler::new(SEED, index as u32, look).next_pair();
            let direction = frame.world_from_local(cosine_hemisphere(Vec2::from(u)));
            let out = Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
            enclosed += 1.0 - world.transmittance(&out).max_element();
            all += 1;
        }
    }
    enclosed / f32::max(all as f32, 1.0)
}

/// Rays evenly over the picture of that size, and what they meet.
fn looks(
    world: &World,
    [width, height]: [u32; 2],
    rays: &CameraRays,
) -> impl Iterator<Item = (Ray, Hit)> {
    let size = Vec2::new(width as f32, height as f32) / LOOKS as f32;
    let places = (0..LOOKS * LOOKS).map(|i| Vec2::new((i % LOOKS) as f32, (i / LOOKS) as f32));
    places.filter_map(move |place| {
        let ray = rays.ray((place + 0.5) * size, Vec2::ZERO);
        world.closest_hit(&ray, true).map(|hit| (ray, hit))
    })
}
