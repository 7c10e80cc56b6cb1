//! Bias: the distance between a method's limit and the reference.

use serde::{Deserialize, Serialize};

use super::statistics::Estimate;
use crate::image::Image;
use crate::metrics::{REL_MSE_EPSILON, block_means, mean};

/// Systematic error of the means of 8x8 pixels, relative, root mean square over blocks and channels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Bias {
    /// Title of the device.
    pub device: String,
    /// Name of the method.
    pub method: String,
    /// Estimate of the squared bias, the reference's own noise included; may be below 0 by chance where there
    /// is no bias.
    pub squared: f64,
    /// Standard error of `squared` by the jackknife over runs; `None` for two runs.
    pub standard_error: Option<f64>,
}

impl Bias {
    /// Estimates it from independent runs' pictures as the mean, over pairs of runs, of the product of both
    /// errors: independent noise cancels there. `None` with fewer than two runs.
    pub(super) fn new(
        device: &str,
        method: &str,
        pictures: &[Image],
        reference: &Image,
    ) -> Option<Self> {
        let unit = mean(reference);
        let reference = block_means(reference);
        let error = |(x, r): (&f32, &f32)| {
            let (x, r) = (f64::from(*x) / unit, f64::from(*r) / unit);
            (x - r) / (r * r + REL_MSE_EPSILON).sqrt()
        };
        let errors_of = |picture: &Image| {
            let blocks = block_means(picture);
            let pairs = blocks.pixels.as_flattened().iter().zip(reference.pixels.as_flattened());
            pairs.map(error).collect()
        };
        let errors: Vec<Vec<f64>> = pictures.iter().map(errors_of).collect();
        let squared = mean_product(&errors)?;
        let standard_error = (errors.len() > 2).then(|| {
            let count = errors.len() as f64;
            let without = |left_out: usize| {
                let mut others = errors.clone();
                others.remove(left_out);
                mean_product(&others).unwrap_or(squared)
            };
            // The jackknife (Efron and Stein, 1981).
            let squares =
                (0..errors.len()).map(|run| (without(run) - squared).powi(2)).sum::<f64>();
            ((count - 1.0) / count * squares).sqrt()
        });
        let (device, method) = (device.to_owned(), method.to_owned());
        Some(Self { device, method, squared, standard_error })
    }

    /// Its square with the standard error.
    pub(super) fn estimate(&self) -> Option<Estimate> {
        Some(Estimate { mean: self.squared, standard_error: self.standard_error })
    }

    /// The bias; 0 where chance makes its square negative.
    pub fn root(&self) -> f64 {
        self.squared.max(0.0).sqrt()
    }
}

/// Mean of the products over pairs of different runs and over all values.
fn mean_product(errors: &[Vec<f64>]) -> Option<f64> {
    let count = errors.len();
    if count < 2 {
        return None;
    }
    let of_value = |i: usize| {
        let values = errors.iter().map(|run| run[i]);
        let (sum, squares) = values.fold((0.0, 0.0), |(s, q), v| (s + v, q + v * v));
        sum * sum - squares
    };
    let values = errors[0].len();
    Some((0..values).map(of_value).sum::<f64>() / (count * (count - 1) * values) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::hash;

    /// A picture of mean 1 and one that is off by `bias` in blocks, with noise.
    fn pictures(bias: f32, noise: f32) -> (Vec<Image>, Image) {
        let reference = Image::from_fn(96, 64, |x, _| [if x < 48 { 0.5 } else { 1.5 }; 3]);
        let run = |seed: u32| {
            Image::from_fn(96, 64, |x, y| {
                let own = reference.pixels[(y * 96 + x) as usize][0];
                let off = if (x / 8 + y / 8) % 2 == 0 { bias } else { -bias };
                let random = hash(seed * 96 * 64 + y * 96 + x) as f32 / 2f32.powi(31) - 1.0;
                [own * (1.0 + off + noise * random); 3]
            })
        };
        ((0..6).map(run).collect(), reference)
    }

    #[test]
    fn bias_is_found_below_the_noise() {
        for (bias, noise) in [(0.03, 0.0), (0.03, 0.6), (0.0, 0.6)] {
            let (runs, reference) = pictures(bias, noise);
            let found = Bias::new("CPU", "cached", &runs, &reference).expect("six runs");
            // Dark pixels are off by a little less: 0.5^2 / (0.5^2 + 0.01).
            let truth = f64::from(bias * bias) * 0.98;
            let sigma = found.standard_error.expect("six runs") + 1e-6;
            assert!((found.squared - truth).abs() < 4.0 * sigma, "{found:?} {truth}");
            assert!(sigma < 3e-4, "{found:?}");
        }
        let (runs, reference) = pictures(0.0, 0.0);
        assert_eq!(Bias::new("CPU", "one", &runs[..1], &reference), None);
    }
}
