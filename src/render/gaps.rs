//! A film that was only begun, to be looked at.

use std::borrow::Cow;

use rayon::prelude::*;

use super::film::{Film, Pixel, Surface};

impl Film {
    /// The film in larger pixels, each as wide and high as `every` of its own.
    pub(crate) fn in_larger_pixels(&self, every: u32) -> Self {
        let [width, height] = [self.width, self.height].map(|side| side.div_ceil(every));
        let larger = |to: usize| {
            let [left, top] = [to as u32 % width * every, to as u32 / width * every];
            let (mut pixel, mut surface) = (Pixel::default(), Surface::default());
            for y in top..(top + every).min(self.height) {
                for from in (left..(left + every).min(self.width)).map(|x| y * self.width + x) {
                    pixel.add_all(&self.pixels[from as usize]);
                    if let Some(more) = self.surfaces.get(from as usize) {
                        surface.add_all(more);
                    }
                }
            }
            (pixel, surface)
        };
        let count = width as usize * height as usize;
        let (pixels, mut surfaces): (Vec<_>, Vec<_>) =
            (0..count).into_par_iter().map(larger).unzip();
        if !self.has_layers() {
            surfaces.clear();
        }
        Self { width, height, pixels, surfaces }
    }

    /// The film with what larger pixels know where pixels have no samples.
    pub(crate) fn without_gaps(&self) -> Cow<'_, Self> {
        if self.min_samples() > 0 || self.width.max(self.height) <= 1 {
            return Cow::Borrowed(self);
        }
        let larger = self.in_larger_pixels(2);
        let larger = larger.without_gaps();
        let mut film = self.clone();
        for index in (0..film.pixels.len()).filter(|index| self.pixels[*index].samples() == 0) {
            let [x, y] = [index as u32 % self.width, index as u32 / self.width];
            let from = (y / 2 * larger.width + x / 2) as usize;
            film.pixels[index] = larger.pixels[from];
            if let Some(surface) = film.surfaces.get_mut(index) {
                *surface = larger.surfaces[from];
            }
        }
        Cow::Owned(film)
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::path::PathResult;

    #[test]
    fn gaps_show_the_larger_pixels_around_them() {
        let mut film = Film::new(9, 5, false);
        let sample = |light: f32| PathResult {
            radiance: Vec3::splat(light),
            rays: 1,
            ..PathResult::default()
        };
        // Every fourth pixel of every fourth row, and one whole row.
        for (x, y) in [(0, 0), (4, 0), (8, 0), (0, 4), (4, 4), (8, 4)] {
            film.add(x, y, &sample((10 * y + x) as f32));
        }
        assert_eq!(film.whole_pixels(), Some(4));
        (0..9).for_each(|x| film.add(x, 2, &sample(100.0 + x as f32)));
        assert_eq!(film.whole_pixels(), Some(4));
        let larger = film.in_larger_pixels(4);
        assert_eq!((larger.width, larger.height, larger.min_samples()), (3, 2, 1));
        assert_eq!(larger.pixels()[0].mean()[0], (100.0 + 101.0 + 102.0 + 103.0) / 5.0);
        let whole = film.without_gaps();
        let at = |x: usize, y: usize| whole.pixels()[y * 9 + x].mean()[0];
        assert_eq!([at(0, 0), at(1, 1), at(5, 0)], [0.0, 0.0, 4.0]);
        assert_eq!([at(2, 2), at(3, 2), at(3, 3)], [102.0, 103.0, 102.5]);
        assert_eq!(at(2, 1), (100.0 + 101.0 + 102.0 + 103.0) / 5.0);
        assert_eq!([at(7, 4), at(8, 4)], [44.0, 48.0]);
        assert!(film.total_samples() > 0 && whole.min_samples() > 0);
        // Where nothing is known it ends, too.
        assert_eq!(Film::new(3, 2, true).without_gaps().total_samples(), 0);
    }
}
