//! Asking for a path to type or paste; the system's dialogue lies before it where there is one.

use std::path::{Path, is_separator};

use egui::text::{CCursor, CCursorRange};
use egui::{Context, Id, Key, Modal, RichText, TextEdit};

use crate::app::commands::Command;
use crate::app::interface::{Interface, Purpose, Refusal};
use crate::app::theme;
use crate::image::extension;
use crate::sources;

/// Why a path is not taken, unless it is; `typed` is the path as it was typed.
fn refusal(purpose: Purpose, typed: &str, path: &Path) -> Option<Refusal> {
    let refused = |sentence: &str| {
        Some(Refusal { path: typed.to_owned(), sentence: sentence.to_owned(), replaces: false })
    };
    let (_, _, extensions) = purpose.words();
    let is_known = || extension(path).is_some_and(|extension| extensions.contains(&&*extension));
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let is_built_in = match purpose {
        Purpose::Scene => sources::is_built_in_scene(typed),
        Purpose::Map => sources::is_built_in_map(typed),
        _ => false,
    };
    match path {
        _ if is_built_in => None,
        _ if path.is_dir() => refused("This is a folder."),
        _ if !purpose.is_output() && !path.exists() => refused("There is no such file."),
        _ if !purpose.is_output() => None,
        _ if !is_known() => refused(&format!("It must end in .{}.", extensions.join(" or ."))),
        _ if folder.is_some_and(|folder| !folder.is_dir()) => refused("There is no such folder."),
        _ if path.exists() => {
            let refusal = refused("This file is there already: Enter again replaces it.");
            refusal.map(|refusal| Refusal { replaces: true, ..refusal })
        }
        _ => None,
    }
}

/// A path in which `~` at the beginning is the user's own folder.
fn in_home(path: &str) -> String {
    let rest =
        path.strip_prefix('~').filter(|rest| rest.is_empty() || rest.starts_with(is_separator));
    match rest.zip(std::env::home_dir()) {
        Some((rest, home)) => format!("{}{rest}", home.display()),
        None => path.to_owned(),
    }
}

/// Draws the open prompt, if any.
pub(in crate::app) fn show(
    context: &Context,
    interface: &mut Interface,
    commands: &mut Vec<Command>,
) {
    let Some(prompt) = &mut interface.prompt else { return };
    let (hint, accept) = match prompt.purpose {
        Purpose::Scene => ("Path of a .gltf or .glb file", "Open"),
        Purpose::Map => ("Path of an .exr, .hdr or 8-bit picture", "Open"),
        Purpose::Look => ("Path of a .cube file", "Open"),
        Purpose::Picture => ("Path of a .png (as shown) or .exr (linear, all layers)", "Save"),
        Purpose::Render => ("Path of a .png (developed) or .exr (linear, all layers)", "Render"),
        Purpose::RenderFrames => {
            ("Path of an .mp4, .webm or .gif, or of .png or .exr pictures to be numbered", "Render")
        }
        Purpose::Reference => {
            ("Path of a linear .exr or .hdr picture of the same view without noise", "Open")
        }
        Purpose::Distributions => ("Path of a .csv, .json or .exr file", "Export"),
    };
    let (mut is_done, mut is_closed) = (false, false);
    let response = Modal::new(Id::unique("prompt")).show(context, |ui| {
        ui.set_width(520.0);
        ui.label(RichText::new(prompt.purpose.words().0).heading());
        ui.add_space(4.0);
        let field = TextEdit::singleline(&mut prompt.path).hint_text(hint);
        let mut field = field.desired_width(f32::INFINITY).show(ui);
        if std::mem::take(&mut prompt.is_new) {
            field.response.request_focus();
            let end = CCursor::new(prompt.path.chars().count());
            let all = CCursorRange::two(CCursor::new(0), end);
            field.state.cursor.set_char_range(Some(all));
            field.state.store(ui.ctx(), field.response.id);
            ui.ctx().request_repaint();
        }
        let field = field.response;
        if field.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter)) {
            is_done = true;
            // Enter takes the keyboard away; without a path there is nothing to be done yet.
            field.request_focus();
        }
        prompt.refusal.take_if(|refusal| refusal.path != prompt.path.trim());
        if let Some(refusal) = &prompt.refusal {
            ui.label(RichText::new(&refusal.sentence).color(theme::ALERT));
        }
        ui.add_space(6.0);
        ui.horizontal(|ui| {
            let replaces = prompt.refusal.as_ref().is_some_and(|refusal| refusal.replaces);
            let accept = if replaces { "Replace" } else { accept };
            is_done |= ui.button(RichText::new(accept).color(theme::ACCENT)).clicked();
            is_closed |= ui.button("Cancel").clicked();
        });
    });
    let typed = prompt.path.trim();
    if is_done && !typed.is_empty() {
        let path = in_home(typed);
        let again = prompt.refusal.as_ref().is_some_and(|refusal| refusal.replaces);
        prompt.refusal = refusal(prompt.purpose, typed, Path::new(&path));
        if prompt.refusal.as_ref().is_none_or(|refusal| refusal.replaces && again) {
            commands.push(prompt.purpose.command(&path));
            is_closed = true;
        }
    }
    if is_closed || response.should_close() {
        interface.prompt = None;
    }
}

#[cfg(test)]
mod tests {
    use std::path::MAIN_SEPARATOR;

    use super::*;

    #[test]
    fn nothing_is_opened_that_is_not_there_and_nothing_replaced_unasked() {
        let folder = tempfile::tempdir().expect("a folder");
        let asked = |purpose, name: &str| {
            let path = folder.path().join(name);
            let refusal = refusal(purpose, path.to_str().expect("text"), &path)?;
            Some((refusal.sentence.trim_end_matches('.').to_owned(), refusal.replaces))
        };
        let because = |sentence: &str| Some((sentence.to_owned(), false));
        std::fs::write(folder.path().join("a.png"), "").expect("written");
        std::fs::write(folder.path().join("a.csv"), "").expect("written");
        for purpose in [Purpose::Scene, Purpose::Map, Purpose::Reference] {
            assert_eq!(asked(purpose, "a.png"), None);
            assert_eq!(asked(purpose, "b.png"), because("There is no such file"));
            assert_eq!(asked(purpose, ""), because("This is a folder"));
        }
        for (purpose, there, gone) in
            [(Purpose::Picture, "a.png", "b.png"), (Purpose::Distributions, "a.csv", "b.csv")]
        {
            assert!(asked(purpose, there).is_some_and(|(_, replaces)| replaces));
            assert_eq!(asked(purpose, gone), None);
        }
        let nowhere = format!("gone{MAIN_SEPARATOR}b.png");
        assert_eq!(asked(Purpose::Picture, &nowhere), because("There is no such folder"));
        assert_eq!(asked(Purpose::Picture, "b"), because("It must end in .png or .exr"));
        assert_eq!(refusal(Purpose::Scene, "office", Path::new("office")), None);
        let sky = "sky:day@64x32";
        assert_eq!(refusal(Purpose::Map, sky, Path::new(sky)), None);
    }

    #[test]
    fn a_tilde_is_the_users_folder() {
        let home = std::env::home_dir().expect("a folder").display().to_string();
        assert_eq!(in_home("~"), home);
        assert_eq!(in_home(&format!("~{MAIN_SEPARATOR}a")), format!("{home}{MAIN_SEPARATOR}a"));
        assert_eq!((in_home("~a").as_str(), in_home("b/~").as_str()), ("~a", "b/~"));
    }
}
