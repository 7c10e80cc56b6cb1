//! What a render leaves behind: pictures, their layers, and what is to be said about them.

use std::path::{Path, PathBuf};

use super::record::Record;
use super::render::RenderArguments;
use super::values;
use crate::color::luminance;
use crate::environment::Environment;
use crate::error::{Error, Result};
use crate::image::{ExrPicture, Layer, check_writable, is_same_file, write_exr, write_png};
use crate::render::film::{Film, Pixel};
use crate::tone::{auto_exposure_ev, display_rgb8};

/// A layer that can be asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum LayerName {
    Albedo,
    Normal,
    Depth,
    Samples,
    Variance,
    All,
}

/// Exposure as typed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Exposure {
    Stops(f32),
    Auto,
}

pub(super) fn parse_exposure(text: &str) -> std::result::Result<Exposure, String> {
    if text == "auto" {
        return Ok(Exposure::Auto);
    }
    values::finite(text)
        .map(|stops| Exposure::Stops(stops as f32))
        .map_err(|e| format!("{e} of stops, or auto"))
}

/// Refuses outputs before the work rather than after it.
pub(super) fn check_outputs(arguments: &RenderArguments) -> Result<()> {
    for picture in &arguments.outputs {
        let extension = picture.extension().map(|e| e.to_string_lossy().to_lowercase());
        if !matches!(extension.as_deref(), Some("png" | "exr")) {
            return Err(Error::at(picture, "pictures are written as .png or .exr"));
        }
    }
    let files: Vec<&PathBuf> = arguments.outputs.iter().chain(&arguments.json).collect();
    for (i, file) in files.iter().enumerate() {
        if files[..i].iter().any(|other| is_same_file(other, file)) {
            return Err(Error::at(file, "two outputs would be written to this one file"));
        }
        check_writable(file)?;
    }
    Ok(())
}

/// What a person should know about a finished picture.
pub(super) fn remarks(film: &Film, environment: &Environment) -> Vec<String> {
    let mut remarks = Vec::new();
    if film.invalid_samples() > 0 {
        remarks
            .push(format!("{} samples were not finite and were left out", film.invalid_samples()));
    }
    let mean =
        film.pixels().iter().map(Pixel::mean_luminance).sum::<f64>() / film.pixels().len() as f64;
    if mean <= BLACK_SHARE * f64::from(luminance(environment.mean_radiance())) {
        remarks.push("the picture is black: hardly any light reaches what the camera sees".into());
    }
    remarks
}

/// Share of the map's mean luminance below which a picture is called black: between the gaps of
/// sealed rooms as they are modelled (1e-9 to 1e-6) and what comes through a crack.
const BLACK_SHARE: f64 = 2e-6;

pub(super) fn write_picture(
    path: &Path,
    arguments: &RenderArguments,
    record: &Record<'_>,
) -> Result<()> {
    let film = record.session.film();
    let image = film.image();
    let mut metadata = record.metadata();
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
        let layers = layers(film, &arguments.layers);
        return write_exr(path, ExrPicture { image: &image, layers, metadata: &metadata });
    }
    let stops = match arguments.exposure {
        Exposure::Stops(stops) => stops,
        Exposure::Auto => auto_exposure_ev(&image),
    };
    metadata.push(("lightgrid.exposure_ev".to_owned(), format!("{stops:.3}")));
    metadata.push(("lightgrid.tonemap".to_owned(), arguments.tonemap.name().to_owned()));
    write_png(path, &display_rgb8(&image, stops, arguments.tonemap), &metadata)
}

fn layers(film: &Film, names: &[LayerName]) -> Vec<Layer> {
    let wanted = |name| names.contains(&name) || names.contains(&LayerName::All);
    let mut layers = Vec::new();
    let mut add = |name: &str, channels: Vec<(String, Vec<f32>)>| {
        layers.push(Layer { name: name.to_owned(), channels });
    };
    if let Some(surface) = film.surface_layers() {
        if wanted(LayerName::Albedo) {
            add("albedo", split(&surface.albedo, ["R", "G", "B"]));
        }
        if wanted(LayerName::Normal) {
            add("normal", split(&surface.normal, ["X", "Y", "Z"]));
        }
        if wanted(LayerName::Depth) {
            add("depth", vec![("Z".to_owned(), surface.depth)]);
        }
    }
    let of_pixels = |f: fn(&Pixel) -> f64| film.pixels().iter().map(|p| f(p) as f32).collect();
    if wanted(LayerName::Samples) {
        add("samples", vec![("N".to_owned(), of_pixels(|p| f64::from(p.samples())))]);
    }
    if wanted(LayerName::Variance) {
        let per_sample = |p: &Pixel| match p.samples() {
            0 | 1 => 0.0,
            n => p.variance_of_mean() * f64::from(n),
        };
        add("variance", vec![("Y".to_owned(), of_pixels(per_sample))]);
    }
    layers
}

fn split(pixels: &[[f32; 3]], names: [&str; 3]) -> Vec<(String, Vec<f32>)> {
    names
        .into_iter()
        .enumerate()
        .map(|(i, name)| (name.to_owned(), pixels.iter().map(|p| p[i]).collect()))
        .collect()
}
