//! Whatever chooses the samples, the expectation is the same: pixel by pixel and over the picture.

use std::sync::atomic::AtomicBool;

use lightgrid::environment::{Environment, EnvironmentOptions, TableKind, sky};
use lightgrid::image::Image;
use lightgrid::light_grid::cells::SphericalGrid;
use lightgrid::light_grid::{DistributionOptions, LightGrid, RenderedPaths};
use lightgrid::path::World;
use lightgrid::render::film::Film;
use lightgrid::render::{Sampling, Session, StopRule, View};
use lightgrid::scene::builtin;
use rayon::prelude::*;

use super::scenes::{pane, room};
use super::{environment, expect_same_mean, learned, mean, probe, render, view};
use crate::z_test::expect_same_pixels;

/// Chance that a sound estimator fails one comparison.
const ALPHA: f64 = 1e-3;

/// Asserts that two pictures of different seeds agree in every pixel and in the mean.
pub(super) fn expect_agreement(what: &str, a: &Film, b: &Film, precision: f64) {
    expect_same_pixels(what, a, b, ALPHA);
    expect_same_mean(what, a, b, precision);
}

/// Soft light from all over, brighter upwards and to one side.
fn soft_map() -> Image {
    sky::build("overcast", 64, 32).expect("a sky")
}

#[test]
fn every_mode_agrees_with_plain_sampling_in_a_room() {
    let environment = environment(soft_map());
    for (glazing, window) in [("open", None), ("glazed", Some(pane()))] {
        let (world, camera) = room(0.7, window.as_ref());
        let film = |sampling, seed| {
            render(&world, &environment, View { seed, ..view(camera.clone(), sampling, 4) }, 512)
        };
        let plain = film(Sampling::Plain, 1);
        for (seed, mode) in [(2, Sampling::Bsdf), (3, Sampling::Talk), (4, Sampling::Adaptive)] {
            let what = format!("{glazing}, {mode:?}");
            expect_agreement(&what, &plain, &film(mode, seed), 0.05);
        }
    }
}

#[test]
fn every_table_agrees_with_sampling_by_the_bsdf() {
    let (world, camera) = room(0.7, None);
    let film = |table, sampling, seed| {
        let options = EnvironmentOptions { table, rotation_radians: 0.7, ..Default::default() };
        let environment = Environment::new(soft_map(), &options).expect("a sound map");
        render(&world, &environment, View { seed, ..view(camera.clone(), sampling, 2) }, 512)
    };
    let reference = film(TableKind::default(), Sampling::Bsdf, 1);
    for (seed, table) in (2..).zip(TableKind::ALL) {
        let found = film(table, Sampling::Adaptive, seed);
        expect_agreement(&table.to_string(), &reference, &found, 0.06);
    }
}

#[test]
fn a_grid_full_of_garbage_is_noisy_but_right() {
    let environment = environment(soft_map());
    let (world, camera) = room(0.7, None);
    let plain = render(&world, &environment, view(camera.clone(), Sampling::Plain, 3), 512);
    for (seed, faces) in [(2, true), (3, false)] {
        let view = View { seed, ..view(camera.clone(), Sampling::Plain, 3) };
        let center = camera.world_from_camera.translation.into();
        let grid = SphericalGrid { center, columns: 32, rows: 16, faces, medium: false };
        let garbage =
            LightGrid::with_garbage_distributions(grid, environment.tile_energies(), seed);
        let mut session = Session::new(&world, &environment, view);
        session.set_grid(garbage.expect("a map with light")).expect("the CPU does not fail");
        session.advance(512, &AtomicBool::new(false)).expect("the CPU does not fail");
        expect_agreement(&format!("faces {faces}"), &plain, session.film(), 0.05);
    }
}

/// Direct light in a built-in scene.
fn builtin_agrees(name: &str, map: &str, modes: &[Sampling], precision: f64) {
    let world = World::new(builtin::build(name).expect("a scene"));
    let environment = environment(sky::build(map, 512, 256).expect("a sky"));
    let camera = &world.scene.cameras[0];
    let film = |sampling, seed| {
        let view = View {
            seed,
            width: 24,
            height: 14,
            learning_paths: 1 << 16,
            ..view(camera.clone(), sampling, 1)
        };
        render(&world, &environment, view, 1024)
    };
    let plain = film(Sampling::Plain, 1);
    for (seed, mode) in (2..).zip(modes) {
        expect_agreement(
            &format!("{name}, {map}, {mode:?}"),
            &plain,
            &film(*mode, seed),
            precision,
        );
    }
}

#[test]
fn learned_distributions_agree_with_plain_sampling_in_the_office() {
    builtin_agrees("office", "overcast", &[Sampling::Talk, Sampling::Adaptive], 0.05);
}

#[test]
fn learned_distributions_agree_with_plain_sampling_in_the_living_room() {
    builtin_agrees("living-room", "overcast", &[Sampling::Talk], 0.05);
    // Not the talk's distributions: where learning met no sun they cannot choose its tile. What is left to
    // BSDF sampling is right on average, but not seen with this many samples. Ours need enough
    // learning paths for the same reason.
    builtin_agrees("living-room", "day", &[Sampling::Adaptive], 0.05);
}

/// Means over seeds of pictures' mean luminances, and their standard errors.
fn over_seeds<const N: usize>(
    seeds: u32,
    pictures: impl Fn(u32) -> [f64; N] + Send + Sync,
) -> [(f64, f64); N] {
    let means: Vec<[f64; N]> = (1..=seeds).into_par_iter().map(pictures).collect();
    let count = f64::from(seeds);
    std::array::from_fn(|i| {
        let mean = means.iter().map(|m| m[i]).sum::<f64>() / count;
        let variance = means.iter().map(|m| (m[i] - mean).powi(2)).sum::<f64>() / (count - 1.0);
        (mean, (variance / count).sqrt())
    })
}

/// One pixel, or sixteen, see a cell of their own of which nothing was learned before: all that its
/// distributions know they know from these pixels' earlier samples. With one scramble for all samples this is
/// 1 % too bright here for one pixel (9 % after 64 samples in a study), and 7 % too dark where it is
/// rendered again from the same seed with the distributions it made.
#[test]
fn distributions_made_of_a_pixel_s_own_samples_do_not_bias_it() {
    const SAMPLES: u32 = 8;
    let environment = environment(soft_map());
    let (world, room_camera) = room(0.7, None);
    let eye: glam::Vec3 = room_camera.world_from_camera.translation.into();
    let ahead = room_camera.world_from_camera.matrix3.z_axis * -3.0;
    let camera = probe(eye, eye + glam::Vec3::from(ahead));
    for (side, seeds) in [(1, 40_000), (4, 4000)] {
        let view = View {
            width: side,
            height: side,
            learning_paths: 0,
            grid_columns: 8,
            // What it takes from the distributions is noise here.
            distributions: DistributionOptions {
                compensation: 0.0,
                rendered_paths: RenderedPaths::Everywhere,
                ..DistributionOptions::ADAPTIVE
            },
            ..view(camera.clone(), Sampling::Adaptive, 1)
        };
        let view_of = |sampling, seed| View { sampling, seed, ..view.clone() };
        let finish = |session: &mut Session<'_>| {
            let rule = StopRule { samples: Some(SAMPLES), ..StopRule::default() };
            while session.samples() < SAMPLES {
                let pass = rule.next_pass(session);
                session.advance(pass, &AtomicBool::new(false)).expect("the CPU does not fail");
            }
            mean(session.film()).luminance
        };
        let learning = |seed| {
            let mut session = learned(&world, &environment, view_of(Sampling::Adaptive, seed));
            let light = finish(&mut session);
            assert!(session.figures().counted_paths > 0, "rendered paths count");
            (light, session.grid().cloned().expect("it has learned"))
        };
        let [plain] = over_seeds(seeds, |seed| {
            let view = view_of(Sampling::Plain, seed);
            [mean(&render(&world, &environment, view, SAMPLES)).luminance]
        });
        let [adaptive, frozen] = over_seeds(seeds, |seed| {
            let (light, grid) = learning(seed);
            let view = view_of(Sampling::Adaptive, seed);
            let mut session = Session::new(&world, &environment, view);
            session.set_grid(grid).expect("the CPU does not fail");
            [light, finish(&mut session)]
        });
        for (what, found) in [("learning", adaptive), ("frozen", frozen)] {
            let off = found.0 / plain.0 - 1.0;
            let error = found.1.hypot(plain.1) / plain.0;
            eprintln!("{side} x {side}, {what}: {:.2} % +- {:.2}", 100.0 * off, 100.0 * error);
            assert!(error < 0.015, "{what}: {error} is too noisy to tell");
            assert!(off.abs() < 4.0 * error, "{side} x {side}, {what}: {off} +- {error}");
        }
    }
}
