//! Learning which tiles are seen from where: passes of learning paths, then what rendered paths count.

use std::ops::Range;
use std::time::Instant;

use crate::environment::Environment;
use crate::light_grid::cells::SphericalGrid;
use crate::light_grid::{LearningGrid, LightGrid, RenderedPaths};
use crate::path::{Lit, World};
use crate::render::view_probe::{ROOM_ENCLOSURE, enclosure, middle_distance};
use crate::render::{Figures, Sampling, View, cpu};

/// What tiles are chosen by, and what is learned of them.
pub(super) struct Tiles {
    /// The distribution of the whole map.
    whole_map: Option<LightGrid>,
    /// Distributions of what was counted.
    learned: Option<LightGrid>,
    /// `None` if nothing is to be learned, or everything has been by others.
    learning: Option<Learning>,
}

/// Learning under way, or over.
pub(super) struct Learning {
    grid: LearningGrid,
    pass: u32,
    /// Paths counted since the counters were last looked through.
    paths_of_pass: u64,
    stage: Stage,
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
    /// An empty grid, if the view is to learn and the map has anything to learn about.
    pub(super) fn new((world, environment): Lit<'_>, view: &View) -> Option<Self> {
        let options = view.distribution_options()?;
        if environment.is_black() || view.limits.bounces == 0 {
            return None;
        }
        let grid = SphericalGrid {
            center: view.rays().position,
            columns: view.grid_columns,
            rows: (view.grid_columns / 2).max(1),
            faces: options.faces,
            medium: view.fog(world).is_some(),
        };
        let grid = LearningGrid::new(grid, environment.tile_count(), options);
        Some(Self { grid, pass: 0, paths_of_pass: 0, stage: Stage::Tracing })
    }

    fn end_pass(&mut self) {
        self.grid.counters.end_pass();
        self.paths_of_pass = 0;
    }
}

impl Tiles {
    /// Nothing learned yet.
    pub(super) fn new(lit: Lit<'_>, view: &View) -> Self {
        let (_, environment) = lit;
        let is_sampled = view.sampling != Sampling::Bsdf && !environment.is_black();
        let whole_map = is_sampled.then(|| LightGrid::whole_map(environment.tile_energies()));
        let learning = Learning::new(lit, view);
        Self { whole_map: whole_map.flatten(), learned: None, learning }
    }

    /// The distributions in use.
    pub(super) fn grid(&self) -> Option<&LightGrid> {
        self.learned.as_ref().or(self.whole_map.as_ref())
    }

    /// What was counted.
    pub(super) fn counters(&self) -> Option<&LearningGrid> {
        self.learning.as_ref().map(|learning| &learning.grid)
    }

    /// What paths are to be counted into; `None` where nothing is counted any more.
    pub(super) fn counted_into(&self) -> Option<&LearningGrid> {
        self.counters().filter(|_| self.stage() != Stage::Over)
    }

    /// Bytes of distributions and counters.
    #[cfg(feature = "window")]
    pub(super) fn memory_bytes(&self) -> usize {
        let grid = self.learned.as_ref().map_or(0, LightGrid::memory_bytes);
        grid + self.counters().map_or(0, |grid| grid.counters.memory_bytes())
    }

    /// How far learning is.
    pub(super) fn stage(&self) -> Stage {
        self.learning.as_ref().map_or(Stage::Over, |learning| learning.stage)
    }

    /// Takes these distributions and learns no more.
    pub(super) fn set(&mut self, grid: Option<LightGrid>) {
        (self.learning, self.learned) = (None, grid);
    }

    /// Ends the tracing of learning paths; rendered ones may count from now on.
    pub(super) fn finish_tracing(&mut self, world: &World, view: &View) {
        if let Some(learning) = self.learning.as_mut().filter(|l| l.stage == Stage::Tracing) {
            let counts = view.distribution_options().is_some_and(|options| {
                let is_everywhere = options.rendered_paths == RenderedPaths::Everywhere;
                options.goes_on() && (is_everywhere || enclosure(world, view) >= ROOM_ENCLOSURE)
            });
            learning.stage = if counts { Stage::Counting } else { Stage::Over };
        }
    }

    /// Goes on from what was counted for a camera near by; `false` if it does not suit, and nothing has changed.
    pub(super) fn continue_from(
        &mut self,
        counted: &LearningGrid,
        world: &World,
        view: &View,
    ) -> bool {
        let goes_on = view.distribution_options().is_some_and(|options| options.goes_on());
        let Some(learning) = self.learning.as_mut().filter(|_| goes_on) else { return false };
        let moved = view.rays().position.distance(counted.grid.center);
        let is_near =
            middle_distance(world, view).is_some_and(|distance| moved <= MAX_MOVED * distance);
        if !is_near || !counted.is_like(&learning.grid) {
            return false;
        }
        learning.grid = counted.snapshot();
        learning.stage = Stage::Counting;
        true
    }

    /// Learning paths of the next pass, and what they are counted into.
    pub(super) fn next_pass(&self, view: &View) -> Option<(Range<u64>, &LearningGrid)> {
        let learning = self.learning.as_ref()?;
        Some((cpu::learning_range(view, learning.pass), &learning.grid))
    }

    /// Takes note of a pass of learning paths, the last of which is before `end`.
    pub(super) fn note_traced(
        &mut self,
        end: u64,
        environment: &Environment,
        figures: &mut Figures,
    ) {
        figures.learning_paths = end;
        if let Some(learning) = &mut self.learning {
            learning.pass += 1;
        }
        self.update(environment, figures);
    }

    /// Forgets all, for a pass was cancelled: which of its paths were counted depends on the threads.
    pub(super) fn begin_again(&mut self, learning: Option<Learning>, figures: &mut Figures) {
        (self.learned, self.learning) = (None, learning);
        (figures.learning_paths, figures.distribution_paths) = (0, 0);
        (figures.visited_cells, figures.learned_cells, figures.grid_bytes) = (0, 0, 0);
    }

    /// Makes distributions of what all passes so far counted: the next pass draws from them.
    pub(super) fn update(&mut self, environment: &Environment, figures: &mut Figures) {
        let Some(learning) = &mut self.learning else { return };
        let start = Instant::now();
        learning.end_pass();
        figures.distribution_paths = figures.learning_paths + figures.counted_paths;
        // The old distributions go first: both together would not fit the budget.
        self.learned = None;
        self.learned = learning.grid.distributions(environment);
        let counters = &learning.grid.counters;
        let distributions = self.learned.as_ref().map_or(0, LightGrid::memory_bytes);
        figures.grid_bytes = counters.memory_bytes() + distributions;
        figures.grid_peak_bytes = figures.grid_peak_bytes.max(figures.grid_bytes);
        figures.visited_cells = counters.visited_cells();
        figures.learned_cells =
            self.learned.as_ref().map_or(0, |grid| grid.distributions().len() as usize - 1);
        figures.distribution_seconds += start.elapsed().as_secs_f64();
    }

    /// Makes room in the counters for a pass of so many samples a pixel; returns of how many one
    /// can be counted.
    pub(super) fn prepare_counting(&mut self, view: &View, samples: u32) -> u32 {
        let most = cpu::most_paths_per_pass(view);
        let paths = view.pixels() * u64::from(samples);
        let stride = paths.div_ceil(most).max(1);
        if let Some(learning) = self.learning.as_mut().filter(|l| l.stage != Stage::Over)
            && learning.paths_of_pass + paths.div_ceil(stride) > most
        {
            learning.end_pass();
        }
        u32::try_from(stride).unwrap_or(u32::MAX)
    }

    /// Takes note that so many rendered paths were counted; whether there are new distributions. There are of twice
    /// as many paths as those in use were made of, where each pixel has a power of two of samples: the points of the
    /// sequences that then end and begin are evenly spread.
    pub(super) fn note_rendered(
        &mut self,
        paths: u64,
        whole_samples: Option<u32>,
        environment: &Environment,
        figures: &mut Figures,
    ) -> bool {
        let Some(learning) = self.learning.as_mut().filter(|l| l.stage != Stage::Over) else {
            return false;
        };
        figures.counted_paths += paths;
        learning.paths_of_pass += paths;
        let all = figures.learning_paths + figures.counted_paths;
        let Some(samples) = whole_samples.filter(|samples| samples.is_power_of_two()) else {
            return false;
        };
        if all >= ENOUGH_PATHS || samples >= LAST_LEARNING_SAMPLE {
            learning.stage = Stage::Over;
        }
        let is_due = all >= 2 * figures.distribution_paths;
        if is_due {
            self.update(environment, figures);
        }
        is_due
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use glam::Vec3;

    use super::*;
    use crate::environment::{EnvironmentOptions, sky};
    use crate::light_grid::DistributionOptions;
    use crate::render::gi::tests::view;
    use crate::render::{Phase, Session};
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
            let session = Session::on((&world, &environment), view.clone(), Some(&uploaded));
            let mut session = session.expect("it fits");
            while !rule.is_met(&session) {
                let seconds = seconds[usize::from(session.samples() > 2)];
                session.state.here = Spent { seconds, samples: 2000 };
                let samples = rule.next_pass(&session);
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
