//! Kept pictures.

use std::sync::Arc;

use egui::{Id, Image, RichText, Sense, TextureOptions, Ui, Vec2};

use super::button::button;
use super::scope::Scope;
use crate::app::commands::Command;
use crate::app::kept_picture::KeptPicture;
use crate::app::screen::color_image;
use crate::app::theme;

/// Height of a small picture in points.
const HEIGHT: f32 = 48.0;

/// Most characters of a name.
const MAX_NAME: usize = 80;

/// Draws the list: two can be chosen to be compared, or one and what is rendered.
pub(in crate::app) fn show(ui: &mut Ui, scope: &mut Scope<'_>) {
    let Scope { interface, library, commands, .. } = scope;
    let (chosen, history) = (&mut interface.compared, &mut library.history);
    theme::heading(ui, "KEPT PICTURES");
    let hint = "Keeps it for comparison with other pictures and later renders (K)";
    button(ui, ("Keep this picture", hint), commands, Command::KeepPicture);
    if chosen.left.is_some() {
        ui.horizontal(|ui| {
            let mut way = |is_difference, name, hint| {
                ui.selectable_value(&mut chosen.is_difference, is_difference, name)
                    .on_hover_text(hint);
            };
            way(false, "Wipe", "Side by side, with a line that can be dragged");
            way(true, "Difference", "Their difference, four times as bright");
        });
    }
    let mut removed = None;
    // The newest is what was just kept.
    for (i, kept) in history.list.iter_mut().enumerate().rev() {
        ui.horizontal(|ui| {
            if small(ui, kept).clicked() {
                chosen.left = (chosen.left != Some(i)).then_some(i);
            }
            ui.vertical(|ui| {
                ui.spacing_mut().item_spacing.y = 2.0;
                let id = Id::unique("name").with(Arc::as_ptr(&kept.pixels).addr());
                let (field, typed) = theme::text_field(ui, id, &kept.name, |field| {
                    let field = field.char_limit(MAX_NAME).desired_width(f32::INFINITY);
                    field.frame(egui::Frame::NONE).hint_text("Name")
                });
                field.on_hover_text("Click to write a name or a note");
                commands.extend(typed.map(|name| Command::RenameKept(i, name)));
                theme::note(ui, &kept.summary);
                ui.horizontal(|ui| {
                    ui.spacing_mut().item_spacing.x = 4.0;
                    side(ui, &mut chosen.left, i, "Left");
                    let has_left = chosen.left.is_some();
                    ui.add_enabled_ui(has_left, |ui| side(ui, &mut chosen.right, i, "Right"));
                    let hint = "Restores scene, map, camera and all settings of this picture";
                    if ui.small_button("Restore").on_hover_text(hint).clicked() {
                        commands.push(Command::SetAsKept(i));
                    }
                    if forget(ui, kept) {
                        removed = Some(i);
                    }
                });
            });
        });
    }
    if let Some(index) = removed {
        history.remove(index);
        chosen.without(index);
    }
}

/// Whether a picture is to be forgotten: asked twice, for its file goes with it.
fn forget(ui: &mut Ui, kept: &KeptPicture) -> bool {
    let id = Id::unique("forget a picture");
    // Others may come before it meanwhile.
    let which = Arc::as_ptr(&kept.pixels).addr();
    let is_asked = ui.data(|data| data.get_temp(id)) == Some(which);
    // As short as it can be: there is no more room beside the others.
    let sure = RichText::new("Sure?").size(11.0).color(theme::ALERT);
    let text = if is_asked { sure } else { "×".into() };
    let response = ui.small_button(text).on_hover_text("Delete this picture and its file");
    if response.clicked() {
        ui.data_mut(|data| data.insert_temp(id, which));
    }
    if is_asked && (response.clicked() || response.clicked_elsewhere()) {
        ui.data_mut(|data| data.remove::<usize>(id));
    }
    is_asked && response.clicked()
}

/// Chooses a picture for one side, or gives that back.
fn side(ui: &mut Ui, chosen: &mut Option<usize>, index: usize, name: &str) {
    let is_chosen = *chosen == Some(index);
    let hint = format!("Compare it on the {}", name.to_lowercase());
    if ui.add(egui::Button::selectable(is_chosen, name).small()).on_hover_text(hint).clicked() {
        *chosen = (!is_chosen).then_some(index);
    }
}

fn small(ui: &mut Ui, kept: &mut KeptPicture) -> egui::Response {
    let texture = kept.texture.get_or_insert_with(|| {
        ui.ctx().load_texture(&kept.name, color_image(&kept.small), TextureOptions::LINEAR)
    });
    let size = Vec2::new(HEIGHT * texture.aspect_ratio(), HEIGHT).min(Vec2::new(96.0, HEIGHT));
    let image = Image::new((texture.id(), size)).sense(Sense::click());
    ui.add(image).on_hover_text("Compares it with what is rendered; again to stop")
}
