//! What one job leaves for the next.

use std::f32::consts::TAU;
use std::sync::Arc;

use super::request::Request;
use super::snapshot::Point;
use crate::environment::Environment;
use crate::error::Result;
use crate::light_grid::{LearningGrid, LightGrid};
use crate::path::{Lit, World};
use crate::render::cached_picture::CachedPicture;
use crate::render::light_groups::LightFactors;
use crate::render::{CacheTraining, Session, SessionState};

/// What one job leaves for the next.
#[derive(Default)]
pub(super) struct SessionCache {
    pub(super) learned: Option<Learned>,
    /// What was counted, if it came to its end, and what for.
    pub(super) counted: Option<(Arc<LearningGrid>, Arc<Request>)>,
    /// Seconds one camera path takes on the CPU, all threads together, and on the GPU.
    pub(super) seconds_per_path: [Option<f64>; 2],
    /// By what the last moving picture's sides were divided.
    pub(super) shrink: Option<u32>,
    pub(super) snapshots: u64,
    /// What paths have trained the radiance cache, and where.
    pub(super) training: Option<(CacheTraining, Arc<Request>)>,
    /// A map as it was lit by a mix last: what it was made from, and the factor on its sun.
    lit: Option<(Environment, f32, Environment)>,
    /// A map as a mix has parted it last, and what it was made from.
    parts: Option<(Environment, [Environment; 2])>,
    /// Pictures that were left for others, oldest first.
    pub(super) left: Vec<SuspendedPicture>,
}

/// A picture that was left for another one: whoever comes back to it finds it as it was.
pub(super) struct SuspendedPicture {
    pub(super) request: Arc<Request>,
    /// One, or of a light mix one for each group.
    pub(super) sessions: Vec<SuspendedSession>,
    /// What learning had counted, for inspection.
    pub(super) counters: Option<Arc<LearningGrid>>,
    /// How its error fell.
    pub(super) curve: Vec<Point>,
    /// Seconds that a picture by cached light took beside it.
    pub(super) cached_seconds: f64,
}

/// A session that was put aside, and the one by cached light beside it.
pub(super) struct SuspendedSession {
    session: SessionState,
    cached: Option<CachedPicture<SessionState>>,
}

impl SuspendedSession {
    pub(super) fn of(main: Session<'_>, cached: Option<CachedPicture<Session<'_>>>) -> Self {
        let cached = cached.map(|cached| cached.map(Session::suspend));
        Self { session: main.suspend(), cached }
    }

    /// Goes on in the same world under the same map.
    pub(super) fn resume(self, lit: Lit<'_>) -> (Session<'_>, Option<CachedPicture<Session<'_>>>) {
        let resume = |state| Session::resume(lit, state);
        (resume(self.session), self.cached.map(|cached| cached.map(resume)))
    }

    fn memory_bytes(&self) -> usize {
        let cached = self.cached.as_ref().map(|cached| cached.session.memory_bytes());
        self.session.memory_bytes() + cached.unwrap_or(0)
    }
}

impl SuspendedPicture {
    fn memory_bytes(&self) -> usize {
        self.sessions.iter().map(SuspendedSession::memory_bytes).sum()
    }

    /// Bytes of its map, unless that is the one in use.
    fn map_bytes(&self, in_use: &Environment) -> usize {
        let map = &self.request.environment;
        let bytes = map.memory_bytes();
        if map.shares_map_with(in_use) { 0 } else { bytes.pixels + bytes.table }
    }
}

/// Pictures that were left are kept for one step back and forth.
const MAX_LEFT: usize = 2;
/// As long as they take no more than this together, with maps that are no longer in use.
const MAX_LEFT_BYTES: usize = 512 << 20;
/// And have taken at least so long: others are soon made again.
const MIN_LEFT_SECONDS: f64 = 1.0;

/// The last distributions that learning ended with.
pub(super) struct Learned {
    pub(super) grid: Arc<LightGrid>,
    /// The map they are for, and the world they were learned in.
    pub(super) environment: Arc<Environment>,
    pub(super) world: Arc<World>,
    /// Whether learning came to its end.
    pub(super) is_complete: bool,
}

impl SessionCache {
    /// Keeps a picture that has taken long, if there is room for it; if need be without the one by cached light.
    pub(super) fn leave(&mut self, mut left: SuspendedPicture) {
        if left.memory_bytes() > MAX_LEFT_BYTES {
            left.sessions.iter_mut().for_each(|it| it.cached = None);
        }
        let seconds = left.sessions.iter().map(|it| it.session.elapsed_seconds()).sum::<f64>();
        let is_long = seconds + left.cached_seconds >= MIN_LEFT_SECONDS;
        if is_long && left.memory_bytes() <= MAX_LEFT_BYTES {
            self.left.push(left);
        }
    }

    /// The picture that was left of the very same.
    pub(super) fn come_back(&mut self, request: &Request) -> Option<SuspendedPicture> {
        let found = self.left.iter().position(|left| left.request.is_resumed_by(request))?;
        Some(self.left.remove(found))
    }

    /// Lets go of all that is of another scene, which is large, and of the oldest pictures that were left if all take
    /// too much. What is seen from where stays right when
    /// surfaces get another colour; what they look like does not.
    pub(super) fn leave_other_worlds(&mut self, request: &Request) {
        let world = &request.world;
        if request.mix.is_none() {
            (self.lit, self.parts) = (None, None);
        }
        let is_other = |of: &Request| !Arc::ptr_eq(&of.world, world);
        self.training.take_if(|(_, of)| is_other(of));
        self.left.retain(|left| !is_other(&left.request));
        let map = &request.environment;
        let bytes = |left: &SuspendedPicture| left.memory_bytes() + left.map_bytes(map);
        while self.left.len() > MAX_LEFT
            || self.left.iter().map(bytes).sum::<usize>() > MAX_LEFT_BYTES
        {
            self.left.remove(0);
        }
        self.counted.take_if(|(_, of)| !of.world.has_same_visibility(world));
        if let Some((_, of)) = self.counted.as_mut().filter(|(_, of)| is_other(of)) {
            *of = Arc::new(Request { world: Arc::clone(world), ..(**of).clone() });
        }
        self.learned.take_if(|learned| !learned.world.has_same_visibility(world));
        self.learned.iter_mut().for_each(|learned| learned.world = Arc::clone(world));
    }

    /// A map of factors 1 as those of a mix make it.
    ///
    /// # Errors
    /// If there is no memory for it.
    pub(super) fn lit_by(&mut self, map: &Environment, mix: &LightFactors) -> Result<Environment> {
        let sun = mix.sun;
        self.lit.take_if(|(of, factor, _)| !of.shares_map_with(map) || *factor != sun);
        let (_, _, lit) = match self.lit.take() {
            Some(lit) => self.lit.insert(lit),
            None if sun == 1.0 => self.lit.insert((map.clone(), sun, map.clone())),
            None => self.lit.insert((map.clone(), sun, map.with_sun(sun)?)),
        };
        let mut lit = turned(lit, map);
        lit.set_intensity(mix.intensity);
        Ok(lit)
    }

    /// A map without its sun, and with nothing else.
    ///
    /// # Errors
    /// If there is no memory for them.
    pub(super) fn parted(&mut self, map: &Environment) -> Result<[Environment; 2]> {
        self.parts.take_if(|(of, _)| !of.shares_map_with(map));
        let (_, parts) = match self.parts.take() {
            Some(parts) => self.parts.insert(parts),
            None => self.parts.insert((map.clone(), map.parted()?)),
        };
        Ok(parts.each_ref().map(|part| turned(part, map)))
    }

    /// Whether the radiance cache was trained in this scene with this light, near by.
    pub(super) fn has_training_for(&self, request: &Request) -> bool {
        let position = request.view.camera.world_from_camera.translation.into();
        self.training
            .as_ref()
            .filter(|(_, of)| Arc::ptr_eq(&of.world, &request.world))
            .is_some_and(|(training, of)| of.is_lit_like(request) && training.suits(position))
    }

    /// Distributions for this request from the last ones, if they are of the same scene.
    pub(super) fn distributions_for(&self, request: &Request) -> Option<Arc<LightGrid>> {
        let Learned { grid: distributions, environment: map, .. } = self.learned_in(request)?;
        let now = &request.environment;
        let first = |map: &Environment| map.direction_in_tile(0, glam::Vec2::ZERO);
        if map.tile_energies() == now.tile_energies() && first(map) == first(now) {
            return Some(Arc::clone(distributions));
        }
        distributions.transferred(map, now).map(Arc::new)
    }

    /// What was counted in this scene with this light.
    pub(super) fn counted_for(&self, request: &Request) -> Option<Arc<LearningGrid>> {
        let (counted, of) = self.counted.as_ref()?;
        of.is_lit_like(request).then(|| Arc::clone(counted))
    }

    /// The last distributions, if they are of this scene.
    pub(super) fn learned_in(&self, request: &Request) -> Option<&Learned> {
        self.learned.as_ref().filter(|learned| Arc::ptr_eq(&learned.world, &request.world))
    }
}

/// A map turned as another one is.
fn turned(map: &Environment, like: &Environment) -> Environment {
    let mut turned = map.clone();
    turned.set_rotation(like.rotation_and_intensity().0 * TAU);
    turned
}

#[cfg(test)]
mod tests {
    use glam::Vec3A;

    use super::*;
    use crate::app::worker::tests::request;
    use crate::environment::{EnvironmentOptions, sky};
    use crate::render::{Gi, View};
    use crate::scene::{Medium, builtin};

    fn lit(sky_name: &str) -> Arc<Environment> {
        let map = sky::build(sky_name, 64, 32).expect("a sky");
        Arc::new(Environment::new(map, &EnvironmentOptions::default()).expect("a sound map"))
    }

    #[test]
    fn the_radiance_cache_is_kept_for_the_same_light_on_the_same_scene_near_by() {
        let world = Arc::new(World::new(builtin::build("office").expect("built in")));
        let request = request(Arc::clone(&world), lit("overcast"), [16, 9]);
        let view = View { gi: Gi::Cached, ..request.view.clone() };
        let request = Request { view, wants_cached: true, ..request };
        let mut kept = SessionCache::default();
        let mut session = Session::new(&world, &request.environment, request.view.clone());
        let training = session.take_training();
        kept.training = training.map(|training| (training, Arc::new(request.clone())));
        let serves = |change: &dyn Fn(&mut Request)| {
            let mut other = request.clone();
            change(&mut other);
            kept.has_training_for(&other)
        };
        let moved = |metres: f32| {
            move |request: &mut Request| {
                let eye = &mut request.view.camera.world_from_camera.translation;
                *eye += Vec3A::new(0.0, metres, 0.0);
            }
        };
        assert!(serves(&|_| ()));
        assert!(serves(&moved(0.2)), "a step aside");
        assert!(serves(&|request| (request.view.width, request.view.seed) = (32, 7)));
        assert!(!serves(&moved(20.0)), "its cells would have other sizes");
        assert!(
            !serves(&|request| request.environment = lit("day")),
            "another map, or a turned one"
        );
        let fog = Some(Medium { scattering: glam::Vec3::ONE, ..Medium::default() });
        assert!(!serves(&|request| request.view.medium = fog));
        assert!(!serves(&|request| request.view.limits.bounces += 1));
        // A changed material makes the world anew.
        let changed = Arc::new(World::new(world.scene.clone()));
        assert!(!serves(&|request| request.world = Arc::clone(&changed)));

        let other = Request { world: changed, ..request.clone() };
        kept.leave_other_worlds(&other);
        assert!(!kept.has_training_for(&request), "it is large, and nobody will want it");
    }
}
