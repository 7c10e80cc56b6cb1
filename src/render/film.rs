//! What the samples add up to.

use glam::DVec3;
use rayon::prelude::*;

use crate::color::luminance;
use crate::image::Image;
use crate::metrics::{REL_MSE_EPSILON, trimmed_mean};
use crate::path::PathResult;

/// Fewer pixels with light than one in so many are chance.
const MIN_LIT: usize = 1000;

/// Sums of one pixel in f64: at 1e6 samples an f32 sum would have lost half its digits.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Pixel {
    /// Red, green, blue and squared luminance.
    pub(crate) sums: [f64; 4],
    pub(crate) samples: u32,
    /// Number of samples that were left out because they were not finite.
    pub(crate) invalid: u32,
}

/// Sums of what the first surface looks like, when layers are asked for; in f64 for the same reason.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Surface {
    albedo: DVec3,
    normal: DVec3,
    /// Sum over hits. Before the first it counts down from zero samples that say nothing ([`PathResult::is_minor`]).
    depth: f64,
    /// Those included that count as the mean of the others.
    hits: f64,
}

/// The picture so far.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Film {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Sums, row after row.
    pub(crate) pixels: Vec<Pixel>,
    /// Sums of first hits, row after row; empty unless layers are asked for.
    pub(crate) surfaces: Vec<Surface>,
}

impl Pixel {
    /// Adds one sample.
    pub fn add(&mut self, result: &PathResult) {
        let radiance = result.radiance;
        self.sums.iter_mut().zip(radiance.to_array()).for_each(|(s, r)| *s += f64::from(r));
        self.sums[3] += f64::from(luminance(radiance)).powi(2);
        self.samples += 1;
        self.invalid += u32::from(result.was_invalid);
    }

    /// Adds all samples of another one.
    pub(super) fn add_all(&mut self, other: &Self) {
        self.sums.iter_mut().zip(other.sums).for_each(|(sum, more)| *sum += more);
        self.samples = self.samples.saturating_add(other.samples);
        self.invalid = self.invalid.saturating_add(other.invalid);
    }

    /// Of a mean over `samples` samples and its variance, which is that of its luminance.
    pub(super) fn of_mean(mean: DVec3, variance: f64, samples: u32, invalid: u32) -> Self {
        let count = f64::from(samples);
        let [red, green, blue] = (mean * count).to_array();
        let pixel = Self { sums: [red, green, blue, 0.0], samples, invalid };
        let spread = if samples > 1 { variance * (count - 1.0) } else { 0.0 };
        let squares = count * (pixel.mean_luminance().powi(2) + spread);
        Self { sums: [red, green, blue, squares], ..pixel }
    }

    /// Number of samples taken.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Mean radiance; black before the first sample.
    pub fn mean(&self) -> [f64; 3] {
        [0, 1, 2].map(|channel| self.sums[channel] / f64::from(self.samples.max(1)))
    }

    /// Mean luminance.
    pub fn mean_luminance(&self) -> f64 {
        let [r, g, b] = self.mean();
        0.2126 * r + 0.7152 * g + 0.0722 * b
    }

    /// Estimated variance of the mean luminance, from the spread of the samples. Low-discrepancy
    /// samples do better than this says. Infinite below two samples.
    pub fn variance_of_mean(&self) -> f64 {
        if self.samples < 2 {
            return f64::INFINITY;
        }
        let count = f64::from(self.samples);
        let variance = (self.sums[3] / count - self.mean_luminance().powi(2)).max(0.0);
        variance / (count - 1.0)
    }
}

impl Surface {
    /// Mean albedo, unit normal and distance in metres of a pixel with this number of samples.
    fn mean(&self, samples: u32) -> ([f32; 3], [f32; 3], f32) {
        let albedo = self.albedo / f64::from(samples.max(1));
        let normal = self.normal.normalize_or_zero();
        let depth = self.depth.max(0.0) / self.hits.max(1.0);
        (albedo.as_vec3().to_array(), normal.as_vec3().to_array(), depth as f32)
    }

    /// Adds the first hit of one sample, or that there was none. One that says nothing counts as much as the others
    /// on average, those that come first as much as the first that says something.
    pub fn add(&mut self, result: &PathResult) {
        let waiting = -self.depth.min(0.0);
        if let Some(hit) = result.first_hit {
            let times = 1.0 + waiting;
            self.albedo += hit.albedo.as_dvec3() * times;
            self.normal += hit.normal.as_dvec3() * times;
            self.depth += f64::from(hit.depth) * times + waiting;
            self.hits += times;
        } else if !result.is_minor {
            self.depth += waiting;
        } else if self.hits > 0.0 {
            let mean = 1.0 / self.hits;
            self.albedo += self.albedo * mean;
            self.normal += self.normal * mean;
            self.depth += self.depth * mean;
            self.hits += 1.0;
        } else {
            self.depth -= 1.0;
        }
    }

    /// Adds what all samples of another one met.
    pub(super) fn add_all(&mut self, other: &Self) {
        self.albedo += other.albedo;
        self.normal += other.normal;
        self.depth += other.depth;
        self.hits += other.hits;
    }

    /// Of sums over first hits: albedo, depth, normal and their number.
    pub(crate) fn of_sums([r, g, b, depth, x, y, z, hits]: [f64; 8]) -> Self {
        Self { albedo: DVec3::new(r, g, b), normal: DVec3::new(x, y, z), depth, hits }
    }

    /// What [`Self::of_sums`] takes.
    pub(crate) fn sums(&self) -> [f64; 8] {
        let ([r, g, b], [x, y, z]) = (self.albedo.to_array(), self.normal.to_array());
        [r, g, b, self.depth, x, y, z, self.hits]
    }
}

/// A squared error over its scale; none is none even where all is black.
pub(super) fn relative(squared: f64, scale: f64) -> f64 {
    if squared == 0.0 { 0.0 } else { squared / scale }
}

/// A film begins with every so-manyth pixel of every so-manyth row.
pub(crate) const BEGINNINGS: [u32; 3] = [8, 4, 2];

impl Film {
    /// A black film; `layers` asks for albedo, normal and depth too.
    pub fn new(width: u32, height: u32, layers: bool) -> Self {
        let count = width as usize * height as usize;
        let pixels = vec![Pixel::default(); count];
        let surfaces = vec![Surface::default(); if layers { count } else { 0 }];
        Self { width, height, pixels, surfaces }
    }

    /// Counts so many samples of every pixel more, without their light: others take them. Only for
    /// [`super::Session::continue_from`].
    pub(crate) fn skip(&mut self, samples: u32) {
        for pixel in &mut self.pixels {
            pixel.samples = pixel.samples.saturating_add(samples);
        }
    }

    /// A copy that does not count the first `skipped` samples of every pixel, which [`Self::skip`] did.
    pub(crate) fn without_skipped(&self, skipped: u32) -> Self {
        let mut film = self.clone();
        film.pixels.iter_mut().for_each(|pixel| pixel.samples -= skipped);
        film
    }

    /// Whether all pixels have a sample that a film begins with.
    pub(crate) fn is_begun(&self) -> bool {
        self.has_every(BEGINNINGS[0])
    }

    /// Along how many pixels a larger one is whose like all have a sample, of the sizes that a film begins with.
    pub(crate) fn whole_pixels(&self) -> Option<u32> {
        [1].into_iter().chain(BEGINNINGS.into_iter().rev()).find(|every| self.has_every(*every))
    }

    /// Whether every so-manyth pixel of every so-manyth row has a sample.
    fn has_every(&self, every: u32) -> bool {
        let every = every as usize;
        let rows = self.pixels.chunks(self.width.max(1) as usize).step_by(every);
        !self.pixels.is_empty()
            && rows.flat_map(|row| row.iter().step_by(every)).all(|pixel| pixel.samples > 0)
    }

    /// Share of its pixels that have a sample.
    pub(crate) fn coverage(&self) -> f64 {
        let covered = self.pixels.iter().filter(|pixel| pixel.samples > 0).count();
        covered as f64 / self.pixels.len().max(1) as f64
    }

    /// Whether next to nothing has got light, and that by chance: hardly a pixel, most by one sample alone.
    pub(crate) fn is_dark(&self) -> bool {
        let lit = || self.pixels.iter().filter(|pixel| pixel.mean_luminance() > 0.0);
        // Of most pictures the first pixels tell.
        if lit().nth(self.pixels.len() / MIN_LIT).is_some() {
            return false;
        }
        let sampled = self.pixels.iter().filter(|pixel| pixel.samples > 0).count();
        let by_more = lit().filter(|pixel| {
            let sum = pixel.mean_luminance() * f64::from(pixel.samples);
            sum * sum > 1.5 * pixel.sums[3]
        });
        let (lit, by_more) = (lit().count(), by_more.count());
        lit * MIN_LIT < sampled && 10 * by_more <= lit
    }

    /// Whether another film has the same size and the same layers.
    pub(crate) fn is_alike(&self, other: &Self) -> bool {
        (self.width, self.height) == (other.width, other.height)
            && self.has_layers() == other.has_layers()
    }

    /// Adds the samples of another film of the same size and with the same layers: each counts as much
    /// as any of this one's.
    pub(crate) fn add_film(&mut self, other: &Self) {
        self.pixels.iter_mut().zip(&other.pixels).for_each(|(pixel, more)| pixel.add_all(more));
        self.surfaces.iter_mut().zip(&other.surfaces).for_each(|(all, more)| all.add_all(more));
    }

    /// Adds one sample to the pixel in column `x` of row `y`.
    #[cfg(test)]
    pub(crate) fn add(&mut self, x: u32, y: u32, result: &PathResult) {
        let index = (y * self.width + x) as usize;
        self.pixels[index].add(result);
        if let Some(surface) = self.surfaces.get_mut(index) {
            surface.add(result);
        }
    }

    /// Whether albedo, normal and depth are kept.
    pub fn has_layers(&self) -> bool {
        !self.surfaces.is_empty()
    }

    /// Mean albedo, unit normal and distance in metres of what a pixel sees; `None` without layers, and where it
    /// has met no surface.
    pub(crate) fn surface_of(&self, index: usize) -> Option<([f32; 3], [f32; 3], f32)> {
        let surface = self.surfaces.get(index).filter(|surface| surface.hits > 0.0)?;
        Some(surface.mean(self.pixels.get(index)?.samples))
    }

    /// The pixels, row after row.
    pub fn pixels(&self) -> &[Pixel] {
        &self.pixels
    }

    /// Mean radiance of every pixel.
    pub fn image(&self) -> Image {
        let pixels = self.pixels.iter().map(|p| p.mean().map(|c| c as f32)).collect();
        Image { width: self.width, height: self.height, pixels }
    }

    /// Fewest samples any pixel has.
    pub fn min_samples(&self) -> u32 {
        self.pixels.iter().map(Pixel::samples).min().unwrap_or(0)
    }

    /// What it takes.
    #[cfg(feature = "window")]
    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(&*self.pixels) + size_of_val(&*self.surfaces)
    }

    /// All samples taken.
    pub fn total_samples(&self) -> u64 {
        self.pixels.iter().map(|p| u64::from(p.samples)).sum()
    }

    /// Samples that were left out because they were not finite.
    pub fn invalid_samples(&self) -> u64 {
        self.pixels.iter().map(|p| u64::from(p.invalid)).sum()
    }

    /// Mean luminance of every pixel and those around it. What a pixel's error is measured against must
    /// not be its own mean: a lone bright sample raises both, and would hide.
    pub(crate) fn luminance_around(&self) -> Vec<f64> {
        let of_one = |index| self.luminance_around_one(index);
        (0..self.pixels.len()).into_par_iter().map(of_one).collect()
    }

    fn luminance_around_one(&self, index: usize) -> f64 {
        let (width, height) = (self.width as usize, self.height as usize);
        let (x, y) = (index % width, index / width);
        let rows = y.saturating_sub(1)..(y + 2).min(height);
        let columns = x.saturating_sub(1)..(x + 2).min(width);
        let count = (rows.len() * columns.len()) as f64;
        let around = rows.flat_map(|row| &self.pixels[row * width..][columns.clone()]);
        around.map(Pixel::mean_luminance).sum::<f64>() / count
    }

    /// Estimated root of the trimmed relative mean squared error of the picture: the root of the mean over
    /// pixels, without the largest thousandth, of
    /// `variance_of_mean / (luminance^2 + 0.01 mean_luminance^2)`, with the luminance of the pixel and
    /// those around it.
    ///
    /// It is an estimate from the samples' own spread: conservative for low-discrepancy samples,
    /// blind to light no sample has met yet. Infinite below two samples a pixel.
    pub fn noise(&self) -> f64 {
        let pixels = self.pixels.iter().zip(self.error_scales(1));
        let relative = |(pixel, scale): (&Pixel, f64)| relative(pixel.variance_of_mean(), scale);
        trimmed_mean(&mut pixels.map(relative).collect::<Vec<_>>()).sqrt()
    }

    /// By what squared errors of every `stride`-th pixel are divided: `luminance^2 + 0.01 mean_luminance^2`, with
    /// the luminance of the pixel and those around it.
    pub(super) fn error_scales(&self, stride: usize) -> Vec<f64> {
        let count = self.pixels.len() as f64;
        let mean = self.pixels.iter().map(Pixel::mean_luminance).sum::<f64>() / count;
        let floor = REL_MSE_EPSILON * mean * mean;
        let scale = |index| self.luminance_around_one(index).powi(2) + floor;
        (0..self.pixels.len()).into_par_iter().step_by(stride).map(scale).collect()
    }

    /// Share of each pixel's samples that met a surface, in `[0,1]`: what the map does not show behind. `None` unless
    /// layers were asked for.
    pub fn alpha(&self) -> Option<Vec<f32>> {
        let share = |(surface, pixel): (&Surface, &Pixel)| {
            (surface.hits / f64::from(pixel.samples.max(1))).clamp(0.0, 1.0) as f32
        };
        self.has_layers().then(|| self.surfaces.iter().zip(&self.pixels).map(share).collect())
    }

    /// Albedo, normal and depth of each pixel; `None` unless layers were asked for. Where nothing
    /// was hit they are zero.
    pub fn surface_layers(&self) -> Option<SurfaceLayers> {
        // Each list gets the room that it takes and no more.
        let pixels = self.surfaces.iter().zip(&self.pixels);
        let means = || pixels.clone().map(|(surface, pixel)| surface.mean(pixel.samples));
        self.has_layers().then(|| SurfaceLayers {
            albedo: means().map(|(albedo, _, _)| albedo).collect(),
            normal: means().map(|(_, normal, _)| normal).collect(),
            depth: means().map(|(_, _, depth)| depth).collect(),
        })
    }

    /// Cuts the film into tiles of this size, row after row of tiles; the first begins `before` columns
    /// and rows before the picture, which is less than a tile.
    pub(super) fn tiles(&mut self, width: u32, height: u32, before: [u32; 2]) -> Vec<FilmTile<'_>> {
        let columns = (self.width + before[0]).div_ceil(width) as usize;
        let rows = (self.height + before[1]).div_ceil(height) as usize;
        let mut tiles = Vec::with_capacity(columns * rows);
        for tile in 0..columns * rows {
            let [column, row] = [tile % columns, tile / columns].map(|index| index as i64);
            let corner = [
                column * i64::from(width) - i64::from(before[0]),
                row * i64::from(height) - i64::from(before[1]),
            ];
            tiles.push(FilmTile { corner, rows: Vec::with_capacity(height as usize) });
        }
        let row_length = self.width as usize;
        let mut surfaces = self.surfaces.chunks_mut(row_length);
        for (y, mut pixels) in self.pixels.chunks_mut(row_length).enumerate() {
            let mut surfaces = surfaces.next().unwrap_or_default();
            let tile_row = (y + before[1] as usize) / height as usize;
            for tile in &mut tiles[tile_row * columns..(tile_row + 1) * columns] {
                let end = (tile.corner[0] + i64::from(width)) as usize;
                let length = end.min(row_length) - tile.first()[0] as usize;
                let own = pixels.split_off_mut(..length).unwrap_or_default();
                // There are none without layers.
                tile.rows.push((own, surfaces.split_off_mut(..length).unwrap_or_default()));
            }
        }
        tiles
    }
}

/// A part of the film for one thread.
pub(super) struct FilmTile<'a> {
    /// Column and row of its first pixel, were none of it outside of the picture.
    pub(super) corner: [i64; 2],
    rows: Vec<(&'a mut [Pixel], &'a mut [Surface])>,
}

/// A pixel of the film and what is seen in it, if that is asked for.
pub(super) struct FilmPixel<'a> {
    pixel: &'a mut Pixel,
    surface: Option<&'a mut Surface>,
}

impl FilmTile<'_> {
    /// Column and row of the first pixel that is in the picture.
    fn first(&self) -> [u32; 2] {
        self.corner.map(|at| at.max(0) as u32)
    }

    /// Its pixels that are in the picture with their column and row, row after row.
    pub(super) fn pixels(&mut self) -> impl Iterator<Item = ([u32; 2], FilmPixel<'_>)> {
        let [left, top] = self.first();
        (top..).zip(&mut self.rows).flat_map(move |(y, (pixels, surfaces))| {
            let mut surfaces = surfaces.iter_mut();
            (left..)
                .zip(pixels.iter_mut())
                .map(move |(x, pixel)| ([x, y], FilmPixel { pixel, surface: surfaces.next() }))
        })
    }
}

impl FilmPixel<'_> {
    /// Number of samples taken.
    pub(super) fn samples(&self) -> u32 {
        self.pixel.samples
    }

    /// Takes one sample in place of all that there are.
    pub(super) fn replace(&mut self, result: &PathResult) {
        *self.pixel = Pixel::default();
        if let Some(surface) = &mut self.surface {
            **surface = Surface::default();
        }
        self.add(result);
    }

    /// Adds one sample.
    pub(super) fn add(&mut self, result: &PathResult) {
        self.pixel.add(result);
        if let Some(surface) = &mut self.surface {
            surface.add(result);
        }
    }
}

/// What the first surface of each pixel looks like.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SurfaceLayers {
    /// Mean albedo, linear RGB.
    pub albedo: Vec<[f32; 3]>,
    /// Unit mean of the world shading normals.
    pub normal: Vec<[f32; 3]>,
    /// Mean distance from the camera in metres.
    pub depth: Vec<f32>,
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn a_sample_takes_the_place_of_all() {
        let mut film = Film::new(1, 1, true);
        let sample = |light: f32, depth: f32| {
            let (normal, albedo) = (Vec3::Z, Vec3::splat(0.5));
            let first_hit = Some(crate::path::FirstHit { normal, albedo, depth });
            PathResult { radiance: Vec3::splat(light), rays: 1, first_hit, ..PathResult::default() }
        };
        film.add(0, 0, &sample(5.0, 2.0));
        let mut expected = Film::new(1, 1, true);
        expected.add(0, 0, &sample(1.0, 3.0));
        for tile in &mut film.tiles(1, 1, [0, 0]) {
            tile.pixels().for_each(|(_, mut pixel)| pixel.replace(&sample(1.0, 3.0)));
        }
        assert_eq!(film, expected);
    }
}
