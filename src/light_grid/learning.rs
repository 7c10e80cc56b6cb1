//! From counters to distributions.

use super::cells::SphericalGrid;
use super::counters::Counters;
use super::distribution_builder::DistributionBuilder;
use super::grid::{Cells, LightGrid, WHOLE_MAP};
use super::options::DistributionOptions;
use crate::environment::Environment;

/// A grid with its learning counters: records while paths are traced, then becomes a [`LightGrid`].
#[derive(Debug)]
pub struct LearningGrid {
    /// The cells.
    pub grid: SphericalGrid,
    /// The counters of its cells.
    pub counters: Counters,
    /// How paths record, and how distributions are built.
    pub options: DistributionOptions,
    /// Number of times that distributions were built.
    generation: u32,
}

/// Maximum bytes of the grid, in learning and in rendering (the talk's 10 MB).
pub const MEMORY_BUDGET_BYTES: usize = 10 << 20;

/// Share of the budget for the counters; distributions take the rest while both are held.
const COUNTER_SHARE: f64 = 0.65;

impl LearningGrid {
    /// An empty grid over the tiles of a map.
    pub fn new(grid: SphericalGrid, tile_count: u32, options: DistributionOptions) -> Self {
        let budget = (MEMORY_BUDGET_BYTES as f64 * COUNTER_SHARE) as usize;
        let counters = Counters::new(grid.cell_count(), tile_count, budget);
        Self { grid, counters, options, generation: 0 }
    }

    /// Whether both grids count the same kind of weight in grids of the same shape; centres may differ.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        let around_other = SphericalGrid { center: other.grid.center, ..self.grid };
        (around_other, self.options) == (other.grid, other.options)
    }

    /// A copy of the counters as they are now.
    pub fn snapshot(&self) -> Self {
        Self { counters: self.counters.snapshot(), ..*self }
    }

    /// Builds the next generation of distributions from the counters. `None` for a black map.
    pub fn distributions(&mut self, environment: &Environment) -> Option<LightGrid> {
        self.generation += 1;
        let mut result = LightGrid::whole_map(environment.tile_energies())?;
        let builder =
            DistributionBuilder::new(self.grid, &self.counters, self.options, environment);
        let mut distribution_of_cell = vec![WHOLE_MAP as u16; self.grid.cell_count() as usize];
        let room = MEMORY_BUDGET_BYTES
            .saturating_sub(self.counters.memory_bytes() + distribution_of_cell.len() * 2)
            .saturating_sub(result.distributions.memory_bytes());
        builder.build(room, &mut result.distributions, &mut distribution_of_cell);
        let cells = Some(Cells { grid: self.grid, distribution_of_cell });
        let (whole_map_share, generation) = (self.options.whole_map_share, self.generation);
        Some(LightGrid { cells, whole_map_share, generation, ..result })
    }
}
