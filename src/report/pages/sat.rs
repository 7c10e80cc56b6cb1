//! Tables of the comparison of summed-area tables.

use std::fmt::Display;

use askama::Template;
use serde::{Deserialize, Serialize};

use crate::environment::{SatReport, TableKind};

/// A finished case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// Title of the case.
    pub title: String,
    /// Errors of u32 and f32 in the talk.
    pub published: Option<[f64; 2]>,
    /// Figures of every table.
    pub report: SatReport,
}

impl Measured {
    /// The talk's error of a table.
    fn talks(&self, table: &TableKind) -> String {
        let theirs = self.published.and_then(|[u32s, f32s]| match table {
            TableKind::U32 => Some(u32s),
            TableKind::F32 => Some(f32s),
            TableKind::TileLocal | TableKind::F64 => None,
        });
        theirs.map_or_else(|| "-".to_owned(), |mse| format!("{mse:.1e}"))
    }
}

/// All cases as comma-separated values.
#[derive(Template)]
#[template(path = "sat.csv", escape = "none")]
pub(in crate::report) struct Csv<'a> {
    pub(in crate::report) maps: &'a [Measured],
}

#[derive(Template)]
#[template(path = "sat.md", escape = "none")]
struct Markdown<'a> {
    maps: &'a [Measured],
}

/// All cases as one Markdown table, with the talk's errors.
pub fn markdown(maps: &[Measured]) -> impl Display {
    Markdown { maps }
}

/// Differences between the talk's figures and ours.
pub const REMARK: &str = "MSE: in units of the mean texel density, exact (the search of each table \
    followed for all random numbers at once). The talk does not say its unit, nor are its maps public: \
    compare ratios. Zero mass: share of the lit texels that are never sampled. Falling steps: share of \
    the steps along a row in which the sums fall.";
