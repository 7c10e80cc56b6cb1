//! Light on all pixels, as it is filtered.

use glam::Vec3;
use rayon::prelude::*;

use super::guides::{Guides, falling, pairs};
use super::samples::Samples;
use crate::color::luminance;

/// Luminances have nothing in common that are so many of their standard errors apart.
pub(crate) const ERRORS_TOLERATED: f32 = 3.5;
/// The same of no variance: not zero.
pub(crate) const MIN_VARIANCE: f32 = 1e-12;
/// No variance and no luminance that is compared is larger, so that sums of them are finite.
pub(crate) const MAX_VARIANCE: f32 = 1e30;
pub(crate) const MAX_LUMINANCE: f32 = 1e15;
/// The variance of a single sample.
pub(super) const UNKNOWN: f32 = -1.0;

/// Light on all pixels, albedo taken out, and the variance of its luminance; negative where it is not known.
pub(super) struct Light {
    pub(super) rgb: [Vec<f32>; 3],
    pub(super) luminance: Vec<f32>,
    pub(super) variance: Vec<f32>,
}

impl Light {
    /// That of samples.
    pub(super) fn of(samples: &Samples<'_>, guides: &Guides) -> Self {
        let undressed = |index: usize| {
            let (albedo, mean) = (guides.at(index).albedo, samples.mean(index));
            let scale = 1.0 / luminance(albedo);
            let variance = mean.variance.map_or(UNKNOWN, |variance| variance * scale * scale);
            (mean.rgb / albedo, variance.min(MAX_VARIANCE))
        };
        let pixels: Vec<(Vec3, f32)> =
            (0..guides.width * guides.height).into_par_iter().map(undressed).collect();
        Self {
            rgb: [0, 1, 2].map(|c| pixels.iter().map(|(rgb, _)| rgb[c]).collect()),
            luminance: pixels.iter().map(|(rgb, _)| compared_luminance(*rgb)).collect(),
            variance: pixels.iter().map(|(_, variance)| *variance).collect(),
        }
    }

    /// None on any pixel.
    pub(super) fn black(pixels: usize) -> Self {
        let plane = || vec![0.0; pixels];
        Self { rgb: [plane(), plane(), plane()], luminance: plane(), variance: plane() }
    }

    /// Multiplies each weight by how well the light fits that of the pixels from `there` on. It is the same for both
    /// of two pixels: what one gives the other gets.
    #[inline(always)]
    pub(super) fn compare(&self, [here, there]: [usize; 2], weights: &mut [f32]) {
        let at = ([here, there], weights.len());
        let [luminance, variance] = [&self.luminance, &self.variance].map(|plane| pairs(plane, at));
        for (i, weight) in weights.iter_mut().enumerate() {
            let difference = luminance.0[i] - luminance.1[i];
            let variance = variance.0[i] + variance.1[i] + MIN_VARIANCE;
            *weight *= falling(
                difference * difference * (1.0 / (ERRORS_TOLERATED * ERRORS_TOLERATED)) / variance,
            );
        }
    }
}

/// Luminance for comparisons.
pub(super) fn compared_luminance(rgb: Vec3) -> f32 {
    luminance(rgb).min(MAX_LUMINANCE)
}
