//! Tests of bvh.
