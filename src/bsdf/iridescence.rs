//! `KHR_materials_iridescence`: a thin film on the interface, whose reflections interfere.
//!
//! Belcour and Barla, *A Practical Extension to Microfacet Theory for the Modeling of Varying
//! Iridescence*, SIGGRAPH 2017, in the form of the extension's appendix: two orders of interference,
//! Gaussians in the spectrum for the eye's sensitivities. The outer interface is Fresnel's instead of
//! Schlick's, which would be there even with a film of index 1.

use std::f32::consts::TAU;

use glam::Vec3;

use super::SurfaceParameters;
use super::fresnel::{dielectric, normal_reflectance, schlick_weight};
use crate::color::REC709_FROM_XYZ;
use crate::math::sin_cos_turns;

/// The film of one point. Air is outside of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Film {
    /// Share of the surface that it covers, in `[0,1]`.
    pub(super) share: f32,
    ior: f32,
    /// Micrometres.
    thickness: f32,
}

impl Film {
    pub(crate) fn new(p: &SurfaceParameters) -> Self {
        // A film much thinner than light's waves is not there.
        let t = (p.iridescence_thickness / 0.03).clamp(0.0, 1.0);
        let ior = 1.0 + (p.iridescence_ior.max(1.0) - 1.0) * (t * t * (3.0 - 2.0 * t));
        Self { share: p.iridescence, ior, thickness: 1e-3 * p.iridescence_thickness }
    }

    pub(super) fn is_absent(&self) -> bool {
        self.share == 0.0
    }

    /// Reflectance of film and base, in `[0,1]`, seen from outside at this cosine; `f0` is the base's
    /// in air.
    pub(crate) fn reflectance(&self, cos: f32, f0: Vec3) -> Vec3 {
        let cos = cos.clamp(0.0, 1.0);
        let cos_inside = (1.0 - (1.0 - cos * cos) / (self.ior * self.ior)).max(0.0).sqrt();
        let schlick = |f0: f32, cos: f32| f0 + (1.0 - f0) * schlick_weight(cos);
        let outer = dielectric(cos, self.ior).unwrap_or(1.0);
        let through = 1.0 - outer;
        let roots = f0.clamp(Vec3::ZERO, Vec3::splat(0.9999)).map(f32::sqrt);
        let base_ior = (1.0 + roots) / (1.0 - roots);
        let inner = (base_ior / self.ior).map(|eta| schlick(normal_reflectance(eta), cos_inside));
        // Half a turn of phase where light is reflected back into the film: at its outer side, and at
        // a base that is less dense.
        let signs = base_ior.map(|ior| if ior < self.ior { 1.0 } else { -1.0 });
        let path = 2.0 * self.ior * self.thickness * cos_inside;
        let both = (outer * inner).min(Vec3::splat(0.9999));
        let mean = through * through * inner / (1.0 - both);
        let mut sum = outer + mean;
        let mut order = mean - through;
        for m in 1..=2 {
            order *= both.map(f32::sqrt);
            let signs = if m == 1 { signs } else { Vec3::ONE };
            sum += order * 2.0 * sensitivity(m as f32 * path, signs);
        }
        sum.clamp(Vec3::ZERO, Vec3::ONE)
    }

    /// The F0 with which a dielectric without film reflects as much as this one at least, at every
    /// angle: its body has to do with the rest.
    pub(super) fn largest_f0(&self, f0: Vec3, specular: f32) -> f32 {
        const COSINES: usize = 12;
        let bound = |cos: f32| {
            let weight = schlick_weight(cos);
            let plain = f0 * specular + (specular - f0 * specular) * weight;
            let mixed = plain.lerp(self.reflectance(cos, f0) * specular, self.share);
            (mixed.max_element() - specular * weight) / (1.0 - weight)
        };
        let cosines = (1..=COSINES).map(|i| i as f32 / COSINES as f32);
        cosines.map(bound).fold(0.0, f32::max).min(specular)
    }
}

/// Fourier transform of the eye's sensitivities at an optical path in micrometres, linear Rec.709;
/// 1 at no path at all.
fn sensitivity(path: f32, signs: Vec3) -> Vec3 {
    let phase = TAU * path;
    let cosine = |position: f32| sin_cos_turns(position * path).1;
    // Weights, positions and variances of the extension's Gaussians, per micrometre.
    let weight = Vec3::new(0.846_590, 1.000_221_9, 1.001_122_5);
    let position = Vec3::new(1.681_0, 1.795_3, 2.208_4);
    let variance = Vec3::new(4.327_8e-3, 9.304_6e-3, 6.612_1e-3);
    let square = phase * phase;
    let mut xyz = weight * position.map(cosine) * (-square * variance).exp();
    xyz.x += 0.153_868_3 * cosine(2.239_9) * (-square * 4.528_2e-3).exp();
    REC709_FROM_XYZ * (xyz * signs)
}
