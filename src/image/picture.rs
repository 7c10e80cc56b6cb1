//! What a picture is, and how large it may be.

use std::ops::Range;

use crate::error::{Decoded, Notices};
use crate::memory;

/// A picture: linear Rec.709 radiance, row 0 at the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height` RGB triples, row after row.
    pub pixels: Vec<[f32; 3]>,
}

impl Image {
    /// A picture of one colour.
    pub fn filled(width: u32, height: u32, rgb: [f32; 3]) -> Self {
        Self { width, height, pixels: vec![rgb; width as usize * height as usize] }
    }

    /// A picture computed pixel by pixel from `(x, y)`.
    pub fn from_fn(width: u32, height: u32, mut f: impl FnMut(u32, u32) -> [f32; 3]) -> Self {
        let (columns, count) = (width as usize, width as usize * height as usize);
        let pixel = |at: usize| f((at % columns) as u32, (at / columns) as u32);
        Self { width, height, pixels: (0..count).map(pixel).collect() }
    }

    /// Size of a picture of `all_width` x `all_height` pixels made at most `width` pixels wide.
    pub(crate) fn shrunk_size(all_width: u32, all_height: u32, width: u32) -> (u32, u32) {
        let width = width.clamp(1, all_width);
        let height = (u64::from(width) * u64::from(all_height) / u64::from(all_width)) as u32;
        (width, height.clamp(1, all_height))
    }

    /// The picture at most `width` pixels wide, each the mean of those it covers.
    pub fn shrunk(&self, width: u32) -> Self {
        let (width, height) = Self::shrunk_size(self.width, self.height, width);
        let covered = |i: u32, count: u32, all: u32| {
            let edge = |i: u32| (u64::from(i) * u64::from(all) / u64::from(count)) as u32;
            edge(i)..edge(i + 1).max(edge(i) + 1)
        };
        Self::from_fn(width, height, |x, y| {
            self.mean(covered(x, width, self.width), covered(y, height, self.height))
        })
    }

    /// The mean of a rectangle of pixels.
    pub(crate) fn mean(&self, columns: Range<u32>, rows: Range<u32>) -> [f32; 3] {
        let count = (columns.len() * rows.len()) as f64;
        let mut sum = [0.0_f64; 3];
        for (x, y) in rows.flat_map(|y| columns.clone().map(move |x| (x, y))) {
            sum.iter_mut().zip(self.at(x, y)).for_each(|(s, v)| *s += f64::from(v));
        }
        sum.map(|s| (s / count) as f32)
    }

    /// The picture in smaller pixels, `times` of which are as wide as one of its own, cut to a size.
    pub(crate) fn enlarged(&self, times: u32, [width, height]: [u32; 2]) -> Self {
        let place = |at: u32| (at as f32 + 0.5) / times as f32 - 0.5;
        let row = |y: u32| (0..width).map(move |x| self.between([place(x), place(y)]));
        Self { width, height, pixels: (0..height).flat_map(row).collect() }
    }

    /// The colour at a place in pixels, whole numbers being their middles: between the four around it.
    pub(crate) fn between(&self, place: [f32; 2]) -> [f32; 3] {
        let size = [self.width, self.height];
        let place: [f32; 2] =
            std::array::from_fn(|i| place[i].clamp(0.0, size[i].saturating_sub(1) as f32));
        let low = place.map(|place| place as u32);
        let next: [u32; 2] = std::array::from_fn(|i| (low[i] + 1).min(size[i] - 1));
        let part: [f32; 2] = std::array::from_fn(|i| place[i] - low[i] as f32);
        let row = |y: u32| {
            let [left, right] = [self.at(low[0], y), self.at(next[0], y)];
            std::array::from_fn::<f32, 3, _>(|i| left[i] + part[0] * (right[i] - left[i]))
        };
        let [upper, lower] = [row(low[1]), row(next[1])];
        std::array::from_fn(|i| upper[i] + part[1] * (lower[i] - upper[i]))
    }

    /// The pixel in column `x` of row `y`.
    pub fn at(&self, x: u32, y: u32) -> [f32; 3] {
        self.pixels[y as usize * self.width as usize + x as usize]
    }
}

/// A picture ready for a display: 8-bit sRGB, row 0 at the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rgb8 {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height` RGB triples, row after row.
    pub pixels: Vec<[u8; 3]>,
}

/// A picture as a file has it, not repaired in any way.
pub(crate) struct FilePicture {
    pub(crate) image: Image,
    pub(crate) notices: Notices,
    /// Whether its values are linear rather than what was made of them for a display.
    pub(crate) is_linear: bool,
    /// Whether the file says that it holds the six faces of a cube.
    pub(crate) is_cube_map: bool,
}

/// Most pixels a picture may have: 16384 x 16384, 3.2 GB of RGB.
pub(super) const MAX_PIXELS: u64 = 1 << 28;

/// Longest side of a picture, in pixels.
pub(super) const MAX_SIDE: u64 = 1 << 16;

/// Refuses sizes that are empty or beyond what a picture may have or memory holds, before anything is allocated.
pub(super) fn check_size(width: u64, height: u64) -> Decoded<(u32, u32)> {
    if width == 0 || height == 0 {
        return Err(format!("has no pixels ({width} x {height})"));
    }
    if width > MAX_SIDE || height > MAX_SIDE || width * height > MAX_PIXELS {
        return Err(format!(
            "claims {width} x {height} pixels, more than the 16384 x 16384 lightgrid reads"
        ));
    }
    memory::check(width * height * size_of::<[f32; 3]>() as u64)?;
    Ok((width as u32, height as u32))
}
