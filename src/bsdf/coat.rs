//! `KHR_materials_clearcoat`: a colourless GGX layer of index 1.5 with its own normal.
//!
//! What is under it is attenuated by `1 - strength * F` on the way in and on the way out; the
//! extension attenuates for the viewer's direction only, which is not reciprocal.

use glam::{Vec2, Vec3};

use super::SurfaceParameters;
use super::fresnel::{reflect, schlick_weight};
use super::microfacet::Ggx;
use super::sample::LobeSample;
use crate::math::Frame;

/// F0 of index of refraction 1.5.
pub(crate) const F0: f32 = 0.04;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Coat {
    strength: f32,
    pub(super) ggx: Ggx,
    /// Around the coat's normal, in the local frame.
    pub(super) frame: Frame,
    thin: bool,
    entering: bool,
}

impl Coat {
    const ABSENT: Self = Self {
        strength: 0.0,
        ggx: Ggx::SMOOTH,
        frame: Frame { x: Vec3::X, y: Vec3::Y, z: Vec3::Z },
        thin: true,
        entering: true,
    };

    pub(super) fn new(p: &SurfaceParameters, entering: bool) -> Self {
        if p.clearcoat == 0.0 {
            return Self::ABSENT;
        }
        let ggx = Ggx::from_roughness(p.clearcoat_roughness);
        let frame = Frame::from_z(p.clearcoat_normal);
        Self { strength: p.clearcoat, ggx, frame, thin: p.thin, entering }
    }

    pub(super) fn is_absent(&self) -> bool {
        self.strength == 0.0
    }

    pub(super) fn is_delta_or_absent(&self) -> bool {
        self.is_absent() || !self.is_outside(1.0) || self.ggx.is_smooth()
    }

    /// What passes the coat in direction `v`; directions inside of a solid do not meet it.
    pub(super) fn attenuation(&self, v: Vec3) -> f32 {
        if self.is_absent() || !self.is_outside(v.z) {
            return 1.0;
        }
        1.0 - self.strength * fresnel(v.dot(self.frame.z).abs())
    }

    /// Estimate of what the coat reflects towards `wo`.
    pub(super) fn albedo(&self, wo: Vec3) -> f32 {
        let cos = wo.dot(self.frame.z);
        let reflects = self.is_outside(wo.z) && cos > 0.0;
        if reflects { self.strength * fresnel(cos) } else { 0.0 }
    }

    /// A direction, given the probability with which the coat was chosen.
    pub(super) fn sample(&self, wo: Vec3, u: Vec2, probability: f32) -> Option<LobeSample> {
        let local = self.frame.local_from_world(wo);
        let smooth = self.ggx.is_smooth();
        let h = if smooth { Vec3::Z } else { self.ggx.sample_visible_normal(local, u) };
        let local_wi = reflect(local, h);
        let wi = self.frame.world_from_local(local_wi);
        if local_wi.z <= 0.0 || wi.z <= 0.0 {
            return None;
        }
        let delta = Vec3::splat(self.strength * fresnel(local.z) / probability);
        Some(if smooth { LobeSample::Coat(wi, delta) } else { LobeSample::Spread(wi) })
    }

    /// `f * cos` (against the coat's normal) and the density of [`Self::sample`]'s lobe.
    pub(super) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (f32, f32) {
        let (o, i) = (self.frame.local_from_world(wo), self.frame.local_from_world(wi));
        if self.ggx.is_smooth() || wi.z <= 0.0 || o.z <= 0.0 || i.z <= 0.0 {
            return (0.0, 0.0);
        }
        let h = (o + i).normalize();
        let common = self.ggx.distribution(h) * self.ggx.visibility(o);
        let value = self.strength * fresnel(o.dot(h)) * common * self.ggx.visibility(i) * i.z;
        // Visible normals over the Jacobian 4 (wo . h).
        (value, 0.5 * common)
    }

    fn is_outside(&self, z: f32) -> bool {
        self.thin || (z > 0.0) == self.entering
    }
}

fn fresnel(cos: f32) -> f32 {
    F0 + (1.0 - F0) * schlick_weight(cos)
}
