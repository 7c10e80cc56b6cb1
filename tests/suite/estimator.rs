//! Tests of the estimator as a whole: paths, light grid, film.
//!
//! Known answers first, then agreement of the sampling modes with each other, then that the same
//! seed gives the same bits, then bounds on memory and odd input.

mod block_noise;
mod bounds;
mod cached;
mod few_samples;
mod known_glass;
mod known_light;
mod known_media;
mod known_paths;
mod many_lights;
mod repeatable;
pub(crate) mod scenes;
mod sharing;
mod smooth_shapes;
mod through_glass;
mod unbiased;

use std::sync::atomic::AtomicBool;

use glam::Vec3;
use lightgrid::environment::{Environment, EnvironmentOptions};
use lightgrid::image::Image;
use lightgrid::path::{PathLimits, World};
use lightgrid::render::film::{Film, Pixel};
use lightgrid::render::filter::PixelFilter;
use lightgrid::render::{Phase, Sampling, Session, StopRule, View};
use lightgrid::scene::Camera;

pub(crate) const MODES: [Sampling; 4] =
    [Sampling::Bsdf, Sampling::Plain, Sampling::Talk, Sampling::Adaptive];

/// Rounding that an answer may be off by, relative: ray origins are moved by 2^-16.
const ROUNDING: f64 = 1e-4;

/// A small picture without Russian roulette.
pub(crate) fn view(camera: Camera, sampling: Sampling, bounces: u32) -> View {
    View {
        filter: PixelFilter::Box,
        sampling,
        limits: PathLimits { bounces, russian_roulette: false },
        seed: 1,
        learning_paths: 1 << 13,
        ..View::new(camera, [16, 16])
    }
}

/// A camera that sees little more than one point.
fn probe(eye: impl Into<Vec3>, target: impl Into<Vec3>) -> Camera {
    Camera::look_at(eye.into(), target.into(), 1e-3)
}

fn constant(radiance: f32) -> Environment {
    environment(Image::filled(16, 8, [radiance; 3]))
}

fn environment(map: Image) -> Environment {
    Environment::new(map, &EnvironmentOptions::default()).expect("a sound map")
}

/// Learns if the view asks for it, then renders pass by pass as users do, so that distributions change on
/// the way.
pub(crate) fn render(world: &World, environment: &Environment, view: View, samples: u32) -> Film {
    let mut session = learned(world, environment, view);
    let rule = StopRule { samples: Some(samples), ..StopRule::default() };
    while !rule.is_met(&session) {
        let pass = rule.next_pass(&session);
        session.advance(pass, &AtomicBool::new(false)).expect("the CPU does not fail");
    }
    assert_eq!(session.samples(), samples);
    session.film().clone()
}

/// A session that has done its learning.
fn learned<'a>(world: &'a World, environment: &'a Environment, view: View) -> Session<'a> {
    let mut session = Session::new(world, environment, view);
    while session.phase() == Phase::Learning {
        session.advance(0, &AtomicBool::new(false)).expect("the CPU does not fail");
    }
    session
}

/// Mean over the picture.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Mean {
    rgb: [f64; 3],
    pub(crate) luminance: f64,
    /// Of the luminance, from the samples' own spread.
    pub(crate) standard_error: f64,
}

pub(crate) fn mean(film: &Film) -> Mean {
    assert_eq!(film.invalid_samples(), 0);
    let count = film.pixels().len() as f64;
    let average = |f: &dyn Fn(&Pixel) -> f64| film.pixels().iter().map(f).sum::<f64>() / count;
    Mean {
        rgb: [0, 1, 2].map(|c| average(&|p| p.mean()[c])),
        luminance: average(&Pixel::mean_luminance),
        standard_error: (average(&Pixel::variance_of_mean) / count).sqrt(),
    }
}

/// Asserts that the picture's mean luminance is `expected` within four standard errors, and that
/// those are at most `precision` of it: a test too noisy to tell must not pass.
fn expect(what: &str, film: &Film, expected: f64, precision: f64) {
    let found = mean(film);
    let (error, noise) = (found.luminance - expected, 4.0 * found.standard_error);
    eprintln!("{what}: {:.6} for {expected:.6}, noise {noise:.6}", found.luminance);
    assert!(noise <= precision * expected, "{what}: noise {noise} is too large to tell");
    assert!(
        error.abs() <= noise + ROUNDING * expected,
        "{what}: {} instead of {expected}, four standard errors are {noise}",
        found.luminance
    );
}

/// Asserts that two independent pictures have the same mean within four joint standard errors, which
/// must be within `precision` of it.
fn expect_same_mean(what: &str, a: &Film, b: &Film, precision: f64) {
    let (a, b) = (mean(a), mean(b));
    let noise = 4.0 * a.standard_error.hypot(b.standard_error);
    eprintln!("{what}: {:.6} and {:.6}, noise {noise:.6}", a.luminance, b.luminance);
    assert!(noise <= precision * a.luminance, "{what}: noise {noise} is too large to tell");
    assert!(
        (a.luminance - b.luminance).abs() <= noise + ROUNDING * a.luminance,
        "{what}: {} and {} differ by more than {noise}",
        a.luminance,
        b.luminance
    );
}
