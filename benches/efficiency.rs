//! The product's claim as ratios in one run: error of direct light at equal samples and equal rays,
//! `adaptive` and `talk` against `plain`.
//!
//! What the camera sees of the map itself (at `bounces` 0, with the same random numbers) is
//! subtracted from picture and reference: it is the same in all modes and measures the pixel filter.
//! Errors are relMSE against a long render with another seed, over three seeds; "trimmed" drops the
//! worst 0.1 % of pixels of each picture.

use lightgrid::environment::{Environment, EnvironmentOptions, sky};
use lightgrid::path::{PathLimits, World};
use lightgrid::render::filter::PixelFilter;
use lightgrid::render::{Figures, Sampling, Session, View};
use lightgrid::scene::builtin;

use super::advance;

const SIZE: (u32, u32) = (128, 72);
const SAMPLES: u32 = 32;
const REFERENCE_SAMPLES: u32 = 2048;
const SEEDS: u32 = 3;
const LEARNING_PATHS: u64 = 1 << 20;

/// Scene, sky, and the ratio that `adaptive` is to reach.
const CASES: [(&str, &str, f64); 6] = [
    ("office", "sunset", 6.0),
    ("living-room", "night", 8.0),
    ("living-room", "day", 1.0),
    ("living-room", "sunset", 1.0),
    ("exterior", "sunset", 2.0),
    ("open", "day", 1.0),
];

/// Prints the table.
pub(crate) fn report() {
    println!("direct light, {SAMPLES} samples, error ratio x ray ratio against plain");
    println!(
        "{:24} {:9} {:>8} {:>8} {:>6} {:>6} {:>8} {:>9}",
        "scene", "sampling", "relMSE", "trimmed", "rays", "time", "learn s", "grid MB"
    );
    for (scene, sky_name, goal) in CASES {
        let world = World::new(builtin::build(scene).expect("built in"));
        let map = sky::build(sky_name, 1024, 512).expect("built in");
        let environment =
            Environment::new(map, &EnvironmentOptions::default()).expect("a finite map");
        let case = Case { world: &world, environment: &environment };
        let reference = case.direct_light(Sampling::Adaptive, 1000, REFERENCE_SAMPLES).0;
        let plain = case.measure(Sampling::Plain, &reference);
        for sampling in [Sampling::Talk, Sampling::Adaptive] {
            let measured = case.measure(sampling, &reference);
            let rays = measured.rays / plain.rays;
            println!(
                "{:24} {:9} {:8.2} {:8.2} {rays:6.2} {:6.2} {:8.1} {:9.1}{}",
                format!("{scene} / {sky_name}"),
                format!("{sampling:?}").to_lowercase(),
                plain.error / measured.error / rays,
                plain.trimmed / measured.trimmed / rays,
                measured.seconds / plain.seconds,
                measured.learning_seconds,
                measured.grid_bytes as f64 / f64::from(1 << 20),
                if sampling == Sampling::Adaptive {
                    format!("  goal {goal}")
                } else {
                    String::new()
                },
            );
        }
    }
}

struct Case<'a> {
    world: &'a World,
    environment: &'a Environment,
}

#[derive(Default)]
struct Measured {
    error: f64,
    trimmed: f64,
    rays: f64,
    seconds: f64,
    learning_seconds: f64,
    grid_bytes: usize,
}

impl Case<'_> {
    fn measure(&self, sampling: Sampling, reference: &[[f64; 3]]) -> Measured {
        let mut sum = Measured::default();
        for seed in 0..SEEDS {
            let (picture, figures) = self.direct_light(sampling, seed, SAMPLES);
            let (error, trimmed) = errors(&picture, reference);
            sum.error += error / f64::from(SEEDS);
            sum.trimmed += trimmed / f64::from(SEEDS);
            sum.rays += figures.rays as f64;
            sum.seconds += figures.render_seconds;
            sum.learning_seconds += figures.learning_seconds / f64::from(SEEDS);
            sum.grid_bytes = sum.grid_bytes.max(figures.grid_peak_bytes);
        }
        sum
    }

    /// Mean direct light per pixel, what is seen directly subtracted.
    fn direct_light(
        &self,
        sampling: Sampling,
        seed: u32,
        samples: u32,
    ) -> (Vec<[f64; 3]>, Figures) {
        let (mut picture, figures) = self.render(sampling, seed, samples, 1);
        let (seen, _) = self.render(Sampling::Plain, seed, samples, 0);
        for (pixel, seen) in picture.iter_mut().zip(seen) {
            pixel.iter_mut().zip(seen).for_each(|(p, s)| *p -= s);
        }
        (picture, figures)
    }

    fn render(
        &self,
        sampling: Sampling,
        seed: u32,
        samples: u32,
        bounces: u32,
    ) -> (Vec<[f64; 3]>, Figures) {
        let view = View {
            filter: PixelFilter::Box,
            sampling,
            limits: PathLimits { bounces, russian_roulette: true },
            seed,
            learning_paths: LEARNING_PATHS,
            ..View::new(self.world.scene.cameras[0].clone(), [SIZE.0, SIZE.1])
        };
        let mut session = Session::new(self.world, self.environment, view);
        advance(&mut session, samples);
        (session.film().pixels().iter().map(|p| p.mean()).collect(), session.figures())
    }
}

/// relMSE, and the same without the worst 0.1 % of pixels.
fn errors(picture: &[[f64; 3]], reference: &[[f64; 3]]) -> (f64, f64) {
    let mean = reference.iter().flatten().sum::<f64>() / (3 * reference.len()) as f64;
    let mut errors: Vec<f64> = picture
        .iter()
        .zip(reference)
        .map(|(p, r)| {
            let channel = |i: usize| {
                let (p, r) = (p[i] / mean, r[i] / mean);
                (p - r).powi(2) / (r * r + 0.01)
            };
            (channel(0) + channel(1) + channel(2)) / 3.0
        })
        .collect();
    let total = errors.iter().sum::<f64>() / errors.len() as f64;
    errors.sort_by(f64::total_cmp);
    errors.truncate(errors.len() - errors.len().div_ceil(1000));
    (total, errors.iter().sum::<f64>() / errors.len() as f64)
}
