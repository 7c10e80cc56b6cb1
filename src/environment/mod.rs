//! The environment map as a light.

pub mod sky;
