//! What `lightgrid render` writes.

use std::path::{Path, PathBuf};

use super::{RenderArguments, sharing};
use crate::error::{Error, Result};
use crate::image::{check_writable, is_same_file};
use crate::light_grid::LightGrid;
use crate::medium::Fog;
use crate::output::laws::{check_laws_extension, write_laws};
use crate::output::record::{self, Record};
use crate::output::{self, PictureOptions};

/// Refuses outputs before the work rather than after it.
pub(super) fn check(arguments: &RenderArguments) -> Result<()> {
    for picture in &arguments.outputs {
        output::check_extension(picture)?;
    }
    if let Some(laws) = &arguments.laws {
        check_laws_extension(laws)?;
    }
    if let Some(denoiser) = arguments.denoise {
        denoiser.check()?;
    }
    let (width, height) = arguments.size;
    if let Some([left, top, w, h]) = arguments.region
        && (left.saturating_add(w) > width || top.saturating_add(h) > height)
    {
        return Err(Error::new(format!(
            "--region {left},{top},{w},{h} is not inside the picture of {width}x{height} pixels"
        )));
    }
    let files: Vec<&PathBuf> =
        arguments.outputs.iter().chain(&arguments.json).chain(&arguments.laws).collect();
    for (i, file) in files.iter().enumerate() {
        if files[..i].iter().any(|other| is_same_file(other, file)) {
            return Err(Error::at(file, "two outputs would be written to this one file"));
        }
        check_writable(file)?;
    }
    Ok(())
}

/// Writes all that was asked for: one that cannot be written must not take the others with it. Returns what
/// failed.
pub(super) fn write(
    arguments: &RenderArguments,
    record: &Record<'_>,
    grid: Option<&LightGrid>,
) -> Vec<Error> {
    let options = PictureOptions {
        exposure: arguments.exposure,
        tone_curve: arguments.tonemap,
        denoiser: arguments.denoise,
        white_balance: arguments.white.unwrap_or_default(),
        layers: arguments.layers.clone(),
    };
    let mut failures: Vec<Error> = arguments
        .outputs
        .iter()
        .filter_map(|path| write_or_rescue(path, &options, record).err())
        .collect();
    if let Some(path) = &arguments.json {
        failures.extend(record::write_json(path, &record.to_json()).err());
    }
    if let Some(path) = &arguments.laws {
        let none = || Error::at(path, "not written: this map and sampling have no laws");
        let written = grid.ok_or_else(none).and_then(|grid| write_laws(path, grid));
        failures.extend(written.err());
    }
    failures
}

/// Writes a picture where it was asked to be or, if that fails, into the temporary folder.
fn write_or_rescue(path: &Path, options: &PictureOptions, record: &Record<'_>) -> Result<()> {
    let Err(failure) = output::write_picture(path, options, record) else { return Ok(()) };
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let rescued = std::env::temp_dir().join(format!("lightgrid-{}-{name}", std::process::id()));
    Err(match output::write_picture(&rescued, options, record) {
        Ok(()) => Error::new(format!("{failure}; the picture is kept as {}", rescued.display())),
        Err(_) => failure,
    })
}

/// Settings that belong into metadata and JSON, as typed or as chosen.
pub(super) fn settings(
    arguments: &RenderArguments,
    fog: Option<Fog>,
) -> Vec<(&'static str, serde_json::Value)> {
    let fog = fog.map(|fog| {
        let Fog { interior, bounds: [low, high] } = fog;
        serde_json::json!({
            "scattering": interior.scattering.to_array(),
            "absorption": (interior.extinction - interior.scattering).to_array(),
            "anisotropy": interior.phase.mean_cosine(),
            "box": [low.to_array(), high.to_array()],
        })
    });
    vec![
        ("fog", serde_json::json!(fog)),
        ("sampling", serde_json::json!(arguments.sampling)),
        ("sharing", serde_json::json!(sharing(arguments))),
        ("gi", serde_json::json!(arguments.gi)),
        ("table", serde_json::json!(arguments.table.to_string())),
        ("tiles", serde_json::json!(format!("{}x{}", arguments.tiles.0, arguments.tiles.1))),
        ("grid_columns", serde_json::json!(arguments.grid)),
        ("bounces", serde_json::json!(arguments.bounces)),
        ("russian_roulette", serde_json::json!(!arguments.no_russian_roulette)),
        ("filter", serde_json::json!(arguments.filter)),
        ("region", serde_json::json!(arguments.region)),
        ("background", serde_json::json!(arguments.background.unwrap_or_default())),
        ("env_rotation_degrees", serde_json::json!(arguments.env_rotation)),
        ("env_intensity", serde_json::json!(arguments.env_intensity)),
        ("seed", serde_json::json!(arguments.seed)),
    ]
}
