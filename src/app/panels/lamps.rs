//! Lamps, which are lights and materials that emit: brightness of all, and each name's switch, colour and brightness.

use std::ops::Range;

use egui::{Align, DragValue, Label, Layout, RichText, ScrollArea, Ui, Vec2};
use glam::Vec3;

use super::late::{late, late_factor};
use super::scope::Scope;
use crate::app::loader::LoadedScene;
use crate::scene::{LampEdit, NamedLamp};

/// Most rows that are seen at once.
const MAX_ROWS: usize = 8;
/// Width of a name in points.
const NAME_WIDTH: f32 = 102.0;

/// Draws the section.
pub(super) fn show(ui: &mut Ui, scope: &mut Scope<'_>, scene: &LoadedScene) {
    let Scope { document, interface, .. } = scope;
    let is_late = document.mix().is_none();
    late_factor(ui, "All", "Brightness of all lamps", (&mut document.lamps, is_late));
    let mut has_changed = false;
    let mut rows = |ui: &mut Ui, rows: Range<usize>| {
        for lamp in &scene.named_lamps[rows] {
            let before = document.lamp_edits.get(&lamp.name).copied().unwrap_or_default();
            let mut edit = before;
            ui.push_id(&lamp.name, |ui| row(ui, lamp, (&mut edit, is_late)));
            if edit == before {
                continue;
            }
            // A colour begins another picture in a mix, too.
            has_changed |= is_late || edit.color != before.color;
            if edit == LampEdit::default() {
                document.lamp_edits.remove(&lamp.name);
            } else {
                document.lamp_edits.insert(lamp.name.clone(), edit);
            }
        }
    };
    match scene.named_lamps.len() {
        count @ ..=MAX_ROWS => rows(ui, 0..count),
        count => {
            let height = ui.spacing().interact_size.y;
            let list = ScrollArea::vertical().max_height(MAX_ROWS as f32 * height);
            list.show_rows(ui, height, count, rows);
        }
    }
    let is_changed = document.lamps != 1.0 || !document.lamp_edits.is_empty();
    if is_changed && ui.button(RichText::new("Reset lamps").size(12.0)).clicked() {
        document.lamps = 1.0;
        document.lamp_edits.clear();
        has_changed |= is_late;
    }
    if has_changed {
        interface.keep_moving(ui.ctx());
    }
}

fn row(ui: &mut Ui, lamp: &NamedLamp, (edit, is_late): (&mut LampEdit, bool)) {
    ui.horizontal(|ui| {
        let mut is_on = !edit.off;
        ui.checkbox(&mut is_on, "").on_hover_text("On or off");
        edit.off = !is_on;
        let size = Vec2::new(NAME_WIDTH, ui.spacing().interact_size.y);
        ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
            ui.set_min_width(NAME_WIDTH);
            ui.add(Label::new(&lamp.name).truncate());
        });
        let mut rgb = edit.color.unwrap_or(lamp.color).to_array();
        let patch = ui.color_edit_button_rgb(&mut rgb).on_hover_text("Colour of its light");
        let rgb = Vec3::from(rgb).clamp(Vec3::ZERO, Vec3::ONE);
        // Black has no colour: the box switches it off.
        if patch.changed() && rgb != Vec3::ZERO {
            edit.color = Some(rgb);
        }
        late(ui, "factor", (&mut edit.factor, is_late), |ui, value| {
            let range = 0.0..=LampEdit::MAX_FACTOR;
            let number = DragValue::new(value).range(range).speed(0.02).max_decimals(6);
            ui.add(number.prefix("× ")).on_hover_text("Brightness: drag, or click and type")
        });
    });
}
