//! What panels are drawn from, and what they change.

use crate::app::assets::Assets;
use crate::app::commands::Command;
use crate::app::display::Display;
use crate::app::document::Document;
use crate::app::interface::Interface;
use crate::app::library::Library;
use crate::app::loader::LoadedScene;
use crate::app::render_queue::RenderQueue;
use crate::app::rendering::Rendering;

/// The parts of the application that panels draw and change.
pub(in crate::app) struct Scope<'a> {
    /// The settings of the picture.
    pub(in crate::app) document: &'a mut Document,
    /// The state of the window.
    pub(in crate::app) interface: &'a mut Interface,
    /// Recent files and kept pictures.
    pub(in crate::app) library: &'a mut Library,
    /// The scene and the map that are loaded.
    pub(in crate::app) assets: &'a Assets,
    /// The worker and its latest picture.
    pub(in crate::app) rendering: &'a mut Rendering,
    /// What is on the screen.
    pub(in crate::app) display: &'a mut Display,
    /// What is rendered into files.
    pub(in crate::app) renders: &'a RenderQueue,
    /// Figures that depend on the clock are left out, and those of what is pointed at.
    pub(in crate::app) is_repeatable: bool,
    /// What is to be carried out.
    pub(in crate::app) commands: &'a mut Vec<Command>,
}

impl<'a> Scope<'a> {
    /// The scene that is shown; while another one is read, nothing is to be chosen in it.
    pub(super) fn scene(&self) -> Option<&'a LoadedScene> {
        self.assets.scene_of(self.document)
    }
}
