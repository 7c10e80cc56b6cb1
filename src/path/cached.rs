//! Where a path may end: in what the radiance cache knows of a surface.

use glam::Vec3;

use super::splitting::MIN_CACHED_ALPHA;
use super::tracer::Path;
use super::vertex::{Scatterer, SurfaceScatterer, Vertex};
use crate::radiance_cache::RadianceCache;

impl SurfaceScatterer<'_> {
    /// Whether what it sends back may be kept in a cache.
    pub(super) fn is_cacheable(&self) -> bool {
        !self.transmits && self.bsdf().is_broad(MIN_CACHED_ALPHA)
    }
}

impl Path<'_> {
    /// Ends the path at a vertex after its first if there is a cache, and what the path would find from
    /// there is averaged over more than a cell: light that is added is what the cache knows.
    ///
    /// How wide a path spreads is the root of the area over which one sample stands, summed over its
    /// rays (Müller et al., *Real-time Neural Radiance Caching for Path Tracing*, SIGGRAPH 2021). So
    /// reflections are followed, and corners, where cells would show.
    pub(super) fn ends_in_cache(&mut self, vertex: &Vertex<'_>) -> bool {
        let Some(cache) = self.tracer.cache else { return false };
        if self.bounces == 0 || self.bounces == self.tracer.limits.bounces {
            return false;
        }
        let Scatterer::Surface(surface) = &vertex.scatterer else { return false };
        let (position, normal) = (vertex.position, surface.sides.geometric_normal);
        let is_known = self.is_known(position, normal) && surface.is_cacheable();
        self.widen(vertex);
        if is_known {
            let radiance = cache.radiance_over_albedo(position, normal);
            self.radiance += self.throughput * surface.bsdf.albedo() * radiance;
        }
        is_known
    }

    /// Whether the cache, if there is one, knows what the path would find from a surface that it has arrived at.
    pub(super) fn is_known(&self, position: Vec3, normal: Vec3) -> bool {
        let is_wide =
            |cache: &RadianceCache| spread_at(self, normal) >= cache.cells.edge_at(position);
        self.is_in_air() && self.tracer.cache.is_none_or(is_wide)
    }

    /// Spreads the path over the way to where it has arrived, if anybody asks.
    pub(super) fn widen(&mut self, vertex: &Vertex<'_>) {
        if self.tracer.cache.is_some()
            && self.bounces > 0
            && let Scatterer::Surface(surface) = &vertex.scatterer
        {
            self.spread = spread_at(self, surface.sides.geometric_normal);
        }
    }
}

/// How wide the path spreads where it has arrived, in metres, on a surface with this geometric normal.
fn spread_at(path: &Path<'_>, normal: Vec3) -> f32 {
    let cosine = normal.dot(path.ray.direction).abs();
    // Of perfect reflections the density is infinite.
    path.spread + path.travelled / (path.departure.pdf_solid_angle * cosine).sqrt()
}
