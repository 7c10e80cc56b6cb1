//! One request being worked on.

use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::device::Device;
use super::{Activity, Point, Request, Shared, Snapshot, Take, Under, lock};
use crate::alarm::Alarm;
use crate::environment::Environment;
use crate::error::Result;
use crate::light_grid::{LearningGrid, LightGrid};
use crate::metrics;
use crate::path::World;
use crate::render::film::Film;
use crate::render::gpu::{DeviceFilm, Gpu, RayChoice};
use crate::render::{Figures, Gi, Lessons, Phase, Sampling, Session, StopRule, View};

/// Longest piece of rendering between two looks at requests and clocks.
const SLICE: Duration = Duration::from_millis(120);
/// A moving camera's picture should take about this long.
const MOVING_SECONDS: f64 = 0.07;
/// What a camera path takes, until it has been measured.
const LIKELY_SECONDS_PER_PATH: f64 = 1e-5;
/// A film begins with every so-manyth pixel of every so-manyth row.
const BEGINNINGS: [u32; 3] = [8, 4, 2];
/// A film that is shown in place is read back this seldom.
const READING_GAP: Duration = Duration::from_millis(250);
/// Publishing may take at most about one part in this of the time.
const PUBLISH_SHARE: u32 = 40;
/// But a picture that changes is shown at least so often.
const LONGEST_GAP: Duration = Duration::from_millis(800);

/// Samples a pixel of the calm picture, which is rendered before the exact one: with them it is as good,
/// denoised, as the exact one with twice as many, in half the time.
const CALM_SAMPLES: u32 = 16;
/// What one of them counts beside an exact one. (Before filtering it is worth five to ten; but its error
/// falls no further.)
const CALM_WORTH: f32 = 4.0;

/// What one job leaves for the next.
pub(super) struct Legacy {
    device: Device,
    /// The last laws that learning ended with, and the map they are for.
    learned: Option<(Arc<LightGrid>, Arc<Environment>)>,
    /// Whether that learning came to its end.
    is_complete: bool,
    /// What was counted, if it came to its end, and what for.
    counted: Option<(Arc<LearningGrid>, Arc<Request>)>,
    /// The world they were learned in.
    world: Option<Arc<World>>,
    /// Seconds one camera path takes, all threads together.
    seconds_per_path: Option<f64>,
    snapshots: u64,
    /// A film of what was seen last, and what it was rendered for.
    under: Option<(Arc<Request>, Arc<Film>)>,
    /// What paths have taught the radiance cache, and where.
    lessons: Option<(Lessons, Arc<Request>)>,
}

impl Legacy {
    /// Of a worker that has done nothing yet.
    pub(super) fn new(gpu: (Option<String>, RayChoice), screen: Arc<Mutex<Gpu>>) -> Self {
        Self {
            device: Device::new(gpu, screen),
            learned: None,
            is_complete: false,
            counted: None,
            world: None,
            seconds_per_path: None,
            snapshots: 0,
            under: None,
            lessons: None,
        }
    }

    /// Whether learning has come to its end in this scene.
    fn has_learned_in(&self, request: &Request) -> bool {
        self.is_complete && self.is_of_world(request)
    }

    /// Whether the radiance cache was taught in this scene with this light, near by.
    fn has_lessons_for(&self, request: &Request) -> bool {
        let position = request.view.camera.world_from_camera.translation.into();
        self.lessons
            .as_ref()
            .is_some_and(|(lessons, of)| of.is_lit_like(request) && lessons.suits(position))
    }

    /// Keeps them for the next session.
    fn keep_lessons(&mut self, session: &mut Session<'_>, request: &Arc<Request>) {
        if let Some(lessons) = session.take_lessons() {
            self.lessons = Some((lessons, Arc::clone(request)));
        }
    }

    /// Laws for this request from the last ones, if they are of the same scene.
    fn laws_for(&self, request: &Request) -> Option<Arc<LightGrid>> {
        if !self.is_of_world(request) {
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

    /// What was counted in this scene with this light.
    fn counted_for(&self, request: &Request) -> Option<Arc<LearningGrid>> {
        let (counted, of) = self.counted.as_ref()?;
        of.is_lit_like(request).then(|| Arc::clone(counted))
    }

    fn is_of_world(&self, request: &Request) -> bool {
        self.world.as_ref().is_some_and(|world| Arc::ptr_eq(world, &request.world))
    }
}

/// A film read back from the window's device, where it is shown in place meanwhile.
struct Reading {
    of: (Gpu, DeviceFilm),
    film: Arc<Film>,
    /// Of the moment it was read, so that both belong together.
    figures: Figures,
    noise: f64,
    at: Instant,
    /// Age at which it is too old.
    gap: Duration,
}

pub(super) struct Job<'a> {
    shared: &'a Shared,
    alarm: &'a Alarm,
    legacy: &'a mut Legacy,
    request: Arc<Request>,
    counters: Option<Arc<LearningGrid>>,
    /// When what was published last, and when there may be something new.
    published: Instant,
    last: Option<(Activity, u64)>,
    publish_gap: Duration,
    /// Films that the window shows in place, as they were read last; they go with the request.
    readings: Vec<Reading>,
    /// The laws published last, with what tells whether they are still those in use.
    laws: Option<((usize, u64), Arc<LightGrid>)>,
    /// The calm film published last, of so many samples in all.
    calm_film: Option<(u64, Arc<Film>)>,
    /// How the error of the main and of the plain picture fell.
    curves: [Vec<Point>; 2],
}

impl<'a> Job<'a> {
    pub(super) fn new(
        shared: &'a Shared,
        alarm: &'a Alarm,
        legacy: &'a mut Legacy,
        request: Arc<Request>,
    ) -> Self {
        Self {
            shared,
            alarm,
            legacy,
            request,
            counters: None,
            published: Instant::now(),
            last: None,
            publish_gap: Duration::ZERO,
            readings: Vec::new(),
            laws: None,
            calm_film: None,
            curves: [Vec::new(), Vec::new()],
        }
    }

    /// Whether the camera moves.
    pub(super) fn is_moving(&self) -> bool {
        self.request.moving
    }

    /// What was worked on last.
    pub(super) fn into_request(self) -> Arc<Request> {
        self.request
    }

    /// Small pictures for as long as the camera rests at this very place.
    pub(super) fn follow(&mut self, world: &World, environment: &Environment) {
        let mut session = self.small_session(world, environment);
        while !self.is_superseded() {
            // The first pass is never cut short: some picture is better than none.
            let cut = session.samples() > 0;
            self.advance(&mut session, None, cut);
            if session.samples() == 0 || self.is_superseded() {
                break;
            }
            self.measure(&session);
            self.keep_under(&session);
            self.publish(Activity::Moving, &session, [None, None]);
            if session.samples() >= 64 {
                self.rest();
            }
        }
        self.legacy.keep_lessons(&mut session, &self.request);
    }

    /// A session for a picture so small that a pass takes a moment, with what was learned before.
    fn small_session<'b>(&mut self, world: &'b World, environment: &'b Environment) -> Session<'b> {
        let mut view = self.request.view.clone();
        let shrink = self.shrink(&view);
        view.width = (view.width / shrink).max(1);
        view.height = (view.height / shrink).max(1);
        if let Some(crop) = &mut view.crop {
            crop.corner = crop.corner.map(|pixel| pixel / shrink);
            crop.whole = crop.whole.map(|pixels| (pixels / shrink).max(1));
        }
        // Learning would take longer than the picture.
        if self.request.is_calm && self.legacy.has_lessons_for(&self.request) {
            view.gi = Gi::Cached;
        }
        self.experienced_session(world, environment, view)
    }

    /// A session that learns, from what is known of the scene if the camera has not gone far.
    fn learning_session<'b>(
        &mut self,
        world: &'b World,
        environment: &'b Environment,
        view: View,
    ) -> Session<'b> {
        let mut session = Session::new(world, environment, view);
        if let Some(counted) = self.legacy.counted_for(&self.request) {
            match session.continue_learning(&counted) {
                Ok(true) => self.counters = Some(counted),
                Ok(false) => {}
                Err(error) => self.go_on(&mut session, Err(error)),
            }
        }
        session
    }

    /// A session that does not learn but uses what was learned before.
    fn experienced_session<'b>(
        &mut self,
        world: &'b World,
        environment: &'b Environment,
        view: View,
    ) -> Session<'b> {
        let mut session = Session::new(world, environment, view);
        session.finish_learning();
        let is_taught = session.view().law_options().is_some();
        if let Some(laws) = self.legacy.laws_for(&self.request).filter(|_| is_taught) {
            let given = session.set_grid((*laws).clone());
            self.go_on(&mut session, given);
        }
        if session.view().gi == Gi::Cached
            && self.legacy.has_lessons_for(&self.request)
            && let Some((lessons, _)) = self.legacy.lessons.take()
        {
            let given = session.set_lessons(lessons);
            self.go_on(&mut session, given);
        }
        session
    }

    /// A film of this view from before, if there is one.
    fn under(&self) -> Option<Arc<Film>> {
        let (request, film) = self.legacy.under.as_ref()?;
        let aspect = |view: &View| f64::from(view.width) / f64::from(view.height);
        let is_as_wide = 1.02 * aspect(&request.view) >= aspect(&self.request.view);
        (is_as_wide && request.looks_like(&self.request)).then(|| Arc::clone(film))
    }

    /// Keeps the film for the next one's first moments, unless there is a better one of the same view.
    fn keep_under(&mut self, session: &Session<'_>) {
        let known = self.under().map_or(0, |film| film.total_samples());
        let film = session.film();
        if film.min_samples() > 0 && film.total_samples() > known {
            self.legacy.under = Some((Arc::clone(&self.request), Arc::new(film.clone())));
        }
    }

    /// By what a moving picture's sides are divided.
    fn shrink(&self, view: &View) -> u32 {
        let pixels = f64::from(view.width) * f64::from(view.height);
        let seconds_per_path = self.legacy.seconds_per_path.unwrap_or(LIKELY_SECONDS_PER_PATH);
        let shrink = (pixels * seconds_per_path / MOVING_SECONDS).sqrt().ceil();
        (shrink as u32).clamp(1, 16)
    }

    /// The full picture: learning first, then samples until a rule is met.
    pub(super) fn render(&mut self, world: &World, environment: &Environment) {
        let view = self.request.view.clone();
        let keeps_laws = self.request.is_frozen && self.legacy.laws_for(&self.request).is_some();
        let mut main = if keeps_laws {
            self.experienced_session(world, environment, view.clone())
        } else {
            self.learning_session(world, environment, view.clone())
        };
        let mut plain = self.request.split.then(|| {
            Session::new(world, environment, View { sampling: Sampling::Plain, ..view.clone() })
        });
        let mut calm = None;
        while let Some(activity) = self.next_activity(&main) {
            let wants_calm = self.is_calm(&main);
            if !wants_calm {
                self.end_calm(&mut calm);
            } else if calm.is_none() && main.phase() == Phase::Rendering {
                let view = View { gi: Gi::Cached, ..view.clone() };
                calm = Some(self.experienced_session(world, environment, view));
            }
            if !self.request.split {
                plain = None;
                self.curves[1].clear();
            }
            match activity {
                Activity::Paused | Activity::Done => {
                    if activity == Activity::Done {
                        let settled = main.settle();
                        let has_failed = settled.is_err();
                        self.go_on(&mut main, settled);
                        if has_failed {
                            continue;
                        }
                    }
                    self.publish(activity, &main, [plain.as_ref(), calm.as_ref()]);
                    self.rest();
                    continue;
                }
                // A picture first.
                Activity::Learning(_) if self.beginning(&main).is_some() => {
                    self.advance(&mut main, None, true);
                    self.measure(&main);
                }
                Activity::Learning(_) => self.learn(&mut main),
                Activity::Rendering | Activity::Moving => match &mut plain {
                    // Equal time, learning included.
                    Some(plain) if plain.elapsed_seconds() < main.elapsed_seconds() => {
                        self.advance(plain, None, true);
                    }
                    _ if let Some(calm) = calm.as_mut().filter(|calm| goes_first(calm, &main)) => {
                        self.advance(calm, None, true);
                    }
                    _ => {
                        let law_paths = main.figures().law_paths;
                        self.advance(&mut main, Some(self.request.rule), self.request.previews);
                        self.measure(&main);
                        if main.figures().law_paths > law_paths {
                            self.keep_laws(&main, true);
                        }
                    }
                },
            }
            let due = self.published.elapsed() >= self.publish_gap;
            let is_reading_due = due && self.is_reading_due(&main);
            if due && self.request.previews && !self.is_superseded() {
                let others = [plain.as_ref(), calm.as_ref()];
                let progress =
                    progress(&main) + others.iter().flatten().map(|s| progress(s)).sum::<u64>();
                if self.last != Some((activity, progress)) {
                    self.publish(activity, &main, others);
                    self.last = Some((activity, progress));
                }
            }
            // After publishing, which has read the film.
            if is_reading_due || !self.request.previews {
                self.note(0, &main);
                plain.iter().for_each(|plain| self.note(1, plain));
            }
        }
        self.end_calm(&mut calm);
        if self.request.previews {
            self.keep_under(&main);
        }
    }

    /// Whether light from a radiance cache is to be shown beside what there is: not where a real GPU has
    /// many samples in a moment, nor where pictures are compared.
    fn is_calm(&self, main: &Session<'_>) -> bool {
        self.request.is_calm
            && !self.request.split
            && !self.legacy.device.is_quick(&self.request)
            && calm_worth(main.samples()) > 0.0
    }

    fn end_calm(&mut self, calm: &mut Option<Session<'_>>) {
        if let Some(mut calm) = calm.take() {
            self.calm_film = None;
            self.legacy.keep_lessons(&mut calm, &self.request);
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
        } else if main.samples() > 0 && main.is_done(&self.request.rule) {
            Activity::Done
        } else {
            Activity::Rendering
        })
    }

    /// One learning pass.
    fn learn(&mut self, main: &mut Session<'_>) {
        self.place(main);
        let learned = main.advance(1, &self.shared.cancel);
        self.go_on(main, learned);
        let is_done = main.phase() == Phase::Rendering;
        // A little learned is better than nothing, but what was learned to the end is better still.
        if is_done
            || (main.figures().learned_cells > 0 && !self.legacy.has_learned_in(&self.request))
        {
            self.keep_laws(main, is_done);
        }
    }

    /// Keeps what was learned, for inspection and for the next request.
    fn keep_laws(&mut self, main: &Session<'_>, is_complete: bool) {
        if is_complete {
            self.counters = main.counters().map(|counters| Arc::new(counters.snapshot()));
            let request = || Arc::clone(&self.request);
            self.legacy.counted = self.counters.clone().map(|counted| (counted, request()));
        }
        if let Some(laws) = self.laws_of(main) {
            self.legacy.learned = Some((laws, Arc::clone(&self.request.environment)));
            self.legacy.world = Some(Arc::clone(&self.request.world));
            self.legacy.is_complete = is_complete;
        }
    }

    /// The laws in use. They are megabytes and seldom change: they are copied once.
    fn laws_of(&mut self, session: &Session<'_>) -> Option<Arc<LightGrid>> {
        let grid = session.grid()?;
        let key = (std::ptr::from_ref(grid).addr(), session.figures().law_paths);
        Some(match &self.laws {
            Some((old, laws)) if *old == key => Arc::clone(laws),
            _ => {
                let laws = Arc::new(grid.clone());
                self.laws = Some((key, Arc::clone(&laws)));
                laws
            }
        })
    }

    /// One pass, cut short after a slice if asked for.
    fn advance(&mut self, session: &mut Session<'_>, rule: Option<StopRule>, cut: bool) {
        self.place(session);
        self.alarm.set(cut.then(|| Instant::now() + SLICE));
        let advanced = match self.beginning(session) {
            Some(every) => {
                session.begin(every, &self.shared.cancel);
                Ok(())
            }
            None => {
                let samples = session.next_pass(&rule.unwrap_or_default());
                session.advance(samples, &self.shared.cancel)
            }
        };
        self.alarm.set(None);
        self.go_on(session, advanced);
        let slot = lock(&self.shared.slot);
        if !slot.quit && slot.request.as_ref().is_none_or(|new| !self.request.restarts(new)) {
            self.shared.cancel.store(false, Ordering::Relaxed);
        }
    }

    /// How far apart the pixels are that the film is to begin with now; `None` once it has begun, and
    /// for moving pictures, which are small.
    fn beginning(&self, session: &Session<'_>) -> Option<u32> {
        if !self.request.previews
            || self.request.moving
            || session.samples() > 0
            || session.is_on_gpu()
        {
            return None;
        }
        let (view, samples) = (session.view(), session.figures().samples);
        let pixels =
            |every| u64::from(view.width.div_ceil(every)) * u64::from(view.height.div_ceil(every));
        let is_learning = session.phase() == Phase::Learning;
        let stages = &BEGINNINGS[..if is_learning { 1 } else { BEGINNINGS.len() }];
        stages.iter().copied().find(|every| samples < pixels(*every))
    }

    /// Lets the session run on the device that is asked for now.
    fn place(&mut self, session: &mut Session<'_>) {
        // A GPU that is not ready, or is none, comes when there is something to be seen.
        let is_fresh = session.samples() == 0 && !session.is_on_gpu();
        let is_learning = session.phase() == Phase::Learning;
        let begins =
            self.request.moving || is_fresh && (is_learning || self.beginning(session).is_some());
        if begins && self.request.previews && !self.legacy.device.is_quick(&self.request) {
            session.continue_on_cpu();
            return;
        }
        let is_long = self.legacy.device.needs_preparation(&self.request);
        if is_long {
            self.shared.is_preparing.store(true, Ordering::Relaxed);
            (self.shared.wake)();
            // The other device's speed says nothing.
            self.legacy.seconds_per_path = None;
        }
        self.legacy.device.place(session, &self.request);
        self.shared.is_preparing.store(false, Ordering::Relaxed);
        self.tell_failure();
    }

    /// Goes on where it can if a GPU has failed.
    fn go_on(&mut self, session: &mut Session<'_>, outcome: Result<()>) {
        if let Err(failure) = outcome {
            session.continue_on_cpu();
            self.legacy.device.give_up(&failure);
            self.tell_failure();
        }
    }

    fn tell_failure(&mut self) {
        if let Some(sentence) = self.legacy.device.take_failure() {
            lock(&self.shared.failures).push(sentence);
            (self.shared.wake)();
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
        [plain, calm]: [Option<&Session<'_>>; 2],
    ) {
        let start = Instant::now();
        self.legacy.snapshots += 1;
        let is_final = matches!(activity, Activity::Paused | Activity::Done);
        let (main_take, main_cost) = self.take(main, is_final);
        let plain_take = plain.map(|session| self.take(session, is_final));
        let reading = main_cost + plain_take.as_ref().map_or(Duration::ZERO, |(_, cost)| *cost);
        let snapshot = Snapshot {
            number: self.legacy.snapshots,
            request: Arc::clone(&self.request),
            activity,
            main: main_take,
            plain: plain_take.map(|(take, _)| take),
            counters: self.counters.clone(),
            under: self.shown_under(main, calm),
            curves: self.curves.clone(),
        };
        *lock(&self.shared.snapshot) = Some(Arc::new(snapshot));
        (self.shared.wake)();
        self.published = Instant::now();
        let cost = (self.published - start).saturating_sub(reading);
        self.publish_gap = gap_after(cost);
    }

    /// What is shown together with the session's own film: the calm one once it has more to say than
    /// what was seen before.
    fn shown_under(&mut self, main: &Session<'_>, calm: Option<&Session<'_>>) -> Option<Under> {
        let before = self.under().map(|film| Under { film, worth: 1.0, is_cached: false });
        let seen = before.as_ref().map_or(0, |under| under.film.total_samples());
        let Some(calm) = calm.filter(|calm| calm.figures().samples > seen) else { return before };
        // It is megabytes and is soon complete.
        let samples = calm.figures().samples;
        let kept = self.calm_film.take().filter(|(of, _)| *of == samples);
        let kept = kept.unwrap_or_else(|| (samples, Arc::new(calm.film().clone())));
        let film = Arc::clone(&self.calm_film.insert(kept).1);
        Some(Under { film, worth: calm_worth(main.samples()), is_cached: true })
    }

    /// Adds a point to a curve, unless nothing has happened since the last one.
    fn note(&mut self, curve: usize, session: &Session<'_>) {
        let film = session.film();
        let point =
            Point {
                seconds: session.elapsed_seconds(),
                samples: film.total_samples() as f64 / film.pixels().len().max(1) as f64,
                noise: session.noise(),
                error: self.request.reference.as_ref().and_then(|reference| {
                    metrics::relative_rms_error(&film.image(), &reference.image)
                }),
            };
        let curve = &mut self.curves[curve];
        let is_later = curve.last().is_none_or(|last| point.samples > last.samples);
        if point.noise.is_finite() && point.noise > 0.0 && is_later {
            curve.push(point);
        }
    }

    /// The session's picture, and what reading a film that is shown in place took of the time.
    fn take(&mut self, session: &Session<'_>, is_final: bool) -> (Take, Duration) {
        let on_device = session.film_on_device();
        let in_place = self.in_place(session);
        let kept = self.reading(in_place.as_ref()).filter(|_| !is_final);
        let (film, figures, noise, cost) = match kept {
            Some(reading) => {
                (Arc::clone(&reading.film), reading.figures, reading.noise, Duration::ZERO)
            }
            None => {
                let start = Instant::now();
                let film = self.film_of(session);
                let (noise, figures) = (session.noise(), session.figures());
                let cost = in_place.as_ref().map_or(Duration::ZERO, |_| start.elapsed());
                if let Some(of) = in_place {
                    let (at, gap) = (Instant::now(), gap_after(cost).max(READING_GAP));
                    self.readings.retain(|reading| !is_same(&reading.of, &of));
                    let film = Arc::clone(&film);
                    self.readings.push(Reading { of, film, figures, noise, at, gap });
                }
                (film, figures, noise, cost)
            }
        };
        let take = Take {
            samples: session.samples(),
            sampling: session.view().sampling,
            noise,
            film,
            figures,
            gpu: session.gpu_figures().map(Arc::new),
            on_device,
            grid: self.laws_of(session),
        };
        (take, cost)
    }

    /// The session's film; before the first sample, one of the same view from before.
    fn film_of(&self, session: &Session<'_>) -> Arc<Film> {
        let before = if session.figures().samples == 0 { self.under() } else { None };
        before.unwrap_or_else(|| Arc::new(session.film().clone()))
    }

    /// The session's film if the window shows it in every frame without its being read. Small ones are
    /// filtered on the CPU, and software does not draw so often.
    fn in_place(&self, session: &Session<'_>) -> Option<(Gpu, DeviceFilm)> {
        let (gpu, film) = session.film_on_device()?;
        let is_small = film.width < self.request.view.width;
        let is_live = !gpu.facts().is_software() && gpu.is_same(&lock(&self.shared.screen));
        (is_live && !is_small).then_some((gpu, film))
    }

    /// The last reading of a film, unless it is too old.
    fn reading(&self, of: Option<&(Gpu, DeviceFilm)>) -> Option<&Reading> {
        let of = of?;
        self.readings.iter().find(|r| is_same(&r.of, of) && r.at.elapsed() < r.gap)
    }

    /// Whether figures that need the film are to be taken anew.
    fn is_reading_due(&self, session: &Session<'_>) -> bool {
        session.samples() > 0 && self.reading(self.in_place(session).as_ref()).is_none()
    }
}

/// Whether the calm picture gets its next sample before the exact one: a few of them for each.
fn goes_first(calm: &Session<'_>, main: &Session<'_>) -> bool {
    calm.samples() < CALM_SAMPLES.min(2 + 4 * main.samples())
}

/// What a sample of the calm picture counts where the exact one has so many: it fades out.
fn calm_worth(samples: u32) -> f32 {
    let all = CALM_WORTH * CALM_SAMPLES as f32;
    CALM_WORTH * ((4.0 * all - samples as f32) / (3.0 * all)).clamp(0.0, 1.0)
}

fn is_same((gpu, film): &(Gpu, DeviceFilm), other: &(Gpu, DeviceFilm)) -> bool {
    gpu.is_same(&other.0) && *film == other.1
}

/// Time until something that took `cost` may be done again.
fn gap_after(cost: Duration) -> Duration {
    (cost * PUBLISH_SHARE).clamp(SLICE, LONGEST_GAP)
}

fn learned_share(session: &Session<'_>) -> f32 {
    let (done, all) = (session.figures().learning_paths, session.view().learning_paths);
    done as f32 / all.max(1) as f32
}

/// Grows with whatever a session does.
fn progress(session: &Session<'_>) -> u64 {
    let figures = session.figures();
    figures.learning_paths + figures.samples
}
