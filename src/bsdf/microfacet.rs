//! The GGX microfacet distribution (Trowbridge-Reitz), isotropic, with separable Smith masking
//! (glTF 2.0 appendix B.3.2), in a frame whose z is the surface normal.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use crate::math::sin_cos_turns;

/// Below this GGX alpha a surface is taken as perfectly smooth: the lobe is narrower than any pixel
/// of an environment map, and f32 half vectors no longer resolve it.
pub(super) const SMOOTH_ALPHA: f32 = 1e-3;

/// GGX of one width.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ggx {
    alpha: f32,
}

impl Ggx {
    /// From glTF's perceptual roughness: alpha is its square.
    pub(crate) fn from_roughness(roughness: f32) -> Self {
        Self { alpha: roughness * roughness }
    }

    /// Whether this is a perfect mirror rather than a lobe.
    pub(crate) fn is_smooth(self) -> bool {
        self.alpha < SMOOTH_ALPHA
    }

    /// Density of normals `D(h)` per steradian for a unit `h` with `h.z >= 0`.
    pub(crate) fn distribution(self, h: Vec3) -> f32 {
        // Written with the sine so that narrow lobes do not cancel.
        let a2 = self.alpha * self.alpha;
        let t = (h.x * h.x + h.y * h.y) / a2 + h.z * h.z;
        1.0 / (PI * a2 * t * t)
    }

    /// `G1(v) / (2 cos)`: half of Smith's masking over the cosine, finite at grazing angles.
    /// Two of them multiply to glTF's visibility term `V = G / (4 cos cos)`.
    pub(crate) fn visibility(self, cos: f32) -> f32 {
        let a2 = self.alpha * self.alpha;
        1.0 / (cos + (a2 + (1.0 - a2) * cos * cos).sqrt())
    }

    /// A normal visible from `wo` (unit, `z > 0`), by spherical caps (Dupuy and Benyoub, *Sampling
    /// Visible GGX Normals with Spherical Caps*, HPG 2023).
    pub(crate) fn sample_visible_normal(self, wo: Vec3, u: Vec2) -> Vec3 {
        let wo_std = Vec3::new(self.alpha * wo.x, self.alpha * wo.y, wo.z).normalize();
        let z = (1.0 - u.y) * (1.0 + wo_std.z) - wo_std.z;
        let r = (1.0 - z * z).max(0.0).sqrt();
        let (sin_phi, cos_phi) = sin_cos_turns(u.x);
        let h_std = Vec3::new(r * cos_phi, r * sin_phi, z) + wo_std;
        Vec3::new(self.alpha * h_std.x, self.alpha * h_std.y, h_std.z.max(1e-7)).normalize()
    }

    /// Density per steradian (of normals) of [`Self::sample_visible_normal`].
    pub(crate) fn visible_normal_pdf_solid_angle(self, wo: Vec3, h: Vec3) -> f32 {
        2.0 * self.visibility(wo.z) * self.distribution(h) * wo.dot(h).max(0.0)
    }
}
