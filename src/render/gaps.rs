//! A film that was only begun, to be looked at: its gaps are filled.

use std::borrow::Cow;

use super::film::{BEGINNINGS, Film};

impl Film {
    /// A film that was only begun, to be looked at: pixels without samples show one beside them or, farther
    /// off, the nearest of those above and left of them that it began with.
    pub(crate) fn without_gaps(&self) -> Cow<'_, Self> {
        if self.min_samples() > 0 {
            return Cow::Borrowed(self);
        }
        let mut film = self.clone();
        for (y, x) in (0..self.height).flat_map(|y| (0..self.width).map(move |x| (y, x))) {
            let at = |x: u32, y: u32| (y * self.width + x) as usize;
            let index = |every: u32| at(x - x % every, y - y % every);
            let has_samples = |at: &usize| self.pixels[*at].samples() > 0;
            // Rows are taken one by one: the next may be there.
            let below = (y + 1 < self.height).then(|| at(x, y + 1));
            let beside = [Some(at(x, y)), Some(at(x, y.saturating_sub(1))), below];
            let begun = BEGINNINGS.iter().rev().map(|every| index(*every));
            if let Some(from) = beside.into_iter().flatten().chain(begun).find(has_samples) {
                film.pixels[at(x, y)] = self.pixels[from];
                if let Some(surface) = self.surfaces.get(from) {
                    film.surfaces[at(x, y)] = *surface;
                }
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
    fn gaps_show_what_is_beside_them() {
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
        (0..9).for_each(|x| film.add(x, 2, &sample(100.0 + x as f32)));
        let whole = film.without_gaps();
        let at = |x: usize, y: usize| whole.pixels()[y * 9 + x].mean()[0];
        assert_eq!([at(0, 0), at(3, 0), at(5, 0)], [0.0, 0.0, 4.0], "as it was begun");
        assert_eq!([at(3, 1), at(3, 2), at(3, 3)], [103.0; 3], "the row between");
        assert_eq!([at(7, 4), at(8, 4)], [44.0, 48.0]);
    }
}
