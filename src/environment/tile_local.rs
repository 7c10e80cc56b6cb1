//! The default importance table: one exact integer table per tile.
//!
//! A tile's patches get integers that add up to just under 2^32, and their prefix sums are exact.
//! So the sums never fall, no lit patch is lost, and the probability of a patch is a quotient of
//! the very integers that are searched. It takes the same 4 bytes per patch as a 32-bit
//! summed-area table, and a map with a sun beside dim sky is as safe as an even one, because the
//! tiles do not share the 32 bits. The idea to quantise before adding up is our answer to the
//! rounded summed-area table of the talk, see [`super::summed_area`].

use glam::Vec2;
use rayon::prelude::*;

use super::patches::PatchSample;
use super::tiles::{TileGrid, TilePatches};
use super::weights::Weights;
use crate::huge_pages::zeros_on_huge_pages;
use crate::prefetch::prefetch_all;

/// Exact integer prefix sums, tile by tile.
#[derive(Debug, Clone)]
pub(crate) struct TileLocal {
    /// Tile after tile (see [`TileGrid::first_patch`]), row after row in a tile: sums along the
    /// row, this patch included. Wrapping cannot happen: a tile's total is below 2^32.
    row_sums: Vec<u32>,
    /// Per tile: sums over whole rows, this row included; [`Self::first_row`] finds a tile's.
    tile_sums: Vec<u32>,
}

impl TileLocal {
    /// Builds the table and the tiles' energies (importance x steradian, f64).
    pub(crate) fn build(weights: &Weights<'_>, grid: &TileGrid) -> (Self, Vec<f64>) {
        let tiles: Vec<TilePatches> =
            (0..grid.count()).map(|tile| grid.patches(tile).clone()).collect();
        let mut row_sums = zeros_on_huge_pages(tiles.iter().map(TilePatches::len).sum());
        let mut tile_sums = vec![0; tiles.iter().map(|t| t.height() as usize).sum()];
        let mut energies = vec![0.0; tiles.len()];

        let (mut row_rest, mut tile_rest) = (&mut row_sums[..], &mut tile_sums[..]);
        let mut jobs = Vec::with_capacity(tiles.len());
        for (patches, energy) in tiles.into_iter().zip(&mut energies) {
            let (row_part, rest) = row_rest.split_at_mut(patches.len());
            row_rest = rest;
            let (tile_part, rest) = tile_rest.split_at_mut(patches.height() as usize);
            tile_rest = rest;
            jobs.push((patches, row_part, tile_part, energy));
        }
        jobs.into_par_iter().for_each_init(
            || (Vec::new(), Vec::new()),
            |(tile_weights, scratch), (patches, row_sums, tile_sums, energy)| {
                fill_weights(weights, &patches, tile_weights, scratch);
                *energy = tile_weights.iter().sum();
                quantise(tile_weights, *energy, patches.width(), row_sums, tile_sums);
            },
        );
        (Self { row_sums, tile_sums }, energies)
    }

    /// Chooses a patch of the tile: first a row by the second number, then a column by the first, both
    /// 64-bit fractions of one. Monotone in both. `None` if the tile is black. The row is told as soon
    /// as it is known, for memory to be fetched while the column is searched.
    pub(crate) fn sample(
        &self,
        grid: &TileGrid,
        tile: u32,
        u: [u64; 2],
        expect_row: impl Fn(u32),
    ) -> Option<PatchSample> {
        let patches = grid.patches(tile);
        let rows = self.rows_of(grid, tile);
        let total = rows[rows.len() - 1];
        if total == 0 {
            return None;
        }
        let row = choose(rows, total, u[1]);
        let columns = self.columns_of(grid, patches, row.index);
        // A row's total is known without reading its last sum.
        prefetch_all(columns);
        expect_row(patches.y.start + row.index as u32);
        let column = choose(columns, row.mass, u[0]);
        Some(PatchSample {
            x: patches.x.start + column.index as u32,
            y: patches.y.start + row.index as u32,
            within: Vec2::new(column.fraction, row.fraction),
            probability: column.mass as f32 / total as f32,
        })
    }

    /// Probability of [`Self::sample`] to choose this patch of the tile it lies in.
    pub(crate) fn sample_probability(&self, grid: &TileGrid, tile: u32, x: u32, y: u32) -> f64 {
        let patches = grid.patches(tile);
        let rows = self.rows_of(grid, tile);
        let total = rows[rows.len() - 1];
        if total == 0 {
            return 0.0;
        }
        let columns = self.columns_of(grid, patches, (y - patches.y.start) as usize);
        let column = (x - patches.x.start) as usize;
        let before = if column == 0 { 0 } else { columns[column - 1] };
        f64::from(columns[column] - before) / f64::from(total)
    }

    /// Sums along the rows of tiles, and down the tiles.
    pub(crate) fn sums(&self) -> [&[u32]; 2] {
        [&self.row_sums, &self.tile_sums]
    }

    /// Bytes of both arrays.
    pub(crate) fn memory_bytes(&self) -> usize {
        (self.row_sums.len() + self.tile_sums.len()) * size_of::<u32>()
    }

    /// Rows of tiles lie one after another, and each tile of one has as many rows as the others.
    fn rows_of(&self, grid: &TileGrid, tile: u32) -> &[u32] {
        let (patches, (columns, _)) = (grid.patches(tile), grid.size());
        let (before, height) = (patches.y.start as usize, patches.height() as usize);
        let first = before * columns as usize + grid.column_of(tile) as usize * height;
        &self.tile_sums[first..][..height]
    }

    fn columns_of(&self, grid: &TileGrid, patches: &TilePatches, row: usize) -> &[u32] {
        let width = patches.width() as usize;
        &self.row_sums[grid.first_patch(patches) + row * width..][..width]
    }
}

/// Where a search ended.
struct Choice {
    index: usize,
    mass: u32,
    /// How far into the entry, in `[0,1]`.
    fraction: f32,
}

/// Finds the entry of inclusive prefix sums that holds a 64-bit fraction of their (positive) total.
fn choose(sums: &[u32], total: u32, u: u64) -> Choice {
    let target = u128::from(u) * u128::from(total);
    let (whole, part) = ((target >> 64) as u32, (target >> 32) as u32);
    let index = sums.partition_point(|&sum| sum <= whole);
    let before = if index == 0 { 0 } else { sums[index - 1] };
    let mass = sums[index] - before;
    let into = (whole - before) as f32 + part as f32 * (1.0 / 4_294_967_296.0);
    Choice { index, mass, fraction: (into / mass as f32).min(1.0) }
}

fn fill_weights(
    weights: &Weights<'_>,
    patches: &TilePatches,
    out: &mut Vec<f64>,
    scratch: &mut Vec<f64>,
) {
    out.clear();
    out.resize(patches.len(), 0.0);
    for (row, y) in out.chunks_exact_mut(patches.width() as usize).zip(patches.y.clone()) {
        weights.row(patches.x.start, y, row, scratch);
    }
}

/// Turns weights into integers, at least 1 where there is any, and adds them up.
fn quantise(weights: &[f64], energy: f64, width: u32, row_sums: &mut [u32], tile_sums: &mut [u32]) {
    if energy <= 0.0 {
        return; // Black: the sums are zero already.
    }
    // Raising to 1 adds at most one per patch; a second one covers the rounding of `energy`, which
    // is below 2^-53 per patch relative to a total below 2^32.
    let total_mass = f64::from(u32::MAX) - 2.0 * weights.len() as f64;
    let width = width as usize;
    let mut tile_sum = 0_u32;
    for ((weights, sums), total) in
        weights.chunks_exact(width).zip(row_sums.chunks_exact_mut(width)).zip(tile_sums)
    {
        let mut row_sum = 0_u32;
        for (weight, sum) in weights.iter().zip(sums) {
            row_sum +=
                if *weight > 0.0 { ((weight / energy * total_mass) as u32).max(1) } else { 0 };
            *sum = row_sum;
        }
        tile_sum += row_sum;
        *total = tile_sum;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_integers_of_a_tile_never_overflow_and_never_lose_a_lit_patch() {
        for weights in [vec![1.0; 4096], vec![1e-300, 1e300, 0.0, 1e-300], vec![5e-324; 9]] {
            let (mut rows, mut totals) = (vec![0; weights.len()], vec![0]);
            let energy = weights.iter().sum();
            quantise(&weights, energy, weights.len() as u32, &mut rows, &mut totals);
            let mut before = 0;
            for (sum, weight) in rows.iter().zip(&weights) {
                assert_eq!(sum - before > 0, *weight > 0.0, "{before} -> {sum}");
                before = *sum;
            }
            assert_eq!(totals[0], before);
        }
    }

    #[test]
    fn the_search_covers_the_unit_interval_in_order() {
        let sums = [0, 3, 3, 4, 10];
        let mut counts = [0; 5];
        let mut last = (0, 0.0);
        for i in 0..1000 {
            let choice = choose(&sums, 10, (u64::MAX / 1000) * i + u64::MAX / 2000);
            assert!((0.0..=1.0).contains(&choice.fraction));
            assert!((choice.index, choice.fraction) > last);
            last = (choice.index, choice.fraction);
            counts[choice.index] += 1;
        }
        assert_eq!(counts, [0, 300, 0, 100, 600]);
    }
}
