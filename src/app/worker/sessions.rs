//! Sessions for a request: with what is known, on which device, and how far they go at a time.

use std::cell::OnceCell;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::device::Device;
use super::session_cache::SessionCache;
use super::shared::{Preparation, RequestWatch};
use crate::alarm::Alarm;
use crate::environment::Environment;
use crate::error::{Error, Result};
use crate::light_grid::LearningGrid;
use crate::path::World;
use crate::render::gpu::CompileGuard;
use crate::render::{Gi, Phase, Session, StopRule, View, cut_off_notice, next_beginning};

/// Longest piece of rendering between two looks at requests and clocks.
pub(super) const SLICE: Duration = Duration::from_millis(120);
/// A moving camera's picture should take about this long.
const MOVING_SECONDS: f64 = 0.07;
/// What a camera path takes, until it has been measured.
const LIKELY_SECONDS_PER_PATH: f64 = 1e-5;

/// Makes sessions for a request, places them on a device and lets them go on.
pub(super) struct Sessions<'a> {
    pub(super) world: &'a World,
    pub(super) environment: &'a Environment,
    pub(super) watch: RequestWatch<'a>,
    pub(super) device: &'a mut Device,
    pub(super) kept: &'a mut SessionCache,
    pub(super) alarm: &'a Alarm,
    /// A sentence where paths end with much of their light left; asked for once there is a picture.
    pub(super) cut_off: OnceCell<Option<Arc<str>>>,
}

impl<'a> Sessions<'a> {
    /// A session for this view, of which nothing is known.
    pub(super) fn new_session(&self, view: View) -> Session<'a> {
        Session::new(self.world, self.environment, view)
    }

    /// A session for a picture so small that a pass takes a moment on a GPU that [is quick], else on the CPU, with
    /// what was learned before.
    ///
    /// [is quick]: super::device::Device::is_quick
    pub(super) fn small_session(&mut self, is_quick: bool) -> Session<'a> {
        let request = Arc::clone(&self.watch.request);
        let shrink = self.shrink(&request.view, is_quick);
        let mut view =
            request.view.of_size(request.view.width / shrink, request.view.height / shrink);
        // Learning would take longer than the picture. Where cached light is not wanted, there are no kernels for it.
        if request.wants_cached && !is_quick && self.kept.has_training_for(&request) {
            view.gi = Gi::Cached;
        }
        self.experienced_session(view)
    }

    /// A session that learns, and the counters it goes on from: those of this scene, if the camera has not gone far.
    pub(super) fn learning_session(
        &mut self,
        view: View,
    ) -> (Session<'a>, Option<Arc<LearningGrid>>) {
        let mut session = self.new_session(view);
        let counted = self.kept.counted_for(&self.watch.request);
        let counted = counted.filter(|counted| {
            let is_gone_on_from = session.continue_learning(counted);
            self.go_on(&mut session, is_gone_on_from) == Some(true)
        });
        (session, counted)
    }

    /// A session that does not learn but uses what was learned before.
    pub(super) fn experienced_session(&mut self, view: View) -> Session<'a> {
        let mut session = self.new_session(view);
        session.finish_learning();
        let is_learning_mode = session.view().distribution_options().is_some();
        let distributions = self.kept.distributions_for(&self.watch.request);
        if let Some(distributions) = distributions.filter(|_| is_learning_mode) {
            let given = session.set_grid((*distributions).clone());
            self.go_on(&mut session, given);
        }
        if session.view().gi == Gi::Cached {
            self.take_up_training(&mut session);
        }
        session
    }

    /// Gives a session the radiance cache that was trained for others, if it suits.
    pub(super) fn take_up_training(&mut self, session: &mut Session<'_>) {
        if self.kept.has_training_for(&self.watch.request)
            && let Some((training, _)) = self.kept.training.take()
        {
            let given = session.set_training(training);
            self.go_on(session, given);
        }
    }

    /// By what a moving picture's sides are divided: as for the last one, unless that took far too long or
    /// could have been much larger, for sizes that come and go are seen.
    fn shrink(&mut self, view: &View, is_quick: bool) -> u32 {
        let seconds_per_path = self.kept.seconds_per_path[usize::from(is_quick)];
        let seconds_per_path = seconds_per_path.unwrap_or(LIKELY_SECONDS_PER_PATH);
        let shrink = (view.pixels() as f64 * seconds_per_path / MOVING_SECONDS).sqrt();
        let is_right = |last: &u32| (0.6..=1.8).contains(&(f64::from(*last) / shrink));
        let last = self.kept.shrink.filter(is_right);
        *self.kept.shrink.insert(last.unwrap_or((shrink.ceil() as u32).clamp(1, 16)))
    }

    /// One learning pass on the device that the session is on.
    pub(super) fn learn_in_place(&mut self, session: &mut Session<'_>) {
        let learned = session.advance(1, &self.watch.shared.cancel);
        self.go_on(session, learned);
    }

    /// Keeps the radiance cache of a session for the next one.
    pub(super) fn keep_training(&mut self, session: &mut Session<'_>) {
        if let Some(training) = session.take_training() {
            self.kept.training = Some((training, Arc::clone(&self.watch.request)));
        }
    }

    /// Waits until something else is asked for, or kernels are compiled that were not; whether they are.
    pub(super) fn rest(&self) -> bool {
        let Self { watch, device, .. } = self;
        watch.shared.orders.wait(|slot| {
            if slot.is_closed || slot.value.as_ref().is_none_or(|new| !watch.request.is_same(new)) {
                ControlFlow::Break(false)
            } else if device.was_compiling() && !device.is_compiling() {
                ControlFlow::Break(true)
            } else {
                ControlFlow::Continue(None)
            }
        })
    }

    /// One pass on the device that is asked for, cut short after a slice if asked for.
    pub(super) fn advance(&mut self, session: &mut Session<'_>, rule: Option<StopRule>, cut: bool) {
        if self.place(session) {
            self.advance_in_place(session, rule, cut);
        }
    }

    /// One pass on the device that the session is on.
    pub(super) fn advance_in_place(
        &mut self,
        session: &mut Session<'_>,
        rule: Option<StopRule>,
        cut: bool,
    ) {
        self.alarm.set(cut.then(|| Instant::now() + SLICE));
        let advanced = match self.beginning(session) {
            Some(every) => {
                session.begin(every, &self.watch.shared.cancel);
                Ok(())
            }
            None => {
                let samples = rule.unwrap_or_default().next_pass(session);
                session.advance(samples, &self.watch.shared.cancel)
            }
        };
        self.alarm.set(None);
        self.go_on(session, advanced);
        self.watch.go_on();
    }

    /// How far apart the pixels are that the film is to begin with now; `None` once it has begun, and
    /// for moving pictures, which are small.
    pub(super) fn beginning(&self, session: &Session<'_>) -> Option<u32> {
        let begins = self.watch.request.previews && !self.watch.request.moving;
        if begins { next_beginning(session) } else { None }
    }

    /// Lets the session run on the device that is asked for now; whether it does before something else is asked for.
    pub(super) fn place(&mut self, session: &mut Session<'_>) -> bool {
        self.device.note_compiled();
        // A GPU that is not ready, or is none, comes when there is something to be seen. Cached light is shown where
        // none is quicker.
        let is_fresh = session.samples() == 0 && !session.is_on_gpu();
        let is_learning = session.phase() == Phase::Learning;
        let begins = self.watch.request.moving
            || is_fresh && (is_learning || self.beginning(session).is_some());
        let waits = begins && !self.device.is_quick(&self.watch.request);
        if self.watch.request.previews && (waits || session.view().gi == Gi::Cached) {
            session.continue_on_cpu();
            return true;
        }
        self.device.choose_for(&self.watch.request);
        let uploading = self.device.needs_upload(&self.watch.request).then(|| {
            // With another one or another scene it was different.
            self.kept.seconds_per_path[1] = None;
            Preparation::begin(self.watch.shared)
        });
        self.place_if_compiled(session);
        drop(uploading);
        // Pictures that are compared, or are to be repeatable, come from one device.
        let is_patient =
            self.watch.request.split && !self.watch.request.moving || !self.watch.request.previews;
        while is_patient && !session.is_on_gpu() && self.device.was_compiling() {
            if !self.rest() {
                return false;
            }
            self.device.note_compiled();
            self.place_if_compiled(session);
        }
        true
    }

    fn place_if_compiled(&mut self, session: &mut Session<'_>) {
        let shared = self.watch.shared;
        let preparation = || Arc::new(Preparation::begin(shared)) as Arc<CompileGuard>;
        let lit = (&*self.watch.request, self.environment);
        self.device.place(session, lit, preparation);
        self.report_failure();
    }

    /// Waits for what a GPU is still at work on; whether none has failed.
    pub(super) fn settle(&mut self, session: &mut Session<'_>) -> bool {
        let settled = session.settle();
        self.go_on(session, settled).is_some()
    }

    /// Goes on where it can if a GPU has failed, without what it was to give.
    pub(super) fn go_on<T>(&mut self, session: &mut Session<'_>, outcome: Result<T>) -> Option<T> {
        let give_up = |failure: &Error| {
            session.continue_on_cpu();
            self.device.give_up(failure, &self.watch.request);
            self.report_failure();
        };
        outcome.inspect_err(give_up).ok()
    }

    fn report_failure(&mut self) {
        if let Some(sentence) = self.device.failure.take() {
            self.watch.shared.report_failure(sentence);
        }
    }

    /// A notice where paths end with much of their light left; `None` of a picture that moves or has no samples.
    pub(super) fn cut_off(&self, samples: u32) -> Option<Arc<str>> {
        let request = &self.watch.request;
        if request.moving || samples == 0 {
            return None;
        }
        let notice = || cut_off_notice((&request.world, &request.environment), &request.view);
        self.cut_off.get_or_init(|| notice().map(Arc::from)).clone()
    }

    /// Notes how fast the device is that a session is on.
    pub(super) fn measure(&mut self, session: &Session<'_>) {
        if let Some(seconds) = session.seconds_per_sample() {
            self.kept.seconds_per_path[usize::from(session.is_on_gpu())] = Some(seconds);
        }
    }
}
