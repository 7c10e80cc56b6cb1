//! Patches: the areas within which radiance is read smoothly, and the units of importance tables.
//!
//! Radiance is interpolated between texel centres: a patch is the rectangle between four of them; rows of
//! half height close the sphere at the poles. Down a patch, radiance is linear in the cosine of the polar
//! angle, that is in solid angle: so a patch's integral is its solid angle times the mean of its corners,
//! and directions are drawn with a density proportional to the interpolated importance. (Interpolation linear
//! in the angle, as other renderers use, differs by the share `pi / (8 height tan(theta))` of two texels'
//! difference: 0.08 % at 512 rows, halfway to the pole.)

use glam::Vec2;

use std::f64::consts::{PI, TAU};

/// Offset of patch edges from texel edges, in texels.
pub(crate) const SHIFT: f32 = 0.5;

/// A row of patches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PatchRow {
    /// Distance of the upper edge's cosine from that of the pole of the row's hemisphere, which keeps
    /// its digits near that pole.
    pub(crate) top: f32,
    /// The lower edge's distance less the upper one's; negative in the lower hemisphere.
    pub(crate) extent: f32,
    /// Steradians of one patch.
    pub(crate) solid_angle: f32,
}

/// The patches of a map.
#[derive(Debug, Clone)]
pub(crate) struct PatchRows {
    /// From the top.
    pub(crate) rows: Vec<PatchRow>,
}

impl PatchRows {
    /// The rows of a map of `width` x `height` texels.
    pub(crate) fn new(width: u32, height: u32) -> Self {
        let count = row_count(height);
        let rows = (0..count).map(|row| {
            let is_upper = is_upper(row, count);
            let distance = |edge| pole_distance(edge, height, is_upper);
            let (top, bottom) = (distance(row), distance(row + 1));
            let solid_angle = solid_angle(width, height, row) as f32;
            PatchRow { top: top as f32, extent: (bottom - top) as f32, solid_angle }
        });
        Self { rows: rows.collect() }
    }

    /// Sine and cosine of the polar angle at a place of a row, `down` in `[0,1]` of its extent.
    pub(crate) fn polar_angle(&self, row: u32, down: f32) -> (f32, f32) {
        let PatchRow { top, extent, .. } = self.rows[row as usize];
        let distance = top + down * extent;
        let sine = (distance * (2.0 - distance)).max(0.0).sqrt();
        let from_upper = is_upper(row, self.rows.len() as u32);
        (sine, if from_upper { 1.0 - distance } else { distance - 1.0 })
    }

    /// Position in a row, in `[0,1]` from its upper edge, of a polar angle given by its squared sine and its
    /// cosine.
    pub(crate) fn down(&self, row: u32, squared_sine: f32, cosine: f32) -> f32 {
        let PatchRow { top, extent, .. } = self.rows[row as usize];
        let near = squared_sine / (1.0 + cosine.abs());
        let from_upper = is_upper(row, self.rows.len() as u32);
        let distance = if (cosine >= 0.0) == from_upper { near } else { 2.0 - near };
        ((distance - top) / extent).clamp(0.0, 1.0)
    }
}

/// Number of rows of patches.
pub(crate) fn row_count(height: u32) -> u32 {
    height + 1
}

/// Exact steradians of a patch of a row.
pub(crate) fn solid_angle(width: u32, height: u32, row: u32) -> f64 {
    let is_upper = is_upper(row, row_count(height));
    let distance = |edge| pole_distance(edge, height, is_upper);
    TAU / f64::from(width) * (distance(row + 1) - distance(row)).abs()
}

/// Whether a row's cosines are stored as distances from the upper pole's.
fn is_upper(row: u32, count: u32) -> bool {
    2 * row < count
}

/// `1 - cos` of the angle between an edge of rows and a pole, without cancellation.
fn pole_distance(edge: u32, height: u32, from_upper: bool) -> f64 {
    let share = ((f64::from(edge) - f64::from(SHIFT)) / f64::from(height)).clamp(0.0, 1.0);
    2.0 * (0.5 * PI * if from_upper { share } else { 1.0 - share }).sin().powi(2)
}

/// A place in `[0,1]` with a density that is linear from `a` to `b` (not negative), from a uniform
/// number in `[0,1]`; uniform where both are 0.
pub(crate) fn sample_linear(a: f32, b: f32, u: f32) -> f32 {
    let sum = a + b;
    if sum <= 0.0 {
        return u;
    }
    // Shares of the sum where squares would be lost.
    let is_safe = sum > 1.0 / SAFE_TO_SQUARE && sum < SAFE_TO_SQUARE;
    let (a, b, sum) = if is_safe { (a, b, sum) } else { (a / sum, b / sum, 1.0) };
    let root = (a * a + u * ((b - a) * sum)).max(0.0).sqrt();
    (u * sum / (a + root).max(f32::MIN_POSITIVE)).min(1.0)
}

const SAFE_TO_SQUARE: f32 = 1e15;

/// A patch chosen by a table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PatchSample {
    /// Column.
    pub(crate) x: u32,
    /// Row.
    pub(crate) y: u32,
    /// The remainder of the random numbers, uniform in `[0,1]`^2.
    pub(crate) within: Vec2,
    /// Probability of the patch given the tile.
    pub(crate) probability: f32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_cover_the_sphere_and_find_their_own_places() {
        for (width, height) in [(1, 1), (2, 1), (4, 3), (64, 32), (16, 8192)] {
            let patches = PatchRows::new(width, height);
            let count = patches.rows.len() as u32;
            let sphere: f64 =
                (0..count).map(|row| f64::from(width) * solid_angle(width, height, row)).sum();
            assert!((sphere / (2.0 * TAU) - 1.0).abs() < 1e-12);
            for row in 0..count {
                for down in [0.0, 0.3, 0.9] {
                    let (sine, cosine) = patches.polar_angle(row, down);
                    assert!((sine.hypot(cosine) - 1.0).abs() < 1e-6);
                    let found = patches.down(row, sine * sine, cosine);
                    // In units of f32 at the distance from the pole.
                    let PatchRow { top, extent, .. } = patches.rows[row as usize];
                    let bound = 4.0 * f32::EPSILON * (1.0 + top / extent.abs());
                    assert!((found - down).abs() < bound, "{height} {row}: {down} {found}");
                }
            }
        }
    }

    #[test]
    fn linear_densities_are_followed_at_any_scale() {
        for scale in [1.0, 1e-30, 1e30] {
            for (a, b) in [(0.0, 1.0), (1.0, 0.0), (1.0, 1.0), (0.2, 3.0)] {
                for step in 0..=100 {
                    let u = step as f32 / 100.0;
                    let x = sample_linear(a * scale, b * scale, u);
                    let cumulative = (2.0 * a * x + (b - a) * x * x) / (a + b);
                    assert!((cumulative - u).abs() < 1e-5, "{a} {b} {scale}: {u} {cumulative}");
                }
            }
        }
        assert_eq!(sample_linear(0.0, 0.0, 0.25), 0.25);
    }
}
