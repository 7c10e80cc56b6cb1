//! Radiance as linear Rec.709 triples: luminance and sampling importance.

use glam::Vec3;

/// Rec.709 luminance of linear RGB.
pub fn luminance(rgb: Vec3) -> f32 {
    rgb.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// Sampling importance of linear RGB: mean of luminance and channel average, so that a saturated
/// blue or red lamp is not starved (RTXPT `EnvMapImportanceSamplingBaker`).
pub fn importance(rgb: Vec3) -> f32 {
    0.5 * (luminance(rgb) + (rgb.x + rgb.y + rgb.z) / 3.0)
}

/// sRGB transfer function, display from linear, both in `[0,1]` (IEC 61966-2-1).
pub fn srgb_from_linear(x: f32) -> f32 {
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

/// Bytes of sRGB of a linear colour; what lies outside of `[0,1]` is clipped.
pub(crate) fn srgb8_from_linear(color: Vec3) -> [u8; 3] {
    color.to_array().map(|x| (255.0 * srgb_from_linear(x)).round() as u8)
}

/// sRGB transfer function, linear from display, both in `[0,1]` (IEC 61966-2-1).
pub fn linear_from_srgb(x: f32) -> f32 {
    if x <= 0.040_45 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

/// Linear Rec.709 from CIE XYZ, white D65 (IEC 61966-2-1).
pub const REC709_FROM_XYZ: glam::Mat3 = glam::Mat3::from_cols_array(&[
    3.240_97,
    -0.969_243_6,
    0.055_630_08,
    -1.537_383_2,
    1.875_967_5,
    -0.203_976_96,
    -0.498_610_76,
    0.041_555_06,
    1.056_971_5,
]);
