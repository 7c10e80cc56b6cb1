//! Changes to materials after loading: what a person tries, without touching the file.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::{AlphaMode, Material};
use crate::color;

/// A change to a material; what is `None` stays as it is.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct MaterialEdit {
    /// Whether neither light nor the camera meets it.
    pub hidden: bool,
    /// Colour, linear RGB in `[0,1]`, by which its texture is multiplied.
    pub color: Option<Vec3>,
    /// Roughness in `[0,1]`, by which its texture is multiplied.
    pub roughness: Option<f32>,
    /// Metalness in `[0,1]`, by which its texture is multiplied.
    pub metalness: Option<f32>,
    /// Opacity in `[0,1]`, by which its texture's alpha is multiplied.
    pub opacity: Option<f32>,
    /// Largest component of the emitted radiance, by which its texture is multiplied; up to [`Self::MAX_EMISSION`].
    pub emission: Option<f32>,
    /// Colour of the emitted radiance, linear RGB in `[0,1]`; its brightness is of no account.
    pub emission_color: Option<Vec3>,
}

/// Above all alpha: a mask that cuts out everything.
const ALL: f32 = 2.0;

impl MaterialEdit {
    /// Largest emitted radiance that can be asked for.
    pub const MAX_EMISSION: f32 = 1e6;

    /// What would change any material to look like this one, textures aside; it is not hidden.
    pub fn like(material: &Material) -> Self {
        let is_blended = material.alpha_mode == AlphaMode::Blend;
        Self {
            hidden: false,
            color: Some(material.base_color.truncate().clamp(Vec3::ZERO, Vec3::ONE)),
            roughness: Some(material.roughness),
            metalness: Some(material.metallic),
            opacity: Some(if is_blended { material.base_color.w } else { 1.0 }),
            emission: Some(material.emissive.max_element().min(Self::MAX_EMISSION)),
            emission_color: Some(brightest(material.emissive).unwrap_or(Vec3::ONE)),
        }
    }

    /// The material changed.
    pub fn apply(&self, material: &Material) -> Material {
        let mut changed = material.clone();
        if let Some(color) = self.color {
            changed.base_color = color.extend(material.base_color.w);
        }
        changed.roughness = self.roughness.unwrap_or(material.roughness);
        changed.metallic = self.metalness.unwrap_or(material.metallic);
        if let Some(opacity) = self.opacity {
            changed.base_color.w = opacity;
            if opacity < 1.0 {
                changed.alpha_mode = AlphaMode::Blend;
            }
        }
        if self.emission.is_some() || self.emission_color.is_some() {
            let radiance = self.emission.unwrap_or(material.emissive.max_element());
            let color = self.emission_color.unwrap_or(material.emissive);
            changed.emissive = radiance * brightest(color).unwrap_or(Vec3::ONE);
        }
        if self.hidden {
            changed = Material {
                alpha_mode: AlphaMode::Mask { cutoff: ALL },
                emissive: Vec3::ZERO,
                transmission: 0.0,
                diffuse_transmission: 0.0,
                thickness: 0.0,
                ..changed
            };
        }
        changed
    }

    /// Whether a material is one that was hidden.
    pub(super) fn has_hidden(material: &Material) -> bool {
        material.alpha_mode == AlphaMode::Mask { cutoff: ALL }
    }

    /// Whether all numbers are in range.
    pub fn is_sound(&self) -> bool {
        let colors = self.color.iter().chain(&self.emission_color).flat_map(Vec3::to_array);
        let shares = colors.chain(self.roughness).chain(self.metalness).chain(self.opacity);
        shares.into_iter().all(|x| (0.0..=1.0).contains(&x))
            && self.emission.is_none_or(|x| (0.0..=Self::MAX_EMISSION).contains(&x))
    }

    /// Reads `NAME:KEY=VALUE,...` with the keys `color` and `emission-color` (`#rrggbb`, sRGB), `roughness`,
    /// `metalness`, `opacity` and `emission`, or the word `hidden`.
    ///
    /// # Errors
    /// The cause, without the text.
    pub fn parse(text: &str) -> Result<(String, Self), String> {
        let (name, changes) = text.rsplit_once(':').ok_or(
            "expected a material's name and changes, like oak:roughness=0.2,color=#c8a070",
        )?;
        let mut edit = Self::default();
        for change in changes.split(',') {
            let (key, value) = change.split_once('=').unwrap_or((change, ""));
            match key.trim() {
                "hidden" if value.is_empty() => edit.hidden = true,
                "color" => edit.color = Some(color_of_hex(value.trim())?),
                "roughness" => edit.roughness = Some(number_up_to(1.0, value)?),
                "metalness" => edit.metalness = Some(number_up_to(1.0, value)?),
                "opacity" => edit.opacity = Some(number_up_to(1.0, value)?),
                "emission" => edit.emission = Some(number_up_to(Self::MAX_EMISSION, value)?),
                "emission-color" => edit.emission_color = Some(color_of_hex(value.trim())?),
                other => {
                    return Err(format!(
                        "{other} is not color, roughness, metalness, opacity, emission, emission-color or hidden"
                    ));
                }
            }
        }
        Ok((name.to_owned(), edit))
    }

    /// As [`Self::parse`] reads it.
    pub fn to_text(&self, name: &str) -> String {
        let mut changes = Vec::new();
        let text = |number: f32| number.to_string();
        for (key, value) in [
            ("color", self.color.map(hex_of_color)),
            ("roughness", self.roughness.map(text)),
            ("metalness", self.metalness.map(text)),
            ("opacity", self.opacity.map(text)),
            ("emission", self.emission.map(text)),
            ("emission-color", self.emission_color.map(hex_of_color)),
        ] {
            changes.extend(value.map(|value| format!("{key}={value}")));
        }
        changes.extend(self.hidden.then(|| "hidden".to_owned()));
        format!("{name}:{}", changes.join(","))
    }
}

/// A color as bright as it can be; `None` for black.
pub(super) fn brightest(color: Vec3) -> Option<Vec3> {
    let max = color.max_element();
    (max > 0.0).then(|| color / max)
}

/// A number from 0 to `max`.
///
/// # Errors
/// A sentence, if it is something else.
pub(super) fn number_up_to(max: f32, text: &str) -> Result<f32, String> {
    let number: Option<f32> = text.trim().parse().ok();
    let number = number.filter(|number| (0.0..=max).contains(number));
    number.ok_or_else(|| format!("{text} is no number from 0 to {max}"))
}

/// Linear RGB of `#rrggbb`.
///
/// # Errors
/// A sentence, if it is something else.
pub(crate) fn color_of_hex(text: &str) -> Result<Vec3, String> {
    let is_hex = |digits: &&str| digits.bytes().all(|digit| digit.is_ascii_hexdigit());
    let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6).filter(is_hex);
    let bytes = digits.and_then(|digits| u32::from_str_radix(digits, 16).ok());
    let bytes = bytes.ok_or_else(|| format!("{text} is no color like #c8a070"))?;
    let [_, r, g, b] = bytes.to_be_bytes();
    Ok(Vec3::from([r, g, b].map(|byte| color::linear_from_srgb(f32::from(byte) / 255.0))))
}

/// Linear RGB as `#rrggbb`.
pub(crate) fn hex_of_color(color: Vec3) -> String {
    let [r, g, b] = color::srgb8_from_linear(color);
    format!("#{r:02x}{g:02x}{b:02x}")
}

#[cfg(test)]
mod tests {
    use glam::Vec4;

    use super::*;

    #[test]
    fn what_is_written_is_read_again() {
        let text = "Oak: dark:color=#c8a070,roughness=0.25,metalness=1,opacity=0.5,emission=40,\
                    emission-color=#ffd0a0,hidden";
        let (name, edit) = MaterialEdit::parse(text).expect("sound");
        assert_eq!(name, "Oak: dark");
        assert_eq!((edit.roughness, edit.metalness, edit.hidden), (Some(0.25), Some(1.0), true));
        assert_eq!(edit.to_text(&name), text);
        let refused = |text: &str| MaterialEdit::parse(text).expect_err("refused");
        assert!(refused("oak").contains("expected a material's name"));
        assert!(refused("oak:shine=1").contains("shine is not color"));
        assert!(refused("oak:roughness=2").contains("2 is no number from 0 to 1"));
        assert!(refused("oak:emission=-1").contains("-1 is no number from 0 to 1000000"));
        assert!(refused("oak:color=red").contains("red is no color"));
        assert!(refused("oak:color=#cé00").contains("is no color"));
        assert!(refused("oak:hidden=1").contains("hidden is not"));
    }

    #[test]
    fn only_what_is_said_changes() {
        let oak = Material { base_color: Vec4::new(0.1, 0.2, 0.3, 0.4), ..Material::lambert(0.5) };
        assert_eq!(MaterialEdit::default().apply(&oak), oak);
        let color = Some(Vec3::new(0.9, 0.8, 0.7));
        let red = MaterialEdit { color, ..MaterialEdit::default() }.apply(&oak);
        assert_eq!(red, Material { base_color: Vec4::new(0.9, 0.8, 0.7, 0.4), ..oak });
    }

    #[test]
    fn light_and_opacity_are_set_apart_from_colour() {
        let lamp = Material { emissive: Vec3::new(1.0, 4.0, 2.0), ..Material::lambert(0.5) };
        let none = MaterialEdit::default();
        let dimmed = MaterialEdit { emission: Some(2.0), ..none }.apply(&lamp);
        assert_eq!(dimmed.emissive, Vec3::new(0.5, 2.0, 1.0));
        let emission_color = Some(Vec3::new(0.5, 0.25, 0.0));
        let red = MaterialEdit { emission_color, ..none }.apply(&lamp);
        assert_eq!(red.emissive, Vec3::new(4.0, 2.0, 0.0));
        let wall = Material::lambert(0.5);
        let lit = MaterialEdit { emission: Some(3.0), ..none }.apply(&wall);
        assert_eq!((lit.emissive, lit.alpha_mode), (Vec3::splat(3.0), AlphaMode::Opaque));
        let thin = MaterialEdit { opacity: Some(0.25), ..none }.apply(&wall);
        assert_eq!((thin.base_color.w, thin.alpha_mode), (0.25, AlphaMode::Blend));
        assert_eq!(MaterialEdit::like(&thin).apply(&wall), thin);
        assert_eq!(MaterialEdit::like(&lamp).apply(&wall), lamp);
    }
}
