//! What is rendered: the worker, its latest picture, and what is measured of that.

use std::sync::Arc;

use super::camera_pictures::CameraPictures;
use super::convergence::Convergence;
use super::inspect::Inspector;
use super::learning_steps::LearningSteps;
use super::speed_up::SpeedUp;
use super::threads::Wake;
use super::worker::{Activity, Snapshot, Worker};
use crate::error::Result;
use crate::render::gpu::{DeviceChoice, Gpu, RayChoice};

/// Samples a pixel after which a picture without light is called dark.
const MIN_SAMPLES: u32 = 4;

/// The render thread and its results.
pub(super) struct Rendering {
    /// The curves of the error.
    pub(super) convergence: Convergence,
    /// What the scene's cameras see.
    pub(super) camera_pictures: CameraPictures,
    /// How it has learned, if somebody asked.
    pub(super) steps: Option<LearningSteps>,
    /// The place that is looked at.
    pub(super) inspector: Inspector,
    /// The render thread.
    pub(super) worker: Worker,
    /// Its latest picture.
    pub(super) snapshot: Option<Arc<Snapshot>>,
    /// How much faster than the plain method that was made, where both are rendered.
    pub(super) speed_up: Option<SpeedUp>,
    /// The geometry of which it was last said that no light gets in.
    dark: Option<Arc<()>>,
}

impl Rendering {
    /// Starts the thread, which calls `wake` at every new picture. `gpu` names the GPU to take where one is wanted and what finds surfaces there; `screen` is
    /// the one the window is drawn on.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub(super) fn start(wake: Wake, gpu: (Option<String>, RayChoice), screen: Gpu) -> Result<Self> {
        Ok(Self {
            convergence: Convergence::default(),
            camera_pictures: CameraPictures::default(),
            steps: None,
            inspector: Inspector::default(),
            worker: Worker::start(wake, gpu, screen)?,
            snapshot: None,
            speed_up: None,
            dark: None,
        })
    }

    /// Takes what is ready.
    pub(super) fn collect(&mut self) {
        let Some(snapshot) = self.worker.snapshot() else { return };
        if self.snapshot.as_ref().is_none_or(|old| old.number != snapshot.number) {
            self.convergence.add(snapshot.main.sampling, &snapshot.curves);
            let plain = snapshot.plain.as_ref();
            self.speed_up = plain.and_then(|plain| SpeedUp::of(&snapshot.main, plain));
            self.steps.take_if(|steps| !steps.is_of(&snapshot.request));
            self.snapshot = Some(snapshot);
        }
    }

    /// Takes steps that somebody still waits for.
    pub(super) fn take_steps(&mut self, steps: LearningSteps) {
        if self.steps.as_ref().is_some_and(|awaited| awaited.has_request_of(&steps)) {
            self.steps = Some(steps);
        }
    }

    /// The latest picture, with what was known at a step of learning.
    pub(super) fn snapshot_at(&self, step: Option<usize>) -> Option<Arc<Snapshot>> {
        let snapshot = self.snapshot.as_ref()?;
        let at_step = step.and_then(|step| self.steps.as_ref()?.at(step, snapshot));
        Some(at_step.unwrap_or_else(|| Arc::clone(snapshot)))
    }

    /// Whether no light reaches what the camera sees, if that has not been said of this scene.
    pub(super) fn turns_out_dark(&mut self) -> bool {
        let whole = self.snapshot.as_ref().filter(|snapshot| snapshot.is_whole());
        let Some(snapshot) = whole else { return false };
        let (main, geometry) = (&snapshot.main, &snapshot.request.world.geometry);
        let turns_out = self.dark.as_ref().is_none_or(|said| !Arc::ptr_eq(said, geometry))
            && main.on_device.is_none()
            && main.film.min_samples() >= MIN_SAMPLES
            && main.film.is_dark();
        if turns_out {
            self.dark = Some(Arc::clone(geometry));
        }
        turns_out
    }

    /// Whether the picture that was asked for last is done.
    pub(super) fn is_done(&self) -> bool {
        let is_answer =
            |s: &Arc<Snapshot>| s.activity == Activity::Done && self.worker.has_answered(s);
        let is_learning = self.steps.as_ref().is_some_and(LearningSteps::is_busy);
        self.snapshot.as_ref().is_some_and(is_answer) && !self.inspector.busy && !is_learning
    }

    /// Whether a GPU renders or is being made ready for it, where this device was chosen.
    pub(super) fn is_on_gpu(&self, choice: DeviceChoice) -> bool {
        let is_preparing = choice != DeviceChoice::Cpu && self.worker.is_preparing();
        is_preparing || self.snapshot.as_ref().is_some_and(|s| s.main.gpu.is_some())
    }
}
