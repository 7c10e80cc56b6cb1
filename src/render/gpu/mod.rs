//! The GPU's schedule: the same paths in compute shaders, in dispatches too short to be felt.
//!
//! `Renderer` holds the scene, the map, the distributions and the film on a device and brings that film forward
//! as `cpu` does. Nothing waits in between: a few dispatches are always under way, and the host reads
//! the film, whose sums lose nothing at any number of samples, only when somebody asks for it.

mod acceleration;
#[cfg(feature = "window")]
mod background_compile;
mod bound;
mod buffer;
mod buffers;
mod cast;
pub(crate) mod constants;
mod device;
mod dispatcher;
mod facts;
mod features;
mod film;
mod flight;
pub(crate) mod kernel;
mod kernel_cache;
mod layout;
mod learning;
mod pacer;
#[cfg(test)]
mod parity;
mod pipeline;
mod progress;
mod queue;
mod read;
#[cfg(test)]
mod registers;
pub(crate) mod shader;
mod sharing;
mod texels;
mod uploaded_scene;
mod whole;

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use glam::Vec3;

use super::film::Film;
use super::{Advance, Pass, View};
use crate::error::Result;
use crate::light_grid::{LearningGrid, LightGrid};
use crate::path::{Lit, LocalLights};
use crate::radiance_cache::{RadianceCache, RadianceSums};
#[cfg(feature = "window")]
pub(crate) use background_compile::MaybeReady;
use dispatcher::Dispatcher;
use features::ViewFeatures;
use film::Sums;
use kernel::Kernel;
#[cfg(feature = "window")]
pub(crate) use kernel_cache::CompileGuard;
use progress::Progress;
use queue::Queue;
use sharing::Sharing;
use uploaded_scene::put_array;

pub(crate) use super::gpu_facts::Question;
pub use super::gpu_facts::{
    AdapterFacts, DeviceChoice, FlightFigures, GpuFigures, KernelFacts, RayChoice, Schedule,
};
pub(crate) use buffer::{buffer, texture};
pub(crate) use cast::Caster;
pub(crate) use device::NO_GPU;
pub use device::{Gpu, adapters};
pub(crate) use film::DeviceFilm;
pub use uploaded_scene::UploadedScene;

/// How kernels share the work of a picture.
enum Rendering {
    /// One does all.
    Whole,
    /// They take turns.
    Queue(Queue),
    /// They take turns, for pixels that share second vertices.
    Sharing(Sharing),
}

impl Rendering {
    /// Makes the buffers it needs.
    fn new(on: &mut Dispatcher) -> Result<Self> {
        if let Some(tile) = on.constants.shared_tile {
            return Sharing::new(on, tile).map(Self::Sharing);
        }
        let is_cached = on.features.view.contains(ViewFeatures::RADIANCE_CACHE);
        match Schedule::of(&on.gpu) {
            Schedule::Queue if !is_cached => Queue::new(on).map(Self::Queue),
            _ => Ok(Self::Whole),
        }
    }

    /// The kernels that add samples to pixels, in order.
    fn kernels(&self, on: &Dispatcher) -> &'static [Kernel] {
        match self {
            Self::Whole => &[Kernel::Render],
            Self::Queue(_) => queue::kernels(on.features),
            Self::Sharing(_) => &Kernel::OF_SHARING,
        }
    }
}

/// What the device holds of a picture in the making.
pub(crate) struct Renderer {
    dispatcher: Dispatcher,
    rendering: Rendering,
    film: Sums,
    progress: Progress,
    /// Samples that the film began with and those that [`Advance`] has told of.
    reported_samples: u64,
    kernel_facts: KernelFacts,
}

impl Renderer {
    /// Builds the kernels for a view of what is uploaded, with that for learning if the session `learns`. The view is asked
    /// for with the lights inside the scene that count; `None` are those that are uploaded.
    ///
    /// # Errors
    /// If something does not fit on the device, with the numbers.
    pub(crate) fn new(
        uploaded: &UploadedScene,
        lit: Lit<'_>,
        asked: (&View, Option<&LocalLights>),
        learns: bool,
    ) -> Result<Self> {
        let mut renderer = Self::without_kernels(uploaded, lit, asked)?;
        renderer.dispatcher.compile(&renderer.own_kernels(learns))?;
        Ok(renderer)
    }

    /// [`Self::new`] if the kernels are there already. Otherwise a thread compiles them, which holds what
    /// `until_then` gave, unless it has begun before, for as long.
    ///
    /// # Errors
    /// As [`Self::new`], or if the driver has refused one of the kernels.
    #[cfg(feature = "window")]
    pub(crate) fn new_or_held(
        uploaded: &UploadedScene,
        lit: Lit<'_>,
        asked: (&View, Option<&LocalLights>),
        learns: bool,
        until_then: impl FnOnce() -> Arc<CompileGuard>,
    ) -> Result<MaybeReady<Self>> {
        let mut renderer = Self::without_kernels(uploaded, lit, asked)?;
        let kernels = renderer.own_kernels(learns);
        let on = &mut renderer.dispatcher;
        match on.gpu.pipelines_or_held(on.programs(&kernels), until_then)? {
            MaybeReady::CompileGuard(held) => Ok(MaybeReady::CompileGuard(held)),
            MaybeReady::Ready(compiled) => {
                on.take_up(&kernels, compiled);
                Ok(MaybeReady::Ready(renderer))
            }
        }
    }

    /// [`Self::new`] with the kernel that `compile` makes of the program for rendering.
    #[cfg(test)]
    fn with_kernel(
        uploaded: &UploadedScene,
        lit: Lit<'_>,
        view: &View,
        compile: impl FnOnce(&Gpu, shader::Program) -> Result<Arc<kernel_cache::Pipeline>>,
    ) -> Result<Self> {
        let mut renderer = Self::without_kernels(uploaded, lit, (view, None))?;
        let on = &mut renderer.dispatcher;
        let program = on.programs(&[Kernel::Render]).remove(0).1;
        on.take_up(&[Kernel::Render], vec![compile(&on.gpu, program)?]);
        Ok(renderer)
    }

    /// All but its kernels.
    fn without_kernels(
        uploaded: &UploadedScene,
        lit: Lit<'_>,
        (view, lights): (&View, Option<&LocalLights>),
    ) -> Result<Self> {
        let mut on = Dispatcher::new(uploaded, lit, view, lights)?;
        let (size, scale) = ([view.width, view.height], on.globals.film_scale);
        let mut renderer = Self {
            film: Sums::new(&mut on.buffers, size, view.layers, scale)?,
            rendering: Rendering::new(&mut on)?,
            progress: Progress::default(),
            reported_samples: 0,
            kernel_facts: KernelFacts::of(on.features),
            dispatcher: on,
        };
        renderer.set_cache(None)?;
        Ok(renderer)
    }

    /// The kernels that it is going to need.
    fn own_kernels(&self, learns: bool) -> Vec<Kernel> {
        let Self { dispatcher: on, rendering, .. } = self;
        let view = on.features.view;
        let learns = learns && view.contains(ViewFeatures::LIGHT_GRID);
        let mut kernels = rendering.kernels(on).to_vec();
        kernels.extend(learns.then_some(Kernel::Learn));
        kernels.extend(view.contains(ViewFeatures::RADIANCE_CACHE).then_some(Kernel::Train));
        kernels
    }

    /// Goes on from another film of this size.
    pub(super) fn set_film(&mut self, film: &Film) -> Result<()> {
        self.settle()?;
        self.forget_paths()?;
        self.film.write(&self.dispatcher.buffers, film)?;
        self.progress = Progress::of(film);
        self.reported_samples = self.total_samples();
        Ok(())
    }

    /// Uploads the distributions paths choose tiles by.
    pub(crate) fn set_grid(&mut self, grid: Option<&LightGrid>) -> Result<()> {
        let samples_map = self.dispatcher.features.view.contains(ViewFeatures::MAP_SAMPLING);
        let Some(grid) = grid.filter(|_| samples_map) else { return Ok(()) };
        // Paths remember which distribution they come from.
        self.forget_paths()?;
        let on = &mut self.dispatcher;
        let words = layout::distributions(grid, &mut on.globals);
        put_array(&mut on.buffers, "distributions", "the light grid", &words)?;
        on.write_globals();
        Ok(())
    }

    /// Uploads the cache that paths end in; without one they go on.
    pub(crate) fn set_cache(&mut self, cache: Option<&RadianceCache>) -> Result<()> {
        let on = &mut self.dispatcher;
        if !on.features.view.contains(ViewFeatures::RADIANCE_CACHE) {
            return Ok(());
        }
        on.globals.cache_is_known = u32::from(cache.is_some());
        on.globals.cache_mean = cache.map_or(Vec3::ZERO, |cache| cache.mean);
        if let Some(cache) = cache {
            on.globals.set_cells_of_cache(&cache.cells, on.globals.cache_scale);
        }
        let slots = cache.map_or(&[][..], |cache| &cache.slots);
        let slots = if slots.is_empty() { &[[0; 4]; 1] } else { slots };
        put_array(&mut on.buffers, "cache_slots", "the radiance cache", slots)?;
        on.write_globals();
        Ok(())
    }

    /// Traces the learning paths in `paths`, drawing from the distributions last set; returns the number of
    /// rays, or `None` if it is cancelled: the counters are then, or if it fails, as before.
    pub(crate) fn learn(
        &mut self,
        paths: Range<u64>,
        learning: &LearningGrid,
        cancel: &AtomicBool,
    ) -> Result<Option<u64>> {
        let on = &mut self.dispatcher;
        learning::put_counters(on, learning)?;
        let (done, rays) = learning::trace_anywhere(on, Kernel::Learn, paths.clone(), cancel)?;
        if done < paths.end {
            return Ok(None);
        }
        learning::take_counters(on, learning)?;
        Ok(Some(rays))
    }

    /// Traces paths that train the radiance cache; what was set of it last is what is known by now.
    /// Returns the first path that was not traced, and the number of rays.
    pub(crate) fn train(
        &mut self,
        paths: Range<u64>,
        sums: &RadianceSums,
        cancel: &AtomicBool,
    ) -> Result<(u64, u64)> {
        let on = &mut self.dispatcher;
        let (words, scale) = sums.words_and_scale();
        on.globals.set_cells_of_cache(&sums.cells, scale);
        on.buffers.put("cache_sums", bytemuck::cast_slice(&words), "the radiance cache")?;
        let done = learning::trace_anywhere(on, Kernel::Train, paths, cancel)?;
        sums.set_words(&on.read_words("cache_sums", words.len())?);
        Ok(done)
    }

    /// Sets going what brings every pixel of the film to a pass's target, counting in `counts` what its
    /// samples of the map see. A pass that was cut short goes on where it was; what then was in work is
    /// counted twice. The device may still be at work afterwards, unless there are counts.
    pub(super) fn render(
        &mut self,
        pass: Pass,
        counts: Option<&LearningGrid>,
        cancel: &AtomicBool,
    ) -> Result<Advance> {
        let on = &mut self.dispatcher;
        on.gpu.check()?;
        on.globals.seed = pass.sequence.seed(on.seed);
        on.globals.first_of_sequence = pass.sequence.first_sample;
        on.write_globals();
        if let Some(counts) = counts {
            learning::put_counters(on, counts)?;
        }
        let pass = Pass { stride: counts.map_or(0, |_| pass.stride), ..pass };
        let is_sharing = matches!(self.rendering, Rendering::Sharing(_));
        if !is_sharing && self.progress.ahead != pass.target {
            self.forget_paths()?;
            self.progress = self.progress.towards(pass.target, self.dispatcher.tiles());
        }
        let Self { dispatcher: on, rendering, progress, .. } = self;
        match rendering {
            Rendering::Whole => whole::advance(on, progress, pass, cancel)?,
            Rendering::Queue(queue) => queue.advance(on, progress, pass, cancel)?,
            Rendering::Sharing(sharing) => sharing.advance(on, progress, pass, cancel)?,
        }
        if let Some(counts) = counts {
            learning::take_counters(on, counts)?;
        }
        let samples = self.total_samples().saturating_sub(self.reported_samples);
        self.reported_samples += samples;
        Ok(Advance { samples, least: self.progress.least })
    }

    /// Leaves paths in work, if there are any: their samples begin anew.
    fn forget_paths(&mut self) -> Result<()> {
        match &mut self.rendering {
            Rendering::Queue(queue) => queue.forget_paths(&mut self.dispatcher, &mut self.progress),
            _ => Ok(()),
        }
    }

    /// Waits until the device has nothing more to do.
    pub(super) fn settle(&mut self) -> Result<()> {
        self.dispatcher.settle()
    }

    /// Reads the film back, dispatches under way included.
    pub(super) fn read_film(&self, film: &mut Film) -> Result<()> {
        self.film.read(&self.dispatcher.buffers, film)
    }

    /// Rays traced on this device for the film, when it was read last.
    pub(super) fn rays(&self) -> u64 {
        self.film.rays()
    }

    /// The film where it is.
    pub(crate) fn film_on_device(&self) -> Option<(Gpu, DeviceFilm)> {
        let on = &self.dispatcher;
        self.film.on_device(&on.buffers).map(|film| (on.gpu.clone(), film))
    }

    /// Samples of all pixels together, dispatches under way included.
    fn total_samples(&self) -> u64 {
        self.progress.total_samples(self.dispatcher.tiles())
    }

    /// Figures of the device and of what the kernels leave out.
    pub(crate) fn figures(&self) -> GpuFigures {
        let on = &self.dispatcher;
        let is_queue = matches!(self.rendering, Rendering::Queue(_));
        GpuFigures {
            adapter: on.gpu.facts().clone(),
            device_bytes: on.buffers.bytes(),
            bytes_read: on.buffers.bytes_read(),
            flights: on.flights.figures,
            compile_seconds: on.compile_seconds,
            schedule: if is_queue { Schedule::Queue } else { Schedule::Whole },
            kernel: self.kernel_facts.clone(),
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use std::sync::atomic::Ordering;

    use super::*;
    use crate::environment::{Environment, EnvironmentOptions};
    use crate::light_grid::DistributionOptions;
    use crate::path::World;
    use crate::render::Sampling;
    use crate::render::gi::tests::view;
    use crate::scene::builtin;

    pub(super) fn crack() -> (World, Environment) {
        let world = World::new(builtin::build("crack").expect("built in"));
        let map = crate::environment::sky::build("sunset", 128, 64).expect("a sky");
        let environment =
            Environment::new(map, &EnvironmentOptions::default()).expect("a sound map");
        (world, environment)
    }

    /// As a window does that looks for news after each slice of work.
    #[test]
    fn a_pass_that_is_cut_short_again_and_again_comes_to_its_end() {
        let Some(gpu) = Gpu::for_test() else { return };
        cut_short(&gpu);
        cut_short(&gpu.with_schedule(Some(Schedule::Queue)));
    }

    fn cut_short(gpu: &Gpu) {
        let (world, environment) = crack();
        let view =
            View { sampling: Sampling::Plain, ..view(&world, DistributionOptions::ADAPTIVE) };
        let uploaded = UploadedScene::new(gpu, &world, &environment).expect("it fits");
        let grid = LightGrid::whole_map(environment.tile_energies());
        let begin = || {
            let renderer = Renderer::new(&uploaded, (&world, &environment), (&view, None), true);
            let mut renderer = renderer.expect("it fits");
            renderer.set_grid(grid.as_ref()).expect("uploaded");
            renderer
        };
        let film = || Film::new(view.width, view.height, false);
        let pass = Pass::to(3);
        let mut at_once = begin();
        let done = at_once.render(pass, None, &AtomicBool::new(false)).expect("rendered");
        let mut film_at_once = film();
        at_once.read_film(&mut film_at_once).expect("read");
        let all = 3 * u64::from(view.width * view.height);
        assert_eq!(done, Advance { samples: all, least: 3 });
        let is_cut = || {
            let (mut renderer, mut calls, mut samples) = (begin(), 0, 0);
            loop {
                assert!(calls < 1000, "{samples} of the samples are there");
                let cancel = Arc::new(AtomicBool::new(false));
                let cut = Arc::clone(&cancel);
                // One group of tiles at a time, or none: the pacer starts small.
                renderer.settle().expect("it runs");
                renderer.dispatcher.flights.forget_speed();
                let cutter =
                    std::thread::Builder::new().name("cutter".to_owned()).spawn(move || {
                        std::thread::sleep(std::time::Duration::from_millis(2));
                        cut.store(true, Ordering::Relaxed);
                    });
                let done = renderer.render(pass, None, &cancel).expect("rendered");
                cutter.expect("a thread").join().expect("it only sleeps");
                calls += 1;
                samples += done.samples;
                if done.least == pass.target {
                    break;
                }
            }
            let mut film = film();
            renderer.read_film(&mut film).expect("read");
            assert_eq!(samples, all);
            assert!(film_at_once == film, "the same samples, each once");
            calls > 1
        };
        // A real GPU is done before, and so is a software one while others keep the cutter from its core.
        assert!((0..20).any(|_| is_cut()) || !gpu.facts().is_software(), "it was never cut");
    }
}
