//! Where a path may end: in what the radiance cache knows of a surface.

use super::Path;
use super::vertex::{Scatterer, SurfaceScatterer, Vertex};

/// Least GGX alpha of a surface that sends back much the same to all sides.
pub(crate) const MIN_ALPHA: f32 = 0.05;

impl SurfaceScatterer<'_> {
    /// Whether what it sends back may be kept in a cache.
    pub(super) fn is_cacheable(&self) -> bool {
        !self.transmits && self.bsdf().is_broad(MIN_ALPHA)
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
        self.widen(vertex);
        let Scatterer::Surface(surface) = &vertex.scatterer else { return false };
        let is_known = self.spread >= cache.cells().edge_at(vertex.position)
            && self.is_in_air()
            && surface.is_cacheable();
        if is_known {
            let radiance =
                cache.radiance_over_albedo(vertex.position, surface.sides.geometric_normal);
            self.radiance += self.throughput * surface.bsdf().albedo() * radiance;
        }
        is_known
    }

    /// Spreads the path over the way to where it has arrived, if anybody asks.
    pub(super) fn widen(&mut self, vertex: &Vertex<'_>) {
        if self.tracer.cache.is_none() || self.bounces == 0 {
            return;
        }
        if let Scatterer::Surface(surface) = &vertex.scatterer {
            let cosine = surface.sides.geometric_normal.dot(self.ray.direction).abs();
            // Of perfect reflections the density is infinite.
            self.spread += self.travelled / (self.departure.pdf_solid_angle * cosine).sqrt();
        }
    }
}
