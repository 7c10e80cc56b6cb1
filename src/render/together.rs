//! Two films as one, to be looked at.

use rayon::prelude::*;

use super::film::{Film, Pixel, Surface};

impl Film {
    /// It and another one of its size and layers, so many of whose samples count as one: they spread so many times
    /// more than its own, or they would count as much.
    pub(crate) fn together(&self, other: &Self, times: f32) -> Self {
        let share = 1.0 / f64::from(times);
        let pixels = self.pixels().par_iter().zip(other.pixels());
        let scaled = |own: f64, other: f64| {
            let all = own + share * other;
            (all.round(), if all > 0.0 { all.round() / all } else { 0.0 })
        };
        let counts = |own: &Pixel, other: &Pixel| {
            scaled(f64::from(own.samples()), f64::from(other.samples()))
        };
        let of_pixel = |(own, other): (&Pixel, &Pixel)| {
            let (samples, scale) = counts(own, other);
            let [sums, mut more] = [own, other].map(Pixel::sums);
            let least = f64::from(other.samples()) * other.mean_luminance().powi(2);
            more[3] = least + share * (more[3] - least).max(0.0);
            let sums = std::array::from_fn(|i| scale * (sums[i] + share * more[i]));
            let invalid = own.invalid().saturating_add(other.invalid());
            Pixel::of_sums(sums, samples as u32, invalid)
        };
        let of_surface = |index: usize| {
            let (_, scale) = counts(&self.pixels()[index], &other.pixels()[index]);
            let [sums, more] = [self, other].map(|film| film.surfaces()[index].sums());
            let mut sums: [f64; 8] = std::array::from_fn(|i| scale * (sums[i] + share * more[i]));
            round_hits(&mut sums);
            Surface::of_sums(sums)
        };
        let surfaces = (0..self.surfaces().len()).into_par_iter().map(of_surface);
        let size = [self.width, self.height];
        Self::of_pixels(size, pixels.map(of_pixel).collect(), surfaces.collect())
    }
}

/// Makes the hits of [`Surface::sums`] a whole number, and keeps the mean depth.
fn round_hits(sums: &mut [f64; 8]) {
    let hits = sums[7].round();
    if hits > 0.0 {
        sums[3] *= hits / sums[7];
    }
    sums[7] = hits;
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::path::{FirstHit, PathResult};

    /// As bright as the column's number, 3 metres away.
    fn film(width: u32, height: u32) -> Film {
        let mut film = Film::new(width, height, true);
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let first_hit = Some(FirstHit { normal: Vec3::Z, albedo: Vec3::ONE, depth: 3.0 });
            let radiance = Vec3::splat(x as f32);
            let result = PathResult { radiance, first_hit, ..PathResult::default() };
            (0..5).for_each(|_| film.add(x, y, &result));
        }
        film
    }

    #[test]
    fn two_films_together_have_the_samples_of_both() {
        let (one, none) = (film(4, 2), Film::new(4, 2, true));
        assert_eq!(one.together(&none, 3.0), one);
        let both = one.together(&one, 5.0);
        assert_eq!((both.pixels()[3].samples(), both.pixels()[3].mean()), (6, [3.0; 3]));
        assert_eq!(both.surface_of(3), one.surface_of(3));
        // What is certain stays so, however little it counts.
        let mut spread = Film::new(1, 1, false);
        for light in (0..100).map(|sample| (sample % 2) as f32) {
            spread.add(0, 0, &PathResult { radiance: Vec3::splat(light), ..PathResult::default() });
        }
        let counted = Film::new(1, 1, false).together(&spread, 4.0);
        let [before, now] = [&spread, &counted].map(|film| film.pixels()[0].variance_of_mean());
        assert!((now / before - 1.0).abs() < 0.04, "{before}, {now}");
    }
}
