//! OpenEXR pictures with feature layers and metadata.

use std::io::{self, Read as _, Seek as _, Write as _};
use std::path::Path;

use exr::meta::attribute::Preview;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Blocks, Compression, Encoding, FlatSamples,
    Image as ExrImage, Layer as ExrLayer, LayerAttributes, LineOrder, SmallVec, Text, Vec2,
    WritableImage,
};

use super::exr_patch::sort_attributes;
use super::{Image, Rgb8, write_beside_and_rename};
use crate::error::{Error, Result};

/// What goes into one OpenEXR file.
#[derive(Debug, Clone)]
pub struct ExrPicture<'a> {
    /// The picture, stored as the top-level channels `R`, `G`, `B`.
    pub image: &'a Image,
    /// More quantities per pixel, such as `albedo` or `variance`.
    pub layers: Vec<Layer>,
    /// Stored as text attributes of these names; see
    /// [`read_exr_metadata`](super::read_exr_metadata).
    pub metadata: &'a [(String, String)],
    /// It in small, for lists of files.
    pub preview: Option<&'a Rgb8>,
}

/// A named group of channels, stored as `name.channel` in the part of the picture itself, which is
/// where Blender, Nuke and tev look for it.
#[derive(Debug, Clone)]
pub struct Layer {
    /// Such as `normal`.
    pub name: String,
    /// Name (such as `X`) and one value per pixel, row after row.
    pub channels: Vec<(String, Vec<f32>)>,
}

/// Writes a ZIP-compressed `f32` OpenEXR file (by [`write_beside_and_rename`]).
///
/// # Errors
/// If a layer is not of the picture's size, two channels or attributes share a name, or the file
/// cannot be written.
pub fn write_exr(path: &Path, picture: ExrPicture<'_>) -> Result<()> {
    let ExrPicture { image, layers, metadata, preview } = picture;
    let size = Vec2(image.width as usize, image.height as usize);
    let mut channels: SmallVec<[AnyChannel<FlatSamples>; 4]> = SmallVec::new();
    for (i, name) in ["R", "G", "B"].into_iter().enumerate() {
        let values = image.pixels.iter().map(|rgb| rgb[i]).collect();
        channels.push(AnyChannel::new(name, FlatSamples::F32(values)));
    }
    for layer in layers {
        for (channel, values) in layer.channels {
            let name = format!("{}.{channel}", layer.name);
            if values.len() != image.pixels.len() {
                return Err(Error::at(
                    path,
                    format!(
                        "cannot be written: the channel {name} has {} values for {} pixels",
                        values.len(),
                        image.pixels.len()
                    ),
                ));
            }
            channels.push(AnyChannel::new(text(&name), FlatSamples::F32(values)));
        }
    }
    let mut attributes =
        LayerAttributes { software_name: Some(text(SOFTWARE)), ..LayerAttributes::default() };
    for (name, value) in metadata {
        attributes.other.insert(text(name), AttributeValue::Text(text(value)));
    }
    attributes.preview = preview.map(|small| Preview {
        size: Vec2(small.width as usize, small.height as usize),
        pixel_data: small
            .pixels
            .iter()
            .flat_map(|&[r, g, b]| [r, g, b, 255])
            .map(u8::cast_signed)
            .collect(),
    });
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let layer = ExrLayer::new(size, attributes, encoding, AnyChannels::sort(channels));
    let file_content = ExrImage::from_layer(layer);
    write_beside_and_rename(path, |file| {
        file_content.write().to_buffered(&mut *file).map_err(|error| match error {
            exr::error::Error::Io(error) => error,
            other => io::Error::other(other.to_string()),
        })?;
        file.rewind()?;
        let mut start = Vec::new();
        file.get_ref().take(MAX_HEADER_BYTES).read_to_end(&mut start)?;
        if sort_attributes(&mut start).is_some() {
            file.rewind()?;
            file.write_all(&start)?;
        }
        Ok(())
    })
}

/// Longer headers than any of ours.
const MAX_HEADER_BYTES: u64 = 1 << 18;

/// What the `software` attribute says.
const SOFTWARE: &str = concat!("lightgrid ", env!("CARGO_PKG_VERSION"));

/// UTF-8 bytes as they are, as the OpenEXR specification asks for.
fn text(text: &str) -> Text {
    Text::from_slice_unchecked(text.as_bytes())
}
