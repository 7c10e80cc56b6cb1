//! What kernels of a view need on the device, and sending them there.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use super::super::View;
use super::bound::Bound;
use super::buffers::Buffers;
use super::device::Gpu;
use super::features::{self, Features, KernelFeatures, ViewFeatures};
use super::film;
use super::flight::{Flights, Job};
use super::kernel::Kernel;
use super::kernel_cache::Pipeline;
use super::layout::{self, Globals, Work};
use super::pipeline::Programs;
use super::progress::Tiles;
use super::shader::{Constants, Program};
use super::uploaded_scene::{UploadedScene, put_array, put_lights};
use crate::bsdf::{albedo, rescatter, sheen};
use crate::environment::Environment;
use crate::error::{Error, Result};
use crate::path::{Lit, LocalLights, World};
use crate::scene::needs::SceneFeatures;

/// Tiles of a dispatch that keep a software device's cores busy.
const MIN_TILES_ON_SOFTWARE: u64 = 4;
/// Tiles of a dispatch that keep a small and a large real device busy.
const MIN_TILES: [u64; 2] = [64, 1024];

/// The buffers and kernels of a view, and their dispatches under way.
pub(super) struct Dispatcher {
    pub(super) gpu: Gpu,
    pub(super) buffers: Buffers,
    pub(super) globals: Globals,
    pub(super) features: Features,
    pub(super) constants: Constants,
    pub(super) flights: Flights,
    /// Seed of the view.
    pub(super) seed: u32,
    kernels: BTreeMap<Kernel, Bound>,
    /// Seconds of waiting for them.
    pub(super) compile_seconds: f64,
}

impl Dispatcher {
    /// Uploads what a view needs beside scene and map, and the lights that count if not all do as they came with the
    /// scene; no kernel is compiled yet.
    ///
    /// # Errors
    /// If something does not fit on the device, with the numbers.
    pub(super) fn new(
        uploaded: &UploadedScene,
        (world, environment): Lit<'_>,
        view: &View,
        lights: Option<&LocalLights>,
    ) -> Result<Self> {
        features::check(view)?;
        let gpu = uploaded.buffers.gpu.clone();
        let mut features = Features::of(world, environment, view);
        features.kernel.set(KernelFeatures::HARDWARE_RAYS, gpu.has_hardware_rays());
        // GPUs may fuse products with sums.
        features.kernel.set(KernelFeatures::FUSING, !gpu.facts().is_software());
        let mut globals = uploaded.globals;
        globals.set_view(view, &view.rays());
        globals.set_fog(view.fog(world).as_ref());
        globals.film_scale = film::scale_for(world.brightest(environment));
        let mut dispatcher = Self {
            flights: Flights::new(&gpu),
            gpu,
            buffers: uploaded.buffers.for_renderer(),
            globals,
            features,
            constants: Constants { shared_tile: view.shared_tile(), ..uploaded.constants },
            seed: view.seed,
            kernels: BTreeMap::new(),
            compile_seconds: 0.0,
        };
        dispatcher.put_tables(view, environment)?;
        if let Some(lights) = lights {
            dispatcher.put_lights(world, lights)?;
        }
        let buffers = &mut dispatcher.buffers;
        if features.view.contains(ViewFeatures::COUNTING) {
            // Until there is something to count.
            for name in ["visits", "slot_of_cell", "counters"] {
                buffers.make(name, 4, "the learning counters")?;
            }
        }
        buffers.make("globals", size_of::<Globals>() as u64, "the view")?;
        dispatcher.write_globals();
        Ok(dispatcher)
    }

    /// Uploads these lights.
    fn put_lights(&mut self, world: &World, lights: &LocalLights) -> Result<()> {
        let Self { buffers, globals, features, .. } = self;
        features.view.set(ViewFeatures::LOCAL_LIGHTS, !lights.is_empty());
        features.view.set(ViewFeatures::AIMING, lights.aiming.is_some());
        if features.scene_lights() {
            put_lights(buffers, globals, lights)?;
        }
        if !lights.emission.is_empty() {
            let (mut materials, _) = layout::materials(world);
            let pairs = materials.iter_mut().zip(&lights.emission);
            pairs.for_each(|(material, factor)| material.emissive *= factor);
            put_array(buffers, "materials", "the list of materials", &materials)?;
        }
        Ok(())
    }

    /// Uploads the small tables of numbers; says where each begins.
    fn put_tables(&mut self, view: &View, environment: &Environment) -> Result<()> {
        let Self { buffers, constants, features, .. } = self;
        let needed = |feature, table: fn() -> Vec<[f32; 4]>| {
            if features.scene.contains(feature) { table() } else { Vec::new() }
        };
        let sums = view.filter.cumulative().into_iter().flatten();
        let tables = [
            albedo::texels(),
            needed(SceneFeatures::SHEEN, sheen::texels),
            needed(SceneFeatures::ROUGH_GLASS, rescatter::texels),
            sums.map(|&sum| [sum, 0.0, 0.0, 0.0]).collect(),
            layout::map_rows(environment).collect(),
        ];
        let mut texels = Vec::new();
        for (at, table) in constants.tables_at.iter_mut().zip(tables) {
            *at = texels.len() as u32;
            texels.extend(table);
        }
        put_array(buffers, "tables", "the list of constants", &texels)
    }

    /// The tiles of the view.
    pub(super) fn tiles(&self) -> Tiles {
        Tiles { width: self.globals.width, height: self.globals.height }
    }

    /// How many tiles a dispatch has at least, if the device affords so many units of work: what takes a large
    /// one no time may take a small one so long that a desktop stutters.
    pub(super) fn min_tiles(&self, units: u64) -> u64 {
        let [small, large] = MIN_TILES;
        let is_software = self.gpu.facts().is_software();
        if is_software { MIN_TILES_ON_SOFTWARE } else { units.clamp(small, large) }
    }

    /// Waits until the device has nothing more to do.
    pub(super) fn settle(&mut self) -> Result<()> {
        self.flights.land_all(&self.gpu)
    }

    pub(super) fn write_globals(&self) {
        self.buffers.write("globals", 0, bytemuck::bytes_of(&self.globals));
    }

    pub(super) fn read_words(&self, name: &str, count: usize) -> Result<Vec<u32>> {
        if count == 0 {
            return Ok(Vec::new());
        }
        self.buffers.read(&[(name, 0, 4 * count as u64)], |read| {
            bytemuck::cast_slice::<u8, u32>(read[0]).to_vec()
        })
    }

    pub(super) fn programs(&self, kernels: &[Kernel]) -> Programs {
        let places = self.buffers.array_places();
        let program = |kernel| Program::new(kernel, self.features, &self.constants, &places);
        kernels.iter().map(|kernel| (*kernel, program(*kernel))).collect()
    }

    /// Compiles kernels, all of them at once: a real GPU's driver takes seconds for each.
    pub(super) fn compile(&mut self, kernels: &[Kernel]) -> Result<()> {
        let start = Instant::now();
        self.take_up(kernels, self.gpu.pipelines(self.programs(kernels))?);
        self.compile_seconds += start.elapsed().as_secs_f64();
        Ok(())
    }

    /// Takes kernels that are compiled.
    pub(super) fn take_up(&mut self, kernels: &[Kernel], compiled: Vec<Arc<Pipeline>>) {
        for (kernel, pipeline) in kernels.iter().zip(&compiled) {
            self.flights.resume(*kernel, &pipeline.last_units);
        }
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

    /// Sets kernels going, one after another, `steps` times in one submission; by the first one's speed the work was
    /// sized. Afterwards the first words of the buffer `report` are read.
    pub(super) fn dispatch(
        &mut self,
        order: &[Kernel],
        work: &Work,
        (steps, groups): (u32, u32),
        units: u64,
        report: Option<&str>,
    ) -> Result<()> {
        let kernels = order.iter().map(|kernel| self.bound(*kernel)).collect::<Result<Vec<_>>>()?;
        self.buffers.write("globals", 0, bytemuck::bytes_of(work));
        let report = report.and_then(|name| self.buffers.get(name));
        let job = Job { kernel: order[0], kernels: &kernels, steps, groups, units, report };
        self.flights.start(&self.gpu, &job)
    }
}
