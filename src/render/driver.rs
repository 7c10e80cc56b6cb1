//! What drives a session: how long its next pass is, what a picture begins with, and when it ends.

use std::borrow::Cow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::film::{BEGINNINGS, Film};
use super::session::MIN_SAMPLES_FOR_NOISE;
use super::{Doubling, Figures, Phase, Session, StopRule};
use crate::error::Result;

/// A first sample that pixels share is begun where the time left is this many times what one sample of each pixel
/// alone would take, as far as the first of those tell: it takes 1.3 to 1.7 times as long, and half a one is
/// worth little.
const RESERVE: f64 = 2.0;

/// Seconds a pass on a GPU should take: what is told to the user between two is this old at most.
const GPU_PASS_SECONDS: f64 = 0.1;
/// Learning takes at most this share of the seconds asked for.
const LEARNING_TIME_SHARE: f64 = 0.05;

impl StopRule {
    /// Whether it says to stop. Noise is only asked for from 16 samples on.
    pub fn is_met(&self, session: &Session<'_>) -> bool {
        let samples = session.samples();
        let is_long = |limit| session.figures().elapsed_seconds() >= limit;
        self.samples.is_some_and(|limit| samples >= limit)
            || (samples > 0 && self.seconds.is_some_and(is_long))
            || (samples >= MIN_SAMPLES_FOR_NOISE
                && self.noise.is_some_and(|limit| session.noise() <= limit))
    }

    /// Samples per pixel that the next pass should take: growing with what is there, so that few
    /// passes are needed and none is much longer than those before it. Where noise is asked for, or
    /// something is learned of what is rendered, it depends on counts alone, so that the picture is
    /// repeatable; else a GPU takes as many as it can in a moment.
    pub fn next_pass(&self, session: &Session<'_>) -> u32 {
        let samples = session.samples();
        let pass = match session.is_on_gpu() {
            // Each look at the noise reads the film.
            true if self.noise.is_some() => (samples / 8).clamp(1, 64),
            true if !session.is_counting() => {
                let pixels = session.view().pixels() as f64;
                let affordable = |each: f64| (GPU_PASS_SECONDS / (each * pixels).max(1e-9)) as u32;
                let affordable = session.seconds_per_sample().map_or(1, affordable);
                affordable.max(samples / 16).min(samples).clamp(1, 64)
            }
            _ => (samples / 16).clamp(1, 64),
        };
        // Where samples are a power of two the radiance cache and the distributions learn, and it is found out
        // how good the picture is.
        let pass = pass.min((samples + 1).next_power_of_two() - samples);
        self.samples.map_or(pass, |limit| pass.min(limit.saturating_sub(samples)).max(1))
    }
}

/// A session and what decides its passes.
pub struct Driver<'a> {
    /// The session; it may be moved to another device between two passes.
    pub session: Session<'a>,
    /// When to stop. Samples are counted from the picture's first.
    pub rule: StopRule,
    /// Whether the seconds of the rule may be over before every pixel has a sample: a picture is then begun with a
    /// sample of some pixels all over it, and where time seems too short, pixels share nothing with their neighbours.
    pub is_hasty: bool,
    /// Whether passes that are learned from are taken whole, unless seconds end the work: half a pass teaches
    /// something else than the half and the rest later on.
    pub(crate) is_resumable: bool,
    /// Samples a pixel that the pass under way is to reach.
    pub(crate) target: u32,
    /// First samples of each pixel that others take.
    pub(crate) skipped: u32,
    /// The film to go on from, once the session has learned what belongs to it.
    pub(crate) awaited: Option<Awaited>,
    /// When the seconds of the rule are over.
    deadline: Option<Instant>,
    /// Whether the samples so far are pixels' own, for want of time.
    is_alone: bool,
}

/// A film to go on from.
pub(crate) struct Awaited {
    pub(crate) film: Film,
    /// What was done for it by an earlier process.
    pub(crate) figures: Option<Figures>,
    /// What its noise is found by.
    pub(crate) noted: Doubling,
    /// Whether to learn what belongs to it even where it has all its samples.
    pub(crate) learns_anyway: bool,
}

impl<'a> Driver<'a> {
    /// Drives a session until the rule says stop.
    pub fn new(session: Session<'a>, rule: StopRule) -> Self {
        Self {
            session,
            rule,
            is_hasty: false,
            is_resumable: false,
            target: 0,
            deadline: None,
            skipped: 0,
            awaited: None,
            is_alone: false,
        }
    }

    /// Learns until there is nothing to learn before rendering, or learning has had its share of the rule's
    /// seconds; `false` if it was cancelled.
    ///
    /// # Errors
    /// As [`Session::advance`].
    pub fn learn(&mut self, cancel: &AtomicBool) -> Result<bool> {
        while self.session.phase() == Phase::Learning {
            if self.has_learned_enough() {
                self.session.finish_learning();
                break;
            }
            self.session.advance(0, cancel)?;
            if cancel.load(Ordering::Relaxed) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Does one piece of work unless the rule says stop; whether the picture is done, with film and figures as they
    /// are now. When `cancel` is true before the call, the picture is done as soon as it has a sample.
    ///
    /// # Errors
    /// As [`Session::advance`].
    pub fn step(&mut self, cancel: &AtomicBool) -> Result<bool> {
        self.take_up()?;
        let is_stopped = cancel.load(Ordering::Relaxed);
        if is_stopped || self.has_learned_enough() {
            self.session.finish_learning();
        }
        // A pass that was cut short says nothing of when noise is looked at.
        let noise = self.rule.noise.filter(|_| self.session.samples() >= self.target);
        let is_met = || StopRule { noise, ..self.rule }.is_met(&self.session);
        if self.has_samples() && (is_stopped || is_met()) {
            self.session.settle()?;
            return Ok(true);
        }
        let is_whole = self.is_resumable && self.deadline.is_none() && self.session.is_counting();
        let never = AtomicBool::new(false);
        self.advance(if is_stopped || is_whole { &never } else { cancel }).map(|()| false)
    }

    /// Does one piece of work, whatever the rule says of the end. Returns early, with what is done so far kept,
    /// when `cancel` becomes true.
    ///
    /// # Errors
    /// As [`Session::advance`].
    pub fn advance(&mut self, cancel: &AtomicBool) -> Result<()> {
        if self.has_learned_enough() {
            self.session.finish_learning();
        }
        if let Some(every) = self.next_beginning() {
            self.session.begin(every, cancel);
            return Ok(());
        }
        let samples = self.next_pass();
        self.session.advance(samples, cancel)
    }

    /// Whether there is a picture of this session's own samples.
    pub(crate) fn has_samples(&self) -> bool {
        self.awaited.is_none()
            && (self.session.samples() > self.skipped || self.is_hasty && self.session.is_begun())
    }

    /// The session's own samples.
    pub(crate) fn film(&self) -> Cow<'_, Film> {
        match self.skipped {
            0 => Cow::Borrowed(self.session.film()),
            skipped => Cow::Owned(self.session.film().without_skipped(skipped)),
        }
    }

    /// When the seconds of the rule are over; the same time at each call.
    pub(crate) fn deadline(&mut self) -> Option<Instant> {
        if self.deadline.is_none()
            && let Some(seconds) = self.rule.seconds
        {
            let left = (seconds - self.session.figures().elapsed_seconds()).max(0.0);
            let left = Duration::try_from_secs_f64(left).ok();
            self.deadline = left.and_then(|left| Instant::now().checked_add(left));
        }
        self.deadline
    }

    /// Goes on from the film that was awaited, if the session has learned what belongs to it.
    ///
    /// # Errors
    /// If a GPU fails.
    pub(crate) fn take_up(&mut self) -> Result<()> {
        let session = &self.session;
        let is_ready = |awaited: &mut Awaited| {
            let samples = self.skipped + awaited.film.min_samples();
            let is_done = self.rule.samples.is_some_and(|limit| samples >= limit);
            (is_done && !awaited.learns_anyway)
                || session.has_final_distributions()
                || (session.phase() == Phase::Rendering && session.samples() >= samples)
        };
        let Some(awaited) = self.awaited.take_if(is_ready) else { return Ok(()) };
        let Awaited { film, figures, noted, .. } = awaited;
        self.session.continue_from(film, (&figures.unwrap_or_default(), noted), self.skipped)
    }

    /// How far apart the pixels are that the picture is to be begun with now, if it is.
    fn next_beginning(&mut self) -> Option<u32> {
        let session = &self.session;
        if !self.is_hasty || session.phase() == Phase::Learning {
            return None;
        }
        let next = next_beginning(session);
        if session.view().shared_tile().is_none() {
            return next;
        }
        // Some tiles beside pixels of their own would be seen: there are tiles everywhere or nowhere.
        let is_new = session.samples() == 0 || self.is_alone;
        self.is_alone = is_new && !session.is_on_gpu() && !self.has_time_for_all();
        self.is_alone.then(|| next.unwrap_or(1))
    }

    /// Whether a sample of every pixel is likely to be done in time, from what those that it was begun with
    /// have taken.
    fn has_time_for_all(&self) -> bool {
        let (figures, view) = (self.session.figures(), self.session.view());
        let pixels = f64::from(view.width) * f64::from(view.height);
        let seconds = figures.render_seconds / figures.samples as f64 * pixels;
        let left = self.rule.seconds.unwrap_or(f64::INFINITY) - figures.elapsed_seconds();
        figures.samples > 0 && RESERVE * seconds < left
    }

    /// Learning ends where it ended for the film that is awaited, or where another pass, as long as all before it,
    /// would take more than its share of the seconds asked for.
    fn has_learned_enough(&self) -> bool {
        let figures = self.session.figures();
        match self.awaited.as_ref().and_then(|awaited| awaited.figures) {
            Some(before) => figures.learning_paths >= before.learning_paths,
            None => {
                let is_long = |s| 2.0 * figures.learning_seconds >= LEARNING_TIME_SHARE * s;
                self.rule.seconds.is_some_and(is_long)
            }
        }
    }

    /// Samples a pixel that the next pass should take. One that was cut short keeps its target, so that
    /// noise is looked at after the same samples whatever the clock says.
    fn next_pass(&mut self) -> u32 {
        let samples = self.session.samples();
        if let Some(awaited) = &self.awaited {
            let missing = (self.skipped + awaited.film.min_samples()).saturating_sub(samples);
            return StopRule::default().next_pass(&self.session).min(missing).max(1);
        }
        if self.target <= samples {
            self.target = samples + self.rule.next_pass(&self.session);
        }
        self.target.min(self.rule.samples.unwrap_or(u32::MAX)).saturating_sub(samples).max(1)
    }
}

/// How far apart the pixels are that [`Session::begin`] should give their first sample next: nearer and
/// nearer. `None` when enough have one to go on with all, and on a GPU.
pub(crate) fn next_beginning(session: &Session<'_>) -> Option<u32> {
    if session.samples() > 0 || session.is_on_gpu() {
        return None;
    }
    let sides = [session.view().width, session.view().height];
    let pixels = |every| sides.map(|side| u64::from(side.div_ceil(every))).iter().product();
    BEGINNINGS.into_iter().find(|every| session.figures().samples < pixels(*every))
}
