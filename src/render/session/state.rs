//! What a session has of its own: without the world and the map, which it borrows, and without a GPU. It can be put
//! aside, and gone on with.

use super::host_film::HostFilm;
use super::learning::Tiles;
use super::noise::Noise;
use crate::light_grid::LearningGrid;
use crate::path::{Lit, LocalLights, PathTracer};
#[cfg(feature = "window")]
use crate::radiance_cache::RadianceSums;
use crate::render::film::Film;
use crate::render::gi::CacheTraining;
use crate::render::{Figures, View};
use crate::sampler::Sequence;

/// All that a [`Session`](super::Session) has of its own.
pub(crate) struct SessionState {
    pub(super) view: View,
    /// The lights of the scene that count; `None` are all.
    pub(super) lights: Option<LocalLights>,
    pub(super) film: HostFilm,
    /// Fewest samples of any pixel.
    pub(super) samples: u32,
    /// So many first samples of each pixel are others'.
    pub(super) skipped: u32,
    /// The film with half its samples.
    pub(super) noise: Noise,
    pub(super) tiles: Tiles,
    pub(super) sequence: Sequence,
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

impl SessionState {
    /// What follows paths by the distributions in use, and counts them into `counts`.
    pub(super) fn tracer<'b>(
        &'b self,
        lit: Lit<'b>,
        counts: Option<&'b LearningGrid>,
    ) -> PathTracer<'b> {
        let cache = self.training.as_ref().and_then(CacheTraining::cache);
        let lights = self.lights.as_ref().unwrap_or(&lit.0.lights);
        PathTracer { lights, counts, cache, ..self.view.tracer(lit, self.tiles.grid()) }
    }

    /// The view, and the lights inside the scene that count; `None` are all.
    pub(super) fn asked(&self) -> (&View, Option<&LocalLights>) {
        (&self.view, self.lights.as_ref())
    }

    /// Notes seconds of rendering and the samples taken in them.
    pub(super) fn spend(&mut self, seconds: f64, samples: u64) {
        self.figures.render_seconds += seconds;
        self.here.seconds += seconds;
        self.here.samples += samples;
    }
}

impl Spent {
    /// Seconds of a sample; `None` until there are a thousand.
    pub(super) fn seconds_per_sample(self) -> Option<f64> {
        (self.samples > 1000).then(|| self.seconds / self.samples as f64)
    }
}

#[cfg(feature = "window")]
impl SessionState {
    /// The film; it was read when the session was put aside.
    pub(crate) fn film(&self) -> Option<&Film> {
        self.film.known()
    }

    /// Seconds of learning and rendering.
    pub(crate) fn elapsed_seconds(&self) -> f64 {
        self.figures.elapsed_seconds()
    }

    /// [`Self::elapsed_seconds`] as if all samples had been taken on the device at work: another may be tens of
    /// times as fast. `None` while it is not known what they take there: until each pixel has had two, or so.
    pub(super) fn comparable_seconds(&self) -> Option<f64> {
        let Figures { samples, render_seconds, learning_seconds, .. } = self.figures;
        let rendering = match self.here.samples {
            here if here >= samples => Some(render_seconds),
            here if here < 2 * self.view.pixels() => None,
            _ => self.here.seconds_per_sample().map(|seconds| seconds * samples as f64),
        };
        rendering.map(|seconds| learning_seconds + seconds)
    }

    /// Bytes of film, distributions, counters and radiance cache.
    pub(crate) fn memory_bytes(&self) -> usize {
        let cache = self.training.as_ref().map_or(0, |_| RadianceSums::memory_bytes());
        self.film().map_or(0, Film::memory_bytes) + self.tiles.memory_bytes() + cache
    }
}

#[cfg(all(test, feature = "window"))]
mod tests {
    use std::sync::atomic::AtomicBool;

    use super::*;
    use crate::environment::{Environment, EnvironmentOptions, sky};
    use crate::path::World;
    use crate::render::{Gi, Sampling, Session};
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
        session.state.spend(10.0, 2000);
        session.state.figures.samples = 2000;
        assert_eq!(session.comparable_seconds(), Some(10.5), "all are of this one");
        session.state.here = Spent::default();
        assert_eq!(session.comparable_seconds(), None);
        session.state.spend(1.0, 4000);
        session.state.figures.samples = 6000;
        assert_eq!(session.comparable_seconds(), Some(2.0));
        assert_eq!(session.figures().elapsed_seconds(), 11.5);
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
        let mut session = Session::resume((&world, &environment), session.suspend());
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
                        session = Session::resume((&world, &environment), session.suspend());
                    }
                }
                session.film().clone()
            };
            assert!(render(true) == render(false), "{sampling:?}");
        }
    }
}
