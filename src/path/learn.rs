//! Learning paths: what the map shows to the vertices of camera paths.

use glam::Vec2;

use super::{Path, PathTracer, Vertex};
use crate::bvh::Ray;
use crate::color::{importance, luminance};
use crate::light_grid::{LearningGrid, WHOLE_MAP};
use crate::sampler::{Sampler, unit_from_bits};

impl PathTracer<'_> {
    /// Traces one camera path and records at each vertex whether a sample of the map is visible,
    /// drawn half from the whole map and half from what [`PathTracer::grid`] has learned so far: a
    /// tile's visibility ratio does not depend on how often it is tried. Returns the number of rays.
    pub fn learn(&self, ray: Ray, sampler: Sampler, learning: &LearningGrid) -> u32 {
        let mut path = Path::new(self, ray, sampler);
        while let Some(vertex) = path.next_vertex() {
            if path.bounces == self.limits.bounces {
                break;
            }
            path.bounces += 1;
            if !vertex.bsdf.is_delta_only() {
                path.record(&vertex, learning);
            }
            if !path.scatter(&vertex) || !path.survives() {
                break;
            }
        }
        path.rays
    }
}

impl Path<'_> {
    fn record(&mut self, vertex: &Vertex, learning: &LearningGrid) {
        let Some(grid) = self.tracer.grid else { return };
        let recording = learning.recording();
        let by_learned = recording.is_ratio() && self.sampler.next_pair_bits()[0] >> 31 == 0;
        let law = if by_learned { vertex.law } else { WHOLE_MAP };
        let [tile_bits, row_bits] = self.sampler.next_pair_bits();
        let choice = grid.laws().sample(law, tile_bits);
        let u = Vec2::new(choice.remainder, unit_from_bits(row_bits));
        let Some(sample) = self.tracer.environment.sample_in_tile(choice.tile, u) else { return };
        let normal = vertex.point.geometric_normal;
        let cell = learning.grid.cell_of(vertex.point.position, normal);
        let weight = match self.scattered(vertex, sample.direction) {
            None => 0.0,
            Some((f, _)) => {
                let transmittance = self.transmittance(vertex, sample.direction, f32::INFINITY);
                if recording.is_ratio() {
                    let cosine = vertex.point.shading_frame.z.dot(sample.direction).abs();
                    luminance(transmittance) * cosine.powi(recording.cosine_power())
                } else {
                    let pdf = choice.probability * sample.pdf_solid_angle;
                    let mean =
                        std::f32::consts::PI * importance(self.tracer.environment.mean_radiance());
                    importance(f * sample.radiance * transmittance) / (pdf * mean)
                }
            }
        };
        learning.counters.record(cell, choice.tile, weight);
    }
}
