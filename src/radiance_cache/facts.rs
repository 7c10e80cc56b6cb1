//! Facts about cells of the cache, for display.

use glam::Vec3;

use super::cells::Cell;
use super::look_up::RadianceCache;

/// The cache, and the training of its cells.
#[derive(Debug, Clone)]
pub struct CacheFacts {
    pub(super) cache: RadianceCache,
    /// Training of each slot; a parent's is that of all its cells.
    pub(super) training: Vec<Training>,
    /// Number of trained cells.
    pub cell_count: usize,
    /// Number of estimates over all cells.
    pub samples: u64,
}

/// Training of a cell.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Training {
    pub(super) paths: u64,
    /// Mean albedo of the surfaces that the estimates belong to.
    pub(super) albedo: Vec3,
}

/// A cell of the cache.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownCell {
    /// Identifier: equal for two cells with a probability of a few in a billion.
    pub number: u32,
    /// Number of doublings of its edge.
    pub level: u32,
    /// Axis of its surfaces' normals: +X, -X, +Y, -Y, +Z, -Z.
    pub face: u32,
    /// Metres along an edge.
    pub edge: f32,
    /// Number of estimates that have trained it.
    pub samples: u64,
    /// Number of estimates of its parent, the cell four times as large, its own included.
    pub samples_around: u64,
    /// Reflected radiance of its surfaces at their mean albedo; linear RGB.
    pub radiance: Vec3,
}

impl CacheFacts {
    /// The cell of a surface with this unit normal on the side it is seen from.
    pub fn cell_at(&self, position: Vec3, normal: Vec3) -> KnownCell {
        let cells = &self.cache.cells;
        let cell = cells.cell_at(position, normal);
        let [own, around] = [cell, cell.parent()].map(|cell| self.training_of(cell));
        let albedo = if own.paths > 0 { own.albedo } else { around.albedo };
        KnownCell {
            number: cell.key().check,
            level: cell.level(),
            face: cell.face(),
            edge: cells.edge_at(position),
            samples: own.paths,
            samples_around: around.paths,
            radiance: albedo * self.cache.radiance_over_albedo(position, normal),
        }
    }

    fn training_of(&self, cell: Cell) -> Training {
        let slot = self.cache.slot_of(cell.key());
        slot.map_or_else(Training::default, |slot| self.training[slot])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radiance_cache::{CacheCells, RadianceSums};

    #[test]
    fn a_cell_tells_what_has_trained_it() {
        let cells = CacheCells { center: Vec3::ZERO, edge: 0.1, least_distance: 1.0 };
        let sums = RadianceSums::new(cells, 1.0);
        assert!(sums.facts().is_none(), "nothing is known");
        let (here, beside) = (Vec3::new(0.05, 0.0, 0.05), Vec3::new(0.15, 0.0, 0.05));
        let radiance = Vec3::new(0.2, 0.4, 0.05);
        for _ in 0..1000 {
            sums.add(here, Vec3::Y, radiance, Vec3::new(0.5, 0.5, 0.25));
        }
        let facts = sums.facts().expect("something is known");
        assert_eq!((facts.cell_count, facts.samples), (1, 1000));
        let cell = facts.cell_at(here, Vec3::Y);
        assert_eq!((cell.level, cell.face, cell.edge), (0, 2, 0.1));
        assert_eq!((cell.samples, cell.samples_around), (1000, 1000));
        assert!(cell.radiance.abs_diff_eq(radiance, 2e-3), "{cell:?}");

        // A point of the same parent cell, whose radiance it takes.
        let neighbour = facts.cell_at(beside, Vec3::Y);
        assert_ne!(neighbour.number, cell.number);
        assert_eq!((neighbour.samples, neighbour.samples_around), (0, 1000));
        assert!(neighbour.radiance.abs_diff_eq(radiance, 2e-3), "{neighbour:?}");

        let back = facts.cell_at(here, Vec3::NEG_Y);
        assert_eq!((back.face, back.samples, back.samples_around), (3, 0, 0));
        let far = facts.cell_at(Vec3::new(2.5, 0.0, 0.0), Vec3::Y);
        assert_eq!((far.level, far.edge, far.samples_around), (1, 0.2, 0));
    }
}
