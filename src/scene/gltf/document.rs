//! From bytes to glTF's JSON objects: the GLB container, the version, the extensions asked for.

use gltf::json;
use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::Value;

use super::{Fallible, extensions, lenient};
use crate::error::Notices;
use crate::memory;

/// GLB chunk types (glTF 2.0, section 4.4.3).
const JSON_CHUNK: &[u8] = b"JSON";
const BIN_CHUNK: &[u8] = b"BIN\0";

/// What a value of the JSON takes as an object of glTF, beside its text: a node of three takes some 400 bytes.
const BYTES_OF_VALUE: u64 = 128;

/// What decides whether the rest can be read.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Head {
    asset: Option<Asset>,
    #[serde(default)]
    extensions_used: Vec<String>,
    #[serde(default)]
    extensions_required: Vec<String>,
    animations: Option<IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Asset {
    version: Option<String>,
    min_version: Option<String>,
}

/// Parses the objects of a `.gltf` or `.glb`; the second part is the GLB's binary chunk.
///
/// The objects are not validated: whoever follows an index checks it.
pub(super) fn parse<'a>(
    bytes: &'a [u8],
    notices: &mut Notices,
) -> Fallible<(json::Root, Option<&'a [u8]>)> {
    if bytes.is_empty() {
        return Err("the file is empty".into());
    }
    let (text, binary) = if bytes.starts_with(b"glTF") { split_glb(bytes)? } else { (bytes, None) };
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    // Some writers pad the JSON chunk with zeros instead of spaces.
    let padding = text.iter().rev().take_while(|&&byte| byte == 0).count();
    let text = &text[..text.len() - padding];
    let values = lenient::check_indices(text)?;
    memory::check(text.len() as u64 + values.saturating_mul(BYTES_OF_VALUE))?;
    // Sound files take the short way: a tree of values takes some twenty times their size.
    let tree = || -> Fallible<Value> {
        let mut tree: Value = serde_json::from_slice(text).map_err(|e| e.to_string())?;
        lenient::repair(&mut tree);
        Ok(tree)
    };
    let other = |cause| format!("its JSON does not describe glTF 2.0 ({cause})");
    let head: Head = match serde_json::from_slice(text) {
        Ok(head) => head,
        Err(_) => serde_json::from_value(tree()?).map_err(other)?,
    };
    check_version(head.asset.as_ref())?;
    extensions::check(&head.extensions_used, &head.extensions_required, notices)?;
    let root: json::Root = match json::deserialize::from_slice(text) {
        Ok(root) => root,
        Err(_) => json::deserialize::from_value(tree()?).map_err(other)?,
    };
    if head.animations.is_some() {
        notices.add("the file has animations; its rest pose is shown");
    }
    Ok((root, binary))
}

fn check_version(asset: Option<&Asset>) -> Fallible<()> {
    let asset = asset.ok_or("its JSON has no `asset`, so it is not glTF")?;
    let version = asset.version.as_deref().unwrap_or("?");
    if version.split('.').next() != Some("2") {
        return Err(format!("it is glTF version {version}; only 2.0 can be read"));
    }
    match asset.min_version.as_deref() {
        Some(least) if least != "2.0" => {
            Err(format!("it needs a reader for glTF {least}; only 2.0 can be read"))
        }
        _ => Ok(()),
    }
}

/// Splits a GLB into its JSON and binary chunks; chunks of other types are passed over.
fn split_glb(bytes: &[u8]) -> Fallible<(&[u8], Option<&[u8]>)> {
    let version = word(bytes, 4).ok_or("the GLB header is cut off")?;
    let length = word(bytes, 8).ok_or("the GLB header is cut off")?;
    if version != 2 {
        return Err(format!("it is GLB version {version}; only 2 can be read"));
    }
    if length < 20 {
        return Err(format!("its GLB header gives a length of {length} bytes, too few for glTF"));
    }
    let Some(mut rest) = bytes.get(12..length) else {
        return Err(format!(
            "it is cut off: its GLB header promises {length} bytes and there are {}",
            bytes.len()
        ));
    };
    let (mut text, mut binary) = (None, None);
    while !rest.is_empty() {
        let size = word(rest, 0).ok_or("a GLB chunk header is cut off")?;
        let kind = rest.get(4..8).ok_or("a GLB chunk header is cut off")?;
        let Some(data) = rest.get(8..).and_then(|data| data.get(..size)) else {
            return Err(format!(
                "it is cut off: a GLB chunk promises {size} bytes and there are {}",
                rest.len() - 8
            ));
        };
        match kind {
            JSON_CHUNK if text.is_none() => text = Some(data),
            BIN_CHUNK if binary.is_none() => binary = Some(data),
            _ => {}
        }
        rest = &rest[8 + size..];
    }
    Ok((text.ok_or("its GLB container has no JSON chunk")?, binary))
}

/// Little-endian u32 at a byte offset.
fn word(bytes: &[u8], offset: usize) -> Option<usize> {
    let word = bytes.get(offset..)?.first_chunk::<4>()?;
    usize::try_from(u32::from_le_bytes(*word)).ok()
}
