//! Buttons for commands.

use egui::Ui;

use crate::app::commands::Command;
use crate::app::theme;

/// A button that gives a command.
pub(super) fn button(
    ui: &mut Ui,
    (text, hint): (&str, &str),
    commands: &mut Vec<Command>,
    command: Command,
) {
    if ui.button(text).on_hover_text(theme::keys(hint)).clicked() {
        commands.push(command);
    }
}
