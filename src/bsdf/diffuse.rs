//! Lambert's lobes of the body: light that comes back from it, and light that comes through
//! (`KHR_materials_diffuse_transmission`). Both get what the interface leaves in both directions
//! (`albedo`).
//!
//! Into a solid as much comes through as out of it, as the extension says: of white light from
//! everywhere nothing is lost either way. That is not reciprocal by the squared index, as refraction
//! is; a white body would have to keep light in.

use std::f32::consts::FRAC_1_PI;

use glam::{Vec2, Vec3};

use super::SurfaceParameters;
use super::albedo::AlbedoTerms;
use super::interface::Interface;
use crate::color::importance;
use crate::math::sin_cos_turns;

/// The body under the opaque dielectric's share of the interface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Diffuse {
    /// Base colour times share, over what the interface lets in on average.
    reflected: Vec3,
    /// The same for light from the far side; radiance through a solid's surface scales by the squared
    /// relative index.
    transmitted: Vec3,
    /// Probability of choosing the far side.
    through: f32,
    /// The dielectric's largest F0 and its F90.
    f0_f90: Vec2,
    /// The interface's.
    pub(super) terms: AlbedoTerms,
}

impl Diffuse {
    /// `f0_f90` are the dielectric's; `terms` of its interface.
    pub(super) fn new(
        p: &SurfaceParameters,
        f0_f90: Vec2,
        terms: AlbedoTerms,
        interface: &Interface,
    ) -> Self {
        let share = (1.0 - p.metallic) * (1.0 - p.transmission);
        let reflected = p.base_color * (share * (1.0 - p.diffuse_transmission));
        let mut diffuse = Self { reflected, transmitted: Vec3::ZERO, through: 0.0, f0_f90, terms };
        if p.diffuse_transmission > 0.0 {
            let color = p.diffuse_transmission_color * (share * p.diffuse_transmission);
            diffuse.transmitted = color * interface.radiance_scale();
            let [back, through] = [reflected, diffuse.transmitted].map(importance);
            diffuse.through = if through > 0.0 { through / (back + through) } else { 0.0 };
        }
        if f0_f90.y > 0.0 && !diffuse.is_absent() {
            let let_in = diffuse.let_in();
            let scale = |color| if let_in > 1e-4 { color / let_in } else { Vec3::ZERO };
            diffuse.reflected = scale(diffuse.reflected);
            diffuse.transmitted = scale(diffuse.transmitted);
        }
        diffuse
    }

    /// Whether it is Lambert's reflection, of which no interface takes anything.
    pub(super) fn is_lambert(&self) -> bool {
        self.f0_f90 == Vec2::ZERO && self.reflected != Vec3::ZERO && self.transmitted == Vec3::ZERO
    }

    pub(super) fn is_absent(&self) -> bool {
        self.reflected == Vec3::ZERO && self.transmitted == Vec3::ZERO
    }

    /// What the interface leaves towards `v`, on either side.
    pub(super) fn left(&self, v: Vec3) -> f32 {
        if self.f0_f90 == Vec2::ZERO { 1.0 } else { self.left_of(self.terms.at(v)) }
    }

    /// The same, given the albedo terms there.
    pub(super) fn left_of(&self, terms: Vec2) -> f32 {
        (1.0 - self.f0_f90.dot(terms)).max(0.0)
    }

    /// Both lobes' albedo towards a viewer to whom the interface leaves `left`; a share of light, so
    /// the scale of radiance on its way through a solid's surface is taken back.
    pub(super) fn albedo(&self, left: f32, radiance_scale: Vec3) -> Vec3 {
        (self.reflected + self.transmitted / radiance_scale) * (left * self.let_in())
    }

    /// What the lobes weigh beside others, not counting what the interface leaves.
    pub(super) fn importance(&self) -> f32 {
        importance(self.reflected + self.transmitted)
    }

    /// A direction with density `cos / pi`, on the side that a uniform number chooses.
    pub(super) fn sample(&self, choice: f32, u: Vec2) -> Vec3 {
        let wi = cosine_hemisphere(u);
        if choice < self.through { -wi } else { wi }
    }

    /// `f * |cos wi|` for a viewer to whom the interface leaves `left`, and the density of
    /// [`Self::sample`].
    pub(super) fn eval_pdf(&self, left: f32, wi: Vec3) -> (Vec3, f32) {
        let lambert = wi.z.abs() * FRAC_1_PI;
        if wi.z > 0.0 {
            let left = left * self.left(wi);
            (self.reflected * (left * lambert), lambert * (1.0 - self.through))
        } else if self.through > 0.0 {
            let left = left * self.left(-wi);
            (self.transmitted * (left * lambert), lambert * self.through)
        } else {
            (Vec3::ZERO, 0.0)
        }
    }

    /// [`Self::eval_pdf`] where [`Self::is_lambert`].
    pub(super) fn lambert(&self, wi: Vec3) -> (Vec3, f32) {
        let lambert = wi.z.max(0.0) * FRAC_1_PI;
        (self.reflected * lambert, lambert)
    }

    fn let_in(&self) -> f32 {
        1.0 - self.f0_f90.dot(self.terms.mean())
    }
}

/// A direction around +Z with density `cos / pi`.
pub(crate) fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let (sin_phi, cos_phi) = sin_cos_turns(u.x);
    let r = u.y.sqrt();
    Vec3::new(r * cos_phi, r * sin_phi, (1.0 - u.y).max(0.0).sqrt())
}
