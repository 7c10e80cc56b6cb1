//! How the estimated error fell, run by run.

use super::worker::Snapshot;
use crate::render::Sampling;

/// Earlier runs kept.
const MOST_RUNS: usize = 8;

/// The state of a run at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Seconds of learning and rendering.
    pub seconds: f64,
    /// Samples per pixel.
    pub samples: f64,
    /// Estimated relative RMS error.
    pub noise: f64,
}

/// One picture from its start on.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// What was rendered how.
    pub name: String,
    /// In order of time.
    pub points: Vec<Point>,
}

/// All runs of this window, newest last.
#[derive(Debug, Clone, Default)]
pub struct Convergence {
    runs: Vec<Run>,
    plain: Option<Run>,
    /// Whether the plot's axis is samples rather than seconds.
    pub by_samples: bool,
}

impl Convergence {
    /// Adds what a snapshot says.
    pub fn add(&mut self, snapshot: &Snapshot) {
        if snapshot.is_preview || snapshot.request.moving {
            return;
        }
        let add = |run: &mut Run, take: &super::worker::Take| {
            let film = &take.film;
            let point = Point {
                seconds: take.figures.elapsed_seconds(),
                samples: film.total_samples() as f64 / film.pixels().len().max(1) as f64,
                noise: take.noise,
            };
            let is_later = run.points.last().is_none_or(|last| point.seconds > last.seconds);
            if point.noise.is_finite() && point.noise > 0.0 && is_later {
                run.points.push(point);
            }
        };
        let seconds = snapshot.main.figures.elapsed_seconds();
        let is_new = self
            .runs
            .last()
            .and_then(|run| run.points.last())
            .is_none_or(|last| seconds < last.seconds);
        let name = name_of(snapshot.main.sampling);
        if is_new {
            self.runs.retain(|run| run.points.len() > 1);
            self.runs.push(Run { name: name.to_owned(), points: Vec::new() });
            self.plain = None;
            if self.runs.len() > MOST_RUNS {
                self.runs.remove(0);
            }
        }
        if let Some(run) = self.runs.last_mut() {
            add(run, &snapshot.main);
        }
        if let Some(take) = &snapshot.plain {
            let run = self.plain.get_or_insert_with(|| Run {
                name: "plain, beside it".to_owned(),
                points: Vec::new(),
            });
            add(run, take);
        }
    }

    /// Runs, oldest first; the last one is going on.
    pub fn runs(&self) -> &[Run] {
        &self.runs
    }

    /// The plain half of a split view.
    pub fn plain(&self) -> Option<&Run> {
        self.plain.as_ref()
    }
}

/// What a person calls a way of sampling.
pub fn name_of(sampling: Sampling) -> &'static str {
    match sampling {
        Sampling::Adaptive => "adaptive",
        Sampling::Talk => "talk",
        Sampling::Plain => "plain",
        Sampling::Bsdf => "BSDF",
    }
}
