//! The bar above: files, undo, who renders, what runs.

use egui::{Align, Layout, Margin, Panel, Ui};

use super::button::button;
use crate::app::commands::Command;
use crate::app::document::Document;
use crate::app::interface::{Interface, Purpose, Tab};
use crate::app::theme;
use crate::app::undo::Undo;
use crate::render::gpu::DeviceChoice;

/// Draws the bar.
pub(in crate::app) fn show(
    ui: &mut Ui,
    document: &mut Document,
    interface: &Interface,
    undo: &Undo<Document>,
    is_on_gpu: bool,
    commands: &mut Vec<Command>,
) {
    let frame = egui::Frame::new().inner_margin(Margin::symmetric(10, 7));
    Panel::top("top").frame(frame).show(ui, |ui| {
        let width = ui.ctx().content_rect().width();
        let is_tight = width < TIGHT;
        if width < TIGHTEST {
            ui.spacing_mut().item_spacing.x = 3.0;
            ui.spacing_mut().button_padding.x = 7.0;
        }
        ui.horizontal(|ui| {
            files(ui, commands);
            if is_tight {
                ui.menu_button("More", |ui| {
                    copy(ui, commands);
                    steps(ui, undo, commands);
                    ui.separator();
                    device(ui, document, is_on_gpu);
                    ui.separator();
                    restart(ui, commands);
                    shortcuts(ui, "Keys and gestures", commands);
                });
            } else {
                copy(ui, commands);
                ui.separator();
                steps(ui, undo, commands);
                ui.separator();
                ui.spacing_mut().item_spacing.x = 3.0;
                device(ui, document, is_on_gpu);
                ui.spacing_mut().item_spacing.x = 8.0;
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                if !is_tight {
                    shortcuts(ui, "?", commands);
                }
                let is_developer = interface.tab == Tab::Inspect || interface.dock.is_some();
                let developer = ui.selectable_label(is_developer, "Inspect");
                if developer.on_hover_text("Overlays, inspector and plots (F12)").clicked() {
                    commands.push(Command::ToggleDeveloper);
                }
                // The right panel has it too.
                if !theme::is_narrow(ui) {
                    ui.toggle_value(&mut document.look.denoise, "Denoise")
                        .on_hover_text("Removes noise on the screen and in .png files (N)");
                }
                if !is_tight {
                    ui.separator();
                    restart(ui, commands);
                }
                let words = match interface.paused {
                    true => ("Resume", "Resume rendering (Space)"),
                    false => ("Pause", "Pause rendering (Space)"),
                };
                button(ui, words, commands, Command::TogglePause);
            });
        });
    });
}

/// Points of width below which there is no room for all in a row.
const TIGHT: f32 = 800.0;
/// And where the little that is left must move together.
const TIGHTEST: f32 = 480.0;

fn files(ui: &mut Ui, commands: &mut Vec<Command>) {
    let is_narrow = theme::is_narrow(ui);
    let scene = if is_narrow { "Scene…" } else { "Open scene…" };
    let hint = "A glTF file (Ctrl O); files can be dropped onto the window, too";
    button(ui, (scene, hint), commands, Command::Ask(Purpose::Scene));
    let map = if is_narrow { "Map…" } else { "Open map…" };
    let hint = "A lat-long HDR map (Ctrl M); files can be dropped onto the window, too";
    button(ui, (map, hint), commands, Command::Ask(Purpose::Map));
    let hint = "Save the picture as .png or .exr (Ctrl S)";
    button(ui, ("Save…", hint), commands, Command::Ask(Purpose::Picture));
}

fn copy(ui: &mut Ui, commands: &mut Vec<Command>) {
    let hint = "Copy the picture to the clipboard (Ctrl C)";
    button(ui, ("Copy", hint), commands, Command::Copy);
}

fn restart(ui: &mut Ui, commands: &mut Vec<Command>) {
    button(ui, ("Restart", "Start the picture again (R)"), commands, Command::Restart);
}

fn steps(ui: &mut Ui, undo: &Undo<Document>, commands: &mut Vec<Command>) {
    let mut button = |is_enabled: bool, text: &str, hint: &str, command: Command| {
        let button = ui.add_enabled(is_enabled, egui::Button::new(text));
        if button.on_hover_text(theme::keys(hint)).clicked() {
            commands.push(command);
        }
    };
    let hint = "Undo the last change of a setting (Ctrl Z)";
    button(!undo.past.is_empty(), "Undo", hint, Command::Undo);
    button(!undo.future.is_empty(), "Redo", "Redo (Ctrl Y)", Command::Redo);
}

/// Who renders; what is highlighted is what does, not what was asked for.
fn device(ui: &mut Ui, document: &mut Document, is_on_gpu: bool) {
    let mut choose = |text: &str, hint: &str, is_on: bool, choice: DeviceChoice| {
        if ui.selectable_label(is_on, text).on_hover_text(hint).clicked() {
            document.light.device = choice;
        }
    };
    choose("CPU", "Render on the CPU (G switches)", !is_on_gpu, DeviceChoice::Cpu);
    choose("GPU", "Render on the GPU (G switches)", is_on_gpu, DeviceChoice::Gpu);
}

fn shortcuts(ui: &mut Ui, text: &str, commands: &mut Vec<Command>) {
    button(ui, (text, "Keys and gestures (?)"), commands, Command::ToggleShortcuts);
}

#[cfg(test)]
mod tests {
    use egui::{Context, Pos2, RawInput, Rect, Shape, Vec2};

    use super::*;

    /// Where the words of the bar are.
    fn words(width: f32) -> Vec<(String, Rect)> {
        let context = Context::default();
        theme::apply(&context);
        let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, Vec2::new(width, 300.0)));
        let (mut document, undo) = (Document::default(), Undo::new(Document::default()));
        let interface = Interface { paused: true, ..Interface::default() };
        let mut draw = || {
            let input = RawInput { screen_rect, ..RawInput::default() };
            context.run_ui(input, |ui| {
                show(ui, &mut document, &interface, &undo, true, &mut Vec::new());
            })
        };
        // Sizes are known after a frame.
        let _ = draw();
        let word = |shape: &Shape| match shape {
            Shape::Text(text) => {
                Some((text.galley.text().to_owned(), shape.visual_bounding_rect()))
            }
            _ => None,
        };
        draw().shapes.iter().filter_map(|clipped| word(&clipped.shape)).collect()
    }

    #[test]
    fn nothing_in_the_bar_covers_anything_else() {
        for width in
            [400.0, 500.0, 640.0, 720.0, 799.0, 800.0, 900.0, 1000.0, 1260.0, 1440.0, 3840.0]
        {
            let plate = Vec2::new(if width < TIGHTEST { 7.0 } else { 9.0 }, 0.0);
            let words: Vec<_> =
                words(width).into_iter().map(|(word, rect)| (word, rect.expand2(plate))).collect();
            assert!(words.len() >= 6, "{width}: {words:?}");
            for (i, (word, place)) in words.iter().enumerate() {
                let is_inside = place.left() >= 0.0 && place.right() <= width;
                assert!(is_inside, "{width}: {word:?} is at {place:?}");
                for (other, of_other) in &words[..i] {
                    assert!(!place.intersects(*of_other), "{width}: {word:?} is over {other:?}");
                }
            }
        }
    }
}
