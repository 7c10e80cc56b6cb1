//! Importance tables side by side: where each fails, and by how much.
//!
//! The tile-local table must hold everywhere. The summed-area forms are kept for comparison; what
//! f32 and u32 lose is told, not judged: it is the talk's finding, and ours.

use super::maps::{scaled, sun};
use super::random::Random;
use super::{Case, On, Outcome, Setting};
use crate::environment::{Lookup, SatReportRow, TableKind, sat_report, sky};
use crate::error::Result;
use crate::image::Image;

const fn case(name: &'static str, run: fn(&Setting) -> Result<Outcome>) -> Case {
    Case { group: "tables", name, on: On::Cpu, run }
}

pub(super) const CASES: &[Case] = &[
    case("day", |s| side_by_side(sky::build("day", width(s), width(s) / 2)?)),
    case("sun-of-1e9", |_| side_by_side(sun(512, 256, 1e9))),
    case("subnormal", |_| side_by_side(scaled(sun(512, 256, 1.0), 1e-40))),
    case("extreme-contrast", |_| side_by_side(contrast())),
];

fn width(setting: &Setting) -> u32 {
    setting.count(1024, 8192)
}

/// Sixty decades in one map.
fn contrast() -> Image {
    let mut random = Random(5);
    Image::from_fn(512, 256, |_, _| [10.0_f32.powf(60.0 * random.unit() - 30.0); 3])
}

fn side_by_side(map: Image) -> Result<Outcome> {
    let report = sat_report(&map, Lookup::Bilinear, 1 << 12)?;
    let mut outcome = Outcome::new();
    for row in &report.rows {
        let SatReportRow { table, missed_share, falling_share, misreported_share, .. } = *row;
        let figures = [
            ("lit texels never sampled", missed_share),
            ("falling steps", falling_share),
            ("density off what is sampled", misreported_share),
            ("mean squared error", row.mean_squared_error),
        ];
        for (what, value) in figures {
            let what = format!("{table}: {what}");
            outcome = match (table, what.contains("error")) {
                (TableKind::TileLocal, false) => outcome.at_most(what, value, 0.0),
                // Rounding to integers of 2^-32 of a tile, at most.
                (TableKind::TileLocal, true) => outcome.at_most(what, value, 1e-6),
                _ => outcome.told(what, value),
            };
        }
    }
    let told = |text: fn(&SatReportRow) -> String| {
        report.rows.iter().map(text).collect::<Vec<_>>().join(", ")
    };
    let missed = told(|row| format!("{} {:.3}", row.table, row.missed_share));
    let worst = told(|row| format!("{} {:.1e}", row.table, row.mean_squared_error));
    Ok(outcome.remark(format!("never sampled: {missed}; mean squared error: {worst}")))
}
