//! The GPU's schedule: the same paths in compute shaders, in dispatches too short to be felt.
//!
//! [`Renderer`] holds the scene, the map and the laws on a device and brings a [`Film`] forward as
//! `cpu` does. A pass sums at most [`MAX_PASS_SAMPLES`] samples of a pixel in f32 on the device; the
//! f64 film on the host adds up the passes, so that no precision is lost at any number of samples
//! and the work so far survives the device.

mod buffers;
mod device;
pub(crate) mod layout;
mod pacer;
pub(crate) mod shader;

use std::borrow::Cow;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::View;
use super::film::Film;
use crate::bsdf::albedo;
use crate::bvh::compressed::CompressedTree;
use crate::environment::Environment;
use crate::error::{Error, Result};
use crate::light_grid::{LearningGrid, LightGrid};
use crate::path::World;
use crate::path::camera::CameraRays;
use buffers::Buffers;
use layout::{Globals, PixelSums, SurfaceSums, Work};
use pacer::Pacer;
use shader::{Binding, Constants, Features, Kernel, Program, VertexTexels};

pub use device::{AdapterFacts, Gpu, adapters};

/// Most samples of a pixel that one pass sums in f32.
const MAX_PASS_SAMPLES: u32 = 64;
/// Pixels along a side of a workgroup's tile.
const TILE: u32 = 8;
/// Paths of a workgroup.
const GROUP: u64 = 64;
/// Most workgroups of one dispatch (WebGPU's limit along an axis).
const MAX_GROUPS: u64 = 65_535;
/// Deepest tree a traversal's stack is made for.
const MAX_DEPTH: u32 = 96;

/// What the device holds of a picture in the making.
pub(crate) struct Renderer<'a> {
    gpu: &'a Gpu,
    buffers: Buffers<'a>,
    globals: Globals,
    features: Features,
    constants: Constants,
    render: Option<Pipeline>,
    learn: Option<Pipeline>,
    render_pacer: Pacer,
    learn_pacer: Pacer,
    kernel_bytes: usize,
}

/// A kernel ready to run.
struct Pipeline {
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    program: Program,
}

/// What was left out of the kernels and what they take.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct GpuFigures {
    /// The device.
    pub adapter: AdapterFacts,
    /// Bytes of all buffers on it.
    pub device_bytes: u64,
    /// Features the kernels were built with.
    pub features: Vec<&'static str>,
    /// Bytes of the render kernel's source, and what they would be with every feature.
    pub kernel_source_bytes: [usize; 2],
}

impl<'a> Renderer<'a> {
    /// Uploads a scene and a map and builds the kernel for the view.
    ///
    /// # Errors
    /// If something does not fit on the device, with the numbers.
    pub(crate) fn new(
        gpu: &'a Gpu,
        world: &World,
        environment: &Environment,
        view: &View,
        rays: &CameraRays,
    ) -> Result<Self> {
        let features = Features::of(world, environment, view);
        let mut buffers = Buffers::new(gpu);
        let mut globals = Globals::default();
        globals.set_view(view, rays);
        globals.set_environment(environment);
        let mut constants = upload_world(&mut buffers, &mut globals, world, &features)?;
        upload_map(&mut buffers, &mut globals, environment, &features)?;
        upload_tables(&mut buffers, view, environment, &mut constants)?;
        let pixels = u64::from(view.width) * u64::from(view.height);
        buffers.make("film", pixels * size_of::<PixelSums>() as u64, "the picture")?;
        if features.has("layers") {
            let bytes = pixels * size_of::<SurfaceSums>() as u64;
            buffers.make("surfaces", bytes, "the picture's layers")?;
        }
        buffers.make("globals", size_of::<Globals>() as u64, "the view")?;
        let mut renderer = Self {
            gpu,
            buffers,
            globals,
            features,
            constants,
            render: None,
            learn: None,
            render_pacer: Pacer::default(),
            learn_pacer: Pacer::default(),
            kernel_bytes: 0,
        };
        renderer.write_globals();
        let render = renderer.pipeline(Kernel::Render)?;
        renderer.kernel_bytes = render.program.source.len();
        renderer.render = Some(render);
        // Now rather than when it is used: building kernels is no learning.
        if renderer.features.has("light_grid") {
            renderer.learn = Some(renderer.pipeline(Kernel::Learn)?);
        }
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
        self.globals.set_cells(&learning.grid);
        self.write_globals();
        let (visits, slots, blocks) = learning.counters.words();
        self.buffers.put("visits", bytemuck::cast_slice(&visits), "the light grid's cells")?;
        self.buffers.put("slot_of_cell", bytemuck::cast_slice(slots), "the light grid's cells")?;
        let mut counters: &[u32] = &blocks;
        if counters.is_empty() {
            counters = &[0];
        }
        self.buffers.put("counters", bytemuck::cast_slice(counters), "the learning counters")?;
        self.buffers.put("learning_rays", &[0; 4], "a count")?;
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
            let seconds = self.dispatch(Kernel::Learn, &work, groups as u32)?;
            self.learn_pacer.record(groups, seconds);
            first += count;
        }
        let visits = self.read_words("visits", visits.len())?;
        let counted = self.read_words("counters", blocks.len())?;
        learning.counters.set_words(&visits, &counted);
        Ok(self.read_words("learning_rays", 1)?.first().copied().map_or(0, u64::from))
    }

    /// Brings every pixel of the film to `target` samples; returns the numbers of samples and rays.
    pub(crate) fn render(
        &mut self,
        target: u32,
        film: &mut Film,
        cancel: &AtomicBool,
    ) -> Result<(u64, u64)> {
        let tiles = u64::from(film.width.div_ceil(TILE)) * u64::from(film.height.div_ceil(TILE));
        let mut done = (0, 0);
        while film.min_samples() < target && !cancel.load(Ordering::Relaxed) {
            let first = film.min_samples();
            let samples = first..target.min(first + MAX_PASS_SAMPLES);
            let finished = self.render_pass(samples.clone(), tiles, cancel)?;
            let (samples, rays) = self.add_to(film, samples, finished)?;
            done = (done.0 + samples, done.1 + rays);
        }
        Ok(done)
    }

    /// Takes these samples of each pixel, summed up in order, so that the sums do not depend on how
    /// the work is cut into dispatches; returns how many tiles are done.
    fn render_pass(&mut self, pass: Range<u32>, tiles: u64, cancel: &AtomicBool) -> Result<u64> {
        let length = u64::from(pass.end - pass.start);
        let mut first = 0;
        while first < tiles {
            let affordable = self.render_pacer.units() / length;
            let count = affordable.clamp(LEAST_TILES, MAX_GROUPS).min(tiles - first);
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
                    ..Work::default()
                };
                let seconds = self.dispatch(Kernel::Render, &work, count as u32)?;
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
                    film.surfaces[index].add_sums(sums.albedo, sums.normal, sums.depth, sums.hits);
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
        let every = Features::from_names(
            Features::ALL.into_iter().filter(|n| !n.starts_with("table_")).map(|n| (n, true)),
        );
        let full = Program::new(Kernel::Render, &every, &self.constants, self.buffers.width_log2());
        GpuFigures {
            adapter: self.gpu.facts().clone(),
            device_bytes: self.buffers.bytes(),
            features: self.features.names().collect(),
            kernel_source_bytes: [self.kernel_bytes, full.source.len()],
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
    fn dispatch(&self, kernel: Kernel, work: &Work, groups: u32) -> Result<f64> {
        let pipeline = match kernel {
            Kernel::Render => &self.render,
            Kernel::Learn => &self.learn,
        };
        let Some(pipeline) = pipeline else { return Ok(0.0) };
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

    fn pipeline(&self, kernel: Kernel) -> Result<Pipeline> {
        let program =
            Program::new(kernel, &self.features, &self.constants, self.buffers.width_log2());
        let device = &self.gpu.device;
        let entries: Vec<_> = program
            .bindings
            .iter()
            .zip(0..)
            .map(|(binding, index)| wgpu::BindGroupLayoutEntry {
                binding: index,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: binding_type(binding),
                count: None,
            })
            .collect();
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(kernel.name()),
            entries: &entries,
        });
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(kernel.name()),
            source: wgpu::ShaderSource::Wgsl(Cow::Borrowed(&program.source)),
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(kernel.name()),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(kernel.name()),
            layout: Some(&pipeline_layout),
            module: &module,
            entry_point: Some(kernel.name()),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        self.gpu.check()?;
        Ok(Pipeline { pipeline, layout, program })
    }
}

fn binding_type(binding: &Binding) -> wgpu::BindingType {
    match binding {
        Binding::Buffer { is_written, .. } => wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only: !is_written },
            has_dynamic_offset: false,
            min_binding_size: None,
        },
        Binding::Array(array) => wgpu::BindingType::Texture {
            sample_type: if array.format.is_float() {
                wgpu::TextureSampleType::Float { filterable: false }
            } else {
                wgpu::TextureSampleType::Uint
            },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        },
    }
}

/// Tiles of a dispatch that keep a device with few cores busy.
const LEAST_TILES: u64 = 4;

/// Uploads geometry, materials, textures and lights; returns what kernels are told of them.
fn upload_world(
    buffers: &mut Buffers<'_>,
    globals: &mut Globals,
    world: &World,
    features: &Features,
) -> Result<Constants> {
    let scene = &world.scene;
    let tree = CompressedTree::build(&scene.positions, &scene.triangles);
    if tree.depth > MAX_DEPTH {
        return Err(Error::new(format!(
            "the scene's tree is {} levels deep; a GPU walks at most {MAX_DEPTH}",
            tree.depth
        )));
    }
    let bounds = world.bvh.bounds();
    globals.scene_extent = bounds.0.abs().max(bounds.1.abs()).max_element();
    put_array(buffers, "bvh_nodes", "the scene's tree", tree.nodes.as_flattened())?;
    put_array(buffers, "bvh_triangles", "the scene's geometry", tree.triangles.as_flattened())?;
    let vertex = VertexTexels::of(features);
    put_array(buffers, "triangles", "the scene's geometry", &layout::triangles(scene))?;
    put_array(buffers, "vertices", "the scene's geometry", &layout::vertices(scene, &vertex))?;
    let (materials, texture_refs) = layout::materials(world);
    put_array(buffers, "materials", "the list of materials", &materials)?;
    if features.has("textures") {
        put_array(buffers, "texture_refs", "the list of textures", &texture_refs)?;
        let texels = scene.images.iter().map(|image| image.texels.len() as u64).sum();
        let images = scene.images.iter().map(|image| bytemuck::cast_slice(&image.texels));
        buffers.put_array("texels", "the set of textures", texels, images.map(Cow::Borrowed))?;
    }
    if features.has("scene_lights") {
        let lights = layout::light_words(world, globals);
        put_array(buffers, "lights", "the list of lights", &lights)?;
    }
    Ok(Constants { stack_size: tree.depth, vertex, ..Constants::default() })
}

/// Makes an array of values that take whole texels or parts of one.
fn put_array<T: bytemuck::Pod>(
    buffers: &mut Buffers<'_>,
    name: &'static str,
    what: &str,
    values: &[T],
) -> Result<()> {
    let bytes: &[u8] = bytemuck::cast_slice(values);
    let texel_bytes = shader::ARRAYS.iter().find(|kind| kind.name == name);
    let texels = bytes.len() as u64 / texel_bytes.map_or(4, |kind| kind.format.bytes());
    buffers.put_array(name, what, texels, std::iter::once(Cow::Borrowed(bytes)))
}

/// Uploads the map's radiance and its importance table.
fn upload_map(
    buffers: &mut Buffers<'_>,
    globals: &mut Globals,
    environment: &Environment,
    features: &Features,
) -> Result<()> {
    if features.has("map") {
        let map = environment.map();
        let rows = map.pixels.chunks(map.width as usize * 64).map(|rows| {
            let words: Vec<[u32; 2]> =
                rows.par_iter().map(|rgb| layout::pack_radiance(*rgb)).collect();
            Cow::Owned(bytemuck::pod_collect_to_vec(&words))
        });
        buffers.put_array("map_texels", "the map", map.pixels.len() as u64, rows)?;
    }
    if features.has("map_sampling") {
        let parts = environment.table_words();
        globals.tile_sums_at = parts[0].len() as u32;
        let words = parts.iter().map(|part| part.len() as u64).sum();
        let bytes = parts.iter().map(|part| Cow::Borrowed(bytemuck::cast_slice(part)));
        buffers.put_array("sums", "the map's importance table", words, bytes)?;
    }
    Ok(())
}

/// Uploads the small tables of numbers; says where each begins.
fn upload_tables(
    buffers: &mut Buffers<'_>,
    view: &View,
    environment: &Environment,
    constants: &mut Constants,
) -> Result<()> {
    let mut texels = albedo::texels();
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
    use crate::light_grid::LawOptions;
    use crate::light_grid::cells::SphericalGrid;
    use crate::path::{PathLimits, PathTracer};
    use crate::render::{Sampling, cpu};
    use crate::sampler::Points;
    use crate::scene::builtin;

    /// Visits of each cell and tile counters after two passes, the second with laws of the first.
    fn learn(gpu: Option<&Gpu>, recording: LawOptions) -> (Vec<u32>, Vec<u32>, u64) {
        let world = World::new(builtin::build("crack").expect("built in"));
        let map = crate::environment::sky::build("sunset", 128, 64).expect("a sky");
        let environment =
            Environment::new(map, &EnvironmentOptions::default()).expect("a sound map");
        let talk = recording == LawOptions::TALK;
        let view = View {
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
            layers: false,
        };
        let rays = CameraRays::new(&view.camera, view.width, view.height);
        let grid = SphericalGrid { center: rays.position, columns: 64, rows: 32, faces: !talk };
        let mut learning = LearningGrid::new(grid, environment.tile_count(), recording);
        let mut laws = LightGrid::whole_map(environment.tile_energies());
        let never = AtomicBool::new(false);
        let mut renderer =
            gpu.map(|gpu| Renderer::new(gpu, &world, &environment, &view, &rays).expect("it fits"));
        let mut traced = 0;
        for pass in [0..2048, 2048..8192] {
            traced += match &mut renderer {
                Some(renderer) => {
                    renderer.set_grid(laws.as_ref()).expect("uploaded");
                    renderer.learn(pass, &learning, &never).expect("learned")
                }
                None => {
                    let tracer = PathTracer {
                        world: &world,
                        environment: &environment,
                        grid: laws.as_ref(),
                        limits: view.limits,
                    };
                    cpu::learn(&tracer, &rays, &view, pass, &learning, &never)
                }
            };
            learning.counters.end_pass();
            laws = learning.laws(&environment);
        }
        let (visits, _, blocks) = learning.counters.words();
        (visits, blocks, traced)
    }

    /// Rounding sends a path in a thousand to another triangle, texel or cell; what it meets from
    /// there on differs. So one count in 500 may lie elsewhere.
    #[test]
    fn both_devices_learn_the_same_counters() {
        let gpu = match Gpu::open(None) {
            Ok(gpu) => gpu,
            Err(reason) => return eprintln!("SKIPPED: {reason}"),
        };
        for recording in [LawOptions::ADAPTIVE, LawOptions::TALK] {
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
