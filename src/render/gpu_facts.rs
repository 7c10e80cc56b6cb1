//! GPUs as they are told of, whether rendering on them was built or not.

use serde::{Deserialize, Serialize};

/// Where to render.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DeviceChoice {
    /// A real GPU if there is one and everything fits on it, else the CPU.
    #[default]
    Auto,
    /// A GPU, be it a software one, or an error.
    Gpu,
    /// The CPU.
    Cpu,
}

/// What finds the surfaces that rays hit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RayChoice {
    /// A real GPU's own ray queries where it has them, else our kernels.
    #[default]
    Auto,
    /// The GPU's ray queries, or an error. They are not watertight to the last bit: a ray along an edge
    /// may hit another triangle or, seldom, none.
    Hardware,
    /// Our kernels.
    Software,
}

/// How kernels share the work of rendering.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Schedule {
    /// One does all.
    Whole,
    /// Three take turns.
    Queue,
}

/// What is asked of rays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Question {
    /// Where they end.
    ClosestHit,
    /// How much light comes along them.
    Transmittance,
}

/// What an adapter is and how much it allows.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct AdapterFacts {
    /// Name of the device.
    pub name: String,
    /// Vulkan, OpenGL, Metal or DX12.
    pub backend: String,
    /// `discrete`, `integrated`, `virtual`, `software` or `other`.
    pub kind: &'static str,
    /// Driver and version.
    pub driver: String,
    /// Most bytes of one storage binding.
    pub storage_binding_bytes: u64,
    /// Most bytes of one buffer.
    pub buffer_bytes: u64,
    /// Most storage buffers of a shader.
    pub storage_buffers: u32,
    /// Whether path tracing shaders can run at all.
    pub can_compute: bool,
    /// Whether it finds what rays hit by itself.
    pub has_ray_queries: bool,
}

impl AdapterFacts {
    /// Name and backend.
    pub(crate) fn title(&self) -> String {
        format!("{} ({})", self.name, self.backend)
    }

    /// Whether name or backend contain `name` (in any case); everything is called nothing.
    pub(crate) fn is_called(&self, name: Option<&str>) -> bool {
        name.is_none_or(|name| self.title().to_lowercase().contains(&name.to_lowercase()))
    }

    /// The name without what stands in brackets.
    pub fn short_name(&self) -> &str {
        self.name.split(" (").next().unwrap_or(&self.name)
    }

    /// Whether it only pretends to be a GPU.
    pub fn is_software(&self) -> bool {
        self.kind == "software"
    }

    /// Whether it is part of a processor.
    #[cfg_attr(not(feature = "gpu"), expect(dead_code, reason = "only queues ask"))]
    pub(crate) fn is_integrated(&self) -> bool {
        self.kind == "integrated"
    }
}

/// What dispatches took.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct FlightFigures {
    /// Dispatches that have ended.
    pub dispatches: u64,
    /// Seconds they took on the device: its own timestamps, or what the host saw.
    pub device_seconds: f64,
    /// Whether these are the device's timestamps.
    pub has_timestamps: bool,
}

/// What the render kernel of a picture holds and what was left out of it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct KernelFacts {
    /// Features it was built with.
    pub features: Vec<String>,
    /// Features it does without.
    pub left_out: Vec<String>,
    /// Bytes of its source.
    pub source_bytes: usize,
    /// Bytes of the source with every feature.
    pub full_source_bytes: usize,
    /// Bytes of a vertex on the device.
    pub vertex_bytes: u32,
    /// Bytes of a vertex with everything a scene can have.
    pub full_vertex_bytes: u32,
}

/// What was left out of the kernels and what they take.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GpuFigures {
    /// The device.
    pub adapter: AdapterFacts,
    /// Bytes of all buffers on it.
    pub device_bytes: u64,
    /// Bytes read back from it for this picture.
    pub bytes_read: u64,
    /// What its dispatches took.
    pub flights: FlightFigures,
    /// Seconds of waiting for the driver to compile its kernels.
    pub compile_seconds: f64,
    /// How its kernels share the work.
    pub schedule: Schedule,
    /// What its render kernel holds.
    pub kernel: KernelFacts,
}
