//! From bytes to glTF's JSON: the GLB container, the version, the extensions asked for, the lists of objects.

use gltf::json;
use json::extensions::scene::khr_lights_punctual::Light;
use serde::Deserialize;

use super::limits::Fallible;
use super::objects::{Objects, member, members, not_gltf, read};
use super::{extensions, lenient};
use crate::error::Notices;
use crate::memory;

/// GLB chunk types (glTF 2.0, section 4.4.3).
const JSON_CHUNK: &[u8] = b"JSON";
const BIN_CHUNK: &[u8] = b"BIN\0";

/// What an object takes until something is made of it.
const BYTES_OF_OBJECT: u64 = 16;

/// What the JSON has. Only what is asked for is read, and validated where it is followed.
pub(super) struct Document<'a> {
    pub(super) accessors: Objects<'a, json::Accessor>,
    pub(super) animations: Objects<'a, json::Animation>,
    pub(super) buffers: Objects<'a, json::Buffer>,
    pub(super) buffer_views: Objects<'a, json::buffer::View>,
    pub(super) cameras: Objects<'a, json::Camera>,
    pub(super) images: Objects<'a, json::Image>,
    pub(super) lights: Objects<'a, Light>,
    pub(super) materials: Objects<'a, json::Material>,
    pub(super) meshes: Objects<'a, json::Mesh>,
    pub(super) nodes: Objects<'a, json::Node>,
    pub(super) samplers: Objects<'a, json::texture::Sampler>,
    /// The one that is shown, if one is named.
    pub(super) scene: Option<json::Index<json::Scene>>,
    pub(super) scenes: Objects<'a, json::Scene>,
    pub(super) skins: Objects<'a, json::Skin>,
    pub(super) textures: Objects<'a, json::Texture>,
    /// The program that has written the file, if it says so.
    pub(super) generator: Option<String>,
    /// The text of the extensions of the whole file.
    pub(super) extensions: &'a str,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Asset {
    generator: Option<String>,
    version: Option<String>,
    min_version: Option<String>,
}

impl<'a> Document<'a> {
    /// Finds the objects in the text of a `.gltf` or of a `.glb`'s JSON.
    pub(super) fn new(text: &'a str, notices: &mut Notices) -> Fallible<Self> {
        if text.len() > u32::MAX as usize {
            return Err("its JSON has more than 4 GiB".into());
        }
        let values = lenient::check_indices(text, extensions::SUPPORTED)?;
        memory::check(values.saturating_mul(BYTES_OF_OBJECT))?;
        let found = members(text)?;
        let of = |name: &str| found.get(name).copied();
        let generator = check_version(of("asset"))?;
        let names = |list| Objects::new(of(list), "extension");
        extensions::check(&names("extensionsUsed")?, &names("extensionsRequired")?, notices)?;
        let extensions = of("extensions").unwrap_or("{}");
        let lights = member(extensions, "KHR_lights_punctual")?;
        let lights = member(lights.unwrap_or("{}"), "lights")?;
        if of("animations").is_some() {
            notices.add("the file has animations: cameras alone follow theirs, in --frames; all else is at rest");
        }
        let scene = of("scene").map(read).transpose();
        Ok(Self {
            accessors: Objects::new(of("accessors"), "accessor")?,
            animations: Objects::new(of("animations"), "animation")?,
            buffers: Objects::new(of("buffers"), "buffer")?,
            buffer_views: Objects::new(of("bufferViews"), "buffer view")?,
            cameras: Objects::new(of("cameras"), "camera")?,
            images: Objects::new(of("images"), "image")?,
            lights: Objects::new(lights, "light")?,
            materials: Objects::new(of("materials"), "material")?,
            meshes: Objects::new(of("meshes"), "mesh")?,
            nodes: Objects::new(of("nodes"), "node")?,
            samplers: Objects::new(of("samplers"), "sampler")?,
            scene: scene.map_err(|cause| not_gltf(&format!("its scene: {cause}")))?,
            generator,
            scenes: Objects::new(of("scenes"), "scene")?,
            skins: Objects::new(of("skins"), "skin")?,
            textures: Objects::new(of("textures"), "texture")?,
            extensions,
        })
    }

    /// The scene that is shown, if the file has any.
    pub(super) fn shown_scene(&self) -> json::Index<json::Scene> {
        self.scene.unwrap_or(json::Index::new(0))
    }
}

/// The text of a `.gltf` or of a `.glb`'s JSON, and the GLB's binary chunk.
pub(super) fn split(bytes: &[u8]) -> Fallible<(&[u8], Option<&[u8]>)> {
    if bytes.is_empty() {
        return Err("the file is empty".into());
    }
    let (text, binary) = if bytes.starts_with(b"glTF") { split_glb(bytes)? } else { (bytes, None) };
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    // Some writers pad the JSON chunk with zeros instead of spaces.
    let padding = text.iter().rev().take_while(|&&byte| byte == 0).count();
    Ok((&text[..text.len() - padding], binary))
}

/// Refuses other versions; the program that has written the file, if it says so.
fn check_version(asset: Option<&str>) -> Fallible<Option<String>> {
    let asset = asset.ok_or("its JSON has no `asset`, so it is not glTF")?;
    let asset: Asset = read(asset).map_err(|cause| not_gltf(&format!("its asset: {cause}")))?;
    let version = asset.version.as_deref().unwrap_or("?");
    if version.split('.').next() != Some("2") {
        return Err(format!("it is glTF version {version}; only 2.0 can be read"));
    }
    if let Some(least) = asset.min_version.filter(|least| least != "2.0") {
        return Err(format!("it needs a reader for glTF {least}; only 2.0 can be read"));
    }
    Ok(asset.generator)
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
