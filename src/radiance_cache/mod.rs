//! A world-space cache of reflected radiance, learned from whole paths.
//!
//! Surfaces are divided into cubic cells by position and dominant axis of the normal, hashed into a table of
//! fixed size (Binder, Fricke, Keller, *Massively Parallel Path Space Filtering*, 2019). Cells grow with
//! the distance from the camera, so that their number is bounded. Each holds the mean reflected radiance of
//! paths over the mean albedo; readers multiply by the albedo of their point, which restores textures. Cells
//! with few paths are blended with a parent cell four times as large.
//!
//! Sums are integers: they do not depend on the order of the paths. A [`RadianceCache`] is read while training
//! continues in [`RadianceSums`].

mod cells;
mod facts;
mod sums;

use glam::Vec3;

pub use cells::CacheCells;
use cells::Key;
pub(crate) use cells::{CHECK_SEED, PARENT};
pub use facts::{CacheFacts, KnownCell};
pub use sums::RadianceSums;
pub(crate) use sums::{ALBEDO_ONE, MAX_PATHS, WORDS};

/// Slots of the table: a power of two.
pub(crate) const SLOTS: usize = 1 << 16;
/// Maximum number of successive slots that are probed for a cell. No cell needs more before the table counts as
/// full, so that the order of insertion does not decide which cells find a slot.
pub(crate) const MAX_PROBES: usize = 512;
/// Weight of the parent's mean in a cell, in paths.
const PARENTS_PATHS: f64 = 8.0;
/// Weight of the mean of all cells in a parent, in paths: few paths are often much brighter or darker.
const PATHS_OF_ALL: f64 = 1.0;
/// Minimum albedo that radiance is divided by.
const MIN_ALBEDO: f64 = 1.0 / 256.0;

/// The trained cache, readable from any number of threads.
#[derive(Debug, Clone)]
pub struct RadianceCache {
    cells: CacheCells,
    /// For each slot the check word of its cell (0 if empty) and the bits of its radiance over albedo, linear RGB.
    pub(crate) slots: Vec<[u32; 4]>,
    /// Mean radiance over albedo, which unknown cells have.
    pub(crate) mean: Vec3,
}

impl RadianceCache {
    /// Its cells.
    pub fn cells(&self) -> &CacheCells {
        &self.cells
    }

    /// Reflected radiance over albedo of a surface at `position` with this unit normal on the visible side; linear
    /// RGB.
    pub fn radiance_over_albedo(&self, position: Vec3, normal: Vec3) -> Vec3 {
        let cell = self.cells.cell_at(position, normal);
        let known = |key| self.find(key);
        known(cell.key()).or_else(|| known(cell.parent().key())).unwrap_or(self.mean)
    }

    fn find(&self, key: Key) -> Option<Vec3> {
        let [_, rgb @ ..] = self.slots[self.slot_of(key)?];
        Some(Vec3::from_array(rgb.map(f32::from_bits)))
    }

    fn slot_of(&self, key: Key) -> Option<usize> {
        let slot = key.probes().find(|slot| [0, key.check].contains(&self.slots[*slot][0]))?;
        (self.slots[slot][0] != 0).then_some(slot)
    }

    /// Number of slots in use, those of parents included.
    #[cfg(test)]
    pub(crate) fn used_slots(&self) -> usize {
        self.slots.iter().filter(|[check, ..]| *check != 0).count()
    }
}
