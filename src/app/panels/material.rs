//! The material that was clicked: its colour, roughness and metalness, and whether it is there at all.

use egui::{Align, RichText, Ui};
use glam::Vec3;

use super::controls::Controls;
use crate::app::document::called;
use crate::app::loader::LoadedScene;
use crate::app::theme;
use crate::scene::{Material, MaterialEdit, TextureSlot};

/// Draws the section.
pub(super) fn show(ui: &mut Ui, controls: &mut Controls<'_>, scene: &LoadedScene) {
    let Controls { document, interface, .. } = controls;
    let title = |number: u32| {
        let name = called(number, &scene.materials);
        match document.materials.get(&number) {
            Some(edit) if edit.hidden => format!("{name} (hidden)"),
            Some(_) => format!("{name} (changed)"),
            None => name,
        }
    };
    let chosen = interface.material.and_then(|number| scene.materials.get(number as usize));
    let text = match (interface.material, chosen) {
        (Some(number), Some(_)) => title(number),
        _ => "Click a surface".to_owned(),
    };
    theme::choice(ui, "material").selected_text(text).show_ui(ui, |ui| {
        for number in 0..scene.materials.len() as u32 {
            let is_chosen = interface.material == Some(number);
            if ui.selectable_label(is_chosen, title(number)).clicked() {
                interface.material = Some(number);
            }
        }
    });
    let (Some(number), Some(material)) = (interface.material, chosen) else { return };
    let before = document.materials.get(&number).copied().unwrap_or_default();
    let mut edit = before;
    change(ui, &mut edit, material);
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

fn change(ui: &mut Ui, edit: &mut MaterialEdit, material: &Material) {
    let has = |texture: bool| if texture { "Multiplies the texture" } else { "" };
    theme::row(ui, "Colour", has(material.texture(TextureSlot::BaseColor).is_some()), |ui| {
        let mut rgb = edit.color.unwrap_or(material.base_color.truncate()).to_array();
        if theme::color(ui, &mut rgb) {
            edit.color = Some(Vec3::from(rgb));
        }
    });
    let of_texture = has(material.texture(TextureSlot::MetallicRoughness).is_some());
    let mut share = |name: &str, value: &mut Option<f32>, own: f32| {
        let mut now = value.unwrap_or(own);
        let slider = theme::slider(&mut now, 0.0..=1.0).fixed_decimals(2);
        if theme::set(ui, name, of_texture, slider).changed() {
            *value = Some(now);
        }
    };
    share("Roughness", &mut edit.roughness, material.roughness);
    share("Metalness", &mut edit.metalness, material.metallic);
    ui.horizontal(|ui| {
        ui.checkbox(&mut edit.hidden, "Hide").on_hover_text("Invisible to the camera and to light");
        let text = RichText::new("Reset").size(12.0);
        if *edit != MaterialEdit::default() && ui.button(text).clicked() {
            *edit = MaterialEdit::default();
        }
    });
}
