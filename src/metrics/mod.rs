//! Comparing pictures, and deciding whether two estimates agree.

#[cfg_attr(not(feature = "flip"), path = "no_flip.rs")]
pub(crate) mod flip;
pub mod hypothesis;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::color::luminance;
use crate::error::{Error, Result};
use crate::image::Image;
use crate::tone::auto_exposure_ev;

/// How far a picture is from its reference. All but `flip` are in units of the reference's mean, so
/// that they do not depend on the exposure. 0 is equal (1 for `mean_ratio`).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Mean over pixels and channels of `(a - r)^2`.
    pub mse: f64,
    /// Mean over pixels and channels of `(a - r)^2 / (r^2 + 0.01)`.
    pub rel_mse: f64,
    /// [`Self::rel_mse`] without the 0.1 % of the pixels (at least one) where it is worst: robust to
    /// fireflies.
    pub trimmed_rel_mse: f64,
    /// [`Self::rel_mse`] of the means of 8x8 pixels, without its worst block: the coarse
    /// error, which no denoiser can tell from the picture.
    pub block_rel_mse: f64,
    /// Mean of the picture over mean of the reference, all channels together.
    pub mean_ratio: f64,
    /// Mean LDR-FLIP error in `[0,1]` at 67 pixels per degree (Andersson et al. 2020), of both
    /// pictures through the ACES curve at [`Self::flip_exposure_ev`]; `None` where the feature `flip` is
    /// not built in.
    pub flip: Option<f64>,
    /// The automatic exposure of the reference, in stops.
    pub flip_exposure_ev: f32,
}

/// Added to the squared reference in relMSE, in units of its squared mean.
pub(crate) const REL_MSE_EPSILON: f64 = 1e-2;

/// Sides of the blocks that coarse errors are taken of, in pixels.
pub(crate) const BLOCK: u32 = 8;

/// Compares a linear picture with its reference.
///
/// # Errors
/// If the sizes differ, a pixel of either is not finite, or the reference is black.
pub fn compare(image: &Image, reference: &Image) -> Result<Comparison> {
    if (image.width, image.height) != (reference.width, reference.height) {
        return Err(Error::new(format!(
            "the pictures differ in size: {} x {} and {} x {}",
            image.width, image.height, reference.width, reference.height
        )));
    }
    check_finite(image, "the picture")?;
    check_finite(reference, "the reference")?;
    let reference_mean = mean(reference);
    if reference_mean <= 0.0 {
        return Err(Error::new("the reference is black: errors relative to it have no meaning"));
    }
    let (mse, mut relative) = squared_errors(image, reference, reference_mean);
    let (_, mut of_blocks) =
        squared_errors(&block_means(image), &block_means(reference), reference_mean);
    let flip_exposure_ev = auto_exposure_ev(reference);
    Ok(Comparison {
        mse,
        rel_mse: relative.iter().sum::<f64>() / relative.len() as f64,
        trimmed_rel_mse: trimmed_mean(&mut relative),
        block_rel_mse: trimmed_mean(&mut of_blocks),
        mean_ratio: mean(image) / reference_mean,
        flip: flip::errors(image, reference, flip_exposure_ev).map(|(_, mean)| mean),
        flip_exposure_ev,
    })
}

/// Mean squared error in units of `unit`, and each pixel's relative one.
fn squared_errors(image: &Image, reference: &Image, unit: f64) -> (f64, Vec<f64>) {
    let mut squared = 0.0;
    let of_pixel = |(a, r): (&[f32; 3], &[f32; 3])| {
        let mut relative = 0.0;
        for (a, r) in a.iter().zip(r) {
            let (a, r) = (f64::from(*a) / unit, f64::from(*r) / unit);
            let difference = (a - r) * (a - r);
            squared += difference / 3.0;
            relative += difference / (r * r + REL_MSE_EPSILON) / 3.0;
        }
        relative
    };
    let relative: Vec<f64> = image.pixels.iter().zip(&reference.pixels).map(of_pixel).collect();
    (squared / relative.len() as f64, relative)
}

/// Means of [`BLOCK`] x [`BLOCK`] pixels; what is left over at the right and at the bottom makes smaller
/// blocks.
pub(crate) fn block_means(image: &Image) -> Image {
    let (width, height) = (image.width.div_ceil(BLOCK), image.height.div_ceil(BLOCK));
    let mean = |block: u32| {
        let (x, y) = (block % width * BLOCK, block / width * BLOCK);
        image.mean(x..(x + BLOCK).min(image.width), y..(y + BLOCK).min(image.height))
    };
    Image { width, height, pixels: (0..width * height).map(mean).collect() }
}

/// What `Session::noise` estimates: the root of the mean over pixels, without the largest thousandth, of
/// `(a - r)^2 / (r^2 + 0.01 mean(r)^2)` of luminances. `None` if the sizes differ or the reference is
/// black.
pub fn relative_rms_error(image: &Image, reference: &Image) -> Option<f64> {
    if (image.width, image.height) != (reference.width, reference.height) {
        return None;
    }
    let light = |rgb: &[f32; 3]| f64::from(luminance((*rgb).into()));
    let count = reference.pixels.len() as f64;
    let mean = reference.pixels.iter().map(light).sum::<f64>() / count;
    let floor = REL_MSE_EPSILON * mean * mean;
    let pairs = image.pixels.iter().zip(&reference.pixels);
    let relative = |(a, r)| {
        let (a, r) = (light(a), light(r));
        (a - r) * (a - r) / (r * r + floor)
    };
    (mean > 0.0).then(|| trimmed_mean(&mut pairs.map(relative).collect::<Vec<_>>()).sqrt())
}

fn check_finite(image: &Image, which: &str) -> Result<()> {
    let bad = image.pixels.par_iter().filter(|rgb| !rgb.iter().all(|v| v.is_finite())).count();
    match (bad, image.pixels.len()) {
        (_, 0) => Err(Error::new(format!("{which} has no pixels"))),
        (0, _) => Ok(()),
        _ => Err(Error::new(format!("{which} has {bad} pixels that are NaN or infinite"))),
    }
}

/// Mean over pixels and channels.
pub(crate) fn mean(image: &Image) -> f64 {
    let sum: f64 = image.pixels.as_flattened().iter().map(|&v| f64::from(v)).sum();
    sum / (3 * image.pixels.len()) as f64
}

/// How many of so many values are left without the largest thousandth, at least one of them; of one it is
/// left.
pub(crate) fn kept_of(count: usize) -> usize {
    let trimmed = (count / 1000).max(1);
    count.saturating_sub(trimmed).max(1)
}

/// Mean without the largest thousandth, at least one value; of one value that value, of none NaN.
pub(crate) fn trimmed_mean(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return f64::NAN;
    }
    let kept = kept_of(values.len());
    values.select_nth_unstable_by(kept - 1, f64::total_cmp);
    values[..kept].iter().sum::<f64>() / kept as f64
}
