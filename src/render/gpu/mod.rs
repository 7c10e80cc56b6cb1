//! The GPU's schedule: the same paths in compute shaders, in dispatches too short to be felt.
//!
//! `Renderer` holds the scene, the map, the distributions and the film on a device and brings that film forward
//! as `cpu` does. Nothing waits in between: a few dispatches are always under way, and the host reads
//! the film, whose sums lose nothing at any number of samples, only when somebody asks for it.

mod acceleration;
mod buffers;
mod cast;
pub(crate) mod constants;
mod device;
mod facts;
mod features;
mod film;
mod flight;
pub(crate) mod kernel;
mod layout;
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
mod uploaded_scene;

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::Vec3;

use super::film::Film;
use super::{Pass, View};
use crate::bsdf::{albedo, sheen};
use crate::environment::Environment;
use crate::error::{Error, Result};
use crate::features::Features;
use crate::light_grid::{LearningGrid, LightGrid};
use crate::path::World;
use crate::path::camera::CameraRays;
use crate::radiance_cache::{RadianceCache, RadianceSums};
use buffers::Buffers;
use film::Sums;
use flight::{Flights, Job};
use kernel::Kernel;
use layout::{Globals, Work};
use pipeline::Pipeline;
use queue::Queue;
use shader::{Binding, Constants, Program};
use sharing::Sharing;
use uploaded_scene::put_array;

pub use super::devices::DeviceChoice;
pub(crate) use super::gpu_facts::Question;
pub use super::gpu_facts::{AdapterFacts, FlightFigures, GpuFigures, RayChoice, Schedule};
pub(crate) use device::NO_GPU;
pub use device::{Gpu, adapters};
pub use facts::KernelFacts;
pub(crate) use film::DeviceFilm;
pub use uploaded_scene::UploadedScene;

/// Pixels along a side of a workgroup's tile.
const TILE: u32 = 8;
/// Paths of a workgroup.
const GROUP: u64 = 64;
/// Most workgroups of one dispatch (WebGPU's limit along an axis).
const MAX_GROUPS: u64 = 65_535;
/// Tiles of a dispatch that keep a device busy: the cores of a software one, and all of a real one.
const LEAST_TILES: [u64; 2] = [4, 1024];
/// Most samples of a pixel in one dispatch.
const MOST_SAMPLES: u32 = 64;

/// What the device holds of a picture in the making.
pub(crate) struct Renderer {
    gpu: Gpu,
    buffers: Buffers,
    globals: Globals,
    features: Features,
    constants: Constants,
    kernels: BTreeMap<Kernel, Bound>,
    flights: Flights,
    /// If kernels take turns.
    queue: Option<Queue>,
    /// If pixels share second vertices.
    sharing: Option<Sharing>,
    film: Sums,
    progress: Progress,
    /// Samples that the film began with and those that [`Advance`] has told of.
    told: u64,
    kernel_facts: KernelFacts,
    seed: u32,
}

/// A kernel and what it is bound to.
struct Bound {
    pipeline: Arc<Pipeline>,
    /// With the version of the buffers that it binds.
    bind_group: Option<(u64, wgpu::BindGroup)>,
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
    /// Builds the kernel for a view of what is uploaded; goes on from `film` if there is one.
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
        let mut renderer = Self::without_kernels(uploaded, (world, environment), view, rays, film)?;
        let is_queue = Schedule::of(&uploaded.gpu, renderer.features) == Schedule::Queue;
        let takes_turns =
            renderer.sharing.is_none() && !renderer.features.contains(Features::RADIANCE_CACHE);
        if is_queue && takes_turns {
            let tiles = renderer.tiles();
            let queue = Queue::new(&mut renderer.buffers, renderer.features, tiles)?;
            renderer.queue = Some(queue);
        }
        for kernel in renderer.render_kernels() {
            renderer.compiled(*kernel)?;
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
        if features.contains(Features::COUNTING) {
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
            flights: Flights::new(&uploaded.gpu),
            queue: None,
            sharing,
            film: sums,
            progress,
            told: 0,
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
        renderer.told = renderer.total_samples();
        Ok(renderer)
    }

    /// Goes on from another film of this size.
    pub(super) fn set_film(&mut self, film: &Film) -> Result<()> {
        self.settle()?;
        self.forget_paths()?;
        self.film.write(&self.buffers, film);
        self.progress = Progress::of(film);
        self.told = self.total_samples();
        Ok(())
    }

    /// Uploads the distributions paths choose tiles by.
    pub(crate) fn set_grid(&mut self, grid: Option<&LightGrid>) -> Result<()> {
        let Some(grid) = grid.filter(|_| self.features.contains(Features::MAP_SAMPLING)) else {
            return Ok(());
        };
        // Paths remember which distribution they come from.
        self.forget_paths()?;
        let words = layout::distributions(grid, &mut self.globals);
        put_array(&mut self.buffers, "distributions", "the light grid", &words)?;
        self.write_globals();
        Ok(())
    }

    /// Traces the learning paths in `paths`, drawing from the distributions last set; returns the number of
    /// rays. The counters are as before if it is cancelled or fails.
    pub(crate) fn learn(
        &mut self,
        paths: Range<u64>,
        learning: &LearningGrid,
        cancel: &AtomicBool,
    ) -> Result<u64> {
        self.put_counters(learning)?;
        let (done, rays) = self.trace_anywhere(Kernel::Learn, paths.clone(), cancel)?;
        if done < paths.end {
            return Ok(0);
        }
        self.take_counters(learning)?;
        Ok(rays)
    }

    /// Traces paths that train the radiance cache; what was set of it last is what is known by now.
    /// Returns the first path that was not traced, and the number of rays.
    pub(crate) fn train(
        &mut self,
        paths: Range<u64>,
        sums: &RadianceSums,
        cancel: &AtomicBool,
    ) -> Result<(u64, u64)> {
        let (words, scale) = sums.words_and_scale();
        self.globals.set_cells_of_cache(sums.cells(), scale);
        self.buffers.put("cache_sums", bytemuck::cast_slice(&words), "the radiance cache")?;
        let done = self.trace_anywhere(Kernel::Train, paths, cancel)?;
        sums.set_words(&self.read_words("cache_sums", words.len())?);
        Ok(done)
    }

    /// Uploads the cache that paths end in; without one they go on.
    pub(crate) fn set_cache(&mut self, cache: Option<&RadianceCache>) -> Result<()> {
        if !self.features.contains(Features::RADIANCE_CACHE) {
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

    /// Traces paths that begin anywhere in the picture, as far as `cancel` allows. Returns the first one
    /// that was not traced, and the number of rays of the others.
    fn trace_anywhere(
        &mut self,
        kernel: Kernel,
        paths: Range<u64>,
        cancel: &AtomicBool,
    ) -> Result<(u64, u64)> {
        self.globals.seed = self.seed;
        self.write_globals();
        self.buffers.put("learning_rays", &[0; 4], "a count")?;
        let mut first = paths.start;
        while first < paths.end && !cancel.load(Ordering::Relaxed) {
            let groups = self.flights.units(kernel).min(MAX_GROUPS);
            let count = (groups * GROUP).min(paths.end - first);
            let work = Work {
                first: first as u32,
                first_high: (first >> 32) as u32,
                count: count as u32,
                ..Work::default()
            };
            let groups = count.div_ceil(GROUP);
            self.dispatch(kernel, &work, groups as u32, groups)?;
            first += count;
        }
        self.settle()?;
        let rays = self.read_words("learning_rays", 1)?.first().copied();
        Ok((first, rays.map_or(0, u64::from)))
    }

    /// Uploads counters, to be counted on.
    fn put_counters(&mut self, learning: &LearningGrid) -> Result<()> {
        self.globals.set_cells(&learning.grid);
        self.globals.tries_per_vertex = learning.tries_per_vertex();
        self.write_globals();
        let (visits, slots, mut blocks) = learning.counters.words();
        if blocks.is_empty() {
            blocks.push(0);
        }
        self.buffers.put("visits", bytemuck::cast_slice(&visits), "the light grid's cells")?;
        self.buffers.put("slot_of_cell", bytemuck::cast_slice(slots), "the light grid's cells")?;
        self.buffers.put("counters", bytemuck::cast_slice(&blocks), "the learning counters")
    }

    /// Takes back the counters that were uploaded.
    fn take_counters(&self, learning: &LearningGrid) -> Result<()> {
        let (visits, blocks) = learning.counters.word_counts();
        let visits = self.read_words("visits", visits)?;
        learning.counters.set_words(&visits, &self.read_words("counters", blocks)?);
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
        let samples = self.total_samples().saturating_sub(self.told);
        self.told += samples;
        Ok(Advance { samples, least: self.progress.least })
    }

    /// Dispatches until all tiles are ahead. Each pixel takes its samples in order, so that its sums do
    /// not depend on how the work is cut.
    fn render_tiles(&mut self, pass: Pass, stride: u32, cancel: &AtomicBool) -> Result<()> {
        let tiles = self.tiles();
        let least_tiles = LEAST_TILES[usize::from(!self.gpu.facts().is_software())];
        let missing = pass.target.saturating_sub(self.progress.least);
        while self.progress.tile < tiles && missing > 0 {
            let first = self.progress.tile;
            if self.progress.group == 0 {
                let units = self.flights.units(Kernel::Render);
                let affordable = units / u64::from(missing.min(MOST_SAMPLES));
                let count = affordable.clamp(least_tiles, MAX_GROUPS).min(tiles - first);
                self.progress.group = count;
            }
            let count = self.progress.group;
            while self.progress.group_samples < missing {
                if cancel.load(Ordering::Relaxed) {
                    return Ok(());
                }
                let affordable = (self.flights.units(Kernel::Render) / count)
                    .clamp(1, u64::from(MOST_SAMPLES)) as u32;
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
                self.dispatch(Kernel::Render, &work, count as u32, units)?;
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
            compile_seconds: self.kernels.values().map(|k| k.pipeline.compile_seconds).sum(),
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
        match (&self.queue, self.features.contains(Features::SHADOW_RAYS)) {
            (None, _) => &[Kernel::Render],
            (Some(_), true) => &Kernel::OF_QUEUE,
            (Some(_), false) => &Kernel::OF_QUEUE[..2],
        }
    }

    /// A kernel, compiled if this is the first time, and what it is to be bound with.
    fn compiled(&mut self, kernel: Kernel) -> Result<(&mut Bound, &Gpu, &Buffers)> {
        let Self { gpu, buffers, features, constants, kernels, .. } = self;
        let bound = match kernels.entry(kernel) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(vacant) => {
                let program = Program::new(kernel, *features, constants, &buffers.array_places());
                vacant.insert(Bound::new(gpu.pipeline(kernel, program)?))
            }
        };
        Ok((bound, gpu, buffers))
    }

    /// A kernel and what binds the buffers as they are now.
    fn bound(&mut self, kernel: Kernel) -> Result<(wgpu::ComputePipeline, wgpu::BindGroup)> {
        let (bound, gpu, buffers) = self.compiled(kernel)?;
        bound.current(gpu, buffers)
    }

    /// Sets a kernel going.
    fn dispatch(&mut self, kernel: Kernel, work: &Work, groups: u32, units: u64) -> Result<()> {
        let kernels = [self.bound(kernel)?];
        self.buffers.write("globals", 0, bytemuck::bytes_of(work));
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

impl Bound {
    fn new(pipeline: Arc<Pipeline>) -> Self {
        Self { pipeline, bind_group: None }
    }

    /// The kernel and what binds the buffers as they are now; that is made anew when others have taken
    /// their place.
    fn current(
        &mut self,
        gpu: &Gpu,
        buffers: &Buffers,
    ) -> Result<(wgpu::ComputePipeline, wgpu::BindGroup)> {
        let version = buffers.version();
        let kept = self.bind_group.take().filter(|(of, _)| *of == version);
        let current = match kept {
            Some(kept) => kept,
            None => (version, self.bind(gpu, buffers)?),
        };
        let bind_group = self.bind_group.insert(current).1.clone();
        Ok((self.pipeline.pipeline.clone(), bind_group))
    }

    fn bind(&self, gpu: &Gpu, buffers: &Buffers) -> Result<wgpu::BindGroup> {
        let missing = |name| Error::new(format!("the shader's {name} was not uploaded"));
        let bindings = &self.pipeline.program.bindings;
        let mut views = Vec::new();
        for binding in bindings {
            if let Binding::Array(array) = binding {
                let texture = buffers.array(array.name).ok_or_else(|| missing(array.name))?;
                views.push(texture.create_view(&wgpu::TextureViewDescriptor::default()));
            }
        }
        let mut next_view = views.iter();
        let mut entries = Vec::new();
        for (binding, index) in bindings.iter().zip(0..) {
            let resource = match binding {
                Binding::Buffer { name, .. } => {
                    buffers.get(name).ok_or_else(|| missing(name))?.as_entire_binding()
                }
                Binding::Array(array) => wgpu::BindingResource::TextureView(
                    next_view.next().ok_or_else(|| missing(array.name))?,
                ),
                Binding::Tree => wgpu::BindingResource::AccelerationStructure(
                    buffers.tree.as_ref().ok_or_else(|| missing("tree"))?,
                ),
            };
            entries.push(wgpu::BindGroupEntry { binding: index, resource });
        }
        Ok(gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.pipeline.layout,
            entries: &entries,
        }))
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
    if features.contains(Features::SHEEN) {
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
    use crate::light_grid::cells::SphericalGrid;
    use crate::light_grid::{DistributionOptions, Recording};
    use crate::path::PathTracer;
    use crate::render::gi::CacheTraining;
    use crate::render::gi::tests::view;
    use crate::render::{Gi, Sampling, cpu};
    use crate::sampler::Sequence;
    use crate::scene::builtin;

    fn crack() -> (World, Environment) {
        let world = World::new(builtin::build("crack").expect("built in"));
        let map = crate::environment::sky::build("sunset", 128, 64).expect("a sky");
        let environment =
            Environment::new(map, &EnvironmentOptions::default()).expect("a sound map");
        (world, environment)
    }

    /// Visits of each cell and, cell by cell, tile counters after two learning passes, the second with
    /// distributions of the first, and a rendering pass of which a third is counted, if rendered paths count.
    pub(super) fn learn(
        gpu: Option<&Gpu>,
        recording: DistributionOptions,
    ) -> (Vec<u32>, Vec<u32>, u64) {
        let (world, environment) = crack();
        let view = view(&world, recording);
        let rays = CameraRays::new(&view.camera, view.width, view.height);
        let grid = SphericalGrid {
            center: rays.position,
            columns: 64,
            rows: 32,
            faces: recording.faces,
            medium: false,
        };
        let mut learning = LearningGrid::new(grid, environment.tile_count(), recording);
        let mut distributions = LightGrid::whole_map(environment.tile_energies());
        let never = AtomicBool::new(false);
        let mut renderer = gpu.map(|gpu| {
            let uploaded = UploadedScene::new(gpu, &world, &environment).expect("it fits");
            Renderer::new(&uploaded, &world, &environment, &view, &rays, None).expect("it fits")
        });
        let mut traced = 0;
        for paths in [Some(0..4096), Some(4096..16384), None] {
            let mut film = Film::new(view.width, view.height, false);
            let pass = Pass {
                target: 4,
                every: 1,
                shares: true,
                stride: 3,
                sequence: Sequence::default(),
            };
            let rendered = recording.goes_on().then_some(pass);
            traced += match (&mut renderer, paths) {
                (Some(renderer), paths) => {
                    renderer.set_grid(distributions.as_ref()).expect("uploaded");
                    let counts = Some(&learning);
                    match (paths, rendered) {
                        (Some(paths), _) => renderer.learn(paths, &learning, &never),
                        (None, Some(pass)) => {
                            renderer.render(pass, counts, &never).and_then(|_| {
                                renderer.read_film(&mut film)?;
                                Ok(renderer.rays())
                            })
                        }
                        (None, None) => Ok(0),
                    }
                    .expect("done")
                }
                (None, paths) => {
                    let tracer = view.tracer(&world, &environment, distributions.as_ref());
                    let tracer = PathTracer { counts: Some(&learning), ..tracer };
                    match (paths, rendered) {
                        (Some(paths), _) => cpu::learn(&tracer, &rays, &view, paths, &never),
                        (None, Some(pass)) => {
                            cpu::render(&tracer, &rays, &view, pass, &mut film, &never).1
                        }
                        (None, None) => 0,
                    }
                }
            };
            learning.counters.end_pass();
            distributions = learning.distributions(&environment);
        }
        let (visits, slots, blocks) = learning.counters.words();
        let words = 2 * environment.tile_count() as usize;
        let counted = slots.iter().filter(|slot| **slot != u32::MAX);
        let by_cell = counted.flat_map(|slot| &blocks[*slot as usize * words..][..words]);
        (visits, by_cell.copied().collect(), traced)
    }

    /// As a window does that looks for news after each slice of work.
    #[test]
    fn a_pass_that_is_cut_short_again_and_again_comes_to_its_end() {
        match Gpu::open(None) {
            Ok(gpu) => {
                cut_short(&gpu);
                cut_short(&gpu.with_schedule(Some(Schedule::Queue)));
            }
            Err(reason) => eprintln!("SKIPPED: {reason}"),
        }
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
        let pass =
            Pass { target: 3, every: 1, shares: true, stride: 1, sequence: Sequence::default() };
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
        assert!(calls > 1, "it was cut");
        assert_eq!(samples, all);
        assert!(films[0] == films[1], "the same samples, each once");
    }

    /// Rounding sends a path in a thousand to another triangle, texel or cell; what it meets from
    /// there on differs. So one count in 500 may lie elsewhere.
    #[test]
    fn both_devices_learn_the_same_counters() {
        let gpu = match Gpu::open(None) {
            Ok(gpu) => gpu,
            Err(reason) => return eprintln!("SKIPPED: {reason}"),
        };
        let squared = DistributionOptions {
            faces: false,
            recording: Recording::VisibleCosineSquared,
            ..DistributionOptions::ADAPTIVE
        };
        for recording in [DistributionOptions::ADAPTIVE, DistributionOptions::TALK, squared] {
            let (cpu_visits, cpu_blocks, cpu_rays) = learn(None, recording);
            let (gpu_visits, gpu_blocks, gpu_rays) = learn(Some(&gpu), recording);
            assert_eq!(cpu_blocks.len(), gpu_blocks.len(), "the same cells have counters");
            for (what, a, b) in
                [("visits", cpu_visits, gpu_visits), ("counters", cpu_blocks, gpu_blocks)]
            {
                let total: u64 = a.iter().map(|n| u64::from(*n)).sum();
                let moved: u64 = a.iter().zip(&b).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
                eprintln!("{what}: {moved} of {total} differ");
                assert!(total > 10_000 && moved * 500 < total, "{what}: {moved} of {total}");
            }
            assert!(cpu_rays.abs_diff(gpu_rays) * 1000 < cpu_rays, "{cpu_rays} {gpu_rays}");
        }
    }

    /// As above: one path in a thousand goes elsewhere.
    #[test]
    fn both_devices_train_the_same() {
        let gpu = match Gpu::open(None) {
            Ok(gpu) => gpu,
            Err(reason) => return eprintln!("SKIPPED: {reason}"),
        };
        let (world, environment) = crack();
        let view = View { gi: Gi::Cached, ..view(&world, DistributionOptions::ADAPTIVE) };
        let rays = CameraRays::new(&view.camera, view.width, view.height);
        let training =
            || CacheTraining::new(&world, &environment, &view, &rays).expect("there is light");
        let distributions = LightGrid::whole_map(environment.tile_energies());
        let (on_cpu, on_gpu) = (training(), training());
        let tracer = view.tracer(&world, &environment, distributions.as_ref());
        let uploaded = UploadedScene::new(&gpu, &world, &environment).expect("it fits");
        let mut renderer =
            Renderer::new(&uploaded, &world, &environment, &view, &rays, None).expect("it fits");
        renderer.set_grid(distributions.as_ref()).expect("uploaded");
        let never = AtomicBool::new(false);
        let mut known = None;
        for paths in [0..8192, 8192..16384] {
            let cpu_rays = cpu::train(
                &PathTracer { cache: known.as_ref(), ..tracer },
                &rays,
                &view,
                paths.clone(),
                on_cpu.sums(),
            );
            renderer.set_cache(known.as_ref()).expect("uploaded");
            let (end, gpu_rays) =
                renderer.train(paths.clone(), on_gpu.sums(), &never).expect("trained");
            assert_eq!(end, paths.end);
            assert!(cpu_rays.abs_diff(gpu_rays) * 500 < cpu_rays, "{cpu_rays} {gpu_rays}");
            let totals = [&on_cpu, &on_gpu].map(|training| training.sums().totals());
            let [(cpu_count, cpu_sums), (gpu_count, gpu_sums)] = totals;
            eprintln!("{cpu_count} {cpu_sums} against {gpu_count} {gpu_sums}");
            assert!(cpu_count.abs_diff(gpu_count) * 500 < cpu_count);
            assert!((cpu_sums / gpu_sums - 1.0).abs().max_element() < 0.01);
            known = on_cpu.sums().cache();
            let found = on_gpu.sums().cache().expect("there is room").used_slots();
            let slots = known.as_ref().map_or(0, RadianceCache::used_slots);
            assert!(slots.abs_diff(found) * 200 < slots, "{slots} {found}");
        }
    }
}
