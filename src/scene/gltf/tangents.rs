//! Tangents of normal-mapped parts, made by MikkTSpace where the file has none.

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{Affine2, Vec2, Vec3, Vec4};

use super::part::Part;
use crate::math::Frame;
use crate::scene::placing::unit;

/// Stands where no tangent is read: a unit vector all the same.
pub(super) const NO_TANGENT: Vec4 = Vec4::new(1.0, 0.0, 0.0, 1.0);

/// Fills `part.tangents` from one UV set, read through `transform` as the normal map is.
///
/// MikkTSpace gives a tangent per corner. Where the corners of a vertex differ (a seam, mirrored
/// texture coordinates, flat shading) the vertex is split.
pub(super) fn generate(part: &mut Part, uv_set: usize, transform: Affine2) {
    let uvs = part.uvs[uv_set].iter().map(|&uv| transform.transform_point2(uv)).collect();
    let mut corners = Corners { part, uvs, tangents: vec![[NO_TANGENT; 3]; part.triangles.len()] };
    // The error type has no values: MikkTSpace cannot fail.
    if is_crowded(part) || generate_tangents(&mut corners).is_err() {
        corners.take_gradients();
    }
    let tangents = corners.tangents;
    split(part, &tangents);
}

/// Whether so many triangles meet in single points that MikkTSpace, quadratic in their number,
/// would take seconds (measured: 3 s for 3e8 pairs).
fn is_crowded(part: &Part) -> bool {
    const MAX_PAIRS: u64 = 200_000_000;
    let corners = part.triangles.as_flattened();
    if (corners.len() as u64).pow(2) <= MAX_PAIRS {
        return false;
    }
    let position = |&vertex: &u32| part.positions[vertex as usize].to_array().map(f32::to_bits);
    let mut positions: Vec<[u32; 3]> = corners.iter().map(position).collect();
    positions.sort_unstable();
    let pairs = positions.chunk_by(|a, b| a == b).map(|same| (same.len() as u64).pow(2));
    pairs.sum::<u64>() > MAX_PAIRS
}

/// A part as MikkTSpace sees it; flat corners have their triangle's normal.
struct Corners<'a> {
    part: &'a Part,
    uvs: Vec<Vec2>,
    tangents: Vec<[Vec4; 3]>,
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

    /// Gives each triangle the direction in which its own u grows, without smoothing.
    fn take_gradients(&mut self) {
        for face in 0..self.part.triangles.len() {
            let [a, b, c] = [0, 1, 2].map(|corner| self.part.positions[self.vertex(face, corner)]);
            let [r, s, t] = [0, 1, 2].map(|corner| Vec2::from(self.tex_coord(face, corner)));
            let (s, t) = (s - r, t - r);
            let mirror = s.perp_dot(t).signum();
            let direction = ((b - a) * t.y - (c - a) * s.y) * mirror;
            for corner in 0..3 {
                // Handedness for v pointing down, as below.
                let normal = self.corner_normal(face, corner);
                let along = unit(direction - normal * normal.dot(direction));
                self.tangents[face][corner] = if along == Vec3::ZERO || !along.is_finite() {
                    Frame::from_z(normal).x.extend(1.0)
                } else {
                    along.extend(-mirror)
                };
            }
        }
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
        self.tangents[face][corner] = tangent;
    }
}

/// Gives each vertex the tangent of its corners, with a copy of it for each further tangent.
fn split(part: &mut Part, tangents: &[[Vec4; 3]]) {
    const NONE: u32 = u32::MAX;
    let mut of_vertex: Vec<Option<Vec4>> = vec![None; part.positions.len()];
    // Copies of a vertex form a chain.
    let mut next_copy = vec![NONE; part.positions.len()];
    for (face, tangents) in tangents.iter().enumerate() {
        for (corner, &wanted) in tangents.iter().enumerate() {
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
    part.tangents = of_vertex.into_iter().map(|t| t.unwrap_or(NO_TANGENT)).collect();
}
