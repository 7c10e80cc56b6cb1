//! Rays and where they meet triangles.

use glam::{IVec3, Vec2, Vec3};

/// Points `origin + t * direction` with `t_min <= t <= t_max`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Start; a ray whose origin is not finite hits nothing.
    pub origin: Vec3,
    /// Direction, not necessarily of unit length; a zero or infinite one hits nothing.
    pub direction: Vec3,
    /// Least distance in lengths of `direction`, 0 or more.
    pub t_min: f32,
    /// Greatest distance in lengths of `direction`; may be infinite.
    pub t_max: f32,
}

/// Where a ray meets a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Hit {
    /// Distance in lengths of the ray's direction.
    pub t: f32,
    /// Index in the triangle list the tree was built from; of an instance's triangles their number.
    pub triangle: u32,
    /// Weights of vertices 1 and 2; vertex 0 has the rest. Each in `[0,1]` up to rounding.
    pub barycentric: Vec2,
}

/// Origin for a ray leaving a surface: `position` nudged along the unit `geometric_normal`, away
/// from rounding errors of the hit (Waechter and Binder, *A Fast and Robust Method for Avoiding
/// Self-Intersection*, Ray Tracing Gems 2019, chapter 6). Flip the normal to leave on the other side.
///
/// The nudge is about 2^-16 of each coordinate, and 2^-16 units within 1/32 unit of an axis' zero.
pub fn offset_origin(position: Vec3, geometric_normal: Vec3) -> Vec3 {
    const NEAR_ZERO: f32 = 1.0 / 32.0;
    const FLOAT_SCALE: f32 = 1.0 / 65536.0;
    const INT_SCALE: f32 = 256.0;
    let steps: IVec3 = (geometric_normal * INT_SCALE).as_ivec3();
    Vec3::from_array(std::array::from_fn(|axis| {
        let p = position[axis];
        if p.abs() < NEAR_ZERO {
            return p + FLOAT_SCALE * geometric_normal[axis];
        }
        let away_from_zero = if p < 0.0 { -steps[axis] } else { steps[axis] };
        f32::from_bits(p.to_bits().wrapping_add_signed(away_from_zero))
    }))
}
