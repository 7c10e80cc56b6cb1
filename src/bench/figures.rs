//! Figures of a bench, and tables of them for a terminal.

use askama::Template;
use serde::Serialize;

use super::rays::{RayFigures, RayKind};
use crate::render::gpu::{AdapterFacts, KernelFacts, Schedule};
use crate::report::Machine;

/// All figures of a machine.
#[derive(Debug, Clone, Serialize, Template)]
#[template(path = "bench.txt", escape = "none")]
pub struct Bench {
    /// The machine.
    pub machine: Machine,
    /// Width and height of the pictures.
    pub size: (u32, u32),
    /// Its devices.
    pub devices: Vec<DeviceFigures>,
    /// For each scene, the differences between the first two devices.
    pub parity: Vec<Parity>,
}

/// Figures of a device.
#[derive(Debug, Clone, Serialize)]
pub struct DeviceFigures {
    /// Its name.
    pub name: String,
    /// Properties and limits of the GPU; `None` for the CPU.
    pub adapter: Option<AdapterFacts>,
    /// Whether its hardware ray queries are used.
    pub has_hardware_rays: bool,
    /// For each scene.
    pub scenes: Vec<SceneFigures>,
}

/// Figures of a scene on a device.
#[derive(Debug, Clone, Default, Serialize)]
pub struct SceneFigures {
    /// The scene's name.
    pub scene: String,
    /// Its triangles.
    pub triangles: usize,
    /// The error that ended the measurement, if any.
    pub failure: Option<String>,
    /// Rays per second, by kind.
    pub rays: Vec<RayFigures>,
    /// Figures of whole paths.
    pub paths: Option<PathFigures>,
}

impl SceneFigures {
    /// Millions of rays of a kind per second, where they were measured.
    fn rate(&self, kind: RayKind) -> String {
        let found = self.rays.iter().find(|rays| rays.kind == kind);
        found.map_or("-".to_owned(), |rays| millions(rays.per_second))
    }
}

fn millions(per_second: f64) -> String {
    let millions = per_second * 1e-6;
    if millions < 99.95 { format!("{millions:.2}") } else { format!("{millions:.0}") }
}

/// Figures of whole paths, with the defaults of `lightgrid render`.
#[derive(Debug, Clone, Serialize)]
pub struct PathFigures {
    /// Seconds of uploading scene and map.
    pub upload_seconds: f64,
    /// Seconds of the driver's compilation before kernels run; some drivers compile at a kernel's first run instead.
    pub compile_seconds: f64,
    /// Seconds from the upload to the first distributions, compilation included.
    pub first_distributions_seconds: f64,
    /// Seconds from the upload to the first sample of every pixel.
    pub first_picture_seconds: f64,
    /// Camera paths per second over all pixels, without learning and the first pass.
    pub samples_per_second: f64,
    /// Rays per second, of all kinds.
    pub rays_per_second: f64,
    /// Number of passes of these figures.
    pub passes: u32,
    /// Milliseconds of a pass.
    pub pass_milliseconds: f64,
    /// Milliseconds per pass in which the device was busy; `None` on the CPU.
    pub device_milliseconds: Option<f64>,
    /// Whether `device_milliseconds` comes from the device's timestamps.
    pub has_timestamps: bool,
    /// Bytes read back from the device per pass.
    pub bytes_read_per_pass: f64,
    /// Maximum milliseconds from a request to stop until the session stops.
    pub stop_milliseconds: f64,
    /// Milliseconds from turning the camera to the first sample of every pixel of a small picture, with
    /// scene, map and kernels ready; the median of a few.
    pub turn_milliseconds: f64,
    /// Bytes on the device.
    pub device_bytes: u64,
    /// Schedule of the kernels.
    pub schedule: Option<Schedule>,
    /// Features and sizes of the kernel.
    pub kernel: Option<KernelFacts>,
}

/// Differences of two devices: pictures of the same seed, with few samples and without learning.
#[derive(Debug, Clone, Serialize)]
pub struct Parity {
    /// What the scene is called.
    pub scene: String,
    /// The error that prevented the comparison, if any.
    pub failure: Option<String>,
    /// Ratio of the means of both pictures.
    pub mean_ratio: f64,
    /// Share of pixels that differ by more than 1 %.
    pub share_apart: f64,
    /// Share of rays that hit different triangles, or that hit one on one device only.
    pub other_triangles: f64,
}
