//! The CPU's schedule: rows of pixels, or runs of learning paths, over all threads.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::Vec2;
use rayon::prelude::*;

use super::film::{Film, Pixel, Surface};
use super::{Pass, View};
use crate::light_grid::counters::MAX_RECORDS_PER_PASS;
use crate::path::PathTracer;
use crate::path::camera::CameraRays;
use crate::sampler::Sampler;

/// Seed offset that keeps learning's random numbers apart from rendering's.
const LEARNING_SEED: u32 = 0x6c65_6172;

/// Learning paths one task traces between two looks at `cancel`.
const PATHS_PER_TASK: u64 = 512;

/// Learning pass `pass` covers this range of paths: a 64th of them first, which only finds out
/// what cells there are, then doubling, as far as the counters allow in one pass.
pub(super) fn learning_range(view: &View, pass: u32) -> Range<u64> {
    let total = view.learning_paths;
    let tries = view.law_options().map_or(1, |laws| u64::from(laws.tries_per_vertex.max(1)));
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
    rays: &CameraRays,
    view: &View,
    paths: Range<u64>,
    cancel: &AtomicBool,
) -> u64 {
    let tasks = (paths.end - paths.start).div_ceil(PATHS_PER_TASK);
    (0..tasks)
        .into_par_iter()
        .map(|task| {
            if cancel.load(Ordering::Relaxed) {
                return 0;
            }
            let start = paths.start + task * PATHS_PER_TASK;
            (start..(start + PATHS_PER_TASK).min(paths.end))
                .map(|path| {
                    // One long sequence over the whole picture; its high bits count its restarts.
                    let seed = view.seed ^ LEARNING_SEED;
                    let mut sampler = Sampler::new(seed, (path >> 32) as u32, path as u32);
                    let on_picture = Vec2::from(sampler.next_pair());
                    let lens = lens_point(rays, &mut sampler);
                    let pixel = on_picture * Vec2::new(view.width as f32, view.height as f32);
                    let ray = rays.ray(pixel, lens);
                    u64::from(tracer.learn(ray, sampler))
                })
                .sum::<u64>()
        })
        .sum()
}

/// Most paths that can be counted in one pass, at one try a vertex.
pub(super) fn most_paths_per_pass(view: &View) -> u64 {
    (MAX_RECORDS_PER_PASS / u64::from(view.limits.bounces.max(1))).max(1)
}

/// Brings every pixel that a pass is about to its target; returns the numbers of samples and rays. Rows
/// come in an order that leaves none far from those that are done, should the pass be cut short.
pub(super) fn render(
    tracer: &PathTracer<'_>,
    rays: &CameraRays,
    view: &View,
    pass: Pass,
    film: &mut Film,
    cancel: &AtomicBool,
) -> (u64, u64) {
    let width = film.width as usize;
    let layers = !film.surfaces.is_empty();
    let mut no_surfaces = vec![Surface::default(); if layers { 0 } else { film.height as usize }];
    let (surfaces, surfaces_per_row) =
        if layers { (&mut film.surfaces, width) } else { (&mut no_surfaces, 1) };
    let surfaces = surfaces.chunks_mut(surfaces_per_row);
    let rows = film.pixels.chunks_mut(width).zip(surfaces).enumerate();
    let mut rows: Vec<_> = rows.step_by(pass.every as usize).collect();
    // Multiples of the golden ratio lie evenly.
    rows.sort_unstable_by_key(|(y, _)| (*y as u32).wrapping_mul(0x9e37_79b9));
    rows.into_par_iter()
        .map(|(y, (pixels, surfaces))| {
            let mut done = (0, 0);
            for (x, pixel) in pixels.iter_mut().enumerate().step_by(pass.every as usize) {
                // A row of a long pass takes too long for somebody who waits.
                if cancel.load(Ordering::Relaxed) {
                    break;
                }
                let surface = if layers { surfaces.get_mut(x) } else { None };
                let (samples, rays) =
                    render_pixel(tracer, rays, view, (x, y), pass, pixel, surface);
                done = (done.0 + samples, done.1 + rays);
            }
            done
        })
        .reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1))
}

fn render_pixel(
    tracer: &PathTracer<'_>,
    rays: &CameraRays,
    view: &View,
    (x, y): (usize, usize),
    pass: Pass,
    pixel: &mut Pixel,
    mut surface: Option<&mut Surface>,
) -> (u64, u64) {
    let index = y as u32 * view.width + x as u32;
    let centre = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
    let (mut samples, mut ray_count) = (0, 0);
    while pixel.samples() < pass.target {
        let sample = pixel.samples();
        let mut sampler = pass.sequence.sampler(view.points, view.seed, index, sample);
        let offset = view.filter.sample(Vec2::from(sampler.next_pair()));
        let lens = lens_point(rays, &mut sampler);
        let counts = tracer.counts.filter(|_| pass.counts(index, sample));
        let tracer = PathTracer { counts, ..*tracer };
        let result = tracer.radiance(rays.ray(centre + offset, lens), sampler);
        pixel.add(&result);
        if let Some(surface) = &mut surface {
            surface.add(&result);
        }
        samples += 1;
        ray_count += u64::from(result.rays);
    }
    (samples, ray_count)
}

fn lens_point(rays: &CameraRays, sampler: &mut Sampler) -> Vec2 {
    if rays.has_lens() { Vec2::from(sampler.next_pair()) } else { Vec2::ZERO }
}
