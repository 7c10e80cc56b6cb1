//! What `lightgrid render` writes.

use std::path::{Path, PathBuf};

use super::render_job::RenderJob;
use super::{RenderArguments, frames};
use crate::cli::picture::{check_output, say_written};
use crate::error::{Error, Result};
use crate::image::is_same_file;
use crate::output::distributions::{check_distributions_extension, write_distributions};
use crate::output::record::{self, Record};
use crate::output::{Films, holds_layers};
use crate::path::World;
use crate::render::{Driver, Sampling, View};
use crate::terminal::notice;

/// Refuses outputs before the work rather than after it.
pub(super) fn check(arguments: &RenderArguments) -> Result<()> {
    if arguments.part.is_some() {
        let [part] = &arguments.outputs[..] else {
            return Err(Error::new("--part writes one file: give -o once"));
        };
        if part.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("part")) {
            return Err(Error::at(part, "a part is written as .part, for `lightgrid merge`"));
        }
        arguments.picture.check([])?;
    } else {
        let has_frames = arguments.frames.is_some() || arguments.turntable.is_some();
        let is_picture = |path: &&PathBuf| !(has_frames && frames::is_video(path));
        arguments.picture.check(arguments.outputs.iter().filter(is_picture))?;
        if has_frames {
            frames::check(arguments)?;
        }
    }
    if let Some(distributions) = &arguments.distributions {
        check_distributions_extension(distributions)?;
        if arguments.sampling == Sampling::Bsdf {
            return Err(without_distributions(distributions));
        }
    }
    let (width, height) = arguments.size;
    if let Some([left, top, w, h]) = arguments.region
        && (left.saturating_add(w) > width || top.saturating_add(h) > height)
    {
        return Err(Error::new(format!(
            "--region {left},{top},{w},{h} is not inside the picture of {width}x{height} pixels"
        )));
    }
    let files: Vec<&PathBuf> = files(arguments).collect();
    for (i, file) in files.iter().enumerate() {
        if files[..i].iter().any(|other| is_same_file(other, file)) {
            return Err(Error::at(file, "two outputs would be written to this one file"));
        }
        check_output(file, [&arguments.scene].into_iter().chain(&arguments.env))?;
    }
    if arguments.part.is_none() {
        arguments.picture.say_unused(&arguments.outputs);
    }
    if arguments.light_groups && !arguments.outputs.iter().any(|path| holds_layers(path)) {
        notice("--light-groups adds nothing: only .exr pictures have layers");
    }
    Ok(())
}

/// All that is to be written, frames without their numbers.
fn files(arguments: &RenderArguments) -> impl Iterator<Item = &PathBuf> {
    let RenderArguments { outputs, json, distributions, checkpoint, .. } = arguments;
    outputs.iter().chain(json).chain(distributions).chain(checkpoint)
}

/// Files that are there already and would be written over, each frame's among them.
pub(super) fn overwritten(arguments: &RenderArguments) -> Vec<PathBuf> {
    let numbers = arguments.frames.clone().or(arguments.turntable.map(|count| 0..=count - 1));
    let of_frames = |path: &PathBuf| match &numbers {
        Some(numbers) => {
            let name = |number| frames::numbered(path, number);
            numbers.clone().map(name).filter(|path| path.exists()).collect()
        }
        None => vec![path.clone()],
    };
    files(arguments).flat_map(of_frames).collect()
}

/// Why there is nothing to be written as distributions: of a black map, or where none is sampled.
pub(super) fn without_distributions(path: &Path) -> Error {
    Error::at(path, "not written: this map and sampling have no distributions")
}

/// Writes all that was asked for: one that cannot be written must not take the others with it. Returns what
/// failed.
pub(super) fn write(
    arguments: &RenderArguments,
    assignment: &RenderJob,
    driver: &Driver<'_>,
    record: &Record<'_>,
    films: Films<'_>,
) -> Vec<Error> {
    let metadata = record.metadata();
    let of_pictures = || arguments.picture.denoised(&arguments.pictures(), films);
    let denoised = arguments.part.is_none().then(of_pictures).flatten();
    let films = Films { denoised: denoised.as_ref(), ..films };
    let write = |path: &PathBuf| match arguments.part {
        Some(_) => assignment.write_part(path, driver, record),
        None => arguments.picture.write(path, films, &metadata),
    };
    let write_and_say = |path: &PathBuf| write(path).map(|()| say_written(path)).err();
    let mut failures: Vec<Error> = arguments.outputs.iter().filter_map(write_and_say).collect();
    failures.extend(arguments.frame_of_video.as_ref().and_then(|path| write(path).err()));
    if let Some(path) = &arguments.json {
        let written = record::write_json(path, &record.to_json());
        failures.extend(written.map(|()| say_written(path)).err());
    }
    if let Some(path) = &arguments.distributions {
        let none = || without_distributions(path);
        let written =
            driver.session.grid().ok_or_else(none).and_then(|grid| write_distributions(path, grid));
        failures.extend(written.map(|()| say_written(path)).err());
    }
    failures
}

/// Settings that belong into metadata and JSON, as typed or as chosen.
pub(super) fn settings(
    arguments: &RenderArguments,
    world: &World,
    view: &View,
) -> Vec<(&'static str, serde_json::Value)> {
    let mut settings = record::settings_of(view, world);
    settings.extend([
        ("table", serde_json::json!(arguments.table.to_string())),
        ("tiles", serde_json::json!(format!("{}x{}", arguments.tiles.0, arguments.tiles.1))),
        ("env_rotation_degrees", serde_json::json!(arguments.env_rotation)),
        ("env_intensity", serde_json::json!(arguments.env_intensity)),
        ("env_sun", serde_json::json!(arguments.env_sun)),
        ("lamps", serde_json::json!(arguments.of_scene.options().lamps)),
        ("lamp_edits", serde_json::json!(arguments.of_scene.lamp_edits())),
        ("materials", serde_json::json!(arguments.of_scene.edits())),
    ]);
    settings
}
