//! Benches of whole paths: rays per second of rendering and of learning, and the tile distributions.

use std::hint::black_box;
use std::sync::atomic::AtomicBool;

use criterion::{Criterion, Throughput};
use lightgrid::environment::{Environment, EnvironmentOptions, sky};
use lightgrid::light_grid::tile_distributions::TileDistributions;
use lightgrid::path::{PathLimits, World};
use lightgrid::render::filter::PixelFilter;
use lightgrid::render::{Sampling, Session, View};
use lightgrid::scene::builtin;

pub(crate) fn bench(criterion: &mut Criterion) {
    let world = World::new(builtin::build("living-room").expect("built in"));
    let map = sky::build("day", 1024, 512).expect("built in");
    let environment = Environment::new(map, &EnvironmentOptions::default()).expect("finite");
    let never = AtomicBool::new(false);
    let view = |sampling, learning_paths| View {
        filter: PixelFilter::Box,
        sampling,
        limits: PathLimits { bounces: 5, russian_roulette: true },
        learning_paths,
        ..View::new(world.scene.cameras[0].clone(), [128, 72])
    };
    let mut group = criterion.benchmark_group("path");
    group.sample_size(10);
    for sampling in [Sampling::Plain, Sampling::Adaptive] {
        let mut session = Session::new(&world, &environment, view(sampling, 1 << 16));
        while session.samples() == 0 {
            session.advance(1, &never).expect("the CPU does not fail");
        }
        let figures = session.figures();
        group.throughput(Throughput::Elements(figures.rays));
        group.bench_function(format!("render one sample, rays, {sampling:?}"), |b| {
            b.iter(|| session.advance(1, &never));
        });
    }
    let learn = || {
        let mut session = Session::new(&world, &environment, view(Sampling::Adaptive, 1 << 13));
        while session.phase() == lightgrid::render::Phase::Learning {
            session.advance(1, &never).expect("the CPU does not fail");
        }
        session.figures().learning_rays
    };
    group.throughput(Throughput::Elements(learn()));
    group.bench_function("learn from 8192 paths, rays", |b| b.iter(learn));
    group.finish();
    distributions(criterion);
}

fn distributions(criterion: &mut Criterion) {
    let mut distributions = TileDistributions::new(512);
    for distribution in 0..1000_u32 {
        let weights: Vec<f64> = (0..512_u32)
            .map(|tile| lightgrid::sampler::hash(distribution << 16 | tile))
            .map(|h| if h % 3 == 0 { f64::from(h >> 8) } else { 0.0 })
            .collect();
        distributions.push(&weights);
    }
    let mut group = criterion.benchmark_group("tile distributions");
    let mut state = 1_u32;
    let mut next = move || {
        state = lightgrid::sampler::hash(state.wrapping_add(0x9e37_79b9));
        state
    };
    group.bench_function("sample, one of 1000 distributions", |b| {
        b.iter(|| black_box(distributions.sample(next() % 1000, next(), next())));
    });
    group.bench_function("probability, one of 1000 distributions", |b| {
        b.iter(|| black_box(distributions.probability(next() % 1000, next() % 512)));
    });
    group.finish();
}
