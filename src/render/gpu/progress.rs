//! How far a film is, in tiles of its picture.

use super::super::film::Film;

/// Pixels along a side of a workgroup's tile.
const TILE: u32 = 8;
/// Paths of a workgroup.
pub(super) const GROUP: u64 = 64;
/// Most workgroups of one dispatch (WebGPU's limit along an axis).
pub(super) const MAX_GROUPS: u64 = 65_535;

/// The tiles of a picture, row after row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tiles {
    pub(super) width: u32,
    pub(super) height: u32,
}

impl Tiles {
    pub(super) fn count(self) -> u64 {
        u64::from(self.width.div_ceil(TILE)) * u64::from(self.height.div_ceil(TILE))
    }

    /// Pixels of the first `tiles` tiles.
    fn pixels_before(self, tiles: u64) -> u64 {
        let (width, height) = (u64::from(self.width), u64::from(self.height));
        let tile = u64::from(TILE);
        let across = width.div_ceil(tile);
        let (row, column) = (tiles / across, tiles % across);
        let rows_before = (row * tile).min(height);
        let rows = ((row + 1) * tile).min(height) - rows_before;
        rows_before * width + rows * (column * tile).min(width)
    }
}

/// How far the film is, dispatches under way included: tiles before `tile` have `ahead` samples a
/// pixel, the others at least `least`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Progress {
    pub(super) least: u32,
    pub(super) ahead: u32,
    pub(super) tile: u64,
    /// How many tiles from there on are under way, and by how many samples they are further.
    pub(super) group: u64,
    pub(super) group_samples: u32,
    /// Samples that pixels have beyond that.
    pub(super) surplus: u64,
}

impl Progress {
    /// Of a film that somebody else has brought forward.
    pub(super) fn of(film: &Film) -> Self {
        let least = film.min_samples();
        let even = u64::from(least) * film.pixels().len() as u64;
        Self { least, surplus: film.total_samples() - even, ..Self::default() }
    }

    /// All pixels have so many samples.
    pub(super) fn even(least: u32) -> Self {
        Self { least, ..Self::default() }
    }

    /// Before a pass that brings all tiles to `target` samples: those that are ahead of the others take less.
    pub(super) fn towards(self, target: u32, tiles: Tiles) -> Self {
        let even = u64::from(self.least) * tiles.pixels_before(tiles.count());
        let surplus = self.total_samples(tiles).saturating_sub(even);
        Self { least: self.least, ahead: target, surplus, ..Self::default() }
    }

    /// Samples of all pixels together, dispatches under way included.
    pub(super) fn total_samples(self, tiles: Tiles) -> u64 {
        let Self { least, ahead, tile, group, group_samples, surplus } = self;
        let (before, all) = (tiles.pixels_before(tile), tiles.pixels_before(tiles.count()));
        let under_way = tiles.pixels_before(tile + group) - before;
        before * u64::from(ahead)
            + (all - before) * u64::from(least)
            + under_way * u64::from(group_samples)
            + surplus
    }
}
