//! How each target reads its input.

use std::fs;
use std::path::Path;

use lightgrid::scene::gltf;

use crate::corpus::container;
use crate::read::{self, Found};

/// Reads an input as its target does; `None` if there is no such target.
pub(crate) fn read(target: &str, bytes: &[u8], folder: &Path) -> Option<Found> {
    let written = |name: &str| {
        let path = folder.join(name);
        fs::write(&path, bytes).expect("written");
        path
    };
    Some(match target {
        "gltf" => scene(bytes),
        "meshopt" => meshopt_file(bytes).map_or_else(too_short, |file| scene(&file)),
        "draco" => draco_file(bytes).map_or_else(too_short, |file| scene(&file)),
        "textures" => read::texture(bytes, "a texture"),
        "exr" => read::map(&written("a.exr")),
        "hdr" => read::map(&written("a.hdr")),
        // TGA is the one format that is told by the name alone.
        "maps" => read::map(&written("a.tga")),
        #[cfg(feature = "window")]
        "settings" => crate::settings::read(&written("settings.json")),
        _ => return None,
    })
}

fn scene(bytes: &[u8]) -> Found {
    match gltf::load_slice(bytes, None, "a scene") {
        Ok(scene) => read::scene(&scene),
        Err(error) => Found::Refused(error.to_string()),
    }
}

fn too_short() -> Found {
    Found::Refused("too short".to_owned())
}

/// A mesh of bytes packed by meshoptimizer, before which are one that says the mode and the filter, one for
/// the stride and two for the count.
pub(crate) fn meshopt_file(bytes: &[u8]) -> Option<Vec<u8>> {
    let (&[kind, stride, low, high], packed) = bytes.split_first_chunk()?;
    let (count, stride) = (u16::from_le_bytes([low, high]), usize::from(stride) + 1);
    let mode = ["ATTRIBUTES", "TRIANGLES", "INDICES"][usize::from(kind % 3)];
    let filter = ["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"];
    let filter = filter[usize::from(kind / 3 % 5)];
    // Positions that indices can refer to.
    let points: Vec<[f32; 3]> = (0..64_u8).map(|i| [i, i % 7, i % 5].map(f32::from)).collect();
    let data = [bytemuck::cast_slice(&points), packed].concat();
    let (plain, length, total) = (data.len() - packed.len(), packed.len(), data.len());
    // A view's own stride is for vertices, and of some size.
    let view_stride = if mode == "ATTRIBUTES" && (12..253).contains(&stride) {
        format!(r#""byteStride":{stride},"#)
    } else {
        String::new()
    };
    let (component, kind, attributes) = match (mode, stride) {
        ("ATTRIBUTES", 8) => (5122, "VEC3", r#""attributes":{"POSITION":1}"#),
        ("ATTRIBUTES", _) => (5126, "VEC3", r#""attributes":{"POSITION":1}"#),
        (_, 2) => (5123, "SCALAR", r#""attributes":{"POSITION":0},"indices":1"#),
        _ => (5125, "SCALAR", r#""attributes":{"POSITION":0},"indices":1"#),
    };
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"extensionsUsed":["EXT_meshopt_compression"],
        "nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{{attributes}}}]}}],"accessors":[
        {{"bufferView":0,"componentType":5126,"type":"VEC3","count":{}}},
        {{"bufferView":1,"componentType":{component},"type":"{kind}","count":{count}}}],"bufferViews":[
        {{"buffer":0,"byteLength":{plain}}},{{"buffer":0,{view_stride}"byteLength":{},"extensions":
        {{"EXT_meshopt_compression":{{"buffer":0,"byteOffset":{plain},"byteLength":{length},
        "byteStride":{stride},"count":{count},"mode":"{mode}","filter":"{filter}"}}}}}}],
        "buffers":[{{"byteLength":{total}}}]}}"#,
        points.len(),
        usize::from(count) * stride,
    );
    Some(container(json, data))
}

/// A mesh packed by Draco, before which is a byte that says which attributes are promised.
pub(crate) fn draco_file(bytes: &[u8]) -> Option<Vec<u8>> {
    let (&promised, packed) = bytes.split_first()?;
    let optional = [("NORMAL", 1), ("TEXCOORD_0", 2), ("COLOR_0", 3)];
    let names: String = optional
        .iter()
        .filter(|(_, number)| promised >> number & 1 == 1)
        .map(|(name, number)| format!(r#","{name}":{number}"#))
        .collect();
    let float = |kind: &str| format!(r#"{{"componentType":5126,"type":"{kind}","count":1024}}"#);
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"extensionsUsed":["KHR_draco_mesh_compression"],
        "nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0{names}}},
        "indices":4,"extensions":{{"KHR_draco_mesh_compression":{{"bufferView":0,"attributes":
        {{"POSITION":0{names}}}}}}}}}]}}],"accessors":[{0},{0},{1},{2},
        {{"componentType":5125,"type":"SCALAR","count":3072}}],
        "bufferViews":[{{"buffer":0,"byteLength":{3}}}],"buffers":[{{"byteLength":{3}}}]}}"#,
        float("VEC3"),
        float("VEC2"),
        float("VEC4"),
        packed.len()
    );
    Some(container(json, packed.to_vec()))
}
