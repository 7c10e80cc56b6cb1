//! OpenEXR pictures with feature layers and metadata.

use std::io::{self, Read as _, Seek, Write};
use std::path::Path;

use exr::block::UncompressedBlock;
use exr::block::chunk::Chunk;
use exr::block::writer::ChunksWriter as _;
use exr::image::write::layers::{LayersWriter as _, WritableLayers as _};
use exr::meta::attribute::Preview;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Blocks, Compression, Encoding, FlatSamples,
    Image as ExrImage, Layer as ExrLayer, LayerAttributes, LineOrder, SmallVec, Text, Vec2,
};
use rayon::prelude::*;

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
            let name = match layer.name.as_str() {
                "" => channel,
                layer => format!("{layer}.{channel}"),
            };
            let (found, wanted) = (values.len(), image.pixels.len());
            if found != wanted {
                let cause = format!("the channel {name} has {found} values for {wanted} pixels");
                return Err(Error::at(path, format!("cannot be written: {cause}")));
            }
            channels.push(AnyChannel::new(text(&name), FlatSamples::F32(values)));
        }
    }
    let mut attributes =
        LayerAttributes { software_name: Some(text(SOFTWARE)), ..LayerAttributes::default() };
    for (name, value) in metadata {
        attributes.other.insert(text(name), AttributeValue::Text(text(value)));
    }
    attributes.preview = preview.map(|small| {
        let size = Vec2(small.width as usize, small.height as usize);
        let bytes = small.pixels.iter().flat_map(|&[r, g, b]| [r, g, b, 255]);
        Preview { size, pixel_data: bytes.map(u8::cast_signed).collect() }
    });
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let layer = ExrLayer::new(size, attributes, encoding, AnyChannels::sort(channels));
    write_beside_and_rename(path, |file| {
        write_blocks(&mut *file, &ExrImage::from_layer(layer)).map_err(|error| match error {
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

/// Lines of a block in files of [`Compression::ZIP16`].
const LINES_OF_BLOCK: u64 = 16;

/// Copies of a block that exist while it is compressed, with room to spare: raw, reordered twice, and the
/// compressed bytes, whose list grows by doubling. A debug build of the library also unpacks them again.
const COPIES_OF_BLOCK: u64 = 8;

/// Bytes that [`write_exr`] takes at most besides the channels' values: each thread compresses a block.
pub(crate) fn exr_encoder_bytes(width: u32, channels: u64) -> u64 {
    let block = LINES_OF_BLOCK * u64::from(width) * channels * size_of::<f32>() as u64;
    block * COPIES_OF_BLOCK * rayon::current_num_threads() as u64
}

/// Writes all blocks in order, compressed by the threads that there are. The library would start threads of
/// its own, whose stacks and heaps may not fit where memory is short.
fn write_blocks(
    file: impl Write + Seek,
    picture: &ExrImage<ExrLayer<AnyChannels<FlatSamples>>>,
) -> exr::error::UnitResult {
    let layers = &picture.layer_data;
    let headers = layers.infer_headers(&picture.attributes);
    let pixels = layers.create_writer(&headers);
    exr::block::write(file, headers, true, |meta, writer| {
        let blocks: Vec<_> = meta.enumerate_ordered_header_block_indices().collect();
        for batch in blocks.chunks(rayon::current_num_threads()) {
            let compress = |&(_, index): &(usize, _)| {
                let data = pixels.extract_uncompressed_block(&meta.headers, index);
                UncompressedBlock { index, data }.compress_to_chunk(&meta.headers)
            };
            let chunks: Vec<exr::error::Result<Chunk>> = batch.par_iter().map(compress).collect();
            for ((at, _), chunk) in batch.iter().zip(chunks) {
                writer.write_chunk(*at, chunk?)?;
            }
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
