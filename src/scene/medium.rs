//! What fills the space between surfaces.

use glam::Vec3;
use serde::{Deserialize, Serialize};

/// A homogeneous medium, like fog: the same everywhere in its box, and outside of solid bodies.
/// All zero is clear air.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Medium {
    /// Scattering coefficient per metre, linear RGB, not negative: one over the mean way of light
    /// between two scatterings.
    pub scattering: Vec3,
    /// Absorption coefficient per metre, linear RGB, not negative.
    pub absorption: Vec3,
    /// Mean cosine of Henyey and Greenstein's phase function: 0 scatters to all sides alike, towards
    /// 1 ever more forward, towards -1 back. Beyond +-0.99 it is clamped.
    pub anisotropy: f32,
    /// Lower and upper corner in metres; `None` is the box around the scene. There is no medium
    /// without end: it would hide the map, which is infinitely far away.
    pub bounds: Option<[Vec3; 2]>,
}

impl Medium {
    /// Whether all numbers are in range and the box, if any, has a volume.
    pub fn is_sound(&self) -> bool {
        [self.scattering, self.absorption].iter().all(|c| c.is_finite() && c.min_element() >= 0.0)
            && self.anisotropy.abs() <= 1.0
            && self.bounds.is_none_or(|[low, high]| {
                low.is_finite() && high.is_finite() && low.cmplt(high).all()
            })
    }
}
