//! From counters to laws.

use std::collections::BTreeMap;

use super::cells::{SphericalGrid, face_axis};
use super::counters::Counters;
use super::tile_laws::TileLaws;
use super::{Cells, LightGrid, MEMORY_BUDGET_BYTES, WHOLE_MAP};
use crate::environment::Environment;

/// What one learning record holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Recording {
    /// Visibility times cosine. Divided by the tries it is a visibility ratio that does not depend
    /// on the map's radiance.
    VisibleCosine,
    /// The visible contribution, as in the talk.
    VisibleContribution,
}

/// How counters become laws. *Measured* defaults.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LawOptions {
    /// What the counters hold.
    pub recording: Recording,
    /// Tries per tile that the pooled ratio of the 4x4 cells around is worth.
    pub pooling_tries: f64,
    /// Share of samples that follow the whole map's law whatever was learned.
    pub whole_map_share: f64,
    /// How much of the diffuse BSDF's own density is subtracted from a law (MIS compensation,
    /// Karlik et al. 2019, on tiles).
    pub compensation: f64,
}

impl LawOptions {
    /// Our own laws.
    pub const ADAPTIVE: Self = Self {
        recording: Recording::VisibleCosine,
        pooling_tries: 1.0,
        whole_map_share: 0.02,
        compensation: 0.5,
    };

    /// The talk's: proportional to the visible contribution, nothing else.
    pub const TALK: Self = Self {
        recording: Recording::VisibleContribution,
        pooling_tries: 0.0,
        whole_map_share: 0.0,
        compensation: 0.0,
    };
}

/// A grid with its learning counters: records while paths are traced, then becomes a [`LightGrid`].
#[derive(Debug)]
pub struct LearningGrid {
    /// Where the cells lie.
    pub grid: SphericalGrid,
    /// What was counted.
    pub counters: Counters,
    options: LawOptions,
}

/// Cells per side of the blocks that visibility is pooled over.
const POOL: u32 = 4;

/// Share of the budget for the counters; laws take the rest while both are held.
const COUNTER_SHARE: f64 = 0.62;

/// Law entries left over by MIS compensation must carry at least this much of the law.
const LEAST_COMPENSATED: f64 = 0.05;

impl LearningGrid {
    /// An empty grid over the tiles of a map.
    pub fn new(grid: SphericalGrid, tile_count: u32, options: LawOptions) -> Self {
        let budget = (MEMORY_BUDGET_BYTES as f64 * COUNTER_SHARE) as usize;
        Self { grid, counters: Counters::new(grid.cell_count(), tile_count, budget), options }
    }

    /// What a record must hold.
    pub fn recording(&self) -> Recording {
        self.options.recording
    }

    /// The laws that follow from what was counted so far. `None` for a black map.
    pub fn laws(&self, environment: &Environment) -> Option<LightGrid> {
        let energies = environment.tile_energies();
        let mut result = LightGrid::whole_map(energies)?;
        let builder = LawBuilder::new(self, environment);
        let mut weights = Vec::new();
        let slots = self.counters.cells().len();
        let supports: Vec<usize> = (0..slots)
            .map(|slot| {
                builder.weights(slot, &mut weights);
                weights.iter().filter(|w| **w > 0.0).count()
            })
            .collect();
        let mut law_of_cell = vec![WHOLE_MAP as u16; self.grid.cell_count() as usize];
        let room = MEMORY_BUDGET_BYTES
            .saturating_sub(self.counters.memory_bytes() + law_of_cell.len() * 2)
            .saturating_sub(result.laws.memory_bytes());
        let kept = fitting(&supports, room, energies.len() as u32);
        let entries = supports[..kept].iter().sum::<usize>();
        result.laws.reserve_exact(kept, entries);
        for slot in 0..kept {
            builder.weights(slot, &mut weights);
            if let Some(law) = result.laws.push(&weights) {
                law_of_cell[self.counters.cells()[slot] as usize] = law as u16;
            }
        }
        result.cells = Some(Cells { grid: self.grid, law_of_cell });
        Some(result)
    }
}

/// How many of the first laws fit into `room` bytes (and into 16-bit law indices).
fn fitting(supports: &[usize], room: usize, tile_count: u32) -> usize {
    let mut used = 0;
    supports
        .iter()
        .take(usize::from(u16::MAX))
        .take_while(|support| {
            used += TileLaws::law_bytes(tile_count, **support as u32);
            used <= room
        })
        .count()
}

/// Visibility sums of a block of cells.
struct Block {
    tries: f64,
    weights: Vec<f64>,
}

struct LawBuilder<'a> {
    learned: &'a LearningGrid,
    /// Whole-map probability of each tile.
    map_law: Vec<f64>,
    faces: BTreeMap<u32, Block>,
    blocks: BTreeMap<u32, Block>,
    /// Share of the diffuse density per face and tile; empty without compensation.
    diffuse: Vec<Vec<f64>>,
}

impl<'a> LawBuilder<'a> {
    fn new(learned: &'a LearningGrid, environment: &Environment) -> Self {
        let energies = environment.tile_energies();
        let total: f64 = energies.iter().sum();
        let mut builder = Self {
            learned,
            map_law: energies.iter().map(|e| e / total).collect(),
            faces: BTreeMap::new(),
            blocks: BTreeMap::new(),
            diffuse: Vec::new(),
        };
        if learned.options.pooling_tries > 0.0 {
            builder.pool();
        }
        if learned.options.compensation > 0.0 && learned.grid.faces {
            builder.diffuse = diffuse_shares(environment);
        }
        builder
    }

    fn block_of(&self, cell: u32) -> u32 {
        let (face, row, column) = self.learned.grid.coordinates(cell);
        (face << 24) | ((row / POOL) << 12) | (column / POOL)
    }

    fn pool(&mut self) {
        let mut weights = Vec::new();
        for (slot, &cell) in self.learned.counters.cells().iter().enumerate() {
            let tries = f64::from(self.learned.counters.read(slot, &mut weights));
            let (face, _, _) = self.learned.grid.coordinates(cell);
            let block = self.block_of(cell);
            for (map, key) in [(&mut self.faces, face), (&mut self.blocks, block)] {
                let sums = map
                    .entry(key)
                    .or_insert_with(|| Block { tries: 0.0, weights: vec![0.0; weights.len()] });
                sums.tries += tries;
                sums.weights.iter_mut().zip(&weights).for_each(|(sum, w)| *sum += w);
            }
        }
    }

    /// Unnormalised law of a slot.
    fn weights(&self, slot: usize, weights: &mut Vec<f64>) {
        let tries = f64::from(self.learned.counters.read(slot, weights));
        let cell = self.learned.counters.cells()[slot];
        let (face, _, _) = self.learned.grid.coordinates(cell);
        if self.learned.options.recording == Recording::VisibleCosine {
            self.shrink(tries, face, self.block_of(cell), weights);
        }
        self.compensate(face as usize, weights);
        let total: f64 = weights.iter().sum();
        let share = self.learned.options.whole_map_share;
        if total > 0.0 && share > 0.0 {
            for (weight, map) in weights.iter_mut().zip(&self.map_law) {
                *weight = (1.0 - share) * *weight / total + share * map;
            }
        }
    }

    /// Visibility ratio of each tile, drawn towards the block's (which is drawn towards the face's)
    /// where the tile was tried too seldom, times the tile's energy.
    fn shrink(&self, tries: f64, face: u32, block: u32, weights: &mut [f64]) {
        let k = self.learned.options.pooling_tries;
        let sums = self.faces.get(&face).zip(self.blocks.get(&block));
        for (tile, weight) in weights.iter_mut().enumerate() {
            let map = self.map_law[tile];
            let ratio = sums.map_or(0.0, |(face, block)| {
                let expected = face.tries * map;
                let face_ratio =
                    if expected > 0.0 { (face.weights[tile] / expected).min(1.0) } else { 0.0 };
                (block.weights[tile] + k * face_ratio) / (block.tries * map + k)
            });
            let expected = tries * map + k;
            *weight = if expected > 0.0 { map * (*weight + k * ratio) / expected } else { 0.0 };
        }
    }

    fn compensate(&self, face: usize, weights: &mut [f64]) {
        let Some(diffuse) = self.diffuse.get(face) else { return };
        let total: f64 = weights.iter().sum();
        let excess = |weight: f64, share: f64| {
            (weight - self.learned.options.compensation * share * total).max(0.0)
        };
        let left: f64 = weights.iter().zip(diffuse).map(|(w, d)| excess(*w, *d)).sum();
        if left >= LEAST_COMPENSATED * total {
            weights.iter_mut().zip(diffuse).for_each(|(w, d)| *w = excess(*w, *d));
        }
    }
}

/// For each face axis, the share of a Lambertian's density that falls into each tile, by summing a
/// Fibonacci lattice of directions.
fn diffuse_shares(environment: &Environment) -> Vec<Vec<f64>> {
    const DIRECTIONS: u32 = 1 << 15;
    let mut shares = vec![vec![0.0; environment.tile_count() as usize]; 6];
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    for i in 0..DIRECTIONS {
        let y = 1.0 - (f64::from(i) + 0.5) * 2.0 / f64::from(DIRECTIONS);
        let radius = (1.0 - y * y).sqrt();
        let (sin, cos) = (golden * f64::from(i)).sin_cos();
        let direction = glam::DVec3::new(radius * cos, y, radius * sin).as_vec3();
        let tile = environment.tile_of(direction) as usize;
        for (face, shares) in shares.iter_mut().enumerate() {
            let cosine = f64::from(direction.dot(face_axis(face as u32)).max(0.0));
            shares[tile] += cosine * 4.0 / f64::from(DIRECTIONS);
        }
    }
    shares
}
