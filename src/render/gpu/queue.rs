//! Paths in slots, which three small kernels bring one ray further in turn: one kernel for everything
//! leaves its walks too few registers. The same samples, in the same order at each pixel, so that pictures
//! are the same bit by bit; see `shaders/slots.wgsl`.

use std::sync::atomic::{AtomicBool, Ordering};

use super::super::Pass;
use super::device::Gpu;
use super::dispatcher::Dispatcher;
use super::features::Features;
use super::flight::REPORT_BYTES;
use super::kernel::Kernel;
use super::layout::Work;
use super::progress::{GROUP, Progress};
use super::texels::SlotTexels;
use crate::error::Result;
use crate::render::gpu_facts::Schedule;

/// Most workgroups of slots, which all take a step at a time: they keep the largest devices busy and fit their
/// caches.
const MAX_GROUPS: u64 = 4096;
/// The same where a processor draws as well: so many steps would make a desktop stutter.
const MAX_GROUPS_INTEGRATED: u64 = 512;
/// Most steps of all slots in one submission.
const MAX_STEPS: u64 = 64;

impl Schedule {
    /// What suits a device. Small kernels run in more waves, and lanes whose paths have ended take others:
    /// an H200 traced 1.1 to 1.9 times the rays so, in six scenes. Software has no waves to gain.
    pub(super) fn of(gpu: &Gpu) -> Self {
        gpu.schedule.unwrap_or(if gpu.prefers_buffers { Self::Queue } else { Self::Whole })
    }
}

/// The slots of a renderer.
pub(super) struct Queue {
    groups: u64,
    /// Whether they hold paths of the pass in work.
    is_filled: bool,
    /// Samples of that pass which are known to be in the film.
    samples: u32,
}

impl Queue {
    /// Makes the buffers for the picture.
    pub(super) fn new(on: &mut Dispatcher) -> Result<Self> {
        let is_integrated = on.gpu.facts().is_integrated();
        let most_groups = if is_integrated { MAX_GROUPS_INTEGRATED } else { MAX_GROUPS };
        let groups = on.tiles().count().min(most_groups);
        let slot_bytes = 16 * u64::from(SlotTexels::of(on.features).count);
        on.buffers.make("slots", groups * GROUP * slot_bytes, "the set of paths")?;
        on.buffers.make("queue", REPORT_BYTES, "a count")?;
        Ok(Self { groups, is_filled: false, samples: 0 })
    }

    /// As [`super::whole::advance`].
    pub(super) fn advance(
        &mut self,
        on: &mut Dispatcher,
        progress: &mut Progress,
        pass: Pass,
        cancel: &AtomicBool,
    ) -> Result<()> {
        if progress.least >= pass.target {
            return Ok(());
        }
        let work = Work {
            count: on.tiles().count() as u32,
            end_sample: pass.target,
            stride: pass.stride,
            ..Work::default()
        };
        if !self.is_filled {
            // Slots take pixels from the first one on.
            self.is_filled = true;
            self.samples = 0;
            let slots = (self.groups * GROUP) as u32;
            on.buffers.clear("slots");
            on.buffers.write("queue", 0, bytemuck::cast_slice(&[0, slots, 0, 0]));
            on.gpu.check()?;
        }
        while self.take_report(on, progress) != Some(0) {
            if cancel.load(Ordering::Relaxed) {
                return Ok(());
            }
            let steps = (on.flights.units(Kernel::Trace) / self.groups).clamp(1, MAX_STEPS);
            let size = (steps as u32, self.groups as u32);
            on.dispatch(kernels(on.features), &work, size, self.groups * steps, Some("queue"))?;
        }
        self.forget_paths(on, progress)?;
        *progress = Progress::even(pass.target);
        Ok(())
    }

    /// Takes note of the samples that the device has told of; returns how many slots still held a path.
    fn take_report(&mut self, on: &Dispatcher, progress: &mut Progress) -> Option<u32> {
        let [_, left, samples, _] = on.flights.report.filter(|_| self.is_filled)?;
        progress.surplus += u64::from(samples.wrapping_sub(self.samples));
        self.samples = samples;
        Some(left)
    }

    /// Leaves paths in work, if there are any: their samples begin anew.
    pub(super) fn forget_paths(
        &mut self,
        on: &mut Dispatcher,
        progress: &mut Progress,
    ) -> Result<()> {
        if self.is_filled {
            on.settle()?;
            self.take_report(on, progress);
            on.flights.report = None;
            self.is_filled = false;
        }
        Ok(())
    }
}

/// Its kernels, in order.
pub(super) fn kernels(features: Features) -> &'static [Kernel] {
    if features.shadow_rays() { &Kernel::OF_QUEUE } else { &Kernel::OF_QUEUE[..2] }
}

#[cfg(test)]
mod tests {
    use super::super::parity::fixture;
    use super::super::{Advance, Renderer, Rendering, UploadedScene, learning};
    use super::*;
    use crate::environment::{Environment, EnvironmentOptions};
    use crate::light_grid::{DistributionOptions, LightGrid};
    use crate::path::World;
    use crate::render::film::Film;
    use crate::render::{Sampling, View};
    use crate::scene::builtin;

    /// Schedules on the device at hand.
    fn devices() -> Option<[Gpu; 2]> {
        let gpu = Gpu::for_test()?;
        Some([Schedule::Whole, Schedule::Queue].map(|s| gpu.clone().with_schedule(Some(s))))
    }

    /// Four samples, then two more. Fewer slots than pixels.
    fn film(
        gpu: &Gpu,
        (world, environment, view): (&World, &Environment, &View),
        grid: Option<&LightGrid>,
    ) -> Film {
        let uploaded = UploadedScene::new(gpu, world, environment).expect("it fits");
        let renderer = Renderer::new(&uploaded, (world, environment), (view, None), true);
        let mut renderer = renderer.expect("it fits");
        if let Rendering::Queue(queue) = &mut renderer.rendering {
            queue.groups = 7;
        }
        renderer.set_grid(grid).expect("uploaded");
        let mut film = Film::new(view.width, view.height, view.layers);
        let pixels = u64::from(view.width * view.height);
        for (target, samples) in [(4, 4), (6, 2)] {
            let pass = Pass::to(target);
            let done = renderer.render(pass, None, &AtomicBool::new(false)).expect("it runs");
            assert_eq!(done, Advance { samples: samples * pixels, least: target });
        }
        renderer.read_film(&mut film).expect("read");
        film
    }

    fn assert_same(name: &str, gpus: &[Gpu; 2], of: (&World, &Environment, &View)) {
        let grid = LightGrid::whole_map(of.1.tile_energies());
        let [whole, queue] = gpus.each_ref().map(|gpu| film(gpu, of, grid.as_ref()));
        let differ = whole.pixels().iter().zip(queue.pixels()).filter(|(a, b)| a != b).count();
        eprintln!("{name}: {differ} of {} pixels differ", whole.pixels().len());
        assert!(whole.min_samples() == 6 && whole == queue, "{name}: {differ} pixels differ");
    }

    /// Lamps, panes, fog, solids, layers, unlit and masked surfaces, dispersion; a sky, and none.
    #[test]
    fn both_schedules_render_the_same_picture() {
        let Some(gpus) = devices() else { return };
        let fixture = fixture::foggy_one();
        assert_same("everything", &gpus, (&fixture.world, &fixture.environment, &fixture.view));
        let fixture = fixture::instanced_one();
        assert_same("instances", &gpus, (&fixture.world, &fixture.environment, &fixture.view));
        let sky = crate::environment::sky::build("sunset", 128, 64).expect("a sky");
        let sky = Environment::new(sky, &EnvironmentOptions::default()).expect("sound");
        for (name, sampling) in [
            ("living-room", Sampling::Plain),
            ("evening", Sampling::Plain),
            ("crack", Sampling::Plain),
            ("crack", Sampling::Bsdf),
        ] {
            let world = World::new(builtin::build(name).expect("built in"));
            let view = View { layers: false, ..fixture::view_of(&world, sampling) };
            assert_same(name, &gpus, (&world, &sky, &view));
        }
    }

    #[test]
    fn both_schedules_count_the_same() {
        let Some(gpus) = devices() else { return };
        let [whole, queue] = gpus
            .each_ref()
            .map(|gpu| learning::tests::learn(Some(gpu), DistributionOptions::ADAPTIVE));
        assert!(whole == queue, "the same visits, counters and rays");
    }
}
