//! What is asked of a scene's file.

use std::path::PathBuf;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::lamp_edit::LampEdit;
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
    /// Units of point, spot and directional lights.
    pub lamps: Lamps,
    /// Leaves out all that is of the material of this name; may be given several times.
    pub hide: Vec<String>,
    /// Changes to all materials of a name, in order.
    pub edits: Vec<(String, MaterialEdit)>,
    /// Changes to all point, spot and directional lights of a name, in order.
    pub lamp_edits: Vec<(String, LampEdit)>,
    /// Files that will be written: a scene that names one of them as its own data is refused.
    #[serde(skip)]
    pub outputs: Vec<PathBuf>,
}

/// Units that point, spot and directional lights are taken in. Maps and emissive surfaces have none: a white wall
/// under a white map of radiance 1 is 1.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Lamps {
    /// [`Self::Watts`] where Blender has written lux and candela, otherwise [`Self::Physical`]; with a notice.
    #[default]
    Auto,
    /// Candela and lux, as the file has them.
    Physical,
    /// Watts per steradian and square metre, as Blender shows them: 683 lumens are one watt.
    Watts,
    /// Multiplied by a factor, not negative.
    Factor(f32),
}

impl Lamps {
    /// Lumens of a watt of light of 555 nm: what exporters multiply by, whatever the colour.
    pub(super) const LUMENS_PER_WATT: f32 = 683.0;
}

impl FromStr for Lamps {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let factor = |text: &str| text.parse().ok().filter(|it: &f32| *it >= 0.0 && it.is_finite());
        match text {
            "auto" => Ok(Self::Auto),
            "physical" => Ok(Self::Physical),
            "watts" => Ok(Self::Watts),
            text => factor(text).map(Self::Factor).ok_or_else(|| {
                "expected auto, physical, watts, or a factor that is not negative".to_owned()
            }),
        }
    }
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
