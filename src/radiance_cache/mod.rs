//! A world-space cache of reflected radiance, learned from whole paths.
//!
//! Surfaces are cut into cubic cells by where they are and which way they face, hashed into a table of
//! fixed size (Binder, Fricke, Keller, *Massively Parallel Path Space Filtering*, 2019). Cells grow with
//! the distance from the camera, so that their number is bounded. Each holds the mean radiance that
//! paths have brought back to it, over the mean albedo: textures are put back where it is read. What
//! few paths have trained leans on a cell four times as large.
//!
//! Sums are integers: they do not depend on the order of the paths. A [`RadianceCache`] is read while
//! the [`RadianceSums`] that it was made of go on.

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
/// Slots in a row that are looked through for a cell: more than any cell needs before the table counts as full, for
/// which of them find a slot must not depend on who comes first.
pub(crate) const MAX_PROBES: usize = 512;
/// What a parent says counts in a cell as much as so many paths of its own.
const PARENTS_PATHS: f64 = 8.0;
/// The same of the mean of all cells in a parent: what few paths see is often brighter or darker.
const PATHS_OF_ALL: f64 = 1.0;
/// Least albedo that radiance is divided by.
const MIN_ALBEDO: f64 = 1.0 / 256.0;

/// What has been learned, to be read by any number of threads.
#[derive(Debug, Clone)]
pub struct RadianceCache {
    cells: CacheCells,
    /// Of each slot the check word of its cell (0 if it is empty) and the bits of its radiance over
    /// albedo, linear RGB.
    slots: Vec<[u32; 4]>,
    mean: Vec3,
}

impl RadianceCache {
    /// Where its cells lie.
    pub fn cells(&self) -> &CacheCells {
        &self.cells
    }

    /// Radiance that a surface at `position`, with this unit normal on the side it is seen from, sends
    /// back for each part of its albedo; linear RGB.
    pub fn radiance_over_albedo(&self, position: Vec3, normal: Vec3) -> Vec3 {
        let cell = self.cells.cell_at(position, normal);
        let known = |key| self.find(key);
        known(cell.key()).or_else(|| known(cell.parent().key())).unwrap_or(self.mean)
    }

    /// The table as a GPU reads it, and the mean radiance over albedo, which is that of unknown cells.
    pub(crate) fn slots_and_mean(&self) -> (&[[u32; 4]], Vec3) {
        (&self.slots, self.mean)
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
