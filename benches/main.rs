//! Criterion benches, one module a subject: `cargo bench -- bvh`.
//!
//! `cargo bench -- efficiency` prints the table of speed-ups instead. What a machine's devices do,
//! `lightgrid bench` tells.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "who runs this reads it")]

use criterion::{Criterion, criterion_group};

mod bvh;
mod denoise;
mod efficiency;
mod environment;
mod path;

criterion_group!(benches, bvh::bench, denoise::bench, environment::bench, path::bench);

fn main() {
    if std::env::args().any(|argument| argument == "efficiency") {
        efficiency::report();
        return;
    }
    benches();
    Criterion::default().configure_from_args().final_summary();
}
