//! The Light Grid: which tiles of the environment map each part of the picture can see.
//!
//! Atanasov et al., *Adaptive Environment Sampling on CPU and GPU*, ACM SIGGRAPH 2018 Talks. A
//! [`cells::SphericalGrid`] around the camera maps a point to a cell, [`counters::Counters`] collect
//! what camera paths saw, and [`LightGrid`] holds the resulting [`tile_laws::TileLaws`]. Whatever
//! was learned, the estimate stays unbiased: the law that chose a sample also gives its pdf, and
//! BSDF sampling covers what a law cannot choose.

use glam::Vec3;

pub mod cells;
pub mod counters;
mod learning;
pub mod tile_laws;
mod transfer;

use cells::SphericalGrid;
use tile_laws::TileLaws;

pub use learning::{LawOptions, LearningGrid, Recording};

/// Index of the law proportional to the whole map's tile energies.
pub const WHOLE_MAP: u32 = 0;

/// Most bytes the grid may hold, learning and rendering alike (the talk's 10 MB).
pub const MEMORY_BUDGET_BYTES: usize = 10 << 20;

/// The tile laws and which of them a point uses.
#[derive(Debug, Clone)]
pub struct LightGrid {
    laws: TileLaws,
    cells: Option<Cells>,
}

#[derive(Debug, Clone)]
struct Cells {
    grid: SphericalGrid,
    /// Law of each cell; [`WHOLE_MAP`] where nothing was learned.
    law_of_cell: Vec<u16>,
}

impl LightGrid {
    /// The plain sampler: every point uses the whole map. `energies` holds one energy per tile; a
    /// black map gives `None`, for there is nothing to sample.
    pub fn whole_map(energies: &[f64]) -> Option<Self> {
        let mut laws = TileLaws::new(energies.len() as u32);
        laws.reserve_exact(1, energies.iter().filter(|e| **e > 0.0).count());
        laws.push(energies)?;
        Some(Self { laws, cells: None })
    }

    /// Law of a point whose unit normal on the lit side is `normal`.
    pub fn law_of(&self, position: Vec3, normal: Vec3) -> u32 {
        self.cells.as_ref().map_or(WHOLE_MAP, |cells| {
            u32::from(cells.law_of_cell[cells.grid.cell_of(position, normal) as usize])
        })
    }

    /// Law of a point in a medium.
    pub fn law_in_medium(&self, position: Vec3) -> u32 {
        self.cells.as_ref().map_or(WHOLE_MAP, |cells| {
            u32::from(cells.law_of_cell[cells.grid.cell_in_medium(position) as usize])
        })
    }

    /// The laws over the map's tiles; law 0 is [`WHOLE_MAP`].
    pub fn laws(&self) -> &TileLaws {
        &self.laws
    }

    /// The grid, unless every point uses the whole map.
    pub fn grid(&self) -> Option<&SphericalGrid> {
        self.cells.as_ref().map(|cells| &cells.grid)
    }

    /// Law of a cell; [`WHOLE_MAP`] without a grid.
    pub fn law_of_cell(&self, cell: u32) -> u32 {
        self.cells.as_ref().map_or(WHOLE_MAP, |cells| u32::from(cells.law_of_cell[cell as usize]))
    }

    /// Where the cells lie and which law each uses; `None` if every point uses the whole map.
    pub(crate) fn cells(&self) -> Option<(&SphericalGrid, &[u16])> {
        self.cells.as_ref().map(|cells| (&cells.grid, cells.law_of_cell.as_slice()))
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.laws.memory_bytes() + self.cells.as_ref().map_or(0, |c| c.law_of_cell.capacity() * 2)
    }

    /// The same grid with the laws of all cells replaced by arbitrary ones, in which about half of
    /// the tiles cannot be chosen: for tests that unbiasedness does not depend on learning.
    pub fn with_garbage_laws(grid: SphericalGrid, energies: &[f64], seed: u32) -> Option<Self> {
        let mut result = Self::whole_map(energies)?;
        let mut law_of_cell = vec![WHOLE_MAP as u16; grid.cell_count() as usize];
        for law in 1..=64_u32 {
            let weights: Vec<f64> = (0..energies.len() as u32)
                .map(|tile| crate::sampler::hash(seed ^ crate::sampler::hash(law << 16 | tile)))
                .map(|h| if h & 1 == 0 { 0.0 } else { f64::from(h >> 8) })
                .collect();
            result.laws.push(&weights);
        }
        for (cell, law) in law_of_cell.iter_mut().enumerate() {
            *law =
                (crate::sampler::hash(seed.wrapping_add(cell as u32)) % result.laws.len()) as u16;
        }
        result.cells = Some(Cells { grid, law_of_cell });
        Some(result)
    }
}
