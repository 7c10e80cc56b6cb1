//! A world-space cache of reflected radiance, learned from whole paths.
//!
//! Surfaces are divided into cubic cells by position and dominant axis of the normal, hashed into a table of
//! fixed size (Binder, Fricke, Keller, *Massively Parallel Path Space Filtering*, 2019). Cells grow with
//! the distance from the camera, so that their number is bounded. Each holds the mean reflected radiance of
//! paths over the mean albedo; readers multiply by the albedo of their point, which restores textures. Cells
//! with few paths are blended with a parent cell four times as large.
//!
//! Sums are integers: they do not depend on the order of the paths. A [`RadianceCache`] is read while training
//! continues in [`RadianceSums`].

mod cells;
mod facts;
mod look_up;
mod sums;

pub use cells::CacheCells;
pub(crate) use cells::{CHECK_SEED, MAX_PROBES, PARENT, SLOTS};
pub use facts::{CacheFacts, KnownCell};
pub use look_up::RadianceCache;
pub use sums::RadianceSums;
pub(crate) use sums::{ALBEDO_ONE, MAX_PATHS, WORDS};
