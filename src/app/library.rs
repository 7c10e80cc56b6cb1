//! What outlasts the window: settings, viewpoints, recent files, kept pictures.

use std::path::Path;

use super::document::{Document, Viewpoint};
use super::history::History;
use super::settings_file::{Settings, lasting_scene};
use super::small_maps::SmallMaps;

/// What this window and earlier ones have kept.
pub(super) struct Library {
    /// Recent files, viewpoints and folders as they are now.
    pub(super) settings: Settings,
    /// As they were when they were written last.
    pub(super) written: Settings,
    /// Kept pictures.
    pub(super) history: History,
    /// Small pictures of maps.
    pub(super) small_maps: SmallMaps,
    /// Whether viewpoints or files have come that are to be written at once: nobody knows whether there will be time for
    /// it at the end.
    pub(super) has_news: bool,
}

impl Library {
    /// Begins with what earlier windows have left.
    pub(super) fn new(settings: Settings, history: History, small_maps: SmallMaps) -> Self {
        Self { written: settings.clone(), settings, history, small_maps, has_news: false }
    }

    /// Notes a scene that was opened.
    pub(super) fn note_scene(&mut self, name: &str) {
        self.settings.recent_scene(name);
        self.has_news |= self.settings.recent_scenes != self.written.recent_scenes;
    }

    /// Notes a map that was opened.
    pub(super) fn note_map(&mut self, name: &str) {
        self.settings.recent_map(name);
        self.has_news |= self.settings.recent_maps != self.written.recent_maps;
    }

    /// Notes where a picture is written.
    pub(super) fn note_save(&mut self, path: &Path) {
        let path = std::path::absolute(path).ok();
        let folder = path.and_then(|path| path.parent().map(Path::to_path_buf));
        self.settings.save_folder = folder.or(self.settings.save_folder.take());
    }

    /// Where a picture of a scene is likely to be written.
    pub(super) fn suggested_file(&self, scene: &str) -> String {
        let stem = Path::new(scene).file_stem();
        let stem = stem.map_or_else(|| "picture".into(), |stem| stem.to_string_lossy());
        let folder = self.settings.save_folder.clone().unwrap_or_default();
        folder.join(format!("{stem}.png")).display().to_string()
    }

    /// The viewpoints that were kept of a scene by now; `document` is the one that is open.
    pub(super) fn viewpoints_of(&self, scene: &str, document: &Document) -> Vec<Viewpoint> {
        match lasting_scene(scene) == lasting_scene(&document.scene) {
            true => document.bookmarks.clone(),
            false => self.settings.viewpoints_of(scene),
        }
    }

    /// Keeps the present viewpoint.
    pub(super) fn bookmark(&mut self, document: &mut Document) {
        let Some(viewpoint) = &document.viewpoint else { return };
        let bookmarks = &mut document.bookmarks;
        let is_new = |name: &String| bookmarks.iter().all(|kept| kept.name != *name);
        let name = (1..).map(|number| format!("View {number}")).find(is_new).unwrap_or_default();
        bookmarks.push(Viewpoint { name, ..viewpoint.clone() });
        self.has_news = true;
    }

    /// Drops a kept viewpoint.
    pub(super) fn forget_bookmark(&mut self, document: &mut Document, index: usize) {
        if index < document.bookmarks.len() {
            document.bookmarks.remove(index);
            self.has_news = true;
        }
    }
}
