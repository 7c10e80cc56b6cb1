//! What was learned under one map, for the same map turned or scaled, or for another one.

use glam::Vec2;

use super::grid::{LightGrid, WHOLE_MAP};
use crate::environment::Environment;

/// Places along a tile's width that are asked for what was known there.
const PLACES: [f32; 3] = [0.15, 0.5, 0.85];

impl LightGrid {
    /// Distributions for the map `new` from distributions learned under `old`: what a cell sees of a direction
    /// does not depend on the map, so a tile's old probability over its old energy tells how visible its
    /// direction is. Approximate (distributions are compensated, and a turned map's tiles lie between the old
    /// ones), which costs noise and never bias; it bridges the time until learning anew is done.
    /// `None` for a black map.
    pub fn transferred(&self, old: &Environment, new: &Environment) -> Option<Self> {
        let mut result = Self::whole_map(new.tile_energies())?;
        let sources: Vec<[u32; PLACES.len()]> = (0..new.tile_count())
            .map(|tile| PLACES.map(|x| old.tile_of(new.direction_in_tile(tile, Vec2::new(x, 0.5)))))
            .collect();
        let mut distribution_of_distribution =
            vec![WHOLE_MAP as u16; self.distributions.len() as usize];
        let mut weights = vec![0.0; new.tile_count() as usize];
        for distribution in 1..self.distributions.len() {
            let visibility = |tile: u32| {
                let energy = old.tile_energies()[tile as usize];
                if energy > 0.0 {
                    f64::from(self.distributions.probability(distribution, tile)) / energy
                } else {
                    0.0
                }
            };
            let tiles = weights.iter_mut().zip(&sources).zip(new.tile_energies());
            for ((weight, sources), energy) in tiles {
                *weight = energy * sources.iter().map(|tile| visibility(*tile)).sum::<f64>();
            }
            if let Some(index) = result.distributions.push(&weights) {
                distribution_of_distribution[distribution as usize] = index as u16;
            }
        }
        result.cells = self.cells.clone().map(|mut cells| {
            for distribution in &mut cells.distribution_of_cell {
                *distribution = distribution_of_distribution[usize::from(*distribution)];
            }
            cells
        });
        Some(Self { whole_map_share: self.whole_map_share, generation: self.generation, ..result })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::EnvironmentOptions;
    use crate::image::Image;
    use crate::light_grid::cells::SphericalGrid;

    fn environment(bright_column: u32, turned_tiles: f32) -> Environment {
        let map =
            Image::from_fn(64, 32, |x, _| if x / 2 == bright_column { [9.0; 3] } else { [1.0; 3] });
        let turn = turned_tiles / 32.0 * std::f32::consts::TAU;
        let options = EnvironmentOptions {
            rotation_radians: turn,
            tile_columns: 32,
            tile_rows: 16,
            ..EnvironmentOptions::default()
        };
        Environment::new(map, &options).expect("a map")
    }

    const GRID: SphericalGrid =
        SphericalGrid { center: glam::Vec3::ZERO, columns: 8, rows: 4, faces: true, medium: false };

    #[test]
    fn a_turned_map_keeps_what_is_seen_where() {
        let old = environment(3, 0.0);
        let learned =
            LightGrid::with_garbage_distributions(GRID, old.tile_energies(), 1).expect("a grid");
        let turned = environment(3, 5.0);
        let distributions = learned.transferred(&old, &turned).expect("a grid");
        let mut compared = 0;
        for distribution in 1..learned.distributions().len() {
            for tile in 0..512_u32 {
                // The tile that now lies where `tile` was, five columns back on the map.
                let now = tile / 32 * 32 + (tile % 32 + 27) % 32;
                let before = learned.distributions().probability(distribution, tile);
                let after = distributions.distributions().probability(distribution, now);
                assert_eq!(before > 0.0, after > 0.0, "distribution {distribution}, tile {tile}");
                compared += u32::from(before > 0.0);
            }
        }
        assert!(compared > 1000);
    }

    #[test]
    fn the_same_map_keeps_its_distributions_and_a_brighter_tile_gets_more() {
        let old = environment(3, 0.0);
        let learned =
            LightGrid::with_garbage_distributions(GRID, old.tile_energies(), 2).expect("a grid");
        let same = learned.transferred(&old, &old).expect("a grid");
        let sun_moved = learned.transferred(&old, &environment(20, 0.0)).expect("a grid");
        for cell in 0..GRID.cell_count() {
            let distribution = learned.distribution_of_cell(cell);
            assert_eq!(same.distribution_of_cell(cell), distribution);
            for tile in 0..512 {
                let (a, b) = (
                    learned.distributions().probability(distribution, tile),
                    same.distributions().probability(distribution, tile),
                );
                assert!((a - b).abs() < 1e-5 + 1e-4 * a, "{a} {b}");
            }
            let share = |distributions: &LightGrid| -> f32 {
                (0..16)
                    .map(|row| {
                        distributions.distributions().probability(distribution, row * 32 + 20)
                    })
                    .sum()
            };
            assert!(distribution == WHOLE_MAP || share(&sun_moved) > 2.0 * share(&learned));
        }
    }
}
