//! What a texel is worth to a sampler: the integral of importance over its solid angle, in f64.

use glam::Vec3;
use rayon::prelude::*;

use crate::color::importance;
use crate::image::Image;
use crate::math::texel_solid_angle;

use super::Lookup;

/// Computes texel weights row by row from the pixels, so that no full-size copy is needed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Weights<'a> {
    map: &'a Image,
    lookup: Lookup,
    /// [`importance`] is linear: these are its coefficients. In f64 nothing overflows or underflows.
    coefficients: [f64; 3],
}

impl<'a> Weights<'a> {
    pub(crate) fn new(map: &'a Image, lookup: Lookup) -> Self {
        let coefficients = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| f64::from(importance(axis)));
        Self { map, lookup, coefficients }
    }

    /// Weights of texels `first_x..first_x + out.len()` of row `y`: importance x steradian.
    ///
    /// With bilinear look-up, radiance over a texel is a mean of three texels in each axis: the
    /// interpolant's integral is the map filtered by `[1 6 1] / 8` in each axis (wrapped in u,
    /// clamped in v), hence every texel near a lit one has some weight. `scratch` is overwritten.
    pub(crate) fn row(&self, first_x: u32, y: u32, out: &mut [f64], scratch: &mut Vec<f64>) {
        let solid_angle = texel_solid_angle(self.map.width, self.map.height, y);
        match self.lookup {
            Lookup::Nearest => {
                let row = &self.pixel_row(y)[first_x as usize..];
                for (weight, pixel) in out.iter_mut().zip(row) {
                    *weight = solid_angle * self.importance(pixel);
                }
            }
            Lookup::Bilinear => {
                self.filtered_columns(first_x, y, out.len(), scratch);
                for (weight, near) in out.iter_mut().zip(scratch.windows(3)) {
                    *weight = solid_angle / 64.0 * (near[0] + 6.0 * near[1] + near[2]);
                }
            }
        }
    }

    /// Calls `f` with each whole row of weights from top to bottom; bands of rows are computed in
    /// parallel.
    pub(crate) fn for_each_row(&self, mut f: impl FnMut(&[f64])) {
        const BAND: u32 = 32;
        let width = self.map.width as usize;
        let mut band = vec![0.0; width * BAND as usize];
        for first_row in (0..self.map.height).step_by(BAND as usize) {
            let rows = BAND.min(self.map.height - first_row) as usize;
            band[..rows * width]
                .par_chunks_mut(width)
                .zip(first_row..first_row + rows as u32)
                .for_each_init(Vec::new, |scratch, (row, y)| self.row(0, y, row, scratch));
            band[..rows * width].chunks_exact(width).for_each(&mut f);
        }
    }

    /// Width and height of the map.
    pub(crate) fn size(&self) -> (u32, u32) {
        (self.map.width, self.map.height)
    }

    /// Importance filtered by `[1 6 1]` along v, for one column more on each side.
    fn filtered_columns(&self, first_x: u32, y: u32, columns: usize, out: &mut Vec<f64>) {
        let above = self.pixel_row(y.saturating_sub(1));
        let here = self.pixel_row(y);
        let below = self.pixel_row((y + 1).min(self.map.height - 1));
        let at = |x: usize| {
            self.importance(&above[x])
                + 6.0 * self.importance(&here[x])
                + self.importance(&below[x])
        };
        let (first, width) = (first_x as usize, self.map.width as usize);
        out.clear();
        out.push(at((first + width - 1) % width));
        out.extend((first..first + columns).map(at));
        out.push(at((first + columns) % width));
    }

    fn pixel_row(&self, y: u32) -> &'a [[f32; 3]] {
        let width = self.map.width as usize;
        &self.map.pixels[y as usize * width..][..width]
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
    fn a_lit_texel_lends_weight_to_its_neighbours_across_the_seam() {
        let map = Image::from_fn(8, 4, |x, y| if (x, y) == (0, 1) { [1.0; 3] } else { [0.0; 3] });
        let weights = Weights::new(&map, Lookup::Bilinear);
        let mut row = [0.0; 8];
        for (y, across) in [(0, 1.0), (1, 6.0), (2, 1.0), (3, 0.0)] {
            weights.row(0, y, &mut row, &mut Vec::new());
            let unit = texel_solid_angle(8, 4, y) / 64.0;
            let expected = [6.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0].map(|c| c * across * unit);
            for (weight, expected) in row.iter().zip(expected) {
                assert!((weight - expected).abs() <= 1e-6 * expected, "{weight} {expected}");
            }
        }
    }

    #[test]
    fn the_weights_of_a_constant_map_are_its_solid_angles() {
        let map = Image::filled(5, 3, [2.0; 3]);
        for lookup in [Lookup::Bilinear, Lookup::Nearest] {
            let mut sum = 0.0;
            for y in 0..3 {
                let mut row = [0.0; 3];
                Weights::new(&map, lookup).row(2, y, &mut row, &mut Vec::new());
                sum += row.iter().sum::<f64>() / 3.0 * 5.0;
            }
            assert!((sum / (8.0 * std::f64::consts::PI) - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn the_largest_and_the_smallest_radiance_keep_finite_positive_weights() {
        for value in [f32::MAX, f32::from_bits(1)] {
            let map = Image::filled(64, 32, [value; 3]);
            let mut row = [0.0; 64];
            Weights::new(&map, Lookup::Bilinear).row(0, 0, &mut row, &mut Vec::new());
            assert!(row.iter().all(|w| w.is_finite() && *w > 0.0));
        }
    }
}
