//! The choice of importance table behind one face.

use glam::DVec2;

use super::TableKind;
use super::summed_area::SummedArea;
use super::tile_local::TileLocal;
use super::tiles::{TileGrid, TileTexels};
use super::weights::Weights;

/// A texel chosen by a table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TexelSample {
    /// Texel column.
    pub(crate) x: u32,
    /// Texel row.
    pub(crate) y: u32,
    /// Place in the texel that the random numbers have left, uniform in `[0,1]`^2.
    pub(crate) within: DVec2,
    /// Probability of the texel given the tile.
    pub(crate) probability: f64,
}

/// An importance table of any kind.
#[derive(Debug, Clone)]
pub(crate) enum Table {
    TileLocal(TileLocal),
    U32(SummedArea<u32>),
    F32(SummedArea<f32>),
    F64(SummedArea<f64>),
}

impl Table {
    /// Builds a table and, from that table's own sums, the tiles' energies.
    pub(crate) fn build(
        kind: TableKind,
        weights: &Weights<'_>,
        grid: &TileGrid,
    ) -> (Self, Vec<f64>) {
        let energies = |energy: &dyn Fn(&TileTexels) -> f64| {
            (0..grid.count()).map(|tile| energy(&grid.texels(tile))).collect()
        };
        match kind {
            TableKind::TileLocal => {
                let (table, energies) = TileLocal::build(weights, grid);
                (Self::TileLocal(table), energies)
            }
            TableKind::U32 => {
                let table = SummedArea::<u32>::build(weights);
                let energies = energies(&|texels| table.energy(texels));
                (Self::U32(table), energies)
            }
            TableKind::F32 => {
                let table = SummedArea::<f32>::build(weights);
                let energies = energies(&|texels| table.energy(texels));
                (Self::F32(table), energies)
            }
            TableKind::F64 => {
                let table = SummedArea::<f64>::build(weights);
                let energies = energies(&|texels| table.energy(texels));
                (Self::F64(table), energies)
            }
        }
    }

    /// Chooses a texel of a tile with `u` in `[0,1)`^2; `None` where the table has no mass.
    pub(crate) fn sample(&self, grid: &TileGrid, tile: u32, u: DVec2) -> Option<TexelSample> {
        match self {
            Self::TileLocal(table) => table.sample(grid, tile, u),
            Self::U32(table) => table.sample(&grid.texels(tile), u),
            Self::F32(table) => table.sample(&grid.texels(tile), u),
            Self::F64(table) => table.sample(&grid.texels(tile), u),
        }
    }

    /// Probability of [`Self::sample`] to choose texel `(x, y)` of the tile it lies in.
    pub(crate) fn sample_probability(&self, grid: &TileGrid, tile: u32, x: u32, y: u32) -> f64 {
        match self {
            Self::TileLocal(table) => table.sample_probability(grid, tile, x, y),
            Self::U32(table) => table.sample_probability(&grid.texels(tile), x, y),
            Self::F32(table) => table.sample_probability(&grid.texels(tile), x, y),
            Self::F64(table) => table.sample_probability(&grid.texels(tile), x, y),
        }
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        match self {
            Self::TileLocal(table) => table.memory_bytes(),
            Self::U32(table) => table.memory_bytes(),
            Self::F32(table) => table.memory_bytes(),
            Self::F64(table) => table.memory_bytes(),
        }
    }
}
