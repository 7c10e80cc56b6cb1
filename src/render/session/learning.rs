//! Learning which tiles are seen from where: passes of learning paths, then what rendered paths count.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::Session;
use crate::environment::Environment;
use crate::error::Result;
use crate::light_grid::cells::SphericalGrid;
use crate::light_grid::{LearningGrid, LightGrid, RenderedPaths};
use crate::path::World;
use crate::path::camera::CameraRays;
use crate::render::view_probe::{ROOM_ENCLOSURE, enclosure, middle_distance};
use crate::render::{View, cpu};

/// Learning under way, or over.
pub(super) struct Learning {
    pub(super) grid: LearningGrid,
    pass: u32,
    /// Paths counted since the counters were last looked through.
    paths_of_pass: u64,
    pub(super) stage: Stage,
}

/// How far learning is.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Stage {
    /// Learning paths are traced.
    Tracing,
    /// What rendered paths see is counted.
    Counting,
    /// Nothing is counted any more.
    Over,
}

/// Paths, traced to learn from or rendered, after which learning ends: the distributions of 2^20 paths leave
/// 1.2 times the error of 2^23 (office at sunset, 128x72), those of 2^16 three times.
const ENOUGH_PATHS: u64 = 1 << 23;

/// Samples of a pixel after which it learns no more. New distributions begin a new sequence, and many short
/// sequences are worse than a long one: distributions of 16 samples in place of 4 have 0.97 to 1.06 times the
/// error of an interior at 64 samples, 1.06 times that of the exterior, 1.14 times that of an open
/// scene (160x90).
const LAST_LEARNING_SAMPLE: u32 = 4;

/// How far the camera may be from the centre of cells that were learned in, over the middle distance of
/// what it sees.
const MAX_MOVED: f32 = 0.5;

impl Learning {
    /// Whether nothing is counted any more.
    pub(super) fn is_over(&self) -> bool {
        self.stage == Stage::Over
    }

    /// An empty grid, if the view is to learn and the map has anything to learn about.
    pub(super) fn new(
        world: &World,
        environment: &Environment,
        view: &View,
        rays: &CameraRays,
    ) -> Option<Self> {
        let options = view.distribution_options()?;
        if environment.is_black() || view.limits.bounces == 0 {
            return None;
        }
        let grid = SphericalGrid {
            center: rays.position(),
            columns: view.grid_columns,
            rows: (view.grid_columns / 2).max(1),
            faces: options.faces,
            medium: view.fog(world).is_some(),
        };
        let grid = LearningGrid::new(grid, environment.tile_count(), options);
        Some(Self { grid, pass: 0, paths_of_pass: 0, stage: Stage::Tracing })
    }
}

impl Session<'_> {
    /// Goes on from what paths have counted before in the same world under the same map, for another
    /// camera near by: it is rendered with what they know, and rendered paths add to it. `false` if it
    /// does not suit, as where rendered paths add nothing, and nothing has changed.
    ///
    /// # Errors
    /// If it does not fit on the GPU.
    pub(crate) fn continue_learning(&mut self, counted: &LearningGrid) -> Result<bool> {
        let goes_on =
            self.state.view.distribution_options().is_some_and(|options| options.goes_on());
        let Some(learning) = self.state.learning.as_mut().filter(|_| goes_on) else {
            return Ok(false);
        };
        let moved = self.state.rays.position().distance(counted.grid.center);
        let is_near = middle_distance(
            self.world,
            [self.state.view.width, self.state.view.height],
            &self.state.rays,
        )
        .is_some_and(|distance| moved <= MAX_MOVED * distance);
        if !is_near || !counted.is_like(&learning.grid) {
            return Ok(false);
        }
        learning.grid = counted.snapshot();
        learning.stage = Stage::Counting;
        self.update_distributions();
        self.take_up_distributions()?;
        Ok(true)
    }

    /// Whether rendered paths count when learning paths have been traced.
    pub(super) fn counts_rendered(&self) -> bool {
        self.state.view.distribution_options().is_some_and(|options| {
            let is_everywhere = options.rendered_paths == RenderedPaths::Everywhere;
            let is_room = || enclosure(self.world, &self.state.view) >= ROOM_ENCLOSURE;
            options.goes_on() && (is_everywhere || is_room())
        })
    }

    /// One learning pass.
    pub(super) fn learn(&mut self, cancel: &AtomicBool) -> Result<()> {
        let Some(learning) = &self.state.learning else { return Ok(()) };
        let range = cpu::learning_range(&self.state.view, learning.pass);
        let rays = match &mut self.gpu {
            None => {
                let tracer = self.tracer(Some(&learning.grid));
                let rays =
                    cpu::learn(&tracer, &self.state.rays, &self.state.view, range.clone(), cancel);
                if cancel.load(Ordering::Relaxed) {
                    return self.begin_learning_again();
                }
                rays
            }
            Some(renderer) => match renderer.learn(range.clone(), &learning.grid, cancel)? {
                Some(rays) => rays,
                None => return Ok(()),
            },
        };
        self.state.figures.learning_rays += rays;
        self.state.figures.learning_paths = range.end;
        if let Some(learning) = &mut self.state.learning {
            learning.pass += 1;
        }
        self.update_distributions();
        if range.end >= self.state.view.learning_paths {
            self.finish_learning();
        }
        self.take_up_distributions()
    }

    /// Forgets a pass that was cancelled: which of its paths were counted depends on the threads.
    fn begin_learning_again(&mut self) -> Result<()> {
        let state = &mut self.state;
        state.learned = None;
        state.learning = Learning::new(self.world, self.environment, &state.view, &state.rays);
        let figures = &mut state.figures;
        (figures.learning_paths, figures.distribution_paths) = (0, 0);
        (figures.visited_cells, figures.learned_cells, figures.grid_bytes) = (0, 0, 0);
        self.take_up_distributions()
    }

    /// Makes distributions of what all passes so far counted: the next pass draws from them.
    pub(super) fn update_distributions(&mut self) {
        let Some(learning) = &mut self.state.learning else { return };
        let start = Instant::now();
        learning.grid.counters.end_pass();
        learning.paths_of_pass = 0;
        self.state.figures.distribution_paths =
            self.state.figures.learning_paths + self.state.figures.counted_paths;
        // The old distributions go first: both together would not fit the budget.
        self.state.learned = None;
        self.state.learned = learning.grid.distributions(self.environment);
        let distributions = self.state.learned.as_ref().map_or(0, LightGrid::memory_bytes);
        let held = learning.grid.counters.memory_bytes() + distributions;
        self.state.figures.grid_bytes = held;
        self.state.figures.grid_peak_bytes = self.state.figures.grid_peak_bytes.max(held);
        self.state.figures.visited_cells = learning.grid.counters.visited_cells();
        self.state.figures.learned_cells =
            self.state.learned.as_ref().map_or(0, |grid| grid.distributions().len() as usize - 1);
        self.state.figures.distribution_seconds += start.elapsed().as_secs_f64();
    }

    /// Makes room in the counters for a pass of so many samples a pixel; returns of how many one
    /// can be counted.
    pub(super) fn prepare_counting(&mut self, samples: u32) -> u32 {
        let most = cpu::most_paths_per_pass(&self.state.view);
        let paths = self.state.view.pixels() * u64::from(samples);
        let stride = paths.div_ceil(most).max(1);
        if let Some(learning) = self.state.learning.as_mut().filter(|learning| !learning.is_over())
            && learning.paths_of_pass + paths.div_ceil(stride) > most
        {
            learning.grid.counters.end_pass();
            learning.paths_of_pass = 0;
        }
        u32::try_from(stride).unwrap_or(u32::MAX)
    }

    /// Takes note that so many rendered paths were counted. There are new distributions of twice as many paths
    /// as those in use were made of, where each pixel has a power of two of samples: the points of the
    /// sequences that then end and begin are evenly spread.
    pub(super) fn learn_from_rendered(&mut self, paths: u64, is_whole: bool) -> Result<()> {
        let Some(learning) = self.state.learning.as_mut().filter(|learning| !learning.is_over())
        else {
            return Ok(());
        };
        self.state.figures.counted_paths += paths;
        learning.paths_of_pass += paths;
        let all = self.state.figures.learning_paths + self.state.figures.counted_paths;
        let samples = self.state.samples;
        if !is_whole || !samples.is_power_of_two() {
            return Ok(());
        }
        if all >= ENOUGH_PATHS || samples >= LAST_LEARNING_SAMPLE {
            learning.stage = Stage::Over;
        }
        if all < 2 * self.state.figures.distribution_paths {
            return Ok(());
        }
        self.update_distributions();
        self.take_up_distributions()
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::environment::{EnvironmentOptions, sky};
    use crate::light_grid::DistributionOptions;
    use crate::render::gi::tests::view;
    use crate::render::{Phase, Sampling};
    use crate::scene::builtin;

    fn office() -> (World, Environment) {
        let map = sky::build("overcast", 128, 64).expect("a sky");
        let environment = Environment::new(map, &EnvironmentOptions::default());
        let world = World::new(builtin::build("office").expect("built in"));
        (world, environment.expect("a sound map"))
    }

    fn moved(view: &View, by: Vec3, seed: u32) -> View {
        let mut view = View { seed, ..view.clone() };
        view.camera.world_from_camera.translation += glam::Vec3A::from(by);
        view
    }

    fn mean(session: &mut Session<'_>) -> f64 {
        session.advance(16, &AtomicBool::new(false)).expect("the CPU does not fail");
        crate::metrics::mean(&session.film().image())
    }

    /// Where pixels share, a picture that was begun with pixels of their own is the same as one that was
    /// not, and nothing of those is left.
    #[test]
    fn what_a_picture_was_begun_with_makes_room_for_tiles() {
        let (world, environment) = office();
        let view = View {
            sampling: Sampling::Plain,
            sharing: crate::render::Sharing::Large,
            ..view(&world, DistributionOptions::ADAPTIVE)
        };
        let never = AtomicBool::new(false);
        let films = [false, true].map(|is_begun| {
            let mut session = Session::new(&world, &environment, view.clone());
            if is_begun {
                session.begin(8, &never);
                assert_eq!(session.film().total_samples(), 8 * 5);
                session.begin(1, &never);
                assert_eq!(session.samples(), 1, "whole, but not shared");
                session = Session::new(&world, &environment, view.clone());
                session.begin(2, &never);
            }
            session.advance(1, &never).expect("the CPU does not fail");
            assert_eq!(session.figures().samples, 64 * 36);
            session.film().clone()
        });
        assert_eq!(films[0], films[1]);
    }

    /// A GPU takes as many samples at a time as it can, but what is learned of them does not depend on it.
    #[cfg(feature = "gpu")]
    #[test]
    fn how_fast_a_gpu_is_changes_nothing_of_what_is_learned() {
        use crate::render::StopRule;
        use crate::render::gpu::{Gpu, UploadedScene};
        use crate::render::session::state::Spent;

        let Some(gpu) = Gpu::for_test() else { return };
        let (world, environment) = office();
        let view = view(&world, DistributionOptions::ADAPTIVE);
        let uploaded = UploadedScene::new(&gpu, &world, &environment).expect("it fits");
        let rule = StopRule { samples: Some(16), ..StopRule::default() };
        // Seconds a pass while there are fewer than three samples, and then.
        let films = [[1e-3, 1e-3], [1e3, 1e-3], [1e3, 1e3]].map(|seconds| {
            let session = Session::on_gpu(&world, &environment, view.clone(), &uploaded);
            let mut session = session.expect("it fits");
            while !session.is_done(&rule) {
                let seconds = seconds[usize::from(session.samples() > 2)];
                session.state.here = Spent { seconds, samples: 2000 };
                let samples = session.next_pass(&rule);
                session.advance(samples, &AtomicBool::new(false)).expect("rendered");
            }
            session.film().clone()
        });
        assert!(films.iter().all(|film| *film == films[0]), "the same bits");
    }

    #[test]
    fn a_camera_near_by_goes_on_with_what_was_counted() {
        let (world, environment) = office();
        let view = view(&world, DistributionOptions::ADAPTIVE);
        let session = |view: View| Session::new(&world, &environment, view);
        let mut first = session(view.clone());
        while first.phase() == Phase::Learning {
            first.advance(0, &AtomicBool::new(false)).expect("learned");
        }
        mean(&mut first);
        let counted = first.counters().expect("it learns");
        let known = first.figures().learned_cells;

        let near = Vec3::new(0.3, 0.1, 0.2);
        let mut means = [Vec::new(), Vec::new()];
        for seed in 0..12 {
            let mut next = session(moved(&view, near, seed));
            assert!(next.continue_learning(counted).expect("the CPU does not fail"));
            assert_eq!(next.phase(), Phase::Rendering);
            assert!(next.figures().learned_cells >= known);
            means[0].push(mean(&mut next));
            assert!(next.figures().learned_cells > known, "it sees what the first one did not");
            let plain = View { sampling: Sampling::Plain, ..moved(&view, near, 100 + seed) };
            means[1].push(mean(&mut session(plain)));
        }
        // Mean, and variance of the mean.
        let [next, plain] = means.map(|values| {
            let count = values.len() as f64;
            let mean = values.iter().sum::<f64>() / count;
            let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
            (mean, squares / (count - 1.0) / count)
        });
        let noise = (next.1 + plain.1).sqrt();
        let is_equal = (next.0 - plain.0).abs() < 4.0 * noise;
        assert!(is_equal && noise < 0.01 * plain.0, "{next:?} {plain:?}");

        let takes = |view: View| session(view).continue_learning(counted).expect("no GPU");
        assert!(!takes(moved(&view, Vec3::new(0.0, 0.0, 50.0), 0)), "too far");
        let no_faces = DistributionOptions { faces: false, ..DistributionOptions::ADAPTIVE };
        assert!(!takes(View { distributions: no_faces, ..view.clone() }), "other cells");
        assert!(!takes(View { sampling: Sampling::Plain, ..view.clone() }), "nothing to learn");
    }
}
