//! What sampling finds.

use glam::Vec3;

/// A direction drawn by [`super::Bsdf::sample`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BsdfSample {
    /// Unit direction the light comes from, local.
    pub wi: Vec3,
    /// `f * |cos wi| / pdf`; through a solid's surface radiance scales by the squared relative index
    /// of refraction, so this may exceed 1 on the way out and is below it on the way in.
    pub weight: Vec3,
    /// Density per steradian, as [`super::Bsdf::pdf_solid_angle`]; 1 and meaningless if `is_delta`.
    pub pdf_solid_angle: f32,
    /// A perfect reflection or refraction, which no other technique can find.
    pub is_delta: bool,
    /// Whether `wi` is on the far side.
    pub is_transmission: bool,
}

/// What sampling one lobe found.
#[derive(Debug, Clone, Copy)]
pub(super) enum LobeSample {
    /// A direction with a density, to be evaluated with all lobes.
    Spread(Vec3),
    /// Perfect reflection of the coat: direction and weight.
    Coat(Vec3, Vec3),
    /// Perfect reflection or refraction of the interface: direction and `f * |cos|` over the
    /// probability of having chosen it within the interface.
    Interface(Vec3, Vec3),
}

impl BsdfSample {
    /// A direction, given the scattering and the density there.
    pub(super) fn spread(wi: Vec3, (value, pdf_solid_angle): (Vec3, f32)) -> Option<Self> {
        let weight = value / pdf_solid_angle;
        let is_transmission = wi.z < 0.0;
        let sample = Self { wi, weight, pdf_solid_angle, is_delta: false, is_transmission };
        (pdf_solid_angle > 0.0 && weight.is_finite()).then_some(sample)
    }

    /// A perfect reflection or refraction.
    pub(super) fn delta(wi: Vec3, weight: Vec3) -> Option<Self> {
        let (pdf_solid_angle, is_transmission) = (1.0, wi.z < 0.0);
        let sample = Self { wi, weight, pdf_solid_angle, is_delta: true, is_transmission };
        (weight.is_finite() && weight != Vec3::ZERO).then_some(sample)
    }
}
