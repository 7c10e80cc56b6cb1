//! The CPU's schedule: rows of pixels, or runs of learning paths, over all threads.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::Vec2;
use rayon::prelude::*;

use super::View;
use super::film::{Film, FilmTile};
use super::pass::{Coverage, Pass};
use crate::bvh::Ray;
use crate::light_grid::counters::MAX_RECORDS_PER_PASS;
use crate::path::camera::CameraRays;
use crate::path::sharing::{SharedTile, Start, radiance_of_tile};
use crate::path::{MAX_COUNTED, PathTracer};
use crate::radiance_cache::RadianceSums;
use crate::sampler::Sampler;

/// Seed offset that keeps learning's random numbers apart from rendering's.
pub(crate) const LEARNING_SEED: u32 = 0x6c65_6172;

/// The same for training the radiance cache.
pub(crate) const TRAINING_SEED: u32 = 0x7465_6163;

/// Learning paths one task traces between two looks at `cancel`.
const PATHS_PER_TASK: u64 = 512;

/// Learning pass `pass` covers this range of paths: a 64th of them first, which only finds out
/// what cells there are, then doubling, as far as the counters allow in one pass.
pub(super) fn learning_range(view: &View, pass: u32) -> Range<u64> {
    let total = view.learning_paths;
    let options = view.distribution_options();
    let tries = options.map_or(1, |options| u64::from(options.tries_per_vertex.max(1)));
    let longest = (most_paths_per_pass(view) / tries).max(1);
    let mut start = 0;
    let mut length = total.div_ceil(64).min(longest);
    for _ in 0..pass {
        start += length;
        length = start.min(longest);
    }
    start.min(total)..(start + length).min(total)
}

/// Traces the learning paths in `paths` and counts what they see; returns the number of rays.
pub(super) fn learn(
    tracer: &PathTracer<'_>,
    view: &View,
    paths: Range<u64>,
    cancel: &AtomicBool,
) -> u64 {
    let rays = view.rays();
    in_tasks(paths, cancel, |path| {
        let (ray, sampler) = anywhere(&rays, view, LEARNING_SEED, path);
        tracer.learn(ray, sampler)
    })
}

/// Traces the training paths in `paths`, all of them, and adds what they find; returns the number of
/// rays.
pub(super) fn train(
    tracer: &PathTracer<'_>,
    view: &View,
    paths: Range<u64>,
    sums: &RadianceSums,
) -> u64 {
    let rays = view.rays();
    in_tasks(paths, &AtomicBool::new(false), |path| {
        let (ray, sampler) = anywhere(&rays, view, TRAINING_SEED, path);
        tracer.train(ray, sampler, sums)
    })
}

/// Does something with each of `paths`, on all threads; returns the number of rays.
fn in_tasks(paths: Range<u64>, cancel: &AtomicBool, trace: impl Fn(u64) -> u32 + Sync) -> u64 {
    let tasks = (paths.end - paths.start).div_ceil(PATHS_PER_TASK);
    let task_of = |task: u64| {
        let start = paths.start + task * PATHS_PER_TASK;
        start..(start + PATHS_PER_TASK).min(paths.end)
    };
    let tasks = (0..tasks).into_par_iter().filter(|_| !cancel.load(Ordering::Relaxed));
    tasks.map(|task| task_of(task).map(|path| u64::from(trace(path))).sum::<u64>()).sum()
}

/// Where path `path` of one long sequence over the whole picture begins; high bits count its restarts.
fn anywhere(rays: &CameraRays, view: &View, seed: u32, path: u64) -> (Ray, Sampler) {
    let mut sampler = Sampler::new(view.seed ^ seed, (path >> 32) as u32, path as u32);
    let on_picture = Vec2::from(sampler.next_pair());
    let lens = lens_point(rays, &mut sampler);
    let pixel = on_picture * Vec2::new(view.width as f32, view.height as f32);
    (rays.ray(pixel, lens), sampler)
}

/// Most paths that can be counted in one pass, at one try a vertex where second vertices are not
/// shared.
pub(super) fn most_paths_per_pass(view: &View) -> u64 {
    let bounces = view.limits.bounces.clamp(1, MAX_COUNTED);
    let tries = view.shared_tile().map_or(bounces, |tile| tile.most_map_samples(bounces));
    (MAX_RECORDS_PER_PASS / u64::from(tries)).max(1)
}

/// Brings every pixel that a pass is about to its target; returns the numbers of samples and rays. Rows
/// come in an order that leaves none far from those that are done, should the pass be cut short.
pub(super) fn render(
    tracer: &PathTracer<'_>,
    view: &View,
    pass: Pass,
    film: &mut Film,
    cancel: &AtomicBool,
) -> (u64, u64) {
    let without_counts = PathTracer { counts: None, ..*tracer };
    let rays = view.rays();
    let task = Task { tracers: [&without_counts, tracer], rays, view, pass, cancel };
    let add = |a: (u64, u64), b: (u64, u64)| (a.0 + b.0, a.1 + b.1);
    let Some(tile) = view.shared_tile().filter(|_| pass.coverage == Coverage::All) else {
        let rows = film.tiles(film.width, 1, [0, 0]).into_iter().enumerate();
        let mut rows: Vec<_> = rows.step_by(pass.coverage.step() as usize).collect();
        // Multiples of the golden ratio lie evenly.
        rows.sort_unstable_by_key(|(y, _)| (*y as u32).wrapping_mul(0x9e37_79b9));
        return rows.into_par_iter().map(|(_, row)| task.render_pixels(row)).reduce(|| (0, 0), add);
    };
    let mut done = (0, 0);
    for sample in film.min_samples()..pass.target {
        if cancel.load(Ordering::Relaxed) {
            break;
        }
        let tiling = tile.tiling([film.width, film.height], pass.sequence.seed(view.seed), sample);
        let tiles = film.tiles(tile.side, tile.side, tiling.before).into_par_iter();
        let render =
            |(index, pixels)| task.render_tile(tile, tiling.seed_of(index as u32), sample, pixels);
        done = add(done, tiles.enumerate().map(render).reduce(|| (0, 0), add));
    }
    done
}

/// What all threads of a pass know.
struct Task<'a> {
    /// The one that counts nothing and the one that may.
    tracers: [&'a PathTracer<'a>; 2],
    rays: CameraRays,
    view: &'a View,
    pass: Pass,
    cancel: &'a AtomicBool,
}

impl Task<'_> {
    /// Where sample `sample` of a pixel begins.
    fn start(&self, [x, y]: [u32; 2], sample: u32) -> (Ray, Sampler, &PathTracer<'_>) {
        let view = self.view;
        let index = y * view.width + x;
        let mut sampler = self.pass.sequence.sampler(view.points, view.seed, [x, y], sample);
        let offset = view.filter.sample(Vec2::from(sampler.next_pair()));
        let lens = lens_point(&self.rays, &mut sampler);
        let centre = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
        let tracer = self.tracers[usize::from(self.pass.counts(index, sample))];
        (self.rays.ray(centre + offset, lens), sampler, tracer)
    }

    /// Brings pixel after pixel to the target; returns the numbers of samples and rays.
    fn render_pixels(&self, mut tile: FilmTile<'_>) -> (u64, u64) {
        let (mut samples, mut ray_count) = (0, 0);
        for (at, mut pixel) in tile.pixels().step_by(self.pass.coverage.step() as usize) {
            // A row of a long pass takes too long for somebody who waits.
            if self.cancel.load(Ordering::Relaxed) {
                break;
            }
            while pixel.samples() < self.pass.target {
                let (ray, sampler, tracer) = self.start(at, pixel.samples());
                let result = tracer.radiance(ray, sampler);
                pixel.add(&result);
                samples += 1;
                ray_count += u64::from(result.rays);
            }
        }
        (samples, ray_count)
    }

    /// Adds one sample to every pixel of a tile that has not got it yet.
    fn render_tile(
        &self,
        tile: SharedTile,
        seed: u32,
        sample: u32,
        mut film: FilmTile<'_>,
    ) -> (u64, u64) {
        if self.cancel.load(Ordering::Relaxed) || film.pixels().all(|(_, p)| p.samples() > sample) {
            return (0, 0);
        }
        let corner = film.corner;
        let start = |at: [u32; 2]| {
            let (ray, sampler, tracer) = self.start(at, sample);
            let place = [0, 1].map(|axis| (i64::from(at[axis]) - corner[axis]) as u32);
            Start { place, ray, sampler, tracer }
        };
        let starts: Vec<Start<'_>> = film.pixels().map(|(at, _)| start(at)).collect();
        let results = radiance_of_tile(tile, seed, &starts);
        let (mut samples, mut ray_count) = (0, 0);
        for ((_, mut pixel), result) in film.pixels().zip(&results) {
            ray_count += u64::from(result.rays);
            // A device that was left may have been ahead in parts.
            if pixel.samples() == sample {
                pixel.add(result);
                samples += 1;
            } else if sample == 0 && pixel.samples() == 1 {
                // The film was begun with a sample of its own, which would stand out of the tile.
                pixel.replace(result);
            }
        }
        (samples, ray_count)
    }
}

fn lens_point(rays: &CameraRays, sampler: &mut Sampler) -> Vec2 {
    if rays.has_lens() { Vec2::from(sampler.next_pair()) } else { Vec2::ZERO }
}
