//! Weights of patches: the integral of importance over a patch's solid angle, in f64.

use glam::Vec3;
use rayon::prelude::*;

use super::patches;
use crate::color::importance;
use crate::image::Image;

/// Computes weights of patches row by row from the pixels, so that no full-size copy is needed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Weights<'a> {
    map: &'a Image,
    /// [`importance`] is linear: these are its coefficients. In f64 nothing overflows or underflows.
    coefficients: [f64; 3],
}

impl<'a> Weights<'a> {
    pub(crate) fn new(map: &'a Image) -> Self {
        let coefficients = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| f64::from(importance(axis)));
        Self { map, coefficients }
    }

    /// Weights of patches `first_x..first_x + out.len()` of row `y`: importance x steradian.
    ///
    /// A patch's integral is its solid angle times the mean of its corners, so every patch that touches a
    /// lit texel's centre has some weight. `scratch` is overwritten.
    pub(crate) fn row(&self, first_x: u32, y: u32, out: &mut [f64], scratch: &mut Vec<f64>) {
        let solid_angle = patches::solid_angle(self.map.width, self.map.height, y);
        self.columns(first_x, y, out.len(), scratch);
        for (weight, sides) in out.iter_mut().zip(scratch.windows(2)) {
            *weight = solid_angle / 4.0 * (sides[0] + sides[1]);
        }
    }

    /// Calls `f` with each whole row of weights from top to bottom; bands of rows are computed in
    /// parallel.
    pub(crate) fn for_each_row(&self, mut f: impl FnMut(&[f64])) {
        const BAND: u32 = 32;
        let (width, height) = self.size();
        let width = width as usize;
        let mut band = vec![0.0; width * BAND as usize];
        for first_row in (0..height).step_by(BAND as usize) {
            let rows = BAND.min(height - first_row) as usize;
            band[..rows * width]
                .par_chunks_mut(width)
                .zip(first_row..first_row + rows as u32)
                .for_each_init(Vec::new, |scratch, (row, y)| self.row(0, y, row, scratch));
            band[..rows * width].chunks_exact(width).for_each(&mut f);
        }
    }

    /// Columns and rows of patches.
    pub(crate) fn size(&self) -> (u32, u32) {
        (self.map.width, patches::row_count(self.map.height))
    }

    /// Sum of importance above and below, for the left side of each patch and the right one of the
    /// last.
    fn columns(&self, first_x: u32, y: u32, columns: usize, out: &mut Vec<f64>) {
        let (first, width) = (first_x as usize, self.map.width as usize);
        let pixels = |y: u32| &self.map.pixels[y as usize * width..][..width];
        let (above, below) = (pixels(y.saturating_sub(1)), pixels(y.min(self.map.height - 1)));
        let at = |x: usize| self.importance(&above[x]) + self.importance(&below[x]);
        out.clear();
        out.push(at((first + width - 1) % width));
        out.extend((first..first + columns).map(at));
    }

    fn importance(&self, pixel: &[f32; 3]) -> f64 {
        let [r, g, b] = self.coefficients;
        r * f64::from(pixel[0]) + g * f64::from(pixel[1]) + b * f64::from(pixel[2])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lit_texel_lends_weight_to_the_patches_around_it_across_the_seam() {
        let map = Image::from_fn(8, 4, |x, y| if (x, y) == (0, 1) { [1.0; 3] } else { [0.0; 3] });
        let weights = Weights::new(&map);
        let mut row = [0.0; 8];
        for (y, lit) in [(0, 0.0), (1, 1.0), (2, 1.0), (3, 0.0), (4, 0.0)] {
            weights.row(0, y, &mut row, &mut Vec::new());
            let unit = patches::solid_angle(8, 4, y) / 4.0;
            let expected = [1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0].map(|c| c * lit * unit);
            for (weight, expected) in row.iter().zip(expected) {
                assert!((weight - expected).abs() <= 1e-6 * expected, "{weight} {expected}");
            }
        }
    }

    #[test]
    fn the_weights_of_a_constant_map_are_its_solid_angles() {
        let map = Image::filled(5, 3, [2.0; 3]);
        let weights = Weights::new(&map);
        let mut sum = 0.0;
        for y in 0..weights.size().1 {
            let mut row = [0.0; 3];
            weights.row(2, y, &mut row, &mut Vec::new());
            sum += row.iter().sum::<f64>() / 3.0 * 5.0;
        }
        assert!((sum / (8.0 * std::f64::consts::PI) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn the_largest_and_the_smallest_radiance_keep_finite_positive_weights() {
        for value in [f32::MAX, f32::from_bits(1)] {
            let map = Image::filled(64, 32, [value; 3]);
            let mut row = [0.0; 64];
            Weights::new(&map).row(0, 0, &mut row, &mut Vec::new());
            assert!(row.iter().all(|w| w.is_finite() && *w > 0.0));
        }
    }
}
