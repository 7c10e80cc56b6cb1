//! One run: error against time of one method with one seed, on one device.

use std::sync::atomic::{AtomicBool, Ordering};

use serde::{Deserialize, Serialize};

use super::plan::{Frame, Method, Settings};
use crate::denoise::Denoiser;
use crate::environment::Environment;
use crate::error::Result;
use crate::image::Image;
use crate::light_grid::LightGrid;
use crate::metrics::{Comparison, compare};
use crate::path::World;
use crate::render::{Driver, Figures, Phase, Session, StopRule, gpu};
use crate::scene::Camera;

/// The scene, map and device of a run.
#[derive(Clone, Copy)]
pub(super) struct Place<'a> {
    pub(super) world: &'a World,
    pub(super) camera: &'a Camera,
    pub(super) frame: &'a Frame,
    pub(super) environment: &'a Environment,
    /// Seconds that the map's importance table took.
    pub(super) table_seconds: f64,
    /// Scene and map on the GPU, if that is the device.
    pub(super) upload: Option<&'a gpu::UploadedScene>,
    /// Name of the device.
    pub(super) device: &'a str,
    /// Ends what is measured.
    pub(super) cancel: &'a AtomicBool,
}

impl<'a> Place<'a> {
    /// A session of one method.
    pub(super) fn session(&self, settings: &Settings, seed: u32) -> Result<Session<'a>> {
        let view = settings.view(self.camera, self.frame, seed);
        Session::on((self.world, self.environment), view, self.upload)
    }

    /// Learns and renders a little, so that all kernels are built.
    pub(super) fn warm_up(&self, settings: &Settings) -> Result<()> {
        let never = AtomicBool::new(false);
        let mut session = self.session(settings, 0)?;
        if session.phase() == Phase::Learning {
            session.advance(0, &never)?;
            session.finish_learning();
        }
        session.advance(1, &never)
    }

    /// A session that has learned, with what drives it on; `None` if it was cancelled.
    pub(super) fn learned(&self, settings: &Settings, seed: u32) -> Result<Option<Driver<'a>>> {
        let mut driver = Driver::new(self.session(settings, seed)?, StopRule::default());
        Ok(driver.learn(self.cancel)?.then_some(driver))
    }

    /// Runs a method for `seconds`; `None` if it was cancelled. The time of copying and denoising pictures does not count.
    pub(super) fn measure(
        &self,
        method: &Method,
        seed: u32,
        seconds: f64,
    ) -> Result<Option<Finished>> {
        let rule = StopRule { seconds: Some(seconds), ..StopRule::default() };
        let mut driver = Driver::new(self.session(&method.settings, seed)?, rule);
        if !driver.learn(self.cancel)? {
            return Ok(None);
        }
        let (mut points, mut films, mut denoised) = (Vec::new(), Vec::new(), Vec::new());
        let mut next = seconds * FIRST_SHARE;
        loop {
            driver.advance(self.cancel)?;
            if self.cancel.load(Ordering::Relaxed) {
                return Ok(None);
            }
            let session = &mut driver.session;
            if self.table_seconds + session.figures().elapsed_seconds() < next.min(seconds) {
                continue;
            }
            session.settle()?;
            let figures = session.figures();
            let elapsed = self.table_seconds + figures.elapsed_seconds();
            points.push(Point {
                seconds: elapsed,
                render_seconds: figures.render_seconds,
                samples: session.samples(),
                rays: figures.rays,
                errors: None,
                denoised_flip: None,
            });
            films.push(session.film().image());
            denoised.push(Denoiser::Best.finish(session.film(), None)?);
            if elapsed >= seconds {
                break;
            }
            next = next.max(elapsed / STEP) * STEP;
        }
        let session = driver.session;
        let figures = session.figures();
        let run = Run {
            method: method.name.clone(),
            seed,
            table_seconds: self.table_seconds,
            figures,
            memory: Memory {
                table_bytes: self.environment.memory_bytes().table as u64,
                bvh_bytes: self.world.bvh.memory_bytes() as u64,
                grid_peak_bytes: figures.grid_peak_bytes as u64,
                grid_bytes: figures.grid_bytes as u64,
                device_bytes: session.gpu_figures().map(|gpu| gpu.device_bytes),
            },
            nanoseconds_per_ray: None,
            points,
            reference_pictures: None,
        };
        Ok(Some(Finished { run, pictures: [films, denoised], grid: session.grid().cloned() }))
    }
}

/// A moment of a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Seconds of building the importance table, learning and rendering.
    pub seconds: f64,
    /// Seconds of rendering alone.
    pub render_seconds: f64,
    /// Samples per pixel.
    pub samples: u32,
    /// Rays of rendering, shadow rays included.
    pub rays: u64,
    /// Errors against the reference; `None` before there is one.
    pub errors: Option<Comparison>,
    /// Mean LDR-FLIP of the denoised picture; `None` before there is a reference.
    pub denoised_flip: Option<f64>,
}

/// Memory that a run holds, in bytes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Memory {
    /// The map's importance table.
    pub table_bytes: u64,
    /// The scene's tree.
    pub bvh_bytes: u64,
    /// The Light Grid while learning, at most.
    pub grid_peak_bytes: u64,
    /// The Light Grid while rendering.
    pub grid_bytes: u64,
    /// Everything on the GPU.
    pub device_bytes: Option<u64>,
}

/// One run's measurements.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Name of the method.
    pub method: String,
    /// Seed.
    pub seed: u32,
    /// Seconds of building the map's importance table.
    pub table_seconds: f64,
    /// The session's own figures.
    pub figures: Figures,
    /// Memory that it held.
    pub memory: Memory,
    /// Nanoseconds per ray and thread, measured after the run.
    pub nanoseconds_per_ray: Option<f64>,
    /// In order of time; the last one is at or after the end.
    pub points: Vec<Point>,
    /// Pictures of the reference that errors were taken against.
    pub reference_pictures: Option<u32>,
}

/// A finished run with its pictures, one of each kind for each point.
pub(super) struct Finished {
    pub(super) run: Run,
    /// As they were rendered, and denoised.
    pub(super) pictures: [Vec<Image>; 2],
    /// The learned grid, for measurements after the run.
    pub(super) grid: Option<LightGrid>,
}

/// Ratio of the times of successive points.
const STEP: f64 = std::f64::consts::SQRT_2;

/// The first point is at most at this share of the run's time.
const FIRST_SHARE: f64 = 1.0 / 256.0;

impl Run {
    /// Computes the errors of its pictures and of the denoised ones, one for each point, against a reference, which
    /// comes with the number of pictures that it is the mean of, where that is known.
    ///
    /// # Errors
    /// If the reference is black or a picture is not finite.
    pub(super) fn evaluate(
        &mut self,
        [films, denoised]: &[Vec<Image>; 2],
        (reference, pictures): &(Image, Option<u32>),
    ) -> Result<()> {
        for (point, (film, denoised)) in self.points.iter_mut().zip(films.iter().zip(denoised)) {
            point.errors = Some(compare(film, reference)?);
            point.denoised_flip = compare(denoised, reference)?.flip;
        }
        self.reference_pictures = *pictures;
        Ok(())
    }
}
