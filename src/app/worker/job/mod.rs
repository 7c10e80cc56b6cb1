//! One request being worked on.

mod cached;
mod publishing;
mod sessions;

use std::borrow::Cow;
use std::ops::ControlFlow;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};

use cached::{CachedPicture, worth};
use publishing::{FilmReadback, Resized};
use sessions::Placed;

use super::kept::{Learned, SessionCache, SuspendedPicture};
use super::{Activity, Point, Request, Shared};
use crate::alarm::Alarm;
use crate::environment::Environment;
use crate::light_grid::{LearningGrid, LightGrid};
use crate::path::World;
use crate::radiance_cache::CacheFacts;
use crate::render::film::Film;
use crate::render::{Gi, Phase, Sampling, Session, StopRule, View};

/// Sessions by what they are for.
const MAIN: usize = 0;
const PLAIN: usize = 1;
/// While there is much to learn the picture goes on a little this often.
const STANDSTILL: Duration = Duration::from_millis(400);

pub(super) struct PictureTask<'a> {
    shared: &'a Arc<Shared>,
    alarm: &'a Alarm,
    kept: &'a mut SessionCache,
    request: Arc<Request>,
    counters: Option<Arc<LearningGrid>>,
    /// When what was published last, and when there may be something new.
    published: Instant,
    last: Option<(Activity, u64)>,
    publish_gap: Duration,
    /// The films of the main and the plain picture, as they were read last; they go with the request.
    readings: [Option<FilmReadback>; 2],
    /// The film from before in the picture's size.
    resized: Option<Resized>,
    /// Copies of films that somebody still has.
    films: Vec<Weak<Film>>,
    /// The distributions published last, with what tells whether they are still those in use.
    distributions: Option<((usize, u64), Arc<LightGrid>)>,
    /// Seconds spent on the cached picture.
    cached_seconds: f64,
    /// What is known of the radiance cache, with what tells of which.
    cache: Option<((u64, f32), Arc<CacheFacts>)>,
    /// How the error of the main and of the plain picture fell.
    curves: [Vec<Point>; 2],
}

impl<'a> PictureTask<'a> {
    pub(super) fn new(
        shared: &'a Arc<Shared>,
        alarm: &'a Alarm,
        kept: &'a mut SessionCache,
        request: Arc<Request>,
    ) -> Self {
        Self {
            shared,
            alarm,
            kept,
            request,
            counters: None,
            published: Instant::now(),
            last: None,
            publish_gap: Duration::ZERO,
            readings: [None, None],
            resized: None,
            films: Vec::new(),
            distributions: None,
            cached_seconds: 0.0,
            cache: None,
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
        let was_quick = self.kept.device.is_quick(&self.request);
        let mut session = self.small_session(world, environment, was_quick);
        self.place(&mut session);
        if was_quick && !session.is_on_gpu() {
            // The CPU affords less until there are kernels for it.
            session = self.small_session(world, environment, false);
        }
        while !self.is_superseded() {
            // The first pass is never cut short: some picture is better than none.
            let cut = session.samples() > 0;
            self.advance(&mut session, None, cut);
            if session.samples() == 0 || self.is_elsewhere() {
                break;
            }
            self.measure(&session);
            self.keep_backdrop(Cow::Borrowed(session.film()), 1.0);
            self.publish(Activity::Moving, &session, None, &mut CachedPicture::default());
            if session.samples() >= 64 {
                self.rest();
            }
        }
        self.kept.keep_training(&mut session, &self.request);
    }

    /// The full picture: learning first, then samples until a rule is met.
    pub(super) fn render(&mut self, world: &World, environment: &Environment) {
        let view = self.request.view.clone();
        let keeps_distributions =
            self.request.is_frozen && self.kept.distributions_for(&self.request).is_some();
        let (before, mut cached) = self.picture_of_before(world, environment);
        if before.is_none() && self.request.previews && !self.kept.device.is_quick(&self.request) {
            self.resize_backdrop();
        }
        let is_rich = self.has_rich_backdrop();
        let mut main = if let Some(session) = before {
            // Before it goes on.
            self.publish(Activity::Rendering, &session, None, &mut cached);
            session
        } else if keeps_distributions {
            self.experienced_session(world, environment, view.clone())
        } else {
            self.learning_session(world, environment, view.clone())
        };
        let mut plain: Option<Session<'_>> = None;
        // Of the cached picture, one after the other.
        let mut turns = 0;
        // When the picture went on last.
        let mut went_on = Instant::now();
        while let Some(activity) = self.next_activity(&main, plain.as_ref()) {
            if !self.wants_cached(&main) {
                // One that is complete may be wanted again with the next key.
                if !(cached.is_complete() && self.may_want_cached(&main)) {
                    cached.end(|session| self.kept.keep_training(session, &self.request));
                }
            } else if cached.is_absent() && !is_rich && self.is_time_for_cached(&main) {
                let view = View { gi: Gi::Cached, ..view.clone() };
                let session = self.experienced_session(world, environment, view);
                cached = CachedPicture::UnderWay(Box::new(session), None);
            }
            if !self.request.split {
                plain = None;
                self.readings[PLAIN] = None;
                self.curves[PLAIN].clear();
            } else if plain.is_none() {
                let view = View { sampling: Sampling::Plain, ..view.clone() };
                plain = Some(Session::new(world, environment, view));
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
                    // With an error, if something to measure it by has come.
                    self.note(MAIN, &main);
                    if let Some(plain) = &plain {
                        self.note(PLAIN, plain);
                    }
                    self.publish(activity, &main, plain.as_ref(), &mut cached);
                    // A GPU may be ready now, or asked for. What is compared stays comparable.
                    let was_on_gpu = main.is_on_gpu();
                    if self.request.split {
                        self.kept.device.note_compiled();
                    } else {
                        self.place(&mut main);
                    }
                    if main.is_on_gpu() == was_on_gpu {
                        self.rest();
                    }
                    continue;
                }
                // A picture first, and one that goes on.
                Activity::Learning(_)
                    if self.beginning(&main).is_some()
                        && (!main.is_begun() || went_on.elapsed() >= STANDSTILL) =>
                {
                    self.advance(&mut main, None, true);
                    self.measure(&main);
                    went_on = Instant::now();
                }
                Activity::Learning(_) => self.learn(&mut main),
                Activity::Rendering | Activity::Moving => {
                    self.take_turn(&mut main, plain.as_mut(), &mut cached, &mut turns);
                }
            }
            cached.complete(|session| self.kept.keep_training(session, &self.request));
            let due = self.published.elapsed() >= self.publish_gap;
            let is_reading_due = due && self.is_reading_due(&main);
            if due && self.request.previews && !self.is_superseded() {
                let sessions = [Some(&main), plain.as_ref(), cached.session()];
                let progress = sessions.into_iter().flatten().map(progress).sum();
                if self.last != Some((activity, progress)) {
                    self.publish(activity, &main, plain.as_ref(), &mut cached);
                    self.last = Some((activity, progress));
                }
            }
            // After publishing, which has read the film.
            if is_reading_due || !self.request.previews {
                self.note(MAIN, &main);
                plain.iter().for_each(|plain| self.note(PLAIN, plain));
            }
        }
        if self.request.previews {
            self.leave(main, cached);
        } else {
            cached.end(|session| self.kept.keep_training(session, &self.request));
        }
    }

    /// Puts the picture aside for another one.
    fn leave(&mut self, main: Session<'_>, mut cached: CachedPicture<'_>) {
        if let Some(session) = cached.session_mut().filter(|_| self.is_left_for_same_light()) {
            self.kept.keep_training(session, &self.request);
        }
        // What is seen of it is better than the film alone.
        let times = worth(main.samples());
        let shown = cached.film_so_far().filter(|_| times >= 1.0 && main.samples() > 0);
        let shown = shown.map(|cached| cached.together(main.film(), times));
        let mut left = SuspendedPicture {
            request: Arc::clone(&self.request),
            session: main.suspend(),
            cached: cached.suspend(),
            counters: self.counters.take(),
            curve: std::mem::take(&mut self.curves[MAIN]),
            cached_seconds: self.cached_seconds,
        };
        let is_worth_it = left.is_worth_it();
        match shown {
            Some(shown) => self.keep_backdrop(Cow::Owned(shown), times),
            None if !is_worth_it => {
                return self.keep_backdrop(Cow::Owned(left.session.into_film()), 1.0);
            }
            None => {
                if let Some(film) = left.session.film() {
                    self.keep_backdrop(Cow::Borrowed(film), 1.0);
                }
            }
        }
        if is_worth_it {
            self.kept.leave(left);
        }
    }

    /// Some samples of the picture that is next: the plain one at equal time, learning included, the cached
    /// one so many `turns` in a row, or the main one.
    fn take_turn(
        &mut self,
        main: &mut Session<'_>,
        plain: Option<&mut Session<'_>>,
        cached: &mut CachedPicture<'_>,
        turns: &mut u32,
    ) {
        let plain = match plain {
            // What they take is compared on the same device.
            Some(plain) => {
                if self.place(main) == Placed::TooLate || self.place(plain) == Placed::TooLate {
                    return;
                }
                (!self.is_level(plain, main)).then_some(plain)
            }
            None => None,
        };
        if let Some(plain) = plain {
            self.advance_in_place(plain, None, true);
        } else if let Some(cached) = cached.next(main, *turns) {
            let start = Instant::now();
            // Where it is shown no GPU is quicker, and one that is being made ready will show none.
            self.advance_in_place(cached, None, self.request.previews);
            self.cached_seconds += start.elapsed().as_secs_f64();
            *turns += 1;
        } else {
            *turns = 0;
            let distribution_paths = main.figures().distribution_paths;
            self.advance(main, Some(self.rule()), self.request.previews);
            self.measure(main);
            if main.figures().distribution_paths > distribution_paths {
                self.keep_distributions(main, true);
            }
        }
    }

    /// Whether light from a radiance cache is to be shown beside what there is: not where a real GPU has
    /// many samples in a moment, nor where pictures are compared.
    fn wants_cached(&self, main: &Session<'_>) -> bool {
        self.request.wants_cached && self.may_want_cached(main)
    }

    /// Whether it would be, if it was asked for.
    fn may_want_cached(&self, main: &Session<'_>) -> bool {
        !self.request.split
            && !self.kept.device.is_quick(&self.request)
            && worth(main.samples()) > 0.0
    }

    /// Where the cache is to be trained first, every pixel has its first exact sample before.
    fn is_time_for_cached(&self, main: &Session<'_>) -> bool {
        main.phase() == Phase::Rendering
            && (main.samples() > 0 || self.kept.has_training_for(&self.request))
    }

    /// When the main picture is done: what the cached one took counts.
    fn rule(&self) -> StopRule {
        let StopRule { seconds, .. } = self.request.rule;
        let seconds = seconds.map(|seconds| seconds - self.cached_seconds);
        StopRule { seconds, ..self.request.rule }
    }

    /// What is to be done next; `None` when something else is asked for.
    fn next_activity(
        &mut self,
        main: &Session<'_>,
        plain: Option<&Session<'_>>,
    ) -> Option<Activity> {
        {
            let slot = self.shared.orders.slot();
            if slot.is_closed {
                return None;
            }
            if let Some(new) = &slot.value {
                if self.request.restarts(new) {
                    return None;
                }
                self.request = Arc::clone(new);
            }
            self.shared.cancel.store(false, Ordering::Relaxed);
        }
        // Begun later, it has the same time to come.
        let is_compared =
            !self.request.split || plain.is_some_and(|plain| self.is_level(plain, main));
        Some(if self.request.paused {
            Activity::Paused
        } else if main.phase() == Phase::Learning {
            Activity::Learning(learned_share(main))
        } else if main.samples() > 0 && main.is_done(&self.rule()) && is_compared {
            Activity::Done
        } else {
            Activity::Rendering
        })
    }

    /// One learning pass.
    fn learn(&mut self, main: &mut Session<'_>) {
        if self.place(main) == Placed::TooLate {
            return;
        }
        let learned = main.advance(1, &self.shared.cancel);
        self.go_on(main, learned);
        let is_done = main.phase() == Phase::Rendering;
        // A little learned is better than nothing, but what was learned to the end is better still.
        if is_done || (main.figures().learned_cells > 0 && !self.kept.has_learned_in(&self.request))
        {
            self.keep_distributions(main, is_done);
        }
    }

    /// Keeps what was learned, for inspection and for the next request.
    fn keep_distributions(&mut self, main: &Session<'_>, is_complete: bool) {
        if is_complete {
            self.counters = main.counters().map(|counters| Arc::new(counters.snapshot()));
            let request = || Arc::clone(&self.request);
            self.kept.counted = self.counters.clone().map(|counted| (counted, request()));
        }
        if let Some(grid) = self.distributions_of(main) {
            let (environment, world) = (&self.request.environment, &self.request.world);
            let (environment, world) = (Arc::clone(environment), Arc::clone(world));
            self.kept.learned = Some(Learned { grid, environment, world, is_complete });
        }
    }

    /// Whether the plain picture of a split view has had the time of the main one, learning included. What that is
    /// must be known of both: whichever has moved to another device has the next turn.
    fn is_level(&self, plain: &Session<'_>, main: &Session<'_>) -> bool {
        match (plain.comparable_seconds(), main.comparable_seconds()) {
            (None, _) => false,
            (Some(plain), Some(main)) => plain >= main,
            (Some(_), None) => !main.is_done(&self.rule()) || plain.samples() >= main.samples(),
        }
    }

    fn is_superseded(&self) -> bool {
        self.is_left_for(Request::restarts)
    }

    /// Whether something else is asked for than the next moment of a movement.
    fn is_elsewhere(&self) -> bool {
        self.is_left_for(Request::is_ended_by)
    }

    fn is_left_for(&self, is_other: impl Fn(&Request, &Request) -> bool) -> bool {
        let slot = self.shared.orders.slot();
        slot.is_closed || slot.value.as_ref().is_some_and(|new| is_other(&self.request, new))
    }

    /// Whether the next picture can go on with the radiance cache of this one.
    fn is_left_for_same_light(&self) -> bool {
        let next = &self.shared.orders.slot().value;
        let is_lit_alike = |next: &Arc<Request>| {
            Arc::ptr_eq(&next.world, &self.request.world) && self.request.is_lit_like(next)
        };
        next.as_ref().is_some_and(is_lit_alike)
    }

    /// Waits until something else is asked for, or kernels are there that were not.
    fn rest(&self) -> Rested {
        let device = &self.kept.device;
        self.shared.orders.wait(|slot| {
            let is_other = slot.value.as_ref().is_none_or(|new| !self.request.is_same(new));
            if slot.is_closed || is_other {
                ControlFlow::Break(Rested::ForRequest)
            } else if device.was_compiling() && !device.is_compiling() {
                ControlFlow::Break(Rested::ForKernels)
            } else {
                ControlFlow::Continue(None)
            }
        })
    }
}

/// What a job has waited for.
#[derive(PartialEq, Eq)]
enum Rested {
    /// Something else is asked for.
    ForRequest,
    /// Kernels that sessions can be placed with.
    ForKernels,
}

fn learned_share(session: &Session<'_>) -> f32 {
    let (done, all) = (session.figures().learning_paths, session.view().learning_paths);
    done as f32 / all.max(1) as f32
}

/// Grows with whatever a session does.
fn progress(session: &Session<'_>) -> u64 {
    let figures = session.figures();
    // A radiance cache is trained out of sight, but that learning is over is to be seen.
    figures.learning_paths + figures.samples + u64::from(figures.training_paths > 0)
}
