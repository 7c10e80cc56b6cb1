//! Adapters: what there is, which one to take, and a connection to it.

use std::sync::{Arc, Mutex, OnceLock, PoisonError, RwLock};

use wgpu::wgt::WgpuHasDisplayHandle;
use wgpu::{Adapter, Backends, DeviceType, ErrorFilter, Features, Instance, InstanceDescriptor};
use wgpu::{Limits, PollType, SubmissionIndex, Surface};

use super::kernel_cache::KernelCache;
use crate::error::{Error, Result};
use crate::render::gpu_facts::{AdapterFacts, RayChoice, Schedule};

impl AdapterFacts {
    fn of(adapter: &Adapter) -> Self {
        let info = adapter.get_info();
        let limits = adapter.limits();
        Self {
            name: info.name,
            backend: match info.backend {
                wgpu::Backend::Gl => "OpenGL".to_owned(),
                other => format!("{other:?}"),
            },
            kind: match info.device_type {
                DeviceType::DiscreteGpu => "discrete",
                DeviceType::IntegratedGpu => "integrated",
                DeviceType::VirtualGpu => "virtual",
                DeviceType::Cpu => "software",
                DeviceType::Other => "other",
            },
            driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
            storage_binding_bytes: limits.max_storage_buffer_binding_size,
            buffer_bytes: limits.max_buffer_size,
            storage_buffers: limits.max_storage_buffers_per_shader_stage,
            can_compute: limits.max_compute_invocations_per_workgroup >= 64,
            has_ray_queries: adapter.features().contains(Features::EXPERIMENTAL_RAY_QUERY)
                && limits.max_acceleration_structures_per_shader_stage > 0,
        }
    }

    /// Discrete before integrated before the rest; Vulkan and Metal before DX12, whose old compiler takes long for our
    /// kernels, before OpenGL.
    fn rank(&self) -> (usize, bool, bool) {
        const KINDS: [&str; 5] = ["discrete", "integrated", "virtual", "other", "software"];
        let kind = KINDS.iter().position(|kind| *kind == self.kind).unwrap_or(KINDS.len());
        (kind, self.backend == "OpenGL", self.backend == "Dx12")
    }
}

/// What is said where there is no adapter.
pub(crate) const NO_GPU: &str = "no GPU: neither Vulkan, Metal, DX12 nor OpenGL has an adapter";

/// All adapters of this machine, the best one first.
pub fn adapters() -> Vec<AdapterFacts> {
    let found = enumerate(&instance(PRIMARY | Backends::GL, None), None);
    found.into_iter().map(|(facts, _)| facts).collect()
}

/// What is asked first: OpenGL is only the fallback.
const PRIMARY: Backends = Backends::VULKAN.union(Backends::METAL).union(Backends::DX12);

fn instance(backends: Backends, display: Option<Box<dyn WgpuHasDisplayHandle>>) -> Instance {
    let usual = InstanceDescriptor::new_without_display_handle();
    Instance::new(InstanceDescriptor { backends, display, ..usual })
}

/// The adapters that can compute, and draw on the surface if there is one; the best one first.
fn enumerate(instance: &Instance, surface: Option<&Surface<'_>>) -> Vec<(AdapterFacts, Adapter)> {
    let mut found: Vec<_> = pollster::block_on(instance.enumerate_adapters(Backends::all()))
        .into_iter()
        .filter(|adapter| surface.is_none_or(|surface| adapter.is_surface_supported(surface)))
        .map(|adapter| (AdapterFacts::of(&adapter), adapter))
        .filter(|(facts, _)| facts.can_compute)
        .collect();
    found.sort_by_key(|(facts, _)| facts.rank());
    found
}

/// A connection to an adapter; clones share it.
#[derive(Clone)]
pub struct Gpu {
    facts: AdapterFacts,
    pub(crate) instance: Instance,
    pub(crate) adapter: Adapter,
    pub(crate) limits: Limits,
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    /// The first thing that went wrong.
    trouble: Arc<OnceLock<String>>,
    /// Held by whoever submits, and alone by whoever needs a device with nothing to do.
    submitting: Arc<RwLock<()>>,
    /// Whether frames of a window are drawn on it too.
    pub(super) has_window: bool,
    hardware_rays: bool,
    pub(super) kernels: Arc<Mutex<KernelCache>>,
    /// Whether read-only arrays lie in storage buffers.
    pub(super) prefers_buffers: bool,
    /// How kernels share the work, whatever suits it.
    pub(super) schedule: Option<Schedule>,
}

/// Storage buffers that a kernel has at most, arrays among them. Metal allows 29.
pub(super) const MAX_STORAGE_BUFFERS: u32 = 28;

/// What wgpu 30 says where [`Gpu::alone`] should have been asked, but egui's painter cannot.
const SURFACE_IS_BUSY: &str = "come idle before reconfiguring the Surface";

impl Gpu {
    /// Opens the best adapter that can be opened, of all or of those whose name or backend contains `name` (in any
    /// case).
    ///
    /// # Errors
    /// If there is none, or none can be opened: why the best one cannot.
    pub fn open(name: Option<&str>) -> Result<Self> {
        Self::open_or_share(name, None)
    }

    /// For a test: the best adapter; `None`, which is said, if there is none.
    #[cfg(test)]
    pub(crate) fn for_test() -> Option<Self> {
        Self::open(None).inspect_err(|reason| eprintln!("SKIPPED: {reason}")).ok()
    }

    /// [`Self::open`], but a clone of `shared` if that is the GPU chosen and still of use.
    ///
    /// # Errors
    /// As [`Self::open`].
    pub(crate) fn open_or_share(name: Option<&str>, shared: Option<&Self>) -> Result<Self> {
        let (mut others, mut failure) = (Vec::new(), None);
        for backends in [PRIMARY, Backends::GL] {
            let instance = instance(backends, None);
            for (facts, adapter) in enumerate(&instance, None) {
                if !facts.is_called(name) {
                    others.push(facts.title());
                    continue;
                }
                if let Some(shared) = shared
                    && shared.facts == facts
                    && shared.check().is_ok()
                {
                    return Ok(shared.clone());
                }
                match Self::connect(facts, instance.clone(), adapter) {
                    Ok(gpu) => return Ok(gpu),
                    Err(error) => drop(failure.get_or_insert(error)),
                }
            }
        }
        Err(failure.unwrap_or_else(|| {
            Error::new(match name {
                Some(name) if !others.is_empty() => {
                    format!("no adapter is called {name}; there are {}", others.join(", "))
                }
                _ => NO_GPU.to_owned(),
            })
        }))
    }

    /// Opens the best adapter that can draw on a window, be it called `name` or, if none of those
    /// can, otherwise.
    ///
    /// # Errors
    /// If none that can compute can draw there, or it cannot be opened.
    pub(crate) fn open_for_window<W>(
        name: Option<&str>,
        display: &(impl WgpuHasDisplayHandle + Clone),
        window: &Arc<W>,
    ) -> Result<Self>
    where
        W: wgpu::DisplayAndWindowHandle + 'static,
    {
        let mut reason = "no Vulkan, Metal, DX12 or OpenGL can compute and draw here".to_owned();
        for backends in [PRIMARY, Backends::GL] {
            let instance = instance(backends, Some(Box::new(display.clone())));
            let surface = match instance.create_surface(Arc::clone(window)) {
                Ok(surface) => surface,
                Err(error) => {
                    reason = one_line(&error.to_string());
                    continue;
                }
            };
            let mut found = enumerate(&instance, Some(&surface));
            found.sort_by_key(|(facts, _)| !facts.is_called(name));
            for (facts, adapter) in found {
                match Self::connect(facts, instance.clone(), adapter) {
                    Ok(gpu) => return Ok(Self { has_window: true, ..gpu }),
                    Err(error) => reason = error.to_string(),
                }
            }
        }
        Err(Error::new(reason))
    }

    fn connect(facts: AdapterFacts, instance: Instance, adapter: Adapter) -> Result<Self> {
        let limits = adapter.limits();
        let wanted = Features::TIMESTAMP_QUERY | Features::EXPERIMENTAL_RAY_QUERY;
        // SAFETY: asks to accept that ray queries of wgpu may have bugs; kernels ask about finite rays
        // only, and read what a query found once it has ended.
        let experimental_features = unsafe { wgpu::ExperimentalFeatures::enabled() };
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("lightgrid"),
            required_features: adapter.features() & wanted,
            experimental_features,
            required_limits: limits.clone(),
            // What is on a device is few and large: shared blocks would be filled with holes.
            memory_hints: wgpu::MemoryHints::MemoryUsage,
            ..wgpu::DeviceDescriptor::default()
        }))
        .map_err(|e| Error::new(format!("{} cannot be opened: {e}", facts.name)))?;
        let trouble = Arc::new(OnceLock::new());
        let (lost, failed) = (Arc::clone(&trouble), Arc::clone(&trouble));
        device.set_device_lost_callback(move |_, message| {
            let cause = one_line(&message);
            let cause = if cause.is_empty() { cause } else { format!(": {cause}") };
            let _ = lost.set(format!("the device was lost{cause}"));
        });
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            let sentence = sentence(&error);
            // Of a surface that could be better, which is as it was and will be configured again.
            if !sentence.contains(SURFACE_IS_BUSY) {
                let _ = failed.set(sentence);
            }
        }));
        let prefers_buffers = !facts.is_software() && facts.storage_buffers >= MAX_STORAGE_BUFFERS;
        let gpu = Self {
            facts,
            instance,
            adapter,
            limits,
            device,
            queue,
            trouble,
            submitting: Arc::default(),
            has_window: false,
            hardware_rays: false,
            kernels: Arc::default(),
            prefers_buffers,
            schedule: None,
        };
        gpu.with_rays(RayChoice::Auto)
    }

    /// The same device with read-only arrays in storage buffers, whatever it prefers.
    #[cfg(test)]
    pub(super) fn with_arrays_in_buffers(mut self) -> Self {
        self.prefers_buffers = true;
        self
    }

    /// The same connection with kernels that share the work so, whatever suits the device; `None` is
    /// what suits it.
    #[must_use]
    pub fn with_schedule(mut self, schedule: Option<Schedule>) -> Self {
        self.schedule = schedule;
        self
    }

    /// What it is.
    pub fn facts(&self) -> &AdapterFacts {
        &self.facts
    }

    /// Whether both are clones of one connection: only then may they use each other's buffers.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        // wgpu 30 takes devices of two instances for equal.
        Arc::ptr_eq(&self.trouble, &other.trouble)
    }

    /// The same connection with rays traced as is asked for.
    ///
    /// # Errors
    /// If it has no ray queries but they are asked for.
    pub fn with_rays(mut self, choice: RayChoice) -> Result<Self> {
        self.hardware_rays = match choice {
            RayChoice::Auto => self.facts.has_ray_queries && !self.facts.is_software(),
            RayChoice::Hardware if !self.facts.has_ray_queries => {
                return Err(Error::new(format!("{} has no ray queries", self.facts.name)));
            }
            RayChoice::Hardware => true,
            RayChoice::Software => false,
        };
        Ok(self)
    }

    /// Whether its own ray queries find what rays hit.
    pub fn has_hardware_rays(&self) -> bool {
        self.hardware_rays
    }

    /// The first thing that went wrong on the device, if any did; it is of no use afterwards.
    ///
    /// # Errors
    /// One sentence with the adapter's name.
    pub fn check(&self) -> Result<()> {
        let named = |trouble| Err(Error::new(format!("{}: {trouble}", self.facts.name)));
        self.trouble.get().map_or(Ok(()), named)
    }

    /// Makes something on the device. What it has no room for, or will not take, is an error of that alone: the
    /// device stays of use.
    ///
    /// # Errors
    /// Why it could not be made, or as [`Self::check`].
    pub(crate) fn make<T>(&self, make: impl FnOnce(&wgpu::Device) -> T) -> Result<T> {
        let filters = [ErrorFilter::Internal, ErrorFilter::Validation, ErrorFilter::OutOfMemory];
        let scopes = filters.map(|filter| self.device.push_error_scope(filter));
        let made = make(&self.device);
        let errors = scopes.into_iter().rev().map(|scope| pollster::block_on(scope.pop()));
        // All are ended, whatever the first one says.
        let errors: Vec<_> = errors.collect();
        self.check()?;
        match errors.iter().flatten().next() {
            None => Ok(made),
            Some(error) => Err(Error::new(format!("{}: {}", self.facts.name, sentence(error)))),
        }
    }

    /// Waits until everything submitted so far is done.
    ///
    /// # Errors
    /// As [`Self::check`].
    pub(crate) fn wait_for(&self, submission: Option<SubmissionIndex>) -> Result<()> {
        // Never with a timeout: then wgpu 30 panics if another thread sees the queue empty first.
        let waited =
            self.device.poll(PollType::Wait { submission_index: submission, timeout: None });
        self.check()?;
        waited.map(|_| ()).map_err(|e| Error::new(format!("{}: {e}", self.facts.name)))
    }

    /// Submits commands.
    pub(crate) fn submit(
        &self,
        commands: impl IntoIterator<Item = wgpu::CommandBuffer>,
    ) -> SubmissionIndex {
        let _one_of_many = self.submitting.read().unwrap_or_else(PoisonError::into_inner);
        self.queue.submit(commands)
    }

    /// Waits for what was written, so that staging memory is given back.
    ///
    /// # Errors
    /// As [`Self::check`].
    pub(super) fn finish_copies(&self) -> Result<()> {
        self.submit([]);
        self.wait_for(None)
    }

    /// Does something while no other thread submits: wgpu 30 configures a window's surface once the device has
    /// nothing to do, and fails if it is given something meanwhile.
    pub(crate) fn alone<T>(&self, work: impl FnOnce() -> T) -> T {
        let _alone = self.submitting.write().unwrap_or_else(PoisonError::into_inner);
        work()
    }

    /// Gives the device up, as a driver reset would; for tests of what happens then.
    pub fn lose(&self) {
        self.device.destroy();
        let _ = self.device.poll(PollType::Poll);
    }
}

/// What is said of an error.
fn sentence(error: &wgpu::Error) -> String {
    match error {
        wgpu::Error::OutOfMemory { .. } => "it is out of memory".to_owned(),
        other => one_line(&other.to_string()),
    }
}

/// A message of several lines as one sentence.
fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_device_refuses_does_not_cost_the_device() {
        let Some(gpu) = Gpu::for_test() else { return };
        let buffer = |size: u64| {
            gpu.make(|device| {
                device.create_buffer(&wgpu::BufferDescriptor {
                    label: None,
                    size,
                    usage: wgpu::BufferUsages::STORAGE,
                    mapped_at_creation: false,
                })
            })
        };
        let refused = buffer(gpu.limits.max_buffer_size + 4).map(|_| ());
        let reason = refused.expect_err("more than there may be").to_string();
        assert!(reason.starts_with(&gpu.facts.name) && !reason.contains('\n'), "{reason}");
        assert!(buffer(16).is_ok() && gpu.check().is_ok(), "it is as it was");
    }
}
