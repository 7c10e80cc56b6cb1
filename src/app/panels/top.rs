//! The bar above: files, undo, how light is found, what runs.

use egui::{Align, Layout, Margin, Panel, Ui};

use crate::app::commands::Command;
use crate::app::convergence::name_of;
use crate::app::document::Document;
use crate::app::interface::{Interface, Tab};
use crate::app::theme;
use crate::app::undo::Undo;
use crate::render::Sampling;
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
            sampling(ui, document);
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
    button("Copy", "The picture to the clipboard (Ctrl C)", Command::Copy);
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

fn sampling(ui: &mut Ui, document: &mut Document) {
    let capital = |sampling| {
        let name = name_of(sampling);
        format!("{}{}", name[..1].to_uppercase(), &name[1..])
    };
    let chosen = &mut document.light.sampling;
    if theme::is_narrow(ui) {
        egui::ComboBox::from_id_salt("sampling")
            .width(90.0)
            .selected_text(capital(*chosen))
            .show_ui(ui, |ui| {
                for (sampling, hint) in WAYS {
                    ui.selectable_value(chosen, sampling, capital(sampling)).on_hover_text(hint);
                }
            });
        return;
    }
    ui.spacing_mut().item_spacing.x = 3.0;
    for (sampling, hint) in WAYS {
        ui.selectable_value(chosen, sampling, capital(sampling)).on_hover_text(hint);
    }
    ui.spacing_mut().item_spacing.x = 8.0;
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

/// Ways of sampling the map, and what they do.
const WAYS: [(Sampling, &str); 4] = [
    (Sampling::Adaptive, "Learned tiles, with faces, cosine weights and pooling"),
    (Sampling::Talk, "Learned tiles as the SIGGRAPH talk describes them"),
    (Sampling::Plain, "The whole map by its brightness"),
    (Sampling::Bsdf, "Directions of the surfaces alone"),
];

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
    ui.toggle_value(
        &mut document.light.split,
        if theme::is_narrow(ui) { "Split" } else { "Split view" },
    )
    .on_hover_text("Plain on the left, the chosen sampling on the right, at equal time (V)");
    // The right panel has it too.
    if !theme::is_narrow(ui) {
        ui.toggle_value(&mut document.look.denoise, "Denoise")
            .on_hover_text("Filter what noise is left, for display and .png (N)");
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
