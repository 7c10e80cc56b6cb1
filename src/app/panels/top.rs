//! The bar above: files, undo, who renders, what runs.

use egui::{Align, Layout, Margin, Panel, Ui};

use crate::app::commands::Command;
use crate::app::document::Document;
use crate::app::interface::{Interface, Tab};
use crate::app::theme;
use crate::app::undo::Undo;
use crate::render::gpu::DeviceChoice;

/// Draws the bar.
pub(in crate::app) fn show(
    ui: &mut Ui,
    document: &mut Document,
    interface: &mut Interface,
    undo: &Undo<Document>,
    is_on_gpu: bool,
    commands: &mut Vec<Command>,
) {
    let frame = egui::Frame::new().fill(theme::PANEL).inner_margin(Margin::symmetric(10, 7));
    Panel::top("top").frame(frame).show(ui, |ui| {
        ui.horizontal(|ui| {
            files(ui, commands);
            ui.separator();
            steps(ui, undo, commands);
            ui.separator();
            device(ui, document, is_on_gpu);
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                running(ui, document, interface, commands);
            });
        });
    });
}

fn files(ui: &mut Ui, commands: &mut Vec<Command>) {
    let is_narrow = theme::is_narrow(ui);
    let has_room = ui.ctx().content_rect().width() >= 800.0;
    let mut button = |text: &str, hint: &str, command: Command| {
        if ui.button(text).on_hover_text(hint).clicked() {
            commands.push(command);
        }
    };
    button(
        if is_narrow { "Scene…" } else { "Open scene…" },
        "A glTF file (Ctrl O); it can be dropped onto the window too",
        Command::ChooseScene,
    );
    button(
        if is_narrow { "Map…" } else { "Open map…" },
        "A lat-long HDR map (Ctrl M); it can be dropped onto the window too",
        Command::ChooseMap,
    );
    button("Save…", "The picture as .png or .exr (Ctrl S)", Command::ChooseSave);
    if has_room {
        button("Copy", "The picture to the clipboard (Ctrl C)", Command::Copy);
    }
}

fn steps(ui: &mut Ui, undo: &Undo<Document>, commands: &mut Vec<Command>) {
    let mut button = |is_enabled: bool, text: &str, hint: &str, command: Command| {
        let button = ui.add_enabled(is_enabled, egui::Button::new(text));
        if button.on_hover_text(hint).clicked() {
            commands.push(command);
        }
    };
    button(undo.can_undo(), "Undo", "Undo the last change of a setting (Ctrl Z)", Command::Undo);
    button(undo.can_redo(), "Redo", "Redo (Ctrl Y)", Command::Redo);
}

/// Who renders; what is highlighted is what does, not what was asked for.
fn device(ui: &mut Ui, document: &mut Document, is_on_gpu: bool) {
    ui.spacing_mut().item_spacing.x = 3.0;
    let mut choose = |text: &str, hint: &str, is_on: bool, choice: DeviceChoice| {
        if ui.selectable_label(is_on, text).on_hover_text(hint).clicked() {
            document.light.device = choice;
        }
    };
    choose("CPU", "Render on the processor (G changes)", !is_on_gpu, DeviceChoice::Cpu);
    choose("GPU", "Render on the graphics card (G changes)", is_on_gpu, DeviceChoice::Gpu);
    ui.spacing_mut().item_spacing.x = 8.0;
}

fn running(
    ui: &mut Ui,
    document: &mut Document,
    interface: &mut Interface,
    commands: &mut Vec<Command>,
) {
    if ui.button("?").on_hover_text("Keys and gestures").clicked() {
        commands.push(Command::ToggleShortcuts);
    }
    let is_developer = interface.tab == Tab::Inspect || interface.dock.is_some();
    let developer = ui.selectable_label(is_developer, "Inspect");
    if developer.on_hover_text("Overlays, inspector and plots (F12)").clicked() {
        commands.push(Command::ToggleDeveloper);
    }
    // The right panel has it too.
    if !theme::is_narrow(ui) {
        ui.toggle_value(&mut document.look.denoise, "Denoise").on_hover_text(
            "Filter what noise is left, for display and .png; off and on shows the difference (N)",
        );
    }
    ui.separator();
    if ui.button("Restart").on_hover_text("Start the picture again (R)").clicked() {
        commands.push(Command::Restart);
    }
    let (symbol, hint) =
        if interface.paused { ("Resume", "Go on (Space)") } else { ("Pause", "Pause (Space)") };
    if ui.button(symbol).on_hover_text(hint).clicked() {
        commands.push(Command::TogglePause);
    }
}
