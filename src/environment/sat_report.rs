//! Measures the talk's claim about summed-area tables: the sampling error of each importance table.
//!
//! The talk reports the mean squared error of a density reconstructed from samples, u32 against
//! f32, without its unit. Here it is in units of the mean texel density, and it is the limit of
//! infinitely many samples: every table's search is followed for all random numbers at once, so
//! that no histogram noise is added.

use std::fmt;
use std::hint::black_box;
use std::time::Instant;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::options::{EnvironmentOptions, TableKind};
use super::statistics::check_size;
use super::table::Table;
use super::tiles::TileGrid;
use super::weights::Weights;
use crate::error::Result;
use crate::image::Image;

/// Samples drawn to time a table.
pub const TIMED_SAMPLES: u32 = 1 << 20;

/// The talk's maps, which built-in skies of the same names replace: columns, rows, and the published mean squared
/// errors of u32 and f32, in the talk's unit.
pub const TALKS_MAPS: [(&str, (u32, u32), [f64; 2]); 4] = [
    ("Hallway", (10_000, 5000), [1.0e-5, 3.8e-1]),
    ("Day", (15_000, 7500), [4.9e-7, 8.6e-3]),
    ("Night", (3000, 1500), [1.4e-8, 4.1e-4]),
    ("Sunset", (3000, 1500), [1.1e-8, 3.6e-4]),
];

/// Every table kind measured on one map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SatReport {
    /// Columns of the map.
    pub width: u32,
    /// Rows of the map.
    pub height: u32,
    /// Share of the patches that have weight.
    pub lit_share: f64,
    /// One row per kind, in the order of [`TableKind::ALL`].
    pub rows: Vec<SatReportRow>,
}

/// One table kind on one map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SatReportRow {
    /// The table.
    pub table: TableKind,
    /// Mean over the patches of the squared difference of the sampled and the true probability,
    /// each times the number of patches.
    pub mean_squared_error: f64,
    /// Share of the patches with weight that are never sampled.
    pub missed_share: f64,
    /// Share of all energy in patches that are never sampled.
    pub missed_energy_share: f64,
    /// Share of the steps from patch to patch in which the sums along a row fall.
    pub falling_share: f64,
    /// Total variation between the sampled and the reported probabilities, in `[0,1]`: 0 if
    /// densities are exact, else an estimator that divides by them is biased.
    pub misreported_share: f64,
    /// Seconds to build the table.
    pub build_seconds: f64,
    /// Nanoseconds to choose a patch of a tile (tiles drawn by energy).
    pub sample_nanoseconds: f64,
    /// Bytes of the table.
    pub table_bytes: u64,
}

/// Builds and measures every table kind on a map (finite, not negative). `timed_samples` is how
/// many samples the time of one is taken over. Summed-area tables are searched over the whole map,
/// as in the talk; the tile-local table over its default tiles, chosen by energy.
///
/// # Errors
/// If the map has no pixels.
pub fn sat_report(map: &Image, timed_samples: u32) -> Result<SatReport> {
    check_size(map)?;
    let options = EnvironmentOptions::default();
    let weights = Weights::new(map);
    let (columns, rows) = weights.size();
    let grid = TileGrid::new(columns, rows, options.tile_columns, options.tile_rows);
    let patches = f64::from(columns) * f64::from(rows);
    let (mut total, mut lit) = (0.0, 0_u64);
    weights.for_each_row(|row| {
        total += row.iter().sum::<f64>();
        lit += row.iter().filter(|weight| **weight > 0.0).count() as u64;
    });
    let table_rows = TableKind::ALL.map(|kind| {
        let start = Instant::now();
        let (table, energies) = Table::build(kind, &weights, &grid);
        let build_seconds = start.elapsed().as_secs_f64();
        let deviation = Deviation::of(&probabilities(&table, &grid, &energies), &weights, total);
        SatReportRow {
            table: kind,
            mean_squared_error: deviation.squares * patches,
            missed_share: deviation.missed as f64 / lit.max(1) as f64,
            missed_energy_share: deviation.missed_energy,
            falling_share: deviation.falling as f64 / patches,
            misreported_share: deviation.misreported / 2.0,
            build_seconds,
            sample_nanoseconds: time_samples(&table, &grid, &energies, timed_samples),
            table_bytes: table.memory_bytes() as u64,
        }
    });
    let lit_share = lit as f64 / patches;
    Ok(SatReport { width: map.width, height: map.height, lit_share, rows: table_rows.to_vec() })
}

/// Errors of a table: sums over patches.
#[derive(Default)]
struct Deviation {
    squares: f64,
    missed: u64,
    missed_energy: f64,
    falling: u64,
    misreported: f64,
}

impl Deviation {
    /// Of the whole map; rows are added in order, so that the result does not depend on threads.
    fn of(probabilities: &OfRow<'_>, weights: &Weights<'_>, total: f64) -> Self {
        let (width, height) = weights.size();
        let buffers = || (vec![0.0; width as usize], Vec::new());
        let of_row = |(row, scratch): &mut (Vec<f64>, Vec<f64>), y| {
            weights.row(0, y, row, scratch);
            let [sampled, reported] = probabilities(y);
            Self::of_row(row, &sampled, &reported, total)
        };
        let rows: Vec<_> = (0..height).into_par_iter().map_init(buffers, of_row).collect();
        rows.iter().fold(Self::default(), |sum, row| Self {
            squares: sum.squares + row.squares,
            missed: sum.missed + row.missed,
            missed_energy: sum.missed_energy + row.missed_energy,
            falling: sum.falling + row.falling,
            misreported: sum.misreported + row.misreported,
        })
    }

    fn of_row(weights: &[f64], sampled: &[f64], reported: &[f64], total: f64) -> Self {
        let mut sum = Self::default();
        for ((weight, sampled), reported) in weights.iter().zip(sampled).zip(reported) {
            let truth = if total > 0.0 { weight / total } else { 0.0 };
            sum.squares += (sampled - truth).powi(2);
            if *weight > 0.0 && *sampled <= 0.0 {
                sum.missed += 1;
                sum.missed_energy += truth;
            }
            sum.falling += u64::from(*reported < 0.0);
            sum.misreported += (sampled - reported.max(0.0)).abs();
        }
        sum
    }
}

/// What finds the probabilities of the patches of a row: those with which they are sampled, and those that are
/// reported, negative where sums fall.
type OfRow<'a> = Box<dyn Fn(u32) -> [Vec<f64>; 2] + Sync + 'a>;

/// The probabilities with which a table samples the whole map, and those that it reports, row by row.
fn probabilities<'a>(table: &'a Table, grid: &'a TileGrid, energies: &[f64]) -> OfRow<'a> {
    let share = |part: f64, total: f64| if total > 0.0 { part / total } else { 0.0 };
    let whole = grid.whole();
    match table {
        Table::TileLocal(table) => {
            let total = energies.iter().sum();
            let of_tiles: Vec<f64> = energies.iter().map(|energy| share(*energy, total)).collect();
            Box::new(move |y| {
                let of_patch = |x| {
                    let tile = grid.tile_of_patch(x, y);
                    of_tiles[tile as usize] * table.sample_probability(tile, x, y)
                };
                // Exact sums: each patch is sampled with its reported probability.
                let reported: Vec<f64> = whole.x.clone().map(of_patch).collect();
                [reported.clone(), reported]
            })
        }
        Table::SummedArea(table) => {
            let (of_rows, total) = (table.row_distribution(&whole), table.mass(&whole.x, &whole.y));
            Box::new(move |y| {
                let columns = table.column_distribution(&whole, y);
                let sampled = columns.iter().map(|column| column * of_rows[y as usize]);
                let mass = |x| table.mass(&(x..x + 1), &(y..y + 1));
                [sampled.collect(), whole.x.clone().map(|x| share(mass(x), total)).collect()]
            })
        }
    }
}

/// Mean time of [`Table::sample`], at the points of the R2 sequence (Roberts 2018), in tiles drawn
/// by energy; 0 if there is nothing to sample.
fn time_samples(table: &Table, grid: &TileGrid, energies: &[f64], samples: u32) -> f64 {
    const TILES: u32 = 4096;
    let total: f64 = energies.iter().sum();
    let mut before = 0.0;
    let mut tiles = Vec::new();
    for (tile, energy) in (0_u32..).zip(energies) {
        let next = before + energy / total * f64::from(TILES);
        tiles.extend((before.ceil() as u32..next.ceil() as u32).map(|_| tile));
        before = next;
    }
    if tiles.is_empty() || samples == 0 {
        return 0.0;
    }
    let steps =
        [0.754_877_666_246_693, 0.569_840_290_998_053].map(|s| (s * 2.0_f64.powi(64)) as u64);
    let mut u = [0_u64; 2];
    let start = Instant::now();
    for sample in 0..samples {
        u = [u[0].wrapping_add(steps[0]), u[1].wrapping_add(steps[1])];
        // A stride without a common factor with the power of two visits the tiles out of order.
        let tile = tiles[(sample as usize * 1597) % tiles.len()];
        black_box(table.search(tile, u).map(|search| table.finish(grid, tile, &search)));
    }
    start.elapsed().as_secs_f64() * 1e9 / f64::from(samples)
}

impl fmt::Display for SatReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { width, height, lit_share, rows } = self;
        let lit = 100.0 * lit_share;
        writeln!(f, "{width} x {height}, bilinear look-up, {lit:.1} % of the patches lit")?;
        writeln!(
            f,
            "table            MSE    missed missed energy   falling   misreported   build s ns/sample       MiB"
        )?;
        for row in rows {
            writeln!(
                f,
                "{:<10} {:>9.1e} {:>7.2} % {:>13.1e} {:>7.2} % {:>13.1e} {:>9.3} {:>9.0} {:>9.1}",
                row.table,
                row.mean_squared_error,
                100.0 * row.missed_share,
                row.missed_energy_share,
                100.0 * row.falling_share,
                row.misreported_share,
                row.build_seconds,
                row.sample_nanoseconds,
                row.table_bytes as f64 / f64::from(1 << 20)
            )?;
        }
        Ok(())
    }
}
