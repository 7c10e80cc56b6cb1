//! The film: many samples, and large samples beside small ones.

use glam::Vec3;

use super::case::{Entry, On, Setting};
use super::outcome::Outcome;
use super::scenes::{constant, render, view};
use crate::error::Result;
use crate::path::{PathResult, WorldBuilder};
use crate::render::film::Pixel;
use crate::render::{Sampling, View};
use crate::sampler::SplitMix;
use crate::scene::Camera;

pub(super) const CASES: &[Entry] = &[
    ("1e7-samples-in-a-pixel", On::Cpu, |_| {
        Ok(sums(|random| 10.0_f32.powf(4.0 * random.next_f32() - 2.0)))
    }),
    ("1e-8-beside-1e8", On::Cpu, |_| {
        Ok(sums(|random| if random.next_bits() & 1 == 0 { 1e-8 } else { 1e8 }))
    }),
    ("1e7-samples-rendered", On::Any, |s| {
        rendered(s, 0.1, if s.gpu.is_some() { s.count(100_000, 10_000_000) } else { 10_000_000 })
    }),
    ("1e-8-rendered", On::Any, |s| rendered(s, 1e-8, 10_000)),
    ("1e8-rendered", On::Any, |s| rendered(s, 1e8, 10_000)),
];

const SAMPLES: u32 = 10_000_000;

/// Ten million samples of one pixel against compensated sums (Neumaier 1974) in f64. Green is always 1e-8, to
/// show that a bright channel does not affect a dark one.
fn sums(draw: impl Fn(&mut SplitMix) -> f32) -> Outcome {
    const GREEN: f32 = 1e-8;
    let mut random = SplitMix(1);
    let mut pixel = Pixel::default();
    let (mut exact, mut exact_squares) = (Compensated::default(), Compensated::default());
    for _ in 0..SAMPLES {
        let radiance = Vec3::new(draw(&mut random), GREEN, 0.0);
        pixel.add(&PathResult { radiance, ..PathResult::default() });
        let luminance = f64::from(crate::color::luminance(radiance));
        exact.add(f64::from(radiance.x));
        exact_squares.add(luminance * luminance);
    }
    let count = f64::from(SAMPLES);
    let mean = exact.sum() / count;
    let luminance = pixel.mean_luminance();
    let variance = (exact_squares.sum() / count - luminance * luminance) / (count - 1.0);
    let relative = |found: f64, expected: f64| (found / expected - 1.0).abs();
    Outcome::default()
        .at_most("mean of 1e7 samples against f64, relative", relative(pixel.mean()[0], mean), 1e-9)
        .at_most("the dark channel, relative", relative(pixel.mean()[1], f64::from(GREEN)), 1e-9)
        .at_most("variance, relative", relative(pixel.variance_of_mean(), variance), 1e-7)
}

/// A sum with compensation of rounding errors.
#[derive(Default)]
struct Compensated {
    sum: f64,
    lost: f64,
}

impl Compensated {
    fn add(&mut self, x: f64) {
        let sum = self.sum + x;
        self.lost +=
            if self.sum.abs() >= x.abs() { (self.sum - sum) + x } else { (x - sum) + self.sum };
        self.sum = sum;
    }

    fn sum(&self) -> f64 {
        self.sum + self.lost
    }
}

/// One pixel that sees only a map of constant radiance.
fn rendered(setting: &Setting, radiance: f32, samples: u32) -> Result<Outcome> {
    let (world, environment) = (WorldBuilder::default().build(), constant(radiance)?);
    let camera = Camera::look_at(Vec3::ZERO, Vec3::X, 1.0);
    let view = View { width: 1, height: 1, ..view(camera, Sampling::Plain, 1) };
    let film = render(setting, (&world, &environment), view, samples)?;
    let off = (film.pixels()[0].mean()[0] / f64::from(radiance) - 1.0).abs();
    // The map is interpolated in f32, which rounds once; a GPU keeps radiance to 2^-18 of itself,
    // and adds up to 64 samples in f32.
    let limit = if setting.gpu.is_some() { 2e-5 } else { 2e-7 };
    Ok(Outcome::default()
        .sound(&film)
        .at_least("samples", f64::from(film.min_samples()), f64::from(samples))
        .at_most(format!("mean of {samples} samples, relative"), off, limit))
}
