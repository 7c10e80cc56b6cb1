//! Bench of the built-in filter, whose rows are worth nothing unless compilers keep them in wide lanes.

use std::hint::black_box;
use std::sync::atomic::AtomicBool;

use criterion::{Criterion, Throughput};
use lightgrid::denoise::Denoiser;
use lightgrid::environment::{Environment, EnvironmentOptions, sky};
use lightgrid::path::World;
use lightgrid::render::{Session, View};
use lightgrid::scene::builtin;

pub(crate) fn bench(criterion: &mut Criterion) {
    let world = World::new(builtin::build("living-room").expect("built in"));
    let map = sky::build("day", 1024, 512).expect("built in");
    let environment = Environment::new(map, &EnvironmentOptions::default()).expect("finite");
    let size = [480, 270];
    let view = View { layers: true, ..View::new(world.scene.cameras[0].clone(), size) };
    let mut session = Session::new(&world, &environment, view);
    while session.samples() == 0 {
        session.advance(1, &AtomicBool::new(false)).expect("the CPU does not fail");
    }
    let film = session.film();
    let mut group = criterion.benchmark_group("denoise");
    group.sample_size(10).throughput(Throughput::Elements(u64::from(size[0] * size[1])));
    group.bench_function("à-trous, pixels", |b| {
        b.iter(|| black_box(Denoiser::ATrous.finish(film, None)));
    });
    group.finish();
}
