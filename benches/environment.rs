//! Benches of environment.

use criterion::Criterion;

pub(crate) fn bench(_criterion: &mut Criterion) {}
