//! What was measured.

use serde::Serialize;

use super::rays::RayFigures;
use crate::render::gpu::{AdapterFacts, KernelFacts, Schedule};
use crate::report::Machine;

/// What a machine did.
#[derive(Debug, Clone, Serialize)]
pub struct Bench {
    /// The machine.
    pub machine: Machine,
    /// Width and height of the pictures.
    pub size: (u32, u32),
    /// Its devices.
    pub devices: Vec<DeviceFigures>,
    /// Scene by scene, how alike the pictures of the first two devices are.
    pub parity: Vec<Parity>,
}

/// What a device did.
#[derive(Debug, Clone, Serialize)]
pub struct DeviceFigures {
    /// Its name.
    pub name: String,
    /// What it is and allows; `None` for the CPU.
    pub adapter: Option<AdapterFacts>,
    /// Whether its own ray queries find what rays hit.
    pub has_hardware_rays: bool,
    /// Scene by scene.
    pub scenes: Vec<SceneFigures>,
}

/// What a device did with a scene.
#[derive(Debug, Clone, Serialize)]
pub struct SceneFigures {
    /// What the scene is called.
    pub scene: String,
    /// Its triangles.
    pub triangles: usize,
    /// Why nothing else is known; `None` if it went well.
    pub failure: Option<String>,
    /// Rays a second, kind by kind.
    pub rays: Vec<RayFigures>,
    /// Figures of whole paths.
    pub paths: Option<PathFigures>,
}

/// What whole paths took: the defaults of `lightgrid render`.
#[derive(Debug, Clone, Serialize)]
pub struct PathFigures {
    /// Seconds until scene and map were on the device.
    pub upload_seconds: f64,
    /// Seconds in which the driver compiled; some compile when a kernel first runs instead.
    pub compile_seconds: f64,
    /// Seconds from then to the first distributions, kernels included.
    pub first_distributions_seconds: f64,
    /// Seconds from the same moment to the first sample of every pixel.
    pub first_picture_seconds: f64,
    /// Camera paths a second, all pixels together, without learning and the first pass.
    pub samples_per_second: f64,
    /// Rays a second, of all kinds.
    pub rays_per_second: f64,
    /// Passes that these figures are of.
    pub passes: u32,
    /// Milliseconds of a pass.
    pub pass_milliseconds: f64,
    /// Milliseconds a pass kept the device busy; `None` on the CPU.
    pub device_milliseconds: Option<f64>,
    /// Whether these are the device's own timestamps.
    pub has_timestamps: bool,
    /// Bytes read back from the device a pass.
    pub bytes_read_per_pass: f64,
    /// Milliseconds that it goes on when told to stop, at most.
    pub stop_milliseconds: f64,
    /// Milliseconds from turning the camera to the first sample of every pixel of a small picture, with
    /// scene, map and kernels ready; the median of a few.
    pub turn_milliseconds: f64,
    /// Bytes on the device.
    pub device_bytes: u64,
    /// How the kernels share the work.
    pub schedule: Option<Schedule>,
    /// What the kernel holds.
    pub kernel: Option<KernelFacts>,
}

/// How alike the pictures of two devices are: the same seed, few samples, no learning.
#[derive(Debug, Clone, Serialize)]
pub struct Parity {
    /// What the scene is called.
    pub scene: String,
    /// Why it could not be judged.
    pub failure: Option<String>,
    /// Mean of the one by that of the other.
    pub mean_ratio: f64,
    /// Share of pixels that are more than 1 % apart.
    pub share_apart: f64,
    /// Share of rays that hit another triangle, or on one device alone none.
    pub other_triangles: f64,
}
