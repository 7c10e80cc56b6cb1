//! How light is scattered at a surface point.
