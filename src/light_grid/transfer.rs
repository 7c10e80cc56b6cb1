//! What was learned under one map, for the same map turned or scaled, or for another one.

use glam::Vec2;

use super::tile_laws::TileLaws;
use super::{LightGrid, WHOLE_MAP};
use crate::environment::Environment;

/// Places along a tile's width that are asked for what was known there.
const PLACES: [f32; 3] = [0.15, 0.5, 0.85];

impl LightGrid {
    /// Laws for the map `new` from laws learned under `old`: what a cell sees of a direction does
    /// not depend on the map, so a tile's old probability over its old energy tells how visible its
    /// direction is. Approximate (laws are compensated, and a turned map's tiles lie between the old
    /// ones), which costs noise and never bias; it bridges the time until learning anew is done.
    /// `None` for a black map.
    pub fn transferred(&self, old: &Environment, new: &Environment) -> Option<Self> {
        let mut result = Self::whole_map(new.tile_energies())?;
        let sources: Vec<[u32; PLACES.len()]> = (0..new.tile_count())
            .map(|tile| PLACES.map(|x| old.tile_of(new.direction_in_tile(tile, Vec2::new(x, 0.5)))))
            .collect();
        let mut law_of_law = vec![WHOLE_MAP as u16; self.laws.len() as usize];
        let mut weights = vec![0.0; new.tile_count() as usize];
        for law in 1..self.laws.len() {
            transfer_law(&self.laws, law, (old, new), &sources, &mut weights);
            if let Some(index) = result.laws.push(&weights) {
                law_of_law[law as usize] = index as u16;
            }
        }
        result.cells = self.cells.clone().map(|mut cells| {
            for law in &mut cells.law_of_cell {
                *law = law_of_law[usize::from(*law)];
            }
            cells
        });
        result.whole_map_share = self.whole_map_share;
        result.generation = self.generation;
        Some(result)
    }
}

fn transfer_law(
    laws: &TileLaws,
    law: u32,
    (old, new): (&Environment, &Environment),
    sources: &[[u32; PLACES.len()]],
    weights: &mut [f64],
) {
    let visibility = |tile: u32| {
        let energy = old.tile_energies()[tile as usize];
        if energy > 0.0 { f64::from(laws.probability(law, tile)) / energy } else { 0.0 }
    };
    for ((weight, sources), energy) in weights.iter_mut().zip(sources).zip(new.tile_energies()) {
        *weight = energy * sources.iter().map(|tile| visibility(*tile)).sum::<f64>();
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
        let learned = LightGrid::with_garbage_laws(GRID, old.tile_energies(), 1).expect("a grid");
        let turned = environment(3, 5.0);
        let laws = learned.transferred(&old, &turned).expect("a grid");
        let mut compared = 0;
        for law in 1..learned.laws().len() {
            for tile in 0..512_u32 {
                // The tile that now lies where `tile` was, five columns back on the map.
                let now = tile / 32 * 32 + (tile % 32 + 27) % 32;
                let before = learned.laws().probability(law, tile);
                let after = laws.laws().probability(law, now);
                assert_eq!(before > 0.0, after > 0.0, "law {law}, tile {tile}");
                compared += u32::from(before > 0.0);
            }
        }
        assert!(compared > 1000);
    }

    #[test]
    fn the_same_map_keeps_its_laws_and_a_brighter_tile_gets_more() {
        let old = environment(3, 0.0);
        let learned = LightGrid::with_garbage_laws(GRID, old.tile_energies(), 2).expect("a grid");
        let same = learned.transferred(&old, &old).expect("a grid");
        let sun_moved = learned.transferred(&old, &environment(20, 0.0)).expect("a grid");
        for cell in 0..GRID.cell_count() {
            let law = learned.law_of_cell(cell);
            assert_eq!(same.law_of_cell(cell), law);
            for tile in 0..512 {
                let (a, b) =
                    (learned.laws().probability(law, tile), same.laws().probability(law, tile));
                assert!((a - b).abs() < 1e-5 + 1e-4 * a, "{a} {b}");
            }
            let share = |laws: &LightGrid| -> f32 {
                (0..16).map(|row| laws.laws().probability(law, row * 32 + 20)).sum()
            };
            assert!(law == WHOLE_MAP || share(&sun_moved) > 2.0 * share(&learned));
        }
    }
}
