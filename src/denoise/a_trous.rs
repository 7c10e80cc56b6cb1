//! An edge-avoiding à-trous filter: noise goes, edges of surfaces and textures stay.
//!
//! Dammertz et al., *Edge-Avoiding À-Trous Wavelet Transform for fast Global Illumination
//! Filtering*, HPG 2010, on radiance divided by albedo, with the luminance tolerance taken from each
//! pixel's own error estimate (as Schied et al., *Spatiotemporal Variance-Guided Filtering*, HPG
//! 2017, do). Biased: for looking, not for measuring.

use glam::Vec3;
use rayon::prelude::*;

use crate::color::luminance;
use crate::image::Image;
use crate::render::film::{Film, Pixel};

/// Filter passes; the last one reaches 2^5 pixels.
const PASSES: u32 = 5;
/// Luminance differences are tolerated up to this many standard errors.
const ERRORS_TOLERATED: f32 = 4.0;
/// Pixels around one that share its error.
const REACH: usize = 3;
/// Weights of a B3 spline.
const KERNEL: [f32; 3] = [3.0 / 8.0, 1.0 / 4.0, 1.0 / 16.0];
/// Power of the cosine between normals.
const NORMAL_POWER: i32 = 64;
/// Albedo that counts as none: black surfaces and the sky are filtered as they are.
const LEAST_ALBEDO: f32 = 0.02;

/// What tells surfaces apart.
#[derive(Clone, Copy)]
struct Guide {
    albedo: Vec3,
    normal: Vec3,
    depth: f32,
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
    let guides: Vec<Guide> = layers
        .albedo
        .iter()
        .zip(&layers.normal)
        .zip(&layers.depth)
        .map(|((albedo, normal), &depth)| {
            let (albedo, normal) = (Vec3::from(*albedo), Vec3::from(*normal));
            let seen = if normal == Vec3::ZERO { Vec3::ONE } else { albedo };
            Guide { albedo: seen.max(Vec3::splat(LEAST_ALBEDO)), normal, depth }
        })
        .collect();
    let mut light: Vec<Light> = film.pixels().iter().zip(&guides).map(undressed).collect();
    share_errors(&mut light, &guides, film.width as usize);
    for pass in 0..PASSES {
        light = filtered(&light, &guides, film.width as usize, 1 << pass);
    }
    let pixels = light.iter().zip(&guides).map(|(l, g)| (l.rgb * g.albedo).to_array()).collect();
    Image { width: film.width, height: film.height, pixels }
}

fn undressed((pixel, guide): (&Pixel, &Guide)) -> Light {
    let mean = Vec3::from(pixel.mean().map(|c| c as f32));
    let scale = 1.0 / luminance(guide.albedo);
    // One sample says nothing about its error: then anything goes.
    let variance = pixel.variance_of_mean().min(f64::from(luminance(mean)).powi(2) + 1.0) as f32;
    Light { rgb: mean / guide.albedo, variance: variance * scale * scale }
}

/// Gives each pixel the mean error of its surface around it: a pixel that has met no light yet knows
/// nothing of its own error.
fn share_errors(light: &mut [Light], guides: &[Guide], width: usize) {
    let height = light.len() / width.max(1);
    let shared = |index: usize| {
        let (x, y) = (index % width, index / width);
        let (mut sum, mut total) = (0.0, 0.0);
        for ny in y.saturating_sub(REACH)..(y + REACH + 1).min(height) {
            for nx in x.saturating_sub(REACH)..(x + REACH + 1).min(width) {
                let other = ny * width + nx;
                let weight = likeness(&guides[index], &guides[other], 1);
                sum += weight * light[other].variance;
                total += weight;
            }
        }
        // The pixel itself always counts.
        sum / total
    };
    let variances: Vec<f32> = (0..light.len()).into_par_iter().map(shared).collect();
    for (light, variance) in light.iter_mut().zip(variances) {
        light.variance = variance;
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
    let tolerance = ERRORS_TOLERATED * own.variance.max(0.0).sqrt() + 1e-6;
    let own_luminance = luminance(own.rgb);
    let (mut sum, mut variance, mut total) = (Vec3::ZERO, 0.0, 0.0);
    for dy in -2..=2_i32 {
        for dx in -2..=2_i32 {
            let (nx, ny) = (x as i32 + dx * step, y as i32 + dy * step);
            if nx < 0 || ny < 0 || nx >= width as i32 || ny >= height as i32 {
                continue;
            }
            let index = ny as usize * width + nx as usize;
            let likeness = likeness(&guide, &guides[index], step)
                * (-(luminance(light[index].rgb) - own_luminance).abs() / tolerance).exp();
            let weight =
                KERNEL[dx.unsigned_abs() as usize] * KERNEL[dy.unsigned_abs() as usize] * likeness;
            sum += light[index].rgb * weight;
            variance += light[index].variance * weight * weight;
            total += weight;
        }
    }
    // The centre always counts, so the total is not zero.
    Light { rgb: sum / total, variance: variance / (total * total) }
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
