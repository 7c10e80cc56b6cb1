//! How much faster one way of sampling is than another, from two films of the same view.

use super::worker::SessionSnapshot;
use crate::metrics::{REL_MSE_EPSILON, kept_of};

/// Blocks along each side of the picture that the uncertainty is taken from.
const BLOCKS: usize = 8;
/// Standard errors that hold 95 % (Student, 63 degrees of freedom).
const STANDARD_ERRORS: f64 = 2.0;

/// An effective speed-up: how many times the time the plain method needs for the same error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SpeedUp {
    /// The ratio.
    pub(super) ratio: f64,
    /// Factor of its 95 % interval: from the ratio over this to the ratio times this (jackknife over
    /// blocks of the picture).
    pub(super) factor: f64,
}

impl SpeedUp {
    /// From relative squared errors times seconds; `None` below eight samples a pixel, and while seconds are not known.
    pub(super) fn of(main: &SessionSnapshot, plain: &SessionSnapshot) -> Option<Self> {
        if main.samples < 8 || plain.samples < 8 {
            return None;
        }
        // Both are measured against the same light, to which both give the same.
        let lights = [main, plain].map(|session| session.film.luminance_around());
        let lights = lights[0].iter().zip(&lights[1]).map(|(a, b)| 0.5 * (a + b));
        let lights: Vec<f64> = lights.collect();
        let (a, p) = (block_errors(main, &lights), block_errors(plain, &lights));
        let seconds = plain.comparable_seconds? / main.comparable_seconds?;
        let (sum_a, sum_p) = (a.iter().sum::<f64>(), p.iter().sum::<f64>());
        let ratio = |a: f64, p: f64| p / a * seconds;
        let whole = ratio(sum_a, sum_p);
        let count = a.len() as f64;
        let without = |(a, p): (&f64, &f64)| ratio(sum_a - a, sum_p - p);
        let without = a.iter().zip(&p).map(without);
        let spread: f64 = without.map(|ratio| (ratio.ln() - whole.ln()).powi(2)).sum();
        let factor = (STANDARD_ERRORS * (spread * (count - 1.0) / count).sqrt()).exp();
        (whole.is_finite() && factor.is_finite()).then_some(Self { ratio: whole, factor })
    }
}

/// Sum over each block's pixels of variance over squared luminance, the worst ones left out.
fn block_errors(session: &SessionSnapshot, lights: &[f64]) -> Vec<f64> {
    let film = &session.film;
    let (width, height) = (film.width as usize, film.height as usize);
    let mean = lights.iter().sum::<f64>() / lights.len() as f64;
    let left = 1.0 - session.figures.variance_saved;
    let error = |(pixel, light): (&crate::render::film::Pixel, &f64)| {
        left * pixel.variance_of_mean() / (light.powi(2) + REL_MSE_EPSILON * mean * mean)
    };
    let errors: Vec<f64> = film.pixels().iter().zip(lights).map(error).collect();
    // As in the reports: a few bright samples would decide.
    let last = kept_of(errors.len()) - 1;
    let largest = *errors.clone().select_nth_unstable_by(last, f64::total_cmp).1;
    let mut sums = vec![0.0; BLOCKS * BLOCKS];
    for (i, error) in errors.into_iter().enumerate().filter(|(_, error)| *error <= largest) {
        let block = (i / width) * BLOCKS / height * BLOCKS + (i % width) * BLOCKS / width;
        sums[block] += error;
    }
    sums
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;
    use std::sync::{Arc, OnceLock};

    use glam::Vec3;

    use super::*;
    use crate::environment::{Environment, EnvironmentOptions, sky};
    use crate::metrics::compare;
    use crate::path::{PathResult, World};
    use crate::render::film::Film;
    use crate::render::{Figures, Phase, Sampling, Session, Sharing, StopRule, View};
    use crate::scene::builtin;

    /// A picture of so many samples a pixel whose logarithms are normal with deviation `sigma`.
    fn rendered(seed: u64, samples: u32, sigma: f32) -> SessionSnapshot {
        let mut film = Film::new(48, 32, false);
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            ((state >> 40) as f32 + 0.5) / (1 << 24) as f32
        };
        for index in 0..48 * 32 * samples {
            let (x, y) = (index % 48, index / 48 % 32);
            let normal = (-2.0 * uniform().ln()).sqrt() * (std::f32::consts::TAU * uniform()).cos();
            // Light falls off from a window; all methods have the same mean.
            let light = 1.0 / (1.0 + 0.1 * (x + y) as f32) * (sigma * (normal - 0.5 * sigma)).exp();
            let radiance = Vec3::splat(light);
            film.add(x, y, &PathResult { radiance, rays: 1, ..PathResult::default() });
        }
        SessionSnapshot {
            samples,
            sampling: Sampling::Plain,
            film: Arc::new(film),
            figures: Figures::default(),
            comparable_seconds: Some(1.0),
            noise: 0.0,
            invalid_samples: 0,
            grid: None,
            gpu: None,
            on_device: None,
        }
    }

    #[test]
    fn a_method_against_itself_is_as_fast_in_95_of_100_runs() {
        for sigma in [0.7, 1.5] {
            let (mut covered, mut logarithms) = (0, 0.0);
            for run in 0..200 {
                let found =
                    SpeedUp::of(&rendered(2 * run, 16, sigma), &rendered(2 * run + 1, 16, sigma));
                let found = found.expect("enough samples");
                covered += u32::from(found.ratio.ln().abs() <= found.factor.ln());
                logarithms += found.ratio.ln() / 200.0;
            }
            // Two standard deviations of what a true 95 % would show.
            assert!(covered >= 184, "{covered} of 200 at {sigma}");
            assert!(logarithms.abs() < 0.02, "{logarithms} at {sigma}");
        }
    }

    #[test]
    fn the_share_of_samples_is_the_ratio() {
        let found =
            SpeedUp::of(&rendered(1, 64, 0.7), &rendered(2, 16, 0.7)).expect("enough samples");
        assert!((found.ratio / 4.0).ln().abs() <= found.factor.ln().max(0.1), "{found:?}");
        assert_eq!(SpeedUp::of(&rendered(1, 7, 0.7), &rendered(2, 16, 0.7)), None);
    }

    const SIZE: [u32; 2] = [48, 32];

    /// The office under the sun, rendered as the window does.
    fn office(sampling: Sampling, seed: u32, samples: u32) -> SessionSnapshot {
        static SCENE: OnceLock<(World, Environment)> = OnceLock::new();
        let (world, environment) = SCENE.get_or_init(|| {
            let map = sky::build("day", 256, 128).expect("a sky");
            let environment = Environment::new(map, &EnvironmentOptions::default());
            let world = World::new(builtin::build("office").expect("built in"));
            (world, environment.expect("a sound map"))
        });
        let camera = world.scene.cameras[0].clone();
        let learning_paths = 1 << 13;
        let view = View {
            sampling,
            seed,
            sharing: Sharing::Off,
            learning_paths,
            ..View::new(camera, SIZE)
        };
        let mut session = Session::new(world, environment, view);
        let rule = StopRule { samples: Some(samples), ..StopRule::default() };
        while session.phase() == Phase::Learning || !rule.is_met(&session) {
            let pass = rule.next_pass(&session);
            session.advance(pass, &AtomicBool::new(false)).expect("no GPU");
        }
        SessionSnapshot {
            samples: session.samples(),
            film: Arc::new(session.film().clone()),
            figures: session.figures(),
            // What is compared does not depend on the clock.
            ..rendered(0, 1, 1.0)
        }
    }

    #[test]
    fn a_real_method_against_itself_is_as_fast() {
        let runs = 16;
        let covered = (0..runs).filter(|run| {
            let [one, other] = [2 * run, 2 * run + 1].map(|s| office(Sampling::Adaptive, s, 16));
            let found = SpeedUp::of(&one, &other).expect("enough samples");
            println!("{found:?}");
            found.ratio.ln().abs() <= found.factor.ln()
        });
        // One in a hundred such tests would find fewer.
        assert!(covered.count() >= 13);
    }

    #[test]
    fn what_is_told_of_one_run_is_what_a_reference_tells_of_many() {
        let reference = office(Sampling::Adaptive, 100, 1024).film.image();
        let (mut told, mut found) = (0.0, [0.0; 2]);
        let seeds = 6;
        for seed in 0..seeds {
            let takes = [Sampling::Adaptive, Sampling::Plain].map(|how| office(how, seed, 32));
            told += SpeedUp::of(&takes[0], &takes[1]).expect("enough samples").ratio.ln();
            for (sum, take) in found.iter_mut().zip(&takes) {
                *sum += compare(&take.film.image(), &reference).expect("of a size").trimmed_rel_mse;
            }
        }
        let (told, found) = ((told / f64::from(seeds)).exp(), found[1] / found[0]);
        println!("{told:.2} told, {found:.2} found");
        assert!(found > 2.0 && (told / found).ln().abs() < 1.4_f64.ln(), "{told}, {found}");
    }
}
