//! Changes to glTF files that leave most of them in order.

use libfuzzer_sys::fuzzer_mutate;
use lightgrid::sampler::SplitMix;
use serde_json::Value;

use crate::corpus::gltf_file;
use crate::mutate;

/// A changed file in place of the first `length` bytes; its length, `most` at most.
///
/// Of what is whole, one part is changed: a number or a branch of the JSON, some of its characters, or the
/// data. The container is made anew, so that its lengths are right.
pub fn mutate_gltf(bytes: &mut [u8], length: usize, most: usize, seed: u32) -> usize {
    let mut random = SplitMix(seed.into());
    let changed = match parts(&bytes[..length]) {
        Some((json, data)) if random.below(5) > 0 => change(json, data, &mut random),
        _ => None,
    };
    match changed {
        Some(file) if file.len() <= most => {
            bytes[..file.len()].copy_from_slice(&file);
            file.len()
        }
        _ => fuzzer_mutate(bytes, length, most),
    }
}

fn change(mut json: Vec<u8>, mut data: Vec<u8>, random: &mut SplitMix) -> Option<Vec<u8>> {
    match random.below(6) {
        0 if !data.is_empty() => data = by_bytes(data),
        0 | 1 if !json.is_empty() => json = mutate::numbers(&json, random),
        2 => json = by_bytes(json),
        _ => {
            let mut tree = serde_json::from_slice(&json).ok()?;
            for _ in 0..1 + random.below(3) {
                graft(&mut tree, random);
            }
            json = serde_json::to_vec(&tree).ok()?;
        }
    }
    Some(gltf_file((String::from_utf8_lossy(&json).into_owned(), data)))
}

/// libFuzzer's own changes.
fn by_bytes(mut bytes: Vec<u8>) -> Vec<u8> {
    let length = bytes.len();
    bytes.resize(length + 64, 0);
    let length = fuzzer_mutate(&mut bytes, length, length + 64);
    bytes.truncate(length);
    bytes
}

/// JSON and data of a file.
fn parts(bytes: &[u8]) -> Option<(Vec<u8>, Vec<u8>)> {
    if !bytes.starts_with(b"glTF") {
        return bytes.starts_with(b"{").then(|| (bytes.to_vec(), Vec::new()));
    }
    let chunk = |at: usize| {
        let length = u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?) as usize;
        bytes.get(at + 8..)?.get(..length)
    };
    let json = chunk(12)?;
    Some((json.to_vec(), chunk(20 + json.len()).unwrap_or_default().to_vec()))
}

/// Puts a copy of one branch in another's place or beside it, or removes one.
fn graft(tree: &mut Value, random: &mut SplitMix) {
    let mut places = Vec::new();
    list(tree, String::new(), &mut places);
    let mut any = || places[random.below(places.len())].clone();
    let (from, to) = (any(), any());
    let branch = tree.pointer(&from).cloned().unwrap_or_default();
    let key = from.rsplit('/').next().unwrap_or_default().to_owned();
    // What makes a file too large stops there.
    let branch = if branch.to_string().len() > 2000 { Value::Null } else { branch };
    let Some(place) = tree.pointer_mut(&to) else { return };
    match (random.below(3), place) {
        (0, place) => *place = branch,
        (1, Value::Object(members)) if !key.is_empty() => {
            members.insert(key, branch);
        }
        (1, Value::Array(items)) => items.insert(random.below(items.len() + 1), branch),
        (_, Value::Object(members)) if !members.is_empty() => {
            let key = members.keys().nth(random.below(members.len())).cloned();
            key.and_then(|key| members.shift_remove(&key));
        }
        (_, Value::Array(items)) if !items.is_empty() => {
            items.remove(random.below(items.len()));
        }
        (_, place) => *place = branch,
    }
}

/// Pointers to all branches; keys with characters that pointers escape are left out.
fn list(value: &Value, place: String, places: &mut Vec<String>) {
    match value {
        Value::Object(members) => {
            for (key, value) in members.iter().filter(|(key, _)| !key.contains(['/', '~'])) {
                list(value, format!("{place}/{key}"), places);
            }
        }
        Value::Array(items) => {
            for (number, value) in items.iter().enumerate() {
                list(value, format!("{place}/{number}"), places);
            }
        }
        _ => {}
    }
    places.push(place);
}
