//! Next event estimation: light from the map and from lamps at a vertex.

use glam::Vec3;

use super::shadows::{Course, GlassWalk, Sight};
use super::sharing::SharedTile;
use super::tracer::Path;
use super::vertex::{Arriving, Vertex};
use crate::bvh::{Hit, Ray};
use crate::environment::TileSearch;
use crate::light_grid::TileChoice;
use crate::math::balance_heuristic;
use crate::scene::needs::SceneFeatures;

/// What next event estimation has chosen to look at.
#[derive(Default)]
pub(super) struct ChosenLights {
    /// Tiles of the map, and where in them.
    of_map: [Option<(TileChoice, TileSearch)>; SharedTile::MAP_SAMPLES as usize],
    /// By which numbers a lamp will be chosen.
    of_lamps: Option<[u32; 2]>,
}

impl Path<'_> {
    /// Draws the random numbers of next event estimation, and chooses tiles of the map by them.
    #[inline(always)]
    pub(super) fn choose_lights(&mut self, vertex: &Vertex<'_>) -> ChosenLights {
        let mut chosen = ChosenLights::default();
        debug_assert!(self.map_samples as usize <= chosen.of_map.len(), "all are drawn");
        if let Some(grid) = self.tracer.grid {
            let count = self.map_samples;
            for (of_map, estimate) in chosen.of_map.iter_mut().zip(0..count) {
                let bits = self.sampler.of_estimate(count, estimate).next_pair_bits();
                let choice = grid.sample(vertex.distribution, bits);
                self.expect_count(vertex, choice.tile);
                let u = [choice.remainder, bits[1]];
                let search = self.tracer.environment.search_tile(choice.tile, u);
                *of_map = search.map(|search| (choice, search));
            }
            self.sampler.skip(1);
        }
        if !self.tracer.lights.is_empty() {
            chosen.of_lamps = Some(self.sampler.next_pair_bits());
        }
        chosen
    }

    /// Calls `take` with the light that next event estimation finds, of the map and, if there are any, of one local light.
    pub(super) fn for_arriving(
        &mut self,
        vertex: &Vertex<'_>,
        lights: &ChosenLights,
        mut take: impl FnMut(Arriving),
    ) {
        for (choice, search) in lights.of_map.iter().flatten() {
            self.light_of_map(vertex, choice, search).map(&mut take);
        }
        if let Some(bits) = lights.of_lamps {
            self.light_of_lamps(vertex, bits).map(&mut take);
        }
    }

    fn light_of_map(
        &mut self,
        vertex: &Vertex<'_>,
        choice: &TileChoice,
        search: &TileSearch,
    ) -> Option<Arriving> {
        let sample = self.tracer.environment.finish_sample(search)?;
        let pdf = choice.probability * sample.pdf_solid_angle;
        let Some((f, own_pdf)) = vertex.scatterer.scattered(sample.direction) else {
            self.count(vertex, choice.tile, 0.0);
            return None;
        };
        self.tracer.environment.prefetch_radiance(&sample);
        let (transmittance, refracted) = self.share_of_map(vertex, sample.direction);
        if self.tracer.counts.is_some() {
            let weight = self.visibility(vertex, sample.direction, own_pdf, transmittance);
            self.count(vertex, choice.tile, weight);
        }
        let all_pdfs = self.map_samples as f32 * pdf + own_pdf;
        if transmittance == Vec3::ZERO || all_pdfs <= 0.0 {
            return None;
        }
        // Balance heuristic over the density; `weight` is what integers drew it with.
        let environment = self.tracer.environment;
        let sampled = || environment.sampled_radiance(&sample);
        let radiance = refracted.map_or_else(sampled, |direction| environment.radiance(direction));
        let light = radiance * transmittance * (sample.weight / all_pdfs);
        Some(Arriving { direction: sample.direction, f, light })
    }

    fn light_of_lamps(&mut self, vertex: &Vertex<'_>, bits: [u32; 2]) -> Option<Arriving> {
        let world = self.tracer.world;
        let point_at = |hit: &Hit, direction| world.point(hit, direction);
        let receiver = vertex.receiver();
        let sample = self.tracer.lights.sample(&world.scene, &receiver, bits, point_at)?;
        let (f, own_pdf) = vertex.scatterer.scattered(sample.direction)?;
        let is_punctual = sample.pdf_solid_angle.is_infinite();
        let light = match self.sight(vertex, sample.direction, sample.distance) {
            Sight::Straight(transmittance) => {
                let weight = balance_heuristic(sample.pdf_solid_angle, own_pdf);
                sample.radiance_over_pdf * transmittance * weight
            }
            // No path finds a light without size, so none competes.
            Sight::ThroughGlass(ray, body) if is_punctual => {
                let walk = GlassWalk::new(self.tracer, ray, body, Course::Straight, None);
                self.rays += walk.rays;
                sample.radiance_over_pdf * walk.transmittance
            }
            Sight::ThroughGlass(ray, body) => {
                let endless = Ray { t_max: f32::INFINITY, ..ray };
                let walk = GlassWalk::new(self.tracer, endless, body, Course::Refracted, None);
                self.rays += walk.rays;
                let emitted = walk.emitted;
                if emitted == Vec3::ZERO {
                    return None;
                }
                let mut pdf = sample.pdf_solid_angle;
                // The straight ray ends at an opaque lamp.
                if world.needs.has(SceneFeatures::SHEER_EMITTERS) {
                    let (course, receiver) = (Course::Straight, Some(&receiver));
                    let walk = GlassWalk::new(self.tracer, endless, body, course, receiver);
                    self.rays += walk.rays;
                    // Where it is found through an edge, rounding may lose the one that was chosen.
                    pdf = walk.lamp_pdf.max(pdf);
                }
                emitted / (pdf + own_pdf)
            }
        };
        (light != Vec3::ZERO).then_some(Arriving { direction: sample.direction, f, light })
    }
}
