//! The GGX microfacet distribution (Trowbridge-Reitz) with separable Smith masking (glTF 2.0 appendix
//! B.3.2; stretched: Heitz, *Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs*,
//! JCGT 3(2), 2014), in a frame whose z is the surface normal.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use crate::math::sin_cos_turns;

/// Below this GGX alpha a surface is taken as perfectly smooth: the lobe is narrower than any pixel
/// of an environment map, and f32 half vectors no longer resolve it.
pub(crate) const SMOOTH_ALPHA: f32 = 1e-3;

/// GGX of one width, or of two across each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ggx {
    /// Width across `axis`; not above `along`.
    pub(crate) alpha: f32,
    along: f32,
    /// Unit direction in the surface that `along` lies in.
    axis: Vec2,
}

impl Ggx {
    /// A perfect mirror.
    pub(crate) const SMOOTH: Self = Self { alpha: 0.0, along: 0.0, axis: Vec2::X };

    /// From glTF's perceptual roughness: alpha is its square.
    pub(crate) fn from_roughness(roughness: f32) -> Self {
        let alpha = roughness * roughness;
        Self { alpha, along: alpha, axis: Vec2::X }
    }

    /// Stretched along unit `axis` by a strength in `[0,1]` (`KHR_materials_anisotropy`).
    pub(crate) fn stretched(roughness: f32, strength: f32, axis: Vec2) -> Self {
        let ggx = Self::from_roughness(roughness);
        let along = ggx.alpha + (1.0 - ggx.alpha) * (strength * strength);
        if strength == 0.0 || along < SMOOTH_ALPHA {
            return ggx;
        }
        Self { alpha: ggx.alpha.max(SMOOTH_ALPHA), along, axis }
    }

    /// Whether this is a perfect mirror rather than a lobe.
    pub(crate) fn is_smooth(self) -> bool {
        self.alpha < SMOOTH_ALPHA
    }

    /// Whether the two widths differ.
    pub(crate) fn is_stretched(self) -> bool {
        self.along != self.alpha
    }

    /// How much they differ: 0 not at all, towards 1 without limit.
    pub(crate) fn stretch(self) -> f32 {
        1.0 - self.alpha / self.along
    }

    /// Density of normals `D(h)` per steradian for a unit `h` with `h.z >= 0`.
    pub(crate) fn distribution(self, h: Vec3) -> f32 {
        // Written with the sine so that narrow lobes do not cancel.
        if self.is_stretched() {
            let slopes = self.along_axis(h) / Vec2::new(self.along, self.alpha);
            let t = slopes.length_squared() + h.z * h.z;
            return 1.0 / (PI * self.along * self.alpha * t * t);
        }
        let a2 = self.alpha * self.alpha;
        let t = (h.x * h.x + h.y * h.y) / a2 + h.z * h.z;
        1.0 / (PI * a2 * t * t)
    }

    /// `G1(v) / (2 cos)` for a unit `v`, `v.z` not negative: half of Smith's masking over the cosine,
    /// finite at grazing angles. Two of them multiply to glTF's visibility term `V = G / (4 cos cos)`.
    pub(crate) fn visibility(self, v: Vec3) -> f32 {
        if self.is_stretched() {
            return 1.0 / (v.z + self.widened(v).length());
        }
        let a2 = self.alpha * self.alpha;
        1.0 / (v.z + (a2 + (1.0 - a2) * v.z * v.z).sqrt())
    }

    /// A normal visible from `wo` (unit, `z > 0`), by spherical caps (Dupuy and Benyoub, *Sampling
    /// Visible GGX Normals with Spherical Caps*, HPG 2023).
    pub(crate) fn sample_visible_normal(self, wo: Vec3, u: Vec2) -> Vec3 {
        let wo_std = self.widened(wo).normalize();
        let z = (1.0 - u.y) * (1.0 + wo_std.z) - wo_std.z;
        let r = (1.0 - z * z).max(0.0).sqrt();
        let (sin_phi, cos_phi) = sin_cos_turns(u.x);
        let h_std = Vec3::new(r * cos_phi, r * sin_phi, z) + wo_std;
        let (along, across) = (self.along * h_std.x, self.alpha * h_std.y);
        let flat = self.axis * along + self.axis.perp() * across;
        flat.extend(h_std.z.max(1e-7)).normalize()
    }

    /// Density per steradian (of normals) of [`Self::sample_visible_normal`].
    pub(crate) fn visible_normal_pdf_solid_angle(self, wo: Vec3, h: Vec3) -> f32 {
        2.0 * self.visibility(wo) * self.distribution(h) * wo.dot(h).max(0.0)
    }

    /// Perceptual roughness of the GGX of one width that masks as much towards `v`.
    pub(crate) fn roughness_towards(self, v: Vec3) -> f32 {
        let flat = self.along_axis(v).normalize_or(Vec2::X);
        self.roughness_off_axis(flat.x, flat.y)
    }

    /// The same at an angle to the axis, by its cosine and sine.
    pub(crate) fn roughness_off_axis(self, cos: f32, sin: f32) -> f32 {
        Vec2::new(self.along * cos, self.alpha * sin).length().sqrt()
    }

    /// Components along and across the axis.
    fn along_axis(self, v: Vec3) -> Vec2 {
        let flat = Vec2::new(v.x, v.y);
        Vec2::new(flat.dot(self.axis), flat.dot(self.axis.perp()))
    }

    /// A direction where the surface is stretched to the GGX of alpha 1.
    fn widened(self, v: Vec3) -> Vec3 {
        (self.along_axis(v) * Vec2::new(self.along, self.alpha)).extend(v.z)
    }
}
