//! Sessions of a job: with what is known, where they run, and how far they go at a time.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use super::cached::CachedPicture;
use super::{Job, MAIN};
use crate::app::lock;
use crate::environment::Environment;
use crate::error::Result;
use crate::path::World;
use crate::render::{Gi, Phase, Session, StopRule, View};

/// Longest piece of rendering between two looks at requests and clocks.
pub(super) const SLICE: Duration = Duration::from_millis(120);
/// A moving camera's picture should take about this long.
const MOVING_SECONDS: f64 = 0.07;
/// What a camera path takes, until it has been measured.
const LIKELY_SECONDS_PER_PATH: f64 = 1e-5;

impl Job<'_> {
    /// A session for a picture so small that a pass takes a moment, with what was learned before.
    pub(super) fn small_session<'b>(
        &mut self,
        world: &'b World,
        environment: &'b Environment,
    ) -> Session<'b> {
        let request = Arc::clone(&self.request);
        let shrink = self.shrink(&request.view);
        let mut view =
            request.view.of_size(request.view.width / shrink, request.view.height / shrink);
        // Learning would take longer than the picture.
        if self.request.wants_cached && self.kept.has_training_for(&self.request) {
            view.gi = Gi::Cached;
        }
        self.experienced_session(world, environment, view)
    }

    /// The session of this very picture that was left for another one, if it was not long ago, and the cached
    /// picture beside it.
    pub(super) fn picture_of_before<'b>(
        &mut self,
        world: &'b World,
        environment: &'b Environment,
    ) -> (Option<Session<'b>>, CachedPicture<'b>) {
        let Some(left) = self.kept.come_back(&self.request) else {
            return (None, CachedPicture::default());
        };
        (self.counters, self.cached_seconds) = (left.counters, left.cached_seconds);
        self.curves[MAIN] = left.curve;
        (Some(Session::resume(world, environment, left.session)), left.cached.into())
    }

    /// A session that learns, from what is known of the scene if the camera has not gone far.
    pub(super) fn learning_session<'b>(
        &mut self,
        world: &'b World,
        environment: &'b Environment,
        view: View,
    ) -> Session<'b> {
        let mut session = Session::new(world, environment, view);
        if let Some(counted) = self.kept.counted_for(&self.request) {
            match session.continue_learning(&counted) {
                Ok(true) => self.counters = Some(counted),
                Ok(false) => {}
                Err(error) => self.go_on(&mut session, Err(error)),
            }
        }
        session
    }

    /// A session that does not learn but uses what was learned before.
    pub(super) fn experienced_session<'b>(
        &mut self,
        world: &'b World,
        environment: &'b Environment,
        view: View,
    ) -> Session<'b> {
        let mut session = Session::new(world, environment, view);
        session.finish_learning();
        let is_learning_mode = session.view().distribution_options().is_some();
        if let Some(distributions) =
            self.kept.distributions_for(&self.request).filter(|_| is_learning_mode)
        {
            let given = session.set_grid((*distributions).clone());
            self.go_on(&mut session, given);
        }
        if session.view().gi == Gi::Cached
            && self.kept.has_training_for(&self.request)
            && let Some((training, _)) = self.kept.training.take()
        {
            let given = session.set_training(training);
            self.go_on(&mut session, given);
        }
        session
    }

    /// By what a moving picture's sides are divided: as for the last one, unless that took far too long or
    /// could have been much larger, for sizes that come and go are seen.
    fn shrink(&mut self, view: &View) -> u32 {
        let pixels = f64::from(view.width) * f64::from(view.height);
        let seconds_per_path = self.kept.seconds_per_path.unwrap_or(LIKELY_SECONDS_PER_PATH);
        let shrink = (pixels * seconds_per_path / MOVING_SECONDS).sqrt();
        let is_right = |last: &u32| (0.6..=1.8).contains(&(f64::from(*last) / shrink));
        let last = self.kept.shrink.filter(is_right);
        *self.kept.shrink.insert(last.unwrap_or((shrink.ceil() as u32).clamp(1, 16)))
    }

    /// One pass, cut short after a slice if asked for.
    pub(super) fn advance(&mut self, session: &mut Session<'_>, rule: Option<StopRule>, cut: bool) {
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
    pub(super) fn beginning(&self, session: &Session<'_>) -> Option<u32> {
        let begins = self.request.previews && !self.request.moving;
        if begins { session.next_beginning() } else { None }
    }

    /// Lets the session run on the device that is asked for now.
    pub(super) fn place(&mut self, session: &mut Session<'_>) {
        // A GPU that is not ready, or is none, comes when there is something to be seen.
        let is_fresh = session.samples() == 0 && !session.is_on_gpu();
        let is_learning = session.phase() == Phase::Learning;
        let begins =
            self.request.moving || is_fresh && (is_learning || self.beginning(session).is_some());
        if begins && self.request.previews && !self.kept.device.is_quick(&self.request) {
            session.continue_on_cpu();
            return;
        }
        self.kept.device.choose_for(&self.request);
        if self.kept.device.needs_preparation(&self.request) {
            self.shared.is_preparing.store(true, Ordering::Relaxed);
            (self.shared.wake)();
            // The other device's speed says nothing.
            self.kept.seconds_per_path = None;
        }
        self.kept.device.place(session, &self.request);
        self.shared.is_preparing.store(false, Ordering::Relaxed);
        self.tell_failure();
    }

    /// Goes on where it can if a GPU has failed.
    pub(super) fn go_on(&mut self, session: &mut Session<'_>, outcome: Result<()>) {
        if let Err(failure) = outcome {
            session.continue_on_cpu();
            self.kept.device.give_up(&failure, &self.request);
            self.tell_failure();
        }
    }

    fn tell_failure(&mut self) {
        if let Some(sentence) = self.kept.device.take_failure() {
            lock(&self.shared.failures).push(sentence);
            (self.shared.wake)();
        }
    }

    pub(super) fn measure(&mut self, session: &Session<'_>) {
        let figures = session.figures();
        if figures.samples > 1000 {
            self.kept.seconds_per_path = Some(figures.render_seconds / figures.samples as f64);
        }
    }
}
