//! What a session has of its own: without the world and the map, which it borrows, and without a GPU. It can be put
//! aside, and gone on with.

use std::sync::Mutex;

use super::host_film::HostFilm;
use super::learning::Learning;
use super::{Doubling, Session};
use crate::environment::Environment;
use crate::light_grid::LightGrid;
use crate::path::World;
use crate::path::camera::CameraRays;
#[cfg(feature = "window")]
use crate::radiance_cache::CacheFacts;
use crate::render::film::Film;
use crate::render::gi::CacheTraining;
use crate::render::{Figures, View};
use crate::sampler::Sequence;

/// All that a [`Session`] has of its own.
pub(crate) struct SessionState {
    pub(super) view: View,
    pub(super) rays: CameraRays,
    pub(super) film: HostFilm,
    /// Fewest samples of any pixel.
    pub(super) samples: u32,
    /// So many first samples of each pixel are others'.
    pub(super) skipped: u32,
    /// The film with half its samples.
    pub(super) doubling: Mutex<Doubling>,
    pub(super) whole_map: Option<LightGrid>,
    pub(super) learned: Option<LightGrid>,
    pub(super) sequence: Sequence,
    /// `None` if nothing is to be learned, or everything has been by others.
    pub(super) learning: Option<Learning>,
    pub(super) training: Option<CacheTraining>,
    pub(super) figures: Figures,
    pub(super) here: Spent,
}

/// What rendering on the device at work took.
#[derive(Clone, Copy, Default)]
pub(super) struct Spent {
    pub(super) seconds: f64,
    /// In all pixels together.
    pub(super) samples: u64,
}

#[cfg(feature = "window")]
impl<'a> Session<'a> {
    /// [`Session::elapsed_seconds`] as if all samples had been taken on the device at work: another may be tens of
    /// times as fast. `None` while it is not known what they take there: until each pixel has had two, or so.
    pub(crate) fn comparable_seconds(&self) -> Option<f64> {
        let Figures { samples, render_seconds, learning_seconds, .. } = self.state.figures;
        let rendering = match self.state.here.samples {
            here if here >= samples => Some(render_seconds),
            here if here < 2 * self.state.view.pixels() => None,
            _ => self.seconds_per_sample().map(|seconds| seconds * samples as f64),
        };
        rendering.map(|seconds| learning_seconds + seconds)
    }

    /// Puts it aside, with what a GPU has as far as it can still be read.
    pub(crate) fn suspend(mut self) -> SessionState {
        self.continue_on_cpu();
        self.film();
        self.state
    }

    /// Goes on, on the CPU, with what was put aside, in the same world under the same map. A radiance cache that was
    /// [taken](Self::take_training) is trained anew.
    pub(crate) fn resume(
        world: &'a World,
        environment: &'a Environment,
        mut state: SessionState,
    ) -> Self {
        if state.training.is_none() {
            state.training = CacheTraining::new(world, environment, &state.view, &state.rays);
        }
        Self { world, environment, gpu: None, state }
    }
}

#[cfg(feature = "window")]
impl SessionState {
    /// The film; it was read when the session was put aside.
    pub(crate) fn film(&self) -> Option<&Film> {
        self.film.known()
    }

    /// The film alone.
    pub(crate) fn into_film(mut self) -> Film {
        self.film.take(&self.view)
    }

    /// Seconds of learning and rendering.
    pub(crate) fn elapsed_seconds(&self) -> f64 {
        self.figures.elapsed_seconds()
    }

    /// Bytes of film, distributions, counters and radiance cache.
    pub(crate) fn memory_bytes(&self) -> usize {
        let grid = self.learned.as_ref().map_or(0, LightGrid::memory_bytes);
        let counters = self.learning.as_ref().map_or(0, |l| l.grid.counters.memory_bytes());
        let cache = self.training.as_ref().map_or(0, |_| CacheFacts::memory_bytes());
        self.film().map_or(0, Film::memory_bytes) + grid + counters + cache
    }
}

#[cfg(all(test, feature = "window"))]
mod tests {
    use std::sync::atomic::AtomicBool;

    use super::*;
    use crate::environment::{EnvironmentOptions, sky};
    use crate::render::{Gi, Sampling};
    use crate::scene::builtin;

    fn lit() -> (World, Environment) {
        let world = World::new(builtin::build("crack").expect("built in"));
        let map = sky::build("day", 64, 32).expect("a sky");
        let environment = Environment::new(map, &EnvironmentOptions::default());
        (world, environment.expect("a sound map"))
    }

    #[test]
    fn samples_of_another_device_count_as_if_they_were_of_this_one() {
        let (world, environment) = lit();
        let view = View::new(world.scene.cameras[0].clone(), [24, 16]);
        let mut session = Session::new(&world, &environment, view);
        session.state.figures.learning_seconds = 0.5;
        session.spend(10.0, 2000);
        session.state.figures.samples = 2000;
        assert_eq!(session.comparable_seconds(), Some(10.5), "all are of this one");
        session.state.here = Spent::default();
        assert_eq!(session.comparable_seconds(), None);
        session.spend(1.0, 4000);
        session.state.figures.samples = 6000;
        assert_eq!(session.comparable_seconds(), Some(2.0));
        assert_eq!(session.elapsed_seconds(), 11.5);
    }

    #[test]
    fn a_radiance_cache_that_others_have_taken_is_trained_anew() {
        let (world, environment) = lit();
        let camera = world.scene.cameras[0].clone();
        let view = View { gi: Gi::Cached, ..View::new(camera, [24, 16]) };
        let mut session = Session::new(&world, &environment, view);
        let goes_on = AtomicBool::new(false);
        session.finish_learning();
        for _ in 0..3 {
            session.advance(1, &goes_on).expect("the CPU does not fail");
        }
        let before = session.take_training().expect("it was trained").state().0;
        let mut session = Session::resume(&world, &environment, session.suspend());
        session.advance(1, &goes_on).expect("the CPU does not fail");
        let after = session.training().expect("it is trained").state().0;
        assert!(after >= before, "{after} paths in place of {before}");
    }

    #[test]
    fn what_was_put_aside_goes_on_to_the_same_picture() {
        let (world, environment) = lit();
        for sampling in [Sampling::Adaptive, Sampling::Talk, Sampling::Plain] {
            let view = View {
                sampling,
                learning_paths: 4096,
                ..View::new(world.scene.cameras[0].clone(), [24, 16])
            };
            let render = |is_put_aside: bool| {
                let mut session = Session::new(&world, &environment, view.clone());
                while session.samples() < 7 {
                    session.advance(1, &AtomicBool::new(false)).expect("the CPU does not fail");
                    if is_put_aside {
                        session = Session::resume(&world, &environment, session.suspend());
                    }
                }
                session.film().clone()
            };
            assert!(render(true) == render(false), "{sampling:?}");
        }
    }
}
