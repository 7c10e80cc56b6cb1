//! Criterion benches, one module a subject: `cargo bench -- bvh`.
//!
//! `cargo bench -- efficiency` prints the table of speed-ups instead, `cargo bench -- gpu` how the GPU
//! compares with the CPU.

use criterion::{Criterion, criterion_group};

mod bvh;
mod efficiency;
mod environment;
mod gpu;
mod path;

criterion_group!(benches, bvh::bench, environment::bench, path::bench);

fn main() {
    if std::env::args().any(|argument| argument == "efficiency") {
        efficiency::report();
        return;
    }
    if std::env::args().any(|argument| argument == "gpu") {
        gpu::report();
        return;
    }
    benches();
    Criterion::default().configure_from_args().final_summary();
}
