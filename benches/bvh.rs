//! Benches of bvh.

use criterion::Criterion;

pub(crate) fn bench(_criterion: &mut Criterion) {}
