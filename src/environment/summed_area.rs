//! Summed-area tables over the whole map: the talk's u32 form and the f32 and f64 ones it is
//! measured against. Any rectangle of texels can be sampled by two binary searches.
//!
//! They are kept for comparison. The u32 form is an f64 table rounded corner by corner, as in the
//! talk (Atanasov et al., SIGGRAPH 2018 Talks): the error of every corner is the same half unit,
//! but a texel is the difference of four corners, so a dim texel can get no mass (it is then never
//! sampled) or a negative one. The searched sums then fall here and there, and the choice follows
//! the reported probability only nearly. Negative masses count as zero; nothing panics or loops.

use std::ops::Range;

use glam::DVec2;

use super::table::TexelSample;
use super::tiles::TileTexels;
use super::weights::Weights;

/// A corner's storage type; all three convert to f64 exactly.
pub(crate) trait Corner: Copy + Default + Into<f64> + Send + Sync {}
impl Corner for u32 {}
impl Corner for f32 {}
impl Corner for f64 {}

/// Sums of all texels left of and above each texel corner, `(width + 1) * (height + 1)` of them.
#[derive(Debug, Clone)]
pub(crate) struct SummedArea<T> {
    stride: usize,
    corners: Vec<T>,
    /// Importance x steradian of a unit of mass.
    unit: f64,
}

impl SummedArea<f64> {
    /// Sums in f64.
    pub(crate) fn build(weights: &Weights<'_>) -> Self {
        let mut table = Self::zero(weights, 1.0);
        let mut rows = table.corners.chunks_exact_mut(table.stride).skip(1);
        for_each_corner_row(weights, |corners| {
            if let Some(row) = rows.next() {
                row.copy_from_slice(corners);
            }
        });
        table
    }
}

impl SummedArea<u32> {
    /// Sums in f64, then maps `[0, total]` to the integers `[0, 2^32 - 1]`: the talk's table.
    pub(crate) fn build(weights: &Weights<'_>) -> Self {
        let total = total(weights);
        let mut table = Self::zero(weights, total / f64::from(u32::MAX));
        let mut rows = table.corners.chunks_exact_mut(table.stride).skip(1);
        for_each_corner_row(weights, |corners| {
            if let Some(row) = rows.next() {
                for (rounded, corner) in row.iter_mut().zip(corners) {
                    // 0 / 0 of a black map converts to 0.
                    *rounded = (corner / total * f64::from(u32::MAX)).round() as u32;
                }
            }
        });
        table
    }
}

impl SummedArea<f32> {
    /// Sums in f32 by the usual recurrence `w + left + above - diagonal`, of weights scaled to a
    /// mean of 1 so that nothing overflows.
    pub(crate) fn build(weights: &Weights<'_>) -> Self {
        let (width, height) = weights.size();
        let total = total(weights);
        let mean = total / (f64::from(width) * f64::from(height));
        let mut table = Self::zero(weights, if total > 0.0 { mean } else { 1.0 });
        let (stride, unit) = (table.stride, table.unit);
        let mut first = stride;
        weights.for_each_row(|row| {
            for (x, weight) in row.iter().enumerate() {
                let here = first + x + 1;
                table.corners[here] =
                    (weight / unit) as f32 + table.corners[here - 1] + table.corners[here - stride]
                        - table.corners[here - stride - 1];
            }
            first += stride;
        });
        table
    }
}

impl<T: Corner> SummedArea<T> {
    fn zero(weights: &Weights<'_>, unit: f64) -> Self {
        let (width, height) = weights.size();
        let stride = width as usize + 1;
        Self { stride, corners: vec![T::default(); stride * (height as usize + 1)], unit }
    }

    /// Energy of a rectangle, importance x steradian, never negative.
    pub(crate) fn energy(&self, texels: &TileTexels) -> f64 {
        (self.mass(&texels.x, &texels.y) * self.unit).max(0.0)
    }

    /// Chooses a texel of the rectangle: a row by `u.y`, then a column by `u.x`, both in `[0,1)`.
    /// `None` if the table has no mass where the search ends.
    pub(crate) fn sample(&self, texels: &TileTexels, u: DVec2) -> Option<TexelSample> {
        let row = search(&texels.y, u.y, |end| self.mass(&texels.x, &(texels.y.start..end)))?;
        let in_row = row.index..row.index + 1;
        let column = search(&texels.x, u.x, |end| self.mass(&(texels.x.start..end), &in_row))?;
        let probability = self.sample_probability(texels, column.index, row.index);
        (probability > 0.0).then_some(TexelSample {
            x: column.index,
            y: row.index,
            within: DVec2::new(column.fraction, row.fraction),
            probability,
        })
    }

    /// Probability of [`Self::sample`] to choose this texel of the rectangle, exact as far as the
    /// table's sums never fall.
    pub(crate) fn sample_probability(&self, texels: &TileTexels, x: u32, y: u32) -> f64 {
        let total = self.mass(&texels.x, &texels.y);
        let mass = self.mass(&(x..x + 1), &(y..y + 1));
        if total > 0.0 && mass > 0.0 { mass / total } else { 0.0 }
    }

    /// Mass of a rectangle, as the table has it: may be negative through rounding.
    pub(crate) fn mass(&self, x: &Range<u32>, y: &Range<u32>) -> f64 {
        let at =
            |x: u32, y: u32| -> f64 { self.corners[y as usize * self.stride + x as usize].into() };
        (at(x.end, y.end) - at(x.start, y.end)) - (at(x.end, y.start) - at(x.start, y.start))
    }

    /// Bytes of the table.
    pub(crate) fn memory_bytes(&self) -> usize {
        self.corners.len() * size_of::<T>()
    }
}

struct Choice {
    index: u32,
    /// How far into the entry, in `[0,1]`.
    fraction: f64,
}

/// Binary search for the entry of `range` where `sum_to(end)`, the sum of the entries before
/// `end`, passes `u` of the total. `None` if that entry has no mass.
fn search(range: &Range<u32>, u: f64, sum_to: impl Fn(u32) -> f64) -> Option<Choice> {
    let target = u * sum_to(range.end);
    let (mut first, mut last) = (range.start, range.end - 1);
    while first < last {
        let middle = first + (last - first) / 2;
        if sum_to(middle + 1) > target {
            last = middle;
        } else {
            first = middle + 1;
        }
    }
    let before = sum_to(first);
    let mass = sum_to(first + 1) - before;
    let fraction = ((target - before) / mass).clamp(0.0, 1.0);
    (mass > 0.0).then_some(Choice { index: first, fraction })
}

/// Calls `f` with the f64 sums at the lower corners of each row of texels, top to bottom.
fn for_each_corner_row(weights: &Weights<'_>, mut f: impl FnMut(&[f64])) {
    let mut corners = vec![0.0; weights.size().0 as usize + 1];
    weights.for_each_row(|row| {
        let mut along_row = 0.0;
        for (corner, weight) in corners[1..].iter_mut().zip(row) {
            along_row += weight;
            *corner += along_row;
        }
        f(&corners);
    });
}

/// The last corner of the f64 table.
fn total(weights: &Weights<'_>) -> f64 {
    let mut total = 0.0;
    for_each_corner_row(weights, |corners| total = corners[corners.len() - 1]);
    total
}
