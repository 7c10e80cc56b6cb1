//! The render thread: takes the latest request, publishes the latest picture.
//!
//! The only place that runs a [`Session`]. A request that differs in what is seen starts anew; one
//! that differs in when to stop or whether to pause is taken on the way. While learning for a new
//! view, a second session renders with what was learned for the view before, around its centre, so
//! that there is a picture at once.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::Wake;
use crate::environment::Environment;
use crate::error::{Error, Result};
use crate::light_grid::{LearningGrid, LightGrid};
use crate::path::World;
use crate::render::film::Film;
use crate::render::{Figures, Phase, Sampling, Session, StopRule, View};
use crate::scene::Camera;

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
    /// When to stop.
    pub rule: StopRule,
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
            || self.split != new.split
            || self.moving != new.moving
            || self.run != new.run
    }

    fn is_same(&self, new: &Self) -> bool {
        !self.restarts(new) && self.rule == new.rule && self.paused == new.paused
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

/// How good a picture was at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Seconds of learning and rendering.
    pub seconds: f64,
    /// Samples per pixel.
    pub samples: f64,
    /// Estimated relative RMS error.
    pub noise: f64,
}

/// One picture and what was done for it.
#[derive(Clone)]
pub struct Take {
    /// How the map was sampled.
    pub sampling: Sampling,
    /// The sums.
    pub film: Arc<Film>,
    /// What was done.
    pub figures: Figures,
    /// [`Film::noise`].
    pub noise: f64,
    /// The laws in use.
    pub grid: Option<Arc<LightGrid>>,
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
    pub main: Take,
    /// The plain picture of a split view.
    pub plain: Option<Take>,
    /// Whether `main` only bridges the time until learning is done.
    pub is_preview: bool,
    /// What learning counted, once it has ended.
    pub counters: Option<Arc<LearningGrid>>,
    /// Figures of the session that learns, while `main` is a preview.
    pub learning: Figures,
    /// How the error of `main` and of `plain` fell.
    pub curves: [Vec<Point>; 2],
    /// A small picture of the same view, for pixels that have no samples yet.
    pub under: Option<Arc<Film>>,
}

/// Longest piece of rendering between two looks at requests and clocks.
const SLICE: Duration = Duration::from_millis(120);
/// A moving camera's picture should take about this long.
const MOVING_SECONDS: f64 = 0.07;
/// Publishing may take at most about one part in this of the time.
const PUBLISH_SHARE: u32 = 20;

struct Shared {
    slot: Mutex<Slot>,
    changed: Condvar,
    cancel: Arc<AtomicBool>,
    snapshot: Mutex<Option<Arc<Snapshot>>>,
    wake: Wake,
}

#[derive(Default)]
struct Slot {
    request: Option<Arc<Request>>,
    quit: bool,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The handle of the render thread; it ends when dropped.
pub struct Worker {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    pool: Arc<rayon::ThreadPool>,
}

impl Worker {
    /// Starts the thread; `wake` is called at every new snapshot.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub fn start(wake: Wake) -> Result<Self> {
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
            wake,
        });
        let (inside, render_pool) = (Arc::clone(&shared), Arc::clone(&pool));
        let thread = std::thread::Builder::new()
            .name("worker".to_owned())
            .spawn(move || run(&inside, &render_pool))
            .map_err(|e| no_thread(&e))?;
        Ok(Self { shared, thread: Some(thread), pool })
    }

    /// Asks for a picture; the latest request counts.
    pub fn submit(&self, request: Request) {
        let mut slot = lock(&self.shared.slot);
        if slot.request.as_ref().is_some_and(|old| old.is_same(&request)) {
            return;
        }
        if slot.request.as_ref().is_some_and(|old| old.restarts(&request)) {
            self.shared.cancel.store(true, Ordering::Relaxed);
        }
        slot.request = Some(Arc::new(request));
        self.shared.changed.notify_all();
    }

    /// The latest picture.
    pub fn snapshot(&self) -> Option<Arc<Snapshot>> {
        lock(&self.shared.snapshot).clone()
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

/// What one job leaves for the next.
#[derive(Default)]
struct Legacy {
    /// The last laws that learning ended with, and the map they are for.
    learned: Option<(Arc<LightGrid>, Arc<Environment>)>,
    /// Whether that learning came to its end.
    is_complete: bool,
    /// The world they were learned in.
    world: Option<Arc<World>>,
    /// Seconds one camera path takes, all threads together.
    seconds_per_path: Option<f64>,
    snapshots: u64,
    /// The last small picture and its camera.
    under: Option<(Camera, Arc<Film>)>,
}

impl Legacy {
    /// Whether learning has come to its end in this scene.
    fn has_learned_in(&self, request: &Request) -> bool {
        self.is_complete
            && self.world.as_ref().is_some_and(|world| Arc::ptr_eq(world, &request.world))
    }

    /// Laws for this request from the last ones, if they are of the same scene.
    fn laws_for(&self, request: &Request) -> Option<Arc<LightGrid>> {
        if !self.world.as_ref().is_some_and(|world| Arc::ptr_eq(world, &request.world)) {
            return None;
        }
        let (laws, map) = self.learned.as_ref()?;
        let same = map.tile_energies() == request.environment.tile_energies()
            && map.direction_in_tile(0, glam::Vec2::ZERO)
                == request.environment.direction_in_tile(0, glam::Vec2::ZERO);
        if same {
            return Some(Arc::clone(laws));
        }
        laws.transferred(map, &request.environment).map(Arc::new)
    }
}

fn run(shared: &Arc<Shared>, pool: &rayon::ThreadPool) {
    let mut legacy = Legacy::default();
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
        let mut job = Job {
            shared,
            alarm: &alarm,
            legacy: &mut legacy,
            request,
            counters: None,
            published: Instant::now(),
            publish_gap: Duration::ZERO,
            laws: None,
            curves: [Vec::new(), Vec::new()],
        };
        pool.install(|| {
            if job.request.moving {
                job.follow(&world, &environment);
            } else {
                job.render(&world, &environment);
            }
        });
        done = Some(job.request);
    }
}

/// Sets the cancel flag after a while, so that a pass ends with what it has.
struct Alarm {
    state: Arc<(Mutex<AlarmState>, Condvar)>,
}

#[derive(Default)]
struct AlarmState {
    at: Option<Instant>,
    quit: bool,
}

impl Alarm {
    fn start(cancel: Arc<AtomicBool>) -> Self {
        let state = Arc::new((Mutex::new(AlarmState::default()), Condvar::new()));
        let inside = Arc::clone(&state);
        // Without the thread passes are merely not cut short.
        let _ = std::thread::Builder::new().name("alarm".to_owned()).spawn(move || {
            let (mutex, changed) = &*inside;
            let mut state = lock(mutex);
            while !state.quit {
                state = match state.at.map(|at| at.saturating_duration_since(Instant::now())) {
                    None => changed.wait(state).unwrap_or_else(PoisonError::into_inner),
                    Some(Duration::ZERO) => {
                        cancel.store(true, Ordering::Relaxed);
                        state.at = None;
                        state
                    }
                    Some(left) => {
                        changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0
                    }
                };
            }
        });
        Self { state }
    }

    fn set(&self, at: Option<Instant>) {
        lock(&self.state.0).at = at;
        self.state.1.notify_all();
    }
}

impl Drop for Alarm {
    fn drop(&mut self) {
        lock(&self.state.0).quit = true;
        self.state.1.notify_all();
    }
}

struct Job<'a> {
    shared: &'a Shared,
    alarm: &'a Alarm,
    legacy: &'a mut Legacy,
    request: Arc<Request>,
    counters: Option<Arc<LearningGrid>>,
    published: Instant,
    publish_gap: Duration,
    /// The laws published last, with what tells whether they are still those in use.
    laws: Option<((usize, u64), Arc<LightGrid>)>,
    /// How the error of the main and of the plain picture fell.
    curves: [Vec<Point>; 2],
}

impl Job<'_> {
    /// Small pictures for as long as the camera rests at this very place.
    fn follow(&mut self, world: &World, environment: &Environment) {
        let mut session = self.small_session(world, environment);
        while !self.is_superseded() {
            // The first pass is never cut short: some picture is better than none.
            let cut = session.film().min_samples() > 0;
            self.advance(&mut session, None, cut);
            if session.film().min_samples() == 0 || self.is_superseded() {
                return;
            }
            self.measure(&session);
            self.keep_under(&session);
            self.publish(Activity::Moving, &session, None, None);
            if session.film().min_samples() >= 64 {
                self.rest();
            }
        }
    }

    /// A session for a small picture, with what was learned before.
    fn small_session<'b>(&self, world: &'b World, environment: &'b Environment) -> Session<'b> {
        let mut view = self.request.view.clone();
        let shrink = self.shrink(&view);
        view.width = (view.width / shrink).max(1);
        view.height = (view.height / shrink).max(1);
        self.experienced_session(world, environment, view)
    }

    /// A session that does not learn but uses what was learned before.
    fn experienced_session<'b>(
        &self,
        world: &'b World,
        environment: &'b Environment,
        view: View,
    ) -> Session<'b> {
        let mut session = Session::new(world, environment, view);
        session.finish_learning();
        if let Some(laws) = self.legacy.laws_for(&self.request) {
            session.set_grid((*laws).clone());
        }
        session
    }

    /// A small picture to begin with, unless one of this view is shown.
    fn glance(&mut self, world: &World, environment: &Environment) {
        if self.under().is_some() || !self.request.previews {
            return;
        }
        let mut session = self.small_session(world, environment);
        self.advance(&mut session, None, false);
        if session.film().min_samples() > 0 && !self.is_superseded() {
            self.measure(&session);
            self.keep_under(&session);
            self.publish(Activity::Moving, &session, None, None);
        }
    }

    /// The small picture of this view, if there is one.
    fn under(&self) -> Option<Arc<Film>> {
        let (camera, film) = self.legacy.under.as_ref()?;
        (*camera == self.request.view.camera).then(|| Arc::clone(film))
    }

    /// Keeps the small picture for the good one's first moments.
    fn keep_under(&mut self, session: &Session<'_>) {
        let camera = self.request.view.camera.clone();
        self.legacy.under = Some((camera, Arc::new(session.film().clone())));
    }

    /// By what the picture's sides are divided while the camera moves.
    fn shrink(&self, view: &View) -> u32 {
        let pixels = f64::from(view.width) * f64::from(view.height);
        let Some(seconds_per_path) = self.legacy.seconds_per_path else { return 8 };
        let shrink = (pixels * seconds_per_path / MOVING_SECONDS).sqrt().ceil();
        (shrink as u32).clamp(1, 16)
    }

    /// The full picture: learning first, with a preview meanwhile, then samples until a rule is met.
    fn render(&mut self, world: &World, environment: &Environment) {
        self.glance(world, environment);
        let mut main = Session::new(world, environment, self.request.view.clone());
        let mut plain = self.request.split.then(|| {
            let view = View { sampling: Sampling::Plain, ..self.request.view.clone() };
            Session::new(world, environment, view)
        });
        let is_experienced = self.legacy.laws_for(&self.request).is_some();
        let mut preview = None;
        if self.request.previews && main.phase() == Phase::Learning {
            let view = self.request.view.clone();
            preview = Some(self.experienced_session(world, environment, view));
        }
        while let Some(activity) = self.next_activity(&main) {
            match activity {
                Activity::Paused | Activity::Done => {
                    self.publish(activity, &main, plain.as_ref(), preview.as_ref());
                    self.rest();
                    continue;
                }
                Activity::Learning(_) => {
                    self.learn(&mut main, preview.as_mut());
                    // Where nothing was learned before, even a little helps.
                    if let (Some(preview), Some(laws)) = (&mut preview, main.grid())
                        && !is_experienced
                    {
                        preview.set_grid(laws.clone());
                    }
                }
                Activity::Rendering | Activity::Moving => {
                    self.measure(&main);
                    match &mut plain {
                        // Equal time, learning included.
                        Some(plain) if plain.elapsed_seconds() < main.elapsed_seconds() => {
                            self.advance(plain, None, true);
                        }
                        _ => {
                            self.advance(&mut main, Some(self.request.rule), self.request.previews);
                        }
                    }
                }
            }
            if let Some(session) = &preview
                && main.film().min_samples() >= session.film().min_samples().min(4)
                && main.phase() == Phase::Rendering
                && main.film().min_samples() > 0
            {
                preview = None;
            }
            let due = self.published.elapsed() >= self.publish_gap;
            if due || !self.request.previews {
                self.note(0, &main);
                plain.iter().for_each(|plain| self.note(1, plain));
            }
            if due && self.request.previews && !self.is_superseded() {
                self.publish(activity, &main, plain.as_ref(), preview.as_ref());
            }
        }
    }

    /// What is to be done next; `None` when something else is asked for.
    fn next_activity(&mut self, main: &Session<'_>) -> Option<Activity> {
        {
            let slot = lock(&self.shared.slot);
            if slot.quit {
                return None;
            }
            if let Some(new) = &slot.request {
                if self.request.restarts(new) {
                    return None;
                }
                self.request = Arc::clone(new);
            }
            self.shared.cancel.store(false, Ordering::Relaxed);
        }
        Some(if self.request.paused {
            Activity::Paused
        } else if main.phase() == Phase::Learning {
            Activity::Learning(learned_share(main))
        } else if main.film().min_samples() > 0 && main.is_done(&self.request.rule) {
            Activity::Done
        } else {
            Activity::Rendering
        })
    }

    /// One learning pass, then the preview for as long.
    fn learn(&mut self, main: &mut Session<'_>, preview: Option<&mut Session<'_>>) {
        if let Some(preview) = preview {
            // A picture first.
            let start = Instant::now();
            let owed = main.figures().learning_seconds - preview.figures().render_seconds;
            while !self.is_superseded()
                && (preview.film().min_samples() == 0
                    || start.elapsed().as_secs_f64() < owed.min(1.0))
            {
                self.advance(preview, None, true);
                self.measure(preview);
                if preview.film().total_samples() > 0
                    && self.published.elapsed() >= self.publish_gap
                    && !self.is_superseded()
                {
                    let activity = Activity::Learning(learned_share(main));
                    self.publish(activity, main, None, Some(preview));
                }
            }
        }
        if self.is_superseded() {
            return;
        }
        main.advance(1, &self.shared.cancel);
        let is_done = main.phase() == Phase::Rendering;
        if is_done {
            self.counters = main.take_counters().map(Arc::new);
        }
        // A little learned is better than nothing, but what was learned to the end is better still.
        if (is_done
            || (main.figures().learned_cells > 0 && !self.legacy.has_learned_in(&self.request)))
            && let Some(laws) = main.grid()
        {
            let map = Arc::clone(&self.request.environment);
            self.legacy.learned = Some((Arc::new(laws.clone()), map));
            self.legacy.world = Some(Arc::clone(&self.request.world));
            self.legacy.is_complete = is_done;
        }
    }

    /// One pass, cut short after a slice if asked for.
    fn advance(&self, session: &mut Session<'_>, rule: Option<StopRule>, cut: bool) {
        self.alarm.set(cut.then(|| Instant::now() + SLICE));
        session.advance(session.next_pass(&rule.unwrap_or_default()), &self.shared.cancel);
        self.alarm.set(None);
        let slot = lock(&self.shared.slot);
        if !slot.quit && slot.request.as_ref().is_none_or(|new| !self.request.restarts(new)) {
            self.shared.cancel.store(false, Ordering::Relaxed);
        }
    }

    fn measure(&mut self, session: &Session<'_>) {
        let figures = session.figures();
        if figures.samples > 1000 {
            self.legacy.seconds_per_path = Some(figures.render_seconds / figures.samples as f64);
        }
    }

    fn is_superseded(&self) -> bool {
        let slot = lock(&self.shared.slot);
        slot.quit || slot.request.as_ref().is_some_and(|new| self.request.restarts(new))
    }

    /// Waits until something else is asked for.
    fn rest(&self) {
        let mut slot = lock(&self.shared.slot);
        while !slot.quit && slot.request.as_ref().is_some_and(|new| self.request.is_same(new)) {
            slot = self.shared.changed.wait(slot).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn publish(
        &mut self,
        activity: Activity,
        main: &Session<'_>,
        plain: Option<&Session<'_>>,
        preview: Option<&Session<'_>>,
    ) {
        let start = Instant::now();
        self.legacy.snapshots += 1;
        let shown = preview.unwrap_or(main);
        let snapshot = Snapshot {
            number: self.legacy.snapshots,
            request: Arc::clone(&self.request),
            activity,
            main: self.take(shown),
            plain: plain.map(|session| self.take(session)),
            is_preview: preview.is_some(),
            counters: self.counters.clone(),
            learning: *main.figures(),
            under: self.under(),
            curves: self.curves.clone(),
        };
        *lock(&self.shared.snapshot) = Some(Arc::new(snapshot));
        (self.shared.wake)();
        self.published = Instant::now();
        let cost = self.published - start;
        self.publish_gap = (cost * PUBLISH_SHARE).clamp(SLICE, Duration::from_secs(3));
    }

    /// Adds a point to a curve, unless nothing has happened since the last one.
    fn note(&mut self, curve: usize, session: &Session<'_>) {
        let film = session.film();
        let point = Point {
            seconds: session.elapsed_seconds(),
            samples: film.total_samples() as f64 / film.pixels().len().max(1) as f64,
            noise: film.noise(),
        };
        let curve = &mut self.curves[curve];
        let is_later = curve.last().is_none_or(|last| point.samples > last.samples);
        if point.noise.is_finite() && point.noise > 0.0 && is_later {
            curve.push(point);
        }
    }

    fn take(&mut self, session: &Session<'_>) -> Take {
        let film = session.film();
        Take {
            sampling: session.view().sampling,
            noise: film.noise(),
            film: Arc::new(film.clone()),
            figures: *session.figures(),
            grid: session.grid().map(|grid| {
                // Laws are megabytes and seldom change: they are copied once.
                let key = (std::ptr::from_ref(grid).addr(), session.figures().learning_paths);
                match &self.laws {
                    Some((old, laws)) if *old == key => Arc::clone(laws),
                    _ => {
                        let laws = Arc::new(grid.clone());
                        self.laws = Some((key, Arc::clone(&laws)));
                        laws
                    }
                }
            }),
        }
    }
}

fn learned_share(session: &Session<'_>) -> f32 {
    let (done, all) = (session.figures().learning_paths, session.view().learning_paths);
    done as f32 / all.max(1) as f32
}
