//! The error report: its statistics on known answers, its variants unbiased, its command as a person
//! uses it.

mod command;
mod statistics;

use lightgrid::environment::{Environment, EnvironmentOptions, sky};
use lightgrid::metrics::hypothesis::chi_square_test;
use lightgrid::path::{PathLimits, World};
use lightgrid::render::{Gi, Sampling, View};
use lightgrid::report::{Device, Effort, Frame, Plan, ablations, talk};
use lightgrid::sampler::Points;
use lightgrid::scene::builtin;

use crate::estimator::{mean, render, view};

fn effort() -> Effort {
    Effort {
        devices: vec![Device::Cpu],
        frame: Frame { size: (64, 36), bounces: 3 },
        seconds: 2.0,
        seeds: 3,
        reference_noise: 0.1,
    }
}

fn all_ablations() -> Plan {
    ablations::plan(Vec::new(), &[], effort(), String::new())
}

#[test]
fn every_ablation_is_a_change_with_a_name_of_its_own() {
    let plan = all_ablations();
    for (i, method) in plan.methods.iter().enumerate() {
        for other in &plan.methods[..i] {
            assert_ne!(method.name, other.name);
            assert_ne!(method.settings, other.settings, "{} and {}", method.name, other.name);
        }
    }
    let names = |word: &str, devices: &[Device]| -> Vec<String> {
        let effort = Effort { devices: devices.to_vec(), ..effort() };
        let some = ablations::plan(Vec::new(), &[word.to_owned()], effort, String::new());
        some.methods.into_iter().map(|m| m.name).collect()
    };
    let both = [Device::Cpu, Device::Gpu];
    let tiles = ["plain", "adaptive", "8x4 tiles", "32x16 tiles", "64x32 tiles"];
    assert_eq!(names("tiles", &both), tiles);
    let tables = ["plain", "adaptive", "table u32", "table f32", "table f64"];
    assert_eq!(names("table", &both[..1]), tables);
    assert_eq!(names("table", &both), tables[..2], "a GPU has no others");
}

#[test]
fn the_talks_plan_has_its_rows_and_its_figures() {
    let plan = talk::plan(effort(), String::new());
    let published: Vec<[f64; 2]> = plan.rows.iter().filter_map(|row| row.published).collect();
    let talk = [[6.6, 3.8], [2.7, 2.4], [2.2, 1.6], [1.9, 1.6], [3.8, 3.0], [2.3, 1.8], [3.4, 2.6]];
    assert_eq!(published, talk);
    for row in &plan.rows {
        assert!(builtin::names().contains(&row.scene.as_str()), "{}", row.scene);
        assert!(row.map.strip_prefix("sky:").is_some_and(|name| sky::names().contains(&name)));
    }
    let names = |plan: &Plan| plan.methods.iter().map(|m| m.name.clone()).collect::<Vec<_>>();
    let exact = ["plain", "talk", "adaptive"];
    assert_eq!(names(&plan)[..3], exact);
    assert_eq!(names(&plan)[3..], ["own paths", "plain cached", "talk cached", "adaptive cached"]);
    // 9 rows of 7 methods x 3 runs, a reference of 10 runs and 3 x 1.5 for where the error is left.
    let runs = 9.0 * (7.0 * 3.0 + 10.0 + 4.5) * 2.0;
    assert!((1.0..1.4).contains(&(plan.expected_seconds() / runs)), "{}", plan.expected_seconds());
    let direct = Effort { frame: Frame { bounces: 1, ..effort().frame }, ..effort() };
    assert_eq!(names(&talk::plan(direct, String::new())), exact);
}

/// What a change may alter is noise, never the picture: every variant's mean is that of the others.
#[test]
fn every_ablation_converges_to_the_same_picture() {
    let world = World::new(builtin::build("open").expect("built in"));
    let map = sky::build("day", 64, 32).expect("a sky");
    let picture = |settings: &lightgrid::report::Settings, seed: u32| {
        let options = EnvironmentOptions {
            table: settings.table,
            tile_columns: settings.tiles.0,
            tile_rows: settings.tiles.1,
            ..EnvironmentOptions::default()
        };
        let environment = Environment::new(map.clone(), &options).expect("a sound map");
        let view = View {
            width: 12,
            height: 12,
            seed,
            points: settings.points,
            distributions: settings.distributions,
            grid_columns: settings.grid_columns,
            sharing: settings.sharing,
            gi: settings.gi,
            learning_paths: 1 << 11,
            limits: PathLimits { bounces: 3, russian_roulette: settings.russian_roulette },
            ..view(world.scene.cameras[0].clone(), settings.sampling, 3)
        };
        mean(&render(&world, &environment, view, 128))
    };
    let plan = all_ablations();
    let expected = picture(&plan.methods[0].settings, 1000);
    for (method, seed) in plan.methods[1..].iter().zip(0..) {
        let found = picture(&method.settings, seed);
        // BSDF sampling alone meets the sun by chance: its spread says nothing at so few samples. Cached
        // paths have a bias, and tests of their own.
        if method.settings.sampling == Sampling::Bsdf || method.settings.gi == Gi::Cached {
            continue;
        }
        let noise = 4.5 * found.standard_error.hypot(expected.standard_error);
        let difference = (found.luminance - expected.luminance).abs();
        assert!(noise < 0.2 * expected.luminance, "{}: noise {noise}", method.name);
        assert!(difference < noise, "{}: off by {difference}, noise {noise}", method.name);
    }
}

#[test]
fn independent_points_are_even_in_no_more_than_number() {
    let mut counts = vec![0.0; 256];
    let samples = 1 << 15;
    let mut per_pixel_square = 0.0;
    for pixel in 0..128_u32 {
        let mut cells = [0.0_f64; 256];
        for index in 0..samples / 128 {
            let mut sampler = Points::Independent.sampler(3, [pixel, 0], index);
            sampler.next_pair();
            let [x, y] = sampler.next_pair();
            cells[(x * 16.0) as usize * 16 + (y * 16.0) as usize] += 1.0;
        }
        per_pixel_square += cells.iter().map(|c| (c - 1.0).powi(2)).sum::<f64>();
        counts.iter_mut().zip(cells).for_each(|(sum, c)| *sum += c);
    }
    let expected = vec![f64::from(samples) / 256.0; 256];
    let test = chi_square_test(&counts, &expected, 1e-3).expect("enough counts");
    assert!(test.passed, "{test:?}");
    // 256 samples in 256 cells: Sobol's would lie one in each; independent ones vary by 1 - 1/256.
    let variance = per_pixel_square / f64::from(samples);
    assert!((variance - 1.0).abs() < 0.05, "{variance}");
}
