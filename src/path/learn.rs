//! Learning paths: what the map shows to the vertices of camera paths.

use glam::Vec2;

use super::{Path, PathTracer, Scatterer, Vertex};
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
            // Inside of a solid the map is never seen; its vertices would spoil what fog sees.
            if !vertex.scatterer.is_delta_only() && !path.is_in_solid(&vertex) {
                path.record(&vertex, learning);
            }
            if !path.scatter(&vertex) || !path.survives() {
                break;
            }
        }
        path.rays
    }
}

/// What the cosine is to a surface: the phase function over that of even scattering.
fn phase_weight(phase: f32) -> f32 {
    4.0 * std::f32::consts::PI * phase
}

impl Path<'_> {
    fn is_in_solid(&self, vertex: &Vertex) -> bool {
        matches!(vertex.scatterer, Scatterer::Medium(_)) && self.body.interior.is_some()
    }

    fn record(&mut self, vertex: &Vertex, learning: &LearningGrid) {
        let Some(grid) = self.tracer.grid else { return };
        let recording = learning.recording();
        let by_learned = recording.is_ratio() && self.sampler.next_pair_bits()[0] >> 31 == 0;
        let law = if by_learned { vertex.law } else { WHOLE_MAP };
        let [tile_bits, row_bits] = self.sampler.next_pair_bits();
        let choice = grid.laws().sample(law, tile_bits);
        let u = Vec2::new(choice.remainder, unit_from_bits(row_bits));
        let Some(sample) = self.tracer.environment.sample_in_tile(choice.tile, u) else { return };
        let cell = match &vertex.scatterer {
            Scatterer::Surface(surface) => {
                learning.grid.cell_of(vertex.position, surface.point.geometric_normal)
            }
            Scatterer::Medium(_) => learning.grid.cell_in_medium(vertex.position),
        };
        let weight = match self.scattered(vertex, sample.direction) {
            None => 0.0,
            Some((f, own_pdf)) => {
                let transmittance = self.transmittance(vertex, sample.direction, f32::INFINITY);
                if recording.is_ratio() {
                    let share = match &vertex.scatterer {
                        Scatterer::Surface(surface) => {
                            surface.point.shading_frame.z.dot(sample.direction).abs()
                        }
                        Scatterer::Medium(_) => phase_weight(own_pdf),
                    };
                    luminance(transmittance) * share.powi(recording.cosine_power())
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
