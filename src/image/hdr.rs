//! Radiance `.hdr` pictures (RGBE and XYZE), tolerant of what real programs write.
//!
//! Format: Greg Ward, "Real Pixels", Graphics Gems II; Radiance's `color.c` and `resolu.c`.

use super::picture::FilePicture;
use super::primaries::{Primaries, rec709_conversion};
use super::{Image, check_size};
use crate::color::REC709_FROM_XYZ;
use crate::error::{Decoded, Notices};
use crate::memory;
use glam::{DVec2, Vec3};

/// Decodes a whole `.hdr` file. Header lines `EXPOSURE` and `COLORCORR` are undone, so that pixels
/// are radiance again; `XYZE`, and RGBE of other `PRIMARIES`, are converted to Rec.709.
///
/// # Errors
/// The cause, without the file's name: no Radiance header, an unknown pixel format or resolution
/// line, an implausible size, damaged or missing rows.
pub(crate) fn decode_hdr(bytes: &[u8]) -> Decoded<FilePicture> {
    let mut rest = bytes;
    let mut notices = Notices::default();
    let header = Header::parse(&mut rest, &mut notices)?;
    let (major, minor) = (header.major, header.minor);
    // A row takes four bytes at the very least.
    if (rest.len() as u64) < 4 * major.count {
        let (bytes, Header { width, height, .. }) = (rest.len(), header);
        return Err(format!("is cut short: {bytes} bytes cannot hold {width} x {height} pixels"));
    }
    let decoded = pixel_decoder(&header, &mut notices);
    let mut line = vec![[0u8; 4]; minor.count as usize];
    let mut pixels: Vec<[f32; 3]> = Vec::new();
    // All at once if the file can hold it in runs, else as it is read: old runs have no bound, and a
    // small file may claim gigabytes.
    let total = major.count as usize * minor.count as usize;
    if total / MAX_PIXELS_PER_BYTE <= rest.len() {
        pixels = memory::reserved(total as u64)?;
    }
    // Whoever writes runs needs less than four bytes a pixel. If there are as many, pixels that look like
    // runs of the old kind are dark pixels.
    let may_have_runs = starts_with_runs(rest, line.len()) || rest.len() < 4 * total;
    for row in 0..major.count {
        read_line(&mut rest, &mut line, may_have_runs)
            .map_err(|cause| format!("{cause}: only {row} of {} rows can be read", major.count))?;
        pixels.extend(line.iter().copied().map(&decoded));
    }
    Ok(FilePicture { image: header.upright(pixels), notices, is_linear: true, is_cube_map: false })
}

/// Most pixels that a byte of new run lengths stands for: 127 in two bytes for each of four channels.
const MAX_PIXELS_PER_BYTE: usize = 16;

/// One of the two axes of the resolution line.
#[derive(Debug, Clone, Copy)]
struct Axis {
    is_y: bool,
    count: u64,
    /// Whether pixels come in the opposite order of ours (left to right, top to bottom).
    reversed: bool,
}

impl Axis {
    fn parse(sign_and_name: &str, count: &str) -> Option<Self> {
        let (is_y, reversed) = match sign_and_name {
            "-Y" => (true, false),
            "+Y" => (true, true),
            "+X" => (false, false),
            "-X" => (false, true),
            _ => return None,
        };
        Some(Self { is_y, reversed, count: count.parse().ok()? })
    }

    fn position(self, index: u64) -> usize {
        (if self.reversed { self.count - 1 - index } else { index }) as usize
    }
}

/// What the text before the pixels says.
struct Header {
    is_xyz: bool,
    /// What pixels are to be divided by.
    exposure: [f64; 3],
    /// Of RGBE pixels, if the file says so.
    primaries: Option<Primaries>,
    /// The axis of whole lines, then the axis along a line.
    major: Axis,
    minor: Axis,
    width: u32,
    height: u32,
}

impl Header {
    fn parse(rest: &mut &[u8], notices: &mut Notices) -> Decoded<Self> {
        if !text_line(rest).is_some_and(|line| line.starts_with("#?")) {
            return Err("is not a Radiance picture: it does not begin with #?".into());
        }
        let mut is_xyz = false;
        let mut exposure = [1.0f64; 3];
        let mut primaries = None;
        loop {
            let line = text_line(rest).ok_or("ends within its header")?;
            if line.is_empty() {
                break;
            }
            let Some((key, value)) = line.split_once('=').filter(|_| !line.starts_with('#')) else {
                // A comment, or the command line of the program that made the picture.
                continue;
            };
            match key.trim().to_ascii_uppercase().as_str() {
                "FORMAT" => match value.trim().to_ascii_lowercase().as_str() {
                    "32-bit_rle_rgbe" => is_xyz = false,
                    "32-bit_rle_xyze" => is_xyz = true,
                    other => return Err(format!("has pixels of the unknown format '{other}'")),
                },
                key @ ("EXPOSURE" | "COLORCORR") => {
                    let factors = match key {
                        "EXPOSURE" => numbers(value).map(|[factor]| [factor; 3]),
                        _ => numbers(value),
                    };
                    match factors.filter(|all| all.iter().all(|x| x.is_normal() && *x > 0.0)) {
                        Some(factors) => (0..3).for_each(|i| exposure[i] *= factors[i]),
                        None => {
                            notices
                                .add(format!("{key} of the file makes no sense; it is left out"));
                        }
                    }
                }
                "PRIMARIES" => {
                    // Many write nothing but zeros.
                    let all = numbers::<8>(value).filter(|all| *all != [0.0; 8]);
                    primaries = all
                        .map(|all| Primaries([0, 2, 4, 6].map(|i| DVec2::new(all[i], all[i + 1]))));
                }
                _ => {}
            }
        }
        let (major, minor) = parse_resolution(&text_line(rest).ok_or("has no resolution line")?)?;
        let (columns, rows) = if major.is_y { (minor, major) } else { (major, minor) };
        let (width, height) = check_size(columns.count, rows.count)?;
        Ok(Self { is_xyz, exposure, primaries, major, minor, width, height })
    }

    /// The picture of pixels in file order.
    fn upright(&self, pixels: Vec<[f32; 3]>) -> Image {
        let &Self { major, minor, width, height, .. } = self;
        if major.is_y && !major.reversed && !minor.reversed {
            return Image { width, height, pixels };
        }
        let mut image = Image::filled(width, height, [0.0; 3]);
        let strides = if major.is_y { (width as usize, 1) } else { (1, width as usize) };
        for (row, line) in (0..).zip(pixels.chunks_exact(minor.count as usize)) {
            let start = major.position(row) * strides.0;
            for (i, pixel) in (0..).zip(line) {
                image.pixels[start + minor.position(i) * strides.1] = *pixel;
            }
        }
        image
    }
}

/// Numbers that a line of the header begins with, if there are so many; some programs write more behind them.
fn numbers<const N: usize>(value: &str) -> Option<[f64; N]> {
    let words = value.split_whitespace().take(N).map(|word| word.parse().ok());
    words.collect::<Option<Vec<_>>>()?.try_into().ok()
}

/// What Radiance's own programs assume, and say of pixels that others take for Rec.709.
const RADIANCE: [DVec2; 4] = [
    DVec2::new(0.640, 0.330),
    DVec2::new(0.290, 0.600),
    DVec2::new(0.150, 0.060),
    DVec2::new(0.333_3, 0.333_3),
];

/// The axes of a line like `-Y 512 +X 1024`.
fn parse_resolution(line: &str) -> Decoded<(Axis, Axis)> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let axes = match words[..] {
        [a, n, b, m] => Axis::parse(a, n).zip(Axis::parse(b, m)),
        _ => None,
    };
    axes.filter(|(major, minor)| major.is_y != minor.is_y).ok_or_else(|| {
        let start: String = line.chars().take(40).collect();
        format!("has no resolution like '-Y 512 +X 1024' but '{start}'")
    })
}

/// What makes linear RGB of four bytes.
fn pixel_decoder(header: &Header, notices: &mut Notices) -> impl Fn([u8; 4]) -> [f32; 3] + use<> {
    // What a mantissa of each channel counts for, by exponent: `2^(e - 136)` without the exposure;
    // 0 for exponent 0, which means black.
    let of = |e| header.exposure.map(|exposure| (2f64.powi(e - 136) / exposure) as f32);
    let mut scales: Vec<[f32; 3]> = (0..256).map(of).collect();
    scales[0] = [0.0; 3];
    let primaries = header.primaries.filter(|primaries| !primaries.is(RADIANCE));
    let to_rec709 = match primaries {
        _ if header.is_xyz => Some(REC709_FROM_XYZ),
        Some(primaries) => rec709_conversion(primaries, None, notices),
        None => None,
    };
    // The mantissas are taken as they are, as all but Radiance itself do (it adds one half).
    move |[r, g, b, e]| {
        let scale = scales[e as usize];
        let rgb = [f32::from(r) * scale[0], f32::from(g) * scale[1], f32::from(b) * scale[2]];
        to_rec709.map_or(rgb, |matrix| (matrix * Vec3::from(rgb)).to_array())
    }
}

/// The next line of text without its end (LF or CR LF); `None` at the end of the file or if it is too
/// long to be text.
fn text_line(rest: &mut &[u8]) -> Option<String> {
    const MAX_LINE: usize = 1 << 16;
    let end = rest.iter().take(MAX_LINE).position(|&b| b == b'\n')?;
    let line = &rest.split_off(..=end)?[..end];
    Some(String::from_utf8_lossy(line.strip_suffix(b"\r").unwrap_or(line)).into_owned())
}

/// Takes the next `count` bytes of the file.
fn take<'a>(rest: &mut &'a [u8], count: usize) -> Decoded<&'a [u8]> {
    rest.split_off(..count).ok_or_else(|| "is cut short".into())
}

/// Whether a line of `width` pixels begins here that is written in runs of the new kind.
fn starts_with_runs(rest: &[u8], width: usize) -> bool {
    matches!(*rest, [2, 2, high, low, ..]
        if (8..0x8000).contains(&width) && usize::from(high) << 8 | usize::from(low) == width)
}

/// Reads one line of pixels: each by itself or, if there may be runs, in runs of the new kind, of the old one or
/// without any.
fn read_line(rest: &mut &[u8], line: &mut [[u8; 4]], may_have_runs: bool) -> Decoded<()> {
    if !may_have_runs {
        line.copy_from_slice(take(rest, 4 * line.len())?.as_chunks().0);
        Ok(())
    } else if starts_with_runs(rest, line.len()) {
        take(rest, 4)?;
        (0..4).try_for_each(|channel| read_runs(rest, line, channel))
    } else {
        read_flat_or_old_runs(rest, line)
    }
}

/// One channel of a run-length encoded line: a count above 128 repeats one byte, others copy.
fn read_runs(rest: &mut &[u8], line: &mut [[u8; 4]], channel: usize) -> Decoded<()> {
    let mut filled = 0;
    while filled < line.len() {
        let code = take(rest, 1)?[0];
        let count = usize::from(if code > 128 { code - 128 } else { code });
        let pixels = line.get_mut(filled..filled + count).filter(|_| count > 0);
        let pixels = pixels.ok_or("has a damaged row")?;
        if code > 128 {
            let value = take(rest, 1)?[0];
            pixels.iter_mut().for_each(|pixel| pixel[channel] = value);
        } else {
            let values = take(rest, count)?;
            pixels.iter_mut().zip(values).for_each(|(pixel, &value)| pixel[channel] = value);
        }
        filled += count;
    }
    Ok(())
}

/// Plain pixels, where `1 1 1 n` repeats the last one `n` times; runs in a row are the digits of
/// one count, base 256, lowest first.
fn read_flat_or_old_runs(rest: &mut &[u8], line: &mut [[u8; 4]]) -> Decoded<()> {
    let mut filled = 0;
    let mut shift = 0;
    while filled < line.len() {
        let pixel: [u8; 4] = take(rest, 4)?.try_into().expect("four bytes were taken");
        if let [1, 1, 1, digit] = pixel
            && filled > 0
        {
            let count = usize::from(digit) << shift;
            let previous = line[filled - 1];
            line.get_mut(filled..filled + count).ok_or("has a damaged row")?.fill(previous);
            filled += count;
            shift = (shift + 8).min(24);
        } else {
            line[filled] = pixel;
            filled += 1;
            shift = 0;
        }
    }
    Ok(())
}
