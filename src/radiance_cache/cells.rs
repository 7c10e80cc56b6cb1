//! Which cell of the cache a point of a surface belongs to: twin of `shaders/radiance_cache.wgsl`.

use glam::Vec3;

use super::{MAX_PROBES, SLOTS};
use crate::light_grid::cells::dominant_face;
use crate::sampler::hash;

/// Most doublings of cells.
const MAX_LEVELS: u32 = 31;
/// Marks the cells four times as large that others lean on.
pub(crate) const PARENT: u32 = 1 << 8;
/// Keeps check words apart from places in the table.
pub(crate) const CHECK_SEED: u32 = 0x6365_6c6c;

/// How surfaces are cut into cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CacheCells {
    /// World position from which cells grow: the camera when learning began.
    pub center: Vec3,
    /// Metres along an edge of the smallest.
    pub edge: f32,
    /// Metres to the centre within which cells are all of the same size, and beyond which they double
    /// with every doubling of the distance.
    pub least_distance: f32,
}

/// A cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Cell {
    coordinates: [i32; 3],
    /// Face, level, and whether it is a parent.
    kind: u32,
}

/// Where a cell is looked for in the table.
#[derive(Debug, Clone, Copy)]
pub(super) struct Key {
    place: u32,
    /// Tells cells apart that are looked for in the same place; not 0.
    pub(super) check: u32,
}

impl CacheCells {
    /// Metres along an edge of the cell at `position`.
    pub fn edge_at(&self, position: Vec3) -> f32 {
        self.edge_of_level(self.level_at(position))
    }

    fn level_at(&self, position: Vec3) -> u32 {
        let times = (position - self.center).length() / self.least_distance;
        // The exponent: not a logarithm, which devices round each in their own way.
        (times.max(1.0).to_bits() >> 23).saturating_sub(127).min(MAX_LEVELS)
    }

    fn edge_of_level(&self, level: u32) -> f32 {
        self.edge * (1_u32 << level) as f32
    }

    pub(super) fn cell_at(&self, position: Vec3, normal: Vec3) -> Cell {
        let level = self.level_at(position);
        // Surfaces along the sides of cells are well inside.
        let place = (position - self.center) / self.edge_of_level(level) + 0.25 * normal;
        let coordinates = place.floor().to_array().map(|at| at as i32);
        Cell { coordinates, kind: dominant_face(normal) | level << 3 }
    }
}

impl Cell {
    /// The cell four times as large that it is a part of.
    pub(super) fn parent(self) -> Self {
        Self { coordinates: self.coordinates.map(|at| at >> 2), kind: self.kind | PARENT }
    }

    /// How often its edge was doubled.
    pub(super) fn level(self) -> u32 {
        (self.kind & (PARENT - 1)) >> 3
    }

    /// The axis that its surfaces face.
    pub(super) fn face(self) -> u32 {
        self.kind & 7
    }

    pub(super) fn key(self) -> Key {
        let mixed = |seed: u32| {
            self.coordinates.iter().fold(hash(seed), |mixed, at| hash(mixed ^ *at as u32))
        };
        Key { place: mixed(self.kind), check: mixed(self.kind ^ CHECK_SEED) | 1 }
    }
}

impl Key {
    /// The slots that it may be in.
    pub(super) fn probes(self) -> impl Iterator<Item = usize> {
        (0..MAX_PROBES).map(move |probe| (self.place as usize + probe) % SLOTS)
    }
}
