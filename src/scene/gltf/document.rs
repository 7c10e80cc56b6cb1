//! From bytes to glTF's JSON objects: the GLB container, the version, the extensions asked for.

use gltf::json;
use serde_json::Value;

use super::Fallible;
use super::extensions;
use crate::error::Notices;

/// GLB chunk types (glTF 2.0, section 4.4.3).
const JSON_CHUNK: &[u8] = b"JSON";
const BIN_CHUNK: &[u8] = b"BIN\0";

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
    let mut value: Value = json::deserialize::from_slice(&text[..text.len() - padding])
        .map_err(|cause| format!("it is neither GLB nor valid glTF JSON ({cause})"))?;
    check_version(&value)?;
    extensions::check(&value, notices)?;
    // Animations of newer extensions would not even fit the types.
    if value.as_object_mut().and_then(|root| root.remove("animations")).is_some() {
        notices.add("the file has animations; its rest pose is shown");
    }
    let root = json::deserialize::from_value(value)
        .map_err(|cause| format!("its JSON does not describe glTF 2.0 ({cause})"))?;
    Ok((root, binary))
}

fn check_version(value: &Value) -> Fallible<()> {
    let asset = value.get("asset").ok_or("its JSON has no `asset`, so it is not glTF")?;
    let version = asset.get("version").and_then(Value::as_str).unwrap_or("?");
    if version.split('.').next() != Some("2") {
        return Err(format!("it is glTF version {version}; only 2.0 can be read"));
    }
    match asset.get("minVersion").and_then(Value::as_str) {
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
