//! What the command line calls the choices that there are, with a line of help for each.

use std::path::PathBuf;

use clap::ValueEnum;
use clap::builder::PossibleValue;

#[cfg(feature = "window")]
use crate::app::{interface::TileView, overlays::Overlay};
use crate::environment::TableKind;
use crate::output::{LayerName, LinearRgb};
use crate::render::filter::PixelFilter;
use crate::render::gpu::{DeviceChoice, RayChoice, Schedule};
use crate::render::{Gi, Sampling, Sharing};
#[cfg(feature = "report")]
use crate::report::Device;
use crate::scene::{LampEdit, LampEdits, Lamps, MaterialEdit, Outlines, SceneOptions};
use crate::tone::ToneCurve;

/// What is asked of a scene's file.
#[derive(Debug, Clone, Default, PartialEq, clap::Args)]
pub(super) struct SceneArguments {
    /// Reads files that the scene names outside of its folder, too.
    #[arg(long, help_heading = "Scene")]
    allow_outside: bool,
    /// The look of a model that has several, by its name.
    #[arg(long, value_name = "NAME", help_heading = "Scene")]
    variant: Option<String>,
    /// What happens to outlines: enlarged copies of a model that face inwards and, here, would shut out
    /// all light.
    #[arg(long, default_value = "remove", value_name = "WHAT", help_heading = "Scene")]
    outlines: Outlines,
    /// Units of the file's point, spot and directional lights: physical (candela, lux), watts (683 times
    /// weaker, as Blender shows them), or a factor. auto takes Blender's lux for watts.
    #[arg(long, default_value = "auto", value_parser = str::parse::<Lamps>, value_name = "UNITS", help_heading = "Scene")]
    lamps: Lamps,
    /// Leaves out all that is of the material of this name; may be given several times.
    #[arg(long, value_name = "NAME", help_heading = "Scene")]
    hide: Vec<String>,
    /// Changes all materials of a name or, if none has it, the one of this number, counted from 0: color=#rrggbb,
    /// roughness, metalness or opacity=0..1, emission=RADIANCE (each multiplies its texture), emission-color=#rrggbb,
    /// or hidden; may be given several times.
    #[arg(long = "material", value_name = "NAME:CHANGES", value_parser = MaterialEdit::parse, help_heading = "Scene")]
    edits: Vec<(String, MaterialEdit)>,
    /// Changes all lights and all materials that emit of a name: factor=NUMBER, color=#rrggbb, or off; may be given
    /// several times.
    #[arg(long = "lamp", value_name = "NAME:CHANGES", value_parser = LampEdit::parse, help_heading = "Scene")]
    lamp_edits: Vec<(String, LampEdit)>,
}

impl SceneArguments {
    /// Changes to materials, as they were typed.
    pub(super) fn edits(&self) -> Vec<String> {
        self.edits.iter().map(|(name, edit)| edit.to_text(name)).collect()
    }

    /// Changes to lamps, as they were typed.
    pub(super) fn lamp_edits(&self) -> Vec<String> {
        self.lamp_edits.iter().map(|(name, edit)| edit.to_text(name)).collect()
    }

    /// What a window asks of the file, and changes to lamps, which it can change further.
    #[cfg(feature = "window")]
    pub(super) fn of_window(&self, outputs: Vec<PathBuf>) -> (SceneOptions, LampEdits) {
        let mut options = self.options_beside(outputs);
        let mut by_name = LampEdits::new();
        for (name, edit) in options.lamp_edits.drain(..) {
            let known = by_name.entry(name).or_default();
            *known = known.then(&edit);
        }
        (options, by_name)
    }

    pub(super) fn options(&self) -> SceneOptions {
        self.options_beside(Vec::new())
    }

    /// The same where these files will be written.
    pub(super) fn options_beside(&self, outputs: Vec<PathBuf>) -> SceneOptions {
        let Self { allow_outside, variant, outlines, lamps, hide, edits, lamp_edits } =
            self.clone();
        SceneOptions { allow_outside, variant, outlines, lamps, hide, edits, lamp_edits, outputs }
    }
}

macro_rules! choices {
    ($($type:ty { $($variant:ident = $name:literal: $help:literal)+ })+) => {
        $(impl ValueEnum for $type {
            fn value_variants<'a>() -> &'a [Self] {
                &[$(Self::$variant),+]
            }

            fn to_possible_value(&self) -> Option<PossibleValue> {
                Some(match self {
                    $(Self::$variant => PossibleValue::new($name).help($help)),+
                })
            }
        })+
    };
}

choices! {
    Outlines {
        Remove = "remove": "They are left out, and it is said"
        Keep = "keep": "They are rendered like everything else"
    }
    PixelFilter {
        Box = "box": "One pixel wide, constant: what metrics expect"
        Gauss = "gauss": "Gaussian of standard deviation 0.45 pixels, cut at 1.5"
        BlackmanHarris = "blackman-harris": "Blackman-Harris window 3 pixels wide, Cycles' default shape"
    }
    Sampling {
        Adaptive = "adaptive": "Learned tiles, our way: faces, cosine, pooling; with BSDF sampling"
        Talk = "talk": "Learned tiles as the talk describes them; with BSDF sampling"
        Plain = "plain": "The whole map; with BSDF sampling"
        Bsdf = "bsdf": "BSDF sampling alone"
    }
    Gi {
        Exact = "exact": "Paths are followed to their end: no error but noise"
        Cached = "cached": "Paths end where a radiance cache knows what they would find: less noise, and a few percent of error that stays"
    }
    Sharing {
        Auto = "auto": "As it suits the scene, the way the map is sampled and the size of the picture"
        Off = "off": "Each path is one pixel's"
        Small = "4x4": "In tiles of 4x4 pixels, all of which keep their own: less of the noise is shared"
        Large = "8x8": "In tiles of 8x8 pixels, of which every fourth keeps its own"
    }
    TableKind {
        TileLocal = "tile-local": "Exact integer sums tile by tile"
        U32 = "u32": "The talk's: a summed-area table in f64, rounded to u32"
        F32 = "f32": "A summed-area table computed in f32"
        F64 = "f64": "A summed-area table in f64"
    }
    ToneCurve {
        Agx = "agx": "Troy Sobotka's AgX"
        Aces = "aces": "The ACES transforms in Stephen Hill's fit"
        Neutral = "neutral": "Khronos PBR Neutral: keeps base colours below 0.8 as they are"
        Reinhard = "reinhard": "L / (1 + L) of the luminance"
        None = "none": "Clipped at 1"
    }
    DeviceChoice {
        Auto = "auto": "A real GPU if there is one and everything fits on it, else the CPU"
        Gpu = "gpu": "A GPU, be it a software one, or an error"
        Cpu = "cpu": "The CPU"
    }
    RayChoice {
        Auto = "auto": "A real GPU's own ray queries where it has them, else our kernels"
        Hardware = "hardware": "The GPU's ray queries, or an error. They are not watertight to the last bit: a ray along an edge may hit another triangle or, seldom, none"
        Software = "software": "Our kernels"
    }
    Schedule {
        Whole = "whole": "One does all"
        Queue = "queue": "Three take turns"
    }
    LayerName {
        Albedo = "albedo": "Mean albedo of the first surface"
        Normal = "normal": "World normal of the first surface"
        Depth = "depth": "Metres to the first surface"
        Samples = "samples": "Samples per pixel"
        Variance = "variance": "Variance of one sample's luminance"
        All = "all": "All of these"
        Denoised = "denoised": "Linear radiance without noise"
    }
    LinearRgb {
        Rendered = "rendered": "What was rendered"
        Denoised = "denoised": "Linear radiance without noise; what was rendered is a layer"
    }
}

#[cfg(feature = "report")]
choices! {
    Device {
        Cpu = "cpu": "All threads"
        Gpu = "gpu": "The best adapter, be it a software one"
    }
}

#[cfg(feature = "window")]
choices! {
    TileView {
        Energy = "energy": "Share of the map's energy"
        Learned = "learned": "Share of what all cells together have learned to sample"
    }
}

#[cfg(feature = "window")]
impl ValueEnum for Overlay {
    fn value_variants<'a>() -> &'a [Self] {
        &Self::ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(self.name()).help(self.description()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Files and reports have names of their own, which are read back.
    #[test]
    fn names_read_back() {
        for kind in TableKind::ALL {
            assert_eq!(TableKind::from_str(&kind.to_string(), false), Ok(kind));
        }
        for curve in ToneCurve::ALL {
            assert_eq!(ToneCurve::from_str(&curve.to_string(), false), Ok(curve));
        }
    }
}
