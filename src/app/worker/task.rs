//! One request being worked on.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::inspection::Inspection;
use super::preview::{InPlace, MAIN, MAX_GAP, PLAIN, Preview, gap_after};
use super::request::Request;
use super::session_cache::{Learned, SuspendedPicture, SuspendedSession};
use super::sessions::Sessions;
use super::snapshot::{Activity, SessionSnapshot, Snapshot};
use crate::app::threads::lock;
use crate::light_grid::LearningGrid;
use crate::render::cached_picture::{CachedPicture, suits, view};
use crate::render::{Phase, Sampling, Session, StopRule, View};

/// While there is much to learn the picture goes on a little this often.
const STANDSTILL: Duration = Duration::from_millis(400);

/// Works on one request until something else is asked for.
pub(super) struct PictureTask<'a> {
    sessions: Sessions<'a>,
    preview: Preview,
    inspection: Inspection,
    /// What learning has counted, once it has ended.
    counters: Option<Arc<LearningGrid>>,
    /// Whether a cached picture would help.
    suits_cached: bool,
    /// Seconds spent on the cached picture.
    cached_seconds: f64,
    /// When what was published last, and when there may be something new.
    published: Instant,
    last: Option<(Activity, u64)>,
    publish_gap: Duration,
}

/// The pictures of one request.
struct Pictures<'s> {
    main: Session<'s>,
    /// The plain picture of a split view.
    plain: Option<Session<'s>>,
    cached: Option<CachedPicture<Session<'s>>>,
    /// Turns of the cached one in a row.
    turns: u32,
}

impl<'s> Pictures<'s> {
    fn new(main: Session<'s>, cached: Option<CachedPicture<Session<'s>>>) -> Self {
        Self { main, plain: None, cached, turns: 0 }
    }

    /// Grows with whatever is done for them.
    fn progress(&self) -> u64 {
        let progress = |session: &Session<'_>| {
            let figures = session.figures();
            // A radiance cache is trained out of sight, but that learning is over is to be seen.
            figures.learning_paths + figures.samples + u64::from(figures.training_paths > 0)
        };
        let sessions = [Some(&self.main), self.plain.as_ref(), self.cached_session()];
        sessions.into_iter().flatten().map(progress).sum()
    }

    fn cached_session(&self) -> Option<&Session<'s>> {
        self.cached.as_ref().map(|cached| &cached.session)
    }

    /// Whether the plain picture of a split view has had the time of the main one, learning included. What that is
    /// must be known of both: whichever has moved to another device has the next turn.
    fn are_level(&self, rule: &StopRule) -> bool {
        let (Some(plain), main) = (&self.plain, &self.main) else { return false };
        match (plain.comparable_seconds(), main.comparable_seconds()) {
            (None, _) => false,
            (Some(plain), Some(main)) => plain >= main,
            (Some(_), None) => !rule.is_met(main) || plain.samples() >= main.samples(),
        }
    }
}

impl<'a> PictureTask<'a> {
    pub(super) fn new(sessions: Sessions<'a>) -> Self {
        let request = &sessions.watch.request;
        Self {
            suits_cached: !request.moving && suits(&request.world, &request.view),
            sessions,
            preview: Preview::default(),
            inspection: Inspection::default(),
            counters: None,
            cached_seconds: 0.0,
            published: Instant::now(),
            last: None,
            publish_gap: Duration::ZERO,
        }
    }

    fn request(&self) -> &Arc<Request> {
        &self.sessions.watch.request
    }

    /// Works until something else is asked for; the request that was worked on last.
    pub(super) fn work(mut self) -> Arc<Request> {
        if self.request().moving {
            self.follow();
        } else {
            self.render();
        }
        self.sessions.watch.request
    }

    /// Small pictures for as long as the camera rests at this very place.
    fn follow(&mut self) {
        let was_quick = self.sessions.device.is_quick(self.request());
        let mut session = self.sessions.small_session(was_quick);
        self.sessions.place(&mut session);
        if was_quick && !session.is_on_gpu() {
            // The CPU affords less until there are kernels for it.
            session = self.sessions.small_session(false);
        }
        let mut pictures = Pictures::new(session, None);
        while !self.sessions.watch.is_superseded() {
            // The first pass is never cut short: some picture is better than none.
            let cut = pictures.main.samples() > 0;
            self.sessions.advance(&mut pictures.main, None, cut);
            if pictures.main.samples() == 0 || self.sessions.watch.is_elsewhere() {
                break;
            }
            self.sessions.measure(&pictures.main);
            self.publish(Activity::Moving, &pictures);
            if pictures.main.samples() >= 64 {
                self.sessions.rest();
            }
        }
        self.sessions.keep_training(&mut pictures.main);
    }

    /// The full picture: learning first, then samples until a rule is met.
    fn render(&mut self) {
        let mut pictures = self.begin_pictures();
        // When the picture went on last.
        let mut went_on = Instant::now();
        while let Some(activity) = self.next_activity(&pictures) {
            self.begin_and_end_others(&mut pictures);
            match activity {
                Activity::Paused | Activity::Done => {
                    self.stand_still(activity, &mut pictures);
                    continue;
                }
                // A picture first, and one that goes on.
                Activity::Learning(_)
                    if self.sessions.beginning(&pictures.main).is_some()
                        && (!pictures.main.is_begun() || went_on.elapsed() >= STANDSTILL) =>
                {
                    self.sessions.advance(&mut pictures.main, None, true);
                    self.sessions.measure(&pictures.main);
                    went_on = Instant::now();
                }
                Activity::Learning(_) => self.learn(&mut pictures.main),
                Activity::Rendering | Activity::Moving => self.take_turn(&mut pictures),
            }
            self.publish_if_due(activity, &pictures);
        }
        if self.request().previews {
            self.leave(pictures);
        } else {
            self.end_cached(&mut pictures.cached);
        }
    }

    /// Drops the cached picture, but for what has trained its cache.
    fn end_cached(&mut self, cached: &mut Option<CachedPicture<Session<'a>>>) {
        if let Some(mut cached) = cached.take() {
            self.sessions.keep_training(&mut cached.session);
        }
    }

    /// The picture that was left, if it was this very one and not long ago, or a new one.
    fn begin_pictures(&mut self) -> Pictures<'a> {
        let request = Arc::clone(self.request());
        if let Some(mut left) = self.sessions.kept.come_back(&request)
            && let Some(sessions) = left.sessions.pop()
        {
            (self.counters, self.cached_seconds) = (left.counters, left.cached_seconds);
            self.inspection.curves[MAIN] = left.curve;
            let (main, mut cached) =
                sessions.resume((self.sessions.world, self.sessions.environment));
            cached.iter_mut().for_each(|it| self.sessions.take_up_training(&mut it.session));
            let pictures = Pictures::new(main, cached);
            // Before it goes on.
            self.publish(Activity::Rendering, &pictures);
            return pictures;
        }
        let view = request.view.clone();
        if request.is_frozen && self.sessions.kept.distributions_for(&request).is_some() {
            return Pictures::new(self.sessions.experienced_session(view), None);
        }
        let (main, counted) = self.sessions.learning_session(view);
        self.counters = counted;
        Pictures::new(main, None)
    }

    /// Begins the cached and the plain picture where they are wanted, and ends them where they are not.
    fn begin_and_end_others(&mut self, pictures: &mut Pictures<'a>) {
        let Pictures { main, plain, cached, .. } = pictures;
        let request = Arc::clone(self.request());
        // Where it is not wanted by now it may be with the next key.
        if !self.may_want_cached() {
            self.end_cached(cached);
        } else if request.wants_cached && cached.is_none() && self.is_time_for_cached(main) {
            *cached =
                Some(CachedPicture::new(self.sessions.experienced_session(view(&request.view))));
        }
        if !request.split {
            *plain = None;
            self.preview.copies[PLAIN] = None;
            self.inspection.curves[PLAIN].clear();
        } else if plain.is_none() {
            let view = View { sampling: Sampling::Plain, ..request.view.clone() };
            *plain = Some(self.sessions.new_session(view));
        }
    }

    /// Publishes a picture that is paused or done, and waits until something else is asked for or possible.
    fn stand_still(&mut self, activity: Activity, pictures: &mut Pictures<'_>) {
        if activity == Activity::Done && !self.sessions.settle(&mut pictures.main) {
            return;
        }
        // With an error, if something to measure it by has come.
        self.note(pictures);
        self.publish(activity, pictures);
        // A GPU may be ready now, or asked for. What is compared stays comparable.
        let was_on_gpu = pictures.main.is_on_gpu();
        if self.request().split {
            self.sessions.device.note_compiled();
        } else {
            self.sessions.place(&mut pictures.main);
        }
        if pictures.main.is_on_gpu() == was_on_gpu {
            self.sessions.rest();
        }
    }

    /// Puts the picture aside for another one.
    fn leave(&mut self, pictures: Pictures<'_>) {
        let Pictures { main, mut cached, .. } = pictures;
        if let Some(cached) = &mut cached
            && self.sessions.watch.is_left_for_same_light()
        {
            self.sessions.keep_training(&mut cached.session);
        }
        self.sessions.kept.leave(SuspendedPicture {
            request: Arc::clone(&self.sessions.watch.request),
            sessions: vec![SuspendedSession::of(main, cached)],
            counters: self.counters.take(),
            curve: std::mem::take(&mut self.inspection.curves[MAIN]),
            cached_seconds: self.cached_seconds,
        });
    }

    /// Some samples of the picture that is next: the plain one at equal time, learning included, the cached
    /// one a few turns in a row, or the main one.
    fn take_turn(&mut self, pictures: &mut Pictures<'_>) {
        let rule = self.rule(pictures);
        // What they take is compared on the same device.
        if let Some(plain) = &mut pictures.plain
            && [&mut pictures.main, plain].into_iter().any(|session| !self.sessions.place(session))
        {
            return;
        }
        let is_plain_next = pictures.plain.is_some() && !pictures.are_level(&rule);
        let (wants_cached, cut) = (self.request().wants_cached, self.request().previews);
        let Pictures { main, plain, cached, turns } = pictures;
        let cached = cached.as_mut().filter(|_| wants_cached);
        if let Some(plain) = plain.as_mut().filter(|_| is_plain_next) {
            self.sessions.advance_in_place(plain, None, true);
        } else if let Some(cached) =
            cached.and_then(|cached| cached.next(main, *turns, rule.noise.is_some()))
        {
            let start = Instant::now();
            // Where it is shown no GPU is quicker, and one that is being made ready will show none.
            self.sessions.advance_in_place(cached, None, cut);
            self.cached_seconds += start.elapsed().as_secs_f64();
            *turns += 1;
        } else {
            *turns = 0;
            let distribution_paths = main.figures().distribution_paths;
            self.sessions.advance(main, Some(rule), cut);
            self.sessions.measure(main);
            if main.figures().distribution_paths > distribution_paths {
                self.keep_distributions(main, true);
            }
        }
    }

    /// Whether light from a radiance cache can be shown beside what there is, if it is asked for: not where a real
    /// GPU has many samples in a moment, nor where pictures are compared, and outside only for its own sake.
    fn may_want_cached(&self) -> bool {
        (self.suits_cached || self.request().inspects_cache)
            && !self.request().split
            && !self.sessions.device.is_quick(self.request())
    }

    /// Where the cache is to be trained first, every pixel has its first exact sample before.
    fn is_time_for_cached(&self, main: &Session<'_>) -> bool {
        main.phase() == Phase::Rendering
            && (main.samples() > 0 || self.sessions.kept.has_training_for(self.request()))
    }

    /// When the main picture is done: what the cached one took counts, and so do its samples while it is shown.
    fn rule(&self, pictures: &Pictures<'_>) -> StopRule {
        let rule = self.request().rule;
        let cached = pictures.cached_session().filter(|_| self.request().wants_cached);
        let cached = cached.map_or(0, Session::samples);
        let seconds = rule.seconds.map(|seconds| seconds - self.cached_seconds);
        let samples = rule.samples.map(|samples| samples.saturating_sub(cached));
        StopRule { seconds, samples, ..rule }
    }

    /// What is to be done next; `None` when something else is asked for.
    fn next_activity(&mut self, pictures: &Pictures<'_>) -> Option<Activity> {
        if !self.sessions.watch.takes_up_latest() {
            return None;
        }
        let (request, rule, main) = (self.request(), self.rule(pictures), &pictures.main);
        // Begun later, it has the same time to come.
        let is_compared = !request.split || pictures.are_level(&rule);
        Some(if request.paused {
            Activity::Paused
        } else if main.phase() == Phase::Learning {
            let (done, all) = (main.figures().learning_paths, main.view().learning_paths);
            Activity::Learning(done as f32 / all.max(1) as f32)
        } else if main.samples() > 0 && rule.is_met(main) && is_compared {
            Activity::Done
        } else {
            Activity::Rendering
        })
    }

    /// One learning pass.
    fn learn(&mut self, main: &mut Session<'_>) {
        if !self.sessions.place(main) {
            return;
        }
        self.sessions.learn_in_place(main);
        let is_done = main.phase() == Phase::Rendering;
        // A little learned is better than nothing, but what was learned to the end is better still.
        let has_some = main.figures().learned_cells > 0;
        let before = self.sessions.kept.learned_in(self.request());
        if is_done || has_some && !before.is_some_and(|learned| learned.is_complete) {
            self.keep_distributions(main, is_done);
        }
    }

    /// Keeps what was learned, for inspection and for the next request.
    fn keep_distributions(&mut self, main: &Session<'_>, is_complete: bool) {
        let request = Arc::clone(self.request());
        if is_complete {
            self.counters = main.counters().map(|counters| Arc::new(counters.snapshot()));
            let counted = self.counters.clone();
            self.sessions.kept.counted = counted.map(|counted| (counted, Arc::clone(&request)));
        }
        if let Some(grid) = self.inspection.distributions_of(main) {
            let (environment, world) = (&request.environment, &request.world);
            let (environment, world) = (Arc::clone(environment), Arc::clone(world));
            self.sessions.kept.learned = Some(Learned { grid, environment, world, is_complete });
        }
    }

    /// Brings the curves up to date.
    fn note(&mut self, pictures: &Pictures<'_>) {
        let request = &self.sessions.watch.request;
        self.inspection.note(MAIN, &pictures.main, request);
        if let Some(plain) = &pictures.plain {
            self.inspection.note(PLAIN, plain, request);
        }
    }

    /// Publishes what has changed, if it is time for that.
    fn publish_if_due(&mut self, activity: Activity, pictures: &Pictures<'_>) {
        let is_due = self.published.elapsed() >= self.publish_gap;
        let in_place = self.in_place(&pictures.main);
        // Figures that need the main film are taken anew with it.
        let is_stale = self.preview.is_stale(MAIN, in_place.as_ref(), false);
        let is_reading_due = is_due && pictures.main.samples() > 0 && is_stale;
        let previews = self.request().previews;
        if is_due && previews && !self.sessions.watch.is_superseded() {
            let now = Some((activity, pictures.progress()));
            if self.last != now {
                self.publish(activity, pictures);
                self.last = now;
            }
        }
        // After publishing, which has read the film.
        if is_reading_due || !previews {
            self.note(pictures);
        }
    }

    fn publish(&mut self, activity: Activity, pictures: &Pictures<'_>) {
        let start = Instant::now();
        let (shared, request) = (self.sessions.watch.shared, Arc::clone(self.request()));
        let is_final = matches!(activity, Activity::Paused | Activity::Done);
        let Pictures { main, plain, cached, .. } = pictures;
        self.preview.rests =
            !is_final && (shared.throttle.lasts(MAX_GAP) || self.preview.is_ahead());
        let (main_snapshot, mut reading) = self.session_snapshot(MAIN, main, is_final);
        let plain = plain.as_ref().map(|plain| {
            let (snapshot, cost) = self.session_snapshot(PLAIN, plain, is_final);
            reading += cost;
            snapshot
        });
        let (backdrop, errors) =
            self.preview.backdrop(&request, &main_snapshot.film, cached.as_ref());
        let is_quick = self.sessions.device.is_quick(&request);
        let cut_off = self.sessions.cut_off(main.samples());
        let trained = cached.as_ref().map_or(main, |cached| &cached.session);
        let kept = &mut *self.sessions.kept;
        kept.snapshots += 1;
        shared.publish(Snapshot {
            number: kept.snapshots,
            learning_step: None,
            activity,
            main: main_snapshot,
            now: main.figures(),
            plain,
            counters: self.counters.clone(),
            backdrop,
            errors,
            cached_seconds: self.cached_seconds,
            cut_off,
            cache: self.inspection.cache_facts(trained, &request, kept, is_quick),
            curves: self.inspection.curves.clone(),
            groups: Arc::default(),
            rest: Arc::clone(&shared.throttle),
            request,
        });
        self.published = Instant::now();
        if !self.preview.rests {
            self.publish_gap = gap_after((self.published - start).saturating_sub(reading));
        }
    }

    fn session_snapshot(
        &mut self,
        role: usize,
        session: &Session<'_>,
        is_final: bool,
    ) -> (SessionSnapshot, Duration) {
        let in_place = self.in_place(session);
        let (mut snapshot, cost) = self.preview.session_snapshot(role, session, in_place, is_final);
        snapshot.grid = self.inspection.distributions_of(session);
        (snapshot, cost)
    }

    /// The session's film if the window shows it in every frame without its being read. Small ones are
    /// filtered on the CPU, and software does not draw so often.
    fn in_place(&self, session: &Session<'_>) -> Option<InPlace> {
        let (gpu, film) = session.film_on_device()?;
        let is_small = film.width < self.request().view.width;
        let screen = &self.sessions.watch.shared.screen;
        let is_live = !gpu.facts().is_software() && gpu.is_same(&lock(screen));
        (is_live && !is_small).then_some((gpu, film))
    }
}
