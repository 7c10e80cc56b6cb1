//! Paths that the device learns from, and the counters of what they see.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use super::dispatcher::Dispatcher;
use super::kernel::Kernel;
use super::layout::Work;
use super::progress::{GROUP, MAX_GROUPS};
use crate::error::Result;
use crate::light_grid::LearningGrid;

/// Traces paths that begin anywhere in the picture, as far as `cancel` allows. Returns the first one
/// that was not traced, and the number of rays of the others.
pub(super) fn trace_anywhere(
    on: &mut Dispatcher,
    kernel: Kernel,
    paths: Range<u64>,
    cancel: &AtomicBool,
) -> Result<(u64, u64)> {
    on.globals.seed = on.seed;
    on.write_globals();
    on.buffers.put("learning_rays", &[0; 4], "a count")?;
    let mut first = paths.start;
    while first < paths.end && !cancel.load(Ordering::Relaxed) {
        let groups = on.flights.units(kernel).min(MAX_GROUPS);
        let count = (groups * GROUP).min(paths.end - first);
        let work = Work {
            first: first as u32,
            first_high: (first >> 32) as u32,
            count: count as u32,
            ..Work::default()
        };
        let groups = count.div_ceil(GROUP);
        on.dispatch(&[kernel], &work, (1, groups as u32), groups, None)?;
        first += count;
    }
    on.settle()?;
    Ok((first, on.read_words("learning_rays", 1)?.first().copied().map_or(0, u64::from)))
}

/// Uploads counters, to be counted on.
pub(super) fn put_counters(on: &mut Dispatcher, learning: &LearningGrid) -> Result<()> {
    on.globals.set_cells(&learning.grid);
    on.globals.tries_per_vertex = learning.options.tries_per_vertex;
    on.write_globals();
    let (visits, slots, mut blocks) = learning.counters.words();
    if blocks.is_empty() {
        blocks.push(0);
    }
    on.buffers.put("visits", bytemuck::cast_slice(&visits), "the light grid's cells")?;
    on.buffers.put("slot_of_cell", bytemuck::cast_slice(slots), "the light grid's cells")?;
    on.buffers.put("counters", bytemuck::cast_slice(&blocks), "the learning counters")
}

/// Takes back the counters that were uploaded.
pub(super) fn take_counters(on: &Dispatcher, learning: &LearningGrid) -> Result<()> {
    let (visits, blocks) = learning.counters.word_counts();
    let visits = on.read_words("visits", visits)?;
    learning.counters.set_words(&visits, &on.read_words("counters", blocks)?);
    Ok(())
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::light_grid::cells::SphericalGrid;
    use crate::light_grid::{DistributionOptions, LightGrid};
    use crate::path::Lit;
    use crate::path::PathTracer;
    use crate::path::camera::CameraRays;
    use crate::radiance_cache::RadianceCache;
    use crate::render::film::Film;
    use crate::render::gi::CacheTraining;
    use crate::render::gi::tests::view;
    use crate::render::gpu::tests::crack;
    use crate::render::gpu::{Gpu, Renderer, UploadedScene};
    use crate::render::view_probe::tests::{shut_room, translucent_materials};
    use crate::render::{Gi, Pass, View, cpu, view_probe};

    /// Visits of each cell and, cell by cell, tile counters after two learning passes, the second with
    /// distributions of the first, and a rendering pass of which a third is counted, if rendered paths count.
    pub(in crate::render::gpu) fn learn(
        gpu: Option<&Gpu>,
        recording: DistributionOptions,
    ) -> (Vec<u32>, Vec<u32>, u64) {
        let (world, environment) = crack();
        let view = view(&world, recording);
        let rays = CameraRays::new(&view.camera, view.width, view.height);
        let grid = SphericalGrid {
            center: rays.position,
            columns: 64,
            rows: 32,
            faces: recording.faces,
            medium: false,
        };
        let mut learning = LearningGrid::new(grid, environment.tile_count(), recording);
        let mut distributions = LightGrid::whole_map(environment.tile_energies());
        let never = AtomicBool::new(false);
        let mut renderer = gpu.map(|gpu| {
            let uploaded = UploadedScene::new(gpu, &world, &environment).expect("it fits");
            Renderer::new(&uploaded, (&world, &environment), (&view, None), true).expect("it fits")
        });
        let mut traced = 0;
        for paths in [Some(0..4096), Some(4096..16384), None] {
            let mut film = Film::new(view.width, view.height, false);
            let pass = Pass { stride: 3, ..Pass::to(4) };
            let rendered = recording.goes_on().then_some(pass);
            traced += match (&mut renderer, paths) {
                (Some(renderer), paths) => {
                    renderer.set_grid(distributions.as_ref()).expect("uploaded");
                    let counts = Some(&learning);
                    match (paths, rendered) {
                        (Some(paths), _) => {
                            renderer.learn(paths, &learning, &never).map(Option::unwrap_or_default)
                        }
                        (None, Some(pass)) => {
                            renderer.render(pass, counts, &never).and_then(|_| {
                                renderer.read_film(&mut film)?;
                                Ok(renderer.rays())
                            })
                        }
                        (None, None) => Ok(0),
                    }
                    .expect("done")
                }
                (None, paths) => {
                    let tracer = view.tracer((&world, &environment), distributions.as_ref());
                    let tracer = PathTracer { counts: Some(&learning), ..tracer };
                    match (paths, rendered) {
                        (Some(paths), _) => cpu::learn(&tracer, &view, paths, &never),
                        (None, Some(pass)) => {
                            cpu::render(&tracer, &view, pass, &mut film, &never).1
                        }
                        (None, None) => 0,
                    }
                }
            };
            learning.counters.end_pass();
            distributions = learning.distributions(&environment);
        }
        let (visits, slots, blocks) = learning.counters.words();
        let words = 2 * environment.tile_count() as usize;
        let counted = slots.iter().filter(|slot| **slot != u32::MAX);
        let by_cell = counted.flat_map(|slot| &blocks[*slot as usize * words..][..words]);
        (visits, by_cell.copied().collect(), traced)
    }

    /// Rounding sends a path in a thousand to another triangle, texel or cell; what it meets from
    /// there on differs. So one count in 500 may lie elsewhere.
    #[test]
    fn both_devices_learn_the_same_counters() {
        let Some(gpu) = Gpu::for_test() else { return };
        for recording in [DistributionOptions::ADAPTIVE, DistributionOptions::TALK] {
            let (cpu_visits, cpu_blocks, cpu_rays) = learn(None, recording);
            let (gpu_visits, gpu_blocks, gpu_rays) = learn(Some(&gpu), recording);
            assert_eq!(cpu_blocks.len(), gpu_blocks.len(), "the same cells have counters");
            for (what, a, b) in
                [("visits", cpu_visits, gpu_visits), ("counters", cpu_blocks, gpu_blocks)]
            {
                let total: u64 = a.iter().map(|n| u64::from(*n)).sum();
                let moved: u64 = a.iter().zip(&b).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
                eprintln!("{what}: {moved} of {total} differ");
                assert!(total > 10_000 && moved * 500 < total, "{what}: {moved} of {total}");
            }
            assert!(cpu_rays.abs_diff(gpu_rays) * 1000 < cpu_rays, "{cpu_rays} {gpu_rays}");
        }
    }

    /// As above: one path in a thousand goes elsewhere.
    #[test]
    fn both_devices_train_the_same() {
        let Some(gpu) = Gpu::for_test() else { return };
        let (world, environment) = crack();
        let view = view(&world, DistributionOptions::ADAPTIVE);
        train_the_same(&gpu, (&world, &environment), view);
        for material in translucent_materials() {
            let (world, environment, view) = shut_room(&material);
            train_the_same(&gpu, (&world, &environment), view);
        }
    }

    fn train_the_same(gpu: &Gpu, (world, environment): Lit<'_>, view: View) {
        let view = View { gi: Gi::Cached, ..view };
        let training = || CacheTraining::new((world, environment), &view).expect("there is light");
        let distributions = LightGrid::whole_map(environment.tile_energies());
        let (on_cpu, on_gpu) = (training(), training());
        let lights = view_probe::lights_of((world, environment), &view, distributions.as_ref());
        let tracer = PathTracer {
            lights: lights.as_ref().unwrap_or(&world.lights),
            ..view.tracer((world, environment), distributions.as_ref())
        };
        let uploaded = UploadedScene::new(gpu, world, environment).expect("it fits");
        let mut renderer =
            Renderer::new(&uploaded, (world, environment), (&view, lights.as_ref()), true)
                .expect("it fits");
        renderer.set_grid(distributions.as_ref()).expect("uploaded");
        let never = AtomicBool::new(false);
        let mut known = None;
        for paths in [0..8192, 8192..16384] {
            let cpu_rays = cpu::train(
                &PathTracer { cache: known.as_ref(), ..tracer },
                &view,
                paths.clone(),
                &on_cpu.sums,
            );
            renderer.set_cache(known.as_ref()).expect("uploaded");
            let (end, gpu_rays) =
                renderer.train(paths.clone(), &on_gpu.sums, &never).expect("trained");
            assert_eq!(end, paths.end);
            assert!(cpu_rays.abs_diff(gpu_rays) * 500 < cpu_rays, "{cpu_rays} {gpu_rays}");
            let totals = [&on_cpu, &on_gpu].map(|training| training.sums.totals());
            let [(cpu_count, cpu_sums), (gpu_count, gpu_sums)] = totals;
            eprintln!("{cpu_count} {cpu_sums} against {gpu_count} {gpu_sums}");
            assert!(cpu_count.abs_diff(gpu_count) * 500 < cpu_count);
            assert!((cpu_sums / gpu_sums - 1.0).abs().max_element() < 0.01);
            known = on_cpu.sums.cache();
            let found = on_gpu.sums.cache().expect("there is room").used_slots();
            let slots = known.as_ref().map_or(0, RadianceCache::used_slots);
            assert!(slots.abs_diff(found) * 200 < slots, "{slots} {found}");
        }
    }
}
