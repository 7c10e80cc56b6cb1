//! 8-bit sRGB pictures for the screen.

use std::io::{self, Write};
use std::path::Path;

use super::{Rgb8, write_beside_and_rename};
use crate::error::{Error, Result};

/// Writes an 8-bit sRGB PNG (by [`write_beside_and_rename`]) with the metadata as text chunks. An alpha channel has as
/// many values as there are pixels; colours are not multiplied by it.
///
/// # Errors
/// If a metadata name is not 1 to 79 Latin-1 characters, or the file cannot be written.
pub fn write_png(
    path: &Path,
    picture: &Rgb8,
    alpha: Option<&[u8]>,
    metadata: &[(String, String)],
) -> Result<()> {
    write_beside_and_rename(path, |file| encode(file, picture, alpha, metadata))
}

/// The bytes of an 8-bit sRGB PNG without metadata.
///
/// # Errors
/// If the picture has no pixels.
pub fn encode_png(picture: &Rgb8) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    encode(&mut bytes, picture, None, &[]).map_err(|e| Error::new(format!("PNG: {e}")))?;
    Ok(bytes)
}

fn encode(
    file: impl Write,
    picture: &Rgb8,
    alpha: Option<&[u8]>,
    metadata: &[(String, String)],
) -> io::Result<()> {
    let mut encoder = png::Encoder::new(file, picture.width, picture.height);
    encoder.set_color(if alpha.is_some() { png::ColorType::Rgba } else { png::ColorType::Rgb });
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    for (name, value) in metadata {
        // tEXt holds Latin-1 only.
        if value.chars().all(|c| u32::from(c) < 256) {
            encoder.add_text_chunk(name.clone(), value.clone())
        } else {
            encoder.add_itxt_chunk(name.clone(), value.clone())
        }
        .map_err(into_io)?;
    }
    let mut writer = encoder.write_header().map_err(into_io)?;
    match alpha {
        None => writer.write_image_data(picture.pixels.as_flattened()),
        Some(alpha) => {
            let pixels = picture.pixels.iter().zip(alpha);
            let pixels: Vec<u8> = pixels.flat_map(|(&[r, g, b], &a)| [r, g, b, a]).collect();
            writer.write_image_data(&pixels)
        }
    }
    .map_err(into_io)?;
    writer.finish().map_err(into_io)
}

fn into_io(error: png::EncodingError) -> io::Error {
    match error {
        png::EncodingError::IoError(error) => error,
        other => io::Error::other(other.to_string()),
    }
}
