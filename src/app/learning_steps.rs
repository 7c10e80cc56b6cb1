//! Learning once more, step by step: what was known after each pass of learning paths.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::worker::{Request, SessionSnapshot, Snapshot};
use crate::light_grid::{LearningGrid, LightGrid};
use crate::render::{Phase, Session};

/// What was known after a pass.
struct Step {
    /// All learning paths up to it.
    paths: u64,
    grid: Option<Arc<LightGrid>>,
    counters: Option<Arc<LearningGrid>>,
}

/// The steps in which the picture of a request has learned.
pub(super) struct LearningSteps {
    of: Arc<Request>,
    steps: Vec<Step>,
}

impl LearningSteps {
    /// None yet.
    pub(super) fn begun(of: &Arc<Request>) -> Self {
        Self { of: Arc::clone(of), steps: Vec::new() }
    }

    /// Learns as the picture has, on the CPU; the first step is before all paths.
    pub(super) fn learn(of: Arc<Request>) -> Self {
        let mut session = Session::new(&of.world, &of.environment, of.view.clone());
        let mut steps = Vec::new();
        loop {
            steps.push(Step {
                paths: session.figures().learning_paths,
                grid: session.grid().cloned().map(Arc::new),
                counters: session.counters().map(|counters| Arc::new(counters.snapshot())),
            });
            let is_over = session.phase() != Phase::Learning;
            // Only a GPU fails.
            if is_over || session.advance(1, &AtomicBool::new(false)).is_err() {
                break;
            }
        }
        drop(session);
        Self { of, steps }
    }

    /// Whether they are not there yet.
    pub(super) fn is_busy(&self) -> bool {
        self.steps.is_empty()
    }

    /// How many there are.
    pub(super) fn count(&self) -> usize {
        self.steps.len()
    }

    /// Number of learning paths that a step knows; `None` beyond the last step.
    pub(super) fn paths(&self, step: usize) -> Option<u64> {
        self.steps.get(step).map(|step| step.paths)
    }

    /// Whether both are of the same request.
    pub(super) fn has_request_of(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.of, &other.of)
    }

    /// Whether the picture of a request learns so.
    pub(super) fn is_of(&self, request: &Request) -> bool {
        Arc::ptr_eq(&self.of.world, &request.world)
            && Arc::ptr_eq(&self.of.environment, &request.environment)
            && self.of.view == request.view
    }

    /// A snapshot with what was known at a step.
    pub(super) fn at(&self, step: usize, snapshot: &Snapshot) -> Option<Arc<Snapshot>> {
        let Step { grid, counters, .. } = self.steps.get(step)?;
        let main = SessionSnapshot { grid: grid.clone(), ..snapshot.main.clone() };
        let (learning_step, counters) = (Some(step), counters.clone());
        Some(Arc::new(Snapshot { learning_step, main, counters, ..snapshot.clone() }))
    }
}
