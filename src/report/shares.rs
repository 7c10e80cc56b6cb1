//! Sources of the remaining error: pixel filter, first vertex, later vertices.
//!
//! The same samples are rendered three times: with all bounces, with one, with none. As a path draws
//! its random numbers in order, the pictures differ by later vertices and by the first one exactly;
//! several seeds give each part's variance.

use std::sync::atomic::Ordering;

use serde::{Deserialize, Serialize};

use super::measure::Place;
use super::plan::{Frame, Method, Settings};
use super::reference::{relative, variances_of_mean};
use crate::error::Result;
use crate::image::Image;
use crate::metrics;
use crate::render::Session;
use crate::render::film::Pixel;

/// Variance of the parts of a picture, each as trimmed relMSE (the same pixels left out in all).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Shares {
    /// Name of the method.
    pub method: String,
    /// Number of pictures.
    pub pictures: u32,
    /// Samples per pixel of each.
    pub samples: u32,
    /// Total variance.
    pub total: f64,
    /// Variance of directly visible map and emitters, by the pixel filter.
    pub filter: f64,
    /// Variance of light from the map and from lamps at the first vertex.
    pub first_vertex: f64,
    /// Variance of light over more than one vertex.
    pub later_vertices: f64,
}

impl Shares {
    /// Twice the covariances of the parts: the total less the sum of the parts.
    pub fn together(&self) -> f64 {
        self.total - self.filter - self.first_vertex - self.later_vertices
    }
}

/// Number of pictures that the variances are computed from.
const PICTURES: u32 = 8;

/// First seed of these pictures.
const FIRST_SEED: u32 = 0x5368_6100;

/// Sums over pictures of each part's values and squares.
#[derive(Clone, Copy, Default)]
struct Sums {
    value: [[f64; 3]; 4],
    square: [[f64; 3]; 4],
}

/// Means of a picture's pixels.
type Means = Vec<[f64; 3]>;

impl Place<'_> {
    /// Splits a method's error by its sources at `samples` samples per pixel; `None` if it was cancelled.
    pub(super) fn shares(
        &self,
        method: &Method,
        samples: u32,
        reference: &Image,
    ) -> Result<Option<Shares>> {
        let mut sums = vec![Sums::default(); reference.pixels.len()];
        for seed in FIRST_SEED..FIRST_SEED + PICTURES {
            let depths = self.depths(&method.settings, seed, samples)?;
            let Some([all, one, none]) = depths else { return Ok(None) };
            for (((sums, all), one), none) in sums.iter_mut().zip(&all).zip(&one).zip(&none) {
                for c in 0..3 {
                    let parts = [all[c], none[c], one[c] - none[c], all[c] - one[c]];
                    for (part, x) in parts.into_iter().enumerate() {
                        sums.value[part][c] += x;
                        sums.square[part][c] += x * x;
                    }
                }
            }
        }
        let [total, filter, first_vertex, later_vertices] = trimmed(&sums, reference);
        let method = method.name.clone();
        let pictures = PICTURES;
        Ok(Some(Shares { method, pictures, samples, total, filter, first_vertex, later_vertices }))
    }

    /// Means per pixel with all bounces, with one and with none, from the same random numbers and distributions.
    fn depths(&self, settings: &Settings, seed: u32, samples: u32) -> Result<Option<[Means; 3]>> {
        let Some(driver) = self.learned(settings, seed)? else { return Ok(None) };
        let mut session = driver.session;
        // Distributions of a picture with this many samples.
        if self.finish(&mut session, samples)?.is_none() {
            return Ok(None);
        }
        let grid = session.grid().cloned();
        // Paths of one bounce would not share by default, and would then draw other numbers.
        let settings = &Settings { sharing: session.view().sharing, ..settings.clone() };
        let mut pictures = [Vec::new(), Vec::new(), Vec::new()];
        for (picture, bounces) in pictures.iter_mut().zip([u32::MAX, 1, 0]) {
            let frame = Frame { bounces: bounces.min(self.frame.bounces), ..self.frame.clone() };
            let mut session = Place { frame: &frame, ..*self }.session(settings, seed)?;
            grid.clone().map_or(Ok(()), |grid| session.set_grid(grid))?;
            let Some(means) = self.finish(&mut session, samples)? else { return Ok(None) };
            *picture = means;
        }
        Ok(Some(pictures))
    }

    fn finish(&self, session: &mut Session<'_>, samples: u32) -> Result<Option<Means>> {
        session.advance(samples, self.cancel)?;
        session.settle()?;
        let is_whole = !self.cancel.load(Ordering::Relaxed);
        Ok(is_whole.then(|| session.film().pixels().iter().map(Pixel::mean).collect()))
    }
}

/// Relative variance over pictures of each part, averaged without the worst pixels.
fn trimmed(sums: &[Sums], reference: &Image) -> [f64; 4] {
    let count = f64::from(PICTURES);
    let mean = metrics::mean(reference);
    let of_pixel = |(sums, pixel): (&Sums, &[f32; 3])| {
        [0, 1, 2, 3].map(|part| {
            let variances = variances_of_mean(&sums.value[part], &sums.square[part], count);
            count * relative(&variances, pixel, mean)
        })
    };
    let mut pixels: Vec<[f64; 4]> = sums.iter().zip(&reference.pixels).map(of_pixel).collect();
    pixels.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
    let kept = metrics::kept_of(pixels.len());
    [0, 1, 2, 3].map(|part| pixels[..kept].iter().map(|p| p[part]).sum::<f64>() / kept as f64)
}
