//! Criterion benches, one module a subject: `cargo bench -- bvh`.
//!
//! `cargo bench -- efficiency` prints the table of speed-ups instead, `cargo bench -- denoisers fog open` that of
//! denoised pictures (without scenes, of all). What a machine's devices do, `lightgrid bench` tells.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "who runs this reads it")]

use criterion::{Criterion, criterion_group};

mod bvh;
mod denoise;
mod denoisers;
mod efficiency;
mod environment;
mod path;

criterion_group!(benches, bvh::bench, denoise::bench, environment::bench, path::bench);

fn main() {
    let tables: [(&str, fn()); 2] =
        [("efficiency", efficiency::report), ("denoisers", denoisers::report)];
    for (name, report) in tables {
        if std::env::args().any(|argument| argument == name) {
            return report();
        }
    }
    benches();
    Criterion::default().configure_from_args().final_summary();
}
