//! What controls change.

use crate::app::commands::Command;
use crate::app::document::Document;
use crate::app::interface::Interface;

/// What the controls of a panel change.
pub(in crate::app) struct Controls<'a> {
    /// The settings of the picture.
    pub(in crate::app) document: &'a mut Document,
    /// The state of the window.
    pub(in crate::app) interface: &'a mut Interface,
    /// What is to be carried out.
    pub(in crate::app) commands: &'a mut Vec<Command>,
}
