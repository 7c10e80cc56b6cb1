//! White balance: the colour of light that is shown as white.

use std::ops::RangeInclusive;

use glam::{Mat3, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::color::REC709_FROM_XYZ;
use crate::image::Image;

/// Colour temperature of Rec.709's white, D65, in kelvin.
pub const DAYLIGHT_KELVIN: f32 = 6504.0;

/// Range of colour temperatures, in kelvin.
pub const KELVIN: RangeInclusive<f32> = 2000.0..=12000.0;
/// Range of tints.
pub const TINT: RangeInclusive<f32> = -1.0..=1.0;

with_defaults! {
    /// The light that is shown as white: daylight or a black body of a correlated colour temperature. The default
    /// changes no colours.
    #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
    pub struct WhiteBalance {
        /// Within [`KELVIN`]; lower values make a picture cooler, since warm light becomes white.
        pub kelvin: f32 = DAYLIGHT_KELVIN,
        /// Along green (negative) to magenta (positive), within [`TINT`].
        pub tint: f32 = 0.0,
    }
}

impl WhiteBalance {
    /// The change of linear Rec.709 colours: Bradford's adaptation from the chosen white to D65.
    pub fn matrix(&self) -> Mat3 {
        if *self == Self::default() {
            return Mat3::IDENTITY;
        }
        let source =
            BRADFORD * white_xyz(self.kelvin.clamp(*KELVIN.start(), *KELVIN.end()), self.tint);
        let target = BRADFORD * white_xyz(DAYLIGHT_KELVIN, 0.0);
        let adapt = BRADFORD.inverse() * Mat3::from_diagonal(target / source) * BRADFORD;
        REC709_FROM_XYZ * adapt * REC709_FROM_XYZ.inverse()
    }

    /// The balanced picture. If colours are changed at all, NaN counts as 0 and what is beyond
    /// `1e30` as that: no channel that is not finite spreads to the others.
    pub fn apply(&self, mut image: Image) -> Image {
        let matrix = self.matrix();
        if matrix != Mat3::IDENTITY {
            let finite =
                |x: f32| if x.is_nan() { 0.0 } else { x.clamp(-MAX_COMPONENT, MAX_COMPONENT) };
            image.pixels.par_iter_mut().for_each(|rgb| {
                *rgb = (matrix * Vec3::from(rgb.map(finite))).max(Vec3::ZERO).to_array();
            });
        }
        image
    }
}

/// Maximum of a channel; sums of such values are finite.
const MAX_COMPONENT: f32 = 1e30;

/// Cone responses from XYZ (Lam 1985, the Bradford transform).
const BRADFORD: Mat3 = Mat3::from_cols_array(&[
    0.8951, -0.7502, 0.0389, 0.2664, 1.7135, -0.0685, -0.1614, 0.0367, 1.0296,
]);

/// XYZ (Y = 1) of a white on the Planckian locus (Krystek 1985, in CIE 1960 uv), `tint` off it.
fn white_xyz(kelvin: f32, tint: f32) -> Vec3 {
    let t = kelvin;
    let u = (0.860_117_76 + 1.541_182_5e-4 * t + 1.286_412e-7 * t * t)
        / (1.0 + 8.424_202_4e-4 * t + 7.081_451_6e-7 * t * t);
    let v = (0.317_398_73 + 4.228_062_4e-5 * t + 4.204_817e-8 * t * t)
        / (1.0 - 2.897_418_2e-5 * t + 1.614_560_5e-7 * t * t);
    let v = v + 0.02 * tint;
    let (x, y) = (3.0 * u / (2.0 * u - 8.0 * v + 4.0), 2.0 * v / (2.0 * u - 8.0 * v + 4.0));
    Vec3::new(x / y, 1.0, (1.0 - x - y) / y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn daylight_changes_nothing_and_warm_light_becomes_white() {
        assert_eq!(WhiteBalance::default().matrix(), Mat3::IDENTITY);
        let balance = WhiteBalance { kelvin: 3200.0, tint: 0.0 };
        let warm = REC709_FROM_XYZ * white_xyz(3200.0, 0.0);
        assert!(warm.x > 1.5 * warm.z, "3200 K is orange: {warm}");
        let white = REC709_FROM_XYZ * white_xyz(DAYLIGHT_KELVIN, 0.0);
        assert!((balance.matrix() * warm - white).length() < 1e-3);
        // Known: the Planckian locus at 6504 K is u = 0.1978 - 0.001, near D65 but not on it.
        assert!((white - Vec3::ONE).length() < 0.06, "{white}");
    }

    #[test]
    fn tint_goes_from_green_to_magenta() {
        let grey = |tint| WhiteBalance { kelvin: DAYLIGHT_KELVIN, tint }.matrix() * Vec3::ONE;
        assert!(grey(-0.5).y > grey(-0.5).x && grey(-0.5).y > grey(-0.5).z);
        assert!(grey(0.5).y < grey(0.5).x && grey(0.5).y < grey(0.5).z);
    }
}
