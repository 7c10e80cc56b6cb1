//! lightgrid: a progressive path tracer that learns which tiles of an HDR environment map each part
//! of the picture can see, and samples only those.
//!
//! The nouns and how they meet:
//!
//! - An [`image::Image`] holds linear radiance; an HDR map read into one becomes an
//!   [`environment::Environment`]: equal-size tiles, each with an importance table.
//! - A [`scene::Scene`] is flat arrays (from a glTF file or built in); a [`bvh::Bvh`] finds what a
//!   ray hits in it; a [`bsdf::Bsdf`] says how light is scattered there.
//!   Between surfaces there may be a [`medium`].
//! - The [`light_grid`] maps a point to a cell (seen from the camera) and a cell to a distribution
//!   over the map's tiles, learned by tracing paths.
//! - [`path`] is the one loop that turns random numbers into radiance; [`render`] runs it over the
//!   picture, pass by pass, into a film.
//! - [`app`] is the window, [`cli`] what a person types; both find files by [`sources`], and write by
//!   [`output`]. [`report`] measures error against time; [`metrics`] compares pictures, [`denoise`]
//!   smooths them, [`tone`] develops them, and `develop` does so on a GPU. [`stability`] tries all of it
//!   on stiff and extreme cases, [`mod@bench`] measures a machine.
//!
//! Each uses those beneath it alone; CONTRIBUTING.md draws the house.
//!
//! Without the default features it renders on the CPU: `gpu` adds GPUs, `window` the window and with it
//! GPUs, `report` what measures, `flip` a metric, `meshopt` a compression of glTF files.

#![cfg_attr(
    not(all(feature = "window", feature = "report")),
    allow(
        dead_code,
        unused_imports,
        reason = "what only a part that is left out would use is not worth a `cfg`"
    )
)]

/// Declares a struct with the default of each field.
macro_rules! with_defaults {
    (
        $(#[$attribute:meta])*
        $visibility:vis struct $name:ident {
            $($(#[$of_field:meta])* $visibility_of_field:vis $field:ident: $type:ty = $default:expr,)+
        }
    ) => {
        $(#[$attribute])*
        $visibility struct $name {
            $($(#[$of_field])* $visibility_of_field $field: $type),+
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default),+ }
            }
        }
    };
}

mod alarm;
#[cfg(feature = "window")]
pub mod app;
#[cfg(feature = "report")]
pub mod bench;
pub mod bsdf;
pub mod bvh;
pub mod cli;
pub mod color;
pub mod denoise;
#[cfg(feature = "window")]
mod develop;
mod digest;
pub mod environment;
pub mod error;
mod huge_pages;
pub mod image;
pub mod light_grid;
pub mod math;
pub mod medium;
mod memory;
pub mod metrics;
pub mod noise;
mod out_of_memory;
pub mod output;
pub mod path;
mod prefetch;
pub mod radiance_cache;
pub mod render;
#[cfg(feature = "report")]
pub mod report;
pub mod sampler;
pub mod scene;
pub mod sources;
#[cfg(feature = "report")]
pub mod stability;
mod system;
mod terminal;
pub mod tone;
