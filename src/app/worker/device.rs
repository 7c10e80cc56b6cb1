//! Where sessions run: the GPU that was asked for, as long as it does what it should, else the CPU.

use std::sync::{Arc, Mutex, Weak};

use super::request::Request;
use crate::app::threads::lock;
use crate::environment::Environment;
use crate::error::{Error, Result};
use crate::path::World;
use crate::render::gpu::{CompileGuard, DeviceChoice, Gpu, RayChoice, UploadedScene};
use crate::render::{Session, View};

/// The device in use and what is on it.
pub(super) struct Device {
    /// Name of the adapter to take, if one was asked for, and what finds surfaces there.
    asked: (Option<String>, RayChoice),
    /// The device the window is drawn on, to be shared if it is of that adapter.
    screen: Arc<Mutex<Gpu>>,
    choice: Option<DeviceChoice>,
    gpu: Option<Gpu>,
    /// What is on the GPU.
    uploaded: Option<(Arc<World>, UploadedScene)>,
    /// The kernels that a session waits for on the CPU.
    awaited: Option<Awaited>,
    /// What went wrong since somebody took note of it.
    pub(super) failure: Option<String>,
    /// The geometry that the GPU failed with.
    refused: Option<Weak<()>>,
}

/// Kernels that are being compiled, and what for.
struct Awaited {
    world: Weak<World>,
    /// Where the map lies.
    environment: usize,
    view: View,
    /// What is held until then.
    held: Weak<CompileGuard>,
}

impl Device {
    pub(super) fn new(asked: (Option<String>, RayChoice), screen: Arc<Mutex<Gpu>>) -> Self {
        let (choice, gpu, uploaded, awaited) = (None, None, None, None);
        let (failure, refused) = (None, None);
        Self { asked, screen, choice, gpu, uploaded, awaited, failure, refused }
    }

    /// Chooses the device that the request names, which may be none but the CPU. A GPU that failed with
    /// something else, for which it may have been too small, is chosen again.
    pub(super) fn choose_for(&mut self, request: &Request) {
        let geometry = Arc::downgrade(&request.world.geometry);
        let failed_with_another = self.refused.as_ref().is_some_and(|it| !it.ptr_eq(&geometry));
        let choice = request.device;
        let is_new = self.choice.replace(choice) != Some(choice);
        // A real one is what both choices of a GPU mean.
        let is_meant = choice != DeviceChoice::Cpu && self.has_real_gpu();
        if is_meant || !(is_new || failed_with_another) {
            return;
        }
        (self.gpu, self.uploaded, self.awaited, self.refused) = (None, None, None, None);
        // The name only says which GPU is meant.
        let (adapter, rays) = &self.asked;
        let adapter = adapter.as_deref().filter(|_| choice != DeviceChoice::Cpu);
        let screen = lock(&self.screen).clone();
        let opened = choice.open_or_share(adapter, Some(&screen));
        match opened.and_then(|gpu| gpu.map(|gpu| gpu.with_rays(*rays)).transpose()) {
            Ok(gpu) => self.gpu = gpu,
            Err(failure) => self.tell(&failure),
        }
    }

    /// Whether a GPU was chosen to which the scene has to be uploaded.
    pub(super) fn needs_upload(&self, request: &Request) -> bool {
        let uploaded = self.uploaded.as_ref().map(|(world, _)| Arc::as_ptr(world));
        self.gpu.is_some() && uploaded != Some(Arc::as_ptr(&request.world))
    }

    /// Whether a GPU is ready that has all first samples in a moment; software has not.
    pub(super) fn is_quick(&self, request: &Request) -> bool {
        self.has_real_gpu()
            && self.choice == Some(request.device)
            && !self.needs_upload(request)
            && !self.is_compiling()
    }

    fn has_real_gpu(&self) -> bool {
        self.gpu.as_ref().is_some_and(|gpu| !gpu.facts().is_software())
    }

    /// Whether kernels are being compiled that a session waits for on the CPU.
    pub(super) fn is_compiling(&self) -> bool {
        self.awaited.as_ref().is_some_and(|awaited| awaited.held.strong_count() > 0)
    }

    /// Whether there were any when this was last [noted](Self::note_compiled).
    pub(super) fn was_compiling(&self) -> bool {
        self.awaited.is_some()
    }

    /// Has a look at whether they still are.
    pub(super) fn note_compiled(&mut self) {
        self.awaited.take_if(|awaited| awaited.held.strong_count() == 0);
    }

    /// Lets the session run on the device that was chosen, as soon as its kernels are compiled; what it has so far
    /// is kept. `preparation` begins what is told of for as long.
    pub(super) fn place(
        &mut self,
        session: &mut Session<'_>,
        (request, environment): (&Request, &Environment),
        preparation: impl FnOnce() -> Arc<CompileGuard>,
    ) {
        let Some(gpu) = self.gpu.clone() else { return session.continue_on_cpu() };
        if session.is_on_gpu() || self.awaits(session, request, environment) {
            return;
        }
        let uploaded = self.upload(&gpu, request, environment);
        match uploaded.and_then(|on| session.continue_on_gpu_if_compiled(on, preparation)) {
            Ok(held) => {
                self.awaited = held.map(|held| Awaited {
                    world: Arc::downgrade(&request.world),
                    environment: std::ptr::from_ref(environment).addr(),
                    view: session.view().clone(),
                    held,
                });
            }
            Err(failure) => self.give_up(&failure, request),
        }
    }

    /// Whether the kernels of this very session are being compiled.
    fn awaits(&self, session: &Session<'_>, request: &Request, environment: &Environment) -> bool {
        let is_of_session = |awaited: &Awaited| {
            awaited.world.as_ptr() == Arc::as_ptr(&request.world)
                && awaited.environment == std::ptr::from_ref(environment).addr()
                && awaited.view == *session.view()
        };
        self.is_compiling() && self.awaited.as_ref().is_some_and(is_of_session)
    }

    /// Does without the GPU until another one or another scene is chosen.
    pub(super) fn give_up(&mut self, failure: &Error, request: &Request) {
        self.tell(failure);
        (self.gpu, self.uploaded, self.awaited) = (None, None, None);
        self.refused = Some(Arc::downgrade(&request.world.geometry));
    }

    fn tell(&mut self, failure: &Error) {
        self.failure.get_or_insert_with(|| format!("{failure}; the CPU renders"));
    }

    /// The request's scene and a map on the GPU; what is there already is not uploaded again.
    fn upload(
        &mut self,
        gpu: &Gpu,
        request: &Request,
        environment: &Environment,
    ) -> Result<&UploadedScene> {
        let world = Arc::clone(&request.world);
        let before = self.uploaded.take().filter(|(on, _)| Arc::ptr_eq(on, &world));
        let scene = match before {
            Some((_, scene)) => scene.relit(environment)?,
            None => UploadedScene::new(gpu, &world, environment)?,
        };
        Ok(&self.uploaded.insert((world, scene)).1)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::request_of;
    use super::*;

    #[test]
    fn a_gpu_that_failed_with_one_scene_is_asked_again_for_another() {
        let Some(screen) = Gpu::for_test() else { return };
        let rays = RayChoice::default();
        let mut device = Device::new((None, rays), Arc::new(Mutex::new(screen)));
        let of = |scene| Request { device: DeviceChoice::Gpu, ..request_of(scene, [32, 24]) };
        let first = of("crack");
        device.choose_for(&first);
        assert!(device.gpu.is_some());
        device.give_up(&Error::new("it takes too much"), &first);
        assert_eq!(device.failure.take().as_deref(), Some("it takes too much; the CPU renders"));
        let materials = first.world.scene.materials.clone();
        let edited = first
            .world
            .with_looks(materials, first.world.scene.lights.clone())
            .expect("there is memory");
        let mut turned = (*first.environment).clone();
        turned.set_rotation(1.0);
        let (world, environment) = (Arc::new(edited), Arc::new(turned));
        device.choose_for(&Request { world, environment, ..first });
        assert!(device.gpu.is_none(), "it is as large as before");
        device.choose_for(&of("crack"));
        assert!(device.gpu.is_some(), "nobody knows that it is the same");
    }
}
