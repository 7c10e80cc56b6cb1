//! Kept pictures.

use egui::Ui;

use crate::app::commands::Command;
use crate::app::history::History;
use crate::app::interface::Interface;
use crate::app::theme;

/// Draws the list: one can be chosen to wipe against.
pub(in crate::app) fn show(
    ui: &mut Ui,
    history: &mut History,
    interface: &mut Interface,
    _commands: &mut [Command],
) {
    let mut removed = None;
    for (i, kept) in history.list().iter().enumerate() {
        ui.horizontal(|ui| {
            let is_chosen = interface.compared == Some(i);
            let label = ui.selectable_label(is_chosen, &kept.name).on_hover_text(&kept.summary);
            if label.clicked() {
                interface.compared = (!is_chosen).then_some(i);
            }
            if ui.small_button("×").on_hover_text("Forget this picture").clicked() {
                removed = Some(i);
            }
        });
        ui.label(theme::quiet(&kept.summary));
    }
    if let Some(index) = removed {
        history.remove(index);
        interface.compared = None;
    }
}
