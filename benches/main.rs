//! Criterion benches, one module a subject: `cargo bench -- bvh`.

use criterion::{criterion_group, criterion_main};

mod bvh;
mod environment;

criterion_group!(benches, bvh::bench, environment::bench);
criterion_main!(benches);
