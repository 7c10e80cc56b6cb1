//! The one integration-test binary.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "who runs this reads it")]

#[cfg(feature = "window")]
mod app;
#[cfg(feature = "report")]
mod bench;
mod blender;
mod bsdf;
mod builtin;
mod bvh;
mod cli;
#[cfg(all(feature = "window", feature = "report"))]
mod docs;
mod environment;
mod estimator;
mod examples;
mod farm;
mod faults;
mod gltf_files;
#[cfg(feature = "gpu")]
mod gpu;
mod image_files;
mod instances;
mod long_renders;
mod metrics;
mod packed;
mod peers;
mod real_files;
#[cfg(feature = "report")]
mod report;
mod rooms;
mod shared;
#[cfg(feature = "report")]
mod stability;
#[cfg(feature = "window")]
mod window;
mod z_test;
