//! What the viewport is drawn from.

use std::sync::Arc;

use crate::app::commands::Command;
use crate::app::document::Document;
use crate::app::interface::Interface;
use crate::app::loader::LoadedScene;
use crate::app::presenter::Shown;
use crate::app::screen::{Developed, Screen};
use crate::app::speed_up::SpeedUp;
use crate::app::worker::Snapshot;
use crate::develop::DevelopSettings;
use crate::scene::Camera;

/// Developed pictures.
#[derive(Default)]
pub(in crate::app) struct Textures {
    /// The last whole picture.
    pub(super) main: Option<Developed>,
    /// What it is of, unless it is a kept one: the geometry, and from where.
    pub(super) main_of: Option<(Arc<()>, Camera)>,
    /// A part of it that is rendered alone.
    pub(super) part: Option<Developed>,
    pub(super) other: Option<Developed>,
}

impl Textures {
    /// The picture that is shown, if one was drawn as yet.
    pub(in crate::app) fn picture(&self, shown: Option<&Shown>) -> Option<&Developed> {
        let is_part = shown?.order.snapshot.request.view.crop.is_some();
        if is_part { self.part.as_ref() } else { self.main.as_ref() }
    }
}

/// What the viewport is drawn from.
pub(in crate::app) struct Scope<'a> {
    pub(in crate::app) document: &'a mut Document,
    pub(in crate::app) interface: &'a mut Interface,
    pub(in crate::app) textures: &'a mut Textures,
    pub(in crate::app) screen: &'a Screen,
    pub(in crate::app) shown: Option<&'a Shown>,
    /// How what is shown is developed.
    pub(in crate::app) settings: Option<DevelopSettings>,
    pub(in crate::app) snapshot: Option<&'a Snapshot>,
    pub(in crate::app) speed_up: Option<SpeedUp>,
    pub(in crate::app) scene: Option<&'a LoadedScene>,
    pub(in crate::app) loading: bool,
    pub(in crate::app) commands: &'a mut Vec<Command>,
}
