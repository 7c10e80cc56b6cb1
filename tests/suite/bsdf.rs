//! Tests of bsdf.
