//! The reference: the mean of independent pictures, whose spread estimates its remaining noise.
//!
//! It grows picture by picture and is written after each. Its file's name is a digest of all that it depends
//! on, so a report can be resumed and never uses a reference of something else.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use serde::{Deserialize, Serialize};

use super::measure::Place;
use super::plan::{MIN_PICTURES, Settings};
use crate::digest::Digest;
use crate::error::{At as _, Error, Result};
use crate::image::{Image, read_with_linearity, write_beside_and_rename};
use crate::metrics::{REL_MSE_EPSILON, trimmed_mean};
use crate::render::film::Film;
use crate::render::{Sampling, Session};

/// A picture's own expected squared error, in the units of [`crate::metrics::Comparison`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Noise {
    /// Mean over pixels and channels of the squared error, in units of the reference's squared mean.
    pub mse: f64,
    /// Mean over pixels and channels of the squared error over `r^2 + 0.01`, `r` the reference in units of its
    /// mean.
    pub rel_mse: f64,
    /// The same without the worst 0.1 % of the pixels.
    pub trimmed_rel_mse: f64,
}

impl Noise {
    /// The noise of a picture from the variances of its pixels, per channel.
    pub(super) fn of(variances: &[[f64; 3]], reference: &Image) -> Self {
        let count = variances.len() as f64;
        let mean = crate::metrics::mean(reference);
        let pixels = variances.iter().zip(&reference.pixels);
        let mut relative: Vec<f64> = pixels.map(|(v, pixel)| relative(v, pixel, mean)).collect();
        Self {
            mse: variances.as_flattened().iter().sum::<f64>() / (3.0 * count * mean * mean),
            rel_mse: relative.iter().sum::<f64>() / count,
            trimmed_rel_mse: trimmed_mean(&mut relative),
        }
    }
}

/// Relative squared error of a pixel whose channels have these variances, in a picture of this mean.
pub(super) fn relative(variances: &[f64; 3], pixel: &[f32; 3], mean: f64) -> f64 {
    let of_channel = |(v, r): (&f64, &f32)| {
        let r = f64::from(*r) / mean;
        v / (mean * mean) / (r * r + REL_MSE_EPSILON) / 3.0
    };
    variances.iter().zip(pixel).map(of_channel).sum()
}

/// Variances of the mean of `count` pictures, from the sums of their values and of their squares.
pub(super) fn variances_of_mean(sums: &[f64; 3], squares: &[f64; 3], count: f64) -> [f64; 3] {
    [0, 1, 2].map(|i| {
        let mean = sums[i] / count;
        (squares[i] / count - mean * mean).max(0.0) / (count - 1.0)
    })
}

/// Facts about a reference: the first line of its file.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ReferenceFacts {
    /// Digest of the picture's limit.
    pub digest: String,
    /// Pixels per row, and rows.
    pub size: (u32, u32),
    /// Pictures it is the mean of.
    pub pictures: u32,
    /// Samples per pixel of each.
    pub samples_per_picture: u32,
    /// Seconds that all of them took.
    pub seconds: f64,
    /// The device that rendered the last of them.
    pub device: String,
}

/// Per pixel and channel, sums over pictures of the values and of their squares.
#[derive(Debug, Clone)]
pub(super) struct Reference {
    pub(super) facts: ReferenceFacts,
    sums: Vec<[f64; 3]>,
    squares: Vec<[f64; 3]>,
    path: PathBuf,
}

/// First seed of its pictures, far from those of runs.
const FIRST_SEED: u32 = 0x5265_6600;

impl Reference {
    /// The reference stored in `folder`, or an empty one to be stored there.
    pub(super) fn open(folder: &Path, digest: Digest, size: (u32, u32)) -> Self {
        let path = folder.join(format!("{digest}.ref"));
        let pixels = size.0 as usize * size.1 as usize;
        Self::read(&path, &digest.to_string(), size).unwrap_or_else(|| Self {
            facts: ReferenceFacts { digest: digest.to_string(), size, ..Default::default() },
            sums: vec![[0.0; 3]; pixels],
            squares: vec![[0.0; 3]; pixels],
            path,
        })
    }

    /// `None` if the file is missing or incomplete.
    fn read(path: &Path, digest: &str, size: (u32, u32)) -> Option<Self> {
        let bytes = fs::read(path).ok()?;
        let line = bytes.iter().position(|b| *b == b'\n')?;
        let facts: ReferenceFacts = serde_json::from_slice(&bytes[..line]).ok()?;
        let pixels = size.0 as usize * size.1 as usize;
        let numbers: Vec<f64> =
            bytes[line + 1..].as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
        let is_whole = numbers.len() == 6 * pixels && bytes.len() == line + 1 + 48 * pixels;
        if !is_whole || facts.digest != digest || facts.size != size {
            return None;
        }
        let (sums, squares) = numbers.as_chunks().0.split_at(pixels);
        Some(Self { facts, sums: sums.to_vec(), squares: squares.to_vec(), path: path.to_owned() })
    }

    /// Renders one more picture with the default sampling and stores it. The first one renders for `seconds`, and
    /// at least as long as it learned; the others take as many samples as the first. `false` if it was cancelled.
    ///
    /// # Errors
    /// If the device fails or the file cannot be written.
    pub(super) fn add_picture(&mut self, place: &Place<'_>, seconds: f64) -> Result<bool> {
        let seed = FIRST_SEED + self.facts.pictures;
        let settings = Settings::of(Sampling::Adaptive);
        let Some(mut driver) = place.learned(&settings, seed)? else { return Ok(false) };
        let limit = self.facts.samples_per_picture;
        driver.rule.samples = (limit > 0).then_some(limit);
        let is_done = |session: &Session<'_>| {
            let (samples, figures) = (session.samples(), session.figures());
            let is_long = figures.render_seconds >= seconds.max(figures.learning_seconds);
            if limit > 0 { samples >= limit } else { samples >= 4 && is_long }
        };
        while !is_done(&driver.session) {
            driver.advance(place.cancel)?;
            if place.cancel.load(Ordering::Relaxed) {
                return Ok(false);
            }
        }
        let mut session = driver.session;
        session.settle()?;
        self.add(session.film());
        self.facts.seconds += session.figures().elapsed_seconds();
        place.device.clone_into(&mut self.facts.device);
        let header = serde_json::to_string(&self.facts).at(&self.path)?;
        write_beside_and_rename(&self.path, |file| {
            writeln!(file, "{header}")?;
            let numbers = self.sums.as_flattened().iter().chain(self.squares.as_flattened());
            numbers.into_iter().try_for_each(|x| file.write_all(&x.to_le_bytes()))
        })?;
        Ok(true)
    }

    fn add(&mut self, film: &Film) {
        for ((sum, square), pixel) in self.sums.iter_mut().zip(&mut self.squares).zip(film.pixels())
        {
            for (i, value) in pixel.mean().into_iter().enumerate() {
                sum[i] += value;
                square[i] += value * value;
            }
        }
        self.facts.pictures += 1;
        self.facts.samples_per_picture = film.min_samples();
    }

    /// The mean of all pictures.
    pub(super) fn image(&self) -> Image {
        let count = f64::from(self.facts.pictures.max(1));
        let (width, height) = self.facts.size;
        let pixels = self.sums.iter().map(|sum| sum.map(|s| (s / count) as f32)).collect();
        Image { width, height, pixels }
    }

    /// Whether all its pictures are black: relative errors are undefined then.
    pub(super) fn is_black(&self) -> bool {
        self.facts.pictures > 0 && self.sums.as_flattened().iter().all(|sum| *sum <= 0.0)
    }

    /// Its expected squared error, from the spread of the pictures; infinite below two.
    pub(super) fn noise(&self) -> Noise {
        if self.facts.pictures < 2 {
            let endless = f64::INFINITY;
            return Noise { mse: endless, rel_mse: endless, trimmed_rel_mse: endless };
        }
        let count = f64::from(self.facts.pictures);
        let sums = self.sums.iter().zip(&self.squares);
        let variances: Vec<[f64; 3]> =
            sums.map(|(sum, square)| variances_of_mean(sum, square, count)).collect();
        Noise::of(&variances, &self.image())
    }

    /// Estimated number of pictures that are missing until the noise is `share` of `error`.
    pub(super) fn pictures_missing(&self, share: f64, error: f64) -> u32 {
        let (pictures, noise) = (self.facts.pictures, self.noise().trimmed_rel_mse);
        let enough = if noise.is_finite() && error > 0.0 {
            (f64::from(pictures) * noise / (share * error)).ceil().min(1e6) as u32
        } else {
            (1.0 / share).ceil() as u32
        };
        enough.max(MIN_PICTURES).saturating_sub(pictures)
    }
}

/// Reads a given picture as the reference; it must have the size of the runs.
///
/// # Errors
/// If it cannot be read, is not linear, has another size, or is black.
pub(super) fn read_reference(path: &Path, size: (u32, u32)) -> Result<Image> {
    let (image, is_linear) = read_with_linearity(path)?;
    if !is_linear {
        let cause =
            "is developed for a display, and errors are those of linear light: give an .exr";
        return Err(Error::at(path, cause));
    }
    let (width, height) = (image.width, image.height);
    if (width, height) != size {
        let runs = format!("the runs are {}x{}", size.0, size.1);
        let cause = format!(
            "the reference is {width}x{height} pixels, {runs}: give --size {width}x{height}"
        );
        return Err(Error::at(path, cause));
    }
    if crate::metrics::mean(&image) <= 0.0 {
        return Err(Error::at(path, "is black: errors relative to it have no meaning"));
    }
    Ok(image)
}
