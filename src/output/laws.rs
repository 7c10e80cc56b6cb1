//! What was learned, as tables for other programs.

use std::io::Write as _;
use std::path::Path;

use serde_json::json;

use super::record;
use crate::error::{Error, Result};
use crate::image::{ExrPicture, Image, Layer, write_beside_and_rename, write_exr};
use crate::light_grid::{LightGrid, WHOLE_MAP};

/// Writes the laws of all cells: `.csv` (law, tile, probability), `.json`, or `.exr` (one row a law,
/// one column a tile).
///
/// # Errors
/// If the file cannot be written or is called something else.
pub fn write_laws(path: &Path, grid: &LightGrid) -> Result<()> {
    let laws = grid.laws();
    let tiles = laws.tile_count();
    let cells: Vec<(u32, u32)> = grid.grid().map_or_else(Vec::new, |cells| {
        (0..cells.cell_count())
            .map(|cell| (cell, grid.law_of_cell(cell)))
            .filter(|(_, law)| *law != WHOLE_MAP)
            .collect()
    });
    let row = |law: u32| (0..tiles).map(move |tile| laws.probability(law, tile));
    match extension(path).as_deref() {
        Some("csv") => write_beside_and_rename(path, |file| {
            writeln!(file, "cell,law,tile,probability")?;
            for (cell, law) in &cells {
                for (tile, p) in row(*law).enumerate().filter(|(_, p)| *p > 0.0) {
                    writeln!(file, "{cell},{law},{tile},{p:e}")?;
                }
            }
            Ok(())
        }),
        Some("json") => {
            let all: Vec<Vec<f32>> = (0..laws.len()).map(|law| row(law).collect()).collect();
            let cells: serde_json::Map<_, _> =
                cells.iter().map(|(cell, law)| (cell.to_string(), json!(law))).collect();
            let value = json!({ "tiles": tiles, "law_of_cell": cells, "laws": all });
            record::write_json(path, &value)
        }
        Some("exr") => {
            let values: Vec<f32> = (0..laws.len()).flat_map(row).collect();
            let image = Image {
                width: tiles,
                height: laws.len(),
                pixels: values.iter().map(|p| [*p; 3]).collect(),
            };
            let layer = Layer { name: "law".to_owned(), channels: vec![("p".to_owned(), values)] };
            write_exr(path, ExrPicture { image: &image, layers: vec![layer], metadata: &[] })
        }
        _ => check_laws_extension(path),
    }
}

/// Whether laws can be written into a file of this name.
///
/// # Errors
/// A sentence that says what it may be called.
pub fn check_laws_extension(path: &Path) -> Result<()> {
    match extension(path).as_deref() {
        Some("csv" | "json" | "exr") => Ok(()),
        _ => Err(Error::at(path, "laws are written as .csv, .json or .exr")),
    }
}

fn extension(path: &Path) -> Option<String> {
    path.extension().map(|e| e.to_string_lossy().to_lowercase())
}
