//! What drives a session: how long its next pass is, what a picture begins with, and when it ends.

use std::borrow::Cow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::film::Film;
use super::{Doubling, Figures, Phase, Session, StopRule};
use crate::error::Result;

/// A first sample that pixels share is begun where the time left is this many times what one sample of each pixel
/// alone would take, as far as the first of those tell: it takes 1.3 to 1.7 times as long, and half a one is
/// worth little.
const RESERVE: f64 = 2.0;

/// What a picture begins with on the CPU. A GPU always begins with a sample of every pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Beginning {
    /// A sample of every pixel.
    #[default]
    Whole,
    /// A sample of some pixels all over the picture, then of others between them, even while it still learns.
    Coarse,
    /// As `Coarse` once learning is over. Where the seconds of the rule seem too short for a sample of every
    /// pixel, pixels share nothing with their neighbours.
    InTime,
}

/// A session and what decides its passes.
pub struct Driver<'a> {
    /// The session; it may be moved to another device between two passes.
    pub session: Session<'a>,
    /// When to stop. Samples are counted from the picture's first.
    pub rule: StopRule,
    /// What the picture begins with.
    pub beginning: Beginning,
    /// Whether passes that are learned from are taken whole, unless seconds end the work: half a pass teaches
    /// something else than the half and the rest later on.
    is_resumable: bool,
    /// Samples a pixel that the pass under way is to reach.
    target: u32,
    /// When the seconds of the rule are over.
    deadline: Option<Instant>,
    /// First samples of each pixel that others take.
    skipped: u32,
    /// The film to go on from, once the session has learned what belongs to it.
    awaited: Option<Awaited>,
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
            beginning: Beginning::Whole,
            is_resumable: false,
            target: 0,
            deadline: None,
            skipped: 0,
            awaited: None,
            is_alone: false,
        }
    }

    /// Leaves the first `skipped` samples of each pixel to others, goes on from a film if there is one, whose pass
    /// under way was to reach `target` samples, and takes care that another process can go on from its own.
    pub(crate) fn resumable(
        self,
        skipped: u32,
        awaited: Option<Awaited>,
        target: u32,
        is_resumable: bool,
    ) -> Self {
        Self { skipped, awaited, target, is_resumable, ..self }
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

    /// Works until the rule says stop or, once the picture has a sample, `cancel` becomes true.
    ///
    /// # Errors
    /// As [`Session::advance`].
    pub fn run(&mut self, cancel: &AtomicBool) -> Result<()> {
        while !self.step(cancel)? {}
        Ok(())
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
        if self.has_samples() && (is_stopped || self.is_done()) {
            self.session.settle()?;
            return Ok(true);
        }
        let is_counting =
            self.session.phase() == Phase::Rendering && !self.session.has_final_distributions();
        let is_whole = self.is_resumable && self.deadline.is_none() && is_counting;
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
        match self.next_beginning() {
            Some(every) => {
                self.session.begin(every, cancel);
                Ok(())
            }
            None => {
                let samples = self.next_pass();
                self.session.advance(samples, cancel)
            }
        }
    }

    /// Whether the rule says stop.
    pub fn is_done(&self) -> bool {
        // A pass that was cut short says nothing of when noise is looked at.
        let noise = self.rule.noise.filter(|_| self.session.samples() >= self.target);
        self.session.is_done(&StopRule { noise, ..self.rule })
    }

    /// Whether there is a picture of this session's own samples.
    pub(crate) fn has_samples(&self) -> bool {
        let is_hasty = self.beginning == Beginning::InTime;
        self.awaited.is_none()
            && (self.session.samples() > self.skipped || is_hasty && self.session.is_begun())
    }

    /// The session's own samples.
    pub(crate) fn film(&self) -> Cow<'_, Film> {
        match self.skipped {
            0 => Cow::Borrowed(self.session.film()),
            skipped => Cow::Owned(self.session.film().without_skipped(skipped)),
        }
    }

    /// Samples a pixel that the pass under way is to reach.
    pub(crate) fn target(&self) -> u32 {
        self.target
    }

    /// Whether there is a film to go on from, for which the session still learns.
    pub(crate) fn is_awaiting(&self) -> bool {
        self.awaited.is_some()
    }

    /// When the seconds of the rule are over; the same time at each call.
    pub(crate) fn deadline(&mut self) -> Option<Instant> {
        if self.deadline.is_none()
            && let Some(seconds) = self.rule.seconds
        {
            let left = (seconds - self.session.elapsed_seconds()).max(0.0);
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
        let Some(Awaited { film, figures, noted, .. }) = self
            .awaited
            .take_if(|awaited| is_ready(awaited, &self.session, &self.rule, self.skipped))
        else {
            return Ok(());
        };
        self.session.add_figures(&figures.unwrap_or_default());
        self.session.set_noted(noted);
        self.session.continue_from(film, self.skipped)
    }

    /// How far apart the pixels are that the picture is to be begun with now, if it is.
    pub fn next_beginning(&mut self) -> Option<u32> {
        let session = &self.session;
        let is_over = match self.beginning {
            Beginning::Whole => true,
            Beginning::Coarse => return session.next_beginning(),
            Beginning::InTime => session.phase() == Phase::Learning,
        };
        if is_over {
            return None;
        }
        let next = session.next_beginning();
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
        let left = self.rule.seconds.unwrap_or(f64::INFINITY) - self.session.elapsed_seconds();
        figures.samples > 0 && RESERVE * seconds < left
    }

    /// Learning ends where it ended for the film that is awaited, or has had its share of the seconds.
    fn has_learned_enough(&self) -> bool {
        match self.awaited.as_ref().and_then(|awaited| awaited.figures) {
            Some(before) => self.session.figures().learning_paths >= before.learning_paths,
            None => self.session.has_learned_enough(&self.rule),
        }
    }

    /// Samples a pixel that the next pass should take. One that was cut short keeps its target, so that
    /// noise is looked at after the same samples whatever the clock says.
    fn next_pass(&mut self) -> u32 {
        let samples = self.session.samples();
        if let Some(awaited) = &self.awaited {
            let missing = (self.skipped + awaited.film.min_samples()).saturating_sub(samples);
            return self.session.next_pass(&StopRule::default()).min(missing).max(1);
        }
        if self.target <= samples {
            self.target = samples + self.session.next_pass(&self.rule);
        }
        self.target.min(self.rule.samples.unwrap_or(u32::MAX)).saturating_sub(samples).max(1)
    }
}

/// Whether the session has learned what belongs to the film that awaits it.
fn is_ready(awaited: &Awaited, session: &Session<'_>, rule: &StopRule, skipped: u32) -> bool {
    let samples = skipped + awaited.film.min_samples();
    let is_done = rule.samples.is_some_and(|limit| samples >= limit);
    (is_done && !awaited.learns_anyway)
        || session.has_final_distributions()
        || (session.phase() == Phase::Rendering && session.samples() >= samples)
}
