//! What a camera sees, as far as a few rays tell before anything is rendered.

use std::ops::Range;

use glam::Vec2;
use rayon::prelude::*;

use super::view::{Sampling, View};
use crate::bsdf::cosine_hemisphere;
use crate::bvh::{Hit, Ray, offset_origin};
use crate::light_grid::LightGrid;
use crate::math::Frame;
use crate::path::aim_targets::Aiming;
use crate::path::camera::CameraRays;
use crate::path::limits::{CutOff, MAX_INTERFACES};
use crate::path::lit_targets::Conditions;
use crate::path::{Lit, LocalLights, PathLimits, PathTracer, World};
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
    let tracer = view.tracer(lit, None);
    let cuts = of_paths(view, 0..PATHS, |ray, sampler| tracer.cut_off(ray, sampler));
    let mean = |part: fn(&CutOff) -> f32| cuts.iter().map(part).sum::<f32>() / cuts.len() as f32;
    CutOff { by_bounces: mean(|cut| cut.by_bounces), by_interfaces: mean(|cut| cut.by_interfaces) }
}

/// What paths of these numbers through places all over the picture find: by number, then by place.
fn of_paths<T: Send>(
    view: &View,
    numbers: Range<usize>,
    of_path: impl Fn(Ray, Sampler) -> T + Sync,
) -> Vec<T> {
    let size @ [width, height] = view.whole_size();
    let rays = CameraRays::new(&view.camera, width, height);
    let places: Vec<Vec2> = places(size).collect();
    let of_index = |index: usize| {
        let (number, place) = (numbers.start + index / places.len(), index % places.len());
        let sampler = Sampler::new(SEED, place as u32, number as u32);
        of_path(rays.ray(places[place], Vec2::ZERO), sampler)
    };
    (0..numbers.len() * places.len()).into_par_iter().map(of_index).collect()
}

/// Parts of the picture along each axis whose share of light from targets is found.
const PARTS: u32 = 4;
/// Estimates of that share, an odd number.
const ESTIMATES: usize = 5;
/// Least share of the light that must come from targets to be aimed at.
const MIN_SHARE: f32 = 0.1;
/// Probability of aiming at them over that share: the rest of the light is found by the other paths alone.
const AIM_OF_SHARE: f32 = 0.5;

/// The lights inside the scene that count, with targets to be aimed at if they bring enough of the light; `None` are
/// all of the world. NEE goes by these distributions.
pub(super) fn lights_of(
    lit: Lit<'_>,
    view: &View,
    grid: Option<&LightGrid>,
) -> Option<LocalLights> {
    let chosen = view.chosen_lights(lit.0);
    if view.sampling != Sampling::Adaptive || view.limits.bounces < 2 {
        return chosen;
    }
    let lights = chosen.as_ref().unwrap_or(&lit.0.lights);
    let conditions = conditions_of(view);
    let limits = conditions.limits;
    let tracer = PathTracer { lights, limits, layers: false, ..view.tracer(lit, grid) };
    let Some(targets) = lit.0.targets.of(lit.1, conditions, || {
        // All views of the scene are to aim alike.
        let grid = LightGrid::whole_map(lit.1.tile_energies());
        PathTracer { grid: grid.as_ref(), ..tracer }.aim_targets()
    }) else {
        return chosen;
    };
    let aiming = Some(Aiming { targets, probability: 0.5 });
    let mut lights = LocalLights { aiming, ..lights.clone() };
    let share = share_of_targets(&PathTracer { lights: &lights, ..tracer }, view);
    if share < MIN_SHARE {
        return chosen;
    }
    if let Some(aiming) = &mut lights.aiming {
        aiming.probability = AIM_OF_SHARE * share;
    }
    Some(lights)
}

/// What decides how bright targets are for a view, beside the map. A few bounces tell.
fn conditions_of(view: &View) -> Conditions {
    let limits = PathLimits { bounces: view.limits.bounces.min(4), ..view.limits };
    Conditions { limits, medium: view.medium, lights: view.local_lights.clone() }
}

/// Share of the picture's light that comes straight from targets: the median of some estimates, for a few paths that a
/// metal dazzles make one far too large.
fn share_of_targets(tracer: &PathTracer<'_>, view: &View) -> f32 {
    let numbers = PATHS..PATHS + ESTIMATES;
    let found = of_paths(view, numbers, |ray, sampler| tracer.light_of_targets(ray, sampler));
    let mut shares: Vec<f32> = found.chunks(found.len() / ESTIMATES).map(mean_share).collect();
    shares.sort_unstable_by(f32::total_cmp);
    shares[ESTIMATES / 2]
}

/// Share of light from targets by one path through each place, with all its light: the mean over parts of the picture,
/// for what a lamp shines on near by may be brighter than all the rest.
fn mean_share(of_places: &[[f32; 2]]) -> f32 {
    let mut parts = [[0.0; 2]; (PARTS * PARTS) as usize];
    for (index, light) in (0..).zip(of_places) {
        let part = [index % LOOKS, index / LOOKS].map(|place| place * PARTS / LOOKS);
        let sums = &mut parts[(part[1] * PARTS + part[0]) as usize];
        *sums = [sums[0] + light[0], sums[1] + light[1]];
    }
    let lit = parts.iter().filter(|[_, all]| *all > 0.0 && all.is_finite());
    let shares: Vec<f32> = lit.map(|[some, all]| some / all).collect();
    shares.iter().sum::<f32>() / f32::max(shares.len() as f32, 1.0)
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
pub(super) mod tests {
    use std::sync::Arc;

    use glam::Vec3;

    use super::*;
    use crate::environment::{Environment, EnvironmentOptions, sky};
    use crate::image::Image;
    use crate::math::uv_from_direction;
    use crate::path::{PathLimits, WorldBuilder};
    use crate::render::Sharing;
    use crate::render::film::{Film, Pixel};
    use crate::render::filter::PixelFilter;
    use crate::render::gpu::Gpu;
    use crate::render::light_groups::tests::{mean, rendered};
    use crate::scene::{Camera, Material};

    /// Cloth, and glass that spreads what it lets through.
    pub(in crate::render) fn translucent_materials() -> [Material; 2] {
        let cloth = Material { diffuse_transmission: 0.6, ..Material::lambert(0.8) };
        let frosted =
            Material { roughness: 0.3, transmission: 1.0, thickness: 0.1, ..Material::default() };
        [cloth, frosted]
    }

    /// A room whose window is shut by such a material, its map, and a view that does not see the window.
    pub(in crate::render) fn shut_room(material: &Material) -> (World, Environment, View) {
        let [shut_low, shut_high] = [Vec3::new(-0.5, -0.4, 2.05), Vec3::new(0.5, 0.6, 2.1)];
        let faces = if material.has_inside() { 0..6 } else { 4..5 };
        let world = room_with_window().faces(material, shut_low, shut_high, faces).build();
        let map = sky::build("day", 64, 32).expect("a sky");
        let environment =
            Environment::new(map, &EnvironmentOptions::default()).expect("a sound map");
        (world, environment, view_from_window())
    }

    /// A room into which the sun shines, onto a block of metal on its floor; its map and a view.
    fn room_with_metal(roughness: f32) -> (World, Environment, View) {
        let metal = Material { metallic: 1.0, roughness, ..Material::lambert(0.9) };
        let [low, high] = [Vec3::new(-0.4, -1.5, -0.7), Vec3::new(0.4, -1.4, 0.1)];
        let world = room_with_window().faces(&metal, low, high, 0..6).build();
        let mut map = Image::filled(64, 32, [0.2; 3]);
        // Through the window down to the block.
        let uv = uv_from_direction(Vec3::new(0.0, 0.65, 1.0).normalize());
        let [x, y] = [(uv.x * 64.0) as usize, (uv.y * 32.0) as usize];
        map.pixels[64 * y + x] = [5e3; 3];
        let environment =
            Environment::new(map, &EnvironmentOptions::default()).expect("a sound map");
        (world, environment, view_from_window())
    }

    /// The room without what shuts its window.
    fn room_with_window() -> WorldBuilder {
        let grey = Material::lambert(0.6);
        let [low, high] = [Vec3::new(-2.0, -1.5, -2.0), Vec3::new(2.0, 1.5, 2.0)];
        let walls = WorldBuilder::default().faces(&grey, low, high, 0..4).face(&grey, low, high, 5);
        // What is left of the wall with the window.
        let rest = [
            ([-2.0, -1.5], [1.5, 3.0]),
            ([0.5, -1.5], [1.5, 3.0]),
            ([-0.5, -1.5], [1.0, 1.1]),
            ([-0.5, 0.6], [1.0, 0.9]),
        ];
        rest.into_iter().fold(walls, |room, (corner, size)| {
            let corner = Vec3::from((corner[0], corner[1], 2.0));
            room.quad(&grey, corner, Vec3::X * size[0], Vec3::Y * size[1])
        })
    }

    fn view_from_window() -> View {
        let camera = Camera::look_at(Vec3::new(0.0, 0.0, 1.5), Vec3::NEG_Z, 1.0);
        View {
            filter: PixelFilter::Box,
            sharing: Sharing::Off,
            learning_paths: 1 << 12,
            limits: PathLimits { bounces: 5, ..PathLimits::default() },
            ..View::new(camera, [32, 24])
        }
    }

    /// Probability with which paths of such a view aim.
    fn aim_probability((world, map, view): (&World, &Environment, &View)) -> Option<f32> {
        let grid = LightGrid::whole_map(map.tile_energies());
        let lights = lights_of((world, map), view, grid.as_ref())?;
        lights.aiming.map(|aiming| aiming.probability)
    }

    #[test]
    fn paths_aim_where_light_comes_through_scattered() {
        let probability = |material: &Material, map: &Environment| {
            let (world, _, view) = shut_room(material);
            aim_probability((&world, map, &view))
        };
        let [cloth, frosted] = translucent_materials();
        let (_, map, _) = shut_room(&cloth);
        for material in [&cloth, &frosted] {
            let found = probability(material, &map);
            assert!(found.is_some_and(|found| (0.15..0.5).contains(&found)), "{found:?}");
        }
        let clear = Material { roughness: 0.0, ..frosted.clone() };
        assert_eq!(probability(&clear, &map), None, "shadow rays follow it");
        let mut dark = map.clone();
        dark.set_intensity(0.0);
        assert_eq!(probability(&cloth, &dark), None, "no light comes through");
    }

    #[test]
    fn paths_aim_at_metal_that_the_sun_shines_on() {
        let probability = |roughness: f32| {
            let (world, map, view) = room_with_metal(roughness);
            aim_probability((&world, &map, &view))
        };
        let found = probability(0.2);
        assert!(found.is_some_and(|found| (0.05..0.5).contains(&found)), "{found:?}");
        assert_eq!(probability(0.0), None, "NEE finds nothing on a mirror");
        assert_eq!(probability(0.8), None, "other paths find what dull metal throws");
    }

    #[test]
    fn targets_are_looked_for_once_in_each_light() {
        let (world, mut map, view) = room_with_metal(0.2);
        let found = |map: &Environment, view: &View| {
            aim_probability((&world, map, view));
            world.targets.of(map, conditions_of(view), || None).expect("there is metal")
        };
        let first = found(&map, &view);
        let camera = Camera::look_at(Vec3::ZERO, Vec3::NEG_Z, 1.0);
        let moved = View { camera, ..view.clone() };
        assert!(Arc::ptr_eq(&first, &found(&map, &moved)));
        map.set_rotation(0.1);
        assert!(!Arc::ptr_eq(&first, &found(&map, &view)));
    }

    #[test]
    fn aiming_changes_the_noise_alone_on_both_devices() {
        let shut = translucent_materials().map(|material| shut_room(&material));
        for (world, environment, view) in shut.into_iter().chain([room_with_metal(0.2)]) {
            let lit = (&world, &environment);
            let plain = View { sampling: Sampling::Plain, ..view.clone() };
            let reference = rendered(lit, View { seed: 3, ..plain.clone() }, 1024, None);
            let expected = mean(&reference);
            let assert_agrees = |view: View, gpu: Option<&Gpu>| {
                let what = format!("{:?}, on a GPU: {}", view.sharing, gpu.is_some());
                let film = rendered(lit, view, 64, gpu);
                let [found, variance] = mean(&film);
                let z = (found - expected[0]) / (variance + expected[1]).sqrt();
                // Pixels that share are not independent.
                assert!(z.abs() < 6.0, "{what}: {found} and {expected:?}, {z} standard errors");
                film
            };
            let median_error = |film: &Film| {
                let pixels = film.pixels().iter().zip(reference.pixels());
                let error =
                    |(a, b): (&Pixel, &Pixel)| (a.mean_luminance() - b.mean_luminance()).abs();
                let mut errors: Vec<f64> = pixels.map(error).collect();
                errors.sort_unstable_by(f64::total_cmp);
                errors[errors.len() / 2]
            };
            let [aimed, plain] =
                [assert_agrees(view.clone(), None), rendered(lit, plain, 64, None)]
                    .map(|film| median_error(&film));
            eprintln!("median errors: {aimed}, {plain} by BSDFs alone");
            // The reference has noise of its own. Of a caustic, few pixels have most of the error.
            let is_caustic = world.scene.materials.iter().any(|material| material.metallic > 0.0);
            assert!(is_caustic || aimed < 0.95 * plain, "{aimed} {plain}");
            let shared = View { sharing: Sharing::Large, ..view.clone() };
            assert_agrees(shared.clone(), None);
            #[cfg(feature = "gpu")]
            if let Some(gpu) = Gpu::for_test() {
                assert_agrees(view.clone(), Some(&gpu));
                assert_agrees(shared, Some(&gpu));
                let fog =
                    crate::scene::Medium { scattering: Vec3::splat(0.2), ..Default::default() };
                let foggy = View { medium: Some(fog), ..view.clone() };
                let in_fog = mean(&rendered(lit, foggy.clone(), 256, None));
                let [found, variance] = mean(&rendered(lit, foggy, 256, Some(&gpu)));
                let z = (found - in_fog[0]) / (variance + in_fog[1]).sqrt();
                assert!(z.abs() < 2.0, "{found} and {in_fog:?} in fog, {z} standard errors");
                let cached = View { gi: crate::render::Gi::Cached, ..view };
                let [[on_cpu, _], [on_gpu, _]] =
                    [None, Some(&gpu)].map(|gpu| mean(&rendered(lit, cached.clone(), 256, gpu)));
                assert!((on_cpu / on_gpu - 1.0).abs() < 0.02, "{on_cpu} {on_gpu}");
            }
        }
    }

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
