//! From linear radiance to 8-bit pictures for a display: exposure, tone curve, sRGB, look, dither.

mod lut;
mod white_balance;

use std::fmt;

use glam::{Mat3, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::color::{luminance, srgb_from_linear};
use crate::image::{Image, Rgb8};

pub use lut::{Grade, Lut};
pub use white_balance::{DAYLIGHT_KELVIN, KELVIN, TINT, WhiteBalance};

/// Curve from exposed radiance to display light in `[0,1]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ToneCurve {
    /// Troy Sobotka's AgX, in Benjamin Wrensch's polynomial fit ("Minimal AgX Implementation").
    #[default]
    Agx,
    /// ACES reference rendering and sRGB output transform in Stephen Hill's fit (BakingLab).
    Aces,
    /// Khronos PBR Neutral: keeps base colours below 0.8 as they are.
    Neutral,
    /// `L / (1 + L)` on luminance `L` (Reinhard et al. 2002).
    Reinhard,
    /// Clipped at 1.
    None,
}

impl fmt::Display for ToneCurve {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

impl ToneCurve {
    /// All curves.
    pub const ALL: [Self; 5] = [Self::Agx, Self::Aces, Self::Neutral, Self::Reinhard, Self::None];

    /// Linear display light in `[0,1]` of exposed linear Rec.709. NaN and negative channels count
    /// as 0, and values above `1e6` as `1e6`; so the result is never NaN.
    pub fn apply(self, rgb: Vec3) -> Vec3 {
        let rgb = Vec3::from(rgb.to_array().map(|v| if v > 0.0 { v.min(BRIGHTEST) } else { 0.0 }));
        let display = match self {
            Self::Agx => agx(rgb),
            Self::Aces => aces(rgb),
            Self::Neutral => neutral(rgb),
            Self::Reinhard => rgb / (1.0 + luminance(rgb)),
            Self::None => rgb,
        };
        display.clamp(Vec3::ZERO, Vec3::ONE)
    }
}

/// Maximum of a channel: white in every curve, and its square is finite.
const BRIGHTEST: f32 = 1e6;

/// A tone curve, and the look of what it gives.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tone {
    /// The curve.
    pub curve: ToneCurve,
    /// The look, if there is one.
    pub grade: Option<Grade>,
}

impl From<ToneCurve> for Tone {
    fn from(curve: ToneCurve) -> Self {
        Self { curve, grade: None }
    }
}

impl Tone {
    /// Display colour of exposed linear Rec.709, in sRGB's encoding, `[0,1]`.
    pub(crate) fn apply(&self, rgb: Vec3) -> Vec3 {
        let encoded = Vec3::from(self.curve.apply(rgb).to_array().map(srgb_from_linear));
        self.grade.as_ref().map_or(encoded, |grade| grade.apply(encoded))
    }
}

/// The 8-bit sRGB picture of `image * 2^exposure_ev` under a tone curve and a look.
///
/// Rounding is dithered by interleaved gradient noise (Jimenez 2014), the same for all channels and
/// pictures, so that skies show no bands; values that need no rounding are exact.
pub fn display_rgb8(image: &Image, exposure_ev: f32, tone: impl Into<Tone>) -> Rgb8 {
    let (gain, tone) = (exposure_ev.exp2(), tone.into());
    let width = image.width as usize;
    let pixels = image
        .pixels
        .par_iter()
        .enumerate()
        .map(|(i, &rgb)| {
            let dither = gradient_noise((i % width) as f32, (i / width) as f32);
            tone.apply(Vec3::from(rgb) * gain).to_array().map(|v| quantise(v, dither))
        })
        .collect();
    Rgb8 { width: image.width, height: image.height, pixels }
}

/// The level of a display value in `[0,1]`; `dither` in `[0,1)` decides which way it is rounded.
fn quantise(value: f32, dither: f32) -> u8 {
    let level = value * 255.0;
    let nearest = level.round();
    // Rounding errors of the curve are not dithered.
    if (level - nearest).abs() < 1e-3 { nearest as u8 } else { (level + dither) as u8 }
}

/// Interleaved gradient noise, in `[0,1)` (Jimenez, "Next Generation Post Processing in Call of
/// Duty", SIGGRAPH 2014).
fn gradient_noise(x: f32, y: f32) -> f32 {
    (52.982_92 * (0.067_110_56 * x + 0.005_837_15 * y).fract()).fract()
}

/// Stops that bring the picture's typical luminance to middle grey, 0.18: the mean logarithm of the
/// positive finite luminances between the 5th and 95th percentile. 0 for a black picture.
pub fn auto_exposure_ev(image: &Image) -> f32 {
    const MIDDLE_GREY: f32 = 0.18;
    let mut stops: Vec<f32> = image
        .pixels
        .par_iter()
        .map(|&rgb| luminance(rgb.into()))
        .filter(|l| l.is_normal() && *l > 0.0)
        .map(f32::log2)
        .collect();
    if stops.is_empty() {
        return 0.0;
    }
    stops.par_sort_unstable_by(f32::total_cmp);
    let tail = stops.len() / 20;
    let typical = &stops[tail..stops.len() - tail];
    let mean = typical.iter().map(|&s| f64::from(s)).sum::<f64>() / typical.len() as f64;
    MIDDLE_GREY.log2() - mean as f32
}

/// Benjamin Wrensch, "Minimal AgX Implementation" (iolite-engine.com, 2023), without a look.
fn agx(rgb: Vec3) -> Vec3 {
    const INSET: Mat3 = Mat3::from_cols_array(&[
        0.842_479, 0.042_328, 0.042_376, 0.078_434, 0.878_469, 0.078_434, 0.079_224, 0.079_166,
        0.879_143,
    ]);
    const OUTSET: Mat3 = Mat3::from_cols_array(&[
        1.196_879, -0.052_897, -0.052_972, -0.098_021, 1.151_903, -0.098_043, -0.099_030,
        -0.098_961, 1.151_074,
    ]);
    const MIN_EV: f32 = -12.473_93;
    const MAX_EV: f32 = 4.026_069;
    let sigmoid = |linear: f32| {
        let x = ((linear.max(1e-10).log2() - MIN_EV) / (MAX_EV - MIN_EV)).clamp(0.0, 1.0);
        let (x2, x4) = (x * x, x * x * x * x);
        15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x
            - 0.002_32
    };
    let encoded = OUTSET * Vec3::from((INSET * rgb).to_array().map(sigmoid));
    Vec3::from(encoded.to_array().map(|v| v.max(0.0).powf(2.2)))
}

/// Stephen Hill's fit of the ACES RRT and sRGB ODT (TheRealMJP/BakingLab, `ACES.hlsl`, MIT).
fn aces(rgb: Vec3) -> Vec3 {
    const INPUT: Mat3 = Mat3::from_cols_array(&[
        0.597_19, 0.076, 0.028_4, 0.354_58, 0.908_34, 0.133_83, 0.048_23, 0.015_66, 0.837_77,
    ]);
    const OUTPUT: Mat3 = Mat3::from_cols_array(&[
        1.604_75, -0.102_08, -0.003_27, -0.531_08, 1.108_13, -0.072_76, -0.073_67, -0.006_05,
        1.076_02,
    ]);
    let v = INPUT * rgb;
    let numerator = v * (v + 0.024_578_6) - 0.000_090_537;
    let denominator = v * (0.983_729 * v + 0.432_951) + 0.238_081;
    OUTPUT * (numerator / denominator)
}

/// Khronos PBR Neutral Tone Mapper, after its specification.
fn neutral(rgb: Vec3) -> Vec3 {
    const START_COMPRESSION: f32 = 0.8 - 0.04;
    const DESATURATION: f32 = 0.15;
    let least = rgb.min_element();
    let offset = if least < 0.08 { least - 6.25 * least * least } else { 0.04 };
    let rgb = rgb - offset;
    let peak = rgb.max_element();
    if peak < START_COMPRESSION {
        return rgb;
    }
    let d = 1.0 - START_COMPRESSION;
    let new_peak = 1.0 - d * d / (peak + d - START_COMPRESSION);
    let towards_white = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    (rgb * (new_peak / peak)).lerp(Vec3::splat(new_peak), towards_white)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dither_is_below_one_and_uniform_enough() {
        let mut sum = 0.0;
        for i in 0..65_536 {
            let noise = gradient_noise((i % 256) as f32 + 16_000.0, (i / 256) as f32);
            assert!((0.0..1.0).contains(&noise));
            sum += f64::from(noise);
        }
        assert!((sum / 65_536.0 - 0.5).abs() < 0.01);
    }

    #[test]
    fn quantise_keeps_exact_levels_and_both_ends() {
        for dither in [0.0, 0.5, 0.999] {
            for level in 0..=255u8 {
                assert_eq!(quantise(f32::from(level) / 255.0, dither), level);
            }
        }
        assert_eq!((quantise(100.25 / 255.0, 0.7), quantise(100.25 / 255.0, 0.8)), (100, 101));
    }
}
