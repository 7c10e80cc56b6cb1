//! What the camera sees where it sees no surface.

use std::f32::consts::FRAC_PI_2;

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use crate::environment::Environment;
use crate::math::{Frame, sin_cos_turns};

/// What camera rays find that leave the scene, straight or through panes; surfaces are lit by the map
/// in any case.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Background {
    /// The map.
    #[default]
    Map,
    /// The map out of focus: directions are spread by about this many radians.
    Blurred(f32),
    /// One radiance everywhere, linear RGB.
    Color([f32; 3]),
    /// Nothing: pictures have an alpha channel.
    None,
}

impl Background {
    /// Radiance along a unit direction, from a random point of the unit square.
    pub fn radiance(self, environment: &Environment, direction: Vec3, u: Vec2) -> Vec3 {
        match self {
            Self::Map => environment.radiance(direction),
            Self::Blurred(radians) => {
                environment.radiance(spread(direction, concentration(radians), u))
            }
            Self::Color(rgb) => rgb.into(),
            Self::None => Vec3::ZERO,
        }
    }
}

/// Concentration of the von Mises-Fisher distribution whose standard deviation along one axis is
/// about this.
pub(crate) fn concentration(radians: f32) -> f32 {
    radians.clamp(1e-3, FRAC_PI_2).powi(-2)
}

/// A direction around this one by the von Mises-Fisher distribution (Jakob, *Numerically stable
/// sampling of the von Mises-Fisher distribution on S2 (and other tricks)*, 2012).
pub(crate) fn spread(direction: Vec3, concentration: f32, u: Vec2) -> Vec3 {
    let share = u.x + (1.0 - u.x) * (-2.0 * concentration).exp();
    let cos = (1.0 + share.max(1e-30).ln() / concentration).clamp(-1.0, 1.0);
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    let (sin_phi, cos_phi) = sin_cos_turns(u.y);
    Frame::from_z(direction).world_from_local(Vec3::new(sin * cos_phi, sin * sin_phi, cos))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of a von Mises-Fisher distribution is `coth(k) - 1/k` long.
    #[test]
    fn directions_spread_as_much_as_they_should() {
        for radians in [0.02_f32, 0.2, 0.8] {
            let k = concentration(radians);
            let count = 4096;
            let mean: Vec3 = (0..count)
                .map(|i| {
                    let n = i as f32 + 0.5;
                    let u = Vec2::new(n / count as f32, (n * 0.618_034).fract());
                    spread(Vec3::Y, k, u)
                })
                .sum::<Vec3>()
                / count as f32;
            let expected = 1.0 / k.tanh() - 1.0 / k;
            assert!((mean.y - expected).abs() < 2e-3, "{radians}: {mean} {expected}");
            assert!(mean.x.abs() < 5e-3 && mean.z.abs() < 5e-3, "{radians}: {mean}");
        }
    }
}
