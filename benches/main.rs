//! Criterion benches, one module a subject: `cargo bench -- bvh`.
//!
//! `cargo bench -- efficiency` prints the table of speed-ups instead, `cargo bench -- denoisers fog open` that of
//! denoised pictures (without scenes, of all). What a machine's devices do, `lightgrid bench` tells.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "who runs this reads it")]

use std::sync::atomic::AtomicBool;

use criterion::{Criterion, criterion_group};
use lightgrid::render::{Phase, Session};

mod bvh;
mod denoise;
mod denoisers;
mod efficiency;
mod environment;
mod path;

/// Learns, and adds samples to every pixel.
fn advance(session: &mut Session<'_>, samples: u32) {
    let never = AtomicBool::new(false);
    while session.phase() == Phase::Learning {
        session.advance(1, &never).expect("the CPU does not fail");
    }
    session.advance(samples, &never).expect("the CPU does not fail");
}

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
