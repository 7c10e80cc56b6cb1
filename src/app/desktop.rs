//! What the desktop is asked for: its file dialogue, and its browser.

use std::path::{Path, PathBuf};
use std::pin::Pin;
use std::sync::Arc;

use rfd::{AsyncFileDialog, FileHandle};
use winit::window::Window;

use super::commands::Command;
use super::completion::in_home;
use super::interface::{Prompt, Purpose};
use super::{App, Later};

/// Where the method was published.
pub(super) const METHOD: &str = "https://dl.acm.org/doi/10.1145/3214745.3214808";

/// The file dialogues of the desktop.
#[derive(Default)]
pub(super) struct Desktop {
    /// What a dialogue lies before.
    window: Option<Arc<Window>>,
    open: Option<Dialogue>,
    /// So many were opened.
    opened: u32,
    /// Whether it was found to have none.
    has_none: bool,
}

/// A dialogue that was asked for.
#[derive(Clone)]
struct Dialogue {
    number: u32,
    purpose: Purpose,
    /// The path that was in the prompt.
    path: String,
    /// Whether somebody asked for it by its own button.
    is_by_hand: bool,
    /// Whether our window was left for it, or for anything else: without that it was never there.
    is_seen: bool,
}

/// What becomes of a prompt whose dialogue has ended.
#[derive(Debug, PartialEq)]
enum End {
    /// The prompt stays as it is.
    Stays,
    /// It stays, and there is something to say.
    Says(&'static str),
    /// Nothing was typed in it: it goes.
    Goes,
}

impl Desktop {
    /// The dialogue of this number, unless the prompt that it belongs to has gone by another way.
    fn take(&mut self, number: u32, prompt: Option<&Prompt>) -> Option<Dialogue> {
        let dialogue = self.open.take_if(|dialogue| dialogue.number == number)?;
        prompt.is_some_and(|prompt| prompt.purpose == dialogue.purpose).then_some(dialogue)
    }

    /// A dialogue has ended without a file.
    fn end(&mut self, dialogue: &Dialogue, prompt: &Prompt) -> End {
        self.has_none = !dialogue.is_seen;
        match (dialogue.is_seen, dialogue.is_by_hand) {
            (true, false) if prompt.path == dialogue.path => End::Goes,
            (false, true) => {
                End::Says("this system offers no file dialogue; a path can be typed instead")
            }
            _ => End::Stays,
        }
    }
}

impl App {
    /// Says in which window of the desktop all is drawn: dialogues lie before it.
    pub(super) fn lie_in(&mut self, window: Arc<Window>) {
        self.desktop.window = Some(window);
    }

    /// Says that the window has lost the keyboard.
    pub(super) fn lose_focus(&mut self) {
        self.desktop.open.iter_mut().for_each(|dialogue| dialogue.is_seen = true);
    }

    /// Asks for a path: by a prompt, and by the system's dialogue before it where there is one.
    pub(super) fn ask(&mut self, purpose: Purpose, path: String) {
        self.interface.ask(purpose, path);
        // It belongs to another prompt.
        self.desktop.open = None;
        if self.settings.browses_at_once && !self.desktop.has_none && !self.is_repeatable {
            self.browse(purpose, false);
        }
    }

    /// Opens the system's file dialogue for the prompt; its answer comes later.
    pub(super) fn browse(&mut self, purpose: Purpose, is_by_hand: bool) {
        if let Some(dialogue) = &mut self.desktop.open {
            dialogue.is_by_hand |= is_by_hand;
            self.messages.notice("The system's file dialogue has been asked for already");
            return;
        }
        let path = self.interface.prompt.as_ref().map(|prompt| prompt.path.clone());
        let path = path.unwrap_or_default();
        let dialogue = self.dialogue(purpose, &path);
        let chosen: Pin<Box<dyn Future<Output = Option<FileHandle>> + Send>> =
            match purpose.is_output() {
                true => Box::pin(dialogue.save_file()),
                false => Box::pin(dialogue.pick_file()),
            };
        self.desktop.opened += 1;
        let number = self.desktop.opened;
        let window = self.desktop.window.clone();
        let thread = self.do_later("dialogue", move || {
            let file = pollster::block_on(chosen);
            // It was needed to the end.
            drop(window);
            Ok(Later::Chosen(number, file.map(|file| file.path().display().to_string())))
        });
        self.desktop.open =
            thread.map(|_| Dialogue { number, purpose, path, is_by_hand, is_seen: false });
    }

    /// A dialogue that begins where a path leads to.
    fn dialogue(&self, purpose: Purpose, path: &str) -> AsyncFileDialog {
        let (kind, extensions) = purpose.files();
        let mut dialogue =
            AsyncFileDialog::new().set_title(purpose.title()).add_filter(kind, extensions);
        if let Some(window) = &self.desktop.window {
            dialogue = dialogue.set_parent(&**window);
        }
        // What was opened last lies beside what is opened next.
        let recent = match purpose {
            Purpose::Map => &self.settings.recent_maps,
            _ => &self.settings.recent_scenes,
        };
        let beside = recent.first().and_then(|name| Path::new(name).parent());
        let path = in_home(path.trim());
        let path = match beside.filter(|_| path.is_empty()) {
            Some(folder) => folder.to_owned(),
            None => PathBuf::from(path),
        };
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

    /// Takes the answer of a dialogue.
    pub(super) fn take_chosen(&mut self, number: u32, path: Option<&str>, context: &egui::Context) {
        let prompt = self.interface.prompt.as_ref();
        let dialogue = self.desktop.take(number, prompt);
        let Some((dialogue, prompt)) = dialogue.zip(prompt) else { return };
        let Some(path) = path else {
            match self.desktop.end(&dialogue, prompt) {
                End::Goes => self.interface.prompt = None,
                End::Stays => {}
                End::Says(sentence) => self.messages.error(sentence),
            }
            return;
        };
        self.interface.prompt = None;
        match dialogue.purpose.completed(path) {
            // Nobody was asked whether a file of that name may be replaced.
            Some(path) => self.interface.ask(dialogue.purpose, path),
            None => self.execute(dialogue.purpose.command(path), context),
        }
    }

    /// Opens the method's publication in the browser.
    pub(super) fn show_method(&mut self) {
        if let Err(error) = open::that_detached(METHOD) {
            self.messages.error(format!("no browser can be opened for {METHOD}: {error}"));
        }
    }
}

impl Purpose {
    /// A path that was chosen with what its file's name ends in, where that is missing: not every dialogue adds it.
    pub(super) fn completed(self, path: &str) -> Option<String> {
        let (_, extensions) = self.files();
        let is_missing = self.is_output() && Path::new(path).extension().is_none();
        is_missing.then(|| format!("{path}.{}", extensions[0]))
    }

    /// What to do with the path.
    pub fn command(self, path: &str) -> Command {
        match self {
            Self::Scene => Command::OpenScene(path.to_owned()),
            Self::Map => Command::OpenMap(path.to_owned()),
            Self::Picture => Command::Save(path.into()),
            Self::Distributions => Command::Export(path.into()),
            Self::Reference => Command::OpenReference(path.to_owned()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::interface::Interface;

    #[test]
    fn a_dialogue_that_never_came_is_told_from_one_that_was_closed() {
        let mut interface = Interface::default();
        interface.ask(Purpose::Map, String::new());
        let mut prompt = interface.prompt.expect("asked");
        let dialogue = |is_by_hand, is_seen| {
            let path = String::new();
            Dialogue { number: 1, purpose: Purpose::Map, path, is_by_hand, is_seen }
        };
        let ended = |is_by_hand, is_seen, prompt: &Prompt| {
            let mut desktop = Desktop::default();
            let end = desktop.end(&dialogue(is_by_hand, is_seen), prompt);
            (end, desktop.has_none)
        };
        assert_eq!(ended(false, false, &prompt), (End::Stays, true), "none, and nobody asked");
        assert!(matches!(ended(true, false, &prompt), (End::Says(_), true)), "somebody asked");
        assert_eq!(ended(false, true, &prompt), (End::Goes, false), "closed");
        assert_eq!(ended(true, true, &prompt), (End::Stays, false), "the prompt was there before");
        // Its answer is none to another question.
        let mut desktop = Desktop { open: Some(dialogue(false, true)), ..Desktop::default() };
        assert!(desktop.take(2, Some(&prompt)).is_none() && desktop.open.is_some());
        assert!(desktop.take(1, None).is_none(), "a path was typed");
        prompt.path = "/a/map".to_owned();
        assert_eq!(ended(false, true, &prompt), (End::Stays, false), "something was typed");
        let mut desktop = Desktop { open: Some(dialogue(false, true)), ..Desktop::default() };
        assert!(desktop.take(1, Some(&prompt)).is_some());
    }
}
