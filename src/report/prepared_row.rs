//! A loaded row: the scene's tree, the camera, and the map with the tables that the methods need.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::machine::OpenDevice;
use super::measure::Place;
use super::plan::{Frame, Plan, Row, Settings};
use crate::digest::Digest;
use crate::environment::{Environment, EnvironmentOptions};
use crate::error::{At as _, Notices, Result};
use crate::light_grid::LightGrid;
use crate::path::{Lit, World, framing};
use crate::render::{Sampling, Session, gpu};
use crate::scene::Camera;

/// A scene under a map.
pub(super) struct PreparedRow {
    pub(super) title: String,
    pub(super) world: World,
    camera: Camera,
    frame: Frame,
    lights: Vec<Light>,
    pub(super) map_size: (u32, u32),
    pub(super) notices: Notices,
    /// Digest of the picture's limit.
    pub(super) digest: Digest,
}

/// A map with one kind of table, and the seconds of building it.
struct Light {
    options: EnvironmentOptions,
    environment: Environment,
    seconds: f64,
    /// The scene under it on the GPU.
    upload: Option<gpu::UploadedScene>,
}

impl PreparedRow {
    /// Loads a row's scene and map and builds all that the plan's methods need.
    pub(super) fn load(row: &Row, plan: &Plan) -> Result<Self> {
        let world = World::new(crate::sources::scene(&row.scene)?);
        let (map, map_notices) = crate::sources::map(&row.map)?;
        let mut notices = world.scene.notices.clone();
        notices.extend(&map_notices);
        let map_size = (map.width, map.height);
        let mut lights: Vec<Light> = Vec::new();
        let default = Settings::of(Sampling::Plain);
        for settings in plan.methods.iter().map(|m| &m.settings).chain([&default]) {
            let options = settings.environment();
            if lights.iter().any(|light| light.options == options) {
                continue;
            }
            let map = map.clone();
            let start = Instant::now();
            let environment = Environment::new(map, &options).at(&row.map)?;
            let seconds = start.elapsed().as_secs_f64();
            lights.push(Light { options, environment, seconds, upload: None });
        }
        let aspect = plan.effort.frame.size.0 as f32 / plan.effort.frame.size.1 as f32;
        let camera = world.scene.cameras.first().cloned();
        let camera = camera.unwrap_or_else(|| framing::frame(&world, aspect));
        let digest =
            digest_of_picture((&world, &lights[0].environment), &camera, &plan.effort.frame)?;
        let (title, frame) = (row.title.clone(), plan.effort.frame.clone());
        Ok(Self { title, world, camera, frame, lights, map_size, notices, digest })
    }

    /// Puts the scene under every map onto a GPU; nothing for the CPU.
    ///
    /// # Errors
    /// If it does not fit.
    pub(super) fn upload(&mut self, device: &OpenDevice) -> Result<()> {
        let Some(gpu) = &device.gpu else { return Ok(()) };
        let Some((first, others)) = self.lights.split_first_mut() else { return Ok(()) };
        let uploaded = gpu::UploadedScene::new(gpu, &self.world, &first.environment)?;
        let uploaded = first.upload.insert(uploaded);
        for light in others {
            light.upload = Some(uploaded.relit(&light.environment)?);
        }
        Ok(())
    }

    /// The place of runs with these settings.
    pub(super) fn place<'a>(
        &'a self,
        settings: &Settings,
        (device, cancel): (&'a OpenDevice, &'a AtomicBool),
    ) -> Place<'a> {
        let options = settings.environment();
        let light =
            self.lights.iter().find(|light| light.options == options).unwrap_or(&self.lights[0]);
        Place {
            world: &self.world,
            camera: &self.camera,
            frame: &self.frame,
            environment: &light.environment,
            table_seconds: light.seconds,
            upload: light.upload.as_ref().filter(|_| device.gpu.is_some()),
            device: &device.name,
            cancel,
        }
    }

    /// Mean nanoseconds per ray and thread while a picture is rendered with a learned grid, over at least
    /// `seconds`.
    pub(super) fn time_rays(
        &mut self,
        device: &OpenDevice,
        settings: &Settings,
        grid: Option<LightGrid>,
        seconds: f64,
    ) -> Result<Option<f64>> {
        self.world.start_ray_clock();
        let never = AtomicBool::new(false);
        let render = || {
            let mut session = self.place(settings, (device, &never)).session(settings, 0)?;
            grid.map_or(Ok(()), |grid| session.set_grid(grid))?;
            while session.figures().render_seconds < seconds {
                session.advance(1, &never)?;
            }
            Ok(())
        };
        let rendered = render();
        let nanoseconds = self.world.stop_ray_clock();
        rendered.map(|()| nanoseconds)
    }
}

/// Digest of all that a picture converges to: scene, map, camera, size and bounces. A tiny rendered picture
/// is part of it, which nearly any change of the renderer changes: references of an older renderer are
/// therefore not reused.
fn digest_of_picture(lit: Lit<'_>, camera: &Camera, frame: &Frame) -> Result<Digest> {
    let (world, environment) = lit;
    let digest =
        Digest::new().scene(&world.scene).debug(camera).debug(frame).map(environment.map());
    let settings = Settings::of(Sampling::Plain);
    let view = settings.view(camera, &Frame { size: PROBE_SIZE, ..frame.clone() }, 0);
    let mut session = Session::new(world, environment, view);
    session.advance(PROBE_SAMPLES, &AtomicBool::new(false))?;
    session.settle()?;
    Ok(digest.bytes(bytemuck::cast_slice(session.film().image().pixels.as_flattened())))
}

const PROBE_SIZE: (u32, u32) = (48, 27);
const PROBE_SAMPLES: u32 = 4;
