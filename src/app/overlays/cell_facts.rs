//! Numbers about cells and their distributions, computed once per grid.

use crate::environment::Environment;
use crate::light_grid::{LearningGrid, LightGrid, WHOLE_MAP};

/// What overlays and the inspector say of cells; distributions are indexed as in the grid.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CellFacts {
    /// Entropy of each distribution in bits.
    pub entropy: Vec<f32>,
    /// Total variation between each distribution and the whole map's, in `[0,1]`.
    pub distance: Vec<f32>,
    /// The likeliest tile of each distribution.
    pub best_tile: Vec<u32>,
    /// Tries of each cell, 0 for cells without counters; empty without counters.
    tries: Vec<f32>,
    /// Mean over the tiles' solid angles of each cell's visibility ratio; NaN where unknown.
    visible: Vec<f32>,
}

impl CellFacts {
    /// Looks at every distribution and every counted cell.
    pub fn of(
        grid: &LightGrid,
        counters: Option<&LearningGrid>,
        environment: &Environment,
    ) -> Self {
        let distributions = grid.distributions();
        let tiles = distributions.tile_count();
        let whole: Vec<f32> =
            (0..tiles).map(|tile| distributions.probability(WHOLE_MAP, tile)).collect();
        let mut facts = Self::default();
        for distribution in 0..distributions.len() {
            let (mut entropy, mut distance, mut best) = (0.0, 0.0, (0.0, 0));
            for tile in 0..tiles {
                let p = distributions.probability(distribution, tile);
                entropy -= if p > 0.0 { p * p.log2() } else { 0.0 };
                distance += 0.5 * (p - whole[tile as usize]).abs();
                if p > best.0 {
                    best = (p, tile);
                }
            }
            facts.entropy.push(entropy);
            facts.distance.push(distance);
            facts.best_tile.push(best.1);
        }
        if let Some(counters) = counters {
            facts.count(counters, &tile_solid_angles(environment));
        }
        facts
    }

    fn count(&mut self, counters: &LearningGrid, solid_angles: &[f64]) {
        let cells = counters.grid.cell_count() as usize;
        self.tries = vec![0.0; cells];
        self.visible = vec![f32::NAN; cells];
        for (slot, &cell) in counters.counters.cells().iter().enumerate() {
            let (mut tries, mut visible, mut known) = (0.0, 0.0, 0.0);
            for (tally, solid_angle) in counters.counters.tallies(slot).zip(solid_angles) {
                tries += tally.tries;
                if tally.tries > 0.0 {
                    visible += tally.weight / tally.tries * solid_angle;
                    known += solid_angle;
                }
            }
            self.tries[cell as usize] = tries as f32;
            if known > 0.0 {
                self.visible[cell as usize] = (visible / known) as f32;
            }
        }
    }

    /// Learning samples of the map tried from a cell; `None` if nothing was counted there.
    pub fn visits(&self, cell: u32) -> Option<f32> {
        self.tries.get(cell as usize).copied().filter(|tries| *tries > 0.0)
    }

    /// Mean of visibility times cosine over the tiles tried from a cell.
    pub fn visible_share(&self, cell: u32) -> Option<f32> {
        self.visible.get(cell as usize).copied().filter(|share| share.is_finite())
    }
}

/// Steradians of every tile.
fn tile_solid_angles(environment: &Environment) -> Vec<f64> {
    let y = |tile: u32, v: f32| environment.direction_in_tile(tile, glam::Vec2::new(0.5, v)).y;
    let height = |tile: u32| f64::from(y(tile, 0.0)) - f64::from(y(tile, 1.0));
    let width = std::f64::consts::TAU / f64::from(environment.tile_grid().0);
    (0..environment.tile_count()).map(|tile| width * height(tile)).collect()
}
