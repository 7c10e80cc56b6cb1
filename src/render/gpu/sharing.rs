//! Pixels that share second vertices: three kernels bring a band of tiles one sample further, see
//! `shaders/sharing.wgsl`. The estimator of `crate::path::sharing`, in the same tiles.

use std::sync::atomic::{AtomicBool, Ordering};

use super::super::Pass;
use super::dispatcher::Dispatcher;
use super::features::ViewFeatures;
use super::kernel::Kernel;
use super::layout::{Globals, Work};
use super::progress::{GROUP, Progress};
use super::texels::SlotTexels;
use crate::error::Result;
use crate::path::sharing::SharedTile;
use crate::scene::needs::SceneFeatures;

/// Most workgroups whose vertices are kept at a time: they keep the largest devices busy.
const MAX_GROUPS: u64 = 4096;

/// Most workgroups whose paths one follows: longer rounds gain little.
const MAX_ROUNDS: u64 = 8;

/// What a renderer keeps of pixels that share.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sharing {
    tile: SharedTile,
    most_groups: u64,
    /// Of the sample in work, the first workgroup that is not under way.
    next_group: u64,
}

impl Sharing {
    /// Makes the buffers for the picture.
    pub(super) fn new(on: &mut Dispatcher, tile: SharedTile) -> Result<Self> {
        let Dispatcher { buffers, globals, features, .. } = on;
        // Tiles stick out of the picture on all sides.
        let tiles =
            [globals.width, globals.height].map(|pixels| u64::from(pixels.div_ceil(tile.side)) + 1);
        let most_groups = (tiles[0] * tiles[1]).div_ceil(tiles_of_group(tile)).min(MAX_GROUPS);
        let has_layers = features.view.contains(ViewFeatures::LAYERS);
        let is_behind = features.scene.contains(SceneFeatures::PERFECT_INTERFACES);
        let first_texels = 3 + u64::from(is_behind) + if has_layers { 2 } else { 0 };
        let lights = [ViewFeatures::MAP_SAMPLING, ViewFeatures::LOCAL_LIGHTS]
            .map(|feature| u64::from(features.view.contains(feature)));
        let incidents = u64::from(tile.continuations) * (1 + lights[0] + lights[1]);
        let owners = GROUP / u64::from(tile.owner_side * tile.owner_side);
        let what = "the vertices that pixels share";
        buffers.make("firsts", most_groups * GROUP * 16 * first_texels, what)?;
        buffers.make("seconds", most_groups * owners * 16 * (2 + 2 * incidents), what)?;
        let slot = SlotTexels::of(features.in_kernel(Kernel::LightSeconds, false));
        buffers.make("slots", most_groups * GROUP * 16 * u64::from(slot.count), what)?;
        Ok(Self { tile, most_groups, next_group: 0 })
    }

    /// As [`super::whole::advance`].
    pub(super) fn advance(
        &mut self,
        on: &mut Dispatcher,
        progress: &mut Progress,
        pass: Pass,
        cancel: &AtomicBool,
    ) -> Result<()> {
        let Globals { width, height, seed, .. } = on.globals;
        let busy_groups = on.min_tiles(u64::MAX);
        while progress.least < pass.target {
            let sample = progress.least;
            let tiling = self.tile.tiling([width, height], seed, sample);
            let groups = tiling.count().div_ceil(tiles_of_group(self.tile));
            while self.next_group < groups {
                if cancel.load(Ordering::Relaxed) {
                    return Ok(());
                }
                let first = self.next_group;
                let units = on.flights.units(Kernel::FindSeconds);
                let affordable = units.max(on.min_tiles(units));
                let count = affordable.min(self.most_groups).min(groups - first);
                let work = Work {
                    first: first as u32,
                    count: count as u32,
                    sample,
                    stride: pass.stride,
                    rounds: (count / busy_groups).clamp(1, MAX_ROUNDS) as u32,
                    ..Work::default()
                };
                on.dispatch(&Kernel::OF_SHARING, &work, (1, count as u32), count, None)?;
                self.next_group = first + count;
                let tiles = [first, self.next_group].map(|group| group * tiles_of_group(self.tile));
                progress.surplus += tiling.pixels(tiles[0]..tiles[1]);
            }
            self.next_group = 0;
            *progress = Progress::even(sample + 1);
        }
        Ok(())
    }
}

/// Tiles of a workgroup.
fn tiles_of_group(tile: SharedTile) -> u64 {
    GROUP / u64::from(tile.side * tile.side)
}
