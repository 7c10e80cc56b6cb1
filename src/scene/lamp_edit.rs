//! Changes to point, spot and directional lights after loading.

use std::collections::{BTreeMap, HashSet};

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::light::PunctualLight;
use super::material::Material;
use super::material_edit::{brightest, color_of_hex, hex_of_color, number_up_to};
use super::needs::is_emitter;

/// Changes to lights, by their name.
pub type LampEdits = BTreeMap<String, LampEdit>;

with_defaults! {
    /// A change to all lamps of a name: lights, and materials that emit.
    #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
    #[serde(default)]
    pub struct LampEdit {
        /// Whether they are switched off.
        pub off: bool = false,
        /// Factor on their intensity, `0..=MAX_FACTOR`.
        pub factor: f32 = 1.0,
        /// Their colour, linear RGB in `[0,1]`, in place of their own; its brightness is of no account.
        pub color: Option<Vec3> = None,
    }
}

/// The lights and the materials that emit of one name.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedLamp {
    /// Their name.
    pub name: String,
    /// Linear RGB of the first of them; the largest component is 1.
    pub color: Vec3,
}

/// A lamp for each name among lights and materials that emit.
pub fn named_lamps<'m>(
    lights: &[PunctualLight],
    materials: impl IntoIterator<Item = &'m Material>,
) -> Vec<NamedLamp> {
    let of_lights = lights.iter().map(|light| (&light.name, light.intensity));
    let emitters = materials.into_iter().filter(|material| is_emitter(material));
    let all = of_lights.chain(emitters.map(|material| (&material.name, material.emissive)));
    let mut names = HashSet::new();
    let first_of_name = all.filter(|(name, _)| names.insert(*name));
    let lamp = |(name, light): (&String, Vec3)| {
        let color = light / light.max_element().max(f32::MIN_POSITIVE);
        NamedLamp { name: name.clone(), color }
    };
    first_of_name.map(lamp).collect()
}

/// The change to a lamp: its own, and a factor on all lamps.
pub fn edit_of_lamp(name: &str, edits: &LampEdits, all: f32) -> LampEdit {
    let own = edits.get(name).copied().unwrap_or_default();
    own.then(&LampEdit { factor: all, ..LampEdit::default() })
}

impl LampEdit {
    /// Largest factor that can be asked for.
    pub const MAX_FACTOR: f32 = 1e6;

    /// Factor on their intensity, 0 where they are off.
    pub(crate) fn brightness(&self) -> f32 {
        if self.off { 0.0 } else { self.factor }
    }

    /// The light changed.
    pub fn apply(&self, light: &PunctualLight) -> PunctualLight {
        PunctualLight { intensity: self.changed(light.intensity), ..light.clone() }
    }

    /// The material with its emission changed.
    pub fn apply_to_material(&self, material: &Material) -> Material {
        Material { emissive: self.changed(material.emissive), ..material.clone() }
    }

    fn changed(&self, light: Vec3) -> Vec3 {
        let max = light.max_element();
        self.color.and_then(brightest).map_or(light, |color| color * max) * self.brightness()
    }

    /// This change and then another one.
    pub fn then(&self, next: &Self) -> Self {
        let factor = (self.factor * next.factor).min(Self::MAX_FACTOR);
        Self { off: self.off || next.off, factor, color: next.color.or(self.color) }
    }

    /// Whether all numbers are in range.
    pub fn is_sound(&self) -> bool {
        let mut color = self.color.iter().flat_map(Vec3::to_array);
        (0.0..=Self::MAX_FACTOR).contains(&self.factor) && color.all(|x| (0.0..=1.0).contains(&x))
    }

    /// Reads `NAME:CHANGES`: `factor=NUMBER`, `color=#rrggbb` (sRGB) and `off`, separated by commas.
    ///
    /// # Errors
    /// The cause, without the text.
    pub fn parse(text: &str) -> Result<(String, Self), String> {
        let (name, changes) = text
            .rsplit_once(':')
            .ok_or("expected a lamp's name and changes, like Spot:factor=0.5,color=#ffd0a0")?;
        let mut edit = Self::default();
        for change in changes.split(',') {
            match change.trim().split_once('=').unwrap_or((change.trim(), "")) {
                ("off", "") => edit.off = true,
                ("factor", value) => edit.factor = number_up_to(Self::MAX_FACTOR, value)?,
                ("color", value) => {
                    let color = color_of_hex(value.trim())?;
                    let color = Some(color).filter(|color| *color != Vec3::ZERO);
                    edit.color = Some(color.ok_or("a lamp's color is not black: use off")?);
                }
                (other, _) => return Err(format!("{other} is not factor, color or off")),
            }
        }
        Ok((name.to_owned(), edit))
    }

    /// As [`Self::parse`] reads it.
    pub fn to_text(&self, name: &str) -> String {
        let color = self.color.map(|color| format!(",color={}", hex_of_color(color)));
        let off = if self.off { ",off" } else { "" };
        format!("{name}:factor={}{}{off}", self.factor, color.unwrap_or_default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::PunctualKind;

    #[test]
    fn what_is_written_is_read_again() {
        for text in ["Key: left:factor=0.25,color=#ffd0a0,off", "Spot:factor=1"] {
            let (name, edit) = LampEdit::parse(text).expect("sound");
            assert_eq!(edit.to_text(&name), text);
            assert!(edit.is_sound());
        }
        let refused = |text: &str| LampEdit::parse(text).expect_err("refused");
        assert!(refused("Spot").contains("expected a lamp's name"));
        assert!(refused("Spot:power=1").contains("power is not factor"));
        assert!(refused("Spot:factor=-1").contains("-1 is no number from 0 to 1000000"));
        assert!(refused("Spot:off=1").contains("off is not factor"));
        assert!(refused("Spot:color=#000000").contains("use off"));
    }

    #[test]
    fn a_lamp_is_dimmed_coloured_and_switched_off() {
        let light = PunctualLight {
            name: "Spot".to_owned(),
            kind: PunctualKind::Point,
            position: Vec3::ZERO,
            direction: Vec3::NEG_Z,
            intensity: Vec3::new(1.0, 4.0, 2.0),
            range: f32::INFINITY,
        };
        let changed = |edit: LampEdit| edit.apply(&light).intensity;
        let none = LampEdit::default();
        assert_eq!(changed(none), light.intensity);
        assert_eq!(changed(LampEdit { factor: 0.5, ..none }), Vec3::new(0.5, 2.0, 1.0));
        let color = Some(Vec3::new(0.5, 0.25, 0.0));
        assert_eq!(changed(LampEdit { color, ..none }), Vec3::new(4.0, 2.0, 0.0));
        let off = LampEdit { off: true, ..none };
        assert_eq!(changed(off), Vec3::ZERO);
        let glass = Material { emissive: light.intensity, ..Material::lambert(0.5) };
        let dimmed = LampEdit { factor: 0.5, ..none }.apply_to_material(&glass);
        assert_eq!(dimmed, Material { emissive: Vec3::new(0.5, 2.0, 1.0), ..glass.clone() });
        let half = LampEdit { factor: 0.5, color, ..none };
        assert_eq!(half.then(&half).then(&off), LampEdit { off: true, factor: 0.25, color });
    }
}
