//! Paths that end in the radiance cache: nearly the same picture, with less noise.

use std::sync::atomic::AtomicBool;

use glam::{DVec3, Vec3, Vec4};
use lightgrid::environment::sky;
use lightgrid::path::{Background, PathLimits, World, WorldBuilder};
use lightgrid::render::film::Film;
use lightgrid::render::{Gi, Sampling, Session, Sharing, View};
use lightgrid::scene::{Camera, Material, PunctualKind, PunctualLight};

use super::scenes::{lambert, lamp, painted, room, sunlight, varnish};
use super::{constant, environment, learned, mean, render, view};

fn picture(camera: &Camera, gi: Gi, seed: u32) -> View {
    View {
        width: 32,
        height: 32,
        seed,
        gi,
        sharing: Sharing::Off,
        limits: PathLimits { bounces: 5, russian_roulette: true },
        ..view(camera.clone(), Sampling::Adaptive, 5)
    }
}

/// Relative RMS difference of the means of 8x8 pixels, which have little noise.
fn difference(film: &Film, truth: &Film) -> f64 {
    let blocks = |film: &Film| -> Vec<f64> {
        let mut blocks = vec![0.0; 16];
        for (at, pixel) in film.pixels().iter().enumerate() {
            blocks[at / 256 * 4 + at % 32 / 8] += pixel.mean_luminance();
        }
        blocks
    };
    let squares = |values: Vec<f64>| values.iter().map(|value| value * value).sum::<f64>();
    let (found, truth) = (blocks(film), blocks(truth));
    let difference = found.iter().zip(&truth).map(|(a, b)| a - b).collect();
    (squares(difference) / squares(truth)).sqrt()
}

#[test]
fn a_room_is_as_bright_and_less_noisy() {
    let (world, camera) = room(0.7, None);
    let sky = environment(sky::build("overcast", 64, 32).expect("a sky"));
    let truth = render(&world, &sky, picture(&camera, Gi::Exact, 7), 512);
    let [exact, cached] =
        [Gi::Exact, Gi::Cached].map(|gi| render(&world, &sky, picture(&camera, gi, 1), 64));
    let off = mean(&cached).luminance / mean(&truth).luminance - 1.0;
    let bias = difference(&cached, &truth);
    let gain = (mean(&exact).standard_error / mean(&cached).standard_error).powi(2);
    eprintln!("mean {:+.2} %, blocks {:.2} %, variance / {gain:.1}", 100.0 * off, 100.0 * bias);
    assert!(off.abs() < 0.02, "{off}");
    assert!(bias < 0.05, "{bias}");
    assert!(gain > 1.4, "{gain}");
}

/// Paths end in the cached radiance of the paint below polish and varnish.
#[test]
fn polished_and_varnished_rooms_are_as_bright_and_less_noisy() {
    let red = |material| Material { base_color: Vec4::new(0.9, 0.2, 0.1, 1.0), ..material };
    for (what, paint) in [("polish", varnish(0.1, 1.0)), ("varnish", red(varnish(1.0, 0.1)))] {
        let (world, camera) = painted(&paint);
        let sky = environment(sky::build("overcast", 64, 32).expect("a sky"));
        let truth = render(&world, &sky, picture(&camera, Gi::Exact, 7), 512);
        let rendered = |gi| {
            let mut session = learned(&world, &sky, picture(&camera, gi, 1));
            session.advance(64, &AtomicBool::new(false)).expect("the CPU does not fail");
            (session.film().clone(), session.figures().rays as f64)
        };
        let [(exact, rays), (cached, cached_rays)] = [Gi::Exact, Gi::Cached].map(rendered);
        let colors = |film: &Film| {
            let pixels = film.pixels().iter().map(|pixel| DVec3::from(pixel.mean()));
            pixels.sum::<DVec3>() / film.pixels().len() as f64
        };
        let off = colors(&cached) / colors(&truth) - 1.0;
        let gain = (mean(&exact).standard_error / mean(&cached).standard_error).powi(2);
        let fewer_rays = rays / cached_rays;
        eprintln!("{what}: mean {off:+.4}, variance / {gain:.2}, rays / {fewer_rays:.2}");
        assert!(off.abs().max_element() < 0.02, "{what}: {off}");
        assert!(difference(&cached, &truth) < 0.05, "{what}");
        assert!(gain * fewer_rays > 1.5, "{what}: {gain} {fewer_rays}");
    }
}

/// In a closed box that glows all over, a path finds the same wherever it goes.
#[test]
fn a_glowing_box_is_as_bright_as_its_bounces_make_it() {
    let glow = Material { emissive: Vec3::splat(0.3), ..lambert(0.5) };
    let world =
        WorldBuilder::default().faces(&glow, Vec3::splat(-2.0), Vec3::splat(2.0), 0..6).build();
    let camera = Camera::look_at(Vec3::new(0.3, 0.2, 0.1), Vec3::new(1.0, 0.5, -2.0), 1.0);
    for bounces in [2, 3, 6] {
        let limits = PathLimits { bounces, russian_roulette: false };
        let view = View { limits, ..picture(&camera, Gi::Cached, 1) };
        let film = render(&world, &constant(1.0), view, 16);
        let expected = 0.3 * (0..=bounces).map(|k| 0.5_f64.powi(k as i32)).sum::<f64>();
        let found = mean(&film).luminance;
        eprintln!("{bounces} bounces: {found:.4} for {expected:.4}");
        assert!((found / expected - 1.0).abs() < 0.01, "{bounces}: {found} for {expected}");
    }
}

/// A lamp without size makes what is near it far brighter than its intensity is a number.
#[test]
fn what_a_near_lamp_shines_on_is_not_cut_short() {
    let side = Vec3::splat(0.05);
    // Fronts inside.
    let bulb = PunctualLight {
        kind: PunctualKind::Point,
        position: Vec3::new(0.0, 0.038, 0.0),
        ..sunlight(Vec3::Y, 10.0)
    };
    let world = WorldBuilder::default().faces(&lambert(0.7), side, -side, 0..6).light(bulb).build();
    let camera = Camera::look_at(Vec3::new(0.0, 0.0, 0.045), Vec3::new(0.0, -0.02, 0.0), 1.2);
    let means = [Gi::Exact, Gi::Cached]
        .map(|gi| mean(&render(&world, &constant(0.0), picture(&camera, gi, 1), 128)).luminance);
    eprintln!("{:.3} for {:.3}", means[1], means[0]);
    assert!(means[0] > 0.0 && (means[1] / means[0] - 1.0).abs() < 0.05, "{means:?}");
}

/// Two closed rooms with a wall of 5 cm between them, a lamp in one, and a camera that sees both, for it
/// stands inside of the wall.
#[test]
fn closed_rooms_are_dark_and_thin_walls_hardly_leak() {
    let (wall, [low, high]) =
        (lambert(0.8), [-1.0, 1.0].map(|x| Vec3::new(4.0 * x, 1.25 * x, 2.0 * x)));
    let half = |side: f32| {
        let (near, far) = (Vec3::new(0.025, low.y, low.z), Vec3::new(4.0, high.y, high.z));
        let mirrored = |v: Vec3| Vec3::new(side * v.x, v.y, v.z);
        (mirrored(near).min(mirrored(far)), mirrored(near).max(mirrored(far)))
    };
    let rooms = |with_lamp: bool| {
        let mut builder = WorldBuilder::default();
        for side in [-1.0, 1.0] {
            let (low, high) = half(side);
            // Fronts inside.
            builder = builder.faces(&wall, high, low, 0..6);
        }
        if with_lamp {
            builder =
                builder.quad(&lamp(20.0), [-2.5, 1.2, -0.5], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
        }
        builder.build()
    };
    // Above and behind, through the ceiling, which is not seen from outside.
    let camera = Camera::look_at(Vec3::new(0.0, 7.0, 0.1), Vec3::new(0.0, -1.0, 0.0), 1.2);
    let single_sided = |world: World| {
        let mut scene = world.scene.clone();
        scene.materials.iter_mut().for_each(|material| material.double_sided = false);
        World::new(scene)
    };
    let film_of = |with_lamp| {
        let view =
            View { background: Background::Color([0.0; 3]), ..picture(&camera, Gi::Cached, 1) };
        render(&single_sided(rooms(with_lamp)), &constant(1.0), view, 64)
    };
    let brightest = |film: &Film, columns: std::ops::Range<usize>| {
        let pixels = film.pixels().iter().enumerate();
        let of = pixels.filter(|(at, _)| columns.contains(&(at % 32)));
        of.map(|(_, pixel)| pixel.mean_luminance()).fold(0.0, f64::max)
    };
    let dark = film_of(false);
    assert!(brightest(&dark, 0..32) == 0.0, "no light gets in");
    let lit = film_of(true);
    assert_eq!(lit.invalid_samples(), 0);
    let (light, leak) = (brightest(&lit, 17..32), brightest(&lit, 0..15));
    eprintln!("{leak:.5} beside {light:.3}");
    assert!(light > 0.5, "the lamp is seen to shine: {light}");
    assert!(leak < 0.01 * light, "{leak} leaks through the wall");
}

#[test]
fn the_same_bits_for_any_threads_and_after_a_cancel() {
    let (world, camera) = room(0.7, None);
    let sky = environment(sky::build("overcast", 64, 32).expect("a sky"));
    let view = picture(&camera, Gi::Cached, 3);
    let film_of = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| render(&world, &sky, view.clone(), 5))
    };
    let film = film_of(1);
    assert!(film == film_of(3), "as many threads as there may be");

    let mut session = learned(&world, &sky, view);
    for samples in 0..5 {
        session.advance(1, &AtomicBool::new(true)).expect("cancelled");
        assert_eq!(session.samples(), samples);
        while session.samples() == samples {
            advance_for_a_moment(&mut session);
        }
    }
    assert!(&film == session.film(), "cut short or not");
}

fn advance_for_a_moment(session: &mut Session<'_>) {
    let cancel = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            std::thread::sleep(std::time::Duration::from_millis(15));
            cancel.store(true, std::sync::atomic::Ordering::Relaxed);
        });
        session.advance(1, &cancel).expect("the CPU does not fail");
    });
}
