//! The Light Grid: which tiles of the environment map each part of the picture can see.
//!
//! Atanasov et al., *Adaptive Environment Sampling on CPU and GPU*, ACM SIGGRAPH 2018 Talks. A
//! [`cells::SphericalGrid`] around the camera maps a point to a cell, [`counters::Counters`] count the map
//! samples of camera paths, and [`LightGrid`] holds the resulting [`tile_distributions::TileDistributions`].
//! Whatever was learned, the estimate stays unbiased: the distribution that chose a sample also gives its pdf,
//! and BSDF sampling covers what a distribution cannot choose.

pub mod cells;
pub mod counters;
mod distribution_builder;
mod grid;
mod learning;
mod options;
pub mod tile_distributions;
mod transfer;

pub use grid::{LightGrid, WHOLE_MAP};
pub use learning::{LearningGrid, MEMORY_BUDGET_BYTES};
pub use options::{DistributionOptions, Recording, RenderedPaths};
pub use tile_distributions::TileChoice;
