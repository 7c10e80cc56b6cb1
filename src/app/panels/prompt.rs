//! Asking for a path: typed, pasted, recent, or from the system's dialogue.

use std::path::Path;

use egui::text::{CCursor, CCursorRange};
use egui::{Context, Id, Key, Modal, RichText, TextEdit};

use crate::app::commands::Command;
use crate::app::interface::{Interface, Objection, Purpose};
use crate::app::settings_file::Settings;
use crate::app::theme;
use crate::sources;

/// What is to be known of a path before it is taken.
fn objection(purpose: Purpose, path: &str) -> Option<Objection> {
    let is_there = Path::new(path).exists();
    let is_missing = match purpose {
        Purpose::Scene => sources::check_scene(path).is_err(),
        Purpose::Map => !(is_there || sources::is_built_in_map(path)),
        Purpose::Reference => !is_there,
        Purpose::Picture | Purpose::Distributions => {
            return is_there.then_some(Objection::Replaces);
        }
    };
    is_missing.then_some(Objection::Missing)
}

fn sentence(objection: Objection) -> &'static str {
    match objection {
        Objection::Missing => "There is no such file.",
        Objection::Replaces => "This file is there already: Enter again replaces it.",
    }
}

/// Draws the open prompt, if any.
pub(in crate::app) fn show(
    context: &Context,
    interface: &mut Interface,
    settings: &Settings,
    commands: &mut Vec<Command>,
) {
    let Some(prompt) = &mut interface.prompt else { return };
    let (title, hint, accept, recent): (_, _, _, &[String]) = match prompt.purpose {
        Purpose::Scene => {
            ("Open a scene", "Path of a .gltf or .glb file", "Open", &settings.recent_scenes)
        }
        Purpose::Map => {
            ("Open a map", "Path of an .exr, .hdr or 8-bit picture", "Open", &settings.recent_maps)
        }
        Purpose::Picture => (
            "Save the picture",
            "Path of a .png (as shown) or .exr (linear, all layers)",
            "Save",
            &[],
        ),
        Purpose::Reference => (
            "Open a reference",
            "Path of a linear .exr or .hdr picture of the same view without noise",
            "Open",
            &[],
        ),
        Purpose::Distributions => {
            ("Export the distributions", "Path of a .csv, .json or .exr file", "Export", &[])
        }
    };
    let (mut is_done, mut is_closed) = (false, false);
    let response = Modal::new(Id::unique("prompt")).show(context, |ui| {
        ui.set_width(520.0);
        ui.label(RichText::new(title).heading());
        ui.add_space(4.0);
        let field = TextEdit::singleline(&mut prompt.path);
        let mut field = field.hint_text(hint).desired_width(f32::INFINITY).show(ui);
        if !prompt.is_focused {
            field.response.request_focus();
            prompt.is_focused = true;
            // Whoever types means another name.
            let end = CCursor::new(prompt.path.chars().count());
            field.state.cursor.set_char_range(Some(CCursorRange::two(CCursor::new(0), end)));
            field.state.store(ui.ctx(), field.response.id);
        }
        let field = field.response;
        if field.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter)) {
            is_done = true;
            // Enter takes the keyboard away; without a path there is nothing to be done yet.
            field.request_focus();
        }
        let objection = prompt.objection.as_ref().filter(|(of, _)| of == prompt.path.trim());
        let objection = objection.map(|(_, objection)| *objection);
        if let Some(objection) = objection {
            ui.label(RichText::new(sentence(objection)).color(theme::ALERT));
        }
        for name in recent {
            if ui.link(RichText::new(name).size(12.5)).clicked() {
                prompt.path.clone_from(name);
                is_done = true;
            }
        }
        ui.add_space(6.0);
        ui.horizontal(|ui| {
            let replaces = objection == Some(Objection::Replaces);
            let accept = if replaces { "Replace" } else { accept };
            is_done |= ui.button(RichText::new(accept).color(theme::ACCENT)).clicked();
            if ui.button("Browse…").on_hover_text("The system's file dialogue").clicked() {
                commands.push(Command::Browse(prompt.purpose));
            }
            is_closed |= ui.button("Cancel").clicked();
        });
    });
    let path = prompt.path.trim();
    if is_done && !path.is_empty() {
        let is_known = prompt.objection.as_ref().is_some_and(|(of, _)| of == path);
        match objection(prompt.purpose, path) {
            Some(objection) if objection == Objection::Missing || !is_known => {
                prompt.objection = Some((path.to_owned(), objection));
            }
            _ => {
                commands.push(prompt.purpose.command(path));
                is_closed = true;
            }
        }
    }
    if is_closed || response.should_close() {
        interface.prompt = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_opened_that_is_not_there_and_nothing_replaced_unasked() {
        let folder = tempfile::tempdir().expect("a folder");
        let [there, gone] = ["a.png", "b.png"].map(|name| folder.path().join(name));
        std::fs::write(&there, "").expect("written");
        let asked = |purpose, path: &Path| objection(purpose, path.to_str().expect("text"));
        for purpose in [Purpose::Scene, Purpose::Map, Purpose::Reference] {
            assert_eq!(
                (asked(purpose, &there), asked(purpose, &gone)),
                (None, Some(Objection::Missing))
            );
        }
        for purpose in [Purpose::Picture, Purpose::Distributions] {
            assert_eq!(
                (asked(purpose, &there), asked(purpose, &gone)),
                (Some(Objection::Replaces), None)
            );
        }
        assert_eq!(objection(Purpose::Scene, "office"), None);
        assert_eq!(objection(Purpose::Map, "sky:day@64x32"), None);
    }
}
