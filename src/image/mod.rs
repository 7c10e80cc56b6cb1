//! Linear f32 pictures, and the files they come from and go to.
//!
//! [`read_map`] reads environment maps (repaired where needed), [`read_picture`] pictures to be
//! compared (untouched); [`write_exr`] and [`write_png`] write. Only this module knows the file
//! formats and the crates that decode them.

mod exr_channels;
mod exr_patch;
mod exr_read;
mod exr_write;
mod file;
mod guard;
mod hdr;
mod ktx2;
mod map;
mod picture;
mod png;
mod primaries;
mod texels;
mod tiff;

pub use exr_read::{read_exr_metadata, read_exr_preview};
pub(crate) use exr_write::exr_encoder_bytes;
pub use exr_write::{ExrPicture, Layer, write_exr};
pub use file::{check_writable, is_same_file, write_beside_and_rename};
pub(crate) use file::{
    extension, make_folder, name_of_process, names_device_or_stream, open_file, read_cause,
    read_file, remove_unfinished,
};
pub(crate) use guard::catch_panic;
pub(crate) use map::{IS_A_FILM, is_film, looks_like_film, looks_like_picture, looks_like_scene};
pub use map::{LoadedMap, read_map, read_picture, read_with_linearity, sanitise};
pub use picture::{Image, Rgb8};
use picture::{MAX_PIXELS, MAX_SIDE, check_size};
pub use png::{encode_png, write_png};
pub use texels::Texels;

pub mod ldr;
