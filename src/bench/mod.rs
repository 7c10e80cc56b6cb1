//! Speed of a machine, in a few minutes: rays and samples per second, waits, costs of the host.
//!
//! For users who choose a device, and for bug reports from other machines.

mod figures;
mod place;
mod rays;

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use glam::Affine3A;

use crate::error::{Error, Result};
use crate::image::Image;
use crate::light_grid::LightGrid;
use crate::metrics;
use crate::render::gpu::{Gpu, UploadedScene};
use crate::render::{Driver, Phase, Sampling, Session, StopRule, View};
use crate::report::{Machine, OpenDevice};

pub use figures::{Bench, DeviceFigures, Parity, PathFigures, SceneFigures};
use place::Place;
pub use place::{Options, Subject};
pub use rays::{RayFigures, RayKind};

/// Measures the subjects on the devices and calls `progress` with each step. Returns the figures so far when
/// `cancel` becomes true.
///
/// # Errors
/// If a device cannot be opened.
pub fn run(
    options: &Options,
    subjects: &[Subject],
    cancel: &AtomicBool,
    progress: &dyn Fn(String),
) -> Result<Bench> {
    let machine = Machine::here();
    let open = |device| {
        let mut open = OpenDevice::open(device, options.adapter.as_deref(), &machine)?;
        open.gpu = open.gpu.map(|gpu| gpu.with_rays(options.rays)).transpose()?;
        open.gpu = open.gpu.map(|gpu| gpu.with_schedule(options.schedule));
        Ok(open)
    };
    let opened: Vec<_> = options.devices.iter().map(|d| open(*d)).collect::<Result<_>>()?;
    let without_scenes = |open: &OpenDevice| DeviceFigures {
        name: open.name.clone(),
        adapter: open.gpu.as_ref().map(|gpu| gpu.facts().clone()),
        has_hardware_rays: open.gpu.as_ref().is_some_and(Gpu::has_hardware_rays),
        scenes: Vec::new(),
    };
    let mut devices: Vec<_> = opened.iter().map(without_scenes).collect();
    let mut parity = Vec::new();
    for subject in subjects {
        let mut results = Vec::new();
        for (open, figures) in opened.iter().zip(&mut devices) {
            if cancel.load(Ordering::Relaxed) {
                break;
            }
            let place = Place { subject, open, options, cancel };
            progress(format!("{} on the {}", subject.name, open.device.title()));
            let (scene, result) = place.measure();
            figures.scenes.push(scene);
            results.push(result);
        }
        if let [a, b, ..] = &results[..] {
            parity.push(compare(&subject.name, a, b));
        }
    }
    Ok(Bench { machine, size: options.size, devices, parity })
}

/// Results that are compared between devices: a picture, and hits of rays.
struct Compared {
    picture: Image,
    hits: rays::Answers,
}

/// Pixels and samples of the pictures that are compared.
const COMPARED: ((u32, u32), u32) = ((96, 54), 16);

impl Place<'_> {
    fn measure(&self) -> (SceneFigures, Result<Compared>) {
        let mut figures = SceneFigures {
            scene: self.subject.name.clone(),
            triangles: self.subject.world.scene.shown_triangles() as usize,
            ..SceneFigures::default()
        };
        let compared = self.fill(&mut figures);
        figures.failure = compared.as_ref().err().map(ToString::to_string);
        (figures, compared)
    }

    fn fill(&self, figures: &mut SceneFigures) -> Result<Compared> {
        let (world, environment) = self.lit();
        let start = Instant::now();
        let upload = |gpu| UploadedScene::new(gpu, world, environment);
        let uploaded = self.open.gpu.as_ref().map(upload).transpose()?;
        figures.paths = Some(self.paths(uploaded.as_ref(), start.elapsed().as_secs_f64())?);
        let (rays, hits) = rays::measure(self, uploaded.as_ref())?;
        figures.rays = rays;
        let view = View { sampling: Sampling::Plain, ..self.view(COMPARED.0) };
        let mut session = Session::on(self.lit(), view, uploaded.as_ref())?;
        session.advance(COMPARED.1, self.cancel)?;
        session.settle()?;
        Ok(Compared { picture: session.film().image(), hits })
    }

    /// Seconds to the first picture of another view with distributions learned before; the median of five.
    fn turn(&self, uploaded: Option<&UploadedScene>, grid: Option<&LightGrid>) -> Result<f64> {
        let mut seconds = Vec::new();
        for round in 0..6_u8 {
            let start = Instant::now();
            let mut view = self.view(TURNING);
            view.camera.world_from_camera *= Affine3A::from_rotation_y(0.02 * f32::from(round));
            let mut session = Session::on(self.lit(), view, uploaded)?;
            session.finish_learning();
            grid.map_or(Ok(()), |grid| session.set_grid(grid.clone()))?;
            session.advance(1, self.cancel)?;
            session.settle()?;
            // The first round may compile kernels.
            if round > 0 {
                seconds.push(start.elapsed().as_secs_f64());
            }
        }
        seconds.sort_by(f64::total_cmp);
        Ok(seconds[seconds.len() / 2])
    }

    /// One piece of work.
    fn advance(&self, driver: &mut Driver<'_>) -> Result<()> {
        driver.advance(self.cancel)?;
        if self.is_cancelled() { Err(Error::new("cancelled")) } else { Ok(()) }
    }

    fn paths(&self, uploaded: Option<&UploadedScene>, upload_seconds: f64) -> Result<PathFigures> {
        let start = Instant::now();
        let seconds = || start.elapsed().as_secs_f64();
        let session = Session::on(self.lit(), self.view(self.options.size), uploaded)?;
        let mut driver = Driver::new(session, StopRule::default());
        let mut first_distributions = None;
        while driver.session.samples() == 0 {
            self.advance(&mut driver)?;
            let session = &driver.session;
            if session.phase() == Phase::Rendering || session.figures().learned_cells > 0 {
                first_distributions.get_or_insert_with(seconds);
            }
        }
        driver.session.settle()?;
        let first_picture_seconds = seconds();
        let (before, gpu_before) = (driver.session.figures(), driver.session.gpu_figures());
        let end = before.render_seconds + self.options.seconds;
        let mut passes = 0;
        while driver.session.figures().render_seconds < end {
            self.advance(&mut driver)?;
            passes += 1;
        }
        driver.session.settle()?;
        let (after, gpu) = (driver.session.figures(), driver.session.gpu_figures());
        let elapsed = after.render_seconds - before.render_seconds;
        let stop_milliseconds = 1e3 * slowest_stop(&mut driver)?;
        let per_pass = |total: f64| total / f64::from(passes);
        let difference = |of: fn(&crate::render::gpu::GpuFigures) -> f64| {
            Some(of(gpu.as_ref()?) - of(gpu_before.as_ref()?))
        };
        let busy = difference(|gpu| gpu.flights.device_seconds);
        Ok(PathFigures {
            upload_seconds,
            compile_seconds: gpu.as_ref().map_or(0.0, |gpu| gpu.compile_seconds),
            first_distributions_seconds: first_distributions.unwrap_or(first_picture_seconds),
            first_picture_seconds,
            samples_per_second: (after.samples - before.samples) as f64 / elapsed,
            rays_per_second: (after.rays - before.rays) as f64 / elapsed,
            passes,
            pass_milliseconds: 1e3 * per_pass(elapsed),
            device_milliseconds: busy.map(|seconds| 1e3 * per_pass(seconds)),
            has_timestamps: gpu.as_ref().is_some_and(|gpu| gpu.flights.has_timestamps),
            bytes_read_per_pass: per_pass(difference(|gpu| gpu.bytes_read as f64).unwrap_or(0.0)),
            stop_milliseconds,
            turn_milliseconds: 1e3 * self.turn(uploaded, driver.session.grid())?,
            device_bytes: gpu.as_ref().map_or(0, |gpu| gpu.device_bytes),
            schedule: gpu.as_ref().map(|gpu| gpu.schedule),
            kernel: gpu.map(|gpu| gpu.kernel),
        })
    }
}

/// Size of the pictures of a turning camera.
const TURNING: (u32, u32) = (480, 270);

/// Maximum seconds, over a few trials, from a request to stop until a session stops.
fn slowest_stop(driver: &mut Driver<'_>) -> Result<f64> {
    let mut slowest = 0.0_f64;
    for round in 0..5_u64 {
        let cancel = AtomicBool::new(false);
        let told = std::thread::scope(|scope| {
            let teller = scope.spawn(|| {
                std::thread::sleep(Duration::from_millis(30 + 7 * round));
                cancel.store(true, Ordering::Relaxed);
                Instant::now()
            });
            while !cancel.load(Ordering::Relaxed) {
                driver.advance(&cancel)?;
            }
            driver.session.settle()?;
            teller.join().map_err(|_| Error::new("the thread that says stop panicked"))
        })?;
        slowest = slowest.max(told.elapsed().as_secs_f64());
    }
    Ok(slowest)
}

fn compare(scene: &str, a: &Result<Compared>, b: &Result<Compared>) -> Parity {
    let found = a.as_ref().and_then(|a| Ok((a, b.as_ref()?))).map_err(Clone::clone);
    let judged = found.and_then(|(a, b)| {
        let mean_ratio = metrics::compare(&b.picture, &a.picture)?.mean_ratio;
        let luminance = |rgb: &[f32; 3]| crate::color::luminance((*rgb).into());
        let pairs = a.picture.pixels.iter().zip(&b.picture.pixels);
        let pairs = pairs.map(|(a, b)| (luminance(a), luminance(b)));
        let apart = pairs.filter(|(a, b)| (a - b).abs() > 0.01 * a.max(*b)).count();
        let other = a.hits.iter().zip(&b.hits).filter(|(a, b)| a.1 != b.1).count();
        let share_apart = apart as f64 / a.picture.pixels.len() as f64;
        Ok([mean_ratio, share_apart, other as f64 / a.hits.len().max(1) as f64])
    });
    let failure = judged.as_ref().err().map(ToString::to_string);
    let [mean_ratio, share_apart, other_triangles] = judged.unwrap_or([f64::NAN; 3]);
    Parity { scene: scene.to_owned(), failure, mean_ratio, share_apart, other_triangles }
}
