//! Distributions of all cells from their counters, on all threads.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::ops::Range;

use rayon::prelude::*;

use super::cells::{MEDIUM_FACE, SphericalGrid, face_axis};
use super::counters::{Counters, Tally};
use super::options::DistributionOptions;
use super::tile_distributions::TileDistributions;
use crate::environment::Environment;

/// Cells per side of the blocks that visibility is pooled over.
const POOL: u32 = 4;

/// Bytes of distributions that are built at a time before they are appended to the others.
const BYTES_AT_ONCE: usize = 1 << 19;

/// Minimum share of a distribution that must remain after MIS compensation.
const MIN_COMPENSATED: f64 = 0.05;

/// Computes tile weights from a slot's counters, from those of its neighbours and from the map.
pub(super) struct DistributionBuilder<'a> {
    grid: SphericalGrid,
    counters: &'a Counters,
    options: DistributionOptions,
    /// Whole-map probability of each tile.
    map_distribution: Vec<f64>,
    /// Tallies of all cells of each face; empty if nothing is pooled.
    faces: Vec<Vec<Tally>>,
    /// Slots of each block of 4x4 cells of a face.
    blocks: Vec<Vec<usize>>,
    /// Share of the diffuse density per face and tile; empty without compensation.
    diffuse: Vec<Vec<f64>>,
}

impl<'a> DistributionBuilder<'a> {
    pub(super) fn new(
        grid: SphericalGrid,
        counters: &'a Counters,
        options: DistributionOptions,
        environment: &Environment,
    ) -> Self {
        let energies = environment.tile_energies();
        let total: f64 = energies.iter().sum();
        let map_distribution = energies.iter().map(|e| e / total).collect();
        let mut slots_of_face = vec![Vec::new(); grid.face_count() as usize];
        let mut slots_of_block = BTreeMap::<_, Vec<_>>::new();
        for (slot, &cell) in counters.cells().iter().enumerate() {
            let (face, row, column) = grid.coordinates(cell);
            slots_of_face[face as usize].push(slot);
            slots_of_block.entry((face, row / POOL, column / POOL)).or_default().push(slot);
        }
        let blocks = slots_of_block.into_values().collect();
        let (faces, diffuse) = Default::default();
        let mut builder =
            Self { grid, counters, options, map_distribution, faces, blocks, diffuse };
        if options.recording.is_ratio() {
            builder.faces = slots_of_face.par_iter().map(|slots| builder.sum(slots)).collect();
        }
        if options.compensation > 0.0 && grid.faces {
            builder.diffuse = diffuse_shares(environment);
        }
        builder
    }

    /// Appends the distributions of the most visited cells and stores each cell's distribution index. Their number
    /// is limited by `room` bytes, which include the memory of building them. Indices do not depend on threads.
    pub(super) fn build(
        &self,
        room: usize,
        distributions: &mut TileDistributions,
        distribution_of_cell: &mut [u16],
    ) {
        let mut supports = vec![0; self.counters.cells().len()];
        let by_block = self.blocks.par_iter().flat_map_iter(|slots| {
            let mut found = Vec::with_capacity(slots.len());
            self.weigh(slots, usize::MAX, |slot, weights| {
                found.push((slot, weights.iter().filter(|w| **w > 0.0).count()));
            });
            found
        });
        for (slot, support) in by_block.collect::<Vec<_>>() {
            supports[slot] = support;
        }
        let tile_count = distributions.tile_count();
        let bytes = |slot: &usize| {
            TileDistributions::distribution_bytes(tile_count, supports[*slot] as u32)
        };
        let most = BYTES_AT_ONCE
            / (POOL * POOL) as usize
            / TileDistributions::distribution_bytes(tile_count, tile_count);
        let chunks = self.blocks.chunks(most.max(1));
        let pieces = chunks.clone().map(|blocks| blocks.iter().flatten().map(bytes).sum());
        let room = room.saturating_sub(self.memory_bytes() + pieces.max().unwrap_or(0));
        // The most visited cells have the lowest slots.
        let kept = fitting(&supports, room, tile_count);
        distributions.reserve_exact(kept, supports[..kept].iter().sum());
        for blocks in chunks {
            let pieces = blocks.par_iter().map(|slots| {
                let mut piece = TileDistributions::new(tile_count);
                let mut cells = Vec::with_capacity(slots.len());
                self.weigh(slots, kept, |slot, weights| {
                    if piece.push(weights).is_some() {
                        cells.push(self.counters.cells()[slot]);
                    }
                });
                (piece, cells)
            });
            for (piece, cells) in pieces.collect::<Vec<_>>() {
                let first = distributions.append(&piece);
                for (distribution, cell) in (first..).zip(cells) {
                    distribution_of_cell[cell as usize] = distribution as u16;
                }
            }
        }
    }

    /// Bytes held beside the counters and the distributions.
    fn memory_bytes(&self) -> usize {
        let tile_count = self.map_distribution.len();
        // Computed for eight threads whatever their number, on which distributions must not depend.
        let threads = 8;
        let tallies = (self.faces.len() + threads) * tile_count * size_of::<Tally>();
        let doubles = (self.diffuse.len() + 1 + threads) * tile_count * size_of::<f64>();
        tallies + doubles + 4 * self.counters.cells().len() * size_of::<usize>()
    }

    fn sum(&self, slots: &[usize]) -> Vec<Tally> {
        let mut sums = vec![Tally::default(); self.map_distribution.len()];
        for &slot in slots {
            for (sum, tally) in sums.iter_mut().zip(self.counters.tallies(slot)) {
                sum.tries += tally.tries;
                sum.weight += tally.weight;
            }
        }
        sums
    }

    /// Unnormalised distributions of a block's slots below `end`, one after the other.
    fn weigh(&self, slots: &[usize], end: usize, mut take: impl FnMut(usize, &[f64])) {
        let mut weights = Vec::with_capacity(self.map_distribution.len());
        let mut block = Vec::new();
        for &slot in slots.iter().filter(|slot| **slot < end) {
            let (face, ..) = self.grid.coordinates(self.counters.cells()[slot]);
            weights.clear();
            if self.options.recording.is_ratio() {
                if block.is_empty() {
                    block = self.sum(slots);
                }
                self.visible_energies(slot, &block, &self.faces[face as usize], &mut weights);
            } else {
                weights.extend(self.counters.tallies(slot).map(|t| t.weight));
            }
            self.compensate(face as usize, &mut weights);
            take(slot, &weights);
        }
    }

    /// Energy of each tile times a power of its visibility ratio. Where the tile has few tries, its ratio is pooled
    /// with the block's, and that with the face's.
    fn visible_energies(&self, slot: usize, block: &[Tally], face: &[Tally], out: &mut Vec<f64>) {
        let k = self.options.pooling_tries;
        let shrink = |tally: &Tally, ratio: f64| {
            let tries = tally.tries + k;
            if tries > 0.0 { (tally.weight + k * ratio) / tries } else { 0.0 }
        };
        let exponent = self.options.ratio_exponent;
        let own = self.counters.tallies(slot);
        out.extend(own.zip(block).zip(face).zip(&self.map_distribution).map(
            |(((own, block), face), map)| {
                let ratio = shrink(&own, shrink(block, shrink(face, 0.0)));
                // Most tiles of an interior are never seen: skip their power.
                if ratio > 0.0 { map * power(ratio, exponent) } else { 0.0 }
            },
        ));
    }

    fn compensate(&self, face: usize, weights: &mut [f64]) {
        let Some(diffuse) = self.diffuse.get(face) else { return };
        let total: f64 = weights.iter().sum();
        let excess =
            |weight: f64, share: f64| (weight - self.options.compensation * share * total).max(0.0);
        let left: f64 = weights.iter().zip(diffuse).map(|(w, d)| excess(*w, *d)).sum();
        if left >= MIN_COMPENSATED * total {
            weights.iter_mut().zip(diffuse).for_each(|(w, d)| *w = excess(*w, *d));
        }
    }
}

/// `base` to the power of `exponent`, computed by square roots for an exponent of 3/4.
fn power(base: f64, exponent: f64) -> f64 {
    if exponent == 0.75 { (base * base.sqrt()).sqrt() } else { base.powf(exponent) }
}

/// Number of the first distributions that fit into `room` bytes (and into 16-bit distribution indices).
fn fitting(supports: &[usize], room: usize, tile_count: u32) -> usize {
    let mut used = 0;
    let fits = |support: &&usize| {
        used += TileDistributions::distribution_bytes(tile_count, **support as u32);
        used <= room
    };
    supports.iter().take(usize::from(u16::MAX)).take_while(fits).count()
}

/// For each face axis, the share of a Lambertian's density that falls into each tile; last, the shares of
/// isotropic scattering in a medium.
fn diffuse_shares(environment: &Environment) -> Vec<Vec<f64>> {
    let tiles = 0..environment.tile_count();
    let share = |face| tiles.clone().map(move |tile| diffuse_share(environment, face, tile));
    (0..=MEDIUM_FACE).map(|face| share(face).collect()).collect()
}

/// Integral over a tile of the cosine with a face's axis over pi, or of the isotropic density, in closed form for
/// rectangles of longitude and polar angle.
fn diffuse_share(environment: &Environment, face: u32, tile: u32) -> f64 {
    let [u, v] = environment.extent_of_tile(tile);
    let azimuths = (u.start - 0.5) * TAU..(u.end - 0.5) * TAU;
    let thetas = v.start * PI..v.end * PI;
    let over = |range: &Range<f64>, integral: &dyn Fn(f64) -> f64| {
        integral(range.end) - integral(range.start)
    };
    let width = azimuths.end - azimuths.start;
    if face == MEDIUM_FACE {
        return width * over(&thetas, &|theta| -theta.cos()) / (4.0 * PI);
    }
    let axis = face_axis(face);
    if axis.y != 0.0 {
        let sine_squared = |theta: f64| 0.5 * theta.sin().powi(2);
        return width / PI
            * if axis.y > 0.0 {
                over(&thetas, &|theta| sine_squared(theta.min(FRAC_PI_2)))
            } else {
                over(&thetas, &|theta| -sine_squared(theta.max(FRAC_PI_2)))
            };
    }
    let toward = f64::from(axis.z).atan2(f64::from(axis.x));
    // The integral of the positive part of the cosine.
    let lit = |azimuth: f64| {
        let from_edge = azimuth - toward + FRAC_PI_2;
        let rest = from_edge.rem_euclid(TAU);
        2.0 * from_edge.div_euclid(TAU) + if rest < PI { 1.0 - rest.cos() } else { 2.0 }
    };
    let heights = over(&thetas, &|theta| 0.5 * (theta - theta.sin() * theta.cos()));
    over(&azimuths, &lit) * heights / PI
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::{EnvironmentOptions, sky};

    #[test]
    fn diffuse_shares_are_those_of_directions_spread_evenly() {
        const DIRECTIONS: u32 = 1 << 18;
        for rotation_radians in [0.0, 1.3, 6.0] {
            let map = sky::build("overcast", 130, 61).expect("a sky");
            let options = EnvironmentOptions { rotation_radians, ..EnvironmentOptions::default() };
            let environment = Environment::new(map, &options).expect("a sound map");
            let found = diffuse_shares(&environment);
            let mut expected = vec![vec![0.0; environment.tile_count() as usize]; found.len()];
            let golden = PI * (3.0 - 5.0_f64.sqrt());
            for i in 0..DIRECTIONS {
                let y = 1.0 - (f64::from(i) + 0.5) * 2.0 / f64::from(DIRECTIONS);
                let radius = (1.0 - y * y).sqrt();
                let (sin, cos) = (golden * f64::from(i)).sin_cos();
                let direction = glam::DVec3::new(radius * cos, y, radius * sin).as_vec3();
                let tile = environment.tile_of(direction) as usize;
                expected[MEDIUM_FACE as usize][tile] += 1.0 / f64::from(DIRECTIONS);
                for (face, shares) in expected.iter_mut().take(MEDIUM_FACE as usize).enumerate() {
                    let cosine = f64::from(direction.dot(face_axis(face as u32)).max(0.0));
                    shares[tile] += cosine * 4.0 / f64::from(DIRECTIONS);
                }
            }
            for (found, expected) in found.iter().zip(&expected) {
                assert!((found.iter().sum::<f64>() - 1.0).abs() < 1e-9);
                for (found, expected) in found.iter().zip(expected) {
                    assert!((found - expected).abs() < 1e-4, "{found} {expected}");
                }
            }
        }
    }
}
