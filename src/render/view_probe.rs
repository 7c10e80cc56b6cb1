//! What a camera sees, as far as a few rays tell before anything is rendered.

use glam::Vec2;
use rayon::prelude::*;

use super::view::View;
use crate::bsdf::cosine_hemisphere;
use crate::bvh::{Hit, Ray, offset_origin};
use crate::math::Frame;
use crate::path::camera::CameraRays;
use crate::path::limits::{CutOff, MAX_INTERFACES};
use crate::path::{Lit, World};
use crate::sampler::Sampler;

/// Rays along each axis of the picture.
const LOOKS: u32 = 16;
/// Rays from each place they meet.
const LOOKS_AROUND: u32 = 4;
/// Keeps their random numbers apart from others. All pictures of a view are to look alike, so it is not
/// theirs.
const SEED: u32 = 0x6c6f_6f6b;

/// Metres to what the camera sees, the median over its picture; `None` if it sees no surface.
pub(super) fn middle_distance(world: &World, view: &View) -> Option<f32> {
    let (size, rays) = ([view.width, view.height], view.rays());
    let mut distances: Vec<f32> = looks(world, size, &rays).map(|(_, hit)| hit.t).collect();
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

/// Paths from each place of the picture.
const PATHS: usize = 4;
/// Least share of light cut off that is worth a notice.
const MIN_CUT_OFF: f32 = 0.02;

/// What limits take of the picture's paths, in the mean.
fn cut_off(lit: Lit<'_>, view: &View) -> CutOff {
    let [width, height] = view.whole_size();
    let rays = CameraRays::new(&view.camera, width, height);
    let tracer = view.tracer(lit, None);
    let places: Vec<Vec2> = places([width, height]).collect();
    let of_path = |index: usize| {
        let (place, path) = (index % places.len(), index / places.len());
        let sampler = Sampler::new(SEED, place as u32, path as u32);
        tracer.cut_off(rays.ray(places[place], Vec2::ZERO), sampler)
    };
    let paths = 0..PATHS * places.len();
    let of_paths: Vec<CutOff> = paths.into_par_iter().map(of_path).collect();
    let mean =
        |part: fn(&CutOff) -> f32| of_paths.iter().map(part).sum::<f32>() / of_paths.len() as f32;
    CutOff { by_bounces: mean(|cut| cut.by_bounces), by_interfaces: mean(|cut| cut.by_interfaces) }
}

/// A sentence where paths end with much of their light left, unless direct light alone is asked for.
pub(crate) fn cut_off_notice(lit: Lit<'_>, view: &View) -> Option<String> {
    if view.limits.bounces <= 1 {
        return None;
    }
    let CutOff { by_bounces, by_interfaces } = cut_off(lit, view);
    let share = by_bounces.max(by_interfaces);
    let (what, remedy) = if by_bounces > by_interfaces {
        (format!("{} bounces", view.limits.bounces), "; more bounces show it")
    } else {
        (format!("{MAX_INTERFACES} perfect reflections and refractions in a row"), "")
    };
    let percent = 100.0 * share;
    (share >= MIN_CUT_OFF).then(|| {
        format!("paths end after {what} with {percent:.0} % of their light left, which the picture lacks{remedy}")
    })
}

/// Rays evenly over the picture of that size, and what they meet.
fn looks(world: &World, size: [u32; 2], rays: &CameraRays) -> impl Iterator<Item = (Ray, Hit)> {
    places(size).filter_map(move |place| {
        let ray = rays.ray(place, Vec2::ZERO);
        world.closest_hit(&ray, true).map(|hit| (ray, hit))
    })
}

/// Places evenly over a picture of that size, in pixels.
fn places([width, height]: [u32; 2]) -> impl Iterator<Item = Vec2> {
    let size = Vec2::new(width as f32, height as f32) / LOOKS as f32;
    let places = (0..LOOKS * LOOKS).map(|i| Vec2::new((i % LOOKS) as f32, (i / LOOKS) as f32));
    places.map(move |place| (place + 0.5) * size)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::environment::{Environment, EnvironmentOptions};
    use crate::image::Image;
    use crate::path::{PathLimits, WorldBuilder};
    use crate::scene::{Camera, Material};

    #[test]
    fn a_closed_room_says_what_the_maximum_of_bounces_takes() {
        let map = Image::filled(8, 4, [1.0; 3]);
        let map = Environment::new(map, &EnvironmentOptions::default()).expect("a sound map");
        let camera = Camera::look_at(Vec3::ZERO, Vec3::X, 1.0);
        let room = |material: &Material| {
            let [low, high] = [-Vec3::ONE, Vec3::ONE];
            WorldBuilder::default().faces(material, low, high, 0..6).build()
        };
        let view = |bounces| View {
            limits: PathLimits { bounces, ..PathLimits::default() },
            ..View::new(camera.clone(), [32, 32])
        };
        let white = room(&Material::lambert(0.8));
        let taken = cut_off((&white, &map), &view(8));
        assert!((taken.by_bounces / 0.8_f32.powi(8) - 1.0).abs() < 0.1, "{taken:?}");
        assert_eq!(taken.by_interfaces, 0.0);
        let notice = |world, bounces| cut_off_notice((world, &map), &view(bounces));
        assert!(notice(&white, 8).is_some_and(|said| said.contains("8 bounces with 1")));
        // One bounce asks for direct light; 32 leave out less than is seen.
        assert_eq!(notice(&white, 1).or(notice(&white, 32)), None);

        let mirror = Material { metallic: 1.0, roughness: 0.0, ..Material::lambert(0.99) };
        let said = notice(&room(&mirror), 8);
        assert!(said.is_some_and(|said| said.contains("64 perfect")));
    }
}
