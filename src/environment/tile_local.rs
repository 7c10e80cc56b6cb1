//! The default importance table: one exact integer table per tile.
//!
//! A tile's patches get integers that add up to just under 2^32, and their prefix sums are exact.
//! So the sums never fall, no lit patch is lost, and the probability of a patch is a quotient of
//! the very integers that are searched. It takes the same 4 bytes per patch as a 32-bit
//! summed-area table, and a map with a sun beside dim sky is as safe as an even one, because the
//! tiles do not share the 32 bits. The idea to quantise before adding up is our answer to the
//! rounded summed-area table of the talk, see [`super::summed_area`].

use std::ops::Range;

use glam::Vec2;
use rayon::prelude::*;

use super::patches::PatchSample;
use super::tiles::{TileGrid, TilePatches};
use super::weights::Weights;
use crate::huge_pages::zeros_on_huge_pages;
use crate::prefetch::prefetch_all;

/// Sums of a row that a search ends with: a cache line of them.
const GROUP: usize = 16;

/// Exact integer prefix sums, tile by tile.
#[derive(Debug, Clone)]
pub(crate) struct TileLocal {
    /// Tile after tile (see [`TileGrid::first_patch`]), row after row in a tile: sums along the
    /// row, this patch included. Wrapping cannot happen: a tile's total is below 2^32.
    row_sums: Vec<u32>,
    /// The last of every [`GROUP`] of `row_sums`, row after row of tiles in the same order: few enough to
    /// stay near the processor, so that a search waits for far memory once.
    group_sums: Vec<u32>,
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
        let group_sums = group_sums(&row_sums, grid);
        (Self { row_sums, group_sums, tile_sums }, energies)
    }

    /// Begins to choose a patch of the tile: a row by the second number and, by the first, some columns,
    /// among which [`Self::finish`] chooses; both are 64-bit fractions of one. Monotone in both. What the
    /// rest will read is fetched meanwhile. `None` if the tile is black.
    pub(crate) fn search(&self, grid: &TileGrid, tile: u32, u: [u64; 2]) -> Option<Search> {
        let patches = grid.patches(tile);
        let rows = self.rows_of(grid, tile);
        let total = rows[rows.len() - 1];
        if total == 0 {
            return None;
        }
        let row = Target::new(total, u[1]).find(rows, 0);
        // A row's total is known without reading its last sum.
        let target = Target::new(row.mass, u[0]);
        let groups = self.groups_of(grid, tile, row.index);
        let width = patches.width() as usize;
        let first = GROUP * groups.partition_point(target.is_past());
        let last = (first + GROUP).min(width);
        let sums_at = grid.first_patch(patches) + row.index * width;
        prefetch_all(&self.row_sums[sums_at + first..sums_at + last]);
        Some(Search {
            y: patches.y.start + row.index as u32,
            x: patches.x.start,
            group: first..last,
            sums_at,
            target,
            down: row.fraction,
            total,
        })
    }

    /// Chooses the patch that was searched for.
    pub(crate) fn finish(&self, search: &Search) -> PatchSample {
        let Range { start, end } = search.group;
        let column = search.target.find(&self.row_sums[search.sums_at..][..end], start);
        PatchSample {
            x: search.x + column.index as u32,
            y: search.y,
            within: Vec2::new(column.fraction, search.down),
            probability: column.mass as f32 / search.total as f32,
        }
    }

    /// Probability of [`Self::finish`] to choose this patch of the tile it lies in.
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

    /// Bytes of all arrays.
    pub(crate) fn memory_bytes(&self) -> usize {
        (self.row_sums.len() + self.group_sums.len() + self.tile_sums.len()) * size_of::<u32>()
    }

    /// Sums of a tile's rows.
    fn rows_of(&self, grid: &TileGrid, tile: u32) -> &[u32] {
        &self.tile_sums[first_row(grid, tile)..][..grid.patches(tile).height() as usize]
    }

    fn columns_of(&self, grid: &TileGrid, patches: &TilePatches, row: usize) -> &[u32] {
        let width = patches.width() as usize;
        &self.row_sums[grid.first_patch(patches) + row * width..][..width]
    }

    fn groups_of(&self, grid: &TileGrid, tile: u32, row: usize) -> &[u32] {
        let groups = groups_per_row(grid);
        &self.group_sums[(first_row(grid, tile) + row) * groups..][..groups]
    }
}

/// Where a tile's rows begin when those of all tiles are counted: rows of tiles lie one after another, and
/// each tile of one has as many rows as the others.
fn first_row(grid: &TileGrid, tile: u32) -> usize {
    let (patches, (columns, _)) = (grid.patches(tile), grid.size());
    let (before, height) = (patches.y.start as usize, patches.height() as usize);
    before * columns as usize + grid.column_of(tile) as usize * height
}

/// As many as the widest tile needs.
fn groups_per_row(grid: &TileGrid) -> usize {
    grid.widest().div_ceil(GROUP as u32) as usize
}

/// The last sum of each group of each row, tile after tile; after a row's last group, its total.
fn group_sums(row_sums: &[u32], grid: &TileGrid) -> Vec<u32> {
    let groups = groups_per_row(grid);
    let of_tile = |tile| {
        let patches = grid.patches(tile);
        let tile = &row_sums[grid.first_patch(patches)..][..patches.len()];
        let rows = tile.chunks_exact(patches.width() as usize);
        rows.flat_map(move |row| (1..=groups).map(|end| row[(GROUP * end).min(row.len()) - 1]))
    };
    (0..grid.count()).into_par_iter().flat_map_iter(of_tile).collect()
}

/// A patch that is being chosen.
#[derive(Debug, Clone)]
pub(crate) struct Search {
    y: u32,
    /// First column of the tile.
    x: u32,
    /// Columns of the tile, one of which it will be.
    group: Range<usize>,
    /// Where the row's sums begin.
    sums_at: usize,
    target: Target,
    down: f32,
    total: u32,
}

impl Search {
    /// Row and columns among which the patch will be.
    pub(crate) fn among(&self) -> (u32, Range<u32>) {
        (self.y, self.x + self.group.start as u32..self.x + self.group.end as u32)
    }
}

/// What is searched: a 64-bit fraction of a positive total.
#[derive(Debug, Clone, Copy)]
struct Target {
    whole: u32,
    part: u32,
}

/// Where a search ended.
struct Choice {
    index: usize,
    mass: u32,
    /// How far into the entry, in `[0,1]`.
    fraction: f32,
}

impl Target {
    fn new(total: u32, u: u64) -> Self {
        let target = u128::from(u) * u128::from(total);
        Self { whole: (target >> 64) as u32, part: (target >> 32) as u32 }
    }

    /// Whether the target lies past the entry that an inclusive sum belongs to.
    fn is_past(self) -> impl Fn(&u32) -> bool {
        move |sum| *sum <= self.whole
    }

    /// Finds the entry of inclusive prefix sums that holds it, which is not before `first`.
    fn find(self, sums: &[u32], first: usize) -> Choice {
        let index = first + sums[first..].partition_point(self.is_past());
        let before = if index == 0 { 0 } else { sums[index - 1] };
        let mass = sums[index] - before;
        let into = (self.whole - before) as f32 + self.part as f32 * (1.0 / 4_294_967_296.0);
        Choice { index, mass, fraction: (into / mass as f32).min(1.0) }
    }
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
            let u = (u64::MAX / 1000) * i + u64::MAX / 2000;
            let choice = Target::new(10, u).find(&sums, 0);
            assert!((0.0..=1.0).contains(&choice.fraction));
            assert!((choice.index, choice.fraction) > last);
            last = (choice.index, choice.fraction);
            counts[choice.index] += 1;
        }
        assert_eq!(counts, [0, 300, 0, 100, 600]);
    }
}
