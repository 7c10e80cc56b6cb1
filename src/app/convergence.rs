//! How the estimated error fell, run by run.

use super::worker::{Point, Snapshot};
use crate::render::Sampling;

/// Earlier runs kept.
const MOST_RUNS: usize = 8;

/// One picture from its start on.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Run {
    /// What was rendered how.
    pub name: String,
    /// In order of time.
    pub points: Vec<Point>,
}

/// All runs of this window, newest last.
#[derive(Debug, Clone, Default)]
pub(crate) struct Convergence {
    runs: Vec<Run>,
    plain: Option<Run>,
    /// Whether the plot's axis is samples rather than seconds.
    pub by_samples: bool,
}

impl Convergence {
    /// Takes over what a snapshot says.
    pub(crate) fn add(&mut self, snapshot: &Snapshot) {
        let [main, plain] = &snapshot.curves;
        let Some(first) = main.first() else { return };
        let is_new = self.runs.last().and_then(|run| run.points.first()) != Some(first);
        if is_new {
            self.runs
                .push(Run { name: name_of(snapshot.main.sampling).to_owned(), points: Vec::new() });
            if self.runs.len() > MOST_RUNS {
                self.runs.remove(0);
            }
        }
        if let Some(run) = self.runs.last_mut() {
            run.points.clone_from(main);
        }
        self.plain =
            (!plain.is_empty()).then(|| Run { name: "plain".to_owned(), points: plain.clone() });
    }

    /// Runs, oldest first; the last one is going on.
    pub(crate) fn runs(&self) -> &[Run] {
        &self.runs
    }

    /// The plain half of a split view.
    pub(crate) fn plain(&self) -> Option<&Run> {
        self.plain.as_ref()
    }
}

/// What a person calls a way of sampling.
pub(crate) fn name_of(sampling: Sampling) -> &'static str {
    match sampling {
        Sampling::Bsdf => "BSDF",
        other => other.name(),
    }
}
