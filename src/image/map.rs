//! Environment maps and pictures from files of any format we read.

use std::fs::File;
use std::io::{Cursor, Read};
use std::path::Path;

use image::ImageDecoder as _;
use rayon::prelude::*;

use super::exr_read::read_exr;
use super::file::{extension, open_file, read_cause, read_file};
use super::guard::{guarded, limits};
use super::hdr::decode_hdr;
use super::ldr::decoder_cause;
use super::picture::FilePicture;
use super::{Image, MAX_PIXELS, MAX_SIDE, check_size, tiff};
use crate::color::linear_from_srgb;
use crate::error::{At as _, Decoded, Error, Notices, Result};
use crate::memory;

/// An environment map: finite, non-negative radiance, and what had to be done to get it.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadedMap {
    /// The latitude-longitude picture.
    pub image: Image,
    /// What was repaired, skipped or assumed.
    pub notices: Notices,
}

/// Reads a latitude-longitude environment map: OpenEXR, Radiance HDR, or an 8/16-bit picture (PNG,
/// JPEG, WebP, TIFF, BMP, TGA). The format is told by the content, then by the extension.
///
/// Pixels are linear Rec.709, finite and `>= 0` (see [`sanitise`]).
///
/// # Errors
/// One sentence: the file is missing, damaged, of a kind that is not read, too large, or an OpenEXR
/// cube map.
pub fn read_map(path: &Path) -> Result<LoadedMap> {
    let FilePicture { mut image, mut notices, is_cube_map, .. } = read(path)?;
    if is_cube_map {
        return Err(Error::at(path, "is a cube map, lightgrid reads lat-long maps"));
    }
    notices.extend(&sanitise(&mut image));
    if image.width != 2 * image.height {
        notices.add(format!(
            "the map is {} x {} pixels, not twice as wide as high; it is stretched over the sphere",
            image.width, image.height
        ));
    }
    Ok(LoadedMap { image, notices })
}

/// Reads a picture as it is: no pixel is repaired. Formats as in [`read_map`].
///
/// # Errors
/// As [`read_map`].
pub fn read_picture(path: &Path) -> Result<Image> {
    read_with_linearity(path).map(|(image, _)| image)
}

/// As [`read_picture`], and whether the file holds linear values rather than what was made of them for a
/// display.
///
/// # Errors
/// As [`read_map`].
pub fn read_with_linearity(path: &Path) -> Result<(Image, bool)> {
    read(path).map(|picture| (picture.image, picture.is_linear))
}

/// Whether these are the first bytes of a glTF scene.
pub(crate) fn looks_like_scene(bytes: &[u8]) -> bool {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    bytes.starts_with(b"glTF") || text.trim_ascii_start().starts_with(b"{")
}

/// How a film in a file begins: a part of a picture, or a checkpoint.
const FILM: &[u8] = b"{\"lightgrid_film\"";

/// What is said of one where something else is expected.
pub(crate) const IS_A_FILM: &str =
    "is a part of a picture, or a checkpoint, of which `lightgrid merge` makes a picture";

/// Whether these are the first bytes of a film in a file.
pub(crate) fn looks_like_film(bytes: &[u8]) -> bool {
    bytes.starts_with(FILM)
}

/// Whether a file begins as a film does.
pub(crate) fn is_film(path: &Path) -> bool {
    let mut start = [0; FILM.len()];
    let read = |(mut file, _): (File, u64)| file.read_exact(&mut start).is_ok();
    open_file(path).is_ok_and(read) && looks_like_film(&start)
}

/// Whether these are the first bytes of a picture.
pub(crate) fn looks_like_picture(bytes: &[u8]) -> bool {
    bytes.starts_with(b"#?") || image::guess_format(bytes).is_ok()
}

/// Above it, what other programs write becomes infinite.
const MAX_HALF: f32 = 65_504.0;

/// Makes a map usable as a light: NaN and negative values become 0, infinite ones the largest finite
/// value of the map, or of half floats if it has none above 0. One notice says how many pixels were changed.
pub fn sanitise(image: &mut Image) -> Notices {
    const CHUNK: usize = 1 << 14;
    let defects =
        image.pixels.par_chunks(CHUNK).map(Defects::of).reduce(Defects::default, Defects::and);
    let mut notices = Notices::default();
    let (largest, largest_is) = match defects.largest {
        0.0 => (MAX_HALF, "infinite (now 65504)"),
        largest => (largest, "infinite (now the largest finite value)"),
    };
    let kinds = ["NaN (now 0)", largest_is, "negative (now 0)"];
    let found = defects.pixels.iter().zip(kinds).filter(|(count, _)| **count > 0);
    let found: Vec<String> = found.map(|(count, kind)| format!("{count} {kind}")).collect();
    if !found.is_empty() {
        image.pixels.par_chunks_mut(CHUNK).for_each(|pixels| {
            for v in pixels.as_flattened_mut() {
                *v = if *v == f32::INFINITY { largest } else { v.max(0.0) };
            }
        });
        notices.add(format!("pixels of the map were repaired: {}", found.join(", ")));
    }
    notices
}

/// How many pixels have a channel that is no radiance, and the largest finite value of all.
#[derive(Default, Clone, Copy)]
struct Defects {
    /// With a channel that is NaN, infinite, or negative.
    pixels: [usize; 3],
    largest: f32,
}

impl Defects {
    fn of(pixels: &[[f32; 3]]) -> Self {
        let values = pixels.as_flattened();
        // No short-circuit: this is all that runs for a sound map, and it can be vectorised.
        let sound = values.iter().fold(true, |sound, v| sound & (*v >= 0.0 && v.is_finite()));
        if sound {
            return Self { largest: values.iter().copied().fold(0.0, f32::max), ..Self::default() };
        }
        let tests: [fn(f32) -> bool; 3] = [f32::is_nan, |v| v == f32::INFINITY, |v| v < 0.0];
        let count = |test: fn(f32) -> bool| {
            pixels.iter().filter(|rgb| rgb.iter().any(|&v| test(v))).count()
        };
        let largest = values.iter().copied().filter(|v| v.is_finite()).fold(0.0, f32::max);
        Self { pixels: tests.map(count), largest }
    }

    fn and(self, other: Self) -> Self {
        let pixels = std::array::from_fn(|i| self.pixels[i] + other.pixels[i]);
        Self { pixels, largest: self.largest.max(other.largest) }
    }
}

/// Formats that are read.
const KNOWN: &str = "EXR, HDR, PNG, JPEG, WebP, TIFF, BMP, TGA";

/// Reads by the format that the first bytes tell, else the extension.
fn read(path: &Path) -> Result<FilePicture> {
    /// No format takes more bytes to be told.
    const START: u64 = 16;
    let (file, _) = open_file(path).at(path)?;
    let mut start = Vec::new();
    file.take(START).read_to_end(&mut start).map_err(|e| Error::at(path, read_cause(&e)))?;
    if is_film(path) {
        return Err(Error::at(path, IS_A_FILM));
    }
    if looks_like_scene(&start) {
        return Err(Error::at(path, "is a glTF scene, where a map or a picture is expected"));
    }
    match (image::guess_format(&start).ok(), extension(path).as_deref()) {
        (Some(image::ImageFormat::OpenExr), _) => read_exr(path),
        _ if start.starts_with(b"#?") => read_hdr(path),
        (Some(other), _) if !other.reading_enabled() => {
            let name = format!("{other:?}").to_uppercase();
            Err(Error::at(path, format!("is of the format {name}, not one of {KNOWN}")))
        }
        (None, Some("exr")) => read_exr(path),
        (None, Some("hdr" | "rgbe" | "pic" | "xyze")) => read_hdr(path),
        _ => read_developed(path),
    }
}

fn read_hdr(path: &Path) -> Result<FilePicture> {
    read_file(path).and_then(|bytes| decode_hdr(&bytes)).at(path)
}

/// Reads an sRGB-encoded picture, or a float TIFF as it is.
fn read_developed(path: &Path) -> Result<FilePicture> {
    let decoded = guarded(|| decode_ldr_file(path)).at(path)?;
    let mut notices = Notices::default();
    let (width, height) = (decoded.width(), decoded.height());
    let bits = 8 * (decoded.color().bytes_per_pixel() / decoded.color().channel_count());
    let pixels = if bits == 8 {
        let linear: Vec<f32> = (0..256).map(|v| linear_from_srgb(v as f32 / 255.0)).collect();
        decoded.into_rgb8().pixels().map(|p| p.0.map(|v| linear[v as usize])).collect()
    } else {
        let transfer = if bits == 16 { linear_from_srgb } else { |v| v };
        decoded.into_rgb32f().pixels().map(|p| p.0.map(transfer)).collect()
    };
    if bits < 32 {
        notices.add(format!("the map is {bits}-bit sRGB: it holds no lights brighter than white"));
    }
    let image = Image { width, height, pixels };
    Ok(FilePicture { image, notices, is_linear: bits == 32, is_cube_map: false })
}

/// Most that a pixel takes: four floats.
const BYTES_PER_PIXEL: u64 = 16;

fn decode_ldr_file(path: &Path) -> Decoded<image::DynamicImage> {
    let bytes = read_file(path)?;
    let file_bytes = bytes.len() as u64;
    let reader = || {
        let mut reader = image::ImageReader::new(Cursor::new(&bytes));
        // Some formats, such as TGA, are told by the name alone.
        if let Ok(format) = image::ImageFormat::from_path(path) {
            reader.set_format(format);
        }
        reader.with_guessed_format().map_err(|e| read_cause(&e))
    };
    let mut reader_of_pixels = reader()?;
    if reader_of_pixels.format().is_none() {
        return Err(format!("is not a picture of a known format ({KNOWN})"));
    }
    tiff::check(&bytes)?;
    let cause = |e| format!("cannot be decoded: {}", decoder_cause(&e, file_bytes));
    let decoder = reader()?.into_decoder().map_err(cause)?;
    let (width, height) = decoder.dimensions();
    check_size(u64::from(width), u64::from(height))?;
    memory::check(decoder.total_bytes())?;
    reader_of_pixels.limits(limits(MAX_SIDE as u32, MAX_PIXELS * BYTES_PER_PIXEL, file_bytes));
    reader_of_pixels.decode().map_err(cause)
}
