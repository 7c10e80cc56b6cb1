//! What learning counts: integers only, so that the result depends on no order.

use std::sync::atomic::{AtomicU32, Ordering};

/// Fixed-point scale of one recorded weight: a weight of 1 adds this much.
///
/// A pass may record at most [`MAX_RECORDS_PER_PASS`] weights of at most [`MAX_WEIGHT`] each, so that
/// even if all fell into one counter it grows by less than 2^31 between two calls of
/// [`Counters::end_pass`], which halves a cell whose counters passed 2^31: no wrap, ever.
pub const WEIGHT_ONE: f32 = 256.0;
/// Largest weight that is recorded as it is; more is clamped.
pub const MAX_WEIGHT: f32 = 4.0;
/// Bound on records between two calls of [`Counters::end_pass`].
pub const MAX_RECORDS_PER_PASS: u64 = (1 << 31) / (WEIGHT_ONE as u64 * MAX_WEIGHT as u64) - 1;

const NO_SLOT: u32 = u32::MAX;

/// What is known of one tile seen from one cell.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tally {
    /// Samples that fell into the tile.
    pub tries: f64,
    /// Sum of their weights.
    pub weight: f64,
}

/// Learning counters of all cells: a dense visit count per cell, and tile counters for the cells
/// that were visited, up to a memory budget.
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
    /// Two words a tile in each slot: tries, then weight sum.
    blocks: Vec<Box<[AtomicU32]>>,
}

impl Counters {
    /// Counters for `cell_count` cells over `tile_count` tiles within `budget_bytes`.
    pub fn new(cell_count: u32, tile_count: u32, budget_bytes: usize) -> Self {
        let fixed = cell_count as usize * 8;
        let per_slot = Self::slot_bytes(tile_count);
        Self {
            tile_count,
            capacity: (budget_bytes.saturating_sub(fixed) / per_slot).min(cell_count as usize)
                as u32,
            visits: (0..cell_count).map(|_| AtomicU32::new(0)).collect(),
            slot_of_cell: vec![NO_SLOT; cell_count as usize],
            cell_of_slot: Vec::new(),
            blocks: Vec::new(),
        }
    }

    /// Bytes of one cell's tile counters.
    pub fn slot_bytes(tile_count: u32) -> usize {
        tile_count as usize * 8 + size_of::<Box<[AtomicU32]>>() + 4
    }

    /// Records one try in `cell`: a map sample that fell into `tile` with `weight` in
    /// `[0, MAX_WEIGHT]`, 0 when it was occluded. Safe to call from any thread.
    pub fn record(&self, cell: u32, tile: u32, weight: f32) {
        self.visits[cell as usize].fetch_add(1, Ordering::Relaxed);
        let slot = self.slot_of_cell[cell as usize];
        if slot == NO_SLOT {
            return;
        }
        let block = &self.blocks[slot as usize];
        let counter = 2 * tile as usize;
        block[counter].fetch_add(1, Ordering::Relaxed);
        let fixed = (weight.clamp(0.0, MAX_WEIGHT) * WEIGHT_ONE).round() as u32;
        if fixed > 0 {
            block[counter + 1].fetch_add(fixed, Ordering::Relaxed);
        }
    }

    /// Visits of each cell, the slot of each cell (`u32::MAX` without one) and the words of each
    /// slot: what a GPU needs to count on.
    pub(crate) fn words(&self) -> (Vec<u32>, &[u32], Vec<u32>) {
        let load = |word: &AtomicU32| word.load(Ordering::Relaxed);
        let blocks = self.blocks.iter().flat_map(|block| block.iter().map(load)).collect();
        (self.visits.iter().map(load).collect(), &self.slot_of_cell, blocks)
    }

    /// Takes back what [`Self::words`] gave, counted on.
    pub(crate) fn set_words(&self, visits: &[u32], blocks: &[u32]) {
        let slots = self.blocks.iter().flat_map(|block| block.iter());
        for (word, value) in self.visits.iter().zip(visits).chain(slots.zip(blocks)) {
            word.store(*value, Ordering::Relaxed);
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
            self.blocks.push((0..2 * self.tile_count).map(|_| AtomicU32::new(0)).collect());
        }
        for visits in &self.visits {
            visits.store(visits.load(Ordering::Relaxed).min(1 << 30), Ordering::Relaxed);
        }
        for block in &self.blocks {
            if block.iter().any(|c| c.load(Ordering::Relaxed) >= 1 << 31) {
                for counter in block {
                    counter.store(counter.load(Ordering::Relaxed) / 2, Ordering::Relaxed);
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
        self.blocks[slot].chunks_exact(2).map(|pair| Tally {
            tries: f64::from(pair[0].load(Ordering::Relaxed)),
            weight: f64::from(pair[1].load(Ordering::Relaxed)) / f64::from(WEIGHT_ONE),
        })
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.visits.len() * 8
            + self.cell_of_slot.capacity() * 4
            + self.blocks.capacity() * size_of::<Box<[AtomicU32]>>()
            + self.blocks.iter().map(|b| b.len() * 4).sum::<usize>()
    }

    /// A digest of every counter (FNV-1a over cells in slot order), for tests of repeatability.
    pub fn digest(&self) -> u64 {
        let mut digest = 0xcbf2_9ce4_8422_2325_u64;
        let mut eat =
            |word: u32| digest = (digest ^ u64::from(word)).wrapping_mul(0x0100_0000_01b3);
        for (slot, &cell) in self.cell_of_slot.iter().enumerate() {
            eat(cell);
            for counter in &self.blocks[slot] {
                eat(counter.load(Ordering::Relaxed));
            }
        }
        digest
    }
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
        counters.blocks[0][3].store(3 << 30, Ordering::Relaxed);
        counters.blocks[0][2].store(1000, Ordering::Relaxed);
        counters.end_pass();
        let tally = counters.tallies(0).nth(1).expect("two tiles");
        assert_eq!(tally.tries, 500.0);
        assert_eq!(tally.weight, f64::from(3_u32 << 29) / f64::from(WEIGHT_ONE));
        let growth = MAX_RECORDS_PER_PASS * (MAX_WEIGHT * WEIGHT_ONE) as u64;
        assert!(growth < 1 << 31, "one pass cannot carry a halved counter past u32");
    }
}
