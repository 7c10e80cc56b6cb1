//! An edge-avoiding à-trous filter: noise goes, edges of surfaces and textures stay.
//!
//! Dammertz et al., *Edge-Avoiding À-Trous Wavelet Transform for fast Global Illumination
//! Filtering*, HPG 2010, on radiance divided by albedo, with the luminance tolerance taken from each
//! pixel's own error estimate (as Schied et al., *Spatiotemporal Variance-Guided Filtering*, HPG
//! 2017, do). A pixel on an edge shows a mixture like no other's around it; it is compared less
//! strictly, with the pixels nearby, until it finds some. Biased: for looking, not for measuring.

use glam::Vec3;
use rayon::prelude::*;

use crate::color::luminance;
use crate::image::Image;
use crate::render::film::{Film, Pixel};

/// Albedo that counts as none: black surfaces and the sky are smoothed as they are.
const LEAST_ALBEDO: f32 = 0.02;
/// Pixels between two taps of each pass. Where guides or light stop what the first passes should spread, later
/// ones put it at their taps alone, a lattice: the last two fill it.
pub(crate) const STEPS: [u32; 7] = [1, 2, 4, 8, 16, 3, 1];
/// Luminance differences are tolerated up to this many of their standard errors.
const ERRORS_TOLERATED: f32 = 1.5;
/// Pixels around one that share its error.
const REACH: usize = 3;
/// Weights of a B3 spline.
const KERNEL: [f32; 3] = [3.0 / 8.0, 1.0 / 4.0, 1.0 / 16.0];
/// Power of the cosine between normals.
const NORMAL_POWER: i32 = 64;
/// How strictly guides are compared, as a power of their likeness: the first of these with which a pixel
/// finds its like.
const STRICTNESS: [f32; 3] = [1.0, 1.0 / 4.0, 1.0 / 16.0];
/// Of the 24 pixels around one so many are its like.
const LEAST_ALIKE: f32 = 3.0;
/// A pixel is compared less strictly in passes of smaller steps than this; others reach other edges.
const STRICT_STEP: u32 = 4;

/// What tells surfaces apart.
#[derive(Clone, Copy)]
struct Guide {
    albedo: Vec3,
    normal: Vec3,
    depth: f32,
    /// One of [`STRICTNESS`].
    strictness: f32,
}

/// Light on one pixel, albedo taken out, and the variance of its luminance.
#[derive(Clone, Copy)]
struct Light {
    rgb: Vec3,
    variance: f32,
}

/// The film's picture, filtered. Without layers on the film it is the film's picture as it is.
pub(super) fn denoise(film: &Film) -> Image {
    let Some(layers) = film.surface_layers() else { return film.image() };
    let strict: Vec<Guide> = layers
        .albedo
        .iter()
        .zip(&layers.normal)
        .zip(&layers.depth)
        .map(|((albedo, normal), &depth)| {
            let (albedo, normal) = (Vec3::from(*albedo), Vec3::from(*normal));
            let seen = if normal == Vec3::ZERO { Vec3::ONE } else { albedo };
            Guide { albedo: seen.max(Vec3::splat(LEAST_ALBEDO)), normal, depth, strictness: 1.0 }
        })
        .collect();
    let relaxed = relaxed(&strict, film.width as usize);
    let mut light: Vec<Light> = film.pixels().iter().zip(&strict).map(undressed).collect();
    share_errors(&mut light, &relaxed, film.width as usize);
    for step in STEPS {
        let guides = if step < STRICT_STEP { &relaxed } else { &strict };
        light = filtered(&light, guides, film.width as usize, step as i32);
    }
    let pixels = light.iter().zip(&strict).map(|(l, g)| (l.rgb * g.albedo).to_array()).collect();
    Image { width: film.width, height: film.height, pixels }
}

fn undressed((pixel, guide): (&Pixel, &Guide)) -> Light {
    let mean = Vec3::from(pixel.mean().map(|c| c as f32));
    let scale = 1.0 / luminance(guide.albedo);
    // One sample says nothing about its error: then anything goes.
    let variance = pixel.variance_of_mean().min(f64::from(luminance(mean)).powi(2) + 1.0) as f32;
    Light { rgb: mean / guide.albedo, variance: variance * scale * scale }
}

/// The guides with how strictly each pixel is to be compared.
fn relaxed(guides: &[Guide], width: usize) -> Vec<Guide> {
    let height = guides.len() / width.max(1);
    let strictness_of = |index: usize| {
        let mut alike = [0.0; STRICTNESS.len()];
        for other in around(index, [width, height], 2).filter(|other| *other != index) {
            let likeness = likeness(&guides[index], &guides[other], 1);
            // Those of `STRICTNESS`.
            let powers = [likeness, likeness.sqrt().sqrt(), likeness.sqrt().sqrt().sqrt().sqrt()];
            alike.iter_mut().zip(powers).for_each(|(sum, power)| *sum += power);
        }
        let first = alike.iter().position(|sum| *sum >= LEAST_ALIKE);
        STRICTNESS[first.unwrap_or(STRICTNESS.len() - 1)]
    };
    let relaxed = |index: usize| Guide { strictness: strictness_of(index), ..guides[index] };
    (0..guides.len()).into_par_iter().map(relaxed).collect()
}

/// The pixels up to `reach` columns and rows from one, itself among them.
fn around(index: usize, [width, height]: [usize; 2], reach: usize) -> impl Iterator<Item = usize> {
    let (x, y) = (index % width, index / width);
    let columns = x.saturating_sub(reach)..(x + reach + 1).min(width);
    let rows = y.saturating_sub(reach)..(y + reach + 1).min(height);
    rows.flat_map(move |y| columns.clone().map(move |x| y * width + x))
}

/// Gives each pixel the mean error of its surface around it, if that is larger than its own: a pixel that
/// has met no light yet knows nothing of its error. One that has met too much knows: so its neighbours
/// take their part of it.
fn share_errors(light: &mut [Light], guides: &[Guide], width: usize) {
    let height = light.len() / width.max(1);
    let shared = |index: usize| {
        let (mut sum, mut total) = (0.0, 0.0);
        for other in around(index, [width, height], REACH) {
            let weight = guides[index].weight(&guides[other], 1);
            sum += weight * light[other].variance;
            total += weight;
        }
        // The pixel itself always counts.
        sum / total
    };
    let variances: Vec<f32> = (0..light.len()).into_par_iter().map(shared).collect();
    for (light, variance) in light.iter_mut().zip(variances) {
        light.variance = light.variance.max(variance);
    }
}

fn filtered(light: &[Light], guides: &[Guide], width: usize, step: i32) -> Vec<Light> {
    let height = light.len() / width.max(1);
    let mut result = vec![Light { rgb: Vec3::ZERO, variance: 0.0 }; light.len()];
    result.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, row)| {
        for (x, out) in row.iter_mut().enumerate() {
            *out = filtered_pixel(light, guides, (width, height), (x, y), step);
        }
    });
    result
}

fn filtered_pixel(
    light: &[Light],
    guides: &[Guide],
    (width, height): (usize, usize),
    (x, y): (usize, usize),
    step: i32,
) -> Light {
    let centre = y * width + x;
    let (own, guide) = (light[centre], guides[centre]);
    let own_luminance = luminance(own.rgb);
    let (mut sum, mut variance, mut total) = (Vec3::ZERO, 0.0, 0.0);
    for dy in -2..=2_i32 {
        for dx in -2..=2_i32 {
            let (nx, ny) = (x as i32 + dx * step, y as i32 + dy * step);
            if nx < 0 || ny < 0 || nx >= width as i32 || ny >= height as i32 {
                continue;
            }
            let index = ny as usize * width + nx as usize;
            let other = light[index];
            // The same for both of two pixels: what one gives the other gets.
            let tolerance =
                ERRORS_TOLERATED * (own.variance + other.variance).max(0.0).sqrt() + 1e-6;
            let likeness = guide.weight(&guides[index], step)
                * (-(luminance(other.rgb) - own_luminance).abs() / tolerance).exp();
            let weight =
                KERNEL[dx.unsigned_abs() as usize] * KERNEL[dy.unsigned_abs() as usize] * likeness;
            sum += other.rgb * weight;
            variance += other.variance * weight * weight;
            total += weight;
        }
    }
    // The centre always counts, so the total is not zero.
    Light { rgb: sum / total, variance: variance / (total * total) }
}

impl Guide {
    /// What another pixel counts for this one.
    fn weight(&self, other: &Self, step: i32) -> f32 {
        let likeness = likeness(self, other, step);
        // Most pixels, and a power takes longer than all else.
        if self.strictness == 1.0 { likeness } else { likeness.powf(self.strictness) }
    }
}

/// How much two pixels belong to one surface, 1 for the same.
fn likeness(a: &Guide, b: &Guide, step: i32) -> f32 {
    let albedo = (-(a.albedo - b.albedo).length_squared() / 0.01).exp();
    if a.normal == Vec3::ZERO || b.normal == Vec3::ZERO {
        return if a.normal == b.normal { albedo } else { 0.0 };
    }
    let normal = a.normal.dot(b.normal).max(0.0).powi(NORMAL_POWER);
    let nearer = a.depth.min(b.depth).max(1e-3);
    let depth = (-(a.depth - b.depth).abs() / (0.02 * nearer * step as f32)).exp();
    albedo * normal * depth
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::{FirstHit, PathResult};
    use crate::sampler::{hash, unit_from_bits};

    /// A dark and a bright wall, and between them a column of pixels that show some of each.
    #[test]
    fn the_mixed_pixels_of_an_edge_lose_their_noise_and_keep_their_light() {
        let (width, height, edge) = (25, 40, 12);
        let mut film = Film::new(width, height, true);
        for y in 0..height {
            for x in 0..width {
                // What the edge covers of a pixel varies along it.
                let share = 0.2 + 0.6 * unit_from_bits(hash(y));
                for sample in 0..8 {
                    let random = |n: u32| unit_from_bits(hash(n + 4 * (sample + 8 * (x + 99 * y))));
                    let is_bright = x > edge || (x == edge && random(0) < share);
                    let (albedo, normal) = if is_bright { (0.8, Vec3::Z) } else { (0.1, Vec3::X) };
                    film.add(
                        x,
                        y,
                        &PathResult {
                            radiance: Vec3::splat(albedo * 2.0 * random(1)),
                            first_hit: Some(FirstHit {
                                albedo: Vec3::splat(albedo),
                                normal,
                                depth: 3.0,
                            }),
                            ..PathResult::default()
                        },
                    );
                }
            }
        }
        let guides = film.surface_layers().expect("layers").albedo;
        let spread = |image: &Image| {
            let light = |y: u32| {
                let index = (y * width + edge) as usize;
                f64::from(image.pixels[index][0] / guides[index][0])
            };
            let mean = (0..height).map(light).sum::<f64>() / f64::from(height);
            let square = (0..height).map(|y| (light(y) - mean).powi(2)).sum::<f64>();
            (mean, (square / f64::from(height)).sqrt())
        };
        let ((_, noise), (mean, left)) = (spread(&film.image()), spread(&denoise(&film)));
        assert!((mean - 1.0).abs() < 0.05, "{mean}");
        assert!(left < 0.4 * noise, "{left} of {noise} is left");
    }
}
