//! How vertices go from a mesh's space to the world.

use glam::{Affine3A, DAffine3, DMat3, Mat3A, Vec3, Vec3A, Vec4};

/// How positions, normals and tangents go from a mesh's space to the world.
#[derive(Debug, Clone, Copy)]
pub struct Placing {
    affine: Affine3A,
    /// Cofactors of the linear part with the sign of its determinant: the inverse transpose up to
    /// a positive factor, and still right where one axis is scaled to zero.
    normal: Mat3A,
    /// -1 where handedness is mirrored, else 1.
    handedness: f32,
}

impl Placing {
    /// From world-from-mesh.
    pub fn new(world_from_mesh: DAffine3) -> Self {
        let m = world_from_mesh.matrix3;
        let handedness = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
        let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis];
        // Scaled to unit size first: the cofactors of tiny or huge objects would leave f32.
        let scale = m.to_cols_array().iter().fold(0.0_f64, |largest, v| largest.max(v.abs()));
        let [x, y, z] = [x, y, z].map(|axis| if scale > 0.0 { axis / scale } else { axis });
        let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * handedness;
        Self {
            affine: world_from_mesh.as_affine3a(),
            normal: Mat3A::from(cofactors.as_mat3()),
            handedness: handedness as f32,
        }
    }

    /// World from mesh, rounded.
    pub fn affine(&self) -> Affine3A {
        self.affine
    }

    /// Whether triangles change their winding.
    pub fn mirrors(&self) -> bool {
        self.handedness < 0.0
    }

    /// Corners of a triangle that are counter-clockwise seen from the front.
    pub fn turned<T>(&self, [a, b, c]: [T; 3]) -> [T; 3] {
        if self.mirrors() { [a, c, b] } else { [a, b, c] }
    }

    /// World position.
    pub fn position(&self, position: Vec3) -> Vec3 {
        self.affine.transform_point3(position)
    }

    /// Unit world normal; zero stays zero.
    pub fn normal(&self, normal: Vec3) -> Vec3 {
        unit(Vec3::from(self.normal * Vec3A::from(normal)))
    }

    /// Unit world tangent with its handedness.
    pub fn tangent(&self, tangent: Vec4) -> Vec4 {
        let direction = unit(self.affine.transform_vector3(tangent.truncate()));
        let direction = if direction == Vec3::ZERO { Vec3::X } else { direction };
        direction.extend(tangent.w * self.handedness)
    }
}

/// Unit vector, zero if there is none; in f64, where the squares of tiny values do not vanish.
pub(super) fn unit(vector: Vec3) -> Vec3 {
    vector.as_dvec3().normalize_or_zero().as_vec3()
}
