//! An edge-avoiding à-trous filter: noise goes, edges of surfaces and textures stay.
//!
//! Dammertz et al., *Edge-Avoiding À-Trous Wavelet Transform for fast Global Illumination
//! Filtering*, HPG 2010, on radiance divided by albedo, with the luminance tolerance taken from each
//! pixel's own error estimate (as Schied et al., *Spatiotemporal Variance-Guided Filtering*, HPG
//! 2017, do) and from what is around it, the normals' from their own spread (as Rousselle et al., *Robust
//! Denoising using Feature and Color Information*, 2013, do). A pixel on an edge finds no like: its light is
//! then told by the guides of those around it ([`super::edges`]). Biased: for looking, not for measuring.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::Vec3;
use pulp::Arch;
use rayon::prelude::*;

use super::edges;
use super::guides::{Guides, around, rows};
use super::light::{Light, MAX_VARIANCE, compared_luminance};
use super::samples::Samples;
use crate::image::Image;

/// Pixels between two taps of each pass. Where guides or light stop what the first passes should spread, later
/// ones put it at their taps alone, a lattice: the last two fill it.
pub(crate) const STEPS: [u32; 7] = [1, 2, 4, 8, 16, 3, 1];
/// Columns and rows around a pixel that share its error.
const REACH: isize = 2;
/// What a pixel on another surface counts there, so that somebody always does: one that has met no light and has
/// no like knows nothing of its error.
pub(crate) const MIN_LIKENESS: f32 = 0.05;
/// Squared light of which a single sample's variance is so much at least.
pub(crate) const MIN_SPREAD: f32 = 0.1;
/// By how much more a variance is tolerated that is known of one sample only by those around it.
pub(crate) const SINGLE: f32 = 1.5;
/// How much less likely one sample more makes it that all of a pixel's are off its surroundings by chance: two
/// that are bright by chance, and agree, seem sure.
pub(crate) const FEWER: f32 = 0.2;
/// Most noise of what is seen of the map, relative to it: a fifth of a lamp is not mistaken for the sky beside it.
pub(crate) const MAX_MAP_NOISE: f32 = 0.2;
/// Pixels around one that are kept to tell the quarter with the smallest errors.
const QUARTER: usize = 7;
/// Weights of a B3 spline.
const KERNEL: [f32; 3] = [3.0 / 8.0, 1.0 / 4.0, 1.0 / 16.0];

/// The picture of films with layers, filtered.
pub(super) fn denoise(samples: &Samples<'_>, cancel: &AtomicBool) -> Option<Image> {
    let guides = Guides::of(samples);
    let mut light = Light::of(samples, &guides);
    let support = share_errors(&mut light, &guides, samples);
    for step in STEPS {
        if cancel.load(Ordering::Relaxed) {
            return None;
        }
        light = filtered(&light, &guides, step as isize);
    }
    Some(edges::mended(samples, &guides, &light, &support))
}

/// What the pixels around one know, each in proportion to its likeness.
#[derive(Clone, Copy, Default)]
struct Around {
    /// Likeness of the others.
    support: f32,
    /// Weights of those whose errors are known, and their errors.
    known: f32,
    variance: f32,
    /// Weights of all, and moments of their luminance.
    all: f32,
    first: f32,
    second: f32,
}

/// Gives each pixel the mean error of its surface around it, if that is larger than its own: a pixel that
/// has met no light yet knows nothing of its error. One that has met too much knows: so its neighbours
/// take their part of it. Of a single sample the spread of those around it tells, and how far it is off itself.
/// Returns how many of the 24 pixels around each are its like.
fn share_errors(light: &mut Light, guides: &Guides, samples: &Samples<'_>) -> Vec<f32> {
    let width = guides.width;
    let pooled_row = |y: usize| {
        let mut likeness = vec![0.0; width];
        let mut sums = vec![Around::default(); width];
        for offset in square(REACH) {
            let Some((columns, there)) = guides.columns(y, offset) else { continue };
            let likeness = &mut likeness[..columns.len()];
            guides.compare([y * width + columns.start, there], offset, likeness);
            for ((x, other), likeness) in columns.zip(there..).zip(likeness) {
                let (weight, sums) = (*likeness + MIN_LIKENESS, &mut sums[x]);
                if light.variance[other] >= 0.0 {
                    sums.known += weight;
                    sums.variance += weight * light.variance[other];
                }
                sums.all += weight;
                sums.first += weight * light.luminance[other];
                sums.second += weight * light.luminance[other].powi(2);
                sums.support += *likeness;
            }
        }
        let own = y * width..(y + 1) * width;
        let pooled = |(around, index): (Around, usize)| {
            let count = samples.count(index);
            let variance = variance_of_map(light, guides, index, count).unwrap_or_else(|| {
                around.variance_for(light.variance[index], light.luminance[index], count)
            });
            // The pixel itself is its like.
            (variance, around.support - 1.0)
        };
        sums.into_iter().zip(own).map(pooled).collect::<Vec<_>>()
    };
    let lanes = Arch::new();
    let pooled_row = |y| lanes.dispatch(|| pooled_row(y));
    let (variance, support) = (0..guides.height).into_par_iter().flat_map(pooled_row).unzip();
    light.variance = variance;
    support
}

/// The variance of a pixel that shows the map alone: relative to its light what three quarters of the pixels around
/// exceed, times how much more it is on average. A sun or a lamp, of which edges alone have errors, so keeps its place.
fn variance_of_map(light: &Light, guides: &Guides, index: usize, samples: u32) -> Option<f32> {
    let size = [guides.width, guides.height];
    let shows_map = |other: usize| guides.at(other).coverage == 0.0;
    if !shows_map(index) {
        return None;
    }
    let relative = |other: usize| {
        let (own, variance) = (light.luminance[other], light.variance[other]);
        if variance >= 0.0 {
            return variance / (own * own).max(f32::MIN_POSITIVE);
        }
        // Of single samples neighbours tell.
        let column = other % size[0];
        let next = if column + 1 < size[0] { other + 1 } else { other - column.min(1) };
        let next = light.luminance[next];
        let off = (own - next) / (own + next).max(f32::MIN_POSITIVE);
        2.0 * off * off
    };
    let mut smallest = [f32::INFINITY; QUARTER];
    let mut count = 0;
    for (other, _) in around(index, size, REACH as usize).filter(|(other, _)| shows_map(*other)) {
        let mut variance = relative(other);
        count += 1;
        for kept in &mut smallest {
            if variance < *kept {
                std::mem::swap(kept, &mut variance);
            }
        }
    }
    // Quartiles of chi-square distributions, fitted.
    let freedom = samples.max(2) as f32 - 1.0;
    let variance = smallest[(count - 1) / 4] * (1.0 + 8.85 * freedom.powf(-1.6));
    let luminance = light.luminance[index];
    // Neighbours that differ by more may be in fog: of that one sample says nothing.
    let is_told = samples > 1 || variance <= MAX_MAP_NOISE * MAX_MAP_NOISE;
    is_told.then_some(variance.min(MAX_MAP_NOISE * MAX_MAP_NOISE) * luminance * luminance)
}

impl Around {
    /// The variance of a pixel of this luminance, of so many samples, that knows of so much itself.
    fn variance_for(&self, own: f32, luminance: f32, samples: u32) -> f32 {
        let mean = self.first / self.all;
        let off = (luminance - mean).powi(2);
        let variance = if own < 0.0 {
            let spread = self.second / self.all - mean * mean;
            SINGLE * spread.max(MIN_SPREAD * mean * mean).max(off)
        } else {
            let chance = SINGLE * FEWER.powf(samples.max(1) as f32 - 1.0) * off;
            own.max(self.variance / self.known).max(chance)
        };
        variance.min(MAX_VARIANCE)
    }
}

/// Offsets of up to so many columns and rows.
fn square(reach: isize) -> impl Iterator<Item = [isize; 2]> {
    (-reach..=reach).flat_map(move |dy| (-reach..=reach).map(move |dx| [dx, dy]))
}

/// One pass with taps that are `step` pixels apart.
fn filtered(light: &Light, guides: &Guides, step: isize) -> Light {
    let mut result = Light::black(light.luminance.len());
    let Light { rgb: [r, g, b], luminance, variance } = &mut result;
    let rows = rows([r, g, b, luminance, variance], guides.width);
    let lanes = Arch::new();
    let filter = |row| lanes.dispatch(|| filter_row(light, guides, row, step));
    rows.into_par_iter().enumerate().for_each(filter);
    result
}

/// In-lined, as is what it calls, into code for the widest lanes there are.
#[inline(always)]
fn filter_row(light: &Light, guides: &Guides, (y, mut row): (usize, [&mut [f32]; 5]), step: isize) {
    let width = guides.width;
    let mut weights = vec![0.0; width];
    let mut squares = vec![0.0; width];
    for [dx, dy] in square(2) {
        let kernel = KERNEL[dx.unsigned_abs()] * KERNEL[dy.unsigned_abs()];
        let offset = [dx * step, dy * step];
        let Some((columns, there)) = guides.columns(y, offset) else { continue };
        let (here, count) = (y * width + columns.start, columns.len());
        let weights = &mut weights[..count];
        if [dx, dy] == [0, 0] {
            weights.fill(1.0);
        } else {
            guides.compare([here, there], offset, weights);
            light.compare([here, there], weights);
        }
        let [r, g, b] = light.rgb.each_ref().map(|plane| &plane[there..there + count]);
        let variance = &light.variance[there..there + count];
        // Luminances are sums of weights until the end.
        let [to_r, to_g, to_b, total, to_variance] =
            row.each_mut().map(|plane| &mut plane[columns.clone()]);
        let squares = &mut squares[columns];
        for i in 0..count {
            let weight = kernel * weights[i];
            let square = weight * weight;
            to_r[i] += weight * r[i];
            to_g[i] += weight * g[i];
            to_b[i] += weight * b[i];
            to_variance[i] += square * variance[i];
            total[i] += weight;
            squares[i] += square;
        }
    }
    // The centre always counts, so the total is not zero.
    let [r, g, b, luminance, variance] = row;
    for x in 0..width {
        let scale = 1.0 / luminance[x];
        let rgb = [&mut r[x], &mut g[x], &mut b[x]].map(|value| {
            *value *= scale;
            *value
        });
        let shared = if step == 1 { 1.0 } else { shared_noise(squares[x] * scale * scale) };
        variance[x] *= scale * scale * shared;
        luminance[x] = compared_luminance(Vec3::from(rgb));
    }
}

/// By what the variance of a mean is more than that of independent taps, from the sum of squared weights over the
/// squared sum: after the first pass taps have pixels in common. All weights of the spline have 0.075, and leave a
/// quarter of the variance instead; the fourth root, which goes less far, gave the lowest FLIP.
#[inline(always)]
fn shared_noise(ratio: f32) -> f32 {
    1.0 / ratio.sqrt().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::denoise::quick;
    use crate::path::{FirstHit, PathResult};
    use crate::render::film::Film;
    use crate::sampler::{hash, unit_from_bits};

    const WALL: FirstHit = FirstHit { albedo: Vec3::splat(0.5), normal: Vec3::Z, depth: 3.0 };

    /// A film of what `sample` says of column, row and three random numbers: light without albedo, and what is met.
    fn film(
        [width, height]: [u32; 2],
        samples: u32,
        sample: impl Fn(u32, u32, [f32; 3]) -> (f32, Option<FirstHit>),
    ) -> Film {
        let mut film = Film::new(width, height, true);
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            for number in 0..samples {
                let random = [0, 1, 2]
                    .map(|n| unit_from_bits(hash(n + 3 * (number + samples * (x + width * y)))));
                let (light, first_hit) = sample(x, y, random);
                let radiance = first_hit.map_or(Vec3::ONE, |hit| hit.albedo) * light;
                film.add(x, y, &PathResult { radiance, first_hit, ..PathResult::default() });
            }
        }
        film
    }

    /// Mean and standard deviation of what a column shows.
    fn column(image: &Image, x: u32) -> (f32, f32) {
        let values = image.pixels.iter().skip(x as usize).step_by(image.width as usize);
        let values: Vec<f32> = values.map(|rgb| rgb[0]).collect();
        let count = values.len() as f32;
        let mean = values.iter().sum::<f32>() / count;
        (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / count).sqrt())
    }

    /// A dark and a bright wall, and between them a column of pixels that show some of each.
    #[test]
    fn the_mixed_pixels_of_an_edge_lose_their_noise_and_keep_their_light() {
        let edge = 12;
        let film = film([25, 40], 8, |x, y, [part, light, _]| {
            // What the edge covers of a pixel varies along it.
            let share = 0.2 + 0.6 * unit_from_bits(hash(y));
            let is_bright = x > edge || (x == edge && part < share);
            let (albedo, normal) = if is_bright { (0.8, Vec3::Z) } else { (0.1, Vec3::X) };
            (2.0 * light, Some(FirstHit { albedo: Vec3::splat(albedo), normal, depth: 3.0 }))
        });
        let guides = film.surface_layers().expect("layers").albedo;
        let without_albedo = |mut image: Image| {
            for (pixel, albedo) in image.pixels.iter_mut().zip(&guides) {
                pixel[0] /= albedo[0];
            }
            column(&image, edge)
        };
        let ((_, noise), (mean, left)) =
            (without_albedo(film.image()), without_albedo(quick(&film, None)));
        assert!((mean - 1.0).abs() < 0.05, "{mean}");
        assert!(left < 0.4 * noise, "{left} of {noise} is left");
    }

    /// A groove one pixel wide, of two sides, of which each pixel shows its own mixture; met by few bright samples.
    #[test]
    fn a_groove_shows_no_dark_dots() {
        let groove = 10;
        let film = film([21, 60], 4, |x, _, [chance, side, _]| {
            let light = if chance < 0.2 { 5.0 } else { 0.0 };
            let normal = Vec3::new(if side < 0.5 { 1.0 } else { -1.0 }, 0.0, 1.0).normalize();
            (light, Some(if x == groove { FirstHit { normal, ..WALL } } else { WALL }))
        });
        let (_, noise) = column(&film.image(), groove);
        let (mean, left) = column(&quick(&film, None), groove);
        assert!((mean - 0.5).abs() < 0.1, "{mean}");
        assert!(left < 0.15 * noise, "{left} of {noise} is left");
    }

    #[test]
    fn bright_bars_do_not_shine_on_the_sky_behind() {
        let film = film([48, 32], 4, |x, _, [part, light, _]| {
            // Half of the pixels on both sides shows a bar's edge.
            let covered = match x % 16 {
                0 | 1 => 1.0,
                2 | 15 => 0.3,
                _ => 0.0,
            };
            if part < covered { (400.0 * light, Some(WALL)) } else { (0.01, None) }
        });
        let image = quick(&film, None);
        for x in (4..14).chain(20..30) {
            let (mean, spread) = column(&image, x);
            assert!((mean - 0.01).abs() + spread < 1e-4, "column {x}: {mean} {spread}");
        }
    }

    /// A disc 70000 times as bright as the sky, whose edge pixels show some of each, keeps its size.
    #[test]
    fn a_sun_stays_where_it_is() {
        for samples in [1, 2, 4, 64] {
            let film = film([64, 48], samples, |x, y, [dx, dy, _]| {
                let [x, y] = [x as f32 + dx - 30.0, y as f32 + dy - 24.0];
                (if x * x + y * y < 9.0 { 7e4 } else { 1.0 + 0.01 * x }, None)
            });
            let (raw, image) = (film.image(), quick(&film, None));
            for (raw, filtered) in raw.pixels.iter().zip(&image.pixels) {
                assert!(
                    (filtered[0] / raw[0] - 1.0).abs() < 0.05,
                    "{samples}: {raw:?} {filtered:?}"
                );
            }
        }
    }

    /// Beside a bright slit pixels show one sample of it or none.
    #[test]
    fn a_slit_makes_no_glow_on_the_wall_around() {
        let film = film([48, 48], 64, |x, y, [part, _, _]| {
            let seen = if y.abs_diff(24) == 1 && part < 0.02 { None } else { Some(WALL) };
            let is_slit = y == 24 && (8..40).contains(&x);
            if is_slit || seen.is_none() { (1000.0, None) } else { (1.0, Some(WALL)) }
        });
        let image = quick(&film, None);
        for y in (0..20).chain(29..48) {
            let row = &image.pixels[y * 48..(y + 1) * 48];
            assert!(row.iter().all(|rgb| (rgb[0] - 0.5).abs() < 0.005), "{y}: {row:?}");
        }
    }

    /// Of a single sample a pixel cannot tell its error.
    #[test]
    fn a_shadow_keeps_its_edge_with_one_sample() {
        let film = film([64, 48], 1, |x, _, [light, _, _]| {
            let lit = if x < 32 { 10.0 } else { 1.0 };
            (lit * (0.5 + light), Some(WALL))
        });
        let image = quick(&film, None);
        for (x, expected) in [(16, 5.0), (26, 5.0), (37, 0.5), (48, 0.5)] {
            let (mean, spread) = column(&image, x);
            let off = (mean / expected - 1.0).abs() + spread / expected;
            assert!(off < 0.15, "column {x}: {mean} {spread}");
        }
    }

    /// Of two bright samples the spread says nothing.
    #[test]
    fn two_bright_samples_that_agree_leave_no_dot() {
        let film = film([64, 48], 2, |_, _, [chance, light, _]| {
            (if chance < 0.02 { 20.0 } else { 0.5 + light }, Some(WALL))
        });
        let has_met = |pixel: &[f32; 3]| (pixel[0] - 10.0).abs() < 1.0;
        assert!(film.image().pixels.iter().any(has_met), "none has met two");
        let brightest = quick(&film, None).pixels.iter().map(|p| p[0]).fold(0.0, f32::max);
        assert!(brightest < 2.0, "{brightest} where 0.7 is right");
    }

    /// Normals of a rough cloth: each sample's own.
    #[test]
    fn noise_of_normals_does_not_stop_the_filter() {
        for samples in [1, 4] {
            let film = film([40, 40], samples, |_, _, [light, x, y]| {
                let normal = Vec3::new(x - 0.5, y - 0.5, 1.0).normalize();
                (2.0 * light, Some(FirstHit { normal, ..WALL }))
            });
            let (_, noise) = column(&film.image(), 20);
            let (_, left) = column(&quick(&film, None), 20);
            assert!(left < 0.15 * noise, "{left} of {noise} is left of {samples}");
        }
    }

    /// Whether a sample meets the wall or the fog before it is chance.
    #[test]
    fn chance_in_fog_does_not_stop_the_filter() {
        let film =
            film(
                [40, 40],
                4,
                |_, _, [part, light, _]| {
                    if part < 0.5 { (light, None) } else { (2.0 * light, Some(WALL)) }
                },
            );
        let (_, noise) = column(&film.image(), 20);
        let (_, left) = column(&quick(&film, None), 20);
        assert!(left < 0.35 * noise, "{left} of {noise} is left");
    }
}
