//! The path tracing loop.
