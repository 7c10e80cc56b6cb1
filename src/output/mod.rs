//! What a render leaves behind: pictures, their layers, and what is to be said about them.

use std::path::Path;

pub mod distributions;
pub mod film_file;
pub mod record;

use crate::color::luminance;
use crate::denoise::Denoiser;
use crate::environment::Environment;
use crate::error::{Error, Result};
use crate::image::{ExrPicture, Image, Layer, extension, write_exr, write_png};
use crate::render::film::{Film, Pixel};
pub use crate::render::light_groups::GroupImage;
use crate::tone::{Grade, Tone, WhiteBalance, auto_exposure_ev, display_rgb8};

/// A layer that can be asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LayerName {
    /// Mean albedo of the first surface.
    Albedo,
    /// World normal of the first surface.
    Normal,
    /// Metres to the first surface.
    Depth,
    /// Samples per pixel.
    Samples,
    /// Variance of one sample's luminance.
    Variance,
    /// All of the above.
    All,
    /// Linear radiance without noise.
    Denoised,
}

/// What the RGB channels of linear pictures hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LinearRgb {
    /// What was rendered.
    #[default]
    Rendered,
    /// It without noise; what was rendered is a layer.
    Denoised,
}

/// Exposure of 8-bit pictures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Exposure {
    /// Stops.
    Stops(f32),
    /// What brings the picture to middle grey.
    Auto,
}

impl Exposure {
    /// In stops, of what a film is shown as; a film without light is left as dark as it is.
    pub(crate) fn of(self, film: &Film, shown: &Image) -> f32 {
        match self {
            Self::Stops(stops) => stops,
            // A filter spreads the little that there is.
            Self::Auto if film.is_dark() => 0.0,
            Self::Auto => auto_exposure_ev(shown),
        }
    }
}

/// A film, and one of the same view and size by cached light: what each of its samples counts beside one of the film's
/// own in what is denoised.
#[derive(Debug, Clone, Copy)]
pub struct Films<'a> {
    /// What was rendered.
    pub film: &'a Film,
    /// What helps to denoise it.
    pub cached: Option<(&'a Film, f32)>,
    /// The picture without noise, where that was made for several files.
    pub denoised: Option<&'a Image>,
    /// What each group of light makes of it, if it was rendered so; they add up to the film.
    pub groups: &'a [GroupImage],
}

impl<'a> From<&'a Film> for Films<'a> {
    fn from(film: &'a Film) -> Self {
        Self { film, cached: None, denoised: None, groups: &[] }
    }
}

with_defaults! {
    /// How a picture is written: by default as `lightgrid render` does where nothing else is asked for.
    #[derive(Debug, Clone, PartialEq)]
    pub struct PictureOptions {
        /// Exposure of `.png` pictures.
        pub exposure: Exposure = Exposure::Auto,
        /// Tone curve and look of `.png` pictures.
        pub tone: Tone = Tone::default(),
        /// What takes the noise out of `.png` pictures, of [`LayerName::Denoised`] and of [`LinearRgb::Denoised`].
        pub denoiser: Option<Denoiser> = None,
        /// RGB of `.exr` pictures.
        pub rgb: LinearRgb = LinearRgb::default(),
        /// White balance of `.png` pictures.
        pub white_balance: WhiteBalance = WhiteBalance::default(),
        /// Extra layers of `.exr` pictures.
        pub layers: Vec<LayerName> = Vec::new(),
    }
}

/// Refuses pictures that are neither `.png` nor `.exr`.
///
/// # Errors
/// One sentence that names the file.
pub fn check_extension(path: &Path) -> Result<()> {
    match extension(path).as_deref() {
        Some("png" | "exr") => Ok(()),
        _ => Err(Error::at(path, "pictures are written as .png or .exr")),
    }
}

/// Whether a picture's file has room for layers: OpenEXR's has.
pub fn holds_layers(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("exr"))
}

/// Whether a picture's file is made to be looked at, on a display: PNG is.
pub fn is_for_display(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png"))
}

/// What a person should know about a finished picture.
pub fn remarks(film: &Film, environment: &Environment) -> Vec<String> {
    let mut remarks = Vec::new();
    if film.invalid_samples() > 0 {
        remarks
            .push(format!("{} samples were not finite and were left out", film.invalid_samples()));
    }
    let coverage = film.coverage();
    if coverage < 1.0 {
        remarks.push(format!(
            "it ended when {:.0} % of the pixels had a sample: the others show the mean of those around them",
            100.0 * coverage
        ));
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

/// Writes the film as `.exr` (linear, with layers) or `.png` (8 bits), told by the extension, with
/// key and value pairs such as [`Record::metadata`](record::Record::metadata).
///
/// # Errors
/// If the file is of another kind or cannot be written.
pub fn write_picture(
    path: &Path,
    options: &PictureOptions,
    films: Films<'_>,
    mut metadata: Vec<(String, String)>,
) -> Result<()> {
    check_extension(path)?;
    let film = films.film;
    if holds_layers(path) {
        let whole = film.without_gaps();
        let (mut image, mut layers) = (whole.image(), layers(film, &whole, &options.layers));
        layers.extend(films.groups.iter().map(|GroupImage { name, factor, image }| {
            let pixels: Vec<_> = image.pixels.iter().map(|rgb| rgb.map(|x| x * factor)).collect();
            Layer { name: name.clone(), channels: split(&pixels, ["R", "G", "B"]) }
        }));
        let is_rgb = options.rgb == LinearRgb::Denoised;
        if (is_rgb || options.layers.contains(&LayerName::Denoised)) && options.denoiser.is_some() {
            metadata.extend(filter_metadata(options, films));
            let denoised = shown(options, films)?;
            let (name, layer) = match is_rgb {
                true => ("rendered", std::mem::replace(&mut image, denoised)),
                false => ("denoised", denoised),
            };
            let channels = split(&layer.pixels, ["R", "G", "B"]);
            layers.push(Layer { name: name.to_owned(), channels });
        }
        if let Some(alpha) = alpha_of(&whole, &metadata) {
            // OpenEXR's colours are multiplied by it, as are those of a film.
            layers.push(Layer { name: String::new(), channels: vec![("A".to_owned(), alpha)] });
        }
        let picture = ExrPicture { image: &image, layers, metadata: &metadata, preview: None };
        return write_exr(path, picture);
    }
    let mut image = balanced(options, films)?;
    let stops = options.exposure.of(film, &image);
    metadata.push(("lightgrid.exposure_ev".to_owned(), format!("{stops:.3}")));
    if options.white_balance != WhiteBalance::default() {
        let WhiteBalance { kelvin, tint } = options.white_balance;
        metadata.push(("lightgrid.white_balance".to_owned(), format!("{kelvin},{tint}")));
    }
    metadata.extend(filter_metadata(options, films));
    metadata.push(("lightgrid.tonemap".to_owned(), options.tone.curve.to_string()));
    if let Some(Grade { lut, strength }) = &options.tone.grade {
        metadata.push(("lightgrid.look".to_owned(), format!("{},{strength}", lut.name())));
    }
    let alpha = alpha_of(&film.without_gaps(), &metadata).unwrap_or_default();
    // What surfaces show in pixels that they cover in part.
    for (pixel, alpha) in image.pixels.iter_mut().zip(&alpha).filter(|(_, alpha)| **alpha > 0.0) {
        *pixel = pixel.map(|radiance| radiance / alpha);
    }
    let levels = display_rgb8(&image, stops, options.tone.clone());
    drop(image);
    let alpha: Vec<u8> = alpha.iter().map(|share| (255.0 * share).round() as u8).collect();
    write_png(path, &levels, (!alpha.is_empty()).then_some(&alpha[..]), &metadata)
}

/// What takes the noise out, and what helps.
fn filter_metadata(options: &PictureOptions, films: Films<'_>) -> Vec<(String, String)> {
    let Some(filter) = options.denoiser else { return Vec::new() };
    let cached = films.cached.map(|(cached, _)| {
        ("lightgrid.cached_samples_per_pixel".to_owned(), cached.min_samples().to_string())
    });
    let filter = ("lightgrid.denoiser".to_owned(), filter.name().to_owned());
    std::iter::once(filter).chain(cached).collect()
}

/// The exposure of a film's picture, for that of others, too.
///
/// # Errors
/// If its noise cannot be taken out.
pub fn exposure_of(options: &PictureOptions, film: &Film) -> Result<Exposure> {
    let Exposure::Auto = options.exposure else { return Ok(options.exposure) };
    balanced(options, film.into()).map(|image| Exposure::Stops(Exposure::Auto.of(film, &image)))
}

/// The film's picture under the light that looks white, without noise if that is asked for.
fn balanced(options: &PictureOptions, films: Films<'_>) -> Result<Image> {
    shown(options, films).map(|image| options.white_balance.apply(image))
}

/// The film's picture, without noise if that is asked for.
fn shown(options: &PictureOptions, films: Films<'_>) -> Result<Image> {
    match (options.denoiser, films.denoised) {
        (Some(_), Some(image)) => Ok(image.clone()),
        (Some(filter), None) => filter.finish(films.film, films.cached),
        (None, _) => Ok(films.film.without_gaps().image()),
    }
}

/// The alpha channel of a picture that has nothing behind its surfaces, as its metadata says, if it has layers.
fn alpha_of(whole: &Film, metadata: &[(String, String)]) -> Option<Vec<f32>> {
    let is_transparent =
        metadata.iter().any(|(key, value)| key == "lightgrid.background" && value == "none");
    is_transparent.then(|| whole.alpha())?
}

/// What surfaces look like is that of the film without gaps.
fn layers(film: &Film, whole: &Film, names: &[LayerName]) -> Vec<Layer> {
    let wanted = |name| names.contains(&name) || names.contains(&LayerName::All);
    let mut layers = Vec::new();
    let mut add = |name: &str, channels: Vec<(String, Vec<f32>)>| {
        layers.push(Layer { name: name.to_owned(), channels });
    };
    if let Some(surface) = whole.surface_layers() {
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
    let values = |channel: usize| pixels.iter().map(|pixel| pixel[channel]).collect();
    names.into_iter().zip(0..).map(|(name, i)| (name.to_owned(), values(i))).collect()
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::path::PathResult;

    #[test]
    fn a_film_of_chance_light_is_shown_as_dark_as_it_is() {
        let of_samples = |lit: u32, samples: u32| {
            let mut film = Film::new(100, 100, false);
            let places = (0..100).flat_map(|y| (0..100).map(move |x| (y, x)));
            for ((y, x), sample) in places.flat_map(|at| (0..4).map(move |sample| (at, sample))) {
                let is_lit = 100 * y + x < lit && sample < samples;
                let radiance = Vec3::splat(if is_lit { 1e-6 } else { 0.0 });
                film.add(x, y, &PathResult { radiance, ..PathResult::default() });
            }
            // A filter makes much of little.
            Exposure::Auto.of(&film, &Image::filled(100, 100, [1e-6; 3]))
        };
        let of = |lit| of_samples(lit, 1);
        assert_eq!([of(0), of(9)], [0.0; 2]);
        assert!(of(10) > 17.0 && of(10000) > 17.0);
        assert!(of_samples(9, 4) > 17.0, "a small lamp is no chance");
        let film = Film::new(2, 2, false);
        assert_eq!(Exposure::Stops(3.0).of(&film, &film.image()), 3.0);
    }
}
