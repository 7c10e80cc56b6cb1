//! What is told of a picture's kernel.

use serde::Serialize;

use super::features::Features;
use super::kernel::Kernel;
use super::shader::{ArrayPlaces, Constants, Program, VertexTexels};
use crate::path::World;

/// What the render kernel of a picture holds and what was left out of it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct KernelFacts {
    /// Features it was built with.
    pub features: Vec<String>,
    /// Features it does without.
    pub left_out: Vec<String>,
    /// Bytes of its source.
    pub source_bytes: usize,
    /// Bytes of the source with every feature.
    pub full_source_bytes: usize,
    /// Bytes of a vertex on the device.
    pub vertex_bytes: u32,
    /// Bytes of a vertex with everything a scene can have.
    pub full_vertex_bytes: u32,
}

impl KernelFacts {
    /// Of the kernel for these features.
    pub(crate) fn of(features: Features) -> Self {
        let bytes_of = |features| {
            let vertex = VertexTexels::of(features);
            let constants = Constants { vertex, ..Constants::default() };
            let places = ArrayPlaces::default();
            let program = Program::new(Kernel::Render, features, &constants, &places);
            (program.source.len(), 16 * vertex.count)
        };
        let (source_bytes, vertex_bytes) = bytes_of(features);
        let (full_source_bytes, full_vertex_bytes) = bytes_of(Features::most());
        let names: Vec<_> = features.names().collect();
        let left_out = Features::most().names().filter(|name| !names.contains(name));
        Self {
            features: names.iter().map(|name| name.to_lowercase()).collect(),
            left_out: left_out.map(str::to_lowercase).collect(),
            source_bytes,
            full_source_bytes,
            vertex_bytes,
            full_vertex_bytes,
        }
    }

    /// Of the kernel for a scene with a map that is not black, with the defaults of `render`.
    pub fn of_scene(world: &World) -> Self {
        Self::of(Features::by_default(world))
    }
}
