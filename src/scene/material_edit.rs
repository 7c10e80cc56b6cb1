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
}

/// Above all alpha: a mask that cuts out everything.
const ALL: f32 = 2.0;

impl MaterialEdit {
    /// The material changed.
    pub fn apply(&self, material: &Material) -> Material {
        let mut changed = material.clone();
        if let Some(color) = self.color {
            changed.base_color = color.extend(material.base_color.w);
        }
        changed.roughness = self.roughness.unwrap_or(material.roughness);
        changed.metallic = self.metalness.unwrap_or(material.metallic);
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
        let color = self.color.iter().flat_map(Vec3::to_array);
        color.chain(self.roughness).chain(self.metalness).all(|x| (0.0..=1.0).contains(&x))
    }

    /// Reads `NAME:KEY=VALUE,...` with the keys `color` (`#rrggbb`, sRGB), `roughness` and `metalness`,
    /// or the word `hidden`.
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
                "color" => edit.color = Some(color_of(value.trim())?),
                "roughness" => edit.roughness = Some(share(value)?),
                "metalness" => edit.metalness = Some(share(value)?),
                other => {
                    return Err(format!("{other} is not color, roughness, metalness or hidden"));
                }
            }
        }
        Ok((name.to_owned(), edit))
    }

    /// As [`Self::parse`] reads it.
    pub fn to_text(&self, name: &str) -> String {
        let mut changes = Vec::new();
        changes.extend(self.color.map(|color| format!("color={}", hex(color))));
        changes.extend(self.roughness.map(|roughness| format!("roughness={roughness}")));
        changes.extend(self.metalness.map(|metalness| format!("metalness={metalness}")));
        changes.extend(self.hidden.then(|| "hidden".to_owned()));
        format!("{name}:{}", changes.join(","))
    }
}

fn share(text: &str) -> Result<f32, String> {
    let number: Option<f32> = text.trim().parse().ok();
    let number = number.filter(|number| (0.0..=1.0).contains(number));
    number.ok_or_else(|| format!("{text} is no number from 0 to 1"))
}

/// Linear RGB of `#rrggbb`.
fn color_of(text: &str) -> Result<Vec3, String> {
    let is_hex = |digits: &&str| digits.bytes().all(|digit| digit.is_ascii_hexdigit());
    let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6).filter(is_hex);
    let bytes = digits.and_then(|digits| u32::from_str_radix(digits, 16).ok());
    let bytes = bytes.ok_or_else(|| format!("{text} is no color like #c8a070"))?;
    let [_, r, g, b] = bytes.to_be_bytes();
    Ok(Vec3::from([r, g, b].map(|byte| color::linear_from_srgb(f32::from(byte) / 255.0))))
}

fn hex(color: Vec3) -> String {
    let [r, g, b] = color
        .to_array()
        .map(|c| (255.0 * color::srgb_from_linear(c.clamp(0.0, 1.0))).round() as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}

#[cfg(test)]
mod tests {
    use glam::Vec4;

    use super::*;

    #[test]
    fn what_is_written_is_read_again() {
        let text = "Oak: dark:color=#c8a070,roughness=0.25,metalness=1,hidden";
        let (name, edit) = MaterialEdit::parse(text).expect("sound");
        assert_eq!(name, "Oak: dark");
        assert_eq!((edit.roughness, edit.metalness, edit.hidden), (Some(0.25), Some(1.0), true));
        assert_eq!(edit.to_text(&name), text);
        let refused = |text: &str| MaterialEdit::parse(text).expect_err("refused");
        assert!(refused("oak").contains("expected a material's name"));
        assert!(refused("oak:shine=1").contains("shine is not color"));
        assert!(refused("oak:roughness=2").contains("2 is no number from 0 to 1"));
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
}
