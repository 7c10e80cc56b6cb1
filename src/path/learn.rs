//! Learning paths: what the map shows to the vertices of camera paths.

use glam::Vec3;

use super::tracer::{Path, PathTracer};
use super::vertex::{Scatterer, Vertex};
use crate::bvh::Ray;
use crate::color::{importance, luminance};
use crate::light_grid::LearningGrid;
use crate::sampler::Sampler;

/// First vertices of a path whose samples of the map count. Counters hold so many of a pass; the others, of which
/// there are few, would make passes short.
pub(crate) const MAX_COUNTED: u32 = 64;

impl PathTracer<'_> {
    /// Traces one camera path and counts at each vertex, in [`PathTracer::counts`], whether samples
    /// of the map are visible, drawn half from the whole map and half from what [`PathTracer::grid`]
    /// has learned so far: a tile's visibility ratio does not depend on how often it is tried.
    /// Returns the number of rays.
    pub fn learn(&self, ray: Ray, sampler: Sampler) -> u32 {
        let tries = self.counts.map_or(0, |learning| learning.options.tries_per_vertex);
        let mut path = Path::new(self, ray, sampler);
        let mut own_bsdf = None;
        while let Some(vertex) = path.next_vertex(&mut own_bsdf) {
            if !path.counts_vertex() {
                break;
            }
            if vertex.cell.is_some() && path.bounces <= MAX_COUNTED {
                for number in 0..tries {
                    let bits = path.sampler.of_estimate(tries, number).next_pair_bits();
                    path.look_at_map(&vertex, bits);
                }
                path.sampler.skip(1);
            }
            if !path.scatter(&vertex) || !path.survives() {
                break;
            }
        }
        path.rays
    }
}

impl Path<'_> {
    /// Where this vertex counts, if it does.
    fn counts(&self) -> Option<&LearningGrid> {
        self.tracer.counts.filter(|_| self.bounces <= MAX_COUNTED)
    }

    /// Says that a try of a tile will be counted once its shadow ray is traced.
    pub(super) fn expect_count(&self, vertex: &Vertex<'_>, tile: u32) {
        if let (Some(learning), Some(cell)) = (self.counts(), vertex.cell) {
            learning.counters.prefetch(cell, tile);
        }
    }

    /// Counts a try of a tile of the map, if anything is counted.
    pub(super) fn count(&self, vertex: &Vertex<'_>, tile: u32, weight: f32) {
        if let (Some(learning), Some(cell)) = (self.counts(), vertex.cell) {
            learning.counters.record(cell, tile, weight);
        }
    }

    /// What a try that met no obstacle but `transmittance` counts: how much of the light is seen,
    /// times a power of what the surface or the phase function makes of its direction.
    pub(super) fn visibility(
        &self,
        vertex: &Vertex<'_>,
        direction: Vec3,
        own_pdf: f32,
        transmittance: Vec3,
    ) -> f32 {
        let Some(learning) = self.tracer.counts else { return 0.0 };
        let share = match &vertex.scatterer {
            Scatterer::Surface(surface) => surface.shading_frame.z.dot(direction).abs(),
            // What the cosine is to a surface: the phase function over that of even scattering.
            Scatterer::Medium(_) => 4.0 * std::f32::consts::PI * own_pdf,
        };
        luminance(transmittance) * share.powi(learning.options.recording.cosine_power())
    }

    /// Samples the map to see what is visible of it.
    fn look_at_map(&mut self, vertex: &Vertex<'_>, bits: [u32; 2]) {
        let (Some(grid), Some(learning)) = (self.tracer.grid, self.tracer.counts) else { return };
        let is_ratio = learning.options.recording.is_ratio();
        let whole_map_share = if is_ratio { 128 } else { 256 };
        let choice = grid.sample_sharing(vertex.distribution, bits, whole_map_share);
        self.expect_count(vertex, choice.tile);
        let u = [choice.remainder, bits[1]];
        let Some(sample) = self.tracer.environment.sample_in_tile(choice.tile, u) else { return };
        let weight = match vertex.scatterer.scattered(sample.direction) {
            None => 0.0,
            Some((f, own_pdf)) => {
                let (transmittance, _) = self.share_of_map(vertex, sample.direction);
                if is_ratio {
                    self.visibility(vertex, sample.direction, own_pdf, transmittance)
                } else {
                    let pdf = choice.probability * sample.pdf_solid_angle;
                    let mean =
                        std::f32::consts::PI * importance(self.tracer.environment.mean_radiance());
                    let radiance = self.tracer.environment.sampled_radiance(&sample);
                    sample.weight * importance(f * radiance * transmittance) / (pdf * mean)
                }
            }
        };
        self.count(vertex, choice.tile, weight);
    }
}
