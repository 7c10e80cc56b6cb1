//! The Light Grid: its cells, extreme cameras, little and much learning.
//!
//! The picture's expectation does not depend on learning: most cases compare it with the plain sampler's.

use std::sync::atomic::AtomicBool;

use glam::Vec3;

use super::case::{Entry, On, Setting};
use super::outcome::Outcome;
use super::scenes::{
    SIGMAS, constant, deviation, difference, lambert, learned, mean, render, room, sealed, sky,
    view,
};
use crate::error::{Error, Result};
use crate::light_grid::cells::SphericalGrid;
use crate::light_grid::counters::{Counters, MAX_RECORDS_PER_PASS, MAX_WEIGHT, Tally, WEIGHT_ONE};
use crate::light_grid::{LightGrid, MEMORY_BUDGET_BYTES, WHOLE_MAP};
use crate::path::{Lit, World, WorldBuilder};
use crate::render::{Sampling, View};
use crate::sampler::SplitMix;
use crate::scene::Camera;

pub(super) const CASES: &[Entry] = &[
    ("cells", On::Cpu, |_| Ok(cells())),
    ("camera-on-a-wall", On::Any, |s| {
        let eye = Vec3::new(-2.0, 1.25, 0.25);
        in_the_room(s, 1.0, Vec3::ZERO, Camera::look_at(eye, Vec3::new(0.0, 0.5, 0.0), 1.0))
    }),
    ("camera-inside-a-mesh", On::Any, camera_inside),
    ("camera-at-1e6-m", On::Any, |s| {
        // f32 has steps of 1/16 m there: the room is 40 m long so that its shape survives.
        let center = Vec3::new(1e6, 0.0, -1e6);
        in_the_room(s, 10.0, center, room(0.7, 10.0, center).1)
    }),
    ("sealed-room", On::Any, |s| {
        let (builder, camera) = sealed(1.0);
        black(s, &builder.build(), &camera)
    }),
    ("crack-of-2-cm", On::Any, |s| crack(s, 0.02)),
    ("crack-of-0.2-mm", On::Any, |s| crack(s, 2e-4)),
    ("empty-cells", On::Any, empty_cells),
    ("counters-after-2^32-hits", On::Cpu, saturation),
    ("moving-camera", On::Any, moving_camera),
    ("1-learning-path", On::Any, |s| learning_paths(s, 1)),
    ("1e8-learning-paths", On::Any, |s| learning_paths(s, s.count(1_000_000, 100_000_000))),
];

/// Every cell's middle lies in that cell, and every point has a cell of the grid.
fn cells() -> Outcome {
    let (mut lost, mut outside) = (0, 0);
    let mut random = SplitMix(3);
    for (columns, faces) in [(1, true), (2, false), (64, true), (512, true), (512, false)] {
        let rows = (columns / 2).max(1);
        for center in [Vec3::ZERO, Vec3::new(1e6, -3.0, 2e5)] {
            let grid = SphericalGrid { center, columns, rows, faces, medium: false };
            for cell in 0..grid.cell_count() {
                let (face, _, _) = grid.coordinates(cell);
                let mut normal = Vec3::ZERO;
                normal[face as usize / 2] = if face.is_multiple_of(2) { 1.0 } else { -1.0 };
                // As far as the centre's coordinates are large, of which f32 resolves 2^-24.
                let reach = center.length().max(1.0) * 4.0;
                let position = center + grid.direction_of(cell) * reach;
                lost += usize::from(grid.cell_of(position, normal) != cell);
            }
            let mut odd = vec![
                Vec3::ZERO,
                Vec3::Y,
                Vec3::NEG_Y,
                Vec3::NEG_X,
                Vec3::new(-1.0, 0.0, -0.0),
                Vec3::new(-1.0, 1e-30, -1e-30),
                Vec3::splat(1e-45),
                Vec3::splat(1e20),
                Vec3::splat(f32::MAX),
                Vec3::splat(f32::INFINITY),
                Vec3::splat(f32::NAN),
            ];
            odd.extend(
                (0..1000).map(|_| {
                    random.next_direction() * 10.0_f32.powf(random.next_f32() * 60.0 - 30.0)
                }),
            );
            for offset in odd {
                for normal in [random.next_direction(), Vec3::ZERO, Vec3::splat(f32::NAN)] {
                    outside +=
                        usize::from(grid.cell_of(center + offset, normal) >= grid.cell_count());
                }
            }
        }
    }
    let what = "cells whose middle lies in another one";
    let outcome = Outcome::default().at_most(what, lost as f64, 0.0);
    outcome.at_most("odd points (pole, seam, centre, infinity) off the grid", outside as f64, 0.0)
}

/// Pictures by [`Sampling::Adaptive`] and [`Sampling::Talk`] against the plain sampler's.
fn against_plain(setting: &Setting, lit: Lit<'_>, view: &View, samples: u32) -> Result<Outcome> {
    let plain = View { sampling: Sampling::Plain, seed: 77, ..view.clone() };
    let expected = mean(&render(setting, lit, plain, 4 * samples)?);
    let mut outcome = Outcome::default();
    for sampling in [Sampling::Adaptive, Sampling::Talk] {
        let film = render(setting, lit, View { sampling, ..view.clone() }, samples)?;
        let off = difference(expected, mean(&film));
        let what = format!("{sampling:?} against plain: standard errors off");
        outcome = outcome.sound(&film).at_most(what, off, SIGMAS);
    }
    // A limit of noise, so that a difference is detectable.
    let noise = expected.error / expected.luminance;
    Ok(outcome.at_most("noise of the comparison, relative", noise, 0.1))
}

fn in_the_room(setting: &Setting, scale: f32, center: Vec3, camera: Camera) -> Result<Outcome> {
    let world = room(0.7, scale, center).0.build();
    against_plain(setting, (&world, &sky("day")?), &view(camera, Sampling::Adaptive, 3), 128)
}

/// A camera in a closed box that stands in the room sees that box from inside, black.
fn camera_inside(setting: &Setting) -> Result<Outcome> {
    let (builder, _) = room(0.7, 1.0, Vec3::ZERO);
    let (low, high) = (Vec3::new(0.0, 0.5, 0.0), Vec3::new(0.5, 1.0, 0.5));
    let camera = Camera::look_at(Vec3::new(0.25, 0.75, 0.25), Vec3::new(0.5, 0.5, 0.0), 1.0);
    black(setting, &builder.faces(&lambert(0.8), low, high, 0..6).build(), &camera)
}

fn black(setting: &Setting, world: &World, camera: &Camera) -> Result<Outcome> {
    let environment = sky("day")?;
    let mut outcome = Outcome::default();
    for sampling in [Sampling::Adaptive, Sampling::Talk] {
        let view = view(camera.clone(), sampling, 4);
        let mut session = learned(setting, (world, &environment), view)?;
        session.advance(32, &AtomicBool::new(false))?;
        let (film, figures) = (session.film(), session.figures());
        let learned = figures.learned_cells as f64;
        outcome = outcome
            .sound(film)
            .at_most(format!("{sampling:?}: light in the dark"), mean(film).luminance, 0.0)
            .at_most(format!("{sampling:?}: distributions of nothing"), learned, 0.0)
            .at_least("cells visited", figures.visited_cells as f64, 1.0);
    }
    Ok(outcome)
}

/// A point of a floor under a slit 1 m above it, in a black box: its irradiance is the integral of
/// `h^2 / r^4` over the slit.
fn crack(setting: &Setting, width: f32) -> Result<Outcome> {
    const LENGTH: f32 = 2.0;
    let black = lambert(0.0);
    let (half, end) = (0.5 * width, 0.5 * LENGTH);
    let lid = |builder: WorldBuilder, x: [f32; 2], z: [f32; 2]| {
        let corner = Vec3::new(x[0], 1.0, z[0]);
        builder.quad(&black, corner, Vec3::X * (x[1] - x[0]), Vec3::Z * (z[1] - z[0]))
    };
    let (low, high) = (Vec3::new(-2.0, 0.0, -2.0), Vec3::new(2.0, 1.0, 2.0));
    let mut builder = WorldBuilder::default().faces(&black, low, high, [0, 1, 4, 5]);
    builder = builder.floor(&lambert(1.0), Vec3::ZERO, 4.0);
    builder = lid(builder, [-2.0, -half], [-2.0, 2.0]);
    builder = lid(builder, [half, 2.0], [-2.0, 2.0]);
    builder = lid(builder, [-half, half], [-2.0, -end]);
    builder = lid(builder, [-half, half], [end, 2.0]);
    let world = builder.build();
    // The pixels cover less of the floor than the slit's width.
    let camera = Camera::look_at(Vec3::new(0.3, 0.5, 0.2), Vec3::new(0.02, 0.0, 0.1), 1e-4);
    let (strips, mut irradiance) = (2000, 0.0);
    let width = f64::from(half) * 2.0;
    for i in 0..strips {
        let z = (f64::from(i) + 0.5) / f64::from(strips) * f64::from(LENGTH) - f64::from(end) - 0.1;
        for k in 0..16 {
            let x = (f64::from(k) + 0.5) / 16.0 * width - 0.5 * width - 0.02;
            let r2 = 1.0 + x * x + z * z;
            irradiance += width / 16.0 * f64::from(LENGTH) / f64::from(strips) / (r2 * r2);
        }
    }
    let view = View { learning_paths: 1 << 16, ..view(camera, Sampling::Adaptive, 1) };
    let film = render(setting, (&world, &constant(1.0)?), view, setting.count(4096, 65_536))?;
    let (found, expected) = (mean(&film), irradiance / std::f64::consts::PI);
    let off = deviation(found, expected, 2e-3);
    Ok(Outcome::default()
        .sound(&film)
        .at_most("floor under the slit: standard errors off", off, SIGMAS)
        .at_most("noise, relative", found.error / expected, 0.1))
}

/// A grid that learned in one corner is used elsewhere: cells without learning use the whole map's distribution.
fn empty_cells(setting: &Setting) -> Result<Outcome> {
    let (builder, camera) = room(0.7, 1.0, Vec3::ZERO);
    let (world, environment) = (builder.build(), sky("day")?);
    let eye: Vec3 = camera.world_from_camera.translation.into();
    let narrow = Camera::look_at(eye, Vec3::new(-1.0, 0.0, 1.0), 0.05);
    let first = learned(setting, (&world, &environment), view(narrow, Sampling::Adaptive, 1))?;
    let grid = first.grid().ok_or_else(|| Error::new("nothing was learned"))?.clone();
    let cells = grid.grid().map_or(0, SphericalGrid::cell_count);
    let empty = (0..cells).filter(|cell| grid.distribution_of_cell(*cell) == WHOLE_MAP).count();
    let outcome = with_grid(setting, (&world, &environment), &camera, grid)?;
    Ok(outcome.at_least("share of empty cells", empty as f64 / f64::from(cells), 0.9))
}

/// A picture with a grid that was learned elsewhere, against the plain sampler's.
fn with_grid(setting: &Setting, lit: Lit<'_>, camera: &Camera, grid: LightGrid) -> Result<Outcome> {
    let wanted = |sampling, seed| View { seed, ..view(camera.clone(), sampling, 2) };
    let plain = render(setting, lit, wanted(Sampling::Plain, 5), 512)?;
    let mut session = super::scenes::session(setting, lit, wanted(Sampling::Adaptive, 10))?;
    session.set_grid(grid)?;
    session.advance(128, &AtomicBool::new(false))?;
    let off = difference(mean(&plain), mean(session.film()));
    let what = "foreign grid against plain: standard errors off";
    Ok(Outcome::default().sound(session.film()).at_most(what, off, SIGMAS))
}

/// Ratios survive 2^32 hits in one cell, and no counter wraps.
fn saturation(setting: &Setting) -> Result<Outcome> {
    let mut counters = Counters::new(1, 2, 1 << 20);
    counters.record(0, 0, 1.0);
    counters.end_pass();
    let mut hits = 0_u64;
    let mut wrapped = 0;
    let worth = |weight: f32| (weight * WEIGHT_ONE) as u32;
    while hits < 1 << 32 {
        if setting.nightly {
            for i in 0..MAX_RECORDS_PER_PASS {
                // Three of four tries into tile 1, a quarter of them visible with the largest weight.
                let tile = u32::from(i % 4 != 0);
                counters.record(0, tile, if i % 16 == 1 { MAX_WEIGHT } else { 0.0 });
            }
        } else {
            // Adds the maximum of a pass at once.
            let (mut visits, _, mut blocks) = counters.words();
            let records = MAX_RECORDS_PER_PASS as u32;
            let mut add = |word: &mut u32, more: u32| match word.checked_add(more) {
                Some(sum) => *word = sum,
                None => wrapped += 1,
            };
            add(&mut visits[0], records);
            add(&mut blocks[0], records / 4);
            add(&mut blocks[2], records / 4 * 3);
            add(&mut blocks[3], records / 16 * worth(MAX_WEIGHT));
            counters.set_words(&visits, &blocks);
        }
        hits += MAX_RECORDS_PER_PASS;
        counters.end_pass();
    }
    let tallies: Vec<Tally> = counters.tallies(0).collect();
    let share = tallies[1].tries / (tallies[0].tries + tallies[1].tries);
    let ratio = tallies[1].weight / tallies[1].tries;
    Ok(Outcome::default()
        .at_most("counters that wrapped", f64::from(wrapped), 0.0)
        .at_most("share of tries off 3/4", (share - 0.75).abs(), 1e-5)
        .at_most("visibility ratio off 1/3, relative", (3.0 * ratio - 1.0).abs(), 1e-5))
}

/// A camera flies through the room; each picture uses the previous place's grid, or random distributions.
fn moving_camera(setting: &Setting) -> Result<Outcome> {
    let (world, environment) = (room(0.7, 1.0, Vec3::ZERO).0.build(), sky("sunset")?);
    let mut outcome = Outcome::default();
    let mut before: Option<LightGrid> = None;
    for step in 0..setting.count(3, 12) {
        let eye = Vec3::new(1.5 - 0.9 * step as f32 % 3.0, 1.25, -1.0 + 0.7 * step as f32 % 2.0);
        let camera = Camera::look_at(eye, Vec3::new(-0.5, 0.75, -0.25), 1.0);
        if let Some(grid) = before.take() {
            outcome = outcome.and(with_grid(setting, (&world, &environment), &camera, grid)?);
        }
        let first = learned(setting, (&world, &environment), view(camera, Sampling::Adaptive, 2))?;
        before = first.grid().cloned();
    }
    let grid = SphericalGrid { center: Vec3::Y, columns: 64, rows: 32, faces: true, medium: false };
    let garbage = LightGrid::with_garbage_distributions(grid, environment.tile_energies(), 9);
    let garbage = garbage.ok_or_else(|| Error::new("the sky is black"))?;
    let camera = room(0.7, 1.0, Vec3::ZERO).1;
    Ok(outcome.and(with_grid(setting, (&world, &environment), &camera, garbage)?))
}

fn learning_paths(setting: &Setting, paths: u64) -> Result<Outcome> {
    let (builder, camera) = room(0.7, 1.0, Vec3::ZERO);
    let (world, environment) = (builder.build(), sky("day")?);
    let view = View { learning_paths: paths, ..view(camera, Sampling::Adaptive, 1) };
    let mut session = learned(setting, (&world, &environment), view.clone())?;
    session.advance(64, &AtomicBool::new(false))?;
    let plain = View { sampling: Sampling::Plain, seed: 4, ..view };
    let plain = render(setting, (&world, &environment), plain, 256)?;
    let off = difference(mean(&plain), mean(session.film()));
    let (figures, budget) = (session.figures(), MEMORY_BUDGET_BYTES as f64);
    Ok(Outcome::default()
        .sound(session.film())
        .at_most("bytes of the grid, at most", figures.grid_peak_bytes as f64, budget)
        .at_least("paths learned from", figures.learning_paths as f64, paths as f64)
        .at_most("Adaptive against plain: standard errors off", off, SIGMAS))
}
