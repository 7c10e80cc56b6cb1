//! What the scene and the map need of the renderer, and what is left out.

use egui::{RichText, Ui};

use crate::app::assets::Assets;
use crate::app::theme;

/// Draws two columns: what is used, what is left out.
pub(in crate::app) fn show(ui: &mut Ui, Assets { scene, map, .. }: &Assets) {
    let Some(scene) = scene else { return };
    let needs = &scene.world.needs;
    ui.columns_const(|[left, right]| {
        for column in [&mut *left, &mut *right] {
            // Columns stretch lines to their width otherwise.
            column.style_mut().wrap_mode = Some(egui::TextWrapMode::Truncate);
        }
        theme::heading(left, "USED");
        for name in needs.used() {
            left.label(RichText::new(name).size(12.5));
        }
        theme::heading(right, "LEFT OUT");
        for sentence in needs.left_out() {
            right.label(theme::quiet(sentence));
        }
        let kernel = &scene.kernel;
        right.label(theme::quiet(format!(
            "of the GPU's kernel: {} of {} of source; of a vertex: {} of {} bytes",
            theme::bytes(kernel.full_source_bytes - kernel.source_bytes),
            theme::bytes(kernel.full_source_bytes),
            kernel.full_vertex_bytes - kernel.vertex_bytes,
            kernel.full_vertex_bytes
        )));
        if map.as_ref().is_some_and(|map| map.environment.is_black()) {
            right.label(theme::quiet("sampling of the map and the Light Grid: the map is black"));
        }
        if map.as_ref().is_some_and(|map| map.environment.is_constant()) {
            right.label(theme::quiet("nothing more for the map: it is the same everywhere"));
        }
    });
}
