//! Tangents along texture u, for normal maps and brushed metals.

use glam::Vec3;

use super::mesh::Builder;

/// Sums over the triangles of a vertex, weighted by area.
#[derive(Clone, Copy, Default)]
struct Around {
    /// Direction in which u grows.
    along: Vec3,
    /// Direction in which v grows.
    across: Vec3,
    normal: Vec3,
}

impl Builder {
    /// Gives each vertex a tangent: the mean direction in which u grows over its triangles. No vertex is split,
    /// since in no shape do mirrored halves of a texture share a vertex.
    pub(super) fn add_tangents(&mut self) {
        let scene = &mut self.scene;
        let mut around = vec![Around::default(); scene.positions.len()];
        for corners in &scene.triangles {
            let [a, b, c] = corners.map(|i| i as usize);
            let (positions, uvs) = (&scene.positions, &scene.uvs[0]);
            let (p, q) = (positions[b] - positions[a], positions[c] - positions[a]);
            let (s, t) = (uvs[b] - uvs[a], uvs[c] - uvs[a]);
            let sign = s.perp_dot(t).signum();
            for i in [a, b, c] {
                around[i].along += (p * t.y - q * s.y) * sign;
                around[i].across += (q * s.x - p * t.x) * sign;
                around[i].normal += p.cross(q);
            }
        }
        let tangent = |(shading, Around { along, across, normal }): (&Vec3, Around)| {
            // Flat corners have the normal of their triangle.
            let normal = shading.normalize_or(normal.normalize_or(Vec3::Y));
            let along = along - normal * along.dot(normal);
            let along = along.normalize_or(normal.any_orthonormal_vector());
            let is_mirrored = normal.cross(along).dot(across) < 0.0;
            along.extend(if is_mirrored { -1.0 } else { 1.0 })
        };
        scene.tangents = scene.normals.iter().zip(around).map(tangent).collect();
    }
}
