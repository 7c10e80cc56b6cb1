//! What guides of denoisers tell of the first surface, in mirrors and through glass.

use glam::Vec3;

use crate::bsdf::Bsdf;
use crate::color::importance;
use crate::scene::surface::SurfacePoint;

/// What the camera sees at the first surface that is not passed through, in mirrors and through glass. If these show
/// no surface, it is what they are themselves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FirstHit {
    /// Directional albedo estimate times what mirrors and glass leave of it, and what these add by reflection, linear
    /// RGB in `[0,1]`.
    pub albedo: Vec3,
    /// World shading normal towards where the ray came from.
    pub normal: Vec3,
    /// Metres along the ray, bent as it may be.
    pub depth: f32,
}

/// What the camera sees so far.
#[derive(Clone, Copy, Default)]
pub(super) struct Looks {
    first_hit: Option<FirstHit>,
    /// Metres gone to the last mirror or glass.
    pub(super) before: f32,
    /// Albedo that mirrors and glass take from what is seen by way of them, and what they have on the other way.
    taken: Vec3,
    added: Vec3,
    /// Whether the path went the way that carries less.
    pub(super) is_minor: bool,
}

impl Looks {
    /// The first surface, if the path tells one.
    pub(super) fn first_hit(&self) -> Option<FirstHit> {
        self.first_hit.filter(|_| !self.is_minor)
    }

    /// Keeps which way the path goes at a mirror or smooth glass that reflects and transmits so much.
    pub(super) fn go_by(&mut self, [reflected, transmitted]: [Vec3; 2], is_through: bool) {
        let transmits_more = importance(transmitted) > importance(reflected);
        let [lesser, larger] =
            if transmits_more { [reflected, transmitted] } else { [transmitted, reflected] };
        self.added += (1.0 - self.taken) * lesser;
        self.look_through(larger);
        self.is_minor |= is_through != transmits_more;
    }

    /// Dims what will be seen to this share.
    pub(super) fn look_through(&mut self, left: Vec3) {
        self.taken = 1.0 - (1.0 - self.taken) * left;
    }

    /// Keeps what a surface looks like, so many metres further on. Mirrors and smooth glass are kept until something is
    /// seen in them.
    pub(super) fn look_at(&mut self, point: &SurfacePoint<'_>, bsdf: &Bsdf, travelled: f32) {
        let parameters = &point.parameters;
        let is_interface = bsdf.is_delta_only() && !parameters.unlit;
        if is_interface && self.first_hit.is_some() {
            return;
        }
        let albedo = if parameters.unlit { parameters.base_color } else { bsdf.albedo() };
        let albedo = albedo * (1.0 - self.taken) + self.added;
        let (normal, depth) = (point.shading_frame.z, self.before + travelled);
        self.first_hit = Some(FirstHit { albedo, normal, depth });
    }
}
