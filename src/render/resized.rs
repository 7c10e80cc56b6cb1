//! Films made of others, to be looked at.

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

    /// What it knows of a picture of another size through the same camera: the field of view is vertical, so that
    /// both share their middle. Between pixels sums are interpolated; where it shows nothing there are no samples.
    pub(crate) fn resized(&self, [width, height]: [u32; 2]) -> Self {
        let step = f64::from(self.height) / f64::from(height);
        let place = |at: usize, all: u32, own: u32| {
            (at as f64 + 0.5 - 0.5 * f64::from(all)) * step + 0.5 * f64::from(own)
        };
        let columns = 0.0..f64::from(self.width);
        let mixed = |index: usize| {
            let x = place(index % width as usize, width, self.width);
            let y = place(index / width as usize, height, self.height);
            if columns.contains(&x) { self.mixed(x - 0.5, y - 0.5) } else { Default::default() }
        };
        let count = width as usize * height as usize;
        let mixed = (0..count).into_par_iter().map(mixed);
        let (pixels, surfaces): (Vec<_>, Vec<_>) = match self.has_layers() {
            true => mixed.unzip(),
            false => (mixed.map(|(pixel, _)| pixel).collect(), Vec::new()),
        };
        Self::of_pixels([width, height], pixels, surfaces)
    }

    /// The four pixels around a place together, the nearer the more.
    fn mixed(&self, x: f64, y: f64) -> (Pixel, Surface) {
        let (mut light, mut surface) = ([0.0; 4], [0.0; 8]);
        let (mut samples, mut invalid) = (0.0, 0.0);
        let near = |at: f64, count: u32| at.clamp(0.0, f64::from(count - 1)) as usize;
        for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let share = |at: f64, d: f64| 1.0 - (at.floor() + d - at).abs();
            let weight = share(x, dx) * share(y, dy);
            let (column, row) = (x.floor() + dx, y.floor() + dy);
            let index = near(row, self.height) * self.width as usize + near(column, self.width);
            let pixel = &self.pixels()[index];
            let add = |sum: &mut f64, more: f64| *sum += weight * more;
            light.iter_mut().zip(pixel.sums()).for_each(|(sum, more)| add(sum, more));
            add(&mut samples, f64::from(pixel.samples()));
            add(&mut invalid, f64::from(pixel.invalid()));
            if let Some(of) = self.surfaces().get(index) {
                surface.iter_mut().zip(of.sums()).for_each(|(sum, more)| add(sum, more));
            }
        }
        // There are no parts of samples.
        let whole = samples.round();
        let scale = if samples > 0.0 { whole / samples } else { 0.0 };
        let pixel = Pixel::of_sums(light.map(|sum| scale * sum), whole as u32, invalid as u32);
        let mut surface = surface.map(|sum| scale * sum);
        round_hits(&mut surface);
        (pixel, Surface::of_sums(surface))
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

    #[test]
    fn a_film_of_another_size_shows_the_same_where_both_look() {
        let before = film(12, 8);
        assert_eq!(before.resized([12, 8]), before);
        let lights = |film: &Film| -> Vec<f64> {
            film.pixels()[..film.width as usize].iter().map(|pixel| pixel.mean()[0]).collect()
        };
        let wide = before.resized([20, 8]);
        assert_eq!(lights(&wide)[4..16], lights(&before));
        let counts: Vec<u32> = wide.pixels()[..20].iter().map(Pixel::samples).collect();
        assert_eq!(counts, [[0; 4].as_slice(), &[5; 12], &[0; 4]].concat());
        assert_eq!(lights(&before.resized([6, 8])), lights(&before)[3..9]);
        let large = before.resized([24, 16]);
        assert_eq!(lights(&large)[..4], [0.0, 0.25, 0.75, 1.25]);
        assert_eq!(lights(&before.resized([6, 4])), [0.5, 2.5, 4.5, 6.5, 8.5, 10.5]);
        for film in [wide, large] {
            let (albedo, normal, depth) = film.surface_of(film.width as usize / 2).expect("met");
            assert_eq!((albedo, normal, depth), ([1.0; 3], [0.0, 0.0, 1.0], 3.0));
        }
    }
}
