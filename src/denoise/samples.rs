//! What the filter is given: a film or, of the same view and points, two.

use glam::Vec3;

use crate::color::luminance;
use crate::image::Image;
use crate::render::film::{Film, Pixel};

/// A film and, perhaps, another one of its size and with its layers, each of whose samples counts as so many of the
/// film's own.
#[derive(Clone, Copy)]
pub(super) struct Samples<'a> {
    pub(super) film: &'a Film,
    pub(super) other: Option<(&'a Film, f32)>,
    /// What light is multiplied by, a power of two: 1 unless it is so strong that its squares leave the range
    /// of f32.
    scale: f64,
}

/// Time for which noise is taken out, the least first.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Quality {
    /// By the smaller network, where the version has it.
    Fast,
    High,
    /// Of albedo and normals first.
    Prefiltered,
}

/// What is known of a pixel's light.
pub(super) struct Mean {
    pub(super) rgb: Vec3,
    /// Variance of its luminance; `None` of a single sample.
    pub(super) variance: Option<f32>,
}

/// Light up to `2^40` is taken as it is.
const REACH: i32 = 40;

impl<'a> Samples<'a> {
    pub(super) fn of(film: &'a Film, other: Option<(&'a Film, f32)>) -> Self {
        let of_pixel = |pixel: &Pixel| pixel.mean().into_iter().fold(0.0, f64::max);
        let samples = Self { film, other, scale: 1.0 };
        let brightest = samples.films().flat_map(Film::pixels).map(of_pixel).fold(0.0, f64::max);
        let scale = match brightest.log2().ceil() {
            exponent if exponent > f64::from(REACH) => 2.0_f64.powf(f64::from(REACH) - exponent),
            _ => 1.0,
        };
        Self { scale, ..samples }
    }

    /// A picture made of these samples, as bright as the film is.
    pub(super) fn restored(&self, mut image: Image) -> Image {
        if self.scale != 1.0 {
            for value in image.pixels.as_flattened_mut() {
                *value = (f64::from(*value) / self.scale) as f32;
            }
        }
        image
    }

    /// Samples of a pixel in all films.
    pub(super) fn count(&self, index: usize) -> u32 {
        self.films().map(|film| film.pixels()[index].samples()).sum()
    }

    /// Sums over the first hits of those samples, whatever their light counts.
    pub(super) fn first_hits(&self, index: usize) -> [f32; 8] {
        let mut sums = [0.0; 8];
        for film in self.films() {
            sums.iter_mut().zip(film.surfaces[index].sums()).for_each(|(sum, more)| *sum += more);
        }
        sums.map(|sum| sum as f32)
    }

    fn films(&self) -> impl Iterator<Item = &'a Film> {
        [Some(self.film), self.other.map(|(other, _)| other)].into_iter().flatten()
    }

    /// The picture as it is.
    pub(super) fn image(&self) -> Image {
        let Film { width, height, .. } = *self.film;
        let pixels = (0..self.film.pixels().len()).map(|index| self.mean(index).rgb.to_array());
        Image { width, height, pixels: pixels.collect() }
    }

    /// Mean albedo and unit normal of each pixel's first hits, zero where nothing was hit; `None` without layers.
    pub(super) fn layers(&self) -> Option<[Vec<[f32; 3]>; 2]> {
        let layers = |index: usize| {
            let [r, g, b, _, x, y, z, _] = self.first_hits(index);
            let albedo = Vec3::new(r, g, b) / self.count(index).max(1) as f32;
            (albedo.to_array(), Vec3::new(x, y, z).normalize_or_zero().to_array())
        };
        let pixels = 0..self.film.pixels().len();
        self.film.has_layers().then(|| pixels.map(layers).unzip()).map(|(a, n)| [a, n])
    }

    pub(super) fn mean(&self, index: usize) -> Mean {
        let own = &self.film.pixels()[index];
        let vec3 = |pixel: &Pixel| Vec3::from(pixel.mean().map(|c| (self.scale * c) as f32));
        let variance = |pixel: &Pixel| (self.scale * self.scale * pixel.variance_of_mean()) as f32;
        let Some((film, worth)) = self.other else {
            return Mean { rgb: vec3(own), variance: (own.samples() > 1).then(|| variance(own)) };
        };
        let other = &film.pixels()[index];
        let [n, m] = [own, other].map(|pixel| pixel.samples() as f32);
        let total = (n + worth * m).max(f32::MIN_POSITIVE);
        let rgb = (vec3(own) * n + vec3(other) * (worth * m)) / total;
        // Both tell of the spread of one of the film's own samples, and so does how far apart they are: of
        // something bright one may have met nothing.
        let apart = luminance(vec3(own) - vec3(other)).powi(2);
        let (mut squares, mut freedom, mut weighted) = (0.0, 0.0, 0.0);
        for (pixel, worth) in [(own, 1.0), (other, worth)] {
            if pixel.samples() > 1 {
                let (count, others) = (pixel.samples() as f32, (pixel.samples() - 1) as f32);
                squares += worth * variance(pixel) * others * count;
                freedom += others;
                weighted += (worth * count / total).powi(2) * variance(pixel);
            }
        }
        if freedom > 0.0 && n > 0.0 && m > 0.0 && worth > 0.0 {
            squares += apart / (1.0 / n + 1.0 / (worth * m));
            freedom += 1.0;
        }
        // A film that counts less for an error of its own has less spread than that.
        let variance = (freedom > 0.0).then(|| (squares / freedom / total).max(weighted));
        Mean { rgb, variance }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::PathResult;

    #[test]
    fn samples_of_two_films_count_as_they_are_worth() {
        let film = |lights: &[f32]| {
            let mut film = Film::new(1, 1, true);
            for light in lights {
                let radiance = Vec3::splat(*light);
                film.add(0, 0, &PathResult { radiance, ..PathResult::default() });
            }
            film
        };
        let (own, other) = (film(&[1.0, 3.0]), film(&[4.0, 6.0, 5.0, 5.0]));
        let mean = |worth| Samples::of(&own, Some((&other, worth))).mean(0);
        assert_eq!(mean(1.0).rgb, Vec3::splat(4.0));
        assert!((mean(4.0).rgb - Vec3::splat(84.0 / 18.0)).length() < 1e-6);
        // Squared deviations 2 and 2, of which four are free, and means that are 3 apart.
        let variance = |worth| mean(worth).variance.expect("known");
        assert!((variance(1.0) - (2.0 + 2.0 + 9.0 / 0.75) / 5.0 / 6.0).abs() < 1e-6);
        assert!((variance(4.0) - (2.0 + 8.0 + 9.0 / 0.5625) / 5.0 / 18.0).abs() < 1e-6);
        // What counts little leaves the spread of the rest.
        assert!((variance(0.01) - (2.0 / 2.04_f32).powi(2)).abs() < 1e-3);
        let single = film(&[2.0]);
        assert_eq!(Samples::of(&single, None).mean(0).variance, None);
        let four = film(&[4.0]);
        let both = Samples::of(&single, Some((&four, 1.0)));
        assert_eq!((both.mean(0).rgb, both.mean(0).variance), (Vec3::splat(3.0), None));
        assert_eq!(both.count(0), 2);
    }
}
