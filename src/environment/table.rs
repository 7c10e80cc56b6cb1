//! The choice of importance table behind one face.

use std::sync::Arc;

use glam::DVec2;

use super::TableKind;
use super::patches::PatchSample;
use super::summed_area::SummedArea;
use super::tile_local::{self, TileLocal};
use super::tiles::TileGrid;
use super::weights::Weights;

/// An importance table of any kind.
#[derive(Debug, Clone)]
pub(crate) enum Table {
    TileLocal(TileLocal),
    SummedArea(Arc<SummedArea>),
}

/// A patch that is being chosen.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Search {
    TileLocal(tile_local::Search),
    SummedArea([u64; 2]),
}

impl Table {
    /// Builds a table and, from that table's own sums, the tiles' energies.
    pub(crate) fn build(
        kind: TableKind,
        weights: &Weights<'_>,
        grid: &TileGrid,
    ) -> (Self, Vec<f64>) {
        let table = match kind {
            TableKind::TileLocal => {
                let (table, energies) = TileLocal::build(weights, grid);
                return (Self::TileLocal(table), energies);
            }
            TableKind::U32 => SummedArea::in_u32(weights),
            TableKind::F32 => SummedArea::in_f32(weights),
            TableKind::F64 => SummedArea::in_f64(weights),
        };
        let energies = (0..grid.count()).map(|tile| table.energy(grid.patches(tile))).collect();
        (Self::SummedArea(Arc::new(table)), energies)
    }

    /// Begins to choose a patch of a tile by 64-bit fractions of one; `None` where the table has no mass.
    #[inline]
    pub(crate) fn search(&self, tile: u32, u: [u64; 2]) -> Option<Search> {
        match self {
            Self::TileLocal(table) => table.search(tile, u).map(Search::TileLocal),
            Self::SummedArea(_) => Some(Search::SummedArea(u)),
        }
    }

    /// Chooses the patch that was searched for in a tile; `None` where the table has no mass.
    #[inline]
    pub(crate) fn finish(
        &self,
        grid: &TileGrid,
        tile: u32,
        search: &Search,
    ) -> Option<PatchSample> {
        match (self, search) {
            (Self::TileLocal(table), Search::TileLocal(search)) => Some(table.finish(search)),
            (Self::SummedArea(table), Search::SummedArea(u)) => {
                // 48 bits of each.
                let [x, y] = u.map(|u| (u >> 16) as f64 * (1.0 / (1_u64 << 48) as f64));
                table.sample(grid.patches(tile), DVec2::new(x, y))
            }
            _ => None,
        }
    }

    /// Probability of [`Self::finish`] to choose patch `(x, y)` of the tile it lies in.
    pub(crate) fn sample_probability(&self, grid: &TileGrid, tile: u32, x: u32, y: u32) -> f64 {
        match self {
            Self::TileLocal(table) => table.sample_probability(tile, x, y),
            Self::SummedArea(table) => table.sample_probability(grid.patches(tile), x, y),
        }
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        match self {
            Self::TileLocal(table) => table.memory_bytes(),
            Self::SummedArea(table) => table.memory_bytes(),
        }
    }
}
