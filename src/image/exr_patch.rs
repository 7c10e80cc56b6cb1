//! Headers that the `exr` crate refuses though the pixels can be read: channels that are not sorted by
//! name, and channels of lower resolution.

use std::ops::Range;

/// How many pixels a sample of a channel stands for, across and down.
pub(super) type Step = [usize; 2];

/// A file as the crate reads it.
pub(super) struct Patched {
    pub(super) bytes: Vec<u8>,
    /// Of each channel of the first part.
    pub(super) sampling: Vec<Step>,
}

/// Sorts the channels, in whose order OpenEXR reads pixels, and makes all of them seem to have a sample a
/// pixel. `None` if the header makes no sense.
pub(super) fn patch(mut bytes: Vec<u8>) -> Option<Patched> {
    let mut sampling = None;
    let attributes = attributes(&bytes)?.into_iter().flatten();
    for Attribute { value: list, .. } in attributes.filter(|it| it.is_channel_list) {
        let mut channels = Vec::new();
        let mut rest = &bytes[list.clone()];
        while rest.first().is_some_and(|&byte| byte != 0) {
            // A name, its end, and 16 bytes of which the last eight are the sampling.
            let name = rest.iter().position(|&byte| byte == 0)?;
            let (channel, after) = rest.split_at_checked(name + 17)?;
            channels.push((channel[..name].to_vec(), channel[name..].to_vec()));
            rest = after;
        }
        channels.sort();
        let mut sorted = Vec::with_capacity(list.len());
        let mut steps = Vec::new();
        for (name, facts) in channels {
            let word = |at: usize| facts[at..].first_chunk().map(|b| u32::from_le_bytes(*b));
            steps.push([word(9)? as usize, word(13)? as usize]);
            sorted.extend(name);
            sorted.extend(&facts[..9]);
            sorted.extend([1, 0, 0, 0, 1, 0, 0, 0]);
        }
        sorted.push(0);
        bytes.get_mut(list).filter(|list| list.len() == sorted.len())?.copy_from_slice(&sorted);
        sampling.get_or_insert(steps);
    }
    Some(Patched { bytes, sampling: sampling? })
}

/// Sorts the attributes of the first part, which the crate writes in an order of chance, so that equal
/// pictures are equal files. `start` is the file up to some byte after the header.
pub(super) fn sort_attributes(start: &mut [u8]) -> Option<()> {
    let attributes = attributes(start)?.into_iter().next()?;
    let (first, last) = (attributes.first()?.whole.start, attributes.last()?.whole.end);
    let mut sorted: Vec<&[u8]> = attributes.iter().map(|it| &start[it.whole.clone()]).collect();
    sorted.sort_unstable();
    let sorted = sorted.concat();
    start[first..last].copy_from_slice(&sorted);
    Some(())
}

/// Where an attribute of a header is.
struct Attribute {
    whole: Range<usize>,
    value: Range<usize>,
    is_channel_list: bool,
}

/// The attributes of all parts.
fn attributes(bytes: &[u8]) -> Option<Vec<Vec<Attribute>>> {
    let is_multipart = bytes.get(5)? & 0x10 != 0;
    let text = |at: usize| {
        let length = bytes.get(at..)?.iter().take(256).position(|&byte| byte == 0)?;
        Some(&bytes[at..at + length])
    };
    let (mut at, mut parts) = (8, Vec::new());
    loop {
        let mut part = Vec::new();
        // Up to an empty name.
        while !text(at)?.is_empty() {
            let start = at;
            at += text(at)?.len() + 1;
            let is_channel_list = text(at)? == b"chlist";
            at += text(at)?.len() + 1;
            let size = u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?) as usize;
            let value = at + 4..at.checked_add(4 + size).filter(|end| *end <= bytes.len())?;
            at = value.end;
            part.push(Attribute { whole: start..at, value, is_channel_list });
        }
        at += 1;
        let is_last = part.is_empty() || !is_multipart;
        parts.push(part);
        if is_last {
            return Some(parts);
        }
    }
}
