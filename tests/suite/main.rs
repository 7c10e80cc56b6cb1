//! The one integration-test binary.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "who runs this reads it")]

mod app;
mod bench;
mod bsdf;
mod builtin;
mod bvh;
mod cli;
mod docs;
mod environment;
mod estimator;
mod farm;
mod faults;
mod gltf_files;
mod gpu;
mod image_files;
mod metrics;
mod peers;
mod real_files;
mod report;
mod shared;
mod stability;
mod window;
