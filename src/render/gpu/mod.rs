//! The GPU's schedule: the same paths in compute shaders, in dispatches too short to be felt.
//!
//! `Renderer` holds the scene, the map and the laws on a device and brings a [`Film`] forward as
//! `cpu` does. A pass sums at most `MAX_PASS_SAMPLES` samples of a pixel in f32 on the device; the
//! f64 film on the host adds up the passes, so that no precision is lost at any number of samples
//! and the work so far survives the device.

mod buffers;
mod device;
mod film;
pub(crate) mod layout;
mod pacer;
#[cfg(test)]
mod parity;
mod pipeline;
pub(crate) mod shader;
mod stage;

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::film::{Film, Pixel};
use super::{Pass, View};
use crate::bsdf::{albedo, sheen};
use crate::environment::Environment;
use crate::error::{Error, Result};
use crate::light_grid::{LearningGrid, LightGrid};
use crate::path::World;
use crate::path::camera::CameraRays;
use buffers::Buffers;
use layout::{Globals, PixelSums, SurfaceSums, Work};
use pacer::Pacer;
use pipeline::Pipeline;
use shader::{Binding, Constants, Features, Kernel, Program};
use stage::put_array;

pub use device::{AdapterFacts, DeviceChoice, Gpu, adapters};
pub(crate) use film::DeviceFilm;
pub use shader::KernelFacts;
pub use stage::Stage;

/// Most samples of a pixel that one pass sums in f32.
const MAX_PASS_SAMPLES: u32 = 64;
/// Pixels along a side of a workgroup's tile.
const TILE: u32 = 8;
/// Paths of a workgroup.
const GROUP: u64 = 64;
/// Most workgroups of one dispatch (WebGPU's limit along an axis).
const MAX_GROUPS: u64 = 65_535;
/// Tiles of a dispatch that keep a device with few cores busy.
const LEAST_TILES: u64 = 4;

/// What the device holds of a picture in the making.
pub(crate) struct Renderer {
    gpu: Gpu,
    buffers: Buffers,
    globals: Globals,
    features: Features,
    constants: Constants,
    render: Arc<Pipeline>,
    learn: Option<Arc<Pipeline>>,
    render_pacer: Pacer,
    learn_pacer: Pacer,
    kernel_facts: KernelFacts,
    seed: u32,
}

/// What was left out of the kernels and what they take.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct GpuFigures {
    /// The device.
    pub adapter: AdapterFacts,
    /// Bytes of all buffers on it.
    pub device_bytes: u64,
    /// What its render kernel holds.
    pub kernel: KernelFacts,
}

impl Renderer {
    /// Builds the kernel for a view of what is on the stage.
    ///
    /// # Errors
    /// If something does not fit on the device, with the numbers.
    pub(crate) fn new(
        stage: &Stage,
        world: &World,
        environment: &Environment,
        view: &View,
        rays: &CameraRays,
    ) -> Result<Self> {
        Self::with_kernel(stage, world, environment, view, rays, |gpu, program| {
            gpu.pipeline(Kernel::Render, program)
        })
    }

    /// [`Self::new`] with the kernel that `compile` makes of the program for rendering.
    fn with_kernel(
        stage: &Stage,
        world: &World,
        environment: &Environment,
        view: &View,
        rays: &CameraRays,
        compile: impl FnOnce(&Gpu, Program) -> Result<Arc<Pipeline>>,
    ) -> Result<Self> {
        let features = Features::of(world, environment, view);
        let mut buffers = stage.buffers.clone();
        let mut globals = stage.globals;
        globals.set_view(view, rays);
        globals.set_fog(view.fog(world).as_ref());
        let mut constants = stage.constants;
        upload_tables(&mut buffers, view, environment, &features, &mut constants)?;
        let pixels = u64::from(view.width) * u64::from(view.height);
        buffers.make("film", pixels * size_of::<PixelSums>() as u64, "the picture")?;
        if features.has("layers") {
            let bytes = pixels * size_of::<SurfaceSums>() as u64;
            buffers.make("surfaces", bytes, "the picture's layers")?;
        }
        if features.has("counting") {
            // Until there is something to count.
            for name in ["visits", "slot_of_cell", "counters"] {
                buffers.make(name, 4, "the learning counters")?;
            }
        }
        buffers.make("globals", size_of::<Globals>() as u64, "the view")?;
        let width_log2 = buffers.width_log2();
        let program = Program::new(Kernel::Render, &features, &constants, width_log2);
        let kernel_facts = KernelFacts::of(&features);
        let renderer = Self {
            render: compile(&stage.gpu, program)?,
            learn: None,
            gpu: stage.gpu.clone(),
            buffers,
            globals,
            features,
            constants,
            render_pacer: Pacer::default(),
            learn_pacer: Pacer::default(),
            kernel_facts,
            seed: view.seed,
        };
        renderer.write_globals();
        Ok(renderer)
    }

    /// Uploads the laws paths choose tiles by.
    pub(crate) fn set_grid(&mut self, grid: Option<&LightGrid>) -> Result<()> {
        let Some(grid) = grid.filter(|_| self.features.has("map_sampling")) else { return Ok(()) };
        let words = layout::laws(grid, &mut self.globals);
        put_array(&mut self.buffers, "laws", "the light grid", &words)?;
        self.write_globals();
        Ok(())
    }

    /// Traces the learning paths in `paths`, drawing from the laws last set; returns the number of
    /// rays. The counters are as before if it is cancelled or fails.
    pub(crate) fn learn(
        &mut self,
        paths: Range<u64>,
        learning: &LearningGrid,
        cancel: &AtomicBool,
    ) -> Result<u64> {
        self.globals.seed = self.seed;
        self.put_counters(learning)?;
        self.buffers.put("learning_rays", &[0; 4], "a count")?;
        let learn = match &self.learn {
            Some(learn) => Arc::clone(learn),
            None => {
                let width_log2 = self.buffers.width_log2();
                let program =
                    Program::new(Kernel::Learn, &self.features, &self.constants, width_log2);
                self.gpu.pipeline(Kernel::Learn, program)?
            }
        };
        self.learn = Some(Arc::clone(&learn));
        let mut first = paths.start;
        while first < paths.end {
            if cancel.load(Ordering::Relaxed) {
                return Ok(0);
            }
            let groups = self.learn_pacer.units().min(MAX_GROUPS);
            let count = (groups * GROUP).min(paths.end - first);
            let work = Work {
                first: first as u32,
                first_high: (first >> 32) as u32,
                count: count as u32,
                ..Work::default()
            };
            let groups = count.div_ceil(GROUP);
            let seconds = self.dispatch(&learn, &work, groups as u32)?;
            self.learn_pacer.record(groups, seconds);
            first += count;
        }
        self.take_counters(learning)?;
        Ok(self.read_words("learning_rays", 1)?.first().copied().map_or(0, u64::from))
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

    /// Brings every pixel of the film to a pass's target, counting in `counts` what its samples of
    /// the map see; returns the numbers of samples and rays. A pass that was cut short goes on where
    /// it was; what then was in work is counted twice.
    pub(super) fn render(
        &mut self,
        pass: Pass,
        film: &mut Film,
        counts: Option<&LearningGrid>,
        cancel: &AtomicBool,
    ) -> Result<(u64, u64)> {
        let target = pass.target;
        self.globals.seed = pass.sequence.seed(self.seed);
        self.globals.first_of_sequence = pass.sequence.first_sample;
        self.write_globals();
        if let Some(learning) = counts {
            self.put_counters(learning)?;
        }
        let stride = counts.map_or(0, |_| pass.stride);
        let tiles = u64::from(film.width.div_ceil(TILE)) * u64::from(film.height.div_ceil(TILE));
        let mut done = (0, 0);
        while film.min_samples() < target && !cancel.load(Ordering::Relaxed) {
            let first = film.min_samples();
            let samples = first..target.min(first + MAX_PASS_SAMPLES);
            let undone = first_undone(film, first)..tiles;
            let finished = self.render_pass(samples.clone(), stride, undone, cancel)?;
            let (samples, rays) = self.add_to(film, samples, finished)?;
            done = (done.0 + samples, done.1 + rays);
        }
        if let Some(learning) = counts {
            self.take_counters(learning)?;
        }
        Ok(done)
    }

    /// Takes these samples of each pixel, summed up in order, so that the sums do not depend on how
    /// the work is cut into dispatches; returns the first tile that is not done.
    fn render_pass(
        &mut self,
        pass: Range<u32>,
        stride: u32,
        tiles: Range<u64>,
        cancel: &AtomicBool,
    ) -> Result<u64> {
        let length = u64::from(pass.end - pass.start);
        let mut first = tiles.start;
        while first < tiles.end {
            let affordable = self.render_pacer.units() / length;
            let count = affordable.clamp(LEAST_TILES, MAX_GROUPS).min(tiles.end - first);
            let mut sample = pass.start;
            while sample < pass.end {
                if cancel.load(Ordering::Relaxed) {
                    return Ok(first);
                }
                let affordable = (self.render_pacer.units() / count).clamp(1, length) as u32;
                let work = Work {
                    first: first as u32,
                    count: count as u32,
                    first_sample: sample,
                    samples: affordable.min(pass.end - sample),
                    resumes: (sample > pass.start).into(),
                    stride,
                    ..Work::default()
                };
                let seconds = self.dispatch(&self.render, &work, count as u32)?;
                self.render_pacer.record(count * u64::from(work.samples), seconds);
                sample += work.samples;
            }
            first += count;
        }
        Ok(first)
    }

    /// Adds what a pass has summed up in its first `tiles` tiles.
    fn add_to(&self, film: &mut Film, pass: Range<u32>, tiles: u64) -> Result<(u64, u64)> {
        let (first_sample, samples) = (pass.start, pass.end - pass.start);
        let width = film.width as usize;
        let pixels = film.pixels.len();
        let bytes = self.buffers.read("film", (pixels * size_of::<PixelSums>()) as u64)?;
        let sums: Vec<PixelSums> = bytemuck::pod_collect_to_vec(&bytes);
        let tiles_across = u64::from(film.width.div_ceil(TILE));
        let is_done = |index: usize| {
            let (x, y) = ((index % width) as u32 / TILE, (index / width) as u32 / TILE);
            u64::from(y) * tiles_across + u64::from(x) < tiles
        };
        // A pixel that an interrupted pass has brought further keeps what it has.
        let is_new = |film: &Film, index: usize| {
            is_done(index) && film.pixels[index].samples() == first_sample
        };
        if film.has_layers() {
            let bytes =
                self.buffers.read("surfaces", (pixels * size_of::<SurfaceSums>()) as u64)?;
            let surfaces: Vec<SurfaceSums> = bytemuck::pod_collect_to_vec(&bytes);
            for (index, sums) in surfaces.iter().enumerate() {
                if is_new(film, index) {
                    let hits = sums.hits as u32;
                    film.surfaces[index].add_sums(sums.albedo, sums.normal, sums.depth, hits);
                }
            }
        }
        let done = film
            .pixels
            .par_iter_mut()
            .zip(&sums)
            .enumerate()
            .map(|(index, (pixel, sums))| {
                if !is_done(index) || pixel.samples() != first_sample {
                    return (0, 0);
                }
                pixel.add_sums(sums.sum, sums.luminance_squared, samples, sums.invalid);
                (u64::from(samples), u64::from(sums.rays))
            })
            .reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        Ok(done)
    }

    /// Figures of the device and of what the kernels leave out.
    pub(crate) fn figures(&self) -> GpuFigures {
        GpuFigures {
            adapter: self.gpu.facts().clone(),
            device_bytes: self.buffers.bytes(),
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
        Ok(bytemuck::pod_collect_to_vec(&self.buffers.read(name, 4 * count as u64)?))
    }

    /// Runs a kernel to its end; returns the seconds it took.
    fn dispatch(&self, pipeline: &Pipeline, work: &Work, groups: u32) -> Result<f64> {
        let bind_group = self.bind_group(pipeline)?;
        self.buffers.write("globals", 0, bytemuck::bytes_of(work));
        let mut commands = self.gpu.device.create_command_encoder(&Default::default());
        {
            let mut pass = commands.begin_compute_pass(&Default::default());
            pass.set_pipeline(&pipeline.pipeline);
            pass.set_bind_group(0, &bind_group, &[]);
            pass.dispatch_workgroups(groups, 1, 1);
        }
        let start = std::time::Instant::now();
        let submission = self.gpu.queue.submit([commands.finish()]);
        self.gpu.wait_for(Some(submission))?;
        Ok(start.elapsed().as_secs_f64())
    }

    fn bind_group(&self, pipeline: &Pipeline) -> Result<wgpu::BindGroup> {
        let missing = |name| Error::new(format!("the shader's {name} was not uploaded"));
        let mut views = Vec::new();
        for binding in &pipeline.program.bindings {
            if let Binding::Array(array) = binding {
                let texture = self.buffers.array(array.name).ok_or_else(|| missing(array.name))?;
                views.push(texture.create_view(&wgpu::TextureViewDescriptor::default()));
            }
        }
        let mut next_view = views.iter();
        let mut entries = Vec::new();
        for (binding, index) in pipeline.program.bindings.iter().zip(0..) {
            let resource = match binding {
                Binding::Buffer { name, .. } => {
                    self.buffers.get(name).ok_or_else(|| missing(name))?.as_entire_binding()
                }
                Binding::Array(array) => wgpu::BindingResource::TextureView(
                    next_view.next().ok_or_else(|| missing(array.name))?,
                ),
            };
            entries.push(wgpu::BindGroupEntry { binding: index, resource });
        }
        Ok(self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.layout,
            entries: &entries,
        }))
    }
}

/// The first tile with a pixel that has no more than these samples.
fn first_undone(film: &Film, samples: u32) -> u64 {
    let tiles_across = film.width.div_ceil(TILE);
    let tile_of = |(y, row): (usize, &[Pixel])| {
        let x = row.iter().position(|pixel| pixel.samples() <= samples)?;
        Some(y as u32 / TILE * tiles_across + x as u32 / TILE)
    };
    let rows = film.pixels.chunks(film.width as usize).enumerate();
    rows.filter_map(tile_of).min().map_or(0, u64::from)
}

/// Uploads the small tables of numbers; says where each begins.
fn upload_tables(
    buffers: &mut Buffers,
    view: &View,
    environment: &Environment,
    features: &Features,
    constants: &mut Constants,
) -> Result<()> {
    let mut texels = albedo::texels();
    constants.sheen_at = texels.len() as u32;
    if features.has("sheen") {
        texels.extend(sheen::texels());
    }
    constants.filter_at = texels.len() as u32;
    texels.extend(view.filter.cumulative().iter().map(|&sum| [sum, 0.0, 0.0, 0.0]));
    constants.rows_at = texels.len() as u32;
    texels.extend(layout::map_rows(environment));
    put_array(buffers, "tables", "the list of constants", &texels)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::EnvironmentOptions;
    use crate::light_grid::cells::SphericalGrid;
    use crate::light_grid::{LawOptions, Recording};
    use crate::path::{Background, PathLimits, PathTracer};
    use crate::render::{Sampling, cpu};
    use crate::sampler::{Points, Sequence};
    use crate::scene::builtin;

    fn crack() -> (World, Environment) {
        let world = World::new(builtin::build("crack").expect("built in"));
        let map = crate::environment::sky::build("sunset", 128, 64).expect("a sky");
        let environment =
            Environment::new(map, &EnvironmentOptions::default()).expect("a sound map");
        (world, environment)
    }

    fn view(world: &World, recording: LawOptions) -> View {
        let talk = recording == LawOptions::TALK;
        View {
            camera: world.scene.cameras[0].clone(),
            width: 64,
            height: 36,
            filter: crate::render::filter::PixelFilter::Box,
            sampling: if talk { Sampling::Talk } else { Sampling::Adaptive },
            limits: PathLimits { bounces: 4, russian_roulette: true },
            seed: 5,
            points: Points::Sobol,
            grid_columns: 64,
            learning_paths: 1 << 13,
            laws: recording,
            medium: None,
            background: Background::Map,
            crop: None,
            layers: false,
        }
    }

    /// Visits of each cell and, cell by cell, tile counters after two learning passes, the second with
    /// laws of the first, and a rendering pass of which a third is counted, if rendered paths count.
    fn learn(gpu: Option<&Gpu>, recording: LawOptions) -> (Vec<u32>, Vec<u32>, u64) {
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
        let mut laws = LightGrid::whole_map(environment.tile_energies());
        let never = AtomicBool::new(false);
        let mut renderer = gpu.map(|gpu| {
            let stage = Stage::new(gpu, &world, &environment).expect("it fits");
            Renderer::new(&stage, &world, &environment, &view, &rays).expect("it fits")
        });
        let mut traced = 0;
        for paths in [Some(0..4096), Some(4096..16384), None] {
            let mut film = Film::new(view.width, view.height, false);
            let pass = Pass { target: 4, stride: 3, sequence: Sequence::default() };
            let rendered = recording.goes_on().then_some(pass);
            traced += match (&mut renderer, paths) {
                (Some(renderer), paths) => {
                    renderer.set_grid(laws.as_ref()).expect("uploaded");
                    let counts = Some(&learning);
                    match (paths, rendered) {
                        (Some(paths), _) => renderer.learn(paths, &learning, &never),
                        (None, Some(pass)) => {
                            renderer.render(pass, &mut film, counts, &never).map(|done| done.1)
                        }
                        (None, None) => Ok(0),
                    }
                    .expect("done")
                }
                (None, paths) => {
                    let tracer = PathTracer {
                        world: &world,
                        environment: &environment,
                        grid: laws.as_ref(),
                        fog: view.fog(&world),
                        background: Background::Map,
                        limits: view.limits,
                        counts: Some(&learning),
                    };
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
            laws = learning.laws(&environment);
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
        let gpu = match Gpu::open(None) {
            Ok(gpu) => gpu,
            Err(reason) => return eprintln!("SKIPPED: {reason}"),
        };
        let (world, environment) = crack();
        let view = View { sampling: Sampling::Plain, ..view(&world, LawOptions::ADAPTIVE) };
        let rays = CameraRays::new(&view.camera, view.width, view.height);
        let stage = Stage::new(&gpu, &world, &environment).expect("it fits");
        let mut renderer =
            Renderer::new(&stage, &world, &environment, &view, &rays).expect("it fits");
        let grid = LightGrid::whole_map(environment.tile_energies());
        renderer.set_grid(grid.as_ref()).expect("uploaded");
        let mut films = [true, false].map(|_| Film::new(view.width, view.height, false));
        let pass = Pass { target: 3, stride: 1, sequence: Sequence::default() };
        renderer.render(pass, &mut films[0], None, &AtomicBool::new(false)).expect("rendered");
        let mut calls = 0;
        while films[1].min_samples() < pass.target {
            assert!(calls < 1000, "{} of the samples are there", films[1].total_samples());
            let cancel = Arc::new(AtomicBool::new(false));
            let cut = Arc::clone(&cancel);
            // One group of tiles at a time, or none: the pacer starts small.
            renderer.render_pacer = Pacer::default();
            let cutter = std::thread::Builder::new().name("cutter".to_owned()).spawn(move || {
                std::thread::sleep(std::time::Duration::from_millis(2));
                cut.store(true, Ordering::Relaxed);
            });
            renderer.render(pass, &mut films[1], None, &cancel).expect("rendered");
            cutter.expect("a thread").join().expect("it only sleeps");
            calls += 1;
        }
        assert!(calls > 1, "it was cut");
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
        let squared = LawOptions {
            faces: false,
            recording: Recording::VisibleCosineSquared,
            ..LawOptions::ADAPTIVE
        };
        for recording in [LawOptions::ADAPTIVE, LawOptions::TALK, squared] {
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
}
