//! The default importance table: one exact integer table per tile.
//!
//! A tile's patches get integers that add up to just under 2^32, and their prefix sums are exact.
//! So the sums never decrease, no lit patch is lost, and the probability of a patch is a quotient of
//! the integers that are searched. It takes the same 4 bytes per patch as a 32-bit
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
use crate::prefetch::prefetch;

/// Entries in a group of sums: a cache line. A search ends in one group.
const GROUP: usize = 16;

/// Exact integer prefix sums, tile by tile.
#[derive(Debug, Clone)]
pub(crate) struct TileLocal {
    /// The place of each tile's sums: all data that a search needs about a tile, in a cache line.
    places: Vec<Place>,
    /// Tile after tile (see [`TileGrid::first_patch`]), row after row in a tile: sums along the
    /// row, this patch included. Wrapping cannot happen: a tile's total is below 2^32.
    row_sums: Vec<u32>,
    /// Coarse index of `tile_sums`, by row of tiles in the same order. It is small enough to stay in the
    /// processor's cache, so that a search waits for main memory once.
    row_groups: Groups,
    /// Per tile: sums over whole rows, this row included.
    tile_sums: Vec<u32>,
    /// Coarse index of `row_sums`, tile after tile.
    tile_groups: Groups,
}

/// Coarse index: the last sum of every [`GROUP`] entries of each searched run, the same number for each run;
/// after a run's last group, its total.
#[derive(Debug, Clone)]
struct Groups {
    lasts: Vec<u32>,
    per_run: usize,
}

/// The place of a tile's patches and of its sums.
#[derive(Debug, Clone, Copy)]
struct Place {
    /// Its first patch's column and row.
    corner: [u32; 2],
    /// Patches a row, and rows.
    size: [u32; 2],
    /// The first of its `tile_sums`; rows of tiles lie one after another there.
    first_row: usize,
    /// The first of its `row_sums`.
    first_patch: usize,
    /// The last of its `tile_sums`.
    total: u32,
}

impl TileLocal {
    /// Builds the table and the tiles' energies (importance x steradian, f64).
    pub(crate) fn build(weights: &Weights<'_>, grid: &TileGrid) -> (Self, Vec<f64>) {
        let tiles: Vec<TilePatches> =
            (0..grid.count()).map(|tile| grid.patches(tile).clone()).collect();
        let mut row_sums = zeros_on_huge_pages(tiles.iter().map(TilePatches::len).sum());
        let mut tile_sums = vec![0; tiles.iter().map(|tile| tile.y.len()).sum()];
        let mut energies = vec![0.0; tiles.len()];

        let (mut row_rest, mut tile_rest) = (&mut row_sums[..], &mut tile_sums[..]);
        let mut jobs = Vec::with_capacity(tiles.len());
        for (patches, energy) in tiles.into_iter().zip(&mut energies) {
            let row_part = row_rest.split_off_mut(..patches.len()).unwrap_or_default();
            let tile_part = tile_rest.split_off_mut(..patches.y.len());
            jobs.push((patches, row_part, tile_part.unwrap_or_default(), energy));
        }
        jobs.into_par_iter().for_each_init(
            || (Vec::new(), Vec::new()),
            |(tile_weights, scratch), (patches, row_sums, tile_sums, energy)| {
                tile_weights.clear();
                tile_weights.resize(patches.len(), 0.0);
                let rows = tile_weights.chunks_exact_mut(patches.x.len());
                for (row, y) in rows.zip(patches.y.clone()) {
                    weights.row(patches.x.start, y, row, scratch);
                }
                *energy = tile_weights.iter().sum();
                quantise(tile_weights, *energy, row_sums, tile_sums);
            },
        );
        let places = places(&tile_sums, grid);
        let row_runs = places.par_iter().flat_map_iter(|place| {
            let length = place.size[0] as usize;
            row_sums[place.first_patch..][..length * place.size[1] as usize].chunks_exact(length)
        });
        let longest = |axis: usize| places.iter().map(|place| place.size[axis]).max();
        let row_groups = Groups::of(row_runs, longest(0));
        let tile_runs = places.par_iter().map(|place| place.rows(&tile_sums));
        let tile_groups = Groups::of(tile_runs, longest(1));
        (Self { places, row_sums, row_groups, tile_sums, tile_groups }, energies)
    }

    /// Begins to choose a patch of the tile: a row by the second number and a group of columns by the first, in
    /// which [`Self::finish`] chooses one. Both numbers are 64-bit fractions of one; the choice is monotone in
    /// both. Prefetches the sums that `finish` reads. `None` if the tile is black.
    #[inline]
    pub(crate) fn search(&self, tile: u32, u: [u64; 2]) -> Option<Search> {
        let place = &self.places[tile as usize];
        if place.total == 0 {
            return None;
        }
        let target = Target::new(place.total, u[1]);
        let (first, before) = self.tile_groups.find(tile as usize, target);
        let rows = &place.rows(&self.tile_sums)[first..];
        let row = target.find(&rows[..GROUP.min(rows.len())], before);
        let row_index = first + row.index;
        // A row's total is known without reading its last sum.
        let target = Target::new(row.mass, u[0]);
        let (first, before) = self.row_groups.find(place.first_row + row_index, target);
        let width = place.size[0] as usize;
        let sums = place.first_patch + row_index * width + first;
        let length = GROUP.min(width - first);
        prefetch(&self.row_sums[sums]);
        prefetch(&self.row_sums[sums + length - 1]);
        Some(Search {
            row: place.corner[1] + row_index as u32,
            column: place.corner[0] + first as u32,
            length: length as u32,
            sums,
            before,
            target,
            down: row.fraction,
            total: place.total,
        })
    }

    /// Completes the choice that [`Self::search`] began.
    #[inline]
    pub(crate) fn finish(&self, search: &Search) -> PatchSample {
        let sums = &self.row_sums[search.sums..][..search.length as usize];
        let column = search.target.find(sums, search.before);
        let within = Vec2::new(column.fraction, search.down);
        let probability = column.mass as f32 / search.total as f32;
        PatchSample { x: search.column + column.index as u32, y: search.row, within, probability }
    }

    /// Probability of [`Self::finish`] to choose this patch of the tile.
    pub(crate) fn sample_probability(&self, tile: u32, x: u32, y: u32) -> f64 {
        let place = &self.places[tile as usize];
        if place.total == 0 {
            return 0.0;
        }
        let width = place.size[0] as usize;
        let row = (y - place.corner[1]) as usize;
        let columns = &self.row_sums[place.first_patch + row * width..][..width];
        let column = (x - place.corner[0]) as usize;
        let before = if column == 0 { 0 } else { columns[column - 1] };
        f64::from(columns[column] - before) / f64::from(place.total)
    }

    /// Sums along the rows of tiles, and down the tiles.
    pub(crate) fn sums(&self) -> [&[u32]; 2] {
        [&self.row_sums, &self.tile_sums]
    }

    /// Bytes of all arrays.
    pub(crate) fn memory_bytes(&self) -> usize {
        let groups = self.row_groups.lasts.len() + self.tile_groups.lasts.len();
        let sums = self.row_sums.len() + self.tile_sums.len() + groups;
        sums * size_of::<u32>() + size_of_val(&self.places[..])
    }
}

impl Place {
    /// Sums of the tile's rows.
    fn rows<'a>(&self, tile_sums: &'a [u32]) -> &'a [u32] {
        &tile_sums[self.first_row..][..self.size[1] as usize]
    }
}

impl Groups {
    /// The index of runs of sums; `longest` is the longest run's number of entries.
    fn of<'a>(runs: impl ParallelIterator<Item = &'a [u32]>, longest: Option<u32>) -> Self {
        let per_run = longest.unwrap_or(0).div_ceil(GROUP as u32) as usize;
        let ends = (1..=per_run).map(|end| GROUP * end);
        let lasts_of = |run: &'a [u32]| ends.clone().map(|end| run[end.min(run.len()) - 1]);
        Self { lasts: runs.flat_map_iter(lasts_of).collect(), per_run }
    }

    /// The first entry of the group that holds the target, within its run, and the sum before that entry.
    #[inline]
    fn find(&self, run: usize, target: Target) -> (usize, u32) {
        let lasts = &self.lasts[run * self.per_run..][..self.per_run];
        let group = lasts.partition_point(target.is_past());
        (GROUP * group, if group == 0 { 0 } else { lasts[group - 1] })
    }
}

fn places(tile_sums: &[u32], grid: &TileGrid) -> Vec<Place> {
    let (columns, _) = grid.size();
    let place = |tile: u32| {
        let patches = grid.patches(tile);
        // Each tile of a row of them has as many rows as the others.
        let before = patches.y.start as usize * columns as usize;
        let first_row = before + (tile % columns) as usize * patches.y.len();
        let corner = [patches.x.start, patches.y.start];
        let size = [&patches.x, &patches.y].map(|range| range.len() as u32);
        let first_patch = grid.first_patch(patches);
        let total = tile_sums[first_row + patches.y.len() - 1];
        Place { corner, size, first_row, first_patch, total }
    };
    (0..grid.count()).map(place).collect()
}

/// A patch whose row and group of columns are chosen.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Search {
    row: u32,
    /// First column of the group, and the number of its columns.
    column: u32,
    length: u32,
    /// Index of their first sum.
    sums: usize,
    /// The sum before them.
    before: u32,
    target: Target,
    down: f32,
    total: u32,
}

impl Search {
    /// Row and columns of the group.
    pub(crate) fn among(&self) -> (u32, Range<u32>) {
        (self.row, self.column..self.column + self.length)
    }
}

/// The target of a search: a 64-bit fraction of a positive total.
#[derive(Debug, Clone, Copy, Default)]
struct Target {
    whole: u32,
    part: u32,
}

/// The entry in which a search ended.
struct Choice {
    index: usize,
    mass: u32,
    /// Position within the entry, in `[0,1]`.
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

    /// Finds the entry of inclusive prefix sums that holds it, given the sum before them.
    #[inline]
    fn find(self, sums: &[u32], before: u32) -> Choice {
        let index = sums.partition_point(self.is_past());
        let before = if index == 0 { before } else { sums[index - 1] };
        let mass = sums[index] - before;
        let into = (self.whole - before) as f32 + self.part as f32 * (1.0 / 4_294_967_296.0);
        Choice { index, mass, fraction: (into / mass as f32).min(1.0) }
    }
}

/// Rounds weights to integers, positive ones to at least 1, and computes their prefix sums.
fn quantise(weights: &[f64], energy: f64, row_sums: &mut [u32], tile_sums: &mut [u32]) {
    if energy <= 0.0 {
        return; // Black: the sums are zero already.
    }
    // Raising to 1 adds at most one per patch; a second one covers the rounding of `energy`, which
    // is below 2^-53 per patch relative to a total below 2^32.
    let total_mass = f64::from(u32::MAX) - 2.0 * weights.len() as f64;
    let width = weights.len() / tile_sums.len();
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
            quantise(&weights, energy, &mut rows, &mut totals);
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
