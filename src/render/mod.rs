//! Rendering: what is wanted ([`View`]), who does it ([`Session`]), what comes of it ([`film::Film`]).

pub(crate) mod block_errors;
pub(crate) mod cached_picture;
mod cpu;
mod devices;
mod driver;
pub mod film;
pub mod filter;
mod gaps;
mod gi;
#[cfg_attr(not(feature = "gpu"), path = "no_gpu.rs")]
pub mod gpu;
mod gpu_facts;
#[cfg(feature = "window")]
pub(crate) mod keyframe;
pub(crate) mod light_groups;
#[cfg(feature = "window")]
pub(crate) mod light_parts;
mod pass;
mod progress;
mod session;
mod sharing;
pub mod sun_placement;
pub mod surface_map;
mod view;
mod view_probe;

pub(crate) use driver::Awaited;
pub use driver::Driver;
#[cfg(feature = "window")]
pub(crate) use driver::next_beginning;
pub(crate) use gi::CacheTraining;
use pass::{Advance, Pass};
pub use progress::{Figures, Phase, StopRule};
#[cfg(feature = "window")]
pub(crate) use session::SessionState;
pub use session::{Doubling, Session};
pub use view::{Crop, Gi, Sampling, Sharing, View};
pub(crate) use view_probe::cut_off_notice;

/// Version of what samples are made of: raised when a picture of the same options and seed is another than before.
/// Parts and checkpoints of other versions are refused.
pub const SAMPLES_VERSION: u32 = 6;
