//! How the estimated error fell, run by run.

use super::worker::Point;
use crate::render::Sampling;

/// Earlier runs kept.
const MAX_RUNS: usize = 8;

/// One picture from its start on.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Run {
    /// What was rendered how.
    pub name: String,
    /// Of this window, from 1 on.
    pub number: usize,
    /// In order of time.
    pub points: Vec<Point>,
}

/// All runs of this window, newest last.
#[derive(Debug, Clone, Default)]
pub(crate) struct Convergence {
    /// Runs, oldest first; the last one is going on.
    pub runs: Vec<Run>,
    /// Runs by now, those that are no longer kept included.
    count: usize,
    /// The plain half of a split view.
    pub plain: Option<Run>,
    /// Whether the plot's axis is samples rather than seconds.
    pub by_samples: bool,
}

impl Convergence {
    /// Takes over how the errors of the picture, sampled so, and of the plain one beside it fell.
    pub(crate) fn add(&mut self, sampling: Sampling, [main, plain]: &[Vec<Point>; 2]) {
        let Some(first) = main.first() else { return };
        // The last one, or one that somebody has come back to.
        let is_known =
            |run: &Run| run.points.first().is_some_and(|old| old.seconds == first.seconds);
        let known = self.runs.iter().rposition(is_known).map(|at| self.runs.remove(at));
        self.count += usize::from(known.is_none());
        let (name, number) =
            known.map_or_else(|| (name_of(sampling), self.count), |run| (run.name, run.number));
        self.runs.push(Run { name, number, points: main.clone() });
        if self.runs.len() > MAX_RUNS {
            self.runs.remove(0);
        }
        let of_plain = || Run { name: "plain".to_owned(), number, points: plain.clone() };
        self.plain = (!plain.is_empty()).then(of_plain);
    }
}

/// What a person calls a way of sampling.
pub(crate) fn name_of(sampling: Sampling) -> String {
    if sampling == Sampling::Bsdf { "BSDF".to_owned() } else { sampling.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_that_goes_on_later_keeps_its_number() {
        let mut convergence = Convergence::default();
        let mut add = |seconds: f64, points: usize| {
            let point =
                |i| Point { seconds: seconds + i as f64, samples: 1.0, noise: 0.5, error: None };
            convergence.add(Sampling::Plain, &[(0..points).map(point).collect(), Vec::new()]);
            let runs = convergence.runs.iter();
            runs.map(|run| (run.number, run.points.len())).collect::<Vec<_>>()
        };
        assert_eq!(add(1.0, 1), [(1, 1)]);
        assert_eq!(add(1.0, 2), [(1, 2)]);
        assert_eq!(add(1.5, 1), [(1, 2), (2, 1)]);
        assert_eq!(add(1.0, 3), [(2, 1), (1, 3)]);
        let last = (0..9).map(|i| add(2.0 + 0.1 * f64::from(i), 1)).last().unwrap_or_default();
        assert_eq!(last.len(), MAX_RUNS);
        assert_eq!(last.last(), Some(&(11, 1)));
    }
}
