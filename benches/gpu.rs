//! `cargo bench -- gpu`: what the GPU does in the CPU's time, scene by scene.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use lightgrid::environment::{Environment, EnvironmentOptions, sky};
use lightgrid::light_grid::LawOptions;
use lightgrid::path::{Background, PathLimits, World};
use lightgrid::render::filter::PixelFilter;
use lightgrid::render::gpu::{Gpu, Stage};
use lightgrid::render::{Sampling, Session, View};
use lightgrid::sampler::Points;
use lightgrid::scene::builtin;

/// Rounds in which both devices take their turn; the best round of each counts.
const ROUNDS: u32 = 4;
const SAMPLES: u32 = 8;

/// Prints a table of path samples and rays per second.
pub(crate) fn report() {
    let gpu = match Gpu::open(None) {
        Ok(gpu) => gpu,
        Err(reason) => {
            println!("{reason}");
            return;
        }
    };
    println!("{}, {}, driver {}", gpu.facts().name, gpu.facts().backend, gpu.facts().driver);
    println!(
        "{:<12} {:<8} {:>16} {:>16} {:>14} {:>7}",
        "scene", "bounces", "CPU samples/s", "GPU samples/s", "GPU rays/s", "ratio"
    );
    for name in ["office", "living-room", "exterior", "open"] {
        let world = World::new(builtin::build(name).expect("built in"));
        let map = sky::build("day", 1024, 512).expect("built in");
        let environment = Environment::new(map, &EnvironmentOptions::default()).expect("finite");
        for bounces in [0, 1, 5] {
            row(&gpu, name, &world, &environment, bounces);
        }
        cancel_row(&gpu, name, &world, &environment);
    }
}

/// Prints how long a render that is told to stop goes on.
fn cancel_row(gpu: &Gpu, name: &str, world: &World, environment: &Environment) {
    let stage = Stage::new(gpu, world, environment).expect("it fits");
    let view = View { width: 1280, height: 720, ..view(world, 5) };
    let mut session = Session::on_gpu(world, environment, view, &stage).expect("it fits");
    let never = AtomicBool::new(false);
    while session.samples() == 0 {
        session.advance(1, &never).expect("it runs");
    }
    let mut waits: Vec<Duration> = (0..20_u64)
        .map(|round| {
            let cancel = AtomicBool::new(false);
            let mut told = None;
            std::thread::scope(|scope| {
                let teller = scope.spawn(|| {
                    std::thread::sleep(Duration::from_millis(50 + 7 * round));
                    cancel.store(true, Ordering::Relaxed);
                    Instant::now()
                });
                session.advance(1 << 20, &cancel).expect("it runs");
                let ended = Instant::now();
                told = teller.join().ok().map(|told| ended - told);
            });
            told.expect("it does not panic")
        })
        .collect();
    waits.sort();
    println!(
        "{name:<12} told to stop at 1280x720: median {:?}, longest {:?}",
        waits[10], waits[19]
    );
}

fn row(gpu: &Gpu, name: &str, world: &World, environment: &Environment, bounces: u32) {
    let view = view(world, bounces);
    let stage = Stage::new(gpu, world, environment).expect("it fits");
    let mut sessions = [
        Session::new(world, environment, view.clone()),
        Session::on_gpu(world, environment, view, &stage).expect("it fits"),
    ];
    let never = AtomicBool::new(false);
    // Learning and the first pass, with which kernels are compiled, do not count.
    for session in &mut sessions {
        while session.samples() == 0 {
            session.advance(1, &never).expect("it runs");
        }
    }
    let mut best = [f64::INFINITY; 2];
    let mut rays = 0.0;
    for _ in 0..ROUNDS {
        for (session, best) in sessions.iter_mut().zip(&mut best) {
            let before = session.figures();
            session.advance(SAMPLES, &never).expect("it runs");
            session.settle().expect("it runs");
            let after = session.figures();
            rays = (after.rays - before.rays) as f64;
            *best = best.min(after.render_seconds - before.render_seconds);
        }
    }
    let samples = f64::from(320 * 180 * SAMPLES);
    let [cpu, gpu] = best.map(|seconds| samples / seconds);
    println!(
        "{name:<12} {bounces:<8} {cpu:>16.3e} {gpu:>16.3e} {:>14.3e} {:>7.2}",
        rays / best[1],
        gpu / cpu
    );
}

fn view(world: &World, bounces: u32) -> View {
    View {
        camera: world.scene.cameras[0].clone(),
        width: 320,
        height: 180,
        filter: PixelFilter::Box,
        sampling: Sampling::Adaptive,
        limits: PathLimits { bounces, russian_roulette: true },
        seed: 0,
        points: Points::Sobol,
        grid_columns: 64,
        learning_paths: 1 << 14,
        laws: LawOptions::ADAPTIVE,
        medium: None,
        background: Background::Map,
        crop: None,
        layers: false,
    }
}
