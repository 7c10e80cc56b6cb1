//! The render thread: takes the latest request, publishes the latest picture.
//!
//! The only place that runs a [`crate::render::Session`]. A request that differs in what is seen starts anew; one
//! that differs in when to stop or whether to pause is taken on the way. A film begins with every eighth
//! pixel of every eighth row, then every fourth and second, so that there is a picture of the whole
//! view at once and no sample is lost.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

mod device;
mod job;
mod kept;

use job::Job;
use kept::Kept;

use super::{Wake, lock};
use crate::alarm::Alarm;
use crate::environment::Environment;
use crate::error::{Error, Result};
use crate::image::Image;
use crate::light_grid::{LearningGrid, LightGrid};
use crate::path::World;
use crate::radiance_cache::CacheFacts;
use crate::render::film::Film;
use crate::render::gpu::{DeviceChoice, DeviceFilm, Gpu, GpuFigures, RayChoice};
use crate::render::{Figures, Sampling, StopRule, View};

/// What is to be rendered.
#[derive(Clone)]
pub struct Request {
    /// The scene.
    pub world: Arc<World>,
    /// The map, turned and scaled.
    pub environment: Arc<Environment>,
    /// What is seen and how.
    pub view: View,
    /// Render plainly beside it, at equal time.
    pub split: bool,
    /// The camera moves: a small picture at once rather than a good one.
    pub moving: bool,
    /// Show pictures on the way; else only what [`View`] asks for, for repeatable screenshots.
    pub previews: bool,
    /// Where it is rendered.
    pub device: DeviceChoice,
    /// Show light from a radiance cache while there is little of what is asked for.
    pub is_calm: bool,
    /// Tell what is in that cache.
    pub inspects_cache: bool,
    /// When to stop.
    pub rule: StopRule,
    /// Render with what was learned before rather than learn anew.
    pub is_frozen: bool,
    /// What errors are measured against.
    pub reference: Option<Arc<Reference>>,
    /// Do nothing for now.
    pub paused: bool,
    /// Counts restarts asked for by hand.
    pub run: u32,
}

impl Request {
    /// Whether what is rendered for `self` is of no use for `new`.
    fn restarts(&self, new: &Self) -> bool {
        !Arc::ptr_eq(&self.world, &new.world)
            || !Arc::ptr_eq(&self.environment, &new.environment)
            || self.view != new.view
            // Both halves start together; the plain one can be dropped at any time.
            || (!self.split && new.split)
            || self.moving != new.moving
            || self.run != new.run
    }

    /// Whether `new` is only the next moment of a movement, for which a picture of this one is worth to be seen:
    /// were each ended by the next, none would be seen before the movement ends.
    fn is_followed_by(&self, new: &Self) -> bool {
        self.moving
            && new.moving
            && Arc::ptr_eq(&self.world, &new.world)
            && self.environment.shares_map_with(&new.environment)
    }

    /// Whether work for `self` is to be dropped for `new`.
    fn is_ended_by(&self, new: &Self) -> bool {
        self.restarts(new) && !self.is_followed_by(new)
    }

    /// Whether the same light falls on the same scene, whatever its surfaces make of it.
    fn is_lit_like(&self, other: &Self) -> bool {
        self.world.is_seen_through_like(&other.world)
            && Arc::ptr_eq(&self.environment, &other.environment)
            && (self.view.medium, self.view.limits) == (other.view.medium, other.view.limits)
    }

    /// Whether a picture for `self` shows what one for `new` will show, but for its size and noise.
    fn looks_like(&self, new: &Self) -> bool {
        let (a, b) = (&self.view, &new.view);
        Arc::ptr_eq(&self.world, &new.world)
            && Arc::ptr_eq(&self.environment, &new.environment)
            && (&a.camera, a.crop, a.medium) == (&b.camera, b.crop, b.medium)
            && (a.background, a.limits) == (b.background, b.limits)
            // Whoever asks for other samples wants to see those.
            && (a.sampling, a.seed, self.run) == (b.sampling, b.seed, new.run)
    }

    fn is_same(&self, new: &Self) -> bool {
        !self.restarts(new)
            && self.split == new.split
            && self.device == new.device
            && self.is_frozen == new.is_frozen
            && self.is_calm == new.is_calm
            && self.inspects_cache == new.inspects_cache
            && self.reference.as_ref().map(Arc::as_ptr) == new.reference.as_ref().map(Arc::as_ptr)
            && self.rule == new.rule
            && self.paused == new.paused
    }
}

/// What the worker is doing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Activity {
    /// A small picture while the camera moves.
    Moving,
    /// Learning, the share done in `[0,1]`.
    Learning(f32),
    /// Adding samples.
    Rendering,
    /// Asked to pause.
    Paused,
    /// A stop rule was met.
    Done,
}

/// A picture without noise.
pub struct Reference {
    /// Where it came from.
    pub name: String,
    /// Linear radiance.
    pub image: Image,
}

/// How good a picture was at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Seconds of learning and rendering.
    pub seconds: f64,
    /// Samples per pixel.
    pub samples: f64,
    /// Estimated relative RMS error.
    pub noise: f64,
    /// The true one, where there is a reference.
    pub error: Option<f64>,
}

/// One picture and what was done for it.
#[derive(Clone)]
pub struct SessionSnapshot {
    /// How the map was sampled.
    pub sampling: Sampling,
    /// The sums. While the window shows those on its own device in every frame, or shows no newer ones for
    /// now, they are as they were read last: at most a few seconds ago, and the last ones when nothing is
    /// rendered.
    pub film: Arc<Film>,
    /// Fewest samples of any of its pixels.
    pub samples: u32,
    /// What was done for them.
    pub figures: Figures,
    /// [`Film::noise`].
    pub noise: f64,
    /// The distributions in use.
    pub grid: Option<Arc<LightGrid>>,
    /// The GPU at work; `None` is the CPU.
    pub gpu: Option<Arc<GpuFigures>>,
    /// The sums of `film` or later ones where a GPU has them, and that GPU.
    pub(crate) on_device: Option<(Gpu, DeviceFilm)>,
}

impl SessionSnapshot {
    /// Samples a pixel, in the mean.
    pub fn mean_samples(&self) -> f64 {
        self.figures.samples as f64 / self.film.pixels().len().max(1) as f64
    }
}

/// Why there is no radiance cache to be looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoCache {
    /// Nobody has asked for it.
    Unasked,
    /// It is there for fast light, which only denoised pictures show.
    NotDenoised,
    /// A split view compares pictures, and shows no fast light.
    Split,
    /// The device has many samples before a cache would be trained.
    QuickDevice,
    /// Light that has met one surface needs none.
    OneBounce,
    /// It will be.
    Untrained,
}

/// The latest picture.
#[derive(Clone)]
pub struct Snapshot {
    /// Counts snapshots.
    pub number: u64,
    /// What it was rendered for.
    pub request: Arc<Request>,
    /// What is going on.
    pub activity: Activity,
    /// The picture.
    pub main: SessionSnapshot,
    /// What has been done for it by now; its own figures are those of its film.
    pub now: Figures,
    /// The plain picture of a split view.
    pub plain: Option<SessionSnapshot>,
    /// What learning counted, once it has ended.
    pub counters: Option<Arc<LearningGrid>>,
    /// What is in the radiance cache of fast light.
    pub cache: std::result::Result<Arc<CacheFacts>, NoCache>,
    /// How the error of `main` and of `plain` fell.
    pub curves: [Vec<Point>; 2],
    /// Another film of the same view; its samples help where `main` has few.
    pub backdrop: Option<Backdrop>,
    /// Seconds spent on a backdrop whose light comes from a radiance cache, which are none of `main`'s.
    pub calm_seconds: f64,
    /// Whoever shows it says here when the next one will be wanted.
    pub(super) rest: Arc<Rest>,
}

/// How long no newer picture will be shown: films are large, and none is copied for nothing.
pub(super) struct Rest(Mutex<Instant>);

impl Rest {
    fn new() -> Self {
        Self(Mutex::new(Instant::now()))
    }

    /// No newer picture will be shown before this.
    pub(super) fn set_end(&self, end: Instant) {
        *lock(&self.0) = end;
    }

    /// Whether it lasts for longer than this.
    fn lasts(&self, time: Duration) -> bool {
        *lock(&self.0) > Instant::now() + time
    }
}

/// A film that is shown together with the picture's own, and never saved.
#[derive(Clone)]
pub struct Backdrop {
    /// Of any size.
    pub film: Arc<Film>,
    /// What one of its samples counts beside one of the picture's own.
    pub worth: f32,
    /// Whether its light comes from a radiance cache.
    pub is_cached: bool,
}

impl Backdrop {
    /// The share of what is shown that it makes up, in `[0,1]`, beside a film of the same size with so
    /// many samples a pixel.
    pub fn share(&self, samples: u32) -> f32 {
        let own = self.worth * self.film.min_samples() as f32;
        if own > 0.0 { own / (own + samples as f32) } else { 0.0 }
    }
}

/// Of the very same film, counting alike.
impl PartialEq for Backdrop {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.film, &other.film)
            && (self.worth, self.is_cached) == (other.worth, other.is_cached)
    }
}

impl Snapshot {
    /// Samples a pixel of the picture by now, in the mean.
    pub fn mean_samples(&self) -> f64 {
        self.now.samples as f64 / self.main.film.pixels().len().max(1) as f64
    }

    /// Seconds of learning and rendering, fast light included.
    pub fn seconds(&self) -> f64 {
        self.now.elapsed_seconds() + self.calm_seconds
    }

    /// Whether the picture has its full size and every pixel a sample: it has not at first and while
    /// the camera moves.
    pub fn is_whole(&self) -> bool {
        self.main.samples > 0 && self.main.film.width == self.request.view.width
    }

    /// Whether there is anything to be seen.
    pub fn has_picture(&self) -> bool {
        self.main.figures.samples > 0 || self.backdrop.is_some()
    }
}

struct Shared {
    slot: Mutex<Slot>,
    changed: Condvar,
    cancel: Arc<AtomicBool>,
    snapshot: Mutex<Option<Arc<Snapshot>>>,
    rest: Arc<Rest>,
    is_preparing: AtomicBool,
    failures: Mutex<Vec<String>>,
    /// The device the window is drawn on.
    screen: Arc<Mutex<Gpu>>,
    wake: Wake,
}

#[derive(Default)]
struct Slot {
    request: Option<Arc<Request>>,
    quit: bool,
}

/// The handle of the render thread; it ends when dropped.
pub struct Worker {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    pool: Arc<rayon::ThreadPool>,
}

impl Worker {
    /// Starts the thread; `wake` is called at every new snapshot, `gpu` names the GPU to take
    /// where one is wanted and what finds surfaces there, and `screen` is the one to share if it is that.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub fn start(wake: Wake, gpu: (Option<String>, RayChoice), screen: Gpu) -> Result<Self> {
        let no_thread = |e: &dyn std::fmt::Display| {
            Error::new(format!("the render threads cannot be started: {e}"))
        };
        let pool = rayon::ThreadPoolBuilder::new()
            .thread_name(|i| format!("render {i}"))
            .start_handler(|_| lower_priority())
            .build()
            .map_err(|e| no_thread(&e))?;
        let pool = Arc::new(pool);
        let shared = Arc::new(Shared {
            slot: Mutex::default(),
            changed: Condvar::new(),
            cancel: Arc::default(),
            snapshot: Mutex::default(),
            rest: Arc::new(Rest::new()),
            is_preparing: AtomicBool::default(),
            failures: Mutex::default(),
            screen: Arc::new(Mutex::new(screen)),
            wake,
        });
        let (inside, render_pool) = (Arc::clone(&shared), Arc::clone(&pool));
        let thread = std::thread::Builder::new()
            .name("worker".to_owned())
            .spawn(move || run(&inside, &render_pool, gpu))
            .map_err(|e| no_thread(&e))?;
        Ok(Self { shared, thread: Some(thread), pool })
    }

    /// Says which device the window is drawn on now.
    pub fn move_to(&self, screen: Gpu) {
        *lock(&self.shared.screen) = screen;
    }

    /// Asks for a picture; the latest request counts.
    pub fn submit(&self, request: Request) {
        let mut slot = lock(&self.shared.slot);
        if slot.request.as_ref().is_some_and(|old| old.is_same(&request)) {
            return;
        }
        if slot.request.as_ref().is_some_and(|old| old.is_ended_by(&request)) {
            self.shared.cancel.store(true, Ordering::Relaxed);
        }
        slot.request = Some(Arc::new(request));
        self.shared.changed.notify_all();
    }

    /// The latest picture.
    pub fn snapshot(&self) -> Option<Arc<Snapshot>> {
        lock(&self.shared.snapshot).clone()
    }

    /// Whether a picture is what was asked for last.
    pub(super) fn has_answered(&self, snapshot: &Snapshot) -> bool {
        let slot = lock(&self.shared.slot);
        slot.request.as_ref().is_some_and(|latest| snapshot.request.is_same(latest))
    }

    /// Whether a GPU is being opened, filled or programmed.
    pub fn is_preparing(&self) -> bool {
        self.shared.is_preparing.load(Ordering::Relaxed)
    }

    /// Failures of GPUs since this was asked last, a sentence each.
    pub fn take_failures(&self) -> Vec<String> {
        std::mem::take(&mut lock(&self.shared.failures))
    }

    /// Threads that render.
    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        lock(&self.shared.slot).quit = true;
        self.shared.cancel.store(true, Ordering::Relaxed);
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            // A panic there was reported there.
            let _ = thread.join();
        }
    }
}

/// The window comes first: render threads give way to it.
fn lower_priority() {
    #[cfg(target_os = "linux")]
    // SAFETY: plain system call; 0 names the calling thread, and failing is harmless.
    unsafe {
        libc::setpriority(libc::PRIO_PROCESS, 0, 5);
    }
}

fn run(shared: &Arc<Shared>, pool: &rayon::ThreadPool, gpu: (Option<String>, RayChoice)) {
    let mut kept = Kept::new(gpu, Arc::clone(&shared.screen));
    let alarm = Alarm::start(Arc::clone(&shared.cancel));
    let mut done: Option<Arc<Request>> = None;
    loop {
        let request = {
            let mut slot = lock(&shared.slot);
            loop {
                if slot.quit {
                    return;
                }
                match &slot.request {
                    Some(new) if done.as_ref().is_none_or(|old| !old.is_same(new)) => {
                        // What was to be ended has ended.
                        shared.cancel.store(false, Ordering::Relaxed);
                        break Arc::clone(new);
                    }
                    _ => {
                        slot = shared.changed.wait(slot).unwrap_or_else(PoisonError::into_inner);
                    }
                }
            }
        };
        let world = Arc::clone(&request.world);
        let environment = Arc::clone(&request.environment);
        kept.leave_other_worlds(&request);
        let mut job = Job::new(shared, &alarm, &mut kept, request);
        pool.install(|| {
            if job.is_moving() {
                job.follow(&world, &environment);
            } else {
                job.render(&world, &environment);
            }
        });
        done = Some(job.into_request());
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::environment::{EnvironmentOptions, sky};
    use crate::scene::builtin;

    /// What a window asks for that has just opened.
    pub(super) fn request(
        world: Arc<World>,
        environment: Arc<Environment>,
        size: [u32; 2],
    ) -> Request {
        Request {
            view: View::new(world.scene.cameras[0].clone(), size),
            world,
            environment,
            split: false,
            moving: false,
            previews: true,
            device: DeviceChoice::Cpu,
            is_calm: false,
            inspects_cache: false,
            rule: StopRule::default(),
            is_frozen: false,
            reference: None,
            paused: false,
            run: 0,
        }
    }

    /// What is there of a session's picture.
    pub(in crate::app) fn snapshot_of(request: &Arc<Request>, main: SessionSnapshot) -> Snapshot {
        Snapshot {
            number: main.figures.samples,
            request: Arc::clone(request),
            activity: Activity::Rendering,
            now: main.figures,
            main,
            plain: None,
            counters: None,
            cache: Err(NoCache::Unasked),
            curves: [Vec::new(), Vec::new()],
            backdrop: None,
            calm_seconds: 0.0,
            rest: Arc::new(Rest::new()),
        }
    }

    /// The same for a built-in scene under a soft sky.
    pub(in crate::app) fn request_of(scene: &str, size: [u32; 2]) -> Request {
        let map = sky::build("overcast", 64, 32).expect("a sky");
        let environment = Environment::new(map, &EnvironmentOptions::default());
        let world = World::new(builtin::build(scene).expect("built in"));
        request(Arc::new(world), Arc::new(environment.expect("a sound map")), size)
    }

    /// A worker beside a window; `None`, which is said, where none can be drawn.
    fn worker() -> Option<Worker> {
        let gpu = Gpu::open(None).map_err(|reason| eprintln!("SKIPPED: {reason}")).ok()?;
        let worker = Worker::start(Arc::new(|| ()), (None, RayChoice::default()), gpu);
        Some(worker.expect("threads can be had"))
    }

    /// Waits until a snapshot is as it should be.
    fn wait_for(worker: &Worker, is_right: impl Fn(&Snapshot) -> bool) -> Arc<Snapshot> {
        let start = Instant::now();
        loop {
            if let Some(snapshot) = worker.snapshot().filter(|snapshot| is_right(snapshot)) {
                return snapshot;
            }
            assert!(start.elapsed() < Duration::from_secs(120), "it never comes");
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    #[test]
    fn what_was_learned_outlives_a_change_of_colour() {
        let Some(worker) = worker() else { return };
        let request = Request {
            previews: false,
            rule: StopRule { samples: Some(2), ..StopRule::default() },
            ..request_of("crack", [32, 24])
        };
        let done = |world: &Arc<World>| {
            worker.submit(Request { world: Arc::clone(world), ..request.clone() });
            let is_done = |snapshot: &Snapshot| snapshot.activity == Activity::Done;
            wait_for(&worker, |now| is_done(now) && Arc::ptr_eq(&now.request.world, world))
        };
        let changed = |change: &dyn Fn(&mut crate::scene::Material)| {
            let mut materials = request.world.scene.materials.clone();
            materials.iter_mut().for_each(change);
            Arc::new(request.world.with_materials(materials).expect("there is memory"))
        };
        assert!(done(&request.world).now.learning_paths > 0);
        let darker =
            changed(&|material| material.base_color *= glam::Vec4::new(0.5, 0.5, 0.5, 1.0));
        let after = done(&darker);
        assert_eq!(after.now.learning_paths, 0, "it goes on with what was learned");
        assert!(after.now.learned_cells > 0);
        let open = changed(&|material| material.transmission = 0.9);
        assert!(done(&open).now.learning_paths > 0, "more light comes in");
    }

    #[test]
    fn a_movement_is_seen_while_it_goes_on() {
        let Some(worker) = worker() else { return };
        let mut request = Request { moving: true, ..request_of("office", [640, 480]) };
        let (start, mut seen) = (Instant::now(), std::collections::BTreeSet::new());
        while seen.len() < 3 {
            assert!(start.elapsed() < Duration::from_secs(120), "pictures are ended by the next");
            request.view.camera.world_from_camera.translation.x += 1e-4;
            worker.submit(request.clone());
            std::thread::sleep(Duration::from_millis(2));
            seen.extend(worker.snapshot().map(|snapshot| {
                assert_eq!(snapshot.activity, Activity::Moving);
                snapshot.number
            }));
        }
        // Something else is not kept waiting, and nothing else is shown for it.
        assert!(!request.is_followed_by(&request_of("office", [640, 480])));
        assert!(!request.is_followed_by(&Request { moving: false, ..request.clone() }));
    }

    #[test]
    fn films_are_copied_when_they_are_wanted() {
        let Some(worker) = worker() else { return };
        let request = request_of("open", [64, 48]);
        worker.submit(request.clone());
        let first = wait_for(&worker, |snapshot| snapshot.main.samples > 1);
        first.rest.set_end(Instant::now() + Duration::from_secs(600));
        // One may have been under way.
        let number = first.number + 1;
        let resting = wait_for(&worker, |snapshot| snapshot.number > number);
        let later = wait_for(&worker, |now| now.now.samples > 2 * resting.now.samples);
        assert!(Arc::ptr_eq(&later.main.film, &resting.main.film), "nobody wants another");
        assert_eq!(later.main.figures.samples, resting.main.figures.samples, "its own figures");
        first.rest.set_end(Instant::now());
        let awake = wait_for(&worker, |now| now.main.film.total_samples() >= later.now.samples);
        assert_eq!(awake.main.figures.samples, awake.main.film.total_samples());
        // Whoever pauses sees the last of it.
        awake.rest.set_end(Instant::now() + Duration::from_secs(600));
        worker.submit(Request { paused: true, ..request });
        let last = wait_for(&worker, |snapshot| snapshot.activity == Activity::Paused);
        assert_eq!(last.main.film.total_samples(), last.now.samples);
    }
}
