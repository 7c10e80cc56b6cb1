//! The stability suite: stiff and extreme cases, each with a figure, a limit and a verdict.
//!
//! It is part of the product: an artist with a strange scene or a developer with a new driver runs
//! `lightgrid stability`. Each group is a file; [`cases`] lists them all, [`run`] runs one. The quick
//! half takes seconds a case and runs in the tests; [`Setting::nightly`] asks for the counts that
//! take minutes (1e9 rays, maps of a gigabyte).

mod case;
mod devices;
mod film;
mod geometry;
mod grid;
mod maps;
mod materials;
mod outcome;
mod reference;
mod scenes;
mod tables;

use self::case::Entry;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

use serde_json::{Value, json};

pub use self::case::{Case, On, Setting};
pub use self::outcome::{Figure, Limit, Outcome, Verdict};

/// All cases, group by group.
pub fn cases() -> impl Iterator<Item = Case> {
    let groups = [
        ("maps", maps::CASES),
        ("tables", tables::CASES),
        ("grid", grid::CASES),
        ("geometry", geometry::CASES),
        ("materials", materials::CASES),
        ("film", film::CASES),
        ("devices", devices::CASES),
    ];
    let of_group = |(group, cases): (_, &'static [Entry])| {
        cases.iter().map(move |&(name, on, run)| Case { group, name, on, run })
    };
    groups.into_iter().flat_map(of_group)
}

/// Result of a case that was run.
pub struct CaseReport {
    /// `group/name`.
    pub title: String,
    /// Its figures and verdict.
    pub outcome: Outcome,
    /// Seconds that it took.
    pub seconds: f64,
}

/// Runs a case. An error or a panic in it becomes a failed verdict.
pub fn run(case: Case, setting: &Setting) -> CaseReport {
    let start = Instant::now();
    let outcome = if case.on == On::Gpu && setting.gpu.is_none() {
        Outcome::skipped("needs --device gpu")
    } else {
        match catch_unwind(AssertUnwindSafe(|| (case.run)(setting))) {
            Ok(Ok(outcome)) => outcome,
            Ok(Err(error)) => Outcome::broken(error.to_string()),
            Err(_) => Outcome::broken("it panicked"),
        }
    };
    CaseReport { title: case.title(), outcome, seconds: start.elapsed().as_secs_f64() }
}

impl CaseReport {
    /// One line: case, decisive figure, value, limit, verdict, seconds; then the remarks unless it passed.
    pub fn line(&self) -> String {
        let verdict = self.outcome.verdict();
        let (what, value, limit) = match self.outcome.decisive() {
            Some(figure) if verdict != Verdict::Skipped => {
                (figure.what.as_str(), outcome::number(figure.value), figure.limit.to_string())
            }
            _ => ("", String::new(), String::new()),
        };
        let mut line = format!(
            "{:<35} {what:<64} {value:>9}  {limit:<12} {verdict:<7} {:>5.1} s",
            self.title, self.seconds
        );
        if verdict != Verdict::Passed {
            self.outcome.remarks.iter().for_each(|remark| line += &format!("\n    {remark}"));
        }
        line
    }

    /// Title, seconds, verdict, every figure, remarks.
    pub fn to_json(&self) -> Value {
        json!({
            "case": self.title,
            "seconds": self.seconds,
            "verdict": self.outcome.verdict().to_string(),
            "figures": self.outcome.figures.iter().map(Figure::to_json).collect::<Vec<_>>(),
            "remarks": self.outcome.remarks,
        })
    }
}
