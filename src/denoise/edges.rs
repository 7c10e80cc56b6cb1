//! Pixels on edges, after the filter: each shows a mixture like no other's, so nothing was averaged for it.
//!
//! What it shows is nearly linear in its guides, for these are mixed in the same proportion: a weighted regression of
//! the radiance around it on the guides (Bitterli et al., *Nonlinearly Weighted First-order Regression for Denoising
//! Monte Carlo Renderings*, 2016) tells what it should show, and by the errors of both it is blended with what
//! it shows.

use glam::Vec3;
use rayon::prelude::*;

use super::guides::{Guide, Guides, around};
use super::light::{Light, compared_luminance};
use super::samples::Samples;
use crate::color::luminance;
use crate::image::Image;

/// With fewer like pixels than this, of 24, a pixel's light is taken from a regression.
pub(crate) const MIN_ALIKE: f32 = 8.0;
/// With fewer than this it is on an edge.
pub(crate) const WHOLE: f32 = 18.0;
/// Pixels on edges with up to this many samples show the mean of their neighbours. With more samples the share of that
/// mean is this constant over their number.
pub(crate) const CHANCE_SAMPLES: f32 = 1.5;
/// Columns and rows around a pixel that tell its light.
const REACH: usize = 2;
/// Error of all light relative to it and to what is told: what is bright counts for what is dark no more than in
/// proportion.
pub(crate) const RELATIVE_ERROR: f32 = 0.1;
/// The same of no light: not zero.
const MIN_VARIANCE: f32 = 1e-12;
/// By how much coefficients are drawn to zero where guides say little.
pub(crate) const RIDGE: f32 = 1e-3;
/// Relative difference of depths that counts as much as one of normals of 1.
pub(crate) const DEPTH_SCALE: f32 = 0.1;
/// A constant, albedo, normal and nearness.
const TERMS: usize = 6;

/// The picture with its edges mended. Where a pixel has few samples its part of an edge is chance: there edges are
/// as wide as the pixel filter draws them.
pub(super) fn mended(
    samples: &Samples<'_>,
    guides: &Guides,
    light: &Light,
    support: &[f32],
) -> Image {
    let size @ [width, height] = [guides.width, guides.height];
    let radiance = |index: usize| {
        let albedo = guides.at(index).albedo;
        let rgb = Vec3::from(light.rgb.each_ref().map(|plane| plane[index])) * albedo;
        Radiance { rgb, variance: light.variance[index] * luminance(albedo).powi(2) }
    };
    let pixels: Vec<Radiance> = (0..width * height).into_par_iter().map(radiance).collect();
    let filled = |index: usize| {
        if support[index] < MIN_ALIKE { regress(guides, &pixels, index) } else { pixels[index].rgb }
    };
    let filled: Vec<Vec3> = (0..pixels.len()).into_par_iter().map(filled).collect();
    let smooth = |index: usize| {
        let own = filled[index];
        if support[index] >= WHOLE {
            return own.to_array();
        }
        let (mut sum, mut total) = (Vec3::ZERO, 0.0);
        for (other, [column, row]) in around(index, size, 1) {
            let weight = ((2 - column) * (2 - row)) as f32;
            (sum, total) = (sum + filled[other] * weight, total + weight);
        }
        let share = (CHANCE_SAMPLES / samples.count(index).max(1) as f32).min(1.0);
        own.lerp(sum / total, share).to_array()
    };
    let pixels = (0..filled.len()).into_par_iter().map(smooth).collect();
    Image { width: width as u32, height: height as u32, pixels }
}

/// What a pixel shows, and the variance of its luminance.
struct Radiance {
    rgb: Vec3,
    variance: f32,
}

/// What the pixels around one say it shows, blended with what it shows.
fn regress(guides: &Guides, pixels: &[Radiance], index: usize) -> Vec3 {
    let size = [guides.width, guides.height];
    let own = guides.at(index);
    let own_light = compared_luminance(pixels[index].rgb);
    let mut others = [(0.0, [0.0; TERMS], Vec3::ZERO); (2 * REACH + 1).pow(2)];
    for ((other, [column, row]), witness) in around(index, size, REACH).zip(&mut others) {
        let near = 1.0 - (column * column + row * row) as f32 / (REACH + 1).pow(2) as f32;
        let light = compared_luminance(pixels[other].rgb);
        let relative = RELATIVE_ERROR.powi(2) * (light * light + own_light * own_light);
        let error = pixels[other].variance + relative + MIN_VARIANCE;
        *witness = (near / error, terms(&own, &guides.at(other)), pixels[other].rgb);
    }
    let mut system = [[0.0; TERMS]; TERMS];
    let mut sides = [Vec3::ZERO; TERMS];
    for (weight, terms, rgb) in others {
        for row in 0..TERMS {
            for column in 0..=row {
                system[row][column] += weight * terms[row] * terms[column];
            }
            sides[row] += rgb * (weight * terms[row]);
        }
    }
    let total = system[0][0];
    (1..TERMS).for_each(|term| system[term][term] += RIDGE * total);
    let coefficients = solved(system, sides);
    let misfit = |(weight, terms, rgb): (f32, [f32; TERMS], Vec3)| {
        let fitted: Vec3 = coefficients.iter().zip(terms).map(|(c, term)| *c * term).sum();
        weight * luminance(fitted - rgb).powi(2)
    };
    let error = others.into_iter().map(misfit).sum::<f32>() / total;
    let fitted = coefficients[0].max(Vec3::ZERO);
    let share = error / (error + pixels[index].variance).max(f32::MIN_POSITIVE);
    fitted.lerp(pixels[index].rgb, share)
}

/// How a pixel's guides differ from the one that is asked about, after the constant.
fn terms(own: &Guide, other: &Guide) -> [f32; TERMS] {
    let normal = other.normal - own.normal;
    let albedo = luminance(other.albedo - own.albedo);
    let nearness = (other.nearness - own.nearness)
        / (DEPTH_SCALE * own.nearness.max(other.nearness)).max(f32::MIN_POSITIVE);
    [1.0, albedo, normal.x, normal.y, normal.z, nearness]
}

/// Solves a symmetric system, of which the lower triangle is given, by LDL^T.
fn solved(mut system: [[f32; TERMS]; TERMS], mut sides: [Vec3; TERMS]) -> [Vec3; TERMS] {
    let least = 1e-9 * system[0][0];
    for row in 0..TERMS {
        for column in 0..=row {
            let known = |k: usize| system[row][k] * system[column][k] * system[k][k];
            let rest = system[row][column] - (0..column).map(known).sum::<f32>();
            system[row][column] =
                if column < row { rest / system[column][column] } else { rest.max(least) };
        }
        let known: Vec3 = (0..row).map(|k| sides[k] * system[row][k]).sum();
        sides[row] -= known;
    }
    for row in (0..TERMS).rev() {
        let known: Vec3 = (row + 1..TERMS).map(|k| sides[k] * system[k][row]).sum();
        sides[row] = sides[row] / system[row][row] - known;
    }
    sides
}
