//! How much faster one way of sampling is than another, from two films of the same view.

use super::worker::Take;

/// Blocks along each side of the picture that the uncertainty is taken from.
const BLOCKS: usize = 8;

/// An effective speed-up: how many times the time the plain method needs for the same error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SpeedUp {
    /// The ratio.
    pub(super) ratio: f64,
    /// Its relative standard error (jackknife over blocks of the picture).
    pub(super) relative_error: f64,
}

impl SpeedUp {
    /// From relative squared errors times seconds; `None` below eight samples a pixel.
    pub(super) fn of(main: &Take, plain: &Take) -> Option<Self> {
        if main.film.min_samples() < 8 || plain.film.min_samples() < 8 {
            return None;
        }
        let (a, p) = (block_errors(main, main), block_errors(plain, main));
        let seconds = plain.figures.elapsed_seconds() / main.figures.elapsed_seconds();
        let (sum_a, sum_p) = (a.iter().sum::<f64>(), p.iter().sum::<f64>());
        let ratio = |a: f64, p: f64| p / a * seconds;
        let whole = ratio(sum_a, sum_p);
        let count = a.len() as f64;
        let spread: f64 = a
            .iter()
            .zip(&p)
            .map(|(a, p)| (ratio(sum_a - a, sum_p - p).ln() - whole.ln()).powi(2))
            .sum();
        let relative_error = (spread * (count - 1.0) / count).sqrt();
        (whole.is_finite() && relative_error.is_finite())
            .then_some(Self { ratio: whole, relative_error })
    }
}

/// Sum over each block's pixels of variance over squared luminance, the latter from `reference`.
fn block_errors(take: &Take, reference: &Take) -> Vec<f64> {
    let film = &take.film;
    let (width, height) = (film.width as usize, film.height as usize);
    let lights = reference.film.pixels();
    let mean = lights.iter().map(|p| p.mean_luminance()).sum::<f64>() / lights.len() as f64;
    let mut sums = vec![0.0; BLOCKS * BLOCKS];
    for (i, (pixel, light)) in film.pixels().iter().zip(lights).enumerate() {
        let block = (i / width) * BLOCKS / height * BLOCKS + (i % width) * BLOCKS / width;
        let squared = light.mean_luminance().powi(2) + 0.01 * mean * mean;
        sums[block] += pixel.variance_of_mean() / squared;
    }
    sums
}
