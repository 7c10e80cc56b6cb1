//! Units of punctual lights. `KHR_lights_punctual` has candela and lux, maps and emissive surfaces have none, and
//! exporters multiply what their program calls watts by 683: beside a map such lamps are as much too bright.

use crate::error::Notices;
use crate::scene::{Lamps, PunctualKind, PunctualLight};

/// Least lux and candela that are taken for physical units: what is weaker has not been multiplied.
const MIN_LUX: f32 = 34.0;
const MIN_CANDELA: f32 = 100.0;

/// Scales the lights to the units that are asked for, and says so where a choice was made.
pub(super) fn scale(
    lights: &mut [PunctualLight],
    lamps: Lamps,
    generator: Option<&str>,
    notices: &mut Notices,
) {
    let is_physical = |light: &PunctualLight| {
        let least = if is_sun(light) { MIN_LUX } else { MIN_CANDELA };
        light.intensity.max_element() >= least
    };
    let are_physical = !lights.is_empty() && lights.iter().all(is_physical);
    let is_blender = generator.is_some_and(|name| name.contains("Blender"));
    let factor = match lamps {
        Lamps::Auto if are_physical && is_blender => {
            notices.add(format!(
                "its lamps are in Blender's lux and candela ({}), 683 times brighter than Blender shows them beside \
                 a map; they are taken as watts (--lamps physical keeps lux and candela)",
                brightest(lights)
            ));
            1.0 / Lamps::LUMENS_PER_WATT
        }
        Lamps::Auto if are_physical => {
            notices.add(format!(
                "its lamps ({}) are far brighter than maps usually are; --lamps watts makes them 683 times \
                 weaker, --lamps FACTOR as much as you like",
                brightest(lights)
            ));
            1.0
        }
        Lamps::Auto | Lamps::Physical => 1.0,
        Lamps::Watts => 1.0 / Lamps::LUMENS_PER_WATT,
        Lamps::Factor(factor) => factor,
    };
    if factor != 1.0 {
        lights.iter_mut().for_each(|light| light.intensity *= factor);
    }
}

fn is_sun(light: &PunctualLight) -> bool {
    light.kind == PunctualKind::Directional
}

/// The brightest light, in words.
fn brightest(lights: &[PunctualLight]) -> String {
    let intensity = |light: &&PunctualLight| light.intensity.max_element();
    let most = lights.iter().max_by(|a, b| intensity(a).total_cmp(&intensity(b)));
    most.map_or_else(String::new, |light| {
        let unit = if is_sun(light) { "lux" } else { "candela" };
        format!("{}: {:.0} {unit}", light.name, intensity(&light))
    })
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    fn light(kind: PunctualKind, intensity: f32) -> PunctualLight {
        PunctualLight {
            name: "Sun".to_owned(),
            kind,
            position: Vec3::ZERO,
            direction: Vec3::NEG_Z,
            intensity: Vec3::splat(intensity),
            range: f32::INFINITY,
        }
    }

    /// What becomes of lights of these intensities, and whether it is said.
    fn scaled(lights: [(PunctualKind, f32); 2], lamps: Lamps, generator: &str) -> (Vec<f32>, bool) {
        let mut lights = lights.map(|(kind, intensity)| light(kind, intensity));
        let mut notices = Notices::default();
        scale(&mut lights, lamps, Some(generator), &mut notices);
        (lights.map(|light| light.intensity.x).to_vec(), !notices.is_empty())
    }

    #[test]
    fn only_blenders_lux_and_candela_are_watts_unasked() {
        let (sun, point) = (PunctualKind::Directional, PunctualKind::Point);
        let blender = "Khronos glTF Blender I/O v4.2.70";
        let bright = [(sun, 2049.0), (point, 54_350.0)];
        let weak = [(sun, 3.0), (point, 54_350.0)];
        let watts = vec![2049.0 * (1.0 / 683.0), 54_350.0 * (1.0 / 683.0)];
        for (lights, lamps, generator, right) in [
            (bright, Lamps::Auto, blender, (watts.clone(), true)),
            (bright, Lamps::Auto, "", (vec![2049.0, 54_350.0], true)),
            (bright, Lamps::Physical, blender, (vec![2049.0, 54_350.0], false)),
            (bright, Lamps::Watts, "", (watts, false)),
            (weak, Lamps::Auto, blender, (vec![3.0, 54_350.0], false)),
            (weak, Lamps::Factor(0.5), blender, (vec![1.5, 27_175.0], false)),
        ] {
            assert_eq!(scaled(lights, lamps, generator), right, "{lamps:?} {generator}");
        }
    }

    #[test]
    fn units_are_words_or_factors() {
        assert_eq!("watts".parse(), Ok(Lamps::Watts));
        assert_eq!("0.25".parse(), Ok(Lamps::Factor(0.25)));
        for text in ["", "lux", "-1", "inf", "nan"] {
            assert!(text.parse::<Lamps>().is_err(), "{text}");
        }
    }
}
