//! Spoils bytes and words, always in the same way for a number.
use lightgrid::sampler::SplitMix;

/// Sizes, counts and offsets that readers trip over.
const NUMBERS: [u64; 16] = [
    0,
    1,
    2,
    3,
    7,
    8,
    127,
    128,
    255,
    256,
    0x7fff,
    0xffff,
    0x7fff_ffff,
    0xffff_ffff,
    1_000_000_000,
    0x8000_0000_0000_0000,
];

/// Words that stand for numbers in text.
const WORDS: [&str; 22] = [
    "0",
    "-1",
    "1",
    "2",
    "1e9",
    "1e39",
    "-1e39",
    "1e-50",
    "999999999",
    "4294967296",
    "65536",
    "18446744073709551616",
    "0.5",
    "-0",
    "null",
    "true",
    "\"\"",
    "[]",
    "{}",
    "nan",
    "inf",
    "1e999",
];

/// Some to eight changes to one of the entries.
pub(crate) fn bytes(entries: &[Vec<u8>], random: &mut SplitMix) -> Vec<u8> {
    let mut bytes = entries[random.below(entries.len())].clone();
    for _ in 0..1 + random.below(8) {
        if bytes.is_empty() {
            break;
        }
        // Half of the changes near the beginning, where headers are.
        let reach = if random.below(2) == 0 { bytes.len().min(256) } else { bytes.len() };
        let at = random.below(reach);
        match random.below(10) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = random.next_bits() as u8,
            2..=4 => overwrite(&mut bytes[at..], random),
            5 => {
                let end = at + random.below((bytes.len() - at).min(64) + 1);
                bytes.drain(at..end);
            }
            6 => {
                let end = at + random.below((bytes.len() - at).min(64) + 1);
                let piece = bytes[at..end].to_vec();
                bytes.splice(at..at, piece);
            }
            7 if random.below(4) == 0 => bytes.truncate(at),
            8 if random.below(2) == 0 => {
                let other = &entries[random.below(entries.len())];
                let from = random.below(other.len().max(1));
                let piece = other[from..(from + random.below(64)).min(other.len())].to_vec();
                bytes.splice(at..at, piece);
            }
            _ => replace_number(&mut bytes, at, random),
        }
    }
    bytes
}

/// A glTF file whose container is whole: one to three numbers of its JSON exchanged, a few bytes of its
/// data overwritten. So more of the reader is reached than by spoiling anything anywhere.
pub(crate) fn gltf((json, data): &(String, Vec<u8>), random: &mut SplitMix) -> (String, Vec<u8>) {
    let json = numbers(json.as_bytes(), random);
    let mut data = data.clone();
    for _ in 0..random.below(4) {
        if !data.is_empty() {
            let at = random.below(data.len());
            overwrite(&mut data[at..], random);
        }
    }
    (String::from_utf8_lossy(&json).into_owned(), data)
}

/// Text with one to three of its numbers exchanged.
pub(crate) fn numbers(text: &[u8], random: &mut SplitMix) -> Vec<u8> {
    let mut text = text.to_vec();
    for _ in 0..1 + random.below(3) {
        let at = random.below(text.len());
        replace_number(&mut text, at, random);
    }
    text
}

/// Writes a telling number of one to eight bytes, either end first.
fn overwrite(bytes: &mut [u8], random: &mut SplitMix) {
    let width = (1 << random.below(4)).min(bytes.len());
    let number = NUMBERS[random.below(NUMBERS.len())];
    let mut digits = number.to_le_bytes()[..width].to_vec();
    if random.below(2) == 0 {
        digits.reverse();
    }
    bytes[..width].copy_from_slice(&digits);
}

/// Exchanges the decimal number next after `at` for another word.
fn replace_number(bytes: &mut Vec<u8>, at: usize, random: &mut SplitMix) {
    let is_part = |b: &u8| b.is_ascii_digit() || matches!(*b, b'.' | b'-' | b'e' | b'E');
    let Some(start) = bytes[at..].iter().position(|b| b.is_ascii_digit()).map(|i| at + i) else {
        return;
    };
    let length = bytes[start..].iter().take_while(|b| is_part(b)).count();
    bytes.splice(start..start + length, WORDS[random.below(WORDS.len())].bytes());
}

/// One of the command lines with words exchanged, doubled, left out, or spoilt.
pub(crate) fn words(lines: &[&str], random: &mut SplitMix) -> Vec<String> {
    let line = |random: &mut SplitMix| -> Vec<String> {
        lines[random.below(lines.len())].split_whitespace().map(str::to_owned).collect()
    };
    let mut words = line(random);
    for _ in 0..1 + random.below(4) {
        let at = random.below(words.len().max(1));
        match random.below(6) {
            _ if words.is_empty() => words = line(random),
            0 => {
                words.remove(at);
            }
            1 => words.insert(at, words[at].clone()),
            2 => words[at] = WORDS[random.below(WORDS.len())].to_owned(),
            3 => {
                let other = line(random);
                words[at].clone_from(&other[random.below(other.len())]);
            }
            _ => {
                let spoilt = bytes(&[words[at].clone().into_bytes()], random);
                words[at] = String::from_utf8_lossy(&spoilt).into_owned();
            }
        }
    }
    words
}
