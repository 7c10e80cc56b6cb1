//! Errors of each importance table.
//!
//! The tile-local table has limits. Errors of the summed-area tables, which are kept for comparison, are reported
//! without limits: they are known from the talk and from our own measurements.

use super::case::{Entry, On, Setting};
use super::maps::{scaled, sun};
use super::outcome::Outcome;
use crate::environment::{SatReportRow, TableKind, sat_report, sky};
use crate::error::{Error, Result};
use crate::image::Image;
use crate::sampler::SplitMix;

pub(super) const CASES: &[Entry] = &[
    ("tile-local", On::Cpu, |s| everywhere(s, TableKind::TileLocal)),
    ("u32", On::Cpu, |s| everywhere(s, TableKind::U32)),
    ("f32", On::Cpu, |s| everywhere(s, TableKind::F32)),
    ("f64", On::Cpu, |s| everywhere(s, TableKind::F64)),
];

fn maps(setting: &Setting) -> Result<[(&'static str, Image); 4]> {
    let width = setting.count(512, 8192);
    let mut random = SplitMix(5);
    let mut decades = |_, _| [10.0_f32.powf(60.0 * random.next_f32() - 30.0); 3];
    Ok([
        ("day", sky::build("day", width, width / 2)?),
        ("a sun of 1e9", sun(512, 256, 1e9)),
        ("subnormal radiance", scaled(sun(512, 256, 1.0), 1e-40)),
        ("60 decades", Image::from_fn(512, 256, &mut decades)),
    ])
}

/// A figure of a row.
type FigureOf = fn(&SatReportRow) -> f64;

/// One table on every map; the worst map of each figure is named.
fn everywhere(setting: &Setting, table: TableKind) -> Result<Outcome> {
    let mut rows: Vec<(&str, SatReportRow)> = Vec::new();
    for (name, map) in maps(setting)? {
        let report = sat_report(&map, 0)?;
        let row = report.rows.into_iter().find(|row| row.table == table);
        rows.push((name, row.ok_or_else(|| Error::new("a table is missing from the report"))?));
    }
    let figures: [(&str, FigureOf); 4] = [
        ("lit texels never sampled", |row| row.missed_share),
        ("falling steps", |row| row.falling_share),
        ("density off what is sampled", |row| row.misreported_share),
        ("mean squared error of densities of mean 1", |row| row.mean_squared_error),
    ];
    let mut outcome = Outcome::default();
    for (what, of) in figures {
        let worst = rows.iter().max_by(|a, b| of(&a.1).total_cmp(&of(&b.1)));
        let Some((map, row)) = worst else { continue };
        let (title, value) = (format!("{what}, worst: {map}"), of(row));
        outcome = match table {
            // Limit: rounding to integers of 2^-32 of a tile.
            TableKind::TileLocal if what.contains("error") => outcome.at_most(title, value, 1e-6),
            TableKind::TileLocal => outcome.at_most(title, value, 0.0),
            _ => outcome.info(title, value),
        };
    }
    Ok(outcome)
}
