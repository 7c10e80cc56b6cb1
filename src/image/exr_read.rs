//! OpenEXR pictures, decoded block by block, in parallel, straight into the final pixels.

use std::io::{BufReader, Cursor, Read, Seek};
use std::path::Path;

use exr::block::UncompressedBlock;
use exr::block::chunk::{Chunk, CompressedBlock};
use exr::block::reader::{ChunksReader, Reader as ChunkReader};
use exr::compression::Compression;
use exr::math::Vec2;
use exr::meta::MetaData;
use exr::meta::attribute::{
    AttributeValue, ChannelDescription, ChannelList, EnvironmentMap, IntegerBounds, SampleType,
};
use exr::meta::header::{Header, LayerAttributes};
use exr::prelude::{Text, f16};
use glam::{DVec2, Mat3, Vec3};
use rayon::prelude::*;

use super::exr_channels::{Channels, select};
use super::exr_patch::{Step, patch};
use super::file::{open_file, read_cause, read_file};
use super::guard::guarded;
use super::picture::FilePicture;
use super::primaries::{Primaries, REC709, rec709_conversion};
use super::{Image, Rgb8, check_size};
use crate::error::{At as _, Decoded, Error, Notices, Result};
use crate::memory;

/// Reads linear Rec.709 pixels of an OpenEXR file: see [`select`] for which part and channels that is. Of a
/// tiled file with levels the largest is read. Pixels of the display window outside the data window
/// are black.
///
/// # Errors
/// One sentence: missing, damaged, too large, or of a kind that is not read (deep, an unknown
/// compression).
pub(crate) fn read_exr(path: &Path) -> Result<FilePicture> {
    let (file, file_bytes) = open_file(path).at(path)?;
    let decoded =
        || match ChunkReader::read_from_buffered(BufReader::with_capacity(1 << 20, file), false) {
            Ok(reader) => decode(reader, file_bytes, None),
            Err(failure) if is_patched(&failure) => {
                let file = patch(read_file(path)?).ok_or_else(|| decode_cause(failure))?;
                let reader = ChunkReader::read_from_buffered(Cursor::new(file.bytes), false);
                decode(reader.map_err(decode_cause)?, file_bytes, Some(file.sampling))
            }
            Err(failure) => Err(decode_cause(failure)),
        };
    guarded(decoded).at(path)
}

/// Whether a header is refused that [`patch`] cures.
fn is_patched(failure: &exr::error::Error) -> bool {
    use exr::error::Error as Exr;
    match failure {
        Exr::Invalid(what) => what.contains("not sorted"),
        Exr::NotSupported(what) => what.contains("subsampling"),
        _ => false,
    }
}

/// The text attributes of the first part of an OpenEXR file, sorted by name: what
/// [`write_exr`](super::write_exr) was given as metadata.
///
/// # Errors
/// If the file is missing or its header is damaged.
pub fn read_exr_metadata(path: &Path) -> Result<Vec<(String, String)>> {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let pair = |(name, value): (&Text, &AttributeValue)| match value {
        AttributeValue::Text(value) => Some((text(name.bytes()), text(value.bytes()))),
        _ => None,
    };
    let mut found: Vec<_> = own_attributes(path)?.other.iter().filter_map(pair).collect();
    found.sort();
    Ok(found)
}

/// The small picture in the header of an OpenEXR file's first part, if there is one.
///
/// # Errors
/// If the file is missing or its header is damaged.
pub fn read_exr_preview(path: &Path) -> Result<Option<Rgb8>> {
    let Some(preview) = own_attributes(path)?.preview else { return Ok(None) };
    let byte = |value: i8| value.cast_unsigned();
    let (pixels, _) = preview.pixel_data.as_chunks();
    let pixels: Vec<_> = pixels.iter().map(|&[r, g, b, _]| [r, g, b].map(byte)).collect();
    let Vec2(width, height) = preview.size;
    let is_whole = width.checked_mul(height) == Some(pixels.len());
    let small = Rgb8 { width: width as u32, height: height as u32, pixels };
    Ok((is_whole && !small.pixels.is_empty()).then_some(small))
}

/// What the first part of a file says beside what its pixels need.
fn own_attributes(path: &Path) -> Result<LayerAttributes> {
    let (file, _) = open_file(path).at(path)?;
    let read = || MetaData::read_from_buffered(BufReader::new(file), false);
    let meta = guarded(|| read().map_err(decode_cause)).at(path)?;
    let mut headers = meta.headers.into_iter();
    Ok(headers.next().ok_or_else(|| Error::at(path, "has no pictures"))?.own_attributes)
}

/// `sampling` is that of the first part's channels if they may differ from a sample a pixel.
fn decode<R: Read + Seek>(
    reader: ChunkReader<R>,
    file_bytes: u64,
    sampling: Option<Vec<Step>>,
) -> Decoded<FilePicture> {
    check_plausible(reader.headers(), file_bytes)?;
    let mut notices = Notices::default();
    let selection = select(reader.headers(), &mut notices)?;
    let header = reader.headers()[selection.part].clone();
    let is_subsampled = |all: &Vec<Step>| all.iter().any(|step| *step != [1, 1]);
    let sampling = sampling.filter(|all| selection.part == 0 && is_subsampled(all));
    let placement = Placement::of(&header, &mut notices)?;
    let chromaticities = header.shared_attributes.chromaticities;
    let primaries =
        chromaticities.map(|of| Primaries([of.red, of.green, of.blue, of.white].map(point)));
    let adopted = header.own_attributes.adopted_neutral.map(point);
    let block_decoder = BlockDecoder {
        channels: selection.channels,
        layout: layout(&header),
        bytes_per_pixel: header.channels.bytes_per_pixel,
        sampling,
        weights: primaries.unwrap_or(Primaries(REC709)).luminance(),
        to_rec709: primaries
            .filter(|_| !matches!(selection.channels, Channels::Grey(_)))
            .and_then(|primaries| rec709_conversion(primaries, adopted, &mut notices)),
    };
    let (width, height) = (placement.width, placement.height);
    let mut image = Image { width, height, pixels: Vec::new() };
    let mut chunks = reader
        .filter_chunks(false, |_, tile, block| {
            block.layer == selection.part && tile.is_largest_resolution_level()
        })
        .map_err(decode_cause)?;
    let meta = chunks.meta_data().clone();
    let batch_size = batch_size(&header);
    loop {
        let batch = chunks.by_ref().take(batch_size).collect::<exr::error::Result<Vec<_>>>();
        let batch = batch.map_err(decode_cause)?.into_par_iter();
        let decoded = batch.map(|chunk| block_decoder.decode(chunk, &meta));
        let blocks: Vec<Block> = decoded.collect::<Decoded<_>>()?;
        // Not before there is something to show: a small file may claim a large display window.
        if image.pixels.is_empty() {
            image.pixels = memory::filled(u64::from(width) * u64::from(height), [0.0; 3])?;
        }
        if blocks.is_empty() {
            break;
        }
        blocks.iter().for_each(|block| placement.copy(block, &mut image));
    }
    if block_decoder.sampling.is_some() {
        block_decoder.hold(&mut image);
    }
    let is_cube_map = header.own_attributes.environment_map == Some(EnvironmentMap::Cube);
    Ok(FilePicture { image, notices, is_linear: true, is_cube_map })
}

/// A chromaticity `xy`.
fn point(v: Vec2<f32>) -> DVec2 {
    DVec2::new(f64::from(v.0), f64::from(v.1))
}

/// Largest tile, or group of rows, that is decoded as one.
const MAX_BLOCK_BYTES: usize = 1 << 30;

/// Refuses files whose header claims more than the file can hold, before anything is allocated.
fn check_plausible(headers: &[Header], file_bytes: u64) -> Decoded<()> {
    for header in headers {
        let Vec2(width, height) = header.layer_size;
        check_size(width as u64, height as u64)?;
        // The crate allocates a block of this size as soon as a chunk claims to be as large.
        let Vec2(block_width, block_height) = header.max_block_pixel_size();
        let block_bytes = block_width
            .saturating_mul(block_height)
            .saturating_mul(header.channels.bytes_per_pixel);
        if block_bytes > MAX_BLOCK_BYTES {
            return Err("is damaged: its blocks of pixels are implausibly large".into());
        }
    }
    // Each chunk has an eight-byte offset in a table and an eight-byte header of its own.
    let chunks: u64 = headers.iter().map(|header| header.chunk_count as u64).sum();
    // The best ratio of any codec on a picture that is not quite black is far below this.
    const PIXELS_PER_BYTE: u64 = 10_000;
    let pixels: u64 = headers.iter().map(pixels_to_hold).fold(0, u64::saturating_add);
    if chunks.saturating_mul(16) > file_bytes
        || pixels > (1 << 20) + file_bytes.saturating_mul(PIXELS_PER_BYTE)
    {
        return Err(format!(
            "is cut short or damaged: {file_bytes} bytes cannot hold the {pixels} pixels it claims"
        ));
    }
    Ok(())
}

/// Pixels of a part's data window or of its display window, whichever has more.
fn pixels_to_hold(header: &Header) -> u64 {
    let display = header.shared_attributes.display_window.size;
    let display_pixels = (display.0 as u64).saturating_mul(display.1 as u64);
    display_pixels.max(header.layer_size.area() as u64)
}

/// Chunks to hold in memory at once: some 64 MB decoded, more where that would leave threads idle.
fn batch_size(header: &Header) -> usize {
    let Vec2(width, height) = header.max_block_pixel_size();
    let block_bytes = (width * height * header.channels.bytes_per_pixel).max(1);
    let batch_bytes = (block_bytes * rayon::current_num_threads()).clamp(64 << 20, 256 << 20);
    (batch_bytes / block_bytes).clamp(1, 1024)
}

/// Where the data window lies in the picture that is returned.
struct Placement {
    width: u32,
    height: u32,
    /// Position of the first data pixel, possibly outside the picture.
    x: i64,
    y: i64,
}

impl Placement {
    /// The picture is the display window, or the data window if the two do not meet.
    fn of(header: &Header, notices: &mut Notices) -> Decoded<Self> {
        let data = header.data_window();
        let display = header.shared_attributes.display_window;
        let offset = |axis: fn(Vec2<i32>) -> i32| {
            i64::from(axis(data.position)) - i64::from(axis(display.position))
        };
        let (x, y) = (offset(|v| v.0), offset(|v| v.1));
        let meets = |start: i64, data_size: usize, display_size: usize| {
            start < display_size as i64 && start + data_size as i64 > 0
        };
        let inside = meets(x, data.size.0, display.size.0) && meets(y, data.size.1, display.size.1);
        let IntegerBounds { size, .. } = if inside { display } else { data };
        if data != display {
            let (Vec2(w, h), Vec2(of_w, of_h)) = (data.size, display.size);
            let what = if inside { "what lies between is black" } else { "it is read alone" };
            notices.add(format!(
                "the data window ({w} x {h} at {x}, {y}) is not the display window \
                 ({of_w} x {of_h}); {what}"
            ));
        }
        let (width, height) = check_size(size.0 as u64, size.1 as u64)?;
        let (x, y) = if inside { (x, y) } else { (0, 0) };
        Ok(Self { width, height, x, y })
    }

    /// Copies the part of a block that lies in the picture.
    fn copy(&self, block: &Block, image: &mut Image) {
        let left = self.x + block.x as i64;
        let first = (-left).clamp(0, block.width as i64);
        let end = (i64::from(self.width) - left).clamp(first, block.width as i64);
        for (row, pixels) in block.pixels.chunks_exact(block.width).enumerate() {
            let y = self.y + (block.y + row) as i64;
            if first == end || !(0..i64::from(self.height)).contains(&y) {
                continue;
            }
            let start = (y * i64::from(self.width) + left + first) as usize;
            let pixels = &pixels[first as usize..end as usize];
            image.pixels[start..start + pixels.len()].copy_from_slice(pixels);
        }
    }
}

/// Decoded pixels of one chunk, at their place in the data window.
struct Block {
    x: usize,
    y: usize,
    width: usize,
    pixels: Vec<[f32; 3]>,
}

fn layout(header: &Header) -> Vec<(SampleType, usize)> {
    let mut end = 0;
    let of = |channel: &ChannelDescription| {
        end += channel.sample_type.bytes_per_sample();
        (channel.sample_type, end - channel.sample_type.bytes_per_sample())
    };
    header.channels.list.iter().map(of).collect()
}

/// Hands `count` samples of one channel (native byte order) to `put`, left to right.
fn for_each(sample_type: SampleType, count: usize, bytes: &[u8], put: impl FnMut((usize, f32))) {
    let bytes = &bytes[..sample_type.bytes_per_sample() * count];
    match sample_type {
        SampleType::F16 => each(bytes, |b| f16::from_ne_bytes(b).to_f32(), put),
        SampleType::F32 => each(bytes, f32::from_ne_bytes, put),
        SampleType::U32 => each(bytes, |b| u32::from_ne_bytes(b) as f32, put),
    }
}

fn each<const N: usize>(bytes: &[u8], of: impl Fn([u8; N]) -> f32, put: impl FnMut((usize, f32))) {
    bytes.as_chunks().0.iter().map(|bytes| of(*bytes)).enumerate().for_each(put);
}

/// Turns compressed chunks into linear Rec.709 pixels.
struct BlockDecoder {
    channels: Channels,
    /// Type, and bytes per pixel of all channels before, of each channel.
    layout: Vec<(SampleType, usize)>,
    bytes_per_pixel: usize,
    /// Set if channels have lower resolutions: pixels that a sample of each stands for.
    sampling: Option<Vec<Step>>,
    /// Luminance of the file's own red, green and blue.
    weights: Vec3,
    to_rec709: Option<Mat3>,
}

impl BlockDecoder {
    fn decode(&self, chunk: Chunk, meta: &MetaData) -> Decoded<Block> {
        guarded(|| {
            if let Some(sampling) = &self.sampling {
                return self.decode_subsampled(chunk, meta, sampling);
            }
            let block =
                UncompressedBlock::decompress_chunk(chunk, meta, false).map_err(decode_cause)?;
            let Vec2(width, height) = block.index.pixel_size;
            let mut pixels = vec![[0.0; 3]; width * height];
            let rows = block.data.chunks_exact(width * self.bytes_per_pixel);
            for (row, pixels) in rows.zip(pixels.chunks_exact_mut(width)) {
                for (i, channel) in self.channels.indices().into_iter().enumerate() {
                    let (sample_type, before) = self.layout[channel];
                    for_each(sample_type, width, &row[before * width..], |(x, v)| pixels[x][i] = v);
                }
            }
            let Vec2(x, y) = block.index.pixel_position;
            self.convert(&mut pixels);
            Ok(Block { x, y, width, pixels })
        })
    }

    /// Pixels as they are stored, NaN where there is no sample: lines hold only the channels that have some
    /// in them.
    fn decode_subsampled(&self, chunk: Chunk, meta: &MetaData, steps: &[Step]) -> Decoded<Block> {
        let damaged = || "is damaged: its channels of lower resolution make no sense".to_owned();
        let mut meta = meta.clone();
        let header = meta.headers.get_mut(chunk.layer_index).ok_or_else(damaged)?;
        let place = header.get_block_data_indices(&chunk.compressed_block);
        let place = place.and_then(|place| header.get_absolute_block_pixel_coordinates(place));
        let place = place.map_err(decode_cause)?;
        let (Vec2(width, height), first) = (place.size, place.position.1);
        let has_samples = |row: usize, [_, down]: Step| {
            (i64::from(first) + row as i64).rem_euclid(down.max(1) as i64) == 0
        };
        // Channels with their bytes in a line.
        let line = |(channel, &step): (usize, &Step)| {
            let (sample_type, _) = self.layout[channel];
            let samples = width / step[0].max(1);
            (channel, step, samples * sample_type.bytes_per_sample())
        };
        let lines: Vec<(usize, Step, usize)> = (0..).zip(steps).map(line).collect();
        let of_row = |row| lines.iter().filter(move |(_, step, _)| has_samples(row, *step));
        let bytes: usize = (0..height).flat_map(of_row).map(|(.., bytes)| bytes).sum();
        let is_b44 = matches!(header.compression, Compression::B44 | Compression::B44A);
        // What packing would make larger is stored plainly.
        let is_plain = matches!(&chunk.compressed_block, CompressedBlock::ScanLine(block)
            if block.compressed_pixels_le.len() == bytes);
        let data = if is_b44 && !is_plain {
            let rows = |step| (0..height).filter(|&row| has_samples(row, step)).count();
            let planes = planes_of_b44(chunk, header, &lines, rows).ok_or_else(damaged)?;
            let mut planes: Vec<&[u8]> = planes.iter().map(Vec::as_slice).collect();
            let mut data = Vec::with_capacity(bytes);
            for row in 0..height {
                for (&(_, step, bytes), plane) in lines.iter().zip(&mut planes) {
                    if has_samples(row, step) {
                        data.extend_from_slice(plane.split_off(..bytes).ok_or_else(damaged)?);
                    }
                }
            }
            data
        } else {
            // The crate knows of resolutions, but takes all lines to have as many bytes.
            if !bytes.is_multiple_of(width * height) {
                return Err(damaged());
            }
            header.channels.bytes_per_pixel = bytes / (width * height);
            for (channel, step) in header.channels.list.iter_mut().zip(steps) {
                channel.sampling = Vec2(step[0], step[1]);
            }
            UncompressedBlock::decompress_chunk(chunk, &meta, false).map_err(decode_cause)?.data
        };
        let mut pixels = vec![[f32::NAN; 3]; width * height];
        let mut rest = data.as_slice();
        for (row, line) in pixels.chunks_exact_mut(width).enumerate() {
            for &(channel, step, bytes) in of_row(row) {
                let samples = rest.split_off(..bytes).ok_or_else(damaged)?;
                for i in (0..3).filter(|i| self.channels.indices().get(*i) == Some(&channel)) {
                    for_each(self.layout[channel].0, width / step[0], samples, |(x, v)| {
                        line[x * step[0]..][..step[0]].iter_mut().for_each(|pixel| pixel[i] = v);
                    });
                }
            }
        }
        let at = |axis: fn(Vec2<i32>) -> i32| {
            usize::try_from(axis(place.position)).map_err(|_| damaged())
        };
        Ok(Block { x: at(|v| v.0)?, y: at(|v| v.1)?, width, pixels })
    }

    /// Makes a picture of blocks with channels of lower resolution: samples are held from line to line,
    /// across blocks. Where the picture begins between two lines, the second one's stand for the first's.
    fn hold(&self, image: &mut Image) {
        let (width, count) = (image.width as usize, image.pixels.len());
        let downwards = (width..count).map(|at| (at, at - width));
        let upwards = (width..count).rev().map(|at| (at - width, at));
        for (at, beside) in downwards.chain(upwards) {
            let beside = image.pixels[beside];
            for (value, beside) in image.pixels[at].iter_mut().zip(beside) {
                if value.is_nan() {
                    *value = beside;
                }
            }
        }
        self.convert(&mut image.pixels);
    }

    /// Makes linear Rec.709 of what was stored.
    fn convert(&self, pixels: &mut [[f32; 3]]) {
        match self.channels {
            Channels::Rgb(_) => {}
            Channels::Grey(_) => pixels.iter_mut().for_each(|p| *p = [p[0]; 3]),
            Channels::LumaChroma(_) => {
                pixels.iter_mut().for_each(|p| *p = rgb_from_ycc(*p, self.weights));
            }
        }
        if let Some(matrix) = self.to_rec709 {
            pixels.iter_mut().for_each(|p| *p = (matrix * Vec3::from(*p)).to_array());
        }
    }
}

/// The samples of each channel in `lines` (number, sampling, bytes of a line) of a B44 block, whose channels
/// lie one after another: the crate reckons wrongly with those of lower resolution, but can do one at a
/// time. `None` if there are too few.
fn planes_of_b44(
    chunk: Chunk,
    header: &Header,
    lines: &[(usize, Step, usize)],
    rows: impl Fn(Step) -> usize,
) -> Option<Vec<Vec<u8>>> {
    let CompressedBlock::ScanLine(block) = chunk.compressed_block else { return None };
    let mut rest = block.compressed_pixels_le.as_slice();
    let mut planes = Vec::new();
    for &(channel, step, line_bytes) in lines {
        let mut channel = header.channels.list[channel].clone();
        channel.sampling = Vec2(1, 1);
        let bytes_per_sample = channel.sample_type.bytes_per_sample();
        let size = Vec2(line_bytes / bytes_per_sample, rows(step));
        let mut length = 0;
        if channel.sample_type == SampleType::F16 {
            // Four by four samples take 14 bytes, or 3 where all are equal, which the third says.
            for _ in 0..size.0.div_ceil(4) * size.1.div_ceil(4) {
                length += if *rest.get(length + 2)? >= 13 << 2 { 3 } else { 14 };
            }
        } else {
            length = line_bytes * size.1;
        }
        let own = rest.split_off(..length)?;
        let mut alone = header.clone();
        alone.channels = ChannelList::new(std::iter::once(channel).collect());
        let (own, section) = (own.to_vec(), IntegerBounds { position: Vec2(0, 0), size });
        let compression = header.compression;
        let plane = compression.decompress_image_section_from_le(&alone, own, section, false);
        planes.push(plane.ok()?);
    }
    Some(planes)
}

/// RGB from luminance, of these weights, and the colour differences `(R-Y)/Y`, `(B-Y)/Y` (OpenEXR
/// `ImfRgbaYca`).
fn rgb_from_ycc([y, ry, by]: [f32; 3], weights: Vec3) -> [f32; 3] {
    let (r, b) = ((ry + 1.0) * y, (by + 1.0) * y);
    [r, (y - weights.x * r - weights.z * b) / weights.y, b]
}

/// A decoder's error in the words of someone who wanted a picture.
fn decode_cause(error: exr::error::Error) -> String {
    use exr::error::Error as Exr;
    match error {
        Exr::Io(error) => read_cause(&error),
        Exr::Invalid(what)
            if what.contains("missing magic") || what.contains("file identifier") =>
        {
            "is not an OpenEXR file".into()
        }
        // What the crate makes of an unexpected end of the file.
        Exr::Invalid(what) if what.contains("missing bytes") => "is cut short or damaged".into(),
        Exr::Invalid(what) => format!("is a damaged OpenEXR file ({what})"),
        Exr::NotSupported(what) if what.contains("deep") => {
            "holds deep data, which lightgrid does not read".into()
        }
        Exr::NotSupported(what) => {
            format!("uses a feature of OpenEXR that lightgrid does not read ({what})")
        }
        Exr::Aborted => "was not read to its end".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colour_differences_give_back_the_colour() {
        let rgb = [0.5f32, 0.25, 2.0];
        let y = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
        let weights = Vec3::new(0.2126, 0.7152, 0.0722);
        let back = rgb_from_ycc([y, (rgb[0] - y) / y, (rgb[2] - y) / y], weights);
        assert!(back.iter().zip(&rgb).all(|(a, b)| (a - b).abs() < 1e-6), "{back:?}");
        assert_eq!(rgb_from_ycc([0.0, 3.0, 4.0], weights), [0.0; 3]);
    }

    /// Blocks left of, right of and across each edge of a picture with an offset data window.
    #[test]
    fn blocks_are_clipped_to_the_picture() {
        let placement = Placement { width: 4, height: 3, x: -2, y: -1 };
        let mut image = Image::filled(4, 3, [0.0; 3]);
        for y in 0..6 {
            for x in 0..4 {
                let value = (10 * y + x) as f32;
                let block = Block { x: 3 * x, y, width: 3, pixels: vec![[value; 3]; 3] };
                placement.copy(&block, &mut image);
            }
        }
        let reds: Vec<f32> = image.pixels.iter().map(|p| p[0]).collect();
        assert_eq!(reds, [10., 11., 11., 11., 20., 21., 21., 21., 30., 31., 31., 31.]);
    }
}
