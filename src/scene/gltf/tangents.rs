//! Tangents of normal-mapped parts, made by MikkTSpace where the file has none.

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{Affine2, Vec2, Vec3, Vec4};

use super::geometry::Part;
use crate::math::Frame;

/// Fills `part.tangents` from one UV set, read through `transform` as the normal map is.
///
/// MikkTSpace gives a tangent per corner. Where the corners of a vertex differ (a seam, mirrored
/// texture coordinates, flat shading) the vertex is split.
pub(super) fn generate(part: &mut Part, uv_set: usize, transform: Affine2) {
    let uvs = part.uvs[uv_set].iter().map(|&uv| transform.transform_point2(uv)).collect();
    let mut corners = Corners { part, uvs, tangents: vec![None; part.triangles.len()] };
    // The error type has no values: this cannot fail.
    if generate_tangents(&mut corners).is_err() {
        return;
    }
    let tangents = corners.tangents;
    split(part, &tangents);
}

/// A part as MikkTSpace sees it; flat corners have their triangle's normal.
struct Corners<'a> {
    part: &'a Part,
    uvs: Vec<Vec2>,
    tangents: Vec<Option<[Vec4; 3]>>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.part.triangles[face][corner] as usize
    }

    /// Shading normal of a corner: the vertex's, or the triangle's where that is zero.
    fn corner_normal(&self, face: usize, corner: usize) -> Vec3 {
        let normal = self.part.normals.get(self.vertex(face, corner)).copied().unwrap_or_default();
        if normal != Vec3::ZERO {
            return normal;
        }
        let [a, b, c] = [0, 1, 2].map(|corner| self.part.positions[self.vertex(face, corner)]);
        (b - a).cross(c - a).normalize_or(Vec3::Z)
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.part.triangles.len()
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.part.positions[self.vertex(face, corner)].to_array()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.corner_normal(face, corner).to_array()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        self.uvs.get(self.vertex(face, corner)).copied().unwrap_or_default().to_array()
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        let space = space.map(|space| Vec4::from_array(space.tangent_encoded()));
        let tangent = match space.filter(|t| t.is_finite() && t.truncate() != Vec3::ZERO) {
            // MikkTSpace takes v to point up, glTF has it point down: the handedness changes.
            Some(t) => t.truncate().extend(-t.w),
            None => Frame::from_z(self.corner_normal(face, corner)).x.extend(1.0),
        };
        self.tangents[face].get_or_insert_default()[corner] = tangent;
    }
}

/// Gives each vertex the tangent of its corners, with a copy of it for each further tangent.
fn split(part: &mut Part, tangents: &[Option<[Vec4; 3]>]) {
    const NONE: u32 = u32::MAX;
    let mut of_vertex: Vec<Option<Vec4>> = vec![None; part.positions.len()];
    // Copies of a vertex form a chain.
    let mut next_copy = vec![NONE; part.positions.len()];
    for face in 0..part.triangles.len() {
        for corner in 0..3 {
            let wanted = tangents[face].map_or(Vec4::X + Vec4::W, |tangents| tangents[corner]);
            let mut vertex = part.triangles[face][corner];
            loop {
                let known = &mut of_vertex[vertex as usize];
                if *known.get_or_insert(wanted) == wanted {
                    break;
                }
                if next_copy[vertex as usize] == NONE {
                    next_copy[vertex as usize] = part.copy_vertex(vertex);
                    of_vertex.push(None);
                    next_copy.push(NONE);
                }
                vertex = next_copy[vertex as usize];
            }
            part.triangles[face][corner] = vertex;
        }
    }
    part.tangents = of_vertex.into_iter().map(|t| t.unwrap_or(Vec4::X + Vec4::W)).collect();
}
