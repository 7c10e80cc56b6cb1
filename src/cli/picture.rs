//! How a picture is made of a film and written, wherever the film comes from.

use std::path::{Path, PathBuf};

use super::values;
use crate::denoise::Denoiser;
use crate::error::{Error, Result};
use crate::image::{Image, check_writable, is_same_file, name_of_process};
use crate::output::{self, Exposure, Films, LayerName, LinearRgb, PictureOptions};
use crate::render::film::Film;
use crate::terminal::{notice, tell};
use crate::tone::{Grade, KELVIN, Lut, TINT, Tone, ToneCurve, WhiteBalance};

/// How pictures are written.
#[derive(Debug, Clone, clap::Args)]
pub(super) struct PictureArguments {
    /// Exposure of .png pictures in stops, or `auto`.
    #[arg(long, default_value = "auto", value_parser = parse_exposure, allow_hyphen_values = true, value_name = "EV|auto", help_heading = "Picture")]
    pub(super) exposure: Exposure,
    /// Tone curve of .png pictures.
    #[arg(long, default_value = "agx", value_name = "CURVE", help_heading = "Picture")]
    tonemap: ToneCurve,
    /// Look over .png pictures: a .cube file over sRGB colours, or look:punchy, soft, warm, cool, night,
    /// black-and-white.
    #[arg(long, value_parser = Lut::read, value_name = "FILE|look:NAME", help_heading = "Picture")]
    look: Option<Lut>,
    /// Share of the look, from 0 to 1.
    #[arg(long, default_value_t = 1.0, requires = "look", value_parser = parse_strength, value_name = "SHARE", help_heading = "Picture")]
    look_strength: f32,
    /// What takes noise out of .png pictures and videos; unless it is given, the best there is.
    #[arg(long, value_name = "FILTER", num_args = 0..=1, default_missing_value = "best", help_heading = "Picture")]
    denoise: Option<Denoise>,
    /// The light that looks white in .png pictures: kelvin, and a tint from -1 (green) to 1.
    #[arg(long, value_parser = parse_white, allow_hyphen_values = true, value_name = "K[,TINT]", help_heading = "Picture")]
    white: Option<WhiteBalance>,
    /// What RGB of .exr pictures holds: what was rendered, or linear radiance without noise, with a layer of what was
    /// rendered.
    #[arg(long, default_value = "rendered", value_name = "RGB", help_heading = "Picture")]
    rgb: LinearRgb,
    /// Extra layers in .exr pictures: albedo, normal, depth, samples, variance, all of these, or
    /// denoised: linear radiance without noise.
    #[arg(long, value_delimiter = ',', value_name = "LAYER", help_heading = "Picture")]
    layers: Vec<LayerName>,
}

/// What `--denoise` asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Denoise {
    /// Open Image Denoise where its library is installed, else our own filter.
    Best,
    /// Our edge-avoiding filter over albedo, normal and depth: fast, always there.
    ATrous,
    /// Intel's Open Image Denoise, or an error.
    Oidn,
    /// Nothing: pictures show their noise, and neighbours may share vertices.
    Off,
}

/// Stops, or `auto`.
pub(super) fn parse_exposure(text: &str) -> std::result::Result<Exposure, String> {
    if text == "auto" {
        return Ok(Exposure::Auto);
    }
    let stops = values::finite(text).map_err(|e| format!("{e} of stops, or auto"))?;
    Ok(Exposure::Stops(stops as f32))
}

fn parse_strength(text: &str) -> std::result::Result<f32, String> {
    let strength = values::not_negative(text)?;
    if strength <= 1.0 { Ok(strength) } else { Err("expected a share from 0 to 1".to_owned()) }
}

fn parse_white(text: &str) -> std::result::Result<WhiteBalance, String> {
    let (kelvin, tint) = text.split_once(',').unwrap_or((text, "0"));
    let (kelvin, tint) = (values::finite(kelvin)? as f32, values::finite(tint)? as f32);
    if !(KELVIN.contains(&kelvin) && TINT.contains(&tint)) {
        let [(least, most), (green, magenta)] =
            [KELVIN, TINT].map(|range| (*range.start(), *range.end()));
        return Err(format!(
            "expected {least} to {most} kelvin and a tint from {green} to {magenta}"
        ));
    }
    Ok(WhiteBalance { kelvin, tint })
}

impl PictureArguments {
    /// Refuses names no picture is written by, and denoisers that are not there.
    pub(super) fn check<'a>(&self, pictures: impl IntoIterator<Item = &'a PathBuf>) -> Result<()> {
        pictures.into_iter().try_for_each(|path| output::check_extension(path))?;
        if self.denoise == Some(Denoise::Off) && self.denoises_linear() {
            let option = if self.rgb == LinearRgb::Denoised { "--rgb" } else { "--layers" };
            let cause = format!("{option} denoised wants a denoiser: it cannot be --denoise off");
            return Err(Error::new(cause));
        }
        if self.denoise == Some(Denoise::Oidn) { Denoiser::Oidn.check() } else { Ok(()) }
    }

    /// What takes noise out, where something does.
    fn denoiser(&self) -> Option<Denoiser> {
        match self.denoise {
            None | Some(Denoise::Best) => Some(Denoiser::Best),
            Some(Denoise::ATrous) => Some(Denoiser::ATrous),
            Some(Denoise::Oidn) => Some(Denoiser::Oidn),
            Some(Denoise::Off) => None,
        }
    }

    /// Whether a filter was asked for by name.
    fn asks_for_denoiser(&self) -> bool {
        self.denoise.is_some_and(|denoise| denoise != Denoise::Off)
    }

    fn denoises_linear(&self) -> bool {
        self.rgb == LinearRgb::Denoised || self.layers.contains(&LayerName::Denoised)
    }

    /// Whether one of these pictures shows what was rendered as it is.
    pub(super) fn shows_rendered(&self, pictures: &[PathBuf]) -> bool {
        self.rgb == LinearRgb::Rendered && pictures.iter().any(|path| output::holds_layers(path))
    }

    /// Says what was asked for that none of these pictures holds, and which denoiser was found.
    pub(super) fn say_unused(&self, pictures: &[PathBuf]) {
        let has_linear = pictures.iter().any(|path| output::holds_layers(path));
        if !self.layers.is_empty() && !has_linear {
            notice("--layers adds nothing: they are written into .exr pictures alone");
        }
        if self.rgb != LinearRgb::default() && !has_linear {
            notice("--rgb changes nothing: it is about .exr pictures alone");
        }
        if self.asks_for_denoiser() && !self.is_denoised(pictures) {
            notice("--denoise changes nothing: .exr pictures hold what was rendered");
        }
        let is_found = self.denoise != Some(Denoise::Oidn)
            && self.is_denoised(pictures)
            && self.denoiser().map(Denoiser::found) == Some(Denoiser::Oidn);
        if is_found {
            notice("Open Image Denoise takes out the noise (--denoise off keeps it)");
        }
        let is_developed = (self.exposure, self.tonemap) != (Exposure::Auto, ToneCurve::default())
            || self.white.is_some()
            || self.look.is_some();
        if is_developed && pictures.iter().all(|path| output::holds_layers(path)) {
            notice(
                "--exposure, --tonemap, --look and --white change nothing: .exr pictures hold what was rendered",
            );
        }
    }

    /// Whether noise is to be taken out of one of these pictures or, if a filter was asked for, of those
    /// that are made of a part.
    pub(super) fn is_denoised(&self, pictures: &[PathBuf]) -> bool {
        pictures.iter().any(|path| match self.denoise {
            Some(Denoise::Off) => false,
            _ if output::holds_layers(path) => self.denoises_linear(),
            Some(_) => true,
            None => output::is_for_display(path),
        })
    }

    /// Whether albedo, normal and depth are wanted for these pictures.
    pub(super) fn wants_surfaces(&self, pictures: &[PathBuf]) -> bool {
        self.is_denoised(pictures) || self.asks_for_surface_layers()
    }

    /// Whether parts that lack albedo, normal and depth cannot make what was asked for.
    pub(super) fn asks_for_surfaces(&self, pictures: &[PathBuf]) -> bool {
        (self.asks_for_denoiser() && self.is_denoised(pictures)) || self.asks_for_surface_layers()
    }

    fn asks_for_surface_layers(&self) -> bool {
        let is_surface = |l: &LayerName| !matches!(l, LayerName::Samples | LayerName::Variance);
        self.layers.iter().any(is_surface)
    }

    /// Takes the exposure of a film's picture, to be that of others, too; where noise cannot be taken out, there
    /// is no picture that has one, as there is none where all hold what was rendered.
    pub(super) fn take_exposure(&mut self, film: &Film, pictures: &[PathBuf]) {
        if !pictures.iter().all(|path| output::holds_layers(path)) {
            self.exposure = output::exposure_of(&self.options(film), film).unwrap_or(self.exposure);
        }
    }

    /// Without layers a film is denoised only if that was asked for, which then fails with a sentence.
    fn options(&self, film: &Film) -> PictureOptions {
        let strength = self.look_strength;
        let grade = self.look.clone().map(|lut| Grade { lut, strength });
        PictureOptions {
            exposure: self.exposure,
            tone: Tone { curve: self.tonemap, grade },
            denoiser: self.denoiser().filter(|_| film.has_layers() || self.asks_for_denoiser()),
            rgb: self.rgb,
            white_balance: self.white.unwrap_or_default(),
            layers: self.layers.clone(),
        }
    }

    /// The picture without noise, where several of these pictures show it: it is filtered once.
    pub(super) fn denoised(&self, pictures: &[PathBuf], films: Films<'_>) -> Option<Image> {
        let showing = pictures.chunks(1).filter(|picture| self.is_denoised(picture)).count();
        let filter = self.options(films.film).denoiser.filter(|_| showing > 1)?;
        // Where it fails, each picture that is not written says why.
        filter.finish(films.film, films.cached).ok()
    }

    /// Writes a picture where it was asked to be or, if that fails, into the temporary folder.
    pub(super) fn write(
        &self,
        path: &Path,
        films: Films<'_>,
        metadata: &[(String, String)],
    ) -> Result<()> {
        let options = self.options(films.film);
        let Err(failure) = output::write_picture(path, &options, films, metadata.to_vec()) else {
            return Ok(());
        };
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let rescued = std::env::temp_dir().join(format!("lightgrid-{}-{name}", name_of_process()));
        Err(match output::write_picture(&rescued, &options, films, metadata.to_vec()) {
            Ok(()) => {
                Error::new(format!("{failure}; the picture is kept as {}", rescued.display()))
            }
            Err(second) => Error::new(format!("{failure}; nor can the picture be kept: {second}")),
        })
    }
}

/// Refuses to write over what is `read`, the names of scenes and maps, and where no file can be written.
pub(super) fn check_output<'a>(
    output: &Path,
    read: impl IntoIterator<Item = &'a String>,
) -> Result<()> {
    match read.into_iter().any(|other| is_same_file(Path::new(other), output)) {
        true => Err(Error::at(output, "would be written over the scene or the map")),
        false => check_writable(output),
    }
}

/// Says that a file is there.
pub(super) fn say_written(path: &Path) {
    tell(format_args!("wrote {}", path.display()));
}
