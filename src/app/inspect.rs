//! What the grid knows at one point, and what is true there.

use std::f32::consts::PI;
use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};

use super::interface::Interface;
use super::worker::Snapshot;
use crate::bvh::{Ray, offset_origin};
use crate::color::importance;
use crate::environment::Environment;
use crate::light_grid::counters::Tally;
use crate::light_grid::tile_distributions::TileDistributions;
use crate::light_grid::{LightGrid, WHOLE_MAP};
use crate::path::Lit;
use crate::radiance_cache::KnownCell;
use crate::render::light_parts::LightParts;
use crate::render::surface_map::{Spot, look_at_place};

/// Directions per tile for the truth: a standard error of some per cent for tiles half seen.
const TRUTH_SAMPLES: u32 = 256;

/// What is known of the cell behind a pixel.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Inspected {
    /// The surface.
    pub(super) spot: Spot,
    /// Where it is in the scene's file, metres.
    pub(super) in_file: DVec3,
    /// Its material's name.
    pub(super) material: String,
    /// Index of its cell, and that one's face, row and column; `None` without a grid.
    pub(super) cell: Option<(u32, [u32; 3])>,
    /// Index of its distribution.
    pub(super) distribution: u32,
    /// Bytes of its distribution.
    pub(super) memory_bytes: Option<usize>,
    /// Probability of each tile.
    pub(super) probabilities: Vec<f32>,
    /// What learning counted for each tile; empty where nothing was.
    pub(super) tallies: Vec<Tally>,
    /// The cell of the radiance cache, if there is one.
    pub(super) cached: Option<KnownCell>,
}

/// What light truly arrives at a point, and goes from there to the camera.
pub(super) struct Truth {
    /// Where.
    position: Vec3,
    /// Of which map, turned and scaled.
    environment: Arc<Environment>,
    /// True visible energy of each tile, normalised to 1.
    pub(super) shares: Vec<f32>,
    /// What arrives of the map's light, as a share of what a surface would receive if nothing were in the way; 0 where
    /// the map has nothing on that side.
    pub(super) unblocked: f32,
    /// What the pixel's light is made of.
    pub(super) parts: LightParts,
}

/// Follows the pointer.
#[derive(Default)]
pub(super) struct Inspector {
    /// What is inspected.
    pub(super) inspected: Option<Inspected>,
    truth: Option<Truth>,
    /// The map that is inspected.
    environment: Option<Arc<Environment>>,
    learned: Option<(Arc<LightGrid>, Vec<f32>)>,
    source: Option<(Vec2, (u64, Option<usize>))>,
    /// Whether a truth is being measured.
    pub(super) busy: bool,
    /// A cell that others are compared with.
    pub(super) kept: Option<Inspected>,
}

impl Inspector {
    /// The truth at the inspected point, if it was measured.
    pub(super) fn truth(&self) -> Option<&Truth> {
        let here = self.inspected.as_ref()?.spot.position;
        let is_of = |truth: &&Truth| {
            self.environment.as_ref().is_some_and(|now| Arc::ptr_eq(now, &truth.environment))
        };
        self.truth.as_ref().filter(|truth| truth.position == here).filter(is_of)
    }

    /// Probability of each tile summed over all learned distributions, `None` before anything was learned.
    pub(super) fn learned(&self) -> Option<&[f32]> {
        self.learned.as_ref().map(|(_, sums)| &sums[..])
    }

    /// Forgets everything: another scene or map is shown, and what is known of the last one is large.
    pub(super) fn forget(&mut self) {
        *self = Self { busy: self.busy, ..Self::default() };
    }

    /// Densities in 1/sr of a place within a tile, in `[0,1]^2`: of sampling the map from the inspected cell, and of a
    /// diffuse bounce there.
    pub(super) fn densities(&self, tile: u32, within: Vec2) -> Option<[f32; 2]> {
        let (inspected, environment) = (self.inspected.as_ref()?, self.environment.as_ref()?);
        let direction = environment.direction_in_tile(tile, within);
        let (_, tile, pdf) = environment.radiance_and_tile_pdf(direction);
        let probability = inspected.probabilities.get(tile as usize)?;
        let cosine = direction.dot(inspected.spot.normal).max(0.0);
        Some([probability * pdf, cosine / PI])
    }

    /// Keeps the inspected cell, so that others are compared with it, or no longer.
    pub(super) fn toggle_kept(&mut self) {
        self.kept = self.inspected.clone().filter(|_| self.kept.is_none());
    }

    /// Takes a truth that is ready.
    pub(super) fn take(&mut self, truth: Truth) {
        (self.truth, self.busy) = (Some(truth), false);
    }

    /// Looks again if the pointer or the grid has changed.
    pub(super) fn update(&mut self, interface: &Interface, snapshot: Option<&Arc<Snapshot>>) {
        if interface.tab != super::interface::Tab::Inspect || !interface.panels {
            return;
        }
        let Some(snapshot) = snapshot else { return };
        self.sum_up(snapshot);
        let Some(place) = interface.inspected() else { return };
        let source = Some((place, snapshot.key()));
        if self.source == source {
            return;
        }
        self.source = source;
        self.environment = Some(Arc::clone(&snapshot.request.environment));
        self.inspected = inspect(snapshot, place);
    }

    /// Sums up the distributions, unless they are still the same.
    fn sum_up(&mut self, snapshot: &Snapshot) {
        let grid = snapshot.main.grid.as_ref().filter(|grid| grid.distributions().len() > 1);
        self.learned.take_if(|(old, _)| grid.is_none_or(|grid| !Arc::ptr_eq(old, grid)));
        let Some(grid) = grid.filter(|_| self.learned.is_none()) else { return };
        let distributions = grid.distributions();
        // The first distribution is the whole map's.
        let own = 1..distributions.len();
        let sum = |tile| own.clone().map(|number| distributions.probability(number, tile)).sum();
        self.learned = Some((Arc::clone(grid), (0..distributions.tile_count()).map(sum).collect()));
    }

    /// Measures the truth at the inspected point by brute force, unless one is being measured.
    pub(super) fn measure(
        &mut self,
        snapshot: &Arc<Snapshot>,
    ) -> Option<impl FnOnce() -> Truth + Send + use<>> {
        let inspected = self.inspected.as_ref().filter(|_| !self.busy)?;
        let (place, _) = self.source?;
        let (spot, snapshot) = (inspected.spot, Arc::clone(snapshot));
        self.busy = true;
        Some(move || {
            let environment = Arc::clone(&snapshot.request.environment);
            let lit = (&*snapshot.request.world, &*environment);
            let (shares, unblocked) = true_shares(lit, &spot);
            let grid = snapshot.main.grid.as_deref();
            let parts = LightParts::measure(lit, &snapshot.view(), grid, place);
            Truth { position: spot.position, environment, shares, unblocked, parts }
        })
    }
}

fn inspect(snapshot: &Snapshot, place: Vec2) -> Option<Inspected> {
    let world = &snapshot.request.world;
    let spot = look_at_place(world, &snapshot.view(), place)?;
    let material = world.scene.materials[spot.material as usize].name.clone();
    let mut inspected = Inspected {
        in_file: world.scene.frame.point_in_file(spot.position),
        spot,
        material,
        cell: None,
        distribution: WHOLE_MAP,
        memory_bytes: None,
        probabilities: Vec::new(),
        tallies: Vec::new(),
        cached: snapshot.cache.as_ref().ok().map(|cache| cache.cell_at(spot.position, spot.normal)),
    };
    let Some(grid) = &snapshot.main.grid else { return Some(inspected) };
    let cell = grid.grid().map(|cells| cells.cell_of(spot.position, spot.normal));
    inspected.distribution = cell.map_or(WHOLE_MAP, |cell| grid.distribution_of_cell(cell));
    let (distributions, distribution) = (grid.distributions(), inspected.distribution);
    let (tiles, support) = (distributions.tile_count(), distributions.support(distribution));
    let bytes = TileDistributions::distribution_bytes(tiles, support);
    inspected.memory_bytes = Some(bytes).filter(|_| distribution != WHOLE_MAP);
    inspected.probabilities = (0..tiles).map(|tile| grid.probability(distribution, tile)).collect();
    if let (Some(cells), Some(cell)) = (grid.grid(), cell) {
        inspected.cell = Some((cell, cells.coordinates(cell).into()));
        if let Some(learning) = snapshot.counters.as_ref().filter(|l| l.grid == *cells)
            && let Some(slot) = learning.counters.cells().iter().position(|c| *c == cell)
        {
            inspected.tallies = learning.counters.tallies(slot).collect();
        }
    }
    Some(inspected)
}

/// Share of each tile in what a Lambertian surface at the spot would reflect of the map, and the share of all in what it
/// would reflect if nothing were in the way.
fn true_shares((world, environment): Lit<'_>, spot: &Spot) -> (Vec<f32>, f32) {
    let origin = offset_origin(spot.position, spot.normal);
    // Energies with what is in the way, and without.
    let energies: Vec<[f64; 2]> = (0..environment.tile_count())
        .map(|tile| {
            let mut sums = [0.0; 2];
            for i in 0..TRUTH_SAMPLES {
                // R2 sequence (Roberts 2018).
                let u = [0xc13f_a9a9_u32, 0x91e1_0da5].map(|step| step.wrapping_mul(i));
                let Some(sample) = environment.sample_in_tile(tile, u) else { break };
                let cosine = spot.normal.dot(sample.direction);
                if cosine > 0.0 {
                    let direction = sample.direction;
                    let ray = Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
                    let radiance = environment.sampled_radiance(&sample);
                    let passed = [radiance * world.transmittance(&ray), radiance];
                    let weight = f64::from(sample.weight * cosine / sample.pdf_solid_angle);
                    for (sum, light) in sums.iter_mut().zip(passed) {
                        *sum += weight * f64::from(importance(light));
                    }
                }
            }
            sums
        })
        .collect();
    let share = |part: f64, whole: f64| if whole > 0.0 { (part / whole) as f32 } else { 0.0 };
    let [arriving, whole] = [0, 1].map(|i| energies.iter().map(|e| e[i]).sum::<f64>());
    let shares = energies.iter().map(|[energy, _]| share(*energy, arriving)).collect();
    (shares, share(arriving, whole))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Image;
    use crate::path::WorldBuilder;
    use crate::scene::Material;

    #[test]
    fn half_the_map_arrives_at_a_floor_beside_an_endless_wall() {
        let map = Environment::new(Image::filled(32, 16, [1.0; 3]), &Default::default());
        let map = map.expect("a sound map");
        let [low, high] = [Vec3::new(-9.0, 0.0, -9.0), Vec3::new(9.0, 18.0, 9.0)];
        let spot = Spot { position: Vec3::new(8.99, 0.0, 0.0), normal: Vec3::Y, material: 0 };
        for (faces, expected) in [(vec![3], 1.0), (vec![0, 3], 0.5), (vec![0, 1, 2, 3, 4, 5], 0.0)]
        {
            let builder = WorldBuilder::default();
            let world = builder.faces(&Material::lambert(0.5), low, high, faces.clone()).build();
            let (shares, unblocked) = true_shares((&world, &map), &spot);
            assert!((unblocked - expected).abs() < 0.01, "{faces:?}: {unblocked}");
            let sum: f32 = shares.iter().sum();
            assert!((sum - f32::from(unblocked > 0.0)).abs() < 1e-4, "{faces:?}: {sum}");
        }
    }
}
