//! Which samples of a picture one process takes: all, a part of them, or those that an earlier process
//! left; and what it keeps lest it be killed.
//!
//! Whoever begins in the middle learns first what the others learned, by the same paths and the same first
//! samples: from then on a sample is a matter of its pixel and its index alone.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::RenderArguments;
use crate::alarm::Alarm;
use crate::cli::device::say;
use crate::cli::interrupt::Interrupt;
use crate::digest::Digest;
use crate::error::{Error, Notices, Result};
use crate::output::film_file::{FilmFacts, Part, read_film, write_film};
use crate::output::record::Record;
use crate::path::{Lit, PathLimits};
use crate::render::film::Film;
use crate::render::{
    Awaited, Doubling, Driver, Figures, Gi, SAMPLES_VERSION, Session, StopRule, View,
};
use crate::sources;

/// What one process renders of a picture.
pub(super) struct RenderJob {
    /// What its films are of, but for figures: as metadata checkpoints hold what their pictures say about themselves.
    /// The target is the one that the checkpoint had.
    pub(super) facts: FilmFacts,
    /// Samples a pixel before those of this part.
    first: u32,
    /// When this part is done; samples are counted from the picture's first.
    rule: StopRule,
    /// What a session is to go on from.
    awaited: Option<Awaited>,
    checkpoint: Option<Checkpoint>,
    /// Whether what was learned is wanted for its own sake.
    wants_distributions: bool,
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
    pub(super) fn open(arguments: &RenderArguments, lit: Lit<'_>, view: &View) -> Result<Self> {
        let is_kept = arguments.part.is_some() || arguments.checkpoint.is_some();
        if is_kept && arguments.gi == Some(Gi::Cached) {
            return Err(Error::new(
                "--part and --checkpoint keep samples, not the cache that --gi cached ends paths in: \
                 they want --gi exact",
            ));
        }
        let (part, rule) = (arguments.part.unwrap_or(Part::WHOLE), arguments.stop_rule());
        let range = part.range(rule.samples.unwrap_or(0));
        if arguments.part.is_some() && range.is_empty() {
            let samples = rule.samples.unwrap_or(0);
            return Err(Error::new(format!(
                "--part {}/{}: {samples} samples a pixel cannot be shared by so many",
                part.number, part.count
            )));
        }
        let facts = FilmFacts {
            // It takes a look at all of the scene and the map.
            picture: if is_kept { identity(arguments, lit, view) } else { Vec::new() },
            part,
            samples: rule.samples,
            target: 0,
            figures: Figures::default(),
            metadata: Vec::new(),
            noted: Doubling::default(),
        };
        let mut assignment = Self {
            facts,
            first: range.start,
            rule: StopRule { samples: rule.samples.map(|_| range.end), ..rule },
            awaited: None,
            checkpoint: None,
            wants_distributions: arguments.distributions.is_some(),
        };
        if let Some(path) = &arguments.checkpoint {
            if path.exists() {
                assignment.take_up(path, view)?;
            }
            let every = Duration::try_from_secs_f64(arguments.checkpoint_every);
            let (path, every) = (path.clone(), every.unwrap_or(Duration::MAX));
            assignment.checkpoint = Some(Checkpoint { path, every, written: Instant::now() });
        }
        if assignment.awaited.is_none() && assignment.first > 0 {
            let film = Film::new(view.width, view.height, view.layers);
            assignment.awaited = Some(assignment.awaited(film, None, Doubling::default()));
        }
        Ok(assignment)
    }

    /// Goes on from a checkpoint, if it is one of this part.
    fn take_up(&mut self, path: &Path, view: &View) -> Result<()> {
        let (facts, film) = read_film(path)?;
        let advice = "remove it or name another";
        if let Some(difference) = facts.difference(&self.facts.picture) {
            let cause = format!(
                "is the checkpoint of another picture, which differs in {difference}: {advice}"
            );
            return Err(Error::at(path, cause));
        }
        let FilmFacts { part, samples, .. } = self.facts;
        let is_of_part = facts.part == part && (part == Part::WHOLE || facts.samples == samples);
        let is_alike = (film.width, film.height) == (view.width, view.height)
            && film.has_layers() == view.layers;
        if !is_of_part || !is_alike {
            let cause = format!("is the checkpoint of {}: {advice}", facts.share());
            return Err(Error::at(path, cause));
        }
        self.facts.target = facts.target;
        self.awaited = Some(self.awaited(film, Some(facts.figures), facts.noted));
        Ok(())
    }

    fn awaited(&self, film: Film, figures: Option<Figures>, noted: Doubling) -> Awaited {
        Awaited { film, figures, noted, learns_anyway: self.wants_distributions }
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

    /// What drives a session to this part's samples.
    pub(super) fn driver<'a>(&mut self, session: Session<'a>) -> Driver<'a> {
        let is_kept = self.checkpoint.is_some();
        // Parts and checkpoints want whole samples.
        let is_hasty = self.rule.seconds.is_some() && self.facts.part == Part::WHOLE && !is_kept;
        let mut driver = Driver::new(session, self.rule);
        (driver.is_hasty, driver.is_resumable) = (is_hasty, is_kept);
        (driver.target, driver.skipped) = (self.facts.target, self.first);
        driver.awaited = self.awaited.take();
        driver
    }

    /// Does one piece of work; whether it was the last. Before it the checkpoint is written if it is time, and the next
    /// pass is cut short when it will be so again or the seconds are over.
    ///
    /// # Errors
    /// If a GPU fails.
    pub(super) fn step(
        &mut self,
        driver: &mut Driver<'_>,
        interrupt: &Interrupt,
        alarm: &Alarm,
        notices: &mut Notices,
    ) -> Result<bool> {
        driver.take_up()?;
        if driver.awaited.is_none() {
            let deadline = driver.deadline();
            if self.due(driver).is_some_and(|due| due <= Instant::now()) {
                // A late one would be taken for a person's wish to end.
                alarm.set(None);
                if let Err(failure) = self.keep(driver) {
                    say(notices, failure.to_string());
                }
                if deadline.is_none_or(|deadline| deadline > Instant::now()) {
                    interrupt.go_on();
                }
            }
            alarm.set(deadline.into_iter().chain(self.due(driver)).min());
        }
        if driver.has_samples() {
            interrupt.keep();
        }
        driver.step(&interrupt.asked)
    }

    /// When the checkpoint is to be written next. Before learning is over the samples would be worth nothing
    /// without what was counted meanwhile.
    fn due(&self, driver: &Driver<'_>) -> Option<Instant> {
        let is_final = driver.session.has_final_distributions();
        let checkpoint = self.checkpoint.as_ref().filter(|_| is_final)?;
        checkpoint.written.checked_add(checkpoint.every)
    }

    /// Writes the checkpoint, if there is to be one.
    ///
    /// # Errors
    /// If it cannot be written; the one from before is kept.
    pub(super) fn keep(&mut self, driver: &Driver<'_>) -> Result<()> {
        let Some(checkpoint) = &mut self.checkpoint else { return Ok(()) };
        let session = &driver.session;
        let (target, figures, noted) = (driver.target, session.figures(), session.noted());
        let facts = FilmFacts { target, figures, noted, ..self.facts.clone() };
        let written = write_film(&checkpoint.path, &facts, session.film(), self.first);
        checkpoint.written = Instant::now();
        written
    }

    /// Writes this part's own samples for `lightgrid merge`.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub(super) fn write_part(
        &self,
        path: &Path,
        driver: &Driver<'_>,
        record: &Record<'_>,
    ) -> Result<()> {
        let mut figures = *record.figures;
        if !record.with_times {
            figures.learning_seconds = 0.0;
            figures.distribution_seconds = 0.0;
            figures.render_seconds = 0.0;
        }
        let (target, metadata) = (driver.target, record.metadata());
        let facts = FilmFacts { target, figures, metadata, ..self.facts.clone() };
        write_film(path, &facts, record.film, 0)
    }
}

/// What a picture's samples depend on, by names for sentences.
fn identity(arguments: &RenderArguments, lit: Lit<'_>, view: &View) -> Vec<(String, String)> {
    let (world, environment) = lit;
    let (scene, map) = (&arguments.scene, arguments.map());
    let scene = match sources::is_built_in_scene(scene) {
        true => {
            let of_scene = &arguments.of_scene;
            let changes = (of_scene.options().hide, of_scene.edits(), of_scene.lamp_edits());
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
        ("--sampling", view.sampling.to_string()),
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
