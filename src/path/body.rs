//! What rays travel through.

use crate::bvh::Ray;
use crate::medium::{Fog, Interior};

/// What a ray is in.
#[derive(Clone, Copy)]
pub(super) struct Body {
    /// What a solid is filled with; `None` outside of solids.
    pub(super) interior: Option<Interior>,
    /// Squared index of refraction, by which radiance, hence throughput, is smaller than in air.
    pub(super) squared_index: f32,
}

impl Body {
    pub(super) const AIR: Self = Self { interior: None, squared_index: 1.0 };

    /// What fills the first `distance` metres of a ray, and where. Rays that leave the scene from
    /// inside of a body have met a mesh with holes: nothing is absorbed on their infinite way.
    pub(super) fn stretch(
        &self,
        fog: Option<&Fog>,
        ray: &Ray,
        distance: f32,
    ) -> Option<(Interior, f32, f32)> {
        let Some(interior) = self.interior else {
            let (from, to) = fog?.stretch(ray.origin, ray.direction, distance)?;
            return Some((fog?.interior, from, to));
        };
        (!interior.is_clear() && distance.is_finite()).then_some((interior, 0.0, distance))
    }
}
