//! The scene: flat arrays and `u32` indices, everything in world space (metres, +Y up), but for meshes
//! that instances share.

mod backs;
pub mod builtin;
mod camera;
pub mod camera_path;
mod contents;
mod copies;
mod flush;
mod frame;
pub mod gltf;
mod instances;
mod lamp_edit;
mod light;
mod lists;
mod material;
mod material_edit;
mod medium;
pub mod needs;
mod options;
mod outlines;
mod placing;
pub mod surface;
pub mod texture;

pub use camera::{Camera, CameraPlace, Projection, StartView};
pub use contents::Scene;
pub use frame::Frame;
pub(crate) use frame::in_digits;
pub use instances::{Instance, Instances, MAX_SHOWN};
pub use lamp_edit::{LampEdit, LampEdits, NamedLamp, edit_of_lamp, named_lamps};
pub use light::{PunctualKind, PunctualLight};
pub(crate) use material::MAX_POLISH_ROUGHNESS;
pub use material::{AlphaMode, Material, Texture, TextureImage, TextureRef, TextureSlot, Wrap};
pub use material_edit::MaterialEdit;
#[cfg(feature = "window")]
pub(crate) use material_edit::{color_of_hex, hex_of_color};
pub use medium::Medium;
pub use options::{Lamps, Outlines, SceneOptions};
pub use placing::Placing;
