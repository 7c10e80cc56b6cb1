//! What the viewport is drawn from.

use crate::app::commands::Command;
use crate::app::display::Display;
use crate::app::document::Document;
use crate::app::interface::Interface;
use crate::app::loader::LoadedScene;
use crate::app::rendering::Rendering;

/// What the viewport is drawn from.
pub(in crate::app) struct Scope<'a> {
    pub(in crate::app) document: &'a mut Document,
    pub(in crate::app) interface: &'a mut Interface,
    pub(in crate::app) display: &'a mut Display,
    pub(in crate::app) rendering: &'a Rendering,
    pub(in crate::app) scene: Option<&'a LoadedScene>,
    pub(in crate::app) loading: bool,
    pub(in crate::app) commands: &'a mut Vec<Command>,
}
