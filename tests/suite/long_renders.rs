//! Long renders whose pixels share second vertices against plain ones: no pixel, no block of pixels and no mean is
//! off, whatever was learned, and the error falls with the samples to the end.
//!
//! `cargo test --release --test suite long_renders:: -- --ignored --nocapture`

use std::sync::atomic::AtomicBool;

use lightgrid::environment::{Environment, EnvironmentOptions};
use lightgrid::light_grid::LightGrid;
use lightgrid::light_grid::cells::SphericalGrid;
use lightgrid::path::{PathLimits, World};
use lightgrid::render::{Phase, Sampling, Session, Sharing, StopRule, View};
use lightgrid::scene::builtin;
use lightgrid::sources;

use crate::estimator::view;
use crate::peers::{PEERS, Peer};
use crate::z_test::{Mean, z_test};

/// Samples a pixel of a long render.
const SAMPLES: u32 = 4096;
/// A render's noise is told by the spread of so many parts of its samples. They are of one sequence, whose points
/// avoid each other: all together vary less than that.
const PARTS: u32 = 32;
/// Where errors are looked at.
const COUNTS: [u32; 4] = [64, 256, 1024, SAMPLES];
/// Pixels across and down, in the shape of the references; it ends within a tile.
const SIZE: [u32; 2] = [32, 18];
/// Pixels along a block, as along a tile.
const BLOCK: u32 = 8;
/// Chance that sound pictures fail one comparison.
const ALPHA: f64 = 1e-4;
/// Least standard error of a pixel in units of the picture's mean: one that has met none of its rare light yet
/// knows nothing of its variance.
const MIN_ERROR: f64 = 1e-3;
/// The same in shares of all pixels' mean variance.
const MIN_SHARE: f64 = 0.1;
/// Standard errors that a mean may be off by.
const MAX_SIGMAS: f64 = 4.5;

/// What is rendered.
struct Place<'a> {
    world: &'a World,
    environment: &'a Environment,
}

/// Luminance of each pixel or block.
type Values = Vec<f64>;

/// One render on its way.
struct Run {
    /// Of each part of the samples.
    parts: Vec<Values>,
    /// Of all samples up to each of [`COUNTS`] that it has come to.
    known: Vec<Values>,
}

impl Place<'_> {
    /// The default as it would be for a larger picture; where that would share nothing, in the smaller tiles.
    fn sharing(&self) -> Sharing {
        let [width, height] = SIZE.map(|length| 4 * length);
        let view =
            View { sharing: Sharing::Auto, width, height, ..self.view(Sampling::Adaptive, 0) };
        match Session::new(self.world, self.environment, view).view().sharing {
            Sharing::Off | Sharing::Auto => Sharing::Small,
            sharing => sharing,
        }
    }

    fn view(&self, sampling: Sampling, seed: u32) -> View {
        let [width, height] = SIZE;
        View {
            width,
            height,
            seed,
            sharing: Sharing::Off,
            limits: PathLimits { bounces: 5, russian_roulette: true },
            learning_paths: 1 << 16,
            ..view(self.world.scene.cameras[0].clone(), sampling, 5)
        }
    }

    fn garbage(&self, seed: u32) -> LightGrid {
        let center = self.world.scene.cameras[0].world_from_camera.translation.into();
        let medium = self.world.scene.medium.is_some();
        let grid = SphericalGrid { center, columns: 32, rows: 16, faces: true, medium };
        LightGrid::with_garbage_distributions(grid, self.environment.tile_energies(), seed)
            .expect("a map with light")
    }

    fn run(&self, view: View, samples: u32, grid: Option<LightGrid>) -> Run {
        let mut session = Session::new(self.world, self.environment, view);
        if let Some(grid) = grid {
            session.set_grid(grid).expect("the CPU does not fail");
        }
        let goes_on = AtomicBool::new(false);
        while session.phase() == Phase::Learning {
            session.advance(0, &goes_on).expect("the CPU does not fail");
        }
        let part = samples / PARTS;
        let mut stops: Vec<u32> = (1..=PARTS).map(|i| i * part).chain(COUNTS).collect();
        stops.retain(|stop| *stop <= samples);
        stops.sort_unstable();
        stops.dedup();
        let mut run = Run { parts: Vec::new(), known: Vec::new() };
        // Sums where the last part ended.
        let mut before = vec![0.0; (SIZE[0] * SIZE[1]) as usize];
        for stop in stops {
            let rule = StopRule { samples: Some(stop), ..StopRule::default() };
            while !rule.is_met(&session) {
                let pass = rule.next_pass(&session);
                session.advance(pass, &goes_on).expect("the CPU does not fail");
            }
            let film = session.film();
            assert_eq!(film.invalid_samples(), 0);
            let means: Values = film.pixels().iter().map(|p| p.mean_luminance()).collect();
            if stop.is_multiple_of(part) {
                let sums: Values = means.iter().map(|mean| mean * f64::from(stop)).collect();
                let of = |(sum, before): (&f64, &f64)| (sum - before) / f64::from(part);
                run.parts.push(sums.iter().zip(&before).map(of).collect());
                before = sums;
            }
            if COUNTS.contains(&stop) {
                run.known.push(means);
            }
        }
        run
    }

    /// Means of blocks.
    fn blocks(&self, pixels: &Values) -> Values {
        let [width, height] = SIZE;
        let (columns, rows) = (width.div_ceil(BLOCK), height.div_ceil(BLOCK));
        let mut sums = vec![(0.0, 0.0); (columns * rows) as usize];
        for (i, value) in (0..).zip(pixels) {
            let sum = &mut sums[(i / width / BLOCK * columns + i % width / BLOCK) as usize];
            *sum = (sum.0 + value, sum.1 + 1.0);
        }
        sums.into_iter().map(|(sum, count)| sum / count).collect()
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Mean without the largest hundredth: the few pixels that have met a rare light.
fn without_worst(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    mean(&sorted[..sorted.len() - sorted.len() / 100])
}

/// Mean of some values that are alike, and its standard error.
fn spread(values: &[f64]) -> (f64, f64) {
    let (mean, count) = (mean(values), values.len() as f64);
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (count - 1.0);
    (mean, (variance / count).sqrt())
}

/// Mean and variance of the mean of each quantity, from the parts of runs.
fn moments(parts: &[Values], least_error: f64) -> (Values, Values) {
    (0..parts[0].len())
        .map(|i| {
            let of: Values = parts.iter().map(|part| part[i]).collect();
            let (mean, error) = spread(&of);
            (mean, error.powi(2) + least_error.powi(2))
        })
        .unzip()
}

/// Deviations of quantities in standard errors of a normal distribution (Wallace, *Bounds on Normal
/// Approximations to Student's and the Chi-Square Distributions*, 1959): few parts tell their own spread badly.
fn deviations(a: &[Values], b: &[Values], least_error: f64) -> Values {
    let freedom = |parts: &[Values]| (parts.len() - 1) as f64;
    let (freedom_a, freedom_b) = (freedom(a), freedom(b));
    let moments = |parts: &[Values]| {
        let (means, variances) = moments(parts, least_error);
        let floor = MIN_SHARE * mean(&variances);
        (means, variances.iter().map(|variance| variance + floor).collect::<Values>())
    };
    let (a, b) = (moments(a), moments(b));
    let pairs = a.0.iter().zip(&a.1).zip(b.0.iter().zip(&b.1));
    pairs
        .map(|((a, variance_a), (b, variance_b))| {
            let variance = variance_a + variance_b;
            let freedom = variance.powi(2)
                / (variance_a.powi(2) / freedom_a + variance_b.powi(2) / freedom_b);
            let normal = freedom * ((a - b).powi(2) / variance / freedom).ln_1p();
            (8.0 * freedom + 1.0) / (8.0 * freedom + 3.0) * normal.sqrt()
        })
        .collect()
}

/// The largest deviation of any quantity in standard errors, and whether chance explains it.
fn agreement(a: &[Values], b: &[Values], least_error: f64) -> (f64, bool) {
    let found = deviations(a, b, least_error);
    let standard: Vec<Mean> = found.iter().map(|deviation| (*deviation, 1.0)).collect();
    let test = z_test(&standard, &vec![(0.0, 0.0); found.len()], ALPHA);
    (found.into_iter().fold(0.0, f64::max), test.passed())
}

/// Compares, prints a line and says what is wrong.
fn examine(what: &str, place: &Place<'_>, reference: Option<f64>) -> Vec<String> {
    let sharing = place.sharing();
    let adaptive = |seed| View { sharing, ..place.view(Sampling::Adaptive, seed) };
    let shared: [Run; 2] = [11, 12].map(|seed| place.run(adaptive(seed), SAMPLES, None));
    let plain: [Run; 2] =
        [21, 22].map(|seed| place.run(place.view(Sampling::Plain, seed), SAMPLES / 2, None));
    let garbage = place.run(adaptive(13), SAMPLES / 4, Some(place.garbage(7)));

    let all = |runs: &[Run]| -> Vec<Values> { runs.iter().flat_map(|r| r.parts.clone()).collect() };
    let (ours, theirs, noisy) = (all(&shared), all(&plain), garbage.parts);
    let in_blocks =
        |parts: &[Values]| -> Vec<Values> { parts.iter().map(|part| place.blocks(part)).collect() };
    let picture = |parts: &[Values]| spread(&parts.iter().map(|p| mean(p)).collect::<Values>());
    let (own, other, spoilt) = (picture(&ours), picture(&theirs), picture(&noisy));
    let least = MIN_ERROR * other.0;
    let mut wrong = Vec::new();
    let mut check = |is_right: bool, what: String| {
        if !is_right {
            wrong.push(what);
        }
    };
    let mut deviations = Vec::new();
    for (which, parts) in [("learned", &ours), ("garbage", &noisy)] {
        // The floor of a block is that of its pixels together.
        for (unit, (most, passed)) in [
            ("pixel", agreement(parts, &theirs, least)),
            ("block", agreement(&in_blocks(parts), &in_blocks(&theirs), least / f64::from(BLOCK))),
        ] {
            deviations.push(most);
            check(passed, format!("{what}: {which}, a {unit} is off by {most:.1} standard errors"));
        }
    }
    let mut ratios = Vec::new();
    for (which, (found, error)) in [("learned", own), ("garbage", spoilt)] {
        let (off, noise) = (found / other.0 - 1.0, error.hypot(other.1) / other.0);
        let is_near = off.abs() <= MAX_SIGMAS * noise;
        check(is_near, format!("{what}: {which}, the mean is off by {off} +- {noise}"));
        ratios.push((1.0 + off, noise));
    }

    // Half the squared difference of two seeds is the error of one, without a reference's noise; relative.
    let halved = |known: [&Values; 2], of: &dyn Fn(&Values) -> Values| -> Values {
        let [a, b] = known.map(of);
        let floor = 0.01 * other.0 * other.0;
        let error = |(a, b): (&f64, &f64)| (a - b).powi(2) / 2.0 / (a * b + floor);
        a.iter().zip(&b).map(error).collect()
    };
    let errors = |runs: &[Run; 2], of: &dyn Fn(&Values) -> Values| -> Vec<Values> {
        let counts = 0..runs[0].known.len();
        counts.map(|i| halved([&runs[0].known[i], &runs[1].known[i]], of)).collect()
    };
    let as_it_is = |pixels: &Values| pixels.clone();
    let by_blocks = |pixels: &Values| place.blocks(pixels);
    let mut columns = String::new();
    for (unit, of) in [("pixel", &as_it_is as &dyn Fn(&Values) -> Values), ("block", &by_blocks)] {
        // Times the samples: the same to the end, or falling.
        let scaled: Vec<Values> = errors(&shared, of)
            .into_iter()
            .zip(COUNTS)
            .map(|(errors, count)| errors.iter().map(|e| e * f64::from(count)).collect())
            .collect();
        let row = |of: &dyn Fn(&[f64]) -> f64| {
            let values: Vec<String> = scaled.iter().map(|e| format!("{:.3}", of(e))).collect();
            format!(" | {}", values.join(" / "))
        };
        columns += &row(&mean);
        if unit == "pixel" {
            columns += &row(&without_worst);
            // The same of plain sampling.
            let values: Vec<String> = errors(&plain, of)
                .iter()
                .zip(COUNTS)
                .map(|(errors, count)| format!("{:.2}", without_worst(errors) * f64::from(count)))
                .collect();
            columns += &format!(" | {}", values.join(" / "));
        }
        let difference = |(last, first): (&f64, &f64)| last - first;
        let rise: Values = scaled[3].iter().zip(&scaled[0]).map(difference).collect();
        let rise = if unit == "pixel" { place.blocks(&rise) } else { rise };
        let (rise, noise) = spread(&rise);
        let is_level = rise <= 4.0 * noise;
        check(is_level, format!("{what}: {unit} error x samples rises by {rise} +- {noise}"));
    }
    // What both have in common is left of the products of their errors by independent references.
    let last: [&Values; 2] = [&shared[0].known[3], &shared[1].known[3]];
    let references: Vec<Values> = plain.iter().map(|run| moments(&run.parts, 0.0).0).collect();
    let floor = 0.01 * other.0 * other.0;
    let products: Values = (0..last[0].len())
        .map(|i| {
            let [a, b] = [0, 1].map(|k: usize| last[k][i] - references[k][i]);
            a * b / (references[0][i] * references[1][i] + floor)
        })
        .collect();
    let (bias, noise) = spread(&place.blocks(&products));
    check(bias <= MAX_SIGMAS * noise, format!("{what}: squared bias {bias} +- {noise}"));
    let against = reference.map_or_else(String::new, |r| format!("{:.4}", own.0 / r));
    if let Some(reference) = reference {
        let (off, noise) = (own.0 / reference - 1.0, own.1 / reference);
        let is_near = off.abs() <= 0.005_f64.max(MAX_SIGMAS * noise);
        check(is_near, format!("{what}: off the reference by {off} +- {noise}"));
    }
    println!(
        "| {what} | {sharing:?} | {:.4} +- {:.4} | {:.4} +- {:.4} | {against} | {}{columns} | {bias:.1e} +- {noise:.1e} |",
        ratios[0].0,
        ratios[0].1,
        ratios[1].0,
        ratios[1].1,
        deviations.iter().map(|d| format!("{d:.1}")).collect::<Vec<_>>().join(" / "),
    );
    wrong
}

const HEADER: &str = "| scene | tiles | mean over plain | garbage | over Mitsuba | most sigmas: pixel, block, \
                      garbage | error x samples: pixels | without the worst hundredth | of plain | blocks | squared bias |";

#[test]
#[ignore = "twenty minutes of CPU time; run it in release"]
fn in_all_builtin_scenes_they_converge_as_plain_ones() {
    println!("{HEADER}");
    let mut wrong = Vec::new();
    for name in builtin::names() {
        let world = World::new(builtin::build(name).expect("a scene"));
        let map = builtin::sky(name);
        let (map, _) = sources::map(&format!("{map}@512x256")).expect("a sky");
        let environment =
            Environment::new(map, &EnvironmentOptions::default()).expect("a sound map");
        let place = Place { world: &world, environment: &environment };
        wrong.extend(examine(name, &place, None));
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
#[ignore = "twenty minutes of CPU time; run it in release"]
fn in_scenes_of_the_references_they_converge_as_plain_ones() {
    println!("{HEADER}");
    let mut wrong = Vec::new();
    for name in PEERS {
        let (scene, map) = name.split_once(' ').expect("scene and map");
        let Some(peer) = Peer::load(scene, map) else { return };
        let (world, environment) = (&peer.world, &peer.environment);
        let place = Place { world, environment };
        wrong.extend(examine(name, &place, Some(peer.reference_mean())));
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
