//! What the extension says.

use serde::Deserialize;

/// What the extension says of a buffer view.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in crate::scene::gltf) struct Packed {
    /// Where the packed bytes are.
    pub(in crate::scene::gltf) buffer: usize,
    #[serde(default)]
    pub(in crate::scene::gltf) byte_offset: u64,
    pub(in crate::scene::gltf) byte_length: u64,
    pub(super) byte_stride: usize,
    pub(super) count: u64,
    pub(super) mode: Mode,
    #[serde(default)]
    pub(super) filter: Filter,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum Mode {
    Attributes,
    Triangles,
    Indices,
}

/// What is to be done with attributes afterwards.
#[derive(Clone, Copy, Default, Deserialize, PartialEq)]
#[serde(rename_all = "UPPERCASE")]
pub(super) enum Filter {
    #[default]
    None,
    Octahedral,
    Quaternion,
    Exponential,
    Color,
}
