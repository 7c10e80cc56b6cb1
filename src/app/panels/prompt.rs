//! Asking for a path: typed, pasted, recent, or from the system's dialogue.

use std::path::{MAIN_SEPARATOR, Path, is_separator};

use egui::text::{CCursor, CCursorRange};
use egui::{Align, Context, Id, Key, Layout, Modal, Modifiers, Response, RichText, TextEdit, Ui};

use super::map_view;
use crate::app::commands::Command;
use crate::app::completion::{Completion, complete, in_home};
use crate::app::interface::{Cursor, Interface, Objection, Prompt, Purpose};
use crate::app::settings_file::Settings;
use crate::app::small_maps::SmallMaps;
use crate::app::theme;
use crate::image::extension;
use crate::sources;

/// What is to be known of a path before it is taken.
fn objection(purpose: Purpose, path: &str) -> Option<Objection> {
    let is_there = Path::new(path).exists();
    if purpose.is_output() {
        let (_, extensions) = purpose.files();
        if !extension(Path::new(path)).is_some_and(|extension| extensions.contains(&&*extension)) {
            return Some(Objection::Unknown);
        }
        let folder = Path::new(path).parent().filter(|folder| !folder.as_os_str().is_empty());
        if folder.is_some_and(|folder| !folder.is_dir()) {
            return Some(Objection::NoFolder);
        }
        return is_there.then_some(Objection::Replaces);
    }
    (!is_there && !is_built_in(purpose, path)).then_some(Objection::Missing)
}

fn is_built_in(purpose: Purpose, name: &str) -> bool {
    match purpose {
        Purpose::Scene => sources::is_built_in_scene(name),
        Purpose::Map => sources::is_built_in_map(name),
        _ => false,
    }
}

fn sentence(objection: Objection, purpose: Purpose) -> String {
    match objection {
        Objection::Missing => "There is no such file.".to_owned(),
        Objection::NoFolder => "There is no such folder.".to_owned(),
        Objection::Unknown => {
            format!("It must end in .{}.", purpose.files().1.join(" or ."))
        }
        Objection::Replaces => "This file is there already: Enter again replaces it.".to_owned(),
    }
}

/// Ways to go on that are shown.
const MAX_OFFERS: usize = 12;

impl Prompt {
    /// Goes on with what is typed as far as there is one way, and offers the ways where there are several.
    fn complete(&mut self) {
        let (_, extensions) = self.purpose.files();
        let Completion { path, offers } = complete(&self.path, extensions);
        (self.path, self.offers) = (path, offers);
        self.cursor = Some(Cursor::AtEnd);
    }

    /// Goes on from here.
    fn go_on(&mut self, path: String) {
        self.path = path;
        self.complete();
    }
}

/// Draws the open prompt, if any.
pub(in crate::app) fn show(
    context: &Context,
    interface: &mut Interface,
    settings: &mut Settings,
    small_maps: &SmallMaps,
    commands: &mut Vec<Command>,
) {
    let Some(prompt) = &mut interface.prompt else { return };
    let (hint, accept, recent): (_, _, &[String]) = match prompt.purpose {
        Purpose::Scene => ("Path of a .gltf or .glb file", "Open", &settings.recent_scenes),
        Purpose::Map => ("Path of an .exr, .hdr or 8-bit picture", "Open", &settings.recent_maps),
        Purpose::Picture => ("Path of a .png (as shown) or .exr (linear, all layers)", "Save", &[]),
        Purpose::Reference => {
            ("Path of a linear .exr or .hdr picture of the same view without noise", "Open", &[])
        }
        Purpose::Distributions => ("Path of a .csv, .json or .exr file", "Export", &[]),
    };
    let (mut is_done, mut is_closed) = (false, false);
    let response = Modal::new(Id::unique("prompt")).show(context, |ui| {
        ui.set_width(520.0);
        ui.label(RichText::new(prompt.purpose.title()).heading());
        ui.add_space(4.0);
        if ui.input_mut(|i| i.consume_key(Modifiers::NONE, Key::Tab)) {
            prompt.complete();
        }
        let field = TextEdit::singleline(&mut prompt.path).hint_text(hint).lock_focus(true);
        let mut field = field.desired_width(f32::INFINITY).show(ui);
        if let Some(cursor) = prompt.cursor.take() {
            // Asked for again, it would not keep Tab for itself in the next frame.
            if !field.response.has_focus() {
                field.response.request_focus();
            }
            let end = CCursor::new(prompt.path.chars().count());
            let begin = if cursor == Cursor::OverAll { CCursor::new(0) } else { end };
            field.state.cursor.set_char_range(Some(CCursorRange::two(begin, end)));
            field.state.store(ui.ctx(), field.response.id);
            ui.ctx().request_repaint();
        }
        let field = field.response;
        if field.changed() {
            prompt.offers.clear();
        }
        if field.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter)) {
            is_done = true;
            // Enter takes the keyboard away; without a path there is nothing to be done yet.
            field.request_focus();
        }
        let objection = prompt.objection.as_ref().filter(|(of, _)| of == prompt.path.trim());
        let objection = objection.map(|(_, objection)| *objection);
        if let Some(objection) = objection {
            ui.label(RichText::new(sentence(objection, prompt.purpose)).color(theme::ALERT));
        }
        let mut taken = None;
        for offer in prompt.offers.iter().take(MAX_OFFERS) {
            if path_link(ui, offer).clicked() {
                taken = Some(offer.clone());
            }
        }
        if let Some(offer) = taken {
            prompt.go_on(offer);
            ui.ctx().request_repaint();
        }
        let hidden = prompt.offers.len().saturating_sub(MAX_OFFERS);
        if hidden > 0 {
            ui.label(theme::quiet(format!("and {hidden} more")));
        }
        let recent = if prompt.offers.is_empty() { recent } else { &[] };
        for name in recent {
            ui.horizontal(|ui| {
                let is_map = prompt.purpose == Purpose::Map;
                if let Some(small) = small_maps.of(name).filter(|_| is_map) {
                    ui.add(map_view::small(small));
                }
                if path_link(ui, name).clicked() {
                    prompt.path.clone_from(name);
                    is_done = true;
                }
            });
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
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let is_at_once = &mut settings.browses_at_once;
                ui.checkbox(is_at_once, theme::quiet("Browse at once"))
                    .on_hover_text("Open the system's file dialogue together with this question");
            });
        });
    });
    let typed = prompt.path.trim();
    let path = &in_home(typed);
    if is_done && !is_built_in(prompt.purpose, path) && Path::new(path).is_dir() {
        let is_ended = typed.ends_with(is_separator);
        prompt.go_on(if is_ended { typed.to_owned() } else { format!("{typed}{MAIN_SEPARATOR}") });
        context.request_repaint();
    } else if is_done && !typed.is_empty() {
        let is_known = prompt.objection.as_ref().is_some_and(|(of, _)| of == typed);
        match objection(prompt.purpose, path) {
            Some(objection) if objection != Objection::Replaces || !is_known => {
                prompt.objection = Some((typed.to_owned(), objection));
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

/// A path on one line, which gives its end where there is little room.
fn path_link(ui: &mut Ui, path: &str) -> Response {
    const MAX_CHARACTERS: usize = 74;
    let hidden = path.chars().count().saturating_sub(MAX_CHARACTERS);
    let end: String = path.chars().skip(hidden).collect();
    let text = if hidden > 0 { format!("…{end}") } else { end };
    let link = ui.link(RichText::new(text).size(12.5));
    if hidden > 0 { link.on_hover_text(path) } else { link }
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
        assert_eq!(
            (asked(Purpose::Picture, &there), asked(Purpose::Picture, &gone)),
            (Some(Objection::Replaces), None)
        );
        let [there, gone] = ["a.csv", "b.csv"].map(|name| folder.path().join(name));
        std::fs::write(&there, "").expect("written");
        assert_eq!(
            (asked(Purpose::Distributions, &there), asked(Purpose::Distributions, &gone)),
            (Some(Objection::Replaces), None)
        );
        let nowhere = folder.path().join("gone").join("b.png");
        assert_eq!(asked(Purpose::Picture, &nowhere), Some(Objection::NoFolder));
        let nameless = folder.path().join("b");
        assert_eq!(asked(Purpose::Picture, &nameless), Some(Objection::Unknown));
        assert_eq!(objection(Purpose::Scene, "office"), None);
        assert_eq!(objection(Purpose::Map, "sky:day@64x32"), None);
    }
}
