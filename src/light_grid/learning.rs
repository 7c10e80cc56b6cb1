//! From counters to laws.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::cells::{MEDIUM_FACE, SphericalGrid, face_axis};
use super::counters::{Counters, Tally};
use super::tile_laws::TileLaws;
use super::{Cells, LightGrid, MEMORY_BUDGET_BYTES, WHOLE_MAP};
use crate::environment::Environment;

/// What one learning record holds. All but the last, divided by the tries, are visibility ratios
/// that do not depend on the map's radiance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Recording {
    /// Visibility times cosine.
    VisibleCosine,
    /// Visibility alone.
    Visible,
    /// Visibility times squared cosine: the root of its mean is a root mean square, the weight of
    /// least variance where a tile's texels are chosen by energy (Rath et al. 2020).
    VisibleCosineSquared,
    /// The visible contribution, as in the talk.
    VisibleContribution,
}

impl Recording {
    /// Whether records are visibility ratios once they are divided by the tries.
    pub fn is_ratio(self) -> bool {
        self != Self::VisibleContribution
    }

    /// Power of the cosine in a visibility ratio.
    pub fn cosine_power(self) -> i32 {
        match self {
            Self::Visible | Self::VisibleContribution => 0,
            Self::VisibleCosine => 1,
            Self::VisibleCosineSquared => 2,
        }
    }
}

/// How counters become laws. The defaults are *measured*: `lightgrid report ablations`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LawOptions {
    /// Whether cells are split six-fold by the direction a surface faces.
    pub faces: bool,
    /// What the counters hold.
    pub recording: Recording,
    /// Tries per tile that the pooled ratio of the 4x4 cells around is worth.
    pub pooling_tries: f64,
    /// Power of the visibility ratio: 1 weighs a tile by its mean visible energy, 1/2 by its root
    /// mean square, which is best where each point of a cell sees either all or nothing of it
    /// (Rath et al. 2020).
    pub ratio_exponent: f64,
    /// Share of samples, in 256ths, that follow the whole map's law whatever was learned; see
    /// [`LightGrid::sample`].
    pub whole_map_share: u32,
    /// How much of the diffuse BSDF's own density is subtracted from a law (MIS compensation,
    /// Karlik et al. 2019, on tiles).
    pub compensation: f64,
    /// Whether rendered paths count too, until the laws hardly get better.
    pub while_rendering: bool,
}

impl LawOptions {
    /// Our own laws.
    pub const ADAPTIVE: Self = Self {
        faces: true,
        recording: Recording::VisibleCosine,
        pooling_tries: 16.0,
        ratio_exponent: 0.75,
        whole_map_share: 32,
        compensation: 0.5,
        while_rendering: true,
    };

    /// The talk's: proportional to the visible contribution, nothing else.
    pub const TALK: Self = Self {
        faces: false,
        recording: Recording::VisibleContribution,
        pooling_tries: 0.0,
        ratio_exponent: 1.0,
        whole_map_share: 0,
        compensation: 0.0,
        while_rendering: false,
    };

    /// Whether rendered paths count too. Their samples of the map follow the laws, so only ratios
    /// can be counted.
    pub fn goes_on(&self) -> bool {
        self.while_rendering && self.recording.is_ratio()
    }
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
const COUNTER_SHARE: f64 = 0.65;

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

    /// A copy of the counters as they are now.
    pub fn snapshot(&self) -> Self {
        Self { grid: self.grid, counters: self.counters.snapshot(), options: self.options }
    }

    /// The laws that follow from what was counted so far. `None` for a black map.
    pub fn laws(&self, environment: &Environment) -> Option<LightGrid> {
        let energies = environment.tile_energies();
        let mut result = LightGrid::whole_map(energies)?;
        let mut builder = LawBuilder::new(self, environment);
        let mut weights = Vec::new();
        let mut supports = vec![0; self.counters.cells().len()];
        let order = builder.slots_by_block();
        for &slot in &order {
            builder.weights(slot, &mut weights);
            supports[slot] = weights.iter().filter(|w| **w > 0.0).count();
        }
        let mut law_of_cell = vec![WHOLE_MAP as u16; self.grid.cell_count() as usize];
        let room = MEMORY_BUDGET_BYTES
            .saturating_sub(self.counters.memory_bytes() + law_of_cell.len() * 2)
            .saturating_sub(result.laws.memory_bytes() + builder.memory_bytes());
        // The most visited cells have the lowest slots.
        let kept = fitting(&supports, room, energies.len() as u32);
        result.laws.reserve_exact(kept, supports[..kept].iter().sum());
        for slot in order.into_iter().filter(|slot| *slot < kept) {
            builder.weights(slot, &mut weights);
            if let Some(law) = result.laws.push(&weights) {
                law_of_cell[self.counters.cells()[slot] as usize] = law as u16;
            }
        }
        result.whole_map_share = self.options.whole_map_share;
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

struct LawBuilder<'a> {
    learning: &'a LearningGrid,
    /// Whole-map probability of each tile.
    map_law: Vec<f64>,
    /// Tallies of all cells of each face; empty if nothing is pooled.
    faces: Vec<Vec<Tally>>,
    /// Slots of each block of 4x4 cells of a face.
    slots_of_block: BTreeMap<u32, Vec<usize>>,
    /// The block last asked for and the tallies of all its cells.
    block: Option<(u32, Vec<Tally>)>,
    /// Share of the diffuse density per face and tile; empty without compensation.
    diffuse: Vec<Vec<f64>>,
}

impl<'a> LawBuilder<'a> {
    fn new(learning: &'a LearningGrid, environment: &Environment) -> Self {
        let energies = environment.tile_energies();
        let total: f64 = energies.iter().sum();
        let mut builder = Self {
            learning,
            map_law: energies.iter().map(|e| e / total).collect(),
            faces: Vec::new(),
            slots_of_block: BTreeMap::new(),
            block: None,
            diffuse: Vec::new(),
        };
        let mut slots_of_face = vec![Vec::new(); learning.grid.face_count() as usize];
        for (slot, &cell) in learning.counters.cells().iter().enumerate() {
            slots_of_face[builder.face_of(cell) as usize].push(slot);
            let block = builder.block_of(cell);
            builder.slots_of_block.entry(block).or_default().push(slot);
        }
        if learning.options.recording.is_ratio() {
            builder.faces = slots_of_face.iter().map(|slots| builder.sum(slots)).collect();
        }
        if learning.options.compensation > 0.0 && learning.grid.faces {
            builder.diffuse = diffuse_shares(environment);
        }
        builder
    }

    /// All slots, those of a block together: so one block's tallies at a time are enough.
    fn slots_by_block(&self) -> Vec<usize> {
        self.slots_of_block.values().flatten().copied().collect()
    }

    /// Bytes held beside the counters.
    fn memory_bytes(&self) -> usize {
        let tallies = (self.faces.len() + 1) * self.map_law.len() * size_of::<Tally>();
        let doubles = (self.diffuse.len() + 1) * self.map_law.len() * size_of::<f64>();
        tallies + doubles + 2 * self.learning.counters.cells().len() * size_of::<usize>()
    }

    fn sum(&self, slots: &[usize]) -> Vec<Tally> {
        let mut sums = vec![Tally::default(); self.map_law.len()];
        for &slot in slots {
            for (sum, tally) in sums.iter_mut().zip(self.learning.counters.tallies(slot)) {
                sum.tries += tally.tries;
                sum.weight += tally.weight;
            }
        }
        sums
    }

    fn face_of(&self, cell: u32) -> u32 {
        self.learning.grid.coordinates(cell).0
    }

    fn block_of(&self, cell: u32) -> u32 {
        let (face, row, column) = self.learning.grid.coordinates(cell);
        (face << 24) | ((row / POOL) << 12) | (column / POOL)
    }

    /// Unnormalised law of a slot.
    fn weights(&mut self, slot: usize, weights: &mut Vec<f64>) {
        let cell = self.learning.counters.cells()[slot];
        weights.clear();
        if self.learning.options.recording.is_ratio() {
            self.visible_energies(cell, slot, weights);
        } else {
            weights.extend(self.learning.counters.tallies(slot).map(|t| t.weight));
        }
        self.compensate(self.face_of(cell) as usize, weights);
    }

    /// Energy of each tile times its visibility ratio, which is drawn towards the block's, and that
    /// towards the face's, where the tile was tried too seldom.
    fn visible_energies(&mut self, cell: u32, slot: usize, weights: &mut Vec<f64>) {
        let k = self.learning.options.pooling_tries;
        let shrink = |tally: &Tally, ratio: f64| {
            let tries = tally.tries + k;
            if tries > 0.0 { (tally.weight + k * ratio) / tries } else { 0.0 }
        };
        let exponent = self.learning.options.ratio_exponent;
        let key = self.block_of(cell);
        if self.block.as_ref().is_none_or(|(block, _)| *block != key) {
            self.block = Some((key, self.sum(&self.slots_of_block[&key])));
        }
        let block = self.block.iter().flat_map(|(_, tallies)| tallies);
        let face = &self.faces[self.face_of(cell) as usize];
        let own = self.learning.counters.tallies(slot);
        weights.extend(own.zip(block).zip(face).zip(&self.map_law).map(
            |(((own, block), face), map)| {
                map * shrink(&own, shrink(block, shrink(face, 0.0))).powf(exponent)
            },
        ));
    }

    fn compensate(&self, face: usize, weights: &mut [f64]) {
        let Some(diffuse) = self.diffuse.get(face) else { return };
        let total: f64 = weights.iter().sum();
        let excess = |weight: f64, share: f64| {
            (weight - self.learning.options.compensation * share * total).max(0.0)
        };
        let left: f64 = weights.iter().zip(diffuse).map(|(w, d)| excess(*w, *d)).sum();
        if left >= LEAST_COMPENSATED * total {
            weights.iter_mut().zip(diffuse).for_each(|(w, d)| *w = excess(*w, *d));
        }
    }
}

/// For each face axis, the share of a Lambertian's density that falls into each tile, and at last that
/// of even scattering in a medium, by summing a Fibonacci lattice of directions.
fn diffuse_shares(environment: &Environment) -> Vec<Vec<f64>> {
    const DIRECTIONS: u32 = 1 << 15;
    let mut shares = vec![vec![0.0; environment.tile_count() as usize]; MEDIUM_FACE as usize + 1];
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    for i in 0..DIRECTIONS {
        let y = 1.0 - (f64::from(i) + 0.5) * 2.0 / f64::from(DIRECTIONS);
        let radius = (1.0 - y * y).sqrt();
        let (sin, cos) = (golden * f64::from(i)).sin_cos();
        let direction = glam::DVec3::new(radius * cos, y, radius * sin).as_vec3();
        let tile = environment.tile_of(direction) as usize;
        shares[MEDIUM_FACE as usize][tile] += 1.0 / f64::from(DIRECTIONS);
        for (face, shares) in shares.iter_mut().take(6).enumerate() {
            let cosine = f64::from(direction.dot(face_axis(face as u32)).max(0.0));
            shares[tile] += cosine * 4.0 / f64::from(DIRECTIONS);
        }
    }
    shares
}
