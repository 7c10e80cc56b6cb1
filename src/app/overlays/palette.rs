//! Colours for values.

use glam::Vec3;

/// Viridis (van der Walt and Smith 2015) in Matt Zucker's polynomial fit, sRGB, for `t` in `[0,1]`.
pub fn viridis(t: f32) -> [u8; 3] {
    const C: [[f32; 3]; 7] = [
        [0.277_727_3, 0.005_407_344_5, 0.334_099_8],
        [0.105_093_04, 1.404_613_5, 1.384_590_2],
        [-0.330_861_83, 0.214_847_56, 0.095_095_165],
        [-4.634_230_5, -5.799_101, -19.332_441],
        [6.228_27, 14.179_933, 56.690_55],
        [4.776_385, -13.745_145, -65.353_03],
        [-5.435_456, 4.645_852_6, 26.312_435],
    ];
    let t = t.clamp(0.0, 1.0);
    bytes(C.iter().rev().fold(Vec3::ZERO, |sum, c| sum * t + Vec3::from(*c)))
}

/// A colour of the given hue (turns), saturation and value, sRGB.
pub fn hsv(hue_turns: f32, saturation: f32, value: f32) -> [u8; 3] {
    let channel = |n: f32| {
        let k = (n + hue_turns * 6.0).rem_euclid(6.0);
        value - value * saturation * k.min(4.0 - k).clamp(0.0, 1.0)
    };
    bytes(Vec3::new(channel(5.0), channel(3.0), channel(1.0)))
}

/// A colour that differs from those of neighbouring numbers.
pub fn of_number(number: u32) -> [u8; 3] {
    let [hue, saturation, value, _] = units_of(number);
    hsv(hue, 0.35 + 0.3 * saturation, 0.65 + 0.3 * value)
}

/// The colour of a number of a group: its hue is near the group's.
pub fn of_number_in_group(number: u32, group: u32) -> [u8; 3] {
    let [hue, saturation, value, _] = units_of(number);
    let hue = hue_of_group(group) + 0.12 * (hue - 0.5);
    hsv(hue, 0.3 + 0.5 * saturation, 0.45 + 0.55 * value)
}

/// Random numbers from 0 to 1 that belong to a number.
fn units_of(number: u32) -> [f32; 4] {
    let hash = crate::sampler::hash(number.wrapping_add(0x51ed));
    hash.to_le_bytes().map(|byte| f32::from(byte) / 255.0)
}

/// The colour that stands for a group.
pub fn of_group(group: u32) -> [u8; 3] {
    hsv(hue_of_group(group), 0.55, 0.8)
}

/// Neighbours are far apart, for the golden section divides the circle.
fn hue_of_group(group: u32) -> f32 {
    0.58 + 0.381_966 * group as f32
}

/// The colour of a place on the map: hue around the horizon, brighter towards the zenith.
pub fn of_map_place(u: f32, v: f32) -> [u8; 3] {
    hsv(u, 0.35 + 0.5 * v.clamp(0.0, 1.0), 1.0 - 0.65 * v.clamp(0.0, 1.0))
}

fn bytes(rgb: Vec3) -> [u8; 3] {
    rgb.to_array().map(|v| (v.clamp(0.0, 1.0) * 255.0).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hues_are_where_they_should_be() {
        assert_eq!(hsv(0.0, 1.0, 1.0), [255, 0, 0]);
        assert_eq!(hsv(1.0 / 3.0, 1.0, 1.0), [0, 255, 0]);
        assert_eq!(hsv(2.0 / 3.0, 1.0, 1.0), [0, 0, 255]);
        assert_eq!(hsv(0.5, 0.0, 0.5), [128, 128, 128]);
    }

    #[test]
    fn viridis_goes_from_dark_violet_to_yellow() {
        let ([r0, g0, b0], [r1, g1, b1]) = (viridis(0.0), viridis(1.0));
        assert!(r0 < 90 && g0 < 20 && b0 > 70, "{r0} {g0} {b0}");
        assert!(r1 > 220 && g1 > 210 && b1 < 80, "{r1} {g1} {b1}");
    }
}
