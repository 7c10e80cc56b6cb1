//! Benches of environment: building importance tables, sampling a tile, looking up a direction.

use std::hint::black_box;

use criterion::Criterion;
use glam::Vec3;
use lightgrid::environment::{Environment, EnvironmentOptions, TableKind};
use lightgrid::image::Image;

/// Uneven sky with a sun 1e5 times as bright.
fn sky(width: u32, height: u32) -> Image {
    Image::from_fn(width, height, |x, y| {
        let noise = (x.wrapping_mul(2_654_435_761) ^ y.wrapping_mul(40_503)) >> 20;
        let value = 0.2 + noise as f32 / 4096.0;
        let sun = x.abs_diff(width / 3).pow(2) + y.abs_diff(height / 4).pow(2) < 64;
        [if sun { 1e5 } else { value }; 3]
    })
}

/// Points of the R2 sequence (Roberts 2018).
fn points(count: u32) -> Vec<[u32; 2]> {
    (0..count).map(|i| [0xc13f_a9a9_u32, 0x91e1_0da5].map(|step| step.wrapping_mul(i))).collect()
}

pub(crate) fn bench(criterion: &mut Criterion) {
    for (width, height) in [(2048, 1024), (8192, 4096)] {
        let map = sky(width, height);
        let mut group = criterion.benchmark_group(format!("environment {width}x{height}"));
        group.sample_size(10);
        for table in TableKind::ALL {
            let options = EnvironmentOptions { table, ..Default::default() };
            let build = |map| Environment::new(map, &options).expect("a valid map");
            group.bench_function(format!("build {table}"), |b| {
                b.iter_batched(|| map.clone(), build, criterion::BatchSize::PerIteration);
            });
            let environment = build(map.clone());
            sample_and_look_up(&mut group, table, &environment);
        }
    }
}

fn sample_and_look_up(
    group: &mut criterion::BenchmarkGroup<'_, criterion::measurement::WallTime>,
    table: TableKind,
    environment: &Environment,
) {
    let points = points(1 << 16);
    let tiles = environment.tile_count() as usize;
    let directions: Vec<Vec3> = (points.iter().enumerate())
        .filter_map(|(i, u)| environment.sample_in_tile((i * 197 % tiles) as u32, *u))
        .map(|sample| sample.direction)
        .collect();
    let mut i = 0;
    group.bench_function(format!("sample_in_tile {table}"), |b| {
        b.iter(|| {
            i = (i + 1) % points.len();
            black_box(environment.sample_in_tile((i * 197 % tiles) as u32, points[i]))
        });
    });
    group.bench_function(format!("radiance_and_tile_pdf {table}"), |b| {
        b.iter(|| {
            i = (i + 1) % directions.len();
            black_box(environment.radiance_and_tile_pdf(directions[i]))
        });
    });
}
