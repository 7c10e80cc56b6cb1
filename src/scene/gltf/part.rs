//! Parts: triangles in a mesh's own space, with the vertices they use.

use glam::{Vec2, Vec3, Vec4};

use crate::scene::lists::again;

/// The triangles of one primitive with the vertices they use. Arrays of vertex data are empty
/// where the primitive does not have it, else as long as `positions`.
#[derive(Default)]
pub(super) struct Part {
    pub(super) positions: Vec<Vec3>,
    /// Unit normals, zero where the file's are unusable.
    pub(super) normals: Vec<Vec3>,
    pub(super) tangents: Vec<Vec4>,
    pub(super) uvs: [Vec<Vec2>; 2],
    pub(super) colors: Vec<Vec4>,
    /// Joint and weight, `influences_per_vertex` of them for each vertex, weights summing to 1.
    pub(super) influences: Vec<(u32, f32)>,
    pub(super) influences_per_vertex: usize,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Place in the scene's materials.
    pub(super) material: u32,
}

impl Part {
    /// Bytes that it takes, about.
    pub(super) fn bytes(&self) -> u64 {
        const BYTES_OF_VERTEX: usize = 72;
        let bytes = size_of_val(&self.triangles[..]) + BYTES_OF_VERTEX * self.positions.len();
        (bytes + size_of_val(&self.influences[..])) as u64
    }

    /// Appends a copy of a vertex and returns its number.
    pub(super) fn copy_vertex(&mut self, vertex: u32) -> u32 {
        let copied = self.positions.len() as u32;
        let vertex = vertex as usize;
        again(&mut self.positions, vertex);
        again(&mut self.normals, vertex);
        self.uvs.iter_mut().for_each(|uvs| again(uvs, vertex));
        again(&mut self.colors, vertex);
        let stride = self.influences_per_vertex;
        self.influences.extend_from_within(vertex * stride..(vertex + 1) * stride);
        copied
    }
}

/// What was repaired or skipped, to be said once at the end.
#[derive(Default)]
pub(super) struct Tally {
    pub(super) points: usize,
    pub(super) lines: usize,
    pub(super) without_positions: usize,
    pub(super) dropped_triangles: usize,
    pub(super) bad_normals: usize,
    pub(super) bad_values: usize,
    pub(super) short_attributes: usize,
    pub(super) copied_instances: usize,
    pub(super) copied_triangles: usize,
}
