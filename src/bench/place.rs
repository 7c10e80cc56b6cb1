//! What is measured: a scene on a device.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::environment::Environment;
use crate::error::Result;
use crate::path::{World, framing};
use crate::render::gpu::{RayChoice, Schedule, UploadedScene};
use crate::render::{Session, Sharing, View};
use crate::report::{Device, OpenDevice};

/// What is to be measured.
#[derive(Debug, Clone)]
pub struct Options {
    /// In this order; parity is judged between the first two.
    pub devices: Vec<Device>,
    /// Part of the name of the GPU to take.
    pub adapter: Option<String>,
    /// What finds the surfaces that rays hit on it.
    pub rays: RayChoice,
    /// How its kernels share the work; `None` is what suits it.
    pub schedule: Option<Schedule>,
    /// Whether neighbouring pixels share vertices; then kernels do not take turns.
    pub sharing: Sharing,
    /// Width and height of the pictures.
    pub size: (u32, u32),
    /// Seconds of rendering a scene on a device.
    pub seconds: f64,
}

/// A scene and its map, ready to be measured.
pub struct Subject {
    /// What the scene is called.
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

    pub(super) fn session(
        &self,
        uploaded: Option<&UploadedScene>,
        view: View,
    ) -> Result<Session<'_>> {
        let Subject { world, environment, .. } = self.subject;
        Session::on(world, environment, view, uploaded)
    }

    /// The defaults of `lightgrid render`.
    pub(super) fn view(&self, (width, height): (u32, u32)) -> View {
        let world = &self.subject.world;
        let camera = world.scene.cameras.first().cloned();
        let aspect = width as f32 / height as f32;
        let camera = camera.unwrap_or_else(|| framing::frame(world, aspect));
        View { sharing: self.options.sharing, ..View::new(camera, [width, height]) }
    }
}
