//! What the desktop is asked for: its file dialogue, and its browser.

use std::path::Path;
use std::pin::Pin;
use std::sync::Arc;

use rfd::{AsyncFileDialog, FileHandle};
use winit::window::Window;

use super::commands::Command;
use super::dropped::is_map;
use super::interface::{Interface, Purpose};
use super::settings_file::Settings;
use super::tasks::{TaskResult, Tasks};
use crate::error::Decoded;
use crate::sources;

/// Where the method was published.
pub(super) const METHOD: &str = "https://dl.acm.org/doi/10.1145/3214745.3214808";

/// The file dialogues of the desktop.
#[derive(Default)]
pub(super) struct Desktop {
    /// The window that dialogues lie before.
    pub(super) window: Option<Arc<Window>>,
    open: Option<Dialogue>,
    /// So many were opened.
    opened: u32,
    /// Whether it was found to have none.
    has_none: bool,
}

/// A dialogue that was asked for.
struct Dialogue {
    number: u32,
    purpose: Purpose,
    /// The path that was in the prompt.
    path: String,
    /// Whether our window was left for it, or for anything else: without that it was never there.
    is_seen: bool,
}

impl Desktop {
    /// Says that the window has lost the keyboard.
    pub(super) fn lose_focus(&mut self) {
        self.open.iter_mut().for_each(|dialogue| dialogue.is_seen = true);
    }

    /// Opens the system's file dialogue before a prompt, where there is one; its answer comes later.
    pub(super) fn ask(&mut self, purpose: Purpose, path: &str, settings: &Settings, tasks: &Tasks) {
        // It belongs to another prompt.
        self.open = None;
        if self.has_none {
            return;
        }
        let dialogue = self.dialogue(purpose, path, settings);
        let chosen: Pin<Box<dyn Future<Output = Option<FileHandle>> + Send>> =
            match purpose.is_output() {
                true => Box::pin(dialogue.save_file()),
                false => Box::pin(dialogue.pick_file()),
            };
        self.opened += 1;
        let (number, window) = (self.opened, self.window.clone());
        let thread = tasks.run("dialogue", move || {
            let file = pollster::block_on(chosen);
            // It was needed to the end.
            drop(window);
            Ok(TaskResult::Chosen(number, file.map(|file| file.path().display().to_string())))
        });
        let path = path.to_owned();
        self.open = thread.map(|_| Dialogue { number, purpose, path, is_seen: false });
    }

    /// A dialogue that begins where a path leads to.
    fn dialogue(&self, purpose: Purpose, path: &str, settings: &Settings) -> AsyncFileDialog {
        let (title, kind, extensions) = purpose.words();
        let mut dialogue = AsyncFileDialog::new().set_title(title).add_filter(kind, extensions);
        if let Some(window) = &self.window {
            dialogue = dialogue.set_parent(&**window);
        }
        // What was opened last lies beside what is opened next.
        let Settings { recent_maps, recent_scenes, .. } = settings;
        let recent = if purpose == Purpose::Map { recent_maps } else { recent_scenes };
        let beside = recent.first().and_then(|name| Path::new(name).parent());
        let path = beside.filter(|_| path.is_empty()).unwrap_or(Path::new(path));
        let Ok(path) = std::path::absolute(path) else { return dialogue };
        let folder = if path.is_dir() { Some(&*path) } else { path.parent() };
        if let Some(folder) = folder.filter(|folder| folder.is_dir()) {
            dialogue = dialogue.set_directory(folder);
        }
        let file = path.file_name().filter(|_| purpose.is_output() && !path.is_dir());
        if let Some(file) = file {
            dialogue = dialogue.set_file_name(file.to_string_lossy());
        }
        dialogue
    }

    /// Takes the answer of the dialogue of this number, unless its prompt has gone; the command that follows.
    pub(super) fn answer(
        &mut self,
        number: u32,
        path: Option<&str>,
        interface: &mut Interface,
    ) -> Option<Command> {
        let Dialogue { purpose, path: before, is_seen, .. } =
            self.open.take_if(|dialogue| dialogue.number == number)?;
        interface.prompt.as_ref().filter(|prompt| prompt.purpose == purpose)?;
        let Some(path) = path else {
            self.has_none = !is_seen;
            // What was typed meanwhile stays.
            interface.prompt.take_if(|prompt| is_seen && prompt.path == before);
            return None;
        };
        interface.prompt = None;
        if let Some(path) = purpose.completed(path) {
            // Nobody was asked whether a file of that name may be replaced.
            interface.ask(purpose, path);
            return None;
        }
        Some(purpose.command(path))
    }
}

/// Opens the method's publication in the browser.
///
/// # Errors
/// If no browser can be opened.
pub(super) fn show_method() -> Decoded<()> {
    open::that_detached(METHOD)
        .map_err(|error| format!("no browser can be opened for {METHOD}: {error}"))
}

impl Purpose {
    /// A path that was chosen with what its file's name ends in, where that is missing: not every dialogue adds it.
    fn completed(self, path: &str) -> Option<String> {
        let (_, _, extensions) = self.words();
        let is_missing = self.is_output() && Path::new(path).extension().is_none();
        is_missing.then(|| format!("{path}.{}", extensions[0]))
    }

    /// What to do with the path.
    pub fn command(self, path: &str) -> Command {
        match self {
            // What the file is counts, not by which line it was chosen.
            Self::Scene if is_map(path) => Command::OpenMap(path.to_owned()),
            Self::Map if sources::is_scene(path) => Command::OpenScene(path.to_owned()),
            Self::Scene => Command::OpenScene(path.to_owned()),
            Self::Map => Command::OpenMap(path.to_owned()),
            Self::Look => Command::OpenLook(path.to_owned()),
            Self::Picture => Command::Save(path.into()),
            Self::Render | Self::RenderFrames => Command::Render(path.into()),
            Self::Distributions => Command::Export(path.into()),
            Self::Reference => Command::OpenReference(path.to_owned()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_is_opened_as_one_by_either_dialogue_and_so_is_a_scene() {
        for purpose in [Purpose::Scene, Purpose::Map] {
            assert_eq!(purpose.command("/a/sky.HDR"), Command::OpenMap("/a/sky.HDR".to_owned()));
            assert_eq!(purpose.command("a.glb"), Command::OpenScene("a.glb".to_owned()));
        }
        // Any picture may light a scene.
        assert_eq!(Purpose::Map.command("a.jpg"), Command::OpenMap("a.jpg".to_owned()));
    }

    #[test]
    fn a_dialogue_that_never_came_is_told_from_one_that_was_closed() {
        let answer = |is_seen, number, typed: &str, chosen: Option<&str>| {
            let (purpose, path) = (Purpose::Picture, String::new());
            let open = Some(Dialogue { number: 1, purpose, path, is_seen });
            let mut desktop = Desktop { open, ..Desktop::default() };
            let mut interface = Interface::default();
            interface.ask(purpose, typed.to_owned());
            let command = desktop.answer(number, chosen, &mut interface);
            (command, interface.prompt.map(|prompt| prompt.path), desktop.has_none)
        };
        let prompt = |path: &str| Some(path.to_owned());
        assert_eq!(answer(false, 1, "", None), (None, prompt(""), true), "there is none");
        assert_eq!(answer(true, 1, "", None), (None, None, false), "it was closed");
        assert_eq!(answer(true, 1, "/a", None), (None, prompt("/a"), false), "and a path typed");
        assert_eq!(answer(true, 2, "", Some("a.png")), (None, prompt(""), false), "of another");
        let saved = Command::Save("a.png".into());
        assert_eq!(answer(true, 1, "", Some("a.png")), (Some(saved), None, false));
        assert_eq!(answer(true, 1, "", Some("a")), (None, prompt("a.png"), false), "is it there?");
        // The prompt has gone by a path that was typed.
        let mut desktop = Desktop::default();
        assert_eq!(desktop.answer(1, Some("a.png"), &mut Interface::default()), None);
    }
}
