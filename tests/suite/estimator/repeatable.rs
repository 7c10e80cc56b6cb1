//! The same seed gives the same bits.

use std::sync::atomic::AtomicBool;

use glam::Vec2;
use lightgrid::environment::{Environment, sky};
use lightgrid::light_grid::cells::SphericalGrid;
use lightgrid::light_grid::{DistributionOptions, LearningGrid, LightGrid, MEMORY_BUDGET_BYTES};
use lightgrid::path::camera::CameraRays;
use lightgrid::path::{Background, PathLimits, PathTracer, World};
use lightgrid::render::film::Film;
use lightgrid::render::{Phase, SAMPLES_VERSION, Sampling, Session, Sharing, View};
use lightgrid::sampler::Sampler;
use lightgrid::scene::{Camera, builtin};
use rayon::prelude::*;

use super::scenes::{pane, room};
use super::{environment, learned, render, view};

struct Setting {
    world: World,
    camera: Camera,
    environment: Environment,
}

impl Setting {
    fn new() -> Self {
        let (world, camera) = room(0.6, Some(&pane()));
        Self { world, camera, environment: environment(sky::build("day", 128, 64).expect("a sky")) }
    }

    fn view(&self, sampling: Sampling) -> View {
        View {
            width: 33,
            height: 17,
            limits: PathLimits { bounces: 5, russian_roulette: true },
            ..view(self.camera.clone(), sampling, 5)
        }
    }

    fn session(&self, view: View) -> Session<'_> {
        learned(&self.world, &self.environment, view)
    }
}

fn with_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    pool.install(work)
}

/// Every probability of every cell's distribution.
fn distributions(grid: &LightGrid) -> Vec<(u32, Vec<u32>)> {
    let cells = grid.grid().map_or(0, |grid| grid.cell_count());
    let distributions = grid.distributions();
    let of_distribution = |distribution| -> Vec<u32> {
        (0..distributions.tile_count())
            .map(|tile| distributions.probability(distribution, tile).to_bits())
            .collect()
    };
    let used = (0..cells)
        .map(|cell| (cell, grid.distribution_of_cell(cell)))
        .filter(|(_, distribution)| *distribution > 0);
    used.map(|(cell, distribution)| (cell, of_distribution(distribution))).collect()
}

#[test]
fn film_and_distributions_do_not_depend_on_the_threads() {
    let setting = Setting::new();
    for sampling in [Sampling::Adaptive, Sampling::Talk] {
        let result = |threads| {
            with_threads(threads, || {
                // Few learning paths, so that rendered ones make new distributions.
                let view = View { learning_paths: 1 << 10, ..setting.view(sampling) };
                let mut session = setting.session(view);
                for _ in 0..20 {
                    session.advance(1, &AtomicBool::new(false)).expect("the CPU does not fail");
                }
                let distributions = distributions(session.grid().expect("a map with light"));
                (session.film().clone(), distributions, session.figures())
            })
        };
        let (film, distributions, figures) = result(1);
        assert!(figures.learned_cells > 50, "{figures:?}");
        assert_eq!(distributions.len(), figures.learned_cells);
        let by_rendered = figures.distribution_paths > figures.learning_paths;
        assert_eq!(by_rendered, sampling == Sampling::Adaptive, "{figures:?}");
        assert!(figures.grid_bytes <= MEMORY_BUDGET_BYTES, "{figures:?}");
        for threads in [2, 5] {
            let other = result(threads);
            assert!(film == other.0, "{sampling:?}: the film differs with {threads} threads");
            assert!(
                distributions == other.1,
                "{sampling:?}: the distributions differ with {threads} threads"
            );
            assert_eq!(figures.rays, other.2.rays);
            assert_eq!(figures.learning_rays, other.2.learning_rays);
        }
    }
}

#[test]
fn counters_do_not_depend_on_the_threads() {
    let setting = Setting::new();
    let view = setting.view(Sampling::Adaptive);
    let rays = CameraRays::new(&view.camera, view.width, view.height);
    let energies = setting.environment.tile_energies();
    let whole_map = LightGrid::whole_map(energies).expect("a map with light");
    let counted = |threads| {
        let grid = SphericalGrid {
            center: rays.position,
            columns: 64,
            rows: 32,
            faces: true,
            medium: false,
        };
        let mut learning = LearningGrid::new(
            grid,
            setting.environment.tile_count(),
            DistributionOptions::ADAPTIVE,
        );
        for pass in 0..3 {
            let tracer = PathTracer {
                world: &setting.world,
                environment: &setting.environment,
                lights: &setting.world.lights,
                grid: Some(&whole_map),
                counts: Some(&learning),
                cache: None,
                fog: None,
                background: Background::Map,
                limits: view.limits,
                layers: false,
            };
            with_threads(threads, || {
                (0..4096_u32).into_par_iter().for_each(|path| {
                    let mut sampler = Sampler::new(7, pass, path);
                    let [x, y] = sampler.next_pair();
                    let pixel = Vec2::new(x * view.width as f32, y * view.height as f32);
                    tracer.learn(rays.ray(pixel, Vec2::ZERO), sampler);
                });
            });
            learning.counters.end_pass();
        }
        let counters = learning.counters;
        let cells = counters.cells().iter().enumerate();
        let tallies = |slot| counters.tallies(slot).collect::<Vec<_>>();
        cells.map(|(slot, &cell)| (cell, tallies(slot))).collect::<Vec<_>>()
    };
    let expected = counted(1);
    assert!(expected.len() > 50);
    for threads in [2, 5] {
        assert_eq!(counted(threads), expected, "{threads} threads");
    }
}

#[test]
fn passes_may_be_cut_anywhere() {
    let setting = Setting::new();
    let film = |passes: &[u32]| -> Film {
        let mut session = setting.session(setting.view(Sampling::Adaptive));
        for &samples in passes {
            session.advance(samples, &AtomicBool::new(false)).expect("the CPU does not fail");
        }
        session.film().clone()
    };
    let whole = film(&[8]);
    assert_eq!(whole.min_samples(), 8);
    for passes in [&[1; 8][..], &[3, 5], &[7, 1]] {
        assert!(whole == film(passes), "passes of {passes:?}");
    }
}

#[test]
fn a_cancelled_pass_resumes_to_the_same_picture() {
    let setting = Setting::new();
    let whole = {
        let mut session = setting.session(setting.view(Sampling::Adaptive));
        session.advance(8, &AtomicBool::new(false)).expect("the CPU does not fail");
        session.film().clone()
    };
    let mut session = setting.session(setting.view(Sampling::Adaptive));
    session.advance(3, &AtomicBool::new(false)).expect("the CPU does not fail");
    // Cancelled somewhere in the middle, at the latest after the pass.
    let cancel = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            std::thread::sleep(std::time::Duration::from_millis(1));
            cancel.store(true, std::sync::atomic::Ordering::Relaxed);
        });
        session.advance(200, &cancel).expect("the CPU does not fail");
    });
    assert!(session.film().total_samples() < 203 * 33 * 17, "it was too fast to be cancelled");
    assert!(session.samples() >= 3, "what was done is kept");
    let mut reference = setting.session(setting.view(Sampling::Adaptive));
    while session.samples() < 203 {
        let missing = 203 - session.samples();
        session.advance(missing, &AtomicBool::new(false)).expect("the CPU does not fail");
    }
    reference.advance(203, &AtomicBool::new(false)).expect("the CPU does not fail");
    assert!(session.film() == reference.film(), "cancelled and resumed");
    assert!(whole != *reference.film(), "the comparison can fail");
}

#[test]
fn cancelled_learning_gives_the_same_distributions_in_the_end() {
    let setting = Setting::new();
    let view = setting.view(Sampling::Adaptive);
    let mut session = Session::new(&setting.world, &setting.environment, view.clone());
    session.advance(1, &AtomicBool::new(false)).expect("the CPU does not fail");
    session.advance(1, &AtomicBool::new(true)).expect("the CPU does not fail");
    assert_eq!(session.phase(), Phase::Learning);
    while session.phase() == Phase::Learning {
        session.advance(1, &AtomicBool::new(false)).expect("the CPU does not fail");
    }
    let other = setting.session(view);
    let of = |session: &Session<'_>| distributions(session.grid().expect("a map with light"));
    assert!(of(&session) == of(&other));
}

#[test]
fn another_seed_gives_another_picture() {
    let setting = Setting::new();
    let film = |seed| {
        let view = View { seed, ..setting.view(Sampling::Adaptive) };
        let mut session = setting.session(view);
        session.advance(2, &AtomicBool::new(false)).expect("the CPU does not fail");
        (session.film().clone(), distributions(session.grid().expect("a map with light")))
    };
    let (a, b) = (film(1), film(2));
    assert!(a.0 != b.0 && a.1 != b.1);
    let same = a.0.pixels().iter().zip(b.0.pixels()).filter(|(a, b)| a == b).count();
    assert!(same < a.0.pixels().len() / 10, "{same} pixels are the same");
}

/// The version that [`PICTURES`] are of.
const VERSION: u32 = 6;

/// Scene, sampling and sharing of small pictures, and what they come to: their mean, and how they are spread.
const PICTURES: [(&str, Sampling, Sharing, &str); 8] = [
    ("open", Sampling::Bsdf, Sharing::Off, "5.032e-1 13.372"),
    ("open", Sampling::Plain, Sharing::Off, "4.813e-1 14.424"),
    ("office", Sampling::Talk, Sharing::Off, "2.232e-2 16.926"),
    ("office", Sampling::Adaptive, Sharing::Off, "2.139e-2 17.106"),
    ("office", Sampling::Adaptive, Sharing::Large, "2.088e-2 17.135"),
    ("evening", Sampling::Adaptive, Sharing::Off, "1.834e-2 16.482"),
    ("fog", Sampling::Adaptive, Sharing::Small, "3.903e-2 15.196"),
    ("materials", Sampling::Adaptive, Sharing::Off, "2.129e-1 15.095"),
];

/// Digits that other processors of the same kind leave as they are; other samples change the third.
fn figures(film: &Film) -> String {
    let image = film.image();
    let values = || image.pixels.iter().flatten().map(|value| f64::from(*value));
    let sum: f64 = values().sum();
    let weighted = values().zip((0..31).cycle()).map(|(value, weight)| value * f64::from(weight));
    format!("{:.3e} {:.3}", sum / values().count() as f64, weighted.sum::<f64>() / sum)
}

/// Parts and checkpoints of two builds are joined where they say the same version of samples.
#[test]
fn other_samples_are_another_version() {
    if !cfg!(all(target_os = "linux", target_env = "gnu", target_arch = "x86_64")) {
        eprintln!("SKIPPED: the pictures are those of x86-64 Linux with the GNU C library");
        return;
    }
    let mut table = String::new();
    let mut is_changed = false;
    for (scene, sampling, sharing, expected) in PICTURES {
        let world = World::new(builtin::build(scene).expect("built in"));
        let name = builtin::sky(scene).trim_start_matches("sky:");
        let environment = environment(sky::build(name, 128, 64).expect("a sky"));
        let view = View {
            sampling,
            sharing,
            seed: 1,
            learning_paths: 1 << 10,
            ..View::new(world.scene.cameras[0].clone(), [32, 18])
        };
        let found = figures(&render(&world, &environment, view, 4));
        table +=
            &format!("    ({scene:?}, Sampling::{sampling:?}, Sharing::{sharing:?}, {found:?}),\n");
        is_changed |= found != expected;
    }
    assert!(
        !is_changed,
        "samples are others than those of version {VERSION}: raise SAMPLES_VERSION in src/render/mod.rs and \
         VERSION here to {}, and take these as PICTURES:\n{table}",
        VERSION + 1
    );
    assert_eq!(SAMPLES_VERSION, VERSION, "the pictures are those of version {VERSION}");
}
