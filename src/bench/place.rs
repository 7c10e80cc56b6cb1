//! A scene on a device: the subject of measurements.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::environment::Environment;
use crate::path::{Lit, World, framing};
use crate::render::gpu::{RayChoice, Schedule};
use crate::render::{Sharing, View};
use crate::report::{Device, OpenDevice};

/// Options of a bench.
#[derive(Debug, Clone)]
pub struct Options {
    /// The devices, in this order; the first two are compared.
    pub devices: Vec<Device>,
    /// Part of the GPU's name.
    pub adapter: Option<String>,
    /// Ray queries of the hardware or our kernels.
    pub rays: RayChoice,
    /// Schedule of the GPU's kernels; `None` for its default.
    pub schedule: Option<Schedule>,
    /// Whether neighbouring pixels share second vertices; the schedule is fixed then.
    pub sharing: Sharing,
    /// Width and height of the pictures.
    pub size: (u32, u32),
    /// Seconds of rendering each scene on each device.
    pub seconds: f64,
}

/// A scene and its map, ready to be measured.
pub struct Subject {
    /// The scene's name.
    pub name: String,
    /// The scene.
    pub world: World,
    /// The map.
    pub environment: Environment,
}

/// A scene on a device.
pub(super) struct Place<'a> {
    pub(super) subject: &'a Subject,
    pub(super) open: &'a OpenDevice,
    pub(super) options: &'a Options,
    pub(super) cancel: &'a AtomicBool,
}

impl Place<'_> {
    pub(super) fn is_cancelled(&self) -> bool {
        self.cancel.load(Ordering::Relaxed)
    }

    pub(super) fn lit(&self) -> Lit<'_> {
        (&self.subject.world, &self.subject.environment)
    }

    /// A view with the defaults of `lightgrid render`.
    pub(super) fn view(&self, (width, height): (u32, u32)) -> View {
        let world = &self.subject.world;
        let camera = world.scene.cameras.first().cloned();
        let camera = camera.unwrap_or_else(|| framing::frame(world, width as f32 / height as f32));
        View { sharing: self.options.sharing, ..View::new(camera, [width, height]) }
    }
}
