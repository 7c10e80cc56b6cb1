//! Which samples of a picture one process takes: all, a part of them, or those that an earlier process
//! left; and what it keeps lest it be killed.
//!
//! Whoever begins in the middle learns first what the others learned, by the same paths and the same first
//! samples: from then on a sample is a matter of its pixel and its index alone.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::RenderArguments;
use crate::alarm::Alarm;
use crate::cli::device::say;
use crate::cli::interrupt::Interrupt;
use crate::digest::Digest;
use crate::environment::Environment;
use crate::error::{Error, Notices, Result};
use crate::output::film_file::{FilmFacts, Part, read_film, write_film};
use crate::output::record::Record;
use crate::path::{PathLimits, World};
use crate::render::film::Film;
use crate::render::{Doubling, Figures, Gi, Phase, SAMPLES_VERSION, Session, StopRule, View};
use crate::sources;

/// A first sample that pixels share is begun where so many times as long is left as all would take of their
/// own, as far as the first of those tell: it takes 1.3 to 1.7 times as long, and half a one is worth little.
const RESERVE: f64 = 2.0;

/// What one process renders of a picture.
pub(super) struct RenderJob {
    part: Part,
    /// Samples a pixel before those of this part.
    first: u32,
    /// When this part is done; samples are counted from the picture's first.
    rule: StopRule,
    /// Samples of the whole picture.
    samples: Option<u32>,
    /// What the session is to go on from, once it has learned what belongs to it.
    awaited: Option<Awaited>,
    /// Samples a pixel that the pass under way is to reach.
    target: u32,
    deadline: Option<Instant>,
    checkpoint: Option<Checkpoint>,
    /// Whether what was learned is wanted for its own sake.
    wants_distributions: bool,
    /// Whether the samples so far are pixels' own, for want of time.
    is_alone: bool,
    /// See [`FilmFacts::picture`].
    picture: Vec<(String, String)>,
    /// What checkpoints hold as [`FilmFacts::metadata`].
    metadata: Vec<(String, String)>,
}

/// A film to go on from.
struct Awaited {
    film: Film,
    /// What was done for it.
    figures: Option<Figures>,
    noted: Doubling,
}

struct Checkpoint {
    path: PathBuf,
    every: Duration,
    written: Instant,
}

impl RenderJob {
    /// What the arguments ask for, without what a checkpoint says is done.
    ///
    /// # Errors
    /// If there is a checkpoint that is of another picture or cannot be read, or a part has no samples.
    pub(super) fn open(
        arguments: &RenderArguments,
        rule: StopRule,
        (world, environment): (&World, &Environment),
        view: &View,
    ) -> Result<Self> {
        let is_kept = arguments.part.is_some() || arguments.checkpoint.is_some();
        if is_kept && arguments.gi == Gi::Cached {
            return Err(Error::new(
                "--part and --checkpoint keep samples, not the cache that --gi cached ends paths in: \
                 they want --gi exact",
            ));
        }
        let part = arguments.part.unwrap_or(Part::WHOLE);
        let range = part.range(rule.samples.unwrap_or(0));
        if arguments.part.is_some() && range.is_empty() {
            let samples = rule.samples.unwrap_or(0);
            return Err(Error::new(format!(
                "--part {}/{}: {samples} samples a pixel cannot be shared by so many",
                part.number, part.count
            )));
        }
        let mut assignment = Self {
            part,
            first: range.start,
            rule: StopRule { samples: rule.samples.map(|_| range.end), ..rule },
            samples: rule.samples,
            awaited: None,
            target: 0,
            deadline: None,
            checkpoint: None,
            wants_distributions: arguments.distributions.is_some(),
            is_alone: false,
            // It takes a look at all of the scene and the map.
            picture: match is_kept {
                true => identity(arguments, world, environment, view),
                false => Vec::new(),
            },
            metadata: Vec::new(),
        };
        if let Some(path) = &arguments.checkpoint {
            if path.exists() {
                assignment.take_up(path, view)?;
            }
            assignment.checkpoint = Some(Checkpoint {
                path: path.clone(),
                every: Duration::try_from_secs_f64(arguments.checkpoint_every)
                    .unwrap_or(Duration::MAX),
                written: Instant::now(),
            });
        }
        if assignment.awaited.is_none() && assignment.first > 0 {
            let film = Film::new(view.width, view.height, view.layers);
            assignment.awaited = Some(Awaited { film, figures: None, noted: Doubling::default() });
        }
        Ok(assignment)
    }

    /// Goes on from a checkpoint, if it is one of this part.
    fn take_up(&mut self, path: &Path, view: &View) -> Result<()> {
        let (facts, film) = read_film(path)?;
        let advice = "remove it or name another";
        if let Some(difference) = facts.difference(&self.picture) {
            return Err(Error::at(
                path,
                format!(
                    "is the checkpoint of another picture, which differs in {difference}: {advice}"
                ),
            ));
        }
        let is_of_part =
            facts.part == self.part && (self.part == Part::WHOLE || facts.samples == self.samples);
        let is_alike = (film.width, film.height) == (view.width, view.height)
            && film.has_layers() == view.layers;
        if !is_of_part || !is_alike {
            return Err(Error::at(
                path,
                format!("is the checkpoint of {}: {advice}", facts.share()),
            ));
        }
        self.target = facts.target;
        self.awaited = Some(Awaited { film, figures: Some(facts.figures), noted: facts.noted });
        Ok(())
    }

    /// Says what is gone on from.
    pub(super) fn say(&self, notices: &mut Notices) {
        let before = self.awaited.as_ref().filter(|awaited| awaited.figures.is_some());
        if let (Some(Awaited { film, .. }), Some(checkpoint)) = (before, &self.checkpoint) {
            let (path, samples) = (checkpoint.path.display(), film.min_samples());
            let is_more = self.rule.samples.is_some_and(|asked| self.first + samples > asked);
            let more = if is_more { ", which is more than is asked for" } else { "" };
            say(notices, format!("{path}: goes on from {samples} samples a pixel{more}"));
        }
    }

    /// What pictures of its checkpoints are to say about themselves.
    pub(super) fn set_metadata(&mut self, metadata: Vec<(String, String)>) {
        self.metadata = metadata;
    }

    /// When to stop; samples are counted from the picture's first.
    pub(super) fn rule(&self) -> &StopRule {
        &self.rule
    }

    /// Whether there is a picture of this part's own samples.
    pub(super) fn has_samples(&self, session: &Session<'_>) -> bool {
        self.awaited.is_none()
            && (session.samples() > self.first || self.is_hasty() && session.is_begun())
    }

    /// Whether seconds may be over before every pixel has a sample: a picture is then begun with a few of
    /// them. Parts and checkpoints want whole samples.
    fn is_hasty(&self) -> bool {
        self.rule.seconds.is_some() && self.part == Part::WHOLE && self.checkpoint.is_none()
    }

    /// This part's own samples.
    pub(super) fn film<'s>(&self, session: &'s Session<'_>) -> Cow<'s, Film> {
        match self.first {
            0 => Cow::Borrowed(session.film()),
            skipped => Cow::Owned(session.film().without_skipped(skipped)),
        }
    }

    /// Does one piece of work; whether it was the last.
    ///
    /// # Errors
    /// If a GPU fails.
    pub(super) fn step(
        &mut self,
        session: &mut Session<'_>,
        interrupt: &Interrupt,
        alarm: &Alarm,
        notices: &mut Notices,
    ) -> Result<bool> {
        if self.is_ready(session) {
            self.begin(session)?;
        }
        if self.awaited.is_none() {
            self.look_at_clock(session, interrupt, alarm, notices);
        }
        let has_samples = self.has_samples(session);
        if has_samples {
            interrupt.keep();
        }
        let stopped = interrupt.asked().load(Ordering::Relaxed);
        if stopped || self.has_learned_enough(session) {
            session.finish_learning();
        }
        // A pass that the clock has cut short says nothing of when noise is looked at.
        let noise = self.rule.noise.filter(|_| session.samples() >= self.target);
        if has_samples && (stopped || session.is_done(&StopRule { noise, ..self.rule })) {
            session.settle()?;
            return Ok(true);
        }
        let never = AtomicBool::new(false);
        // What is learned of half a pass is not what is learned of it when it is gone on with.
        let is_counting = session.phase() == Phase::Rendering && !session.has_final_distributions();
        let is_whole = self.checkpoint.is_some() && self.deadline.is_none() && is_counting;
        let cancel = if stopped || is_whole { &never } else { &**interrupt.asked() };
        match self.beginning(session) {
            Some(every) => session.begin(every, cancel),
            None => session.advance(self.next_pass(session), cancel)?,
        }
        Ok(false)
    }

    /// How far apart the pixels are that the picture is to be begun with now, if it is.
    fn beginning(&mut self, session: &Session<'_>) -> Option<u32> {
        if !self.is_hasty() || session.phase() != Phase::Rendering {
            return None;
        }
        let next = session.next_beginning();
        if session.view().shared_tile().is_none() {
            return next;
        }
        // Some tiles beside pixels of their own would be seen: there are tiles everywhere or nowhere.
        let is_new = session.samples() == 0 || self.is_alone;
        self.is_alone = is_new && !session.is_on_gpu() && !self.has_time_for_all(session);
        self.is_alone.then(|| next.unwrap_or(1))
    }

    /// Whether a sample of every pixel is likely to be done in time, from what those that it was begun with
    /// have taken.
    fn has_time_for_all(&self, session: &Session<'_>) -> bool {
        let figures = session.figures();
        let pixels = f64::from(session.view().width) * f64::from(session.view().height);
        let seconds = figures.render_seconds / figures.samples as f64 * pixels;
        let left = self.rule.seconds.unwrap_or(f64::INFINITY) - session.elapsed_seconds();
        figures.samples > 0 && RESERVE * seconds < left
    }

    /// Whether the session has learned what belongs to the film that awaits it.
    fn is_ready(&self, session: &Session<'_>) -> bool {
        self.awaited.as_ref().is_some_and(|awaited| {
            let samples = self.first + awaited.film.min_samples();
            let is_done = self.rule.samples.is_some_and(|limit| samples >= limit);
            (is_done && !self.wants_distributions)
                || session.has_final_distributions()
                || (session.phase() == Phase::Rendering && session.samples() >= samples)
        })
    }

    fn begin(&mut self, session: &mut Session<'_>) -> Result<()> {
        let Some(Awaited { film, figures, noted }) = self.awaited.take() else { return Ok(()) };
        session.add_figures(&figures.unwrap_or_default());
        session.set_noted(noted);
        session.continue_from(film, self.first)
    }

    /// Learning ends where it ended for the film that awaits the session.
    fn has_learned_enough(&self, session: &Session<'_>) -> bool {
        let before = self.awaited.as_ref().and_then(|awaited| awaited.figures);
        match before {
            Some(before) => session.figures().learning_paths >= before.learning_paths,
            None => session.has_learned_enough(&self.rule),
        }
    }

    /// Samples a pixel that the next pass should take. One that was cut short keeps its target, so that
    /// noise is looked at after the same samples whatever the clock says.
    fn next_pass(&mut self, session: &Session<'_>) -> u32 {
        let samples = session.samples();
        if let Some(awaited) = &self.awaited {
            let missing = (self.first + awaited.film.min_samples()).saturating_sub(samples);
            return session.next_pass(&StopRule::default()).min(missing).max(1);
        }
        if self.target <= samples {
            self.target = samples + session.next_pass(&self.rule);
        }
        self.target.min(self.rule.samples.unwrap_or(u32::MAX)).saturating_sub(samples).max(1)
    }

    /// Writes the checkpoint if it is time, and has the next pass cut short when it will be so again or
    /// the seconds are over.
    fn look_at_clock(
        &mut self,
        session: &Session<'_>,
        interrupt: &Interrupt,
        alarm: &Alarm,
        notices: &mut Notices,
    ) {
        let after = |seconds: f64| {
            Instant::now().checked_add(Duration::try_from_secs_f64(seconds.max(0.0)).ok()?)
        };
        if self.deadline.is_none() {
            let left = self.rule.seconds.map(|seconds| seconds - session.elapsed_seconds());
            self.deadline = left.and_then(after);
        }
        // Earlier the first samples would be worth nothing without what was counted meanwhile.
        let kept = self.checkpoint.as_ref().filter(|_| session.has_final_distributions());
        let due = kept.and_then(|kept| kept.written.checked_add(kept.every));
        if due.is_some_and(|due| due <= Instant::now()) {
            // A late one would be taken for a person's wish to end.
            alarm.set(None);
            if let Err(failure) = self.keep(session) {
                say(notices, failure.to_string());
            }
            if self.deadline.is_none_or(|deadline| deadline > Instant::now()) {
                interrupt.go_on();
            }
        }
        let kept = self.checkpoint.as_ref().filter(|_| session.has_final_distributions());
        let due = kept.and_then(|kept| kept.written.checked_add(kept.every));
        alarm.set(self.deadline.into_iter().chain(due).min());
    }

    /// Writes the checkpoint, if there is to be one.
    ///
    /// # Errors
    /// If it cannot be written; the one from before is kept.
    pub(super) fn keep(&mut self, session: &Session<'_>) -> Result<()> {
        let noted = session.noted();
        let facts = FilmFacts { noted, ..self.facts(session.figures(), self.metadata.clone()) };
        let Some(checkpoint) = &mut self.checkpoint else { return Ok(()) };
        let written = write_film(&checkpoint.path, &facts, session.film(), self.first);
        checkpoint.written = Instant::now();
        written
    }

    /// Writes this part's own samples for `lightgrid merge`.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub(super) fn write_part(&self, path: &Path, record: &Record<'_>) -> Result<()> {
        let mut figures = *record.figures;
        if !record.with_times {
            figures = Figures {
                learning_seconds: 0.0,
                distribution_seconds: 0.0,
                render_seconds: 0.0,
                ..figures
            };
        }
        write_film(path, &self.facts(figures, record.metadata()), record.film, 0)
    }

    fn facts(&self, figures: Figures, metadata: Vec<(String, String)>) -> FilmFacts {
        FilmFacts {
            picture: self.picture.clone(),
            part: self.part,
            samples: self.samples,
            target: self.target,
            figures,
            metadata,
            noted: Doubling::default(),
        }
    }
}

/// What a picture's samples depend on, by names for sentences.
fn identity(
    arguments: &RenderArguments,
    world: &World,
    environment: &Environment,
    view: &View,
) -> Vec<(String, String)> {
    let (scene, map) = (&arguments.scene, arguments.map());
    let scene = match sources::is_built_in_scene(scene) {
        true => {
            let changes = (arguments.of_scene.options().hide, arguments.of_scene.edits());
            format!("{scene} {}", Digest::new().debug(&changes).built_in_scene(&world.scene))
        }
        false => Digest::new().scene(&world.scene).to_string(),
    };
    let map = match sources::is_built_in_map(map) {
        true => format!("{map} {}", Digest::new().built_in_map(environment.map())),
        false => Digest::new().map(environment.map()).to_string(),
    };
    let PathLimits { bounces, russian_roulette } = view.limits;
    let pairs = [
        ("version", format!("{}, samples {SAMPLES_VERSION}", env!("CARGO_PKG_VERSION"))),
        ("scene", scene),
        ("map", map),
        ("camera", Digest::new().debug(&view.camera).to_string()),
        ("size", format!("{}x{}", view.width, view.height)),
        ("--region", format!("{:?}", view.crop)),
        ("--seed", view.seed.to_string()),
        ("--filter", format!("{:?}", view.filter)),
        ("--sampling", view.sampling.name().to_owned()),
        ("--sharing", format!("{:?}", arguments.sharing())),
        ("--bounces", bounces.to_string()),
        ("--no-russian-roulette", (!russian_roulette).to_string()),
        ("--grid", view.grid_columns.to_string()),
        ("--tiles", format!("{:?}", arguments.tiles)),
        ("--table", arguments.table.to_string()),
        ("--learning-paths", format!("{:?}", arguments.learning_paths)),
        ("--env-rotation", arguments.env_rotation.to_string()),
        ("--env-intensity", arguments.env_intensity.to_string()),
        ("--env-sun", arguments.env_sun.to_string()),
        ("--fog", Digest::new().debug(&view.medium).to_string()),
        ("--background", format!("{:?}", view.background)),
        ("--layers or --denoise", view.layers.to_string()),
        // What no option changes, but versions may.
        ("settings", Digest::new().debug(&(view.points, &view.distributions)).to_string()),
    ];
    pairs.map(|(name, value)| (name.to_owned(), value)).into()
}
