//! The one integration-test binary.

mod app;
mod bench;
mod bsdf;
mod builtin;
mod bvh;
mod cli;
mod environment;
mod estimator;
mod gltf_files;
mod gpu;
mod image_files;
mod metrics;
mod peers;
mod report;
mod shared;
mod stability;
mod window;
