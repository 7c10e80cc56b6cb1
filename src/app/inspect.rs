//! What the grid knows at one point, and what is true there.

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
use crate::path::World;
use crate::radiance_cache::KnownCell;
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

/// True visible energy of each tile at a point, normalised to 1.
pub(super) struct Truth {
    /// Where.
    position: Vec3,
    /// Of which map, turned and scaled.
    environment: Arc<Environment>,
    /// Share of each tile.
    pub(super) shares: Vec<f32>,
}

/// Follows the pointer.
#[derive(Default)]
pub(super) struct Inspector {
    inspected: Option<Inspected>,
    truth: Option<Truth>,
    /// The map that is inspected.
    environment: Option<Arc<Environment>>,
    learned: Option<(Arc<LightGrid>, Vec<f32>)>,
    source: Option<(Vec2, u64)>,
    /// Whether a truth is being measured.
    pub(super) busy: bool,
}

impl Inspector {
    /// What is inspected.
    pub(super) fn inspected(&self) -> Option<&Inspected> {
        self.inspected.as_ref()
    }

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
        (self.inspected, self.source) = (None, None);
        (self.environment, self.learned, self.truth) = (None, None, None);
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
        let source = Some((place, snapshot.number));
        if self.source == source {
            return;
        }
        self.source = source;
        self.environment = Some(Arc::clone(&snapshot.request.environment));
        self.inspected = inspect(snapshot, place);
    }

    /// Sums up the distributions, unless they are still the same.
    fn sum_up(&mut self, snapshot: &Snapshot) {
        let Some(grid) = snapshot.main.grid.as_ref().filter(|grid| grid.distributions().len() > 1)
        else {
            self.learned = None;
            return;
        };
        if self.learned.as_ref().is_some_and(|(old, _)| Arc::ptr_eq(old, grid)) {
            return;
        }
        let distributions = grid.distributions();
        // The first distribution is the whole map's.
        let sum = |tile| {
            (1..distributions.len())
                .map(|distribution| distributions.probability(distribution, tile))
                .sum()
        };
        let sums = (0..distributions.tile_count()).map(sum).collect();
        self.learned = Some((Arc::clone(grid), sums));
    }

    /// Measures the truth at the inspected point by brute force, unless one is being measured.
    pub(super) fn measure(
        &mut self,
        snapshot: &Arc<Snapshot>,
    ) -> Option<impl FnOnce() -> Truth + Send + use<>> {
        let inspected = self.inspected.as_ref().filter(|_| !self.busy)?;
        let (spot, snapshot) = (inspected.spot, Arc::clone(snapshot));
        self.busy = true;
        Some(move || {
            let environment = Arc::clone(&snapshot.request.environment);
            let shares = true_shares(&snapshot.request.world, &environment, &spot);
            Truth { position: spot.position, environment, shares }
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
    inspected.memory_bytes = (distribution != WHOLE_MAP).then(|| {
        TileDistributions::distribution_bytes(
            distributions.tile_count(),
            distributions.support(distribution),
        )
    });
    inspected.probabilities =
        (0..distributions.tile_count()).map(|tile| grid.probability(distribution, tile)).collect();
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

/// Share of each tile in what a Lambertian surface at the spot would reflect of the map.
fn true_shares(world: &World, environment: &Environment, spot: &Spot) -> Vec<f32> {
    let origin = offset_origin(spot.position, spot.normal);
    let energies: Vec<f64> = (0..environment.tile_count())
        .map(|tile| {
            (0..TRUTH_SAMPLES)
                .map(|i| {
                    // R2 sequence (Roberts 2018).
                    let u = [0xc13f_a9a9_u32, 0x91e1_0da5].map(|step| step.wrapping_mul(i));
                    let Some(sample) = environment.sample_in_tile(tile, u) else { return 0.0 };
                    let cosine = spot.normal.dot(sample.direction);
                    if cosine <= 0.0 {
                        return 0.0;
                    }
                    let direction = sample.direction;
                    let ray = Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
                    let light = importance(
                        environment.sampled_radiance(&sample) * world.transmittance(&ray),
                    );
                    f64::from(sample.weight * light * cosine / sample.pdf_solid_angle)
                })
                .sum()
        })
        .collect();
    let total: f64 = energies.iter().sum();
    energies.iter().map(|e| if total > 0.0 { (e / total) as f32 } else { 0.0 }).collect()
}
