//! Facts of a render kernel: what it holds and what was left out of it.

use super::features::Features;
use super::kernel::Kernel;
use super::shader::{ArrayPlaces, Constants, Program};
use super::texels::VertexTexels;
use crate::path::World;
use crate::render::gpu_facts::KernelFacts;

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
