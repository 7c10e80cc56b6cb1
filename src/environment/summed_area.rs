//! Summed-area tables over the whole map: the talk's u32 form and, to compare with it, f32 and f64 forms. Any rectangle of patches can be sampled by two binary searches.
//!
//! They are kept for comparison. The u32 form is an f64 table rounded corner by corner, as in the
//! talk (Atanasov et al., SIGGRAPH 2018 Talks): the error of every corner is the same half unit,
//! but a patch is the difference of four corners, so a dim patch can get no mass (it is then never
//! sampled) or a negative one. The searched sums then decrease in places, and the choice only approximately
//! follows the reported probability. Negative masses count as zero; nothing panics or loops.

use std::ops::Range;

use glam::DVec2;

use super::patches::PatchSample;
use super::tiles::TilePatches;
use super::weights::Weights;

/// Sums at the corners of patches in their stored format; all convert to f64 exactly.
#[derive(Debug)]
enum Corners {
    U32(Vec<u32>),
    F32(Vec<f32>),
    F64(Vec<f64>),
}

/// Sums of all patches left of and above each patch corner, `(width + 1) * (height + 1)` of them: a table from
/// which any rectangle of patches can be sampled.
#[derive(Debug)]
pub(crate) struct SummedArea {
    stride: usize,
    corners: Corners,
    /// Importance x steradian of a unit of mass.
    unit: f64,
}

impl SummedArea {
    /// Sums in f64, row by row of corners.
    pub(crate) fn in_f64(weights: &Weights<'_>) -> Self {
        let corners = Corners::F64(stored(weights, |sum| sum));
        Self { stride: stride(weights), corners, unit: 1.0 }
    }

    /// Sums in f64, then maps `[0, total]` to the integers `[0, 2^32 - 1]`: the talk's table.
    pub(crate) fn in_u32(weights: &Weights<'_>) -> Self {
        let (total, largest) = (total(weights), f64::from(u32::MAX));
        // 0 / 0 of a black map converts to 0.
        let rounded = |sum: f64| (sum / total * largest).round() as u32;
        let corners = Corners::U32(stored(weights, rounded));
        Self { stride: stride(weights), corners, unit: total / largest }
    }

    /// Sums in f32 by the usual recurrence `w + left + above - diagonal`, of weights scaled to a
    /// mean of 1 so that nothing overflows.
    pub(crate) fn in_f32(weights: &Weights<'_>) -> Self {
        let (width, height) = weights.size();
        let total = total(weights);
        let unit = if total > 0.0 { total / (f64::from(width) * f64::from(height)) } else { 1.0 };
        let (stride, mut corners) = (stride(weights), zero::<f32>(weights));
        let mut first = stride;
        weights.for_each_row(|row| {
            for (x, weight) in row.iter().enumerate() {
                let here = first + x + 1;
                corners[here] = (weight / unit) as f32 + corners[here - 1] + corners[here - stride]
                    - corners[here - stride - 1];
            }
            first += stride;
        });
        Self { stride, corners: Corners::F32(corners), unit }
    }

    /// Energy of a rectangle, importance x steradian, never negative.
    pub(crate) fn energy(&self, patches: &TilePatches) -> f64 {
        (self.mass(&patches.x, &patches.y) * self.unit).max(0.0)
    }

    /// Chooses a patch of the rectangle: a row by `u.y`, then a column by `u.x`, both in `[0,1)`.
    /// `None` if the table has no mass where the search ends.
    pub(crate) fn sample(&self, patches: &TilePatches, u: DVec2) -> Option<PatchSample> {
        let row = search(&patches.y, u.y, |end| self.mass(&patches.x, &(patches.y.start..end)))?;
        let in_row = row.index..row.index + 1;
        let column = search(&patches.x, u.x, |end| self.mass(&(patches.x.start..end), &in_row))?;
        let probability = self.sample_probability(patches, column.index, row.index);
        (probability > 0.0).then_some(PatchSample {
            x: column.index,
            y: row.index,
            within: DVec2::new(column.fraction, row.fraction).as_vec2(),
            probability: probability as f32,
        })
    }

    /// Probability of [`Self::sample`] to choose this patch of the rectangle; exact if the table's sums never
    /// decrease.
    pub(crate) fn sample_probability(&self, patches: &TilePatches, x: u32, y: u32) -> f64 {
        let total = self.mass(&patches.x, &patches.y);
        let mass = self.mass(&(x..x + 1), &(y..y + 1));
        if total > 0.0 && mass > 0.0 { mass / total } else { 0.0 }
    }

    /// Actual probability of [`Self::sample`] to end in each row of the rectangle.
    pub(crate) fn row_distribution(&self, patches: &TilePatches) -> Vec<f64> {
        let sum = |y| self.mass(&patches.x, &(patches.y.start..y + 1));
        search_distribution(&patches.y.clone().map(sum).collect::<Vec<_>>())
    }

    /// Actual probability of [`Self::sample`] to end in each column, given row `y`.
    pub(crate) fn column_distribution(&self, patches: &TilePatches, y: u32) -> Vec<f64> {
        let sum = |x| self.mass(&(patches.x.start..x + 1), &(y..y + 1));
        search_distribution(&patches.x.clone().map(sum).collect::<Vec<_>>())
    }

    /// Mass of a rectangle in the table; rounding may make it negative.
    pub(crate) fn mass(&self, x: &Range<u32>, y: &Range<u32>) -> f64 {
        let at = |x: u32, y: u32| {
            let index = y as usize * self.stride + x as usize;
            match &self.corners {
                Corners::U32(corners) => f64::from(corners[index]),
                Corners::F32(corners) => f64::from(corners[index]),
                Corners::F64(corners) => corners[index],
            }
        };
        (at(x.end, y.end) - at(x.start, y.end)) - (at(x.end, y.start) - at(x.start, y.start))
    }

    /// Bytes of the table.
    pub(crate) fn memory_bytes(&self) -> usize {
        match &self.corners {
            Corners::U32(corners) => size_of_val(&corners[..]),
            Corners::F32(corners) => size_of_val(&corners[..]),
            Corners::F64(corners) => size_of_val(&corners[..]),
        }
    }
}

/// Corners of a row.
fn stride(weights: &Weights<'_>) -> usize {
    weights.size().0 as usize + 1
}

fn zero<T: Clone + Default>(weights: &Weights<'_>) -> Vec<T> {
    vec![T::default(); stride(weights) * (weights.size().1 as usize + 1)]
}

/// The f64 sums at all corners of patches, each as `store` makes it.
fn stored<T: Clone + Default>(weights: &Weights<'_>, store: impl Fn(f64) -> T) -> Vec<T> {
    let mut corners = zero(weights);
    let mut rows = corners.chunks_exact_mut(stride(weights)).skip(1);
    for_each_corner_row(weights, |sums| {
        if let Some(row) = rows.next() {
            row.iter_mut().zip(sums).for_each(|(corner, sum)| *corner = store(*sum));
        }
    });
    corners
}

struct Choice {
    index: u32,
    /// Position within the entry, in `[0,1]`.
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

/// Actual probability of [`search`] to end at each entry of these inclusive sums. Each comparison cuts the
/// interval of `u` that leads to an entry, so this is exact even where the sums decrease.
fn search_distribution(sums: &[f64]) -> Vec<f64> {
    fn descend(sums: &[f64], first: usize, last: usize, [low, high]: [f64; 2], out: &mut [f64]) {
        if high <= low {
            return;
        }
        if first == last {
            let before = if first == 0 { 0.0 } else { sums[first - 1] };
            if sums[first] > before {
                out[first] = high - low;
            }
            return;
        }
        let middle = first + (last - first) / 2;
        descend(sums, first, middle, [low, high.min(sums[middle])], out);
        descend(sums, middle + 1, last, [low.max(sums[middle]), high], out);
    }
    let mut distribution = vec![0.0; sums.len()];
    let total = sums[sums.len() - 1];
    descend(sums, 0, sums.len() - 1, [0.0, total], &mut distribution);
    if total > 0.0 {
        distribution.iter_mut().for_each(|probability| *probability /= total);
    }
    distribution
}

/// Calls `f` with the f64 sums at the lower corners of each row of patches, top to bottom.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Image;

    #[test]
    fn the_distribution_of_a_search_is_that_of_its_outcomes_even_where_sums_fall() {
        for sums in [vec![1.0, 3.0, 6.0, 10.0, 12.0], vec![3.0, 2.0, 5.0, 4.0, 4.0, 9.0, 8.0]] {
            let distribution = search_distribution(&sums);
            let sum_to = |end: u32| if end == 0 { 0.0 } else { sums[end as usize - 1] };
            let mut counts = vec![0.0; sums.len()];
            const STEPS: u32 = 100_000;
            for step in 0..STEPS {
                let u = (f64::from(step) + 0.5) / f64::from(STEPS);
                if let Some(choice) = search(&(0..sums.len() as u32), u, sum_to) {
                    counts[choice.index as usize] += 1.0 / f64::from(STEPS);
                }
            }
            for (count, probability) in counts.iter().zip(&distribution) {
                assert!((count - probability).abs() < 1e-4, "{counts:?} {distribution:?}");
            }
        }
    }

    #[test]
    fn the_distribution_of_a_table_is_that_of_its_samples_where_patches_are_about_one_unit() {
        let map = Image::from_fn(64, 32, |x, y| {
            let sky = 0.1 + ((x * 7919 + y * 104_729) % 97) as f32 / 97.0;
            if (x, y) == (20, 10) { [1e10; 3] } else { [sky; 3] }
        });
        let table = SummedArea::in_u32(&Weights::new(&map));
        let sky = TilePatches { x: 10..40, y: 12..21 };
        let mut expected = Vec::new();
        for (row, y) in table.row_distribution(&sky).into_iter().zip(sky.y.clone()) {
            expected
                .extend(table.column_distribution(&sky, y).into_iter().map(|column| row * column));
        }
        let falls = sky.y.clone().flat_map(|y| sky.x.clone().map(move |x| (x, y)));
        assert!(falls.filter(|(x, y)| table.mass(&(*x..x + 1), &(*y..y + 1)) < 0.0).count() > 5);

        let mut observed = vec![0.0; expected.len()];
        const SIDE: u32 = 1000;
        for i in 0..SIDE * SIDE {
            let u = DVec2::new(f64::from(i % SIDE) + 0.5, f64::from(i / SIDE) + 0.5);
            if let Some(patch) = table.sample(&sky, u / f64::from(SIDE)) {
                let row = (patch.y - sky.y.start) as usize;
                observed[row * sky.x.len() + (patch.x - sky.x.start) as usize] +=
                    1.0 / f64::from(SIDE * SIDE);
            }
        }
        for (observed, expected) in observed.iter().zip(&expected) {
            assert!((observed - expected).abs() < 5e-4, "{observed} {expected}");
        }
    }
}
