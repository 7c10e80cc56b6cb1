//! Cells of the cache: from a surface point to its cell; twin of `shaders/radiance_cache.wgsl`.

use glam::Vec3;

use crate::light_grid::cells::dominant_face;
use crate::sampler::hash;

/// Slots of the table: a power of two.
pub(crate) const SLOTS: usize = 1 << 16;
/// Maximum number of successive slots that are probed for a cell. No cell needs more before the table counts as
/// full, so that the order of insertion does not decide which cells find a slot.
pub(crate) const MAX_PROBES: usize = 512;
/// Maximum number of doublings of a cell's edge.
const MAX_LEVELS: u32 = 31;
/// Flag of parents: cells four times as large, which cells with few paths are blended with.
pub(crate) const PARENT: u32 = 1 << 8;
/// Seed that makes check words independent of table places.
pub(crate) const CHECK_SEED: u32 = 0x6365_6c6c;

/// The division of surfaces into cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CacheCells {
    /// World position around which cells are smallest: the camera when learning began.
    pub center: Vec3,
    /// Edge of the smallest cells in metres.
    pub edge: f32,
    /// Radius in metres within which all cells have the smallest size; beyond it they double with every doubling
    /// of the distance.
    pub least_distance: f32,
}

/// A cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Cell {
    coordinates: [i32; 3],
    /// Face, level, and the flag of parents.
    kind: u32,
}

/// The place of a cell in the table.
#[derive(Debug, Clone, Copy)]
pub(super) struct Key {
    place: u32,
    /// Check word that separates cells of the same place; not 0.
    pub(super) check: u32,
}

impl CacheCells {
    /// Edge in metres of the cell at `position`.
    pub fn edge_at(&self, position: Vec3) -> f32 {
        self.edge_of_level(self.level_at(position))
    }

    fn level_at(&self, position: Vec3) -> u32 {
        let times = (position - self.center).length() / self.least_distance;
        // The exponent of the float: devices round logarithms differently.
        (times.max(1.0).to_bits() >> 23).saturating_sub(127).min(MAX_LEVELS)
    }

    fn edge_of_level(&self, level: u32) -> f32 {
        self.edge * (1_u32 << level) as f32
    }

    pub(super) fn cell_at(&self, position: Vec3, normal: Vec3) -> Cell {
        let level = self.level_at(position);
        // Shifted so that surfaces on cell borders lie well inside cells.
        let place = (position - self.center) / self.edge_of_level(level) + 0.25 * normal;
        let coordinates = place.floor().to_array().map(|at| at as i32);
        Cell { coordinates, kind: dominant_face(normal) | level << 3 }
    }
}

impl Cell {
    /// Its parent: the cell four times as large that contains it.
    pub(super) fn parent(self) -> Self {
        Self { coordinates: self.coordinates.map(|at| at >> 2), kind: self.kind | PARENT }
    }

    /// Number of doublings of its edge.
    pub(super) fn level(self) -> u32 {
        (self.kind & (PARENT - 1)) >> 3
    }

    /// The axis of its surfaces' normals.
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
    /// The slots in which it may be stored.
    pub(super) fn probes(self) -> impl Iterator<Item = usize> {
        (0..MAX_PROBES).map(move |probe| (self.place as usize + probe) % SLOTS)
    }
}
