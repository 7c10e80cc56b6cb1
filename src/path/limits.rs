//! When paths end that could go on: the most vertices, and Russian roulette.

use super::{Path, PathTracer};
use crate::bvh::Ray;
use crate::sampler::Sampler;

/// What bounds a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PathLimits {
    /// Most vertices, on surfaces or in a medium, that scatter light; 1 is direct light only, 0 sees emitters
    /// and the environment alone. Perfect mirrors and smooth glass scatter none.
    pub bounces: u32,
    /// Whether dim paths are ended at random.
    pub russian_roulette: bool,
}

impl Default for PathLimits {
    /// 32 vertices: in the built-in rooms 8 leave out 1 to 2 % of the light, and 32 take 4 % more CPU time.
    fn default() -> Self {
        Self { bounces: 32, russian_roulette: true }
    }
}

impl PathLimits {
    /// Most [`Self::bounces`] that may be asked for.
    pub const MAX_BOUNCES: u32 = 100_000;
}

/// Vertices after which Russian roulette may end a path.
pub(crate) const ROULETTE_AFTER: u32 = 3;
/// A path that carries less than one over this is ended in proportion: ending it as soon as it carries
/// less than 1 saves a third of the rays of an office and doubles its error.
pub(crate) const ROULETTE_MILDNESS: f32 = 3.0;

/// Least probability of surviving it: a path that carries little is not made to count for too much.
pub(crate) const MIN_SURVIVAL: f32 = 0.05;

/// Most perfect reflections and refractions in a row; only light that is caught in a solid has more.
pub(crate) const MAX_INTERFACES: u32 = 64;

/// What a path still carries where a limit ends it: its throughput's largest component, 0 for a limit that has not
/// ended it. The mean over paths is the share of light that a picture lacks, where all places are as bright.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct CutOff {
    /// After [`PathLimits::bounces`].
    pub(crate) by_bounces: f32,
    /// After [`MAX_INTERFACES`].
    pub(crate) by_interfaces: f32,
}

impl PathTracer<'_> {
    /// What limits take of a camera path.
    pub(crate) fn cut_off(&self, ray: Ray, sampler: Sampler) -> CutOff {
        let mut path = Path::new(self, ray, sampler);
        let mut own_bsdf = None;
        while let Some(vertex) = path.next_vertex(&mut own_bsdf) {
            let carried = path.throughput.max_element();
            if !path.counts_vertex() {
                return CutOff { by_bounces: carried, by_interfaces: 0.0 };
            }
            if !path.scatter(&vertex) || !path.survives() {
                return CutOff::default();
            }
        }
        let is_caught = path.interfaces > MAX_INTERFACES;
        let by_interfaces = if is_caught { path.throughput.max_element() } else { 0.0 };
        CutOff { by_bounces: 0.0, by_interfaces }
    }
}

impl Path<'_> {
    /// Counts a vertex; `false` if the path may have no more of them.
    pub(super) fn counts_vertex(&mut self) -> bool {
        if self.bounces == self.tracer.limits.bounces {
            return false;
        }
        self.bounces += 1;
        self.interfaces = 0;
        true
    }

    /// Russian roulette.
    pub(super) fn survives(&mut self) -> bool {
        let Some(probability) = self.survival() else { return false };
        self.throughput /= probability;
        true
    }

    /// With which probability the path has survived; `None` if it has not. By throughput, as it would
    /// be in air: refraction into a body is no loss.
    pub(super) fn survival(&mut self) -> Option<f32> {
        let is_young = self.bounces + self.interfaces < ROULETTE_AFTER;
        if !self.tracer.limits.russian_roulette || is_young {
            return Some(1.0);
        }
        let in_air = self.throughput.max_element() * self.body.squared_index;
        let carried = self.throughput_before * in_air;
        let probability = (ROULETTE_MILDNESS * carried).clamp(MIN_SURVIVAL, 1.0);
        let survives = probability >= 1.0 || self.sampler.next_pair()[1] < probability;
        survives.then_some(probability)
    }
}
