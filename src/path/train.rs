//! Training paths: what surfaces send back, for the radiance cache.

use glam::Vec3;

use super::limits::PathLimits;
use super::splitting::UseOfVertices;
use super::tracer::{Path, PathTracer};
use super::vertex::Vertex;
use crate::bvh::Ray;
use crate::color::luminance;
use crate::radiance_cache::{RadianceCache, RadianceSums};
use crate::sampler::Sampler;

/// First vertices of a path that train the radiance cache.
pub(crate) const TRAINING_VERTICES: u32 = 3;
/// An estimate so many times as bright as what is known of its cell counts as if it were just that: one
/// path in a million would make a cell shine. Less costs light (1 % at 64, 5 % at 16, of a living room
/// at sunset).
pub(crate) const MAX_TIMES: f32 = 128.0;
/// A path that carries less of one channel than this share of the largest says too little about it.
pub(crate) const MIN_SHARE: f32 = 1e-3;

/// A vertex of a path that has not yet brought back all that the cache is to learn from it.
struct TrainingVertex {
    vertex: u32,
    position: Vec3,
    normal: Vec3,
    albedo: Vec3,
    /// What the path carried there, and what it had brought back before.
    throughput: Vec3,
    radiance_before: Vec3,
}

impl PathTracer<'_> {
    /// Traces one camera path and adds to `sums` what it has found at its first vertices, after so many
    /// vertices as a path has that arrives there second. What [`PathTracer::cache`] knows by now bounds
    /// it. Returns the number of rays.
    pub(crate) fn train(&self, ray: Ray, sampler: Sampler, sums: &RadianceSums) -> u32 {
        let Some(window) = self.limits.bounces.checked_sub(1) else { return 0 };
        let limits = PathLimits { bounces: window + TRAINING_VERTICES - 1, ..self.limits };
        let tracer = PathTracer { limits, cache: None, counts: None, ..*self };
        let mut path = Path::new(&tracer, ray, sampler);
        path.use_of_vertices = UseOfVertices::Training(TRAINING_VERTICES);
        let mut vertices = Vec::<TrainingVertex>::with_capacity(TRAINING_VERTICES as usize);
        let mut own_bsdf = None;
        while let Some(vertex) = path.next_vertex(&mut own_bsdf) {
            let arrived = path.bounces;
            for done in vertices.extract_if(.., |trained| arrived == trained.vertex + window) {
                done.train(&path, sums, self.cache);
            }
            vertices.extend(TrainingVertex::new(&path, &vertex));
            if !path.visit(&vertex) {
                break;
            }
        }
        vertices.iter().for_each(|trained| trained.train(&path, sums, self.cache));
        path.rays
    }
}

impl TrainingVertex {
    fn new(path: &Path<'_>, vertex: &Vertex<'_>) -> Option<Self> {
        let surface = vertex.scatterer.surface()?;
        let throughput = path.throughput;
        let trains = path.bounces < TRAINING_VERTICES
            && path.is_in_air()
            && surface.is_cacheable()
            && throughput.min_element() > MIN_SHARE * throughput.max_element();
        // Parts of BSDFs have weights, which would bring their albedo above 1.
        let weight = surface.bsdf().weight();
        trains.then(|| Self {
            vertex: path.bounces,
            position: vertex.position,
            normal: surface.sides.geometric_normal,
            albedo: surface.bsdf.albedo() / weight,
            throughput: throughput * weight,
            radiance_before: path.radiance,
        })
    }

    fn train(&self, path: &Path<'_>, sums: &RadianceSums, known: Option<&RadianceCache>) {
        let radiance = (path.radiance - self.radiance_before) / self.throughput;
        let times = known.map_or(1.0, |cache| {
            let known = cache.radiance_over_albedo(self.position, self.normal) * self.albedo;
            let most = MAX_TIMES * luminance(known);
            // Where nothing was found, nothing is known.
            if most > 0.0 { (most / luminance(radiance)).min(1.0) } else { 1.0 }
        });
        sums.add(self.position, self.normal, radiance * times, self.albedo);
    }
}
