//! What was learned, as tables for other programs.

use std::io::Write as _;
use std::path::Path;

use serde_json::json;

use super::record;
use crate::error::{Error, Result};
use crate::image::{ExrPicture, Image, Layer, extension, write_beside_and_rename, write_exr};
use crate::light_grid::{LightGrid, WHOLE_MAP};

/// Writes the distributions of all cells: `.csv` (distribution, tile, probability), `.json`, or `.exr` (one row
/// a distribution, one column a tile).
///
/// # Errors
/// If the file cannot be written or is called something else.
pub fn write_distributions(path: &Path, grid: &LightGrid) -> Result<()> {
    let distributions = grid.distributions();
    let tiles = distributions.tile_count();
    let cells: Vec<(u32, u32)> = grid.grid().map_or_else(Vec::new, |cells| {
        let all = (0..cells.cell_count()).map(|cell| (cell, grid.distribution_of_cell(cell)));
        all.filter(|(_, distribution)| *distribution != WHOLE_MAP).collect()
    });
    let row = |distribution: u32| {
        (0..tiles).map(move |tile| distributions.probability(distribution, tile))
    };
    match extension(path).as_deref() {
        Some("csv") => write_beside_and_rename(path, |file| {
            writeln!(file, "cell,distribution,tile,probability")?;
            for (cell, distribution) in &cells {
                for (tile, p) in row(*distribution).enumerate().filter(|(_, p)| *p > 0.0) {
                    writeln!(file, "{cell},{distribution},{tile},{p:e}")?;
                }
            }
            Ok(())
        }),
        Some("json") => {
            let all: Vec<Vec<f32>> =
                (0..distributions.len()).map(|distribution| row(distribution).collect()).collect();
            let entries = cells.iter().map(|(cell, own)| (cell.to_string(), json!(own)));
            let cells: serde_json::Map<_, _> = entries.collect();
            let value =
                json!({ "tiles": tiles, "distribution_of_cell": cells, "distributions": all });
            record::write_json(path, &value)
        }
        Some("exr") => {
            let values: Vec<f32> = (0..distributions.len()).flat_map(row).collect();
            let image = Image {
                width: tiles,
                height: distributions.len(),
                pixels: values.iter().map(|p| [*p; 3]).collect(),
            };
            let layer =
                Layer { name: "distribution".to_owned(), channels: vec![("p".to_owned(), values)] };
            write_exr(
                path,
                ExrPicture { image: &image, layers: vec![layer], metadata: &[], preview: None },
            )
        }
        _ => check_distributions_extension(path),
    }
}

/// Whether distributions can be written into a file of this name.
///
/// # Errors
/// A sentence that says what it may be called.
pub fn check_distributions_extension(path: &Path) -> Result<()> {
    match extension(path).as_deref() {
        Some("csv" | "json" | "exr") => Ok(()),
        _ => Err(Error::at(path, "distributions are written as .csv, .json or .exr")),
    }
}
