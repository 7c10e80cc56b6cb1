//! Fog and scattering solids, against closed forms and quadrature.

use std::f64::consts::PI;

use glam::{Vec2, Vec3};
use lightgrid::environment::{Environment, sky};
use lightgrid::medium::Phase;
use lightgrid::metrics::hypothesis::chi_square_test;
use lightgrid::path::{World, WorldBuilder};
use lightgrid::render::film::Film;
use lightgrid::render::{Sampling, View};
use lightgrid::sampler::SplitMix;
use lightgrid::scene::needs::SceneFeatures;
use lightgrid::scene::{Medium, PunctualKind, PunctualLight};

use super::scenes::{black, lamp, room, smoked_glass, sunlight, unlit};
use super::unbiased::expect_agreement;
use super::{MODES, constant, environment, expect, mean, probe, render, view};

/// A cube of side 2 around the origin.
fn cube(scattering: f32, absorption: f32, anisotropy: f32) -> Medium {
    Medium {
        scattering: Vec3::splat(scattering),
        absorption: Vec3::splat(absorption),
        anisotropy,
        bounds: Some([Vec3::NEG_ONE, Vec3::ONE]),
    }
}

/// A wall behind the cube as seen by [`ahead`].
fn wall(radiance: f32) -> World {
    let (corner, x, y) = ([-9.0, -9.0, -3.0], [18.0, 0.0, 0.0], [0.0, 18.0, 0.0]);
    WorldBuilder::default().quad(&unlit(radiance), corner, x, y).build()
}

/// Straight through the cube, two metres of it.
fn ahead(sampling: Sampling, bounces: u32, medium: Medium) -> View {
    let camera = probe([0.0, 0.0, 3.0], [0.0; 3]);
    View { medium: Some(medium), ..view(camera, sampling, bounces) }
}

#[test]
fn absorption_follows_beer_and_lambert() {
    let world = wall(0.8);
    for depth in [1e-6_f64, 0.3, 5.0] {
        let medium = cube(0.0, 0.5 * depth as f32, 0.0);
        let film = render(&world, &constant(0.0), ahead(Sampling::Plain, 2, medium), 4);
        expect(&format!("depth {depth}"), &film, 0.8 * (-depth).exp(), 1e-4);
    }
    let rgb = Medium { absorption: Vec3::new(0.0, 0.5, 2.0), ..cube(0.0, 0.0, 0.0) };
    let film = render(&world, &constant(0.0), ahead(Sampling::Plain, 2, rgb), 4);
    for (value, depth) in mean(&film).rgb.into_iter().zip([0.0, 1.0, 4.0_f64]) {
        assert!((value - 0.8 * (-depth).exp()).abs() < 1e-6, "{value} at depth {depth}");
    }
    let film = render(&world, &constant(0.0), ahead(Sampling::Plain, 2, cube(0.0, 5e3, 0.0)), 4);
    assert!(film.pixels().iter().all(|p| p.mean() == [0.0; 3]), "nothing comes through 1e4");
}

#[test]
fn what_is_scattered_is_missing_behind() {
    let world = wall(0.8);
    let medium = Medium { scattering: Vec3::new(0.1, 0.3, 0.9), ..cube(0.0, 0.1, 0.5) };
    let film = render(&world, &constant(0.0), ahead(Sampling::Plain, 0, medium), 1 << 14);
    let found = mean(&film);
    for (c, (value, scattering)) in found.rgb.into_iter().zip([0.1, 0.3, 0.9]).enumerate() {
        let expected = 0.8 * (-2.0 * (scattering + 0.1_f64)).exp();
        assert!((value - expected).abs() < 2e-3, "channel {c}: {value} for {expected}");
    }
}

/// Henyey and Greenstein in f64.
fn phase(g: f64, cos: f64) -> f64 {
    (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cos).powf(1.5))
}

/// Single scattering along the z axis through the cube: `light(z)` is the irradiance on a facing
/// plane at a point, the cosine of its deflection into the eye, and its way in the cube.
fn single_scattering(
    scattering: f64,
    extinction: f64,
    g: f64,
    light: impl Fn(f64) -> (f64, f64, f64),
) -> f64 {
    const STEPS: u32 = 20_000;
    let step = 2.0 / f64::from(STEPS);
    let ways = (0..STEPS).map(|i| (f64::from(i) + 0.5) * step);
    let at = |way: f64| {
        let (irradiance, cos, inside) = light(1.0 - way);
        scattering * phase(g, cos) * irradiance * (-extinction * (way + inside)).exp()
    };
    ways.map(at).sum::<f64>() * step
}

#[test]
fn single_scattering_matches_quadrature() {
    let lit = |light: PunctualLight| {
        let far = ([90.0, -1.0, -1.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]);
        WorldBuilder::default().quad(&black(), far.0, far.1, far.2).light(light).build()
    };
    let sun = lit(sunlight(Vec3::NEG_Y, 3.0));
    let point = lit(PunctualLight {
        kind: PunctualKind::Point,
        position: Vec3::new(2.0, 0.0, 0.5),
        ..sunlight(Vec3::NEG_Y, 5.0)
    });
    for (g, scattering, absorption) in [(0.0, 0.4, 0.2), (0.7, 1.5, 0.1), (-0.5, 1e-2, 0.0)] {
        let (medium, extinction) =
            (cube(scattering as f32, absorption as f32, g as f32), scattering + absorption);
        // Light that travels along -Y is turned by a right angle towards the eye at +Z.
        let from_sun = single_scattering(scattering, extinction, g, |_| (3.0, 0.0, 1.0));
        let from_point = single_scattering(scattering, extinction, g, |z| {
            let (x, dz) = (2.0, 0.5 - z);
            let squared: f64 = x * x + dz * dz;
            let distance = squared.sqrt();
            // It leaves the cube at x = 1, half-way.
            (5.0 / squared, -dz / distance, 0.5 * distance)
        });
        let samples = if scattering < 0.1 { 1 << 13 } else { 1 << 12 };
        let precision = if scattering < 0.1 { 0.05 } else { 0.01 };
        for (what, world, expected) in [("sun", &sun, from_sun), ("point", &point, from_point)] {
            let film = render(world, &constant(0.0), ahead(Sampling::Plain, 1, medium), samples);
            expect(&format!("{what}, g {g}, {scattering}"), &film, expected, precision);
        }
    }
}

#[test]
fn a_white_medium_in_uniform_light_is_invisible() {
    let far =
        WorldBuilder::default().quad(&black(), [90.0; 3], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0]).build();
    for (scattering, g) in [(0.5, 0.0), (2.0, 0.6), (1e-6, -0.3)] {
        for mode in MODES {
            let view = ahead(mode, 400, cube(scattering, 0.0, g));
            let film = render(&far, &constant(1.5), view, 64);
            expect(&format!("{mode:?}, {scattering}, g {g}"), &film, 1.5, 0.02);
        }
    }
}

#[test]
fn a_white_solid_in_uniform_light_is_invisible() {
    let milk = lightgrid::scene::Material {
        attenuation_distance: f32::INFINITY,
        scattering: Vec3::new(0.5, 1.0, 2.0),
        scatter_anisotropy: 0.4,
        ..smoked_glass()
    };
    let world =
        WorldBuilder::default().faces(&milk, Vec3::splat(-0.5), Vec3::splat(0.5), 0..6).build();
    assert!(world.needs.has(SceneFeatures::SCATTERING_SOLIDS));
    let camera = probe([1.0, 2.0, 3.0], [0.1, 0.2, 0.0]);
    for mode in MODES {
        let film = render(&world, &constant(1.0), view(camera.clone(), mode, 1000), 64);
        expect(&format!("{mode:?}"), &film, 1.0, 0.02);
    }
}

/// Chandrasekhar's H function for even scattering of this albedo (*Radiative Transfer*, 1950, chapter
/// 5), by iteration of 1/H = sqrt(1 - albedo) + albedo/2 int x H(x) / (x + mu) dx.
fn h_function(albedo: f64, mu: f64) -> f64 {
    const STEPS: usize = 400;
    let node = |i: usize| (i as f64 + 0.5) / STEPS as f64;
    let mut h = vec![1.0; STEPS];
    let next = |h: &[f64], mu: f64| {
        let sum: f64 = h.iter().enumerate().map(|(i, h)| node(i) * h / (node(i) + mu)).sum();
        1.0 / ((1.0 - albedo).sqrt() + 0.5 * albedo * sum / STEPS as f64)
    };
    for _ in 0..200 {
        h = (0..STEPS).map(|i| next(&h, node(i))).collect();
    }
    next(&h, mu)
}

#[test]
fn a_dense_medium_reflects_like_a_half_space() {
    let far =
        WorldBuilder::default().quad(&black(), [90.0; 3], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0]).build();
    for albedo in [0.3, 0.8] {
        // What uniform light makes of a half-space: 1 - H(mu) sqrt(1 - albedo).
        let expected = 1.0 - h_function(albedo, 1.0) * (1.0 - albedo).sqrt();
        let medium = cube(5e3 * albedo as f32, 5e3 * (1.0 - albedo) as f32, 0.0);
        for mode in [Sampling::Bsdf, Sampling::Adaptive] {
            let film = render(&far, &constant(1.0), ahead(mode, 300, medium), 512);
            expect(&format!("{mode:?}, albedo {albedo}"), &film, expected, 0.03);
        }
    }
}

#[test]
fn phase_samples_follow_henyey_and_greenstein() {
    const SAMPLES: usize = 100_000;
    const BINS: usize = 64;
    let mut random = SplitMix(4);
    let axis = Vec3::new(0.48, -0.6, 0.64);
    for g in [-0.99_f64, -0.5, -1e-4, 0.0, 1e-3, 0.3, 0.9, 0.99] {
        let phase_function = Phase::new(g as f32);
        let below = |cos: f64| {
            if g.abs() < 1e-3 {
                0.5 * (1.0 + cos) + 0.75 * g * (cos * cos - 1.0)
            } else {
                let root = (1.0 + g * g - 2.0 * g * cos).sqrt();
                (1.0 - g * g) / (2.0 * g) * (1.0 / root - 1.0 / (1.0 + g))
            }
        };
        // Bins by cosine, in each half of the azimuth.
        let edge = |i: usize| -1.0 + 2.0 * i as f64 / BINS as f64;
        let expected: Vec<f64> = (0..2 * BINS)
            .map(|i| 0.5 * (below(edge(i / 2 + 1)) - below(edge(i / 2))) * SAMPLES as f64)
            .collect();
        let mut observed = vec![0.0; 2 * BINS];
        for _ in 0..SAMPLES {
            let direction =
                phase_function.sample(axis, Vec2::new(random.next_f32(), random.next_f32()));
            assert!((direction.length() - 1.0).abs() < 1e-4);
            let cos = direction.dot(axis);
            let bin = (((cos + 1.0) * 0.5 * BINS as f32) as usize).min(BINS - 1);
            observed[2 * bin + usize::from(direction.cross(axis).y > 0.0)] += 1.0;
        }
        let test = chi_square_test(&observed, &expected, 1e-4).expect("two cells or more");
        assert!(test.passed, "g {g}: {test:?}");
        for cos in [-1.0_f64, -0.3, 0.0, 0.7, 0.999, 1.0] {
            let found = f64::from(phase_function.pdf_solid_angle(cos as f32));
            let exact = phase(g, cos);
            assert!((found / exact - 1.0).abs() < 2e-2, "g {g}, cos {cos}: {found} for {exact}");
        }
    }
}

fn foggy_room() -> (World, Environment, View) {
    let (world, camera) = room(0.7, None);
    let medium = Medium {
        scattering: Vec3::new(0.15, 0.2, 0.3),
        absorption: Vec3::new(0.02, 0.01, 0.0),
        anisotropy: 0.6,
        bounds: None,
    };
    let environment = environment(sky::build("overcast", 64, 32).expect("a sky"));
    (world, environment, View { medium: Some(medium), ..view(camera, Sampling::Plain, 4) })
}

#[test]
fn every_mode_agrees_in_a_foggy_room() {
    let (world, environment, view) = foggy_room();
    let film =
        |sampling, seed| render(&world, &environment, View { seed, sampling, ..view.clone() }, 512);
    let plain = film(Sampling::Plain, 1);
    for (seed, mode) in [(2, Sampling::Bsdf), (3, Sampling::Talk), (4, Sampling::Adaptive)] {
        expect_agreement(&format!("{mode:?}"), &plain, &film(mode, seed), 0.08);
    }
}

#[test]
fn lamps_shine_alike_with_and_without_sampling_them() {
    // The same panel as a lamp and as unlit paint, which nothing samples.
    let (x, y) = ([1.2, 0.0, 0.0], [0.0, 0.0, -1.2]);
    let film = |panel, seed| {
        let world = WorldBuilder::default().quad(&panel, [-0.6, 0.9, 0.6], x, y).build();
        let view = ahead(Sampling::Plain, 3, cube(0.8, 0.1, 0.5));
        render(&world, &constant(0.1), View { seed, ..view }, 4096)
    };
    let (sampled, found): (Film, Film) = (film(lamp(0.9), 1), film(unlit(0.9), 2));
    expect_agreement("lamp", &sampled, &found, 0.03);
}

#[test]
fn a_medium_out_of_sight_changes_nothing() {
    let (world, environment, view) = foggy_room();
    let elsewhere = Medium {
        bounds: Some([Vec3::splat(50.0), Vec3::splat(51.0)]),
        ..view.medium.expect("a medium")
    };
    // Not the adaptive mode: a grid that knows of a medium has more cells.
    for sampling in [Sampling::Bsdf, Sampling::Plain, Sampling::Talk] {
        let film =
            |medium| render(&world, &environment, View { sampling, medium, ..view.clone() }, 4);
        let clear = film(Some(Medium::default()));
        assert!(film(Some(elsewhere)) == clear, "{sampling:?}");
        assert!(film(view.medium) != clear, "{sampling:?}");
    }
}
