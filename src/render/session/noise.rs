//! How good pictures really are beside what their samples' own spread tells.
//!
//! The points of a scrambled sequence avoid each other, so that a pixel's mean is better than the mean of
//! as many independent samples. Both halves of a pixel's samples estimate the same: a quarter of their squared
//! difference is an estimate of the variance of their mean that knows of this within the halves, though
//! not between them (replication, Owen 1997). One pixel's says little; the sum over many does.

use std::sync::{Mutex, MutexGuard, PoisonError};

use serde::{Deserialize, Serialize};

use crate::metrics::trimmed_mean;
use crate::render::film::{Film, Pixel, relative};

/// Fewest samples a pixel with which noise ends a picture.
pub(in crate::render) const MIN_SAMPLES_FOR_NOISE: u32 = 16;
/// Fewest samples a pixel of a picture on the CPU that a later one is compared with, to find its noise.
const FIRST_NOTED: u32 = 2;
/// Of how many pixels at most, spread over the picture.
const MAX_PIXELS: usize = 1 << 14;
/// Fewer pixels tell too little of what is saved: of few squares, the largest left out, the mean is too small (0.65 of
/// it for 4, 0.98 for 256).
const MIN_PIXELS: usize = 1 << 8;

/// Some pixels as they were when they had at most half their samples. A checkpoint keeps it, to the bit.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Doubling {
    /// Samples, and the bits of their mean luminance.
    halves: Vec<(u32, u64)>,
    samples: u32,
    /// The bits of [`Self::saved`].
    saved: u64,
}

impl Doubling {
    /// [`crate::render::Figures::variance_saved`].
    pub(super) fn saved(&self) -> f64 {
        f64::from_bits(self.saved)
    }

    /// Takes note of a picture with so many samples a pixel, if they are at least `first` and twice those of
    /// the one before.
    fn note(&mut self, film: &Film, samples: u32, first: u32) {
        if samples < first.max(self.samples.saturating_mul(2)) {
            return;
        }
        let stride = film.pixels().len().div_ceil(MAX_PIXELS).max(1);
        let chosen = film.pixels().iter().step_by(stride);
        let scales = film.error_scales(stride);
        let (mut found, mut told) = (Vec::new(), Vec::new());
        for ((pixel, half), scale) in chosen.clone().zip(&self.halves).zip(scales) {
            if let Some(variance) = variance_between(pixel, *half) {
                found.push(relative(variance, scale));
                told.push(relative(pixel.variance_of_mean(), scale));
            }
        }
        let saved = 1.0 - trimmed_mean(&mut found) / trimmed_mean(&mut told);
        if saved.is_finite() && found.len() >= MIN_PIXELS {
            self.saved = saved.to_bits();
        }
        let noted = |pixel: &Pixel| (pixel.samples(), pixel.mean_luminance().to_bits());
        self.halves = chosen.map(noted).collect();
        self.samples = samples;
    }
}

/// [`Doubling`] of a film that is rendered.
#[derive(Default)]
pub(super) struct Noise(Mutex<Doubling>);

impl Noise {
    /// What noise is found by.
    pub(super) fn noted(&self) -> MutexGuard<'_, Doubling> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Goes on with what noise was found by.
    pub(super) fn set(&mut self, noted: Doubling) {
        self.0 = Mutex::new(noted);
    }

    /// Takes note of the film where it has twice the samples of the one noted before. A GPU's is not read for
    /// this: it is noted when somebody asks, which is after equal samples only from those on with which
    /// noise can end a picture.
    pub(super) fn note(&self, film: &Film, samples: u32, is_on_gpu: bool) {
        let first = if is_on_gpu { MIN_SAMPLES_FOR_NOISE } else { FIRST_NOTED };
        self.noted().note(film, samples, first);
    }
}

/// Variance of the mean of all samples, from the means of the first and of the others.
fn variance_between(pixel: &Pixel, (first, mean_of_first): (u32, u64)) -> Option<f64> {
    let mean_of_first = f64::from_bits(mean_of_first);
    let others = pixel.samples().checked_sub(first).filter(|others| *others > 0 && first > 0)?;
    let (first, others, all) = (f64::from(first), f64::from(others), f64::from(pixel.samples()));
    let mean_of_others = (all * pixel.mean_luminance() - first * mean_of_first) / others;
    Some((mean_of_first - mean_of_others).powi(2) * first * others / (all * all))
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use crate::environment::{Environment, EnvironmentOptions, sky};
    use crate::metrics::trimmed_mean;
    use crate::path::World;
    use crate::render::{Sampling, Session, Sharing, StopRule, View};
    use crate::scene::builtin;

    /// Root mean squared noise of several pictures: as told, as samples' spread alone would have it, and as
    /// they differ from each other.
    fn noise(scene: &str, sampling: Sampling, sharing: Sharing) -> [f64; 3] {
        let map = sky::build("overcast", 128, 64).expect("a sky");
        let environment =
            Environment::new(map, &EnvironmentOptions::default()).expect("a sound map");
        let world = World::new(builtin::build(scene).expect("built in"));
        let rule = StopRule { samples: Some(64), ..StopRule::default() };
        let pictures: Vec<_> = (1..9)
            .map(|seed| {
                let view = View::new(world.scene.cameras[0].clone(), [48, 27]);
                let view = View { sampling, sharing, seed, ..view };
                let mut session = Session::new(&world, &environment, view);
                while !rule.is_met(&session) {
                    let samples = rule.next_pass(&session);
                    session.advance(samples, &AtomicBool::new(false)).expect("no GPU");
                }
                (session.noise(), session.film().clone())
            })
            .collect();
        let count = pictures.len() as f64;
        let told = pictures.iter().map(|(noise, _)| noise.powi(2)).sum::<f64>() / count;
        let spread = pictures.iter().map(|(_, film)| film.noise().powi(2)).sum::<f64>() / count;
        let pixels = pictures[0].1.pixels().len();
        let of =
            |at: usize| pictures.iter().map(move |(_, film)| film.pixels()[at].mean_luminance());
        let means: Vec<f64> = (0..pixels).map(|at| of(at).sum::<f64>() / count).collect();
        let floor = 0.01 * (means.iter().sum::<f64>() / pixels as f64).powi(2);
        let variance = |at: usize| {
            let squares: f64 = of(at).map(|value| (value - means[at]).powi(2)).sum();
            squares / (count - 1.0) / (means[at].powi(2) + floor)
        };
        let found = trimmed_mean(&mut (0..pixels).map(variance).collect::<Vec<_>>());
        [told, spread, found].map(f64::sqrt)
    }

    #[test]
    fn noise_is_told_as_pictures_differ() {
        for (scene, sampling, sharing, saves) in [
            ("open", Sampling::Plain, Sharing::Off, true),
            ("open", Sampling::Adaptive, Sharing::Off, true),
            ("office", Sampling::Adaptive, Sharing::Off, false),
            ("office", Sampling::Plain, Sharing::Large, false),
        ] {
            let [told, spread, found] = noise(scene, sampling, sharing);
            eprintln!(
                "{scene}, {sampling:?}, {sharing:?}: {told:.4}, spread {spread:.4}; {found:.4}"
            );
            assert!((0.8..1.25).contains(&(told / found)), "{scene}: {told} for {found}");
            assert!(!saves || spread > 1.4 * found, "{scene}: nothing was saved");
        }
    }
}
