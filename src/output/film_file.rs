//! A film in a file, to be gone on with or joined with others: a line of JSON, the sums of every pixel
//! as they are in memory, and a digest of both.
//!
//! After the line come, row after row, five little-endian words of 64 bits a pixel: samples and
//! invalid samples (the low and the high half of the first), then the f64 sums of red, green, blue and
//! squared luminance. With layers eight words a pixel follow for the whole picture: f64 sums over first
//! hits of albedo (3), depth and normal (3), and their number. The last word is the digest.

use std::fmt;
use std::io::{Read as _, Write as _};
use std::ops::Range;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::digest::Digest;
use crate::error::{At as _, Decoded, Error, Result};
use crate::image::{looks_like_film, open_file, read_cause, read_file, write_beside_and_rename};
use crate::memory;
use crate::render::film::{Film, Pixel, Surface};
use crate::render::{Doubling, Figures};

/// One of several disjoint shares of a picture's samples, in all pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Part {
    /// From 1 on.
    pub number: u32,
    /// How many parts there are.
    pub count: u32,
}

impl Part {
    /// All samples.
    pub const WHOLE: Self = Self { number: 1, count: 1 };

    /// Which of `samples` samples of every pixel it takes.
    pub fn range(self, samples: u32) -> Range<u32> {
        let edge =
            |number: u32| (u64::from(samples) * u64::from(number) / u64::from(self.count)) as u32;
        edge(self.number - 1)..edge(self.number)
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} of {}", self.number, self.count)
    }
}

/// What a film in a file is of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FilmFacts {
    /// What every sample of the picture depends on, by name: equal for films that belong together.
    pub picture: Vec<(String, String)>,
    /// Which of the picture's samples these are.
    pub part: Part,
    /// Samples a pixel that the whole picture is to have; `None` if another rule ends it.
    pub samples: Option<u32>,
    /// Samples a pixel, of the whole picture, that the pass under way was to reach.
    pub target: u32,
    /// What was done for it.
    pub figures: Figures,
    /// What a picture of it says about itself.
    pub metadata: Vec<(String, String)>,
    /// What its noise is found by, if it is to be gone on from.
    #[serde(default)]
    pub noted: Doubling,
}

impl FilmFacts {
    /// Which share of what, in words.
    pub fn share(&self) -> String {
        let of_samples =
            self.samples.map_or_else(String::new, |n| format!(" of {n} samples a pixel"));
        match self.part {
            Part::WHOLE => format!("a whole picture{of_samples}"),
            part => format!("part {part}{of_samples}"),
        }
    }

    /// The names of what differs from another picture, joined for a sentence; `None` if nothing does.
    pub fn difference(&self, other: &[(String, String)]) -> Option<String> {
        let value = |name: &str| other.iter().find(|(key, _)| key == name).map(|(_, value)| value);
        let apart = self.picture.iter().filter(|(name, own)| value(name) != Some(own));
        let names: Vec<&str> = apart.map(|(name, _)| name.as_str()).collect();
        (!names.is_empty()).then(|| names.join(", "))
    }
}

/// The file's first line.
#[derive(Serialize, Deserialize)]
struct Header {
    lightgrid_film: u32,
    size: (u32, u32),
    layers: bool,
    #[serde(flatten)]
    facts: FilmFacts,
}

/// Version of the format.
const FORMAT: u32 = 1;
/// Longer first lines than any of ours.
const MAX_HEADER_BYTES: u64 = 1 << 20;
const DAMAGED: &str = "is damaged: its checksum does not fit";
const CUT_SHORT: &str = "is cut short";
const PIXEL_WORDS: usize = 5;
const SURFACE_WORDS: usize = 8;
const WORD_BYTES: u64 = size_of::<u64>() as u64;

/// Writes a film without the first `skipped` samples of every pixel, which others took (by
/// [`write_beside_and_rename`]).
///
/// # Errors
/// If the file cannot be written.
pub fn write_film(path: &Path, facts: &FilmFacts, film: &Film, skipped: u32) -> Result<()> {
    let header = Header {
        lightgrid_film: FORMAT,
        size: (film.width, film.height),
        layers: film.has_layers(),
        facts: facts.clone(),
    };
    let line = serde_json::to_string(&header).at(path)?;
    let width = film.width as usize;
    write_beside_and_rename(path, |file| {
        writeln!(file, "{line}")?;
        let mut digest = Digest::new().bytes(line.as_bytes());
        let mut put = |words: Vec<u64>| {
            let bytes: Vec<u8> = words.into_iter().flat_map(u64::to_le_bytes).collect();
            digest = digest.bytes(&bytes);
            file.write_all(&bytes)
        };
        for row in film.pixels().chunks(width) {
            put(row.iter().flat_map(|pixel| pixel_words(pixel, skipped)).collect())?;
        }
        for row in film.surfaces.chunks(width) {
            put(row.iter().flat_map(|surface| surface.sums().map(f64::to_bits)).collect())?;
        }
        file.write_all(&digest.value().to_le_bytes())
    })
}

fn pixel_words(pixel: &Pixel, skipped: u32) -> [u64; PIXEL_WORDS] {
    let samples = u64::from(pixel.samples() - skipped);
    let [r, g, b, squared] = pixel.sums.map(f64::to_bits);
    [samples | u64::from(pixel.invalid) << 32, r, g, b, squared]
}

/// Reads what [`write_film`] wrote.
///
/// # Errors
/// One sentence: the file cannot be read, is something else, or is not whole.
pub fn read_film(path: &Path) -> Result<(FilmFacts, Film)> {
    read_file(path).and_then(|bytes| decode(&bytes)).at(path)
}

/// Reads what a film in a file is of, without the film.
///
/// # Errors
/// One sentence: the file cannot be read or is something else.
pub fn read_facts(path: &Path) -> Result<FilmFacts> {
    let read = || {
        let (file, _) = open_file(path)?;
        let mut start = Vec::new();
        file.take(MAX_HEADER_BYTES).read_to_end(&mut start).map_err(|e| read_cause(&e))?;
        Ok(header(&start)?.1.facts)
    };
    read().map_err(|cause: String| Error::at(path, cause))
}

/// The first line, and what it says.
fn header(start: &[u8]) -> Decoded<(&[u8], Header)> {
    let other = "is neither a part of a picture nor a checkpoint of lightgrid";
    if start.is_empty() {
        return Err(CUT_SHORT.into());
    }
    let start = &start[..start.len().min(MAX_HEADER_BYTES as usize)];
    let [cut, damaged] = if looks_like_film(start) { [CUT_SHORT, DAMAGED] } else { [other, other] };
    let length = start.iter().position(|byte| *byte == b'\n').ok_or(cut)?;
    let line = &start[..length];
    let header: serde_json::Value = serde_json::from_slice(line).map_err(|_| damaged)?;
    let format = header.get("lightgrid_film").and_then(serde_json::Value::as_u64).ok_or(other)?;
    if format != u64::from(FORMAT) {
        return Err(format!("was written by another version of lightgrid (format {format})"));
    }
    let header: Header = serde_json::from_value(header).map_err(|_| DAMAGED)?;
    let Part { number, count } = header.facts.part;
    let (width, height) = header.size;
    let is_sound = number > 0 && number <= count && width > 0 && height > 0;
    if is_sound { Ok((line, header)) } else { Err(DAMAGED.into()) }
}

fn decode(bytes: &[u8]) -> Decoded<(FilmFacts, Film)> {
    let (line, header) = header(bytes)?;
    let rest = &bytes[line.len() + 1..];
    let (width, height) = header.size;
    let pixels = u64::from(width) * u64::from(height);
    let words_of_pixel = PIXEL_WORDS + if header.layers { SURFACE_WORDS } else { 0 };
    let wanted =
        pixels.saturating_mul(words_of_pixel as u64 * WORD_BYTES).saturating_add(WORD_BYTES);
    if (rest.len() as u64) < wanted {
        return Err(CUT_SHORT.into());
    }
    let (content, last) = rest.split_at(rest.len() - WORD_BYTES as usize);
    let (of_pixels, of_surfaces) =
        content.split_at(pixels as usize * PIXEL_WORDS * WORD_BYTES as usize);
    let row_bytes = |words: usize| width as usize * words * WORD_BYTES as usize;
    let digest =
        of_pixels.chunks(row_bytes(PIXEL_WORDS)).fold(Digest::new().bytes(line), Digest::bytes);
    let digest = of_surfaces.chunks(row_bytes(SURFACE_WORDS)).fold(digest, Digest::bytes);
    if rest.len() as u64 != wanted || last != digest.value().to_le_bytes() {
        return Err(DAMAGED.into());
    }
    memory::check(content.len() as u64)?;
    let pixels = in_rows(of_pixels).map(pixel_of_words).collect();
    let surfaces = in_rows(of_surfaces).map(|words| Surface::of_sums(words.map(f64::from_bits)));
    Ok((header.facts, Film { width, height, pixels, surfaces: surfaces.collect() }))
}

/// Little-endian words, so many at a time.
fn in_rows<const N: usize>(bytes: &[u8]) -> impl Iterator<Item = [u64; N]> {
    let (words, _) = bytes.as_chunks::<8>();
    let (rows, _) = words.as_chunks::<N>();
    rows.iter().map(|row| row.map(u64::from_le_bytes))
}

/// Inverse of [`pixel_words`].
fn pixel_of_words([counts, sums @ ..]: [u64; PIXEL_WORDS]) -> Pixel {
    let sums = sums.map(f64::from_bits);
    Pixel { sums, samples: counts as u32, invalid: (counts >> 32) as u32 }
}
