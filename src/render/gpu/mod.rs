//! The GPU's schedule: the same paths in compute shaders, in dispatches too short to be felt.
//!
//! `Renderer` holds the scene, the map, the distributions and the film on a device and brings that film forward
//! as `cpu` does. Nothing waits in between: a few dispatches are always under way, and the host reads
//! the film, whose sums lose nothing at any number of samples, only when somebody asks for it.

mod acceleration;
#[cfg(feature = "window")]
mod background_compile;
mod bound;
mod buffers;
mod cast;
pub(crate) mod constants;
mod device;
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
mod queue;
mod read;
#[cfg(test)]
mod registers;
pub(crate) mod shader;
mod sharing;
mod texels;
mod uploaded_scene;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use glam::Vec3;

use super::film::Film;
use super::{Pass, View};
use crate::bsdf::{albedo, sheen};
use crate::environment::Environment;
use crate::error::{Error, Result};
use crate::light_grid::{LearningGrid, LightGrid};
use crate::path::World;
use crate::path::camera::CameraRays;
use crate::radiance_cache::RadianceCache;
use crate::scene::needs::SceneFeatures;
#[cfg(feature = "window")]
pub(crate) use background_compile::MaybeReady;
use bound::Bound;
use buffers::Buffers;
use features::{Features, ViewFeatures};
use film::Sums;
use flight::{Flights, Job};
use kernel::Kernel;
#[cfg(feature = "window")]
pub(crate) use kernel_cache::CompileGuard;
use kernel_cache::Pipeline;
use layout::{Globals, Work};
use pipeline::Programs;
use queue::Queue;
use shader::{Constants, Program};
use sharing::Sharing;
use uploaded_scene::put_array;

pub use super::devices::DeviceChoice;
pub(crate) use super::gpu_facts::Question;
pub use super::gpu_facts::{
    AdapterFacts, FlightFigures, GpuFigures, KernelFacts, RayChoice, Schedule,
};
pub(crate) use device::NO_GPU;
pub use device::{Gpu, adapters};
pub(crate) use film::DeviceFilm;
pub use uploaded_scene::UploadedScene;

/// Pixels along a side of a workgroup's tile.
const TILE: u32 = 8;
/// Paths of a workgroup.
const GROUP: u64 = 64;
/// Most workgroups of one dispatch (WebGPU's limit along an axis).
const MAX_GROUPS: u64 = 65_535;
/// Tiles of a dispatch that keep a software device's cores busy.
const MIN_TILES_ON_SOFTWARE: u64 = 4;
/// Tiles of a dispatch that keep a small and a large real device busy.
const MIN_TILES: [u64; 2] = [64, 1024];
/// Most samples of a pixel in one dispatch.
const MAX_SAMPLES: u32 = 64;

/// What the device holds of a picture in the making.
pub(crate) struct Renderer {
    gpu: Gpu,
    buffers: Buffers,
    globals: Globals,
    features: Features,
    constants: Constants,
    kernels: BTreeMap<Kernel, Bound>,
    /// Seconds of waiting for them.
    compile_seconds: f64,
    flights: Flights,
    /// If kernels take turns.
    queue: Option<Queue>,
    /// If pixels share second vertices.
    sharing: Option<Sharing>,
    film: Sums,
    progress: Progress,
    /// Samples that the film began with and those that [`Advance`] has reported_samples of.
    reported_samples: u64,
    kernel_facts: KernelFacts,
    seed: u32,
}

/// How far the film is, dispatches under way included: tiles before `tile` have `ahead` samples a
/// pixel, the others at least `least`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Progress {
    least: u32,
    ahead: u32,
    tile: u64,
    /// How many tiles from there on are under way, and by how many samples they are further.
    group: u64,
    group_samples: u32,
    /// Samples that pixels have beyond that.
    surplus: u64,
}

/// What a call of [`Renderer::render`] has set going.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Advance {
    /// Samples of all pixels together.
    pub(super) samples: u64,
    /// Fewest samples of any pixel from now on.
    pub(super) least: u32,
}

impl Renderer {
    /// Builds the kernels for a view of what is uploaded; goes on from `film` if there is one.
    ///
    /// # Errors
    /// If something does not fit on the device, with the numbers.
    pub(crate) fn new(
        uploaded: &UploadedScene,
        world: &World,
        environment: &Environment,
        view: &View,
        rays: &CameraRays,
        film: Option<&Film>,
    ) -> Result<Self> {
        let mut renderer = Self::with_buffers(uploaded, (world, environment), view, rays, film)?;
        renderer.compile(&renderer.own_kernels())?;
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
        world: &World,
        environment: &Environment,
        view: &View,
        rays: &CameraRays,
        film: Option<&Film>,
        until_then: impl FnOnce() -> Arc<CompileGuard>,
    ) -> Result<MaybeReady<Self>> {
        // A film is large, and uploaded when it is wanted.
        let lit = (world, environment);
        let mut renderer = Self::with_buffers(uploaded, lit, view, rays, None)?;
        let kernels = renderer.own_kernels();
        let programs = renderer.programs(&kernels);
        match renderer.gpu.pipelines_or_held(programs, until_then)? {
            MaybeReady::CompileGuard(held) => Ok(MaybeReady::CompileGuard(held)),
            MaybeReady::Ready(compiled) => {
                renderer.take_up(&kernels, compiled);
                film.map_or(Ok(()), |film| renderer.set_film(film))?;
                Ok(MaybeReady::Ready(renderer))
            }
        }
    }

    /// All but its kernels.
    fn with_buffers(
        uploaded: &UploadedScene,
        lit: (&World, &Environment),
        view: &View,
        rays: &CameraRays,
        film: Option<&Film>,
    ) -> Result<Self> {
        let mut renderer = Self::without_kernels(uploaded, lit, view, rays, film)?;
        let is_queue = Schedule::of(&uploaded.gpu) == Schedule::Queue;
        let takes_turns = renderer.sharing.is_none()
            && !renderer.features.view.contains(ViewFeatures::RADIANCE_CACHE);
        if is_queue && takes_turns {
            let tiles = renderer.tiles();
            let Self { buffers, gpu, features, .. } = &mut renderer;
            let queue = Queue::new(buffers, gpu, *features, tiles)?;
            renderer.queue = Some(queue);
        }
        Ok(renderer)
    }

    /// [`Self::new`] with the kernel that `compile` makes of the program for rendering.
    #[cfg(test)]
    fn with_kernel(
        uploaded: &UploadedScene,
        (world, environment): (&World, &Environment),
        view: &View,
        rays: &CameraRays,
        compile: impl FnOnce(&Gpu, Program) -> Result<Arc<Pipeline>>,
    ) -> Result<Self> {
        let mut renderer = Self::without_kernels(uploaded, (world, environment), view, rays, None)?;
        let Self { features, constants, buffers, .. } = &renderer;
        let places = buffers.array_places();
        let program = Program::new(Kernel::Render, *features, constants, &places);
        let pipeline = compile(&renderer.gpu, program)?;
        renderer.kernels.insert(Kernel::Render, Bound::new(pipeline));
        Ok(renderer)
    }

    fn without_kernels(
        uploaded: &UploadedScene,
        (world, environment): (&World, &Environment),
        view: &View,
        rays: &CameraRays,
        film: Option<&Film>,
    ) -> Result<Self> {
        features::check(view)?;
        let mut features = Features::of(world, environment, view);
        if uploaded.gpu.has_hardware_rays() {
            features = features.with_hardware_rays();
        }
        let mut buffers = uploaded.buffers.for_renderer();
        let mut globals = uploaded.globals;
        globals.set_view(view, rays);
        globals.set_fog(view.fog(world).as_ref());
        let mut constants = uploaded.constants;
        upload_tables(&mut buffers, view, environment, features, &mut constants)?;
        let size = [view.width, view.height];
        globals.film_scale = film::scale_for(world.brightest(environment));
        let sums = Sums::new(&mut buffers, size, view.layers, globals.film_scale, film)?;
        let progress = film.map(Progress::of).unwrap_or_default();
        if features.view.contains(ViewFeatures::COUNTING) {
            // Until there is something to count.
            for name in ["visits", "slot_of_cell", "counters"] {
                buffers.make(name, 4, "the learning counters")?;
            }
        }
        buffers.make("globals", size_of::<Globals>() as u64, "the view")?;
        let kernel_facts = KernelFacts::of(features);
        constants.shared_tile = view.shared_tile();
        let sharing = constants
            .shared_tile
            .map(|tile| Sharing::new(&mut buffers, features, tile, size))
            .transpose()?;
        let mut renderer = Self {
            kernels: BTreeMap::new(),
            compile_seconds: 0.0,
            flights: Flights::new(&uploaded.gpu),
            queue: None,
            sharing,
            film: sums,
            progress,
            reported_samples: 0,
            gpu: uploaded.gpu.clone(),
            buffers,
            globals,
            features,
            constants,
            kernel_facts,
            seed: view.seed,
        };
        renderer.set_cache(None)?;
        renderer.write_globals();
        renderer.reported_samples = renderer.total_samples();
        Ok(renderer)
    }

    /// Goes on from another film of this size.
    pub(super) fn set_film(&mut self, film: &Film) -> Result<()> {
        self.settle()?;
        self.forget_paths()?;
        self.film.write(&self.buffers, film)?;
        self.progress = Progress::of(film);
        self.reported_samples = self.total_samples();
        Ok(())
    }

    /// Uploads the distributions paths choose tiles by.
    pub(crate) fn set_grid(&mut self, grid: Option<&LightGrid>) -> Result<()> {
        let Some(grid) = grid.filter(|_| self.features.view.contains(ViewFeatures::MAP_SAMPLING))
        else {
            return Ok(());
        };
        // Paths remember which distribution they come from.
        self.forget_paths()?;
        let words = layout::distributions(grid, &mut self.globals);
        put_array(&mut self.buffers, "distributions", "the light grid", &words)?;
        self.write_globals();
        Ok(())
    }

    /// Uploads the cache that paths end in; without one they go on.
    pub(crate) fn set_cache(&mut self, cache: Option<&RadianceCache>) -> Result<()> {
        if !self.features.view.contains(ViewFeatures::RADIANCE_CACHE) {
            return Ok(());
        }
        let (slots, mean) = cache.map_or((&[][..], Vec3::ZERO), RadianceCache::slots_and_mean);
        self.globals.cache_is_known = u32::from(cache.is_some());
        self.globals.cache_mean = mean;
        if let Some(cache) = cache {
            self.globals.set_cells_of_cache(cache.cells(), self.globals.cache_scale);
        }
        let slots = if slots.is_empty() { &[[0; 4]; 1] } else { slots };
        put_array(&mut self.buffers, "cache_slots", "the radiance cache", slots)?;
        self.write_globals();
        Ok(())
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
        self.gpu.check()?;
        self.globals.seed = pass.sequence.seed(self.seed);
        self.globals.first_of_sequence = pass.sequence.first_sample;
        self.write_globals();
        if let Some(learning) = counts {
            self.put_counters(learning)?;
        }
        let stride = counts.map_or(0, |_| pass.stride);
        if self.sharing.is_none() && self.progress.ahead != pass.target {
            self.forget_paths()?;
            // Tiles that are ahead of the others take less than those.
            let Progress { least, .. } = self.progress;
            let even = u64::from(least) * self.pixels_before(self.tiles());
            let surplus = self.total_samples().saturating_sub(even);
            self.progress = Progress { least, ahead: pass.target, surplus, ..Progress::default() };
        }
        if self.sharing.is_some() {
            self.render_shared(pass, stride, cancel)?;
        } else if self.queue.is_some() {
            self.render_queue(pass, stride, cancel)?;
        } else {
            self.render_tiles(pass, stride, cancel)?;
        }
        if let Some(learning) = counts {
            self.take_counters(learning)?;
        }
        let samples = self.total_samples().saturating_sub(self.reported_samples);
        self.reported_samples += samples;
        Ok(Advance { samples, least: self.progress.least })
    }

    /// How many tiles a dispatch has at least, if the device affords so many units of work: what takes a large
    /// one no time may take a small one so long that a desktop stutters.
    fn least_tiles(&self, units: u64) -> u64 {
        let [small, large] = MIN_TILES;
        match self.gpu.facts().is_software() {
            true => MIN_TILES_ON_SOFTWARE,
            false => units.clamp(small, large),
        }
    }

    /// Dispatches until all tiles are ahead. Each pixel takes its samples in order, so that its sums do
    /// not depend on how the work is cut.
    fn render_tiles(&mut self, pass: Pass, stride: u32, cancel: &AtomicBool) -> Result<()> {
        let tiles = self.tiles();
        let missing = pass.target.saturating_sub(self.progress.least);
        while self.progress.tile < tiles && missing > 0 {
            let first = self.progress.tile;
            if self.progress.group == 0 {
                let units = self.flights.units(Kernel::Render);
                let affordable = units / u64::from(missing.min(MAX_SAMPLES));
                let count = affordable.clamp(self.least_tiles(units), MAX_GROUPS);
                let count = count.min(tiles - first);
                self.progress.group = count;
            }
            let count = self.progress.group;
            while self.progress.group_samples < missing {
                if cancel.load(Ordering::Relaxed) {
                    return Ok(());
                }
                let affordable = (self.flights.units(Kernel::Render) / count)
                    .clamp(1, u64::from(MAX_SAMPLES)) as u32;
                let samples = affordable.min(missing - self.progress.group_samples);
                let work = Work {
                    first: first as u32,
                    count: count as u32,
                    samples,
                    end_sample: pass.target,
                    stride,
                    ..Work::default()
                };
                let units = count * u64::from(samples);
                self.dispatch(&[Kernel::Render], &work, count as u32, units)?;
                self.progress.group_samples += samples;
            }
            let tile = first + count;
            self.progress = Progress { tile, group: 0, group_samples: 0, ..self.progress };
        }
        if self.progress.tile >= tiles {
            self.progress = Progress { least: pass.target, ..Progress::default() };
        }
        Ok(())
    }

    /// Waits until the device has nothing more to do.
    pub(super) fn settle(&mut self) -> Result<()> {
        self.flights.land_all(&self.gpu)
    }

    /// Reads the film back, dispatches under way included.
    pub(super) fn read_film(&self, film: &mut Film) -> Result<()> {
        self.film.read(&self.buffers, film)
    }

    /// Rays traced on this device for the film, when it was read last.
    pub(super) fn rays(&self) -> u64 {
        self.film.rays()
    }

    /// The film where it is.
    pub(crate) fn film_on_device(&self) -> Option<(Gpu, DeviceFilm)> {
        self.film.on_device(&self.buffers).map(|film| (self.gpu.clone(), film))
    }

    fn tiles(&self) -> u64 {
        let Globals { width, height, .. } = self.globals;
        u64::from(width.div_ceil(TILE)) * u64::from(height.div_ceil(TILE))
    }

    /// Pixels of the first `tiles` tiles.
    fn pixels_before(&self, tiles: u64) -> u64 {
        let (width, height) = (u64::from(self.globals.width), u64::from(self.globals.height));
        let tile = u64::from(TILE);
        let across = width.div_ceil(tile);
        let (row, column) = (tiles / across, tiles % across);
        let rows_before = (row * tile).min(height);
        let rows = ((row + 1) * tile).min(height) - rows_before;
        rows_before * width + rows * (column * tile).min(width)
    }

    /// Samples of all pixels together, dispatches under way included.
    fn total_samples(&self) -> u64 {
        let Progress { least, ahead, tile, group, group_samples, surplus } = self.progress;
        let (before, all) = (self.pixels_before(tile), self.pixels_before(self.tiles()));
        let under_way = self.pixels_before(tile + group) - before;
        before * u64::from(ahead)
            + (all - before) * u64::from(least)
            + under_way * u64::from(group_samples)
            + surplus
    }

    /// Figures of the device and of what the kernels leave out.
    pub(crate) fn figures(&self) -> GpuFigures {
        GpuFigures {
            adapter: self.gpu.facts().clone(),
            device_bytes: self.buffers.bytes(),
            bytes_read: self.buffers.bytes_read(),
            flights: self.flights.figures(),
            compile_seconds: self.compile_seconds,
            schedule: if self.queue.is_some() { Schedule::Queue } else { Schedule::Whole },
            kernel: self.kernel_facts.clone(),
        }
    }

    fn write_globals(&self) {
        self.buffers.write("globals", 0, bytemuck::bytes_of(&self.globals));
    }

    fn read_words(&self, name: &str, count: usize) -> Result<Vec<u32>> {
        if count == 0 {
            return Ok(Vec::new());
        }
        self.buffers.read(&[(name, 0, 4 * count as u64)], |read| {
            bytemuck::cast_slice::<u8, u32>(read[0]).to_vec()
        })
    }

    /// The kernels that add samples to pixels, in order.
    fn render_kernels(&self) -> &'static [Kernel] {
        if self.sharing.is_some() {
            return &Kernel::OF_SHARING;
        }
        match (&self.queue, self.features.shadow_rays()) {
            (None, _) => &[Kernel::Render],
            (Some(_), true) => &Kernel::OF_QUEUE,
            (Some(_), false) => &Kernel::OF_QUEUE[..2],
        }
    }

    /// The kernels that it is going to need.
    fn own_kernels(&self) -> Vec<Kernel> {
        let learning = [
            (Kernel::Learn, ViewFeatures::LIGHT_GRID),
            (Kernel::Train, ViewFeatures::RADIANCE_CACHE),
        ];
        let view = self.features.view;
        let learning = learning.into_iter().filter(|(_, feature)| view.contains(*feature));
        let rendering = self.render_kernels().iter().copied();
        rendering.chain(learning.map(|(kernel, _)| kernel)).collect()
    }

    fn programs(&self, kernels: &[Kernel]) -> Programs {
        let places = self.buffers.array_places();
        let program = |kernel| Program::new(kernel, self.features, &self.constants, &places);
        kernels.iter().map(|kernel| (*kernel, program(*kernel))).collect()
    }

    /// Compiles kernels, all of them at once: a real GPU's driver takes seconds for each.
    fn compile(&mut self, kernels: &[Kernel]) -> Result<()> {
        let start = Instant::now();
        let compiled = self.gpu.pipelines(self.programs(kernels))?;
        self.take_up(kernels, compiled);
        self.compile_seconds += start.elapsed().as_secs_f64();
        Ok(())
    }

    fn take_up(&mut self, kernels: &[Kernel], compiled: Vec<Arc<Pipeline>>) {
        self.kernels.extend(kernels.iter().copied().zip(compiled.into_iter().map(Bound::new)));
    }

    /// A kernel, compiled if this is the first time, and what binds the buffers as they are now.
    fn bound(&mut self, kernel: Kernel) -> Result<(wgpu::ComputePipeline, wgpu::BindGroup)> {
        if !self.kernels.contains_key(&kernel) {
            self.compile(&[kernel])?;
        }
        let Self { gpu, buffers, kernels, .. } = self;
        let bound = kernels.get_mut(&kernel).ok_or_else(|| Error::new("a kernel is missing"))?;
        bound.current(gpu, buffers)
    }

    /// Sets kernels going, one after another; by the first one's speed the work was sized.
    fn dispatch(&mut self, order: &[Kernel], work: &Work, groups: u32, units: u64) -> Result<()> {
        let kernels = order.iter().map(|kernel| self.bound(*kernel)).collect::<Result<Vec<_>>>()?;
        self.buffers.write("globals", 0, bytemuck::bytes_of(work));
        let kernel = order[0];
        let job = Job { kernel, kernels: &kernels, steps: 1, groups, units, report: None };
        self.flights.start(&self.gpu, &job)
    }
}

impl Progress {
    /// Of a film that somebody else has brought forward.
    fn of(film: &Film) -> Self {
        let least = film.min_samples();
        let even = u64::from(least) * film.pixels().len() as u64;
        Self { least, surplus: film.total_samples() - even, ..Self::default() }
    }
}

/// Uploads the small tables of numbers; says where each begins.
fn upload_tables(
    buffers: &mut Buffers,
    view: &View,
    environment: &Environment,
    features: Features,
    constants: &mut Constants,
) -> Result<()> {
    let mut texels = albedo::texels();
    constants.sheen_at = texels.len() as u32;
    if features.scene.contains(SceneFeatures::SHEEN) {
        texels.extend(sheen::texels());
    }
    constants.filter_at = texels.len() as u32;
    texels.extend(view.filter.cumulative().iter().map(|&sum| [sum, 0.0, 0.0, 0.0]));
    constants.rows_at = texels.len() as u32;
    texels.extend(layout::map_rows(environment));
    put_array(buffers, "tables", "the list of constants", &texels)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::environment::EnvironmentOptions;
    use crate::light_grid::DistributionOptions;
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
        let rays = CameraRays::new(&view.camera, view.width, view.height);
        let uploaded = UploadedScene::new(gpu, &world, &environment).expect("it fits");
        let grid = LightGrid::whole_map(environment.tile_energies());
        let begin = || {
            let renderer = Renderer::new(&uploaded, &world, &environment, &view, &rays, None);
            let mut renderer = renderer.expect("it fits");
            renderer.set_grid(grid.as_ref()).expect("uploaded");
            renderer
        };
        let mut films = [true, false].map(|_| Film::new(view.width, view.height, false));
        let pass = Pass::to(3);
        let mut at_once = begin();
        let done = at_once.render(pass, None, &AtomicBool::new(false)).expect("rendered");
        at_once.read_film(&mut films[0]).expect("read");
        let all = 3 * u64::from(view.width * view.height);
        assert_eq!(done, Advance { samples: all, least: 3 });
        let (mut renderer, mut calls, mut samples) = (begin(), 0, 0);
        loop {
            assert!(calls < 1000, "{samples} of the samples are there");
            let cancel = Arc::new(AtomicBool::new(false));
            let cut = Arc::clone(&cancel);
            // One group of tiles at a time, or none: the pacer starts small.
            renderer.settle().expect("it runs");
            renderer.flights.forget_speed();
            let cutter = std::thread::Builder::new().name("cutter".to_owned()).spawn(move || {
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
        renderer.read_film(&mut films[1]).expect("read");
        // A real GPU is done before.
        assert!(calls > 1 || !gpu.facts().is_software(), "it was cut");
        assert_eq!(samples, all);
        assert!(films[0] == films[1], "the same samples, each once");
    }
}
