//! Counters of learning: integers only, so that results do not depend on the order of paths.

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

use crate::prefetch::prefetch;

/// Fixed-point scale of one recorded weight: a weight of 1 adds this much.
///
/// A pass may record at most [`MAX_RECORDS_PER_PASS`] weights of at most [`MAX_WEIGHT`] each, so that
/// even if all fell into one counter it grows by less than 2^31 between two calls of
/// [`Counters::end_pass`], which halves a cell whose counters passed 2^31: no wrap, ever.
pub const WEIGHT_ONE: f32 = 256.0;
/// Maximum recorded weight; larger ones are clamped.
pub const MAX_WEIGHT: f32 = 4.0;
/// Bound on records between two calls of [`Counters::end_pass`].
pub const MAX_RECORDS_PER_PASS: u64 = (1 << 31) / (WEIGHT_ONE as u64 * MAX_WEIGHT as u64) - 1;

const NO_SLOT: u32 = u32::MAX;

/// Counts of one tile seen from one cell.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tally {
    /// Samples that fell into the tile.
    pub tries: f64,
    /// Sum of their weights.
    pub weight: f64,
}

/// Learning counters of all cells: a visit count for those without tile counters, and tile counters
/// for those that were visited, up to a memory budget.
///
/// A cell gets its tile counters at the end of the pass that first visited it, the most visited
/// first when the budget runs out: which cells they are depends on integer counts alone, never on
/// the threads.
#[derive(Debug)]
pub struct Counters {
    tile_count: u32,
    capacity: u32,
    visits: Vec<AtomicU32>,
    slot_of_cell: Vec<u32>,
    cell_of_slot: Vec<u32>,
    /// Tries and weight sum of each tile in each slot; see [`pair`].
    blocks: Vec<Box<[AtomicU64]>>,
}

impl Counters {
    /// Counters for `cell_count` cells over `tile_count` tiles within `budget_bytes`.
    pub fn new(cell_count: u32, tile_count: u32, budget_bytes: usize) -> Self {
        let fixed = cell_count as usize * 8;
        let slots = budget_bytes.saturating_sub(fixed) / Self::slot_bytes(tile_count);
        Self {
            tile_count,
            capacity: slots.min(cell_count as usize) as u32,
            visits: (0..cell_count).map(|_| AtomicU32::new(0)).collect(),
            slot_of_cell: vec![NO_SLOT; cell_count as usize],
            cell_of_slot: Vec::new(),
            blocks: Vec::new(),
        }
    }

    /// Bytes of one cell's tile counters.
    pub fn slot_bytes(tile_count: u32) -> usize {
        tile_count as usize * 8 + size_of::<Box<[AtomicU64]>>() + 4
    }

    /// Records one try in `cell`: a map sample that fell into `tile` with `weight` in
    /// `[0, MAX_WEIGHT]`, 0 when it was occluded. Safe to call from any thread.
    pub fn record(&self, cell: u32, tile: u32, weight: f32) {
        let slot = self.slot_of_cell[cell as usize];
        if slot == NO_SLOT {
            self.visits[cell as usize].fetch_add(1, Ordering::Relaxed);
            return;
        }
        let fixed = (weight.clamp(0.0, MAX_WEIGHT) * WEIGHT_ONE).round() as u32;
        self.blocks[slot as usize][tile as usize].fetch_add(pair(1, fixed), Ordering::Relaxed);
    }

    /// Prefetches the counters of this cell and tile for a later [`Self::record`]: a cache miss takes as long as a
    /// short ray.
    pub fn prefetch(&self, cell: u32, tile: u32) {
        let slot = self.slot_of_cell[cell as usize];
        if slot != NO_SLOT {
            prefetch(&self.blocks[slot as usize][tile as usize]);
        }
    }

    /// Visits of each cell, the slot of each cell (`u32::MAX` without one) and the words of each
    /// slot: the state from which a GPU continues to count.
    pub(crate) fn words(&self) -> (Vec<u32>, &[u32], Vec<u32>) {
        let visits = self.visits.iter().map(|word| word.load(Ordering::Relaxed)).collect();
        let pairs = self.blocks.iter().flat_map(|block| block.iter());
        (visits, &self.slot_of_cell, pairs.flat_map(parts).collect())
    }

    /// Numbers of words of visits and of blocks in [`Self::words`].
    pub(crate) fn word_counts(&self) -> (usize, usize) {
        (self.visits.len(), self.blocks.len() * 2 * self.tile_count as usize)
    }

    /// Replaces the state by continued counts of [`Self::words`].
    pub(crate) fn set_words(&self, visits: &[u32], blocks: &[u32]) {
        for (word, value) in self.visits.iter().zip(visits) {
            word.store(*value, Ordering::Relaxed);
        }
        let pairs = self.blocks.iter().flat_map(|block| block.iter());
        for (word, value) in pairs.zip(blocks.chunks_exact(2)) {
            word.store(pair(value[0], value[1]), Ordering::Relaxed);
        }
    }

    /// A copy as they are now.
    pub fn snapshot(&self) -> Self {
        let copy = |word: &AtomicU64| AtomicU64::new(word.load(Ordering::Relaxed));
        let copy_visits = |word: &AtomicU32| AtomicU32::new(word.load(Ordering::Relaxed));
        Self {
            tile_count: self.tile_count,
            capacity: self.capacity,
            visits: self.visits.iter().map(copy_visits).collect(),
            slot_of_cell: self.slot_of_cell.clone(),
            cell_of_slot: self.cell_of_slot.clone(),
            blocks: self.blocks.iter().map(|block| block.iter().map(copy).collect()).collect(),
        }
    }

    /// Ends a pass: newly visited cells get tile counters, counters past 2^31 are halved.
    pub fn end_pass(&mut self) {
        let free = self.capacity as usize - self.blocks.len();
        let mut fresh: Vec<(u32, u32)> = (0..self.visits.len() as u32)
            .filter(|&cell| self.slot_of_cell[cell as usize] == NO_SLOT)
            .map(|cell| (self.visits[cell as usize].load(Ordering::Relaxed), cell))
            .filter(|(visits, _)| *visits > 0)
            .collect();
        fresh.sort_unstable_by_key(|&(visits, cell)| (std::cmp::Reverse(visits), cell));
        self.blocks.reserve_exact(fresh.len().min(free));
        self.cell_of_slot.reserve_exact(fresh.len().min(free));
        for (_, cell) in fresh.into_iter().take(free) {
            self.slot_of_cell[cell as usize] = self.blocks.len() as u32;
            self.cell_of_slot.push(cell);
            self.blocks.push((0..self.tile_count).map(|_| AtomicU64::new(0)).collect());
        }
        for visits in &self.visits {
            visits.store(visits.load(Ordering::Relaxed).min(1 << 30), Ordering::Relaxed);
        }
        for block in &self.blocks {
            let is_full = |word| parts(word).into_iter().any(|counter| counter >= 1 << 31);
            if block.iter().any(is_full) {
                for word in block {
                    let [tries, weight] = parts(word);
                    word.store(pair(tries / 2, weight / 2), Ordering::Relaxed);
                }
            }
        }
    }

    /// Cells that have tile counters, in slot order.
    pub fn cells(&self) -> &[u32] {
        &self.cell_of_slot
    }

    /// Number of cells that were visited at all.
    pub fn visited_cells(&self) -> usize {
        self.visits.iter().filter(|v| v.load(Ordering::Relaxed) > 0).count()
    }

    /// Tries and weight sums (in units of a weight of 1) of a slot's tiles.
    pub fn tallies(&self, slot: usize) -> impl Iterator<Item = Tally> {
        self.blocks[slot].iter().map(|word| {
            let [tries, weight] = parts(word);
            Tally { tries: tries.into(), weight: f64::from(weight) / f64::from(WEIGHT_ONE) }
        })
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.visits.len() * 8
            + self.cell_of_slot.capacity() * 4
            + self.blocks.capacity() * size_of::<Box<[AtomicU64]>>()
            + self.blocks.iter().map(|b| b.len() * 8).sum::<usize>()
    }
}

/// Tries and fixed-point weight of a tile in one word, so that one addition counts both: neither
/// half overflows, see [`Counters`].
fn pair(tries: u32, weight: u32) -> u64 {
    u64::from(weight) << 32 | u64::from(tries)
}

/// Inverse of [`pair`].
fn parts(word: &AtomicU64) -> [u32; 2] {
    let word = word.load(Ordering::Relaxed);
    [word as u32, (word >> 32) as u32]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_most_visited_cells_win_the_budget_in_any_order() {
        let budget = 100 * 8 + 3 * Counters::slot_bytes(8);
        for order in [[5, 9, 9, 40, 40, 40, 7, 7], [7, 40, 9, 5, 40, 9, 7, 40]] {
            let mut counters = Counters::new(100, 8, budget);
            for cell in order {
                counters.record(cell, 0, 1.0);
            }
            counters.end_pass();
            assert_eq!(counters.cells(), &[40, 7, 9]);
            assert!(counters.memory_bytes() <= budget);
            counters.record(7, 3, 0.5);
            let tallies: Vec<Tally> = counters.tallies(1).collect();
            assert_eq!(tallies[3], Tally { tries: 1.0, weight: 0.5 });
            assert_eq!(tallies.iter().map(|t| t.tries).sum::<f64>(), 1.0);
        }
    }

    #[test]
    fn counters_are_halved_before_they_can_wrap() {
        let mut counters = Counters::new(1, 2, 1 << 20);
        counters.record(0, 0, 1.0);
        counters.end_pass();
        counters.blocks[0][1].store(pair(1000, 3 << 30), Ordering::Relaxed);
        counters.end_pass();
        let tally = counters.tallies(0).nth(1).expect("two tiles");
        assert_eq!(tally.tries, 500.0);
        assert_eq!(tally.weight, f64::from(3_u32 << 29) / f64::from(WEIGHT_ONE));
        let growth = MAX_RECORDS_PER_PASS * (MAX_WEIGHT * WEIGHT_ONE) as u64;
        assert!(growth < 1 << 31, "one pass cannot carry a halved counter past u32");
    }
}
