//! The material that was clicked: what it looks like, what it emits, and whether it is there at all.

use egui::{Align, RichText, Ui};
use glam::Vec3;

use super::scope::Scope;
use crate::app::document::called;
use crate::app::loader::LoadedScene;
use crate::app::theme;
use crate::scene::{Material, MaterialEdit, TextureSlot};

/// Draws the section.
pub(super) fn show(ui: &mut Ui, scope: &mut Scope<'_>, scene: &LoadedScene) {
    let Scope { document, interface, .. } = scope;
    let title = |number: u32| {
        let name = called(number, &scene.materials);
        match document.materials.get(&number) {
            Some(edit) if edit.hidden => format!("{name} (hidden)"),
            Some(_) => format!("{name} (changed)"),
            None => name,
        }
    };
    let found = |number: u32| Some((number, scene.materials.get(number as usize)?));
    let chosen = interface.material.and_then(found);
    let text = chosen.map_or_else(|| "Click a surface".to_owned(), |(number, _)| title(number));
    theme::choice(ui, "material").selected_text(text).show_ui(ui, |ui| {
        for number in 0..scene.materials.len() as u32 {
            if ui.selectable_label(interface.material == Some(number), title(number)).clicked() {
                interface.material = Some(number);
            }
        }
    });
    let (Some(number), Some((_, material))) = (interface.material, chosen) else { return };
    let before = document.materials.get(&number).copied().unwrap_or_default();
    let mut edit = before;
    let now = MaterialEdit::like(&MaterialEdit { hidden: false, ..edit }.apply(material));
    change(ui, &mut edit, now, material);
    buttons(ui, &mut edit, now, &mut interface.copied_material);
    if std::mem::take(&mut interface.is_material_new) {
        ui.scroll_to_cursor(Some(Align::BOTTOM));
    }
    if edit == MaterialEdit::default() {
        document.materials.remove(&number);
    } else if edit != before {
        document.materials.insert(number, edit);
    }
    if edit != before {
        interface.keep_moving(ui.ctx());
    }
}

/// Draws what `edit` may change of a material that looks like `now`.
fn change(ui: &mut Ui, edit: &mut MaterialEdit, now: MaterialEdit, material: &Material) {
    let has = |slot| material.texture(slot).map_or("", |_| "Multiplies the texture");
    let base = has(TextureSlot::BaseColor);
    color(ui, ("Colour", base), &mut edit.color, now.color);
    let surface = has(TextureSlot::MetallicRoughness);
    for (name, hint, value, now) in [
        ("Roughness", surface, &mut edit.roughness, now.roughness),
        ("Metalness", surface, &mut edit.metalness, now.metalness),
        ("Opacity", base, &mut edit.opacity, now.opacity),
    ] {
        setting(ui, (name, hint), value, now, |ui, value| {
            ui.add(theme::slider(value, 0.0..=1.0).fixed_decimals(2)).changed()
        });
    }
    let hint = "Largest component of the radiance that its surfaces emit";
    setting(ui, ("Emission", hint), &mut edit.emission, now.emission, |ui, value| {
        let slider = theme::slider(value, 0.0..=MaterialEdit::MAX_EMISSION).logarithmic(true);
        ui.add(slider.smallest_positive(0.01).max_decimals(2)).changed()
    });
    if now.emission != Some(0.0) {
        let hint = has(TextureSlot::Emissive);
        color(ui, ("Light colour", hint), &mut edit.emission_color, now.emission_color);
    }
}

/// What sliders leave to the button that takes a change back, in points.
const WIDTH_OF_RESET: f32 = 22.0;

/// A colour of a material.
fn color(ui: &mut Ui, words: (&str, &str), value: &mut Option<Vec3>, now: Option<Vec3>) {
    setting(ui, words, value, now, |ui, color| {
        let mut rgb = color.to_array();
        let is_changed = theme::color(ui, &mut rgb);
        *color = rgb.into();
        is_changed
    });
}

/// A row of a property, and once it is changed a button that takes the change back. `edit` says whether it has changed
/// the present value.
fn setting<T>(
    ui: &mut Ui,
    (name, hint): (&str, &str),
    value: &mut Option<T>,
    now: Option<T>,
    edit: impl FnOnce(&mut Ui, &mut T) -> bool,
) {
    let Some(mut now) = now else { return };
    theme::row(ui, name, hint, |ui| {
        ui.spacing_mut().slider_width -= WIDTH_OF_RESET;
        if edit(ui, &mut now) {
            *value = Some(now);
        }
        if value.is_some() && ui.small_button("×").on_hover_text("As in the file").clicked() {
            *value = None;
        }
    });
}

/// What is done with a material as a whole.
fn buttons(
    ui: &mut Ui,
    edit: &mut MaterialEdit,
    now: MaterialEdit,
    copied: &mut Option<MaterialEdit>,
) {
    ui.horizontal(|ui| {
        ui.checkbox(&mut edit.hidden, "Hide").on_hover_text("Invisible to the camera and to light");
        let small = |ui: &mut Ui, text: &str| ui.button(RichText::new(text).size(12.0));
        if small(ui, "Copy").on_hover_text("Remember how it looks, textures aside").clicked() {
            *copied = Some(now);
        }
        if let Some(copied) = copied
            && small(ui, "Paste").on_hover_text("Look like what was copied").clicked()
        {
            *edit = MaterialEdit { hidden: edit.hidden, ..*copied };
        }
        if *edit != MaterialEdit::default() && small(ui, "Reset").clicked() {
            *edit = MaterialEdit::default();
        }
    });
}
