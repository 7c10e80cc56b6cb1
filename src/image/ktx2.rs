//! KTX 2 pictures: Basis Universal's ETC1S and UASTC, or plain bytes; stored as they are or by Zstandard.
//!
//! Of the library that knows Basis Universal only the two decoders to pixels are used: it has the whole way
//! to the formats of graphics cards, too, with megabytes of tables.

use std::io::{self, Read};

use basisu::basislz::etc1s::Etc1sTranscoder;
use basisu::uastc::unpack::unpack_uastc;
use ruzstd::decoding::{FrameDecoder, StreamingDecoder};

use super::guard::{catch_panic, decoder_bytes};
use crate::error::Decoded;
use crate::memory;

const MAGIC: &[u8] = b"\xabKTX 20\xbb\r\n\x1a\n";

/// Schemes by which the pixels are packed once more.
const PLAIN: u32 = 0;
const BASIS_LZ: u32 = 1;
const ZSTANDARD: u32 = 2;

/// Colour models of the data format descriptor.
const ETC1S: u8 = 163;
const UASTC: u8 = 166;

/// What a channel of ETC1S and of UASTC holds if its values, decoded as opacity, are green.
const ETC1S_GREEN: u8 = 4;
const UASTC_RED_GREEN: u8 = 5;

/// Bytes that a picture of any file may take: 4096 x 4096. One colour, so large, is a file of some kilobytes.
const ALWAYS: u64 = 64 << 20;

/// A frame of Zstandard may look back so far, whatever it makes: what all its readers must bear.
const MIN_WINDOW: u64 = 8 << 20;

/// Whether these bytes are of such a file.
pub(super) fn is_ktx2(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// Width and height as the header claims them.
///
/// # Errors
/// A cause, if the header is cut off or claims no picture.
pub(super) fn size(bytes: &[u8]) -> Decoded<(u32, u32)> {
    match (word(bytes, 20), word(bytes, 24)) {
        (Some(width), Some(height)) if width > 0 && height > 0 => Ok((width, height)),
        (Some(width), Some(height)) => Err(format!("has no pixels ({width} x {height})")),
        _ => Err("is cut off in its header".into()),
    }
}

/// The largest mip level's pixels, and whether the file says that they are multiplied by their opacity.
///
/// Row 0 is at the top and channels are where the file's metadata wants them; opacity is 255 where the file
/// has none.
///
/// # Errors
/// A cause: the file is damaged, is not one flat picture, or of a format that is not read, it claims more
/// pixels than its bytes can hold, or memory is short.
pub(super) fn decode(bytes: &[u8]) -> Decoded<(Vec<[u8; 4]>, bool)> {
    catch_panic(|| {
        let file = File::open(bytes)?;
        let mut pixels = match (file.format, file.scheme, file.model) {
            (0, BASIS_LZ, ETC1S) => file.etc1s()?,
            (0, PLAIN | ZSTANDARD, UASTC) => file.uastc()?,
            (0, scheme, model) => {
                return Err(format!(
                    "is of the KTX colour model {model} in scheme {scheme}, which is not read \
                     (ETC1S, UASTC and plain bytes are)"
                ));
            }
            (format, PLAIN | ZSTANDARD, _) => file.plain(format)?,
            (_, scheme, _) => {
                return Err(format!("is packed by scheme {scheme}, which is not read"));
            }
        };
        file.orient(&mut pixels);
        file.swizzle(&mut pixels);
        Ok((pixels, file.is_premultiplied))
    })
    .ok_or("is damaged: the decoder of its pixels failed")?
}

/// What a file says of its first picture.
struct File<'a> {
    width: usize,
    height: usize,
    /// Number of the format among Vulkan's; 0 where the colour model says it.
    format: u32,
    scheme: u32,
    model: u8,
    is_premultiplied: bool,
    /// Whether so short a file may well have nothing to fill its pixels with. Then that is tried first.
    is_doubtful: bool,
    /// What the channels of the descriptor hold.
    channels: Vec<u8>,
    levels: usize,
    /// The largest level, packed.
    level: &'a [u8],
    /// What all levels have in common.
    global: &'a [u8],
    /// Values of keys, without the zero at their end.
    orientation: &'a [u8],
    swizzle: &'a [u8],
}

impl<'a> File<'a> {
    fn open(bytes: &'a [u8]) -> Decoded<Self> {
        let (width, height) = size(bytes)?;
        let header = |at| word(bytes, at).ok_or("is cut off in its header");
        let (depth, layers, faces, levels) = (header(28)?, header(32)?, header(36)?, header(40)?);
        if depth > 1 || layers > 1 || faces > 1 {
            return Err("is a cube map, an array or a volume, not one flat picture".into());
        }
        let pixel_bytes = 4 * u64::from(width) * u64::from(height);
        let file_bytes = bytes.len() as u64;
        if pixel_bytes > ALWAYS + 1100 * file_bytes {
            return Err(format!("claims more pixels than its {file_bytes} bytes can hold"));
        }
        // The pixels, what they are made of, and what Zstandard looks back at.
        memory::check(4 * pixel_bytes)?;
        let cut = || format!("is cut off: it refers to more than its {file_bytes} bytes");
        let part = |offset: u64, length: u64| {
            let end = offset.checked_add(length)?;
            bytes.get(usize::try_from(offset).ok()?..usize::try_from(end).ok()?)
        };
        let short = |at| part(word(bytes, at)?.into(), word(bytes, at + 4)?.into());
        let long = |at| part(long_word(bytes, at)?, long_word(bytes, at + 8)?);
        let descriptor = short(48).ok_or_else(cut)?;
        let samples = descriptor.get(28..).unwrap_or_default().chunks_exact(16);
        let metadata = short(56).ok_or_else(cut)?;
        Ok(Self {
            width: width as usize,
            height: height as usize,
            format: header(12)?,
            scheme: header(44)?,
            model: descriptor.get(12).copied().unwrap_or_default(),
            is_premultiplied: descriptor.get(15).is_some_and(|flags| flags & 1 == 1),
            is_doubtful: pixel_bytes > decoder_bytes(file_bytes),
            channels: samples.map(|sample| sample[3] & 15).collect(),
            levels: levels.max(1) as usize,
            level: long(80).ok_or_else(cut)?,
            global: long(64).ok_or_else(cut)?,
            orientation: value(metadata, b"KTXorientation"),
            swizzle: value(metadata, b"KTXswizzle"),
        })
    }

    /// How many pixels there are.
    fn count(&self) -> u64 {
        self.width as u64 * self.height as u64
    }

    fn etc1s(&self) -> Decoded<Vec<[u8; 4]>> {
        const DAMAGED: &str = "holds damaged ETC1S data";
        let short =
            |at| Some(u32::from(u16::from_le_bytes(*self.global.get(at..)?.first_chunk()?)));
        let long = |at| Some(word(self.global, at)? as usize);
        let slice = |at| self.level.get(long(at)?..)?.get(..long(at + 4)?);
        let mut rest =
            self.levels.checked_mul(20).and_then(|all| self.global.get(20..)?.get(all..));
        let mut next = |at| {
            let (part, left) = rest?.split_at_checked(long(at)?)?;
            rest = Some(left);
            Some(part)
        };
        let mut parts = || Some((short(0)?, next(4)?, short(2)?, next(8)?, next(12)?));
        let (endpoint_count, endpoints, selector_count, selectors, tables) =
            parts().ok_or(DAMAGED)?;
        let mut decoder = Etc1sTranscoder::new();
        if !decoder.decode_palettes(endpoint_count, endpoints, selector_count, selectors)
            || !decoder.decode_tables(tables)
        {
            return Err(DAMAGED.into());
        }
        let color = slice(24).ok_or(DAMAGED)?;
        let second = (self.channels.len() > 1).then(|| slice(32).ok_or(DAMAGED)).transpose()?;
        let [width, height] = [self.width, self.height].map(|side| side as u32);
        let [columns, rows] = [width, height].map(|side| side.div_ceil(4));
        if self.is_doubtful {
            // Blocks take an eighth of what pixels do.
            let mut blocks = vec![0; 8 * columns as usize * rows as usize];
            for slice in [Some(color), second].into_iter().flatten() {
                decoder
                    .transcode_slice_etc1(slice, columns, rows, None, &mut blocks)
                    .ok_or(DAMAGED)?;
            }
        }
        let mut pixels = memory::filled(self.count(), [0; 4])?;
        let out = pixels.as_flattened_mut();
        match second {
            Some(second) => decoder
                .transcode_image_rgba32(color, second, columns, rows, width, height, None, out),
            None => decoder.transcode_slice_rgba32(color, columns, rows, width, height, None, out),
        }
        .ok_or(DAMAGED)?;
        if self.channels.get(1) == Some(&ETC1S_GREEN) {
            green_from_opacity(&mut pixels);
        }
        Ok(pixels)
    }

    fn uastc(&self) -> Decoded<Vec<[u8; 4]>> {
        let mut blocks = vec![[0_u8; 16]; self.width.div_ceil(4)];
        let bytes = 16 * blocks.len() * self.height.div_ceil(4);
        let mut pixels = self.by_rows(bytes, 4, |source, rows, out| {
            source.read_exact(blocks.as_flattened_mut())?;
            let start = out.len();
            out.resize(start + rows * self.width, [0; 4]);
            for (column, block) in blocks.iter().enumerate() {
                let texels = unpack_uastc(block, false)
                    .ok_or_else(|| io::Error::other("a block of no kind"))?;
                let from = 4 * column;
                let to = self.width.min(from + 4);
                for (row, texels) in texels.as_chunks::<4>().0[..rows].iter().enumerate() {
                    let at = start + row * self.width;
                    let row = out[at + from..at + to].iter_mut();
                    row.zip(texels).for_each(|(pixel, texel)| *pixel = texel.c);
                }
            }
            Ok(())
        })?;
        if self.channels.first() == Some(&UASTC_RED_GREEN) {
            green_from_opacity(&mut pixels);
        }
        Ok(pixels)
    }

    /// Bytes of one of Vulkan's formats with 8 bits a channel.
    fn plain(&self, format: u32) -> Decoded<Vec<[u8; 4]>> {
        let order: &[usize] = match format {
            9 | 15 => &[0],
            16 | 22 => &[0, 1],
            23 | 29 => &[0, 1, 2],
            30 | 36 => &[2, 1, 0],
            37 | 43 => &[0, 1, 2, 3],
            44 | 50 => &[2, 1, 0, 3],
            _ => {
                return Err(format!(
                    "is of Vulkan's format {format}, which is not read (ETC1S, UASTC and formats \
                     of 8 bits a channel are)"
                ));
            }
        };
        let mut row = vec![0; self.width * order.len()];
        self.by_rows(row.len() * self.height, 1, |source, _, out| {
            source.read_exact(&mut row)?;
            out.extend(row.chunks_exact(order.len()).map(|stored| {
                let mut pixel = [0, 0, 0, 255];
                order.iter().zip(stored).for_each(|(&channel, &value)| pixel[channel] = value);
                pixel
            }));
            Ok(())
        })
    }

    /// Pixels made of so many bytes, so many rows at a time read by `read` to the end of a list.
    fn by_rows(
        &self,
        bytes: usize,
        step: usize,
        mut read: impl FnMut(&mut dyn Read, usize, &mut Vec<[u8; 4]>) -> io::Result<()>,
    ) -> Decoded<Vec<[u8; 4]>> {
        let damaged = |_| format!("holds damaged pixels, or too few for {} rows", self.height);
        let unpacked = || {
            let mut decoder = FrameDecoder::new();
            decoder.set_max_window_size((bytes as u64).max(MIN_WINDOW));
            StreamingDecoder::new_with_decoder(self.level, decoder)
                .map_err(|cause| format!("holds no Zstandard data ({cause})"))
        };
        let is_packed = self.scheme == ZSTANDARD;
        let there = match (is_packed, self.is_doubtful) {
            (false, _) => self.level.len() as u64,
            (true, true) => {
                let mut first = unpacked()?.take(bytes as u64);
                io::copy(&mut first, &mut io::sink()).map_err(damaged)?
            }
            (true, false) => bytes as u64,
        };
        if there < bytes as u64 {
            return Err(format!("holds too few pixels for {} rows", self.height));
        }
        let mut pixels = memory::reserved(self.count())?;
        let mut source: Box<dyn Read> = match is_packed {
            true => Box::new(unpacked()?),
            false => Box::new(self.level),
        };
        for row in (0..self.height).step_by(step) {
            read(&mut source, step.min(self.height - row), &mut pixels).map_err(damaged)?;
        }
        Ok(pixels)
    }

    /// Makes the first row the uppermost and the first column the left one.
    fn orient(&self, pixels: &mut [[u8; 4]]) {
        if self.orientation.first() == Some(&b'l') {
            pixels.chunks_exact_mut(self.width).for_each(<[_]>::reverse);
        }
        if self.orientation.get(1) == Some(&b'u') {
            let (upper, lower) = pixels.split_at_mut(self.height / 2 * self.width);
            let rows = lower.rchunks_exact_mut(self.width);
            upper.chunks_exact_mut(self.width).zip(rows).for_each(|(a, b)| a.swap_with_slice(b));
        }
    }

    /// Puts the channels where they are to be read.
    fn swizzle(&self, pixels: &mut [[u8; 4]]) {
        let Some(wanted) = self.swizzle.first_chunk::<4>().filter(|wanted| *wanted != b"rgba")
        else {
            return;
        };
        for pixel in pixels {
            let [r, g, b, a] = *pixel;
            *pixel = [0, 1, 2, 3].map(|channel| match wanted[channel] {
                b'r' => r,
                b'g' => g,
                b'b' => b,
                b'a' => a,
                b'0' => 0,
                b'1' => 255,
                _ => pixel[channel],
            });
        }
    }
}

fn green_from_opacity(pixels: &mut [[u8; 4]]) {
    pixels.iter_mut().for_each(|pixel| *pixel = [pixel[0], pixel[3], 0, 255]);
}

/// The value of a key of the metadata, without the zero at its end; empty if it is not there.
fn value<'a>(mut metadata: &'a [u8], key: &[u8]) -> &'a [u8] {
    while let Some(length) = word(metadata, 0) {
        let Some(entry) = metadata[4..].get(..length as usize) else { break };
        if let Some(value) = entry.strip_prefix(key).and_then(|rest| rest.strip_prefix(b"\0")) {
            return value.strip_suffix(b"\0").unwrap_or(value);
        }
        let next = 4 + (length as usize).next_multiple_of(4);
        metadata = metadata.get(next..).unwrap_or_default();
    }
    &[]
}

/// Little-endian u32 at a byte offset.
fn word(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

/// Little-endian u64 at a byte offset.
fn long_word(bytes: &[u8], at: usize) -> Option<u64> {
    Some(u64::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}
