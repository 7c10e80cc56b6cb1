//! Figures of a case, their limits and the verdict.

use std::fmt;

use serde_json::{Value, json};

/// Limit of a figure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Limit {
    /// The figure must be at most this.
    AtMost(f64),
    /// The figure must be at least this.
    AtLeast(f64),
    /// No limit: the figure is information.
    Info,
}

/// One measured number and its limit.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// What was measured, with its unit.
    pub what: String,
    /// The number; NaN always fails.
    pub value: f64,
    /// Its limit.
    pub limit: Limit,
}

impl Figure {
    /// Whether the limit is kept.
    pub fn holds(&self) -> bool {
        match self.limit {
            Limit::AtMost(most) => self.value <= most,
            Limit::AtLeast(least) => self.value >= least,
            Limit::Info => !self.value.is_nan(),
        }
    }

    /// Share of the limit that is used: above 1 it fails, below 0 it has no limit.
    fn strain(&self) -> f64 {
        match self.limit {
            _ if !self.holds() => f64::INFINITY,
            Limit::AtMost(most) if most > 0.0 => (self.value / most).max(0.0),
            // Lower limits mostly check that the case has measured something.
            Limit::AtMost(_) | Limit::AtLeast(_) => 0.0,
            Limit::Info => -1.0,
        }
    }

    /// What, value, limit, and whether that holds.
    pub(super) fn to_json(&self) -> Value {
        let number = |x: f64| if x.is_finite() { json!(x) } else { json!(x.to_string()) };
        let (bound, limit) = match self.limit {
            Limit::AtMost(most) => ("at most", number(most)),
            Limit::AtLeast(least) => ("at least", number(least)),
            Limit::Info => ("info", Value::Null),
        };
        json!({
            "what": self.what,
            "value": number(self.value),
            "bound": bound,
            "limit": limit,
            "holds": self.holds(),
        })
    }
}

/// Result of a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Every limit is kept.
    Passed,
    /// A limit is exceeded, or the case could not be finished.
    Failed,
    /// It cannot be run here; the reason is in the outcome's remarks.
    Skipped,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Passed => "ok",
            Self::Failed => "FAILED",
            Self::Skipped => "skipped",
        })
    }
}

/// All figures and remarks of a case.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Outcome {
    /// In the order they were measured.
    pub figures: Vec<Figure>,
    /// Remarks, such as why the case was skipped.
    pub remarks: Vec<String>,
    /// Where figures do not decide.
    known: Option<Verdict>,
}

impl Outcome {
    /// A case that cannot be run here.
    pub(super) fn skipped(reason: impl Into<String>) -> Self {
        Self { remarks: vec![reason.into()], known: Some(Verdict::Skipped), ..Self::default() }
    }

    /// A case that could not be finished.
    pub(super) fn broken(reason: impl Into<String>) -> Self {
        Self { remarks: vec![reason.into()], known: Some(Verdict::Failed), ..Self::default() }
    }

    /// Adds a figure that must be `most` or less.
    pub(super) fn at_most(mut self, what: impl Into<String>, value: f64, most: f64) -> Self {
        self.figures.push(Figure { what: what.into(), value, limit: Limit::AtMost(most) });
        self
    }

    /// Adds a figure that must be `least` or more.
    pub(super) fn at_least(mut self, what: impl Into<String>, value: f64, least: f64) -> Self {
        self.figures.push(Figure { what: what.into(), value, limit: Limit::AtLeast(least) });
        self
    }

    /// Adds a figure that is not judged.
    pub(super) fn info(mut self, what: impl Into<String>, value: f64) -> Self {
        self.figures.push(Figure { what: what.into(), value, limit: Limit::Info });
        self
    }

    /// Adds a sentence.
    pub(super) fn remark(mut self, sentence: impl Into<String>) -> Self {
        self.remarks.push(sentence.into());
        self
    }

    /// Adds all of another outcome.
    pub(super) fn and(mut self, other: Self) -> Self {
        self.figures.extend(other.figures);
        self.remarks.extend(other.remarks);
        self.known = self.known.or(other.known);
        self
    }

    /// The verdict. A case without figures that was not skipped has failed.
    pub fn verdict(&self) -> Verdict {
        let holds = !self.figures.is_empty() && self.figures.iter().all(Figure::holds);
        self.known.unwrap_or(if holds { Verdict::Passed } else { Verdict::Failed })
    }

    /// The decisive figure: the first that fails, else the one nearest to its limit.
    pub fn decisive(&self) -> Option<&Figure> {
        self.figures.iter().reduce(|a, b| if b.strain() > a.strain() { b } else { a })
    }
}

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AtMost(most) => f.pad(&format!("<= {}", number(*most))),
            Self::AtLeast(least) => f.pad(&format!(">= {}", number(*least))),
            Self::Info => f.pad("info"),
        }
    }
}

/// Whole numbers as they are, others with three digits.
pub(super) fn number(x: f64) -> String {
    if x.fract() == 0.0 && x.abs() < 1e7 {
        format!("{x}")
    } else if (0.01..1000.0).contains(&x.abs()) {
        format!("{x:.3}")
    } else {
        format!("{x:.1e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_fails_decides_and_nothing_measured_is_no_pass() {
        let sound =
            Outcome::default().at_most("a", 1.0, 10.0).at_least("b", 2.0, 1.0).info("c", 9e9);
        assert_eq!(sound.verdict(), Verdict::Passed);
        assert_eq!(sound.decisive().map(|f| f.what.as_str()), Some("a"));
        let failed = sound.clone().at_most("d", 1.0, 0.0).at_most("e", 1.0, 1.0);
        assert_eq!(failed.verdict(), Verdict::Failed);
        assert_eq!(failed.decisive().map(|f| f.what.as_str()), Some("d"));
        assert_eq!(sound.at_most("f", f64::NAN, f64::INFINITY).verdict(), Verdict::Failed);
        assert_eq!(Outcome::default().verdict(), Verdict::Failed);
        assert_eq!(Outcome::skipped("no GPU").verdict(), Verdict::Skipped);
        let broken = Outcome::default().at_most("a", 0.0, 0.0).and(Outcome::broken("no room"));
        assert_eq!(broken.verdict(), Verdict::Failed);
    }
}
