//! Look-up of a surface's radiance in the trained cache.

use glam::Vec3;

use super::cells::{CacheCells, Key};

/// The trained cache, readable from any number of threads.
#[derive(Debug, Clone)]
pub struct RadianceCache {
    /// Its cells.
    pub cells: CacheCells,
    /// For each slot the check word of its cell (0 if empty) and the bits of its radiance over albedo, linear RGB.
    pub(crate) slots: Vec<[u32; 4]>,
    /// Mean radiance over albedo, which unknown cells have.
    pub(crate) mean: Vec3,
}

impl RadianceCache {
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

    pub(super) fn slot_of(&self, key: Key) -> Option<usize> {
        let slot = key.probes().find(|slot| [0, key.check].contains(&self.slots[*slot][0]))?;
        (self.slots[slot][0] != 0).then_some(slot)
    }

    /// Number of slots in use, those of parents included.
    #[cfg(test)]
    pub(crate) fn used_slots(&self) -> usize {
        self.slots.iter().filter(|[check, ..]| *check != 0).count()
    }
}
