//! What is asked of a scene's file.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::material_edit::MaterialEdit;

/// What is asked of a scene's file.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SceneOptions {
    /// Reads files that the scene names outside of its folder, too.
    pub allow_outside: bool,
    /// The look of a model that has several, by its name.
    pub variant: Option<String>,
    /// What happens to outlines: enlarged copies of a model that face inwards and, here, would shut out
    /// all light.
    pub outlines: Outlines,
    /// Leaves out all that is of the material of this name; may be given several times.
    pub hide: Vec<String>,
    /// Changes to all materials of a name, in order.
    pub edits: Vec<(String, MaterialEdit)>,
    /// Files that will be written: a scene that names one of them as its own data is refused.
    #[serde(skip)]
    pub outputs: Vec<PathBuf>,
}

/// What happens to inverted hulls.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outlines {
    /// They are left out, and it is said.
    #[default]
    Remove,
    /// They are rendered like everything else.
    Keep,
}
