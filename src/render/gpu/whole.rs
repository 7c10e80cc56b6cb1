//! One kernel for all of a path: tile after tile takes as many samples as fit into a dispatch.

use std::sync::atomic::{AtomicBool, Ordering};

use super::super::Pass;
use super::dispatcher::Dispatcher;
use super::kernel::Kernel;
use super::layout::Work;
use super::progress::{MAX_GROUPS, Progress};
use crate::error::Result;

/// Most samples of a pixel in one dispatch.
const MAX_SAMPLES: u32 = 64;

/// Dispatches until all tiles are ahead. Each pixel takes its samples in order, so that its sums do
/// not depend on how the work is cut.
pub(super) fn advance(
    on: &mut Dispatcher,
    progress: &mut Progress,
    pass: Pass,
    cancel: &AtomicBool,
) -> Result<()> {
    let tiles = on.tiles().count();
    let missing = pass.target.saturating_sub(progress.least);
    while progress.tile < tiles && missing > 0 {
        let first = progress.tile;
        if progress.group == 0 {
            let units = on.flights.units(Kernel::Render);
            let affordable = units / u64::from(missing.min(MAX_SAMPLES));
            progress.group = affordable.clamp(on.min_tiles(units), MAX_GROUPS).min(tiles - first);
        }
        let count = progress.group;
        while progress.group_samples < missing {
            if cancel.load(Ordering::Relaxed) {
                return Ok(());
            }
            let affordable =
                (on.flights.units(Kernel::Render) / count).clamp(1, u64::from(MAX_SAMPLES)) as u32;
            let samples = affordable.min(missing - progress.group_samples);
            let work = Work {
                first: first as u32,
                count: count as u32,
                samples,
                end_sample: pass.target,
                stride: pass.stride,
                ..Work::default()
            };
            let units = count * u64::from(samples);
            on.dispatch(&[Kernel::Render], &work, (1, count as u32), units, None)?;
            progress.group_samples += samples;
        }
        *progress = Progress { tile: first + count, group: 0, group_samples: 0, ..*progress };
    }
    if progress.tile >= tiles {
        *progress = Progress::even(pass.target);
    }
    Ok(())
}
