//! How large the picture is shown, and which part of it lies in the middle of its room.

use egui::{Pos2, Rect, Vec2};

/// Times as large as it fits that it is shown at most.
const MAX_ZOOM: f32 = 32.0;
/// Less than this is none.
const MIN_ZOOM: f32 = 1.01;

with_defaults! {
    /// A magnification of the picture that fits its room.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Zoom {
        /// Times as large, from 1.
        pub(super) times: f32 = 1.0,
        /// Place of the picture in the middle of the room, both coordinates in `[0,1]`.
        middle: Vec2 = Vec2::splat(0.5),
    }
}

impl Zoom {
    /// So many times as large as it fits, with this place in the middle.
    pub(super) fn new(times: f32, middle: Vec2) -> Self {
        let times = times.clamp(1.0, MAX_ZOOM);
        // Half of what is seen at each side of the middle: the edges of the picture stay those of the room.
        let margin = 0.5 / times;
        let middle = middle.clamp(Vec2::splat(margin), Vec2::splat(1.0 - margin));
        if times < MIN_ZOOM { Self::default() } else { Self { times, middle } }
    }

    /// Whether it is more than what fits.
    pub(super) fn is_some(self) -> bool {
        self.times > 1.0
    }

    /// Where something lies in the room `area`, if `whole` is where the picture would fit.
    pub(super) fn of(self, area: Rect, whole: Rect, rect: Rect) -> Rect {
        if !self.is_some() {
            return rect;
        }
        let corner = area.center() - self.middle * whole.size() * self.times;
        Rect::from_min_size(corner + (rect.min - whole.min) * self.times, rect.size() * self.times)
    }

    /// Larger by a factor, such that what is seen `at` a point of the room stays there; `shown` is where the whole
    /// picture lies now.
    pub(super) fn by(self, factor: f32, at: Pos2, area: Rect, shown: Rect) -> Self {
        let times = (self.times * factor).clamp(1.0, MAX_ZOOM);
        let place = (at - shown.min) / shown.size();
        let size = shown.size() * (times / self.times);
        Self::new(times, place + (area.center() - at) / size)
    }

    /// Moved with the pointer by so many points.
    pub(super) fn moved(self, by: Vec2, shown: Rect) -> Self {
        Self::new(self.times, self.middle - by / shown.size())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_under_the_pointer_stays_there_and_the_edges_stay_outside() {
        let area = Rect::from_min_size(Pos2::new(30.0, 10.0), Vec2::new(400.0, 300.0));
        let whole = Rect::from_center_size(area.center(), Vec2::new(400.0, 200.0));
        let at = Pos2::new(200.0, 170.0);
        let place = |shown: Rect| (at - shown.min) / shown.size();
        let (mut zoom, mut shown) = (Zoom::default(), whole);
        for factor in [2.0, 1.5, 3.0, 0.5] {
            let before = place(shown);
            zoom = zoom.by(factor, at, area, shown);
            shown = zoom.of(area, whole, whole);
            assert!((place(shown) - before).length() < 1e-4, "{zoom:?}");
        }
        assert!((zoom.times - 4.5).abs() < 1e-4);
        // A part of it lies where it does.
        let part = Rect::from_center_size(whole.center(), 0.5 * whole.size());
        let of_part = zoom.of(area, whole, part);
        assert!((of_part.center() - shown.center()).length() < 1e-3);
        assert!((of_part.size() - 0.5 * shown.size()).length() < 1e-3);
        let far = zoom.moved(Vec2::splat(1e6), shown).of(area, whole, whole);
        assert!((far.left() - area.left()).abs() < 1e-2, "{far:?}");
        assert!(!zoom.by(1e-3, at, area, shown).is_some(), "it fits again");
        assert_eq!(Zoom::default().of(area, whole, part), part);
    }
}
