//! Which tile distribution a point uses, and the choice of a tile by it.

use super::cells::SphericalGrid;
use super::tile_distributions::{TileChoice, TileDistributions};
use crate::sampler::hash;

/// Index of the distribution proportional to the whole map's tile energies.
pub const WHOLE_MAP: u32 = 0;

/// The tile distributions and which of them a point uses.
#[derive(Debug, Clone)]
pub struct LightGrid {
    pub(super) distributions: TileDistributions,
    /// `None` if every point uses the whole map.
    pub(crate) cells: Option<Cells>,
    /// Share of samples, in 256ths, that follow the whole map's distribution.
    pub(crate) whole_map_share: u32,
    /// Generation of the distributions: 0 without learning, and increasing by one each time they are rebuilt. The
    /// samples that they were built from followed distributions of lower generations: see
    /// [`crate::sampler::Sequence`].
    pub(crate) generation: u32,
}

/// The cells of a grid.
#[derive(Debug, Clone)]
pub(crate) struct Cells {
    pub(crate) grid: SphericalGrid,
    /// Distribution of each cell; [`WHOLE_MAP`] where nothing was learned.
    pub(crate) distribution_of_cell: Vec<u16>,
}

impl LightGrid {
    /// The plain sampler: every point uses the whole map. `energies` holds one energy per tile; a
    /// black map gives `None`, for there is nothing to sample.
    pub fn whole_map(energies: &[f64]) -> Option<Self> {
        let mut distributions = TileDistributions::new(energies.len() as u32);
        distributions.reserve_exact(1, energies.iter().filter(|e| **e > 0.0).count());
        distributions.push(energies)?;
        Some(Self { distributions, cells: None, whole_map_share: 0, generation: 0 })
    }

    /// Chooses a tile at a point of distribution `distribution` with the first of two uniform 32-bit numbers;
    /// the second stays unused but for a hash of it, the bits below the first. A share of samples follows the
    /// whole map's distribution (defensive mixture, Hesterberg 1995), which bounds the estimate where a
    /// distribution is wrong and finds what it missed.
    pub fn sample(&self, distribution: u32, bits: [u32; 2]) -> TileChoice {
        self.sample_sharing(distribution, bits, self.whole_map_share)
    }

    /// [`Self::sample`] with another share, in 256ths, of the whole map's distribution.
    pub fn sample_sharing(
        &self,
        distribution: u32,
        [bits, other_bits]: [u32; 2],
        whole_map_share: u32,
    ) -> TileChoice {
        let finer = hash(bits ^ hash(other_bits));
        if distribution == WHOLE_MAP || whole_map_share == 0 {
            return self.distributions.sample(distribution, bits, finer);
        }
        let (by_whole_map, bits) = split(bits, finer, whole_map_share);
        let [own, other] =
            if by_whole_map { [WHOLE_MAP, distribution] } else { [distribution, WHOLE_MAP] };
        let choice = self.distributions.sample(own, bits, finer);
        let other = self.distributions.probability(other, choice.tile);
        let (whole_map, learned) =
            if by_whole_map { (choice.probability, other) } else { (other, choice.probability) };
        TileChoice { probability: mixed(whole_map, learned, whole_map_share), ..choice }
    }

    /// Probability that [`Self::sample`] chooses `tile` at a point of distribution `distribution`.
    pub fn probability(&self, distribution: u32, tile: u32) -> f32 {
        let learned = self.distributions.probability(distribution, tile);
        if distribution == WHOLE_MAP || self.whole_map_share == 0 {
            return learned;
        }
        mixed(self.distributions.probability(WHOLE_MAP, tile), learned, self.whole_map_share)
    }

    /// The distributions over the map's tiles; distribution 0 is [`WHOLE_MAP`]. [`Self::sample`] mixes them.
    pub fn distributions(&self) -> &TileDistributions {
        &self.distributions
    }

    /// The grid, unless every point uses the whole map.
    pub fn grid(&self) -> Option<&SphericalGrid> {
        self.cells.as_ref().map(|cells| &cells.grid)
    }

    /// Distribution of a cell; [`WHOLE_MAP`] without a grid.
    pub fn distribution_of_cell(&self, cell: u32) -> u32 {
        self.cells
            .as_ref()
            .map_or(WHOLE_MAP, |cells| u32::from(cells.distribution_of_cell[cell as usize]))
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.distributions.memory_bytes()
            + self.cells.as_ref().map_or(0, |c| c.distribution_of_cell.capacity() * 2)
    }

    /// The same grid with the distributions of all cells replaced by arbitrary ones, in which about half of
    /// the tiles cannot be chosen: for tests that unbiasedness does not depend on learning.
    pub fn with_garbage_distributions(
        grid: SphericalGrid,
        energies: &[f64],
        seed: u32,
    ) -> Option<Self> {
        let mut result = Self::whole_map(energies)?;
        for distribution in 1..=64_u32 {
            let weights: Vec<f64> = (0..energies.len() as u32)
                .map(|tile| hash(seed ^ hash(distribution << 16 | tile)))
                .map(|h| if h & 1 == 0 { 0.0 } else { f64::from(h >> 8) })
                .collect();
            result.distributions.push(&weights);
        }
        let count = result.distributions.len();
        let of_cell = |cell: u32| (hash(seed.wrapping_add(cell)) % count) as u16;
        let distribution_of_cell = (0..grid.cell_count()).map(of_cell).collect();
        result.cells = Some(Cells { grid, distribution_of_cell });
        result.whole_map_share = 32;
        result.generation = 1;
        Some(result)
    }
}

/// Splits a uniform number at a share in 256ths: whether it lies below, and its position in its part as a uniform
/// number. Both parts keep the order, hence the stratification; `finer` are the bits below it.
fn split(bits: u32, finer: u32, share: u32) -> (bool, u32) {
    let edge = u64::from(share) << 24;
    let is_below = u64::from(bits) < edge;
    let (rest, width) =
        if is_below { (bits, share) } else { ((u64::from(bits) - edge) as u32, 256 - share) };
    // (256 rest + finer) / width, in 32 bits as a GPU has them.
    let (whole, left) = (rest / width, rest % width);
    (is_below, (whole << 8) + ((left << 8) | finer & 0xff) / width)
}

/// A probability of the whole map's distribution and one of a learned distribution, mixed.
fn mixed(whole_map: f32, learned: f32, share: u32) -> f32 {
    let share = share as f32 * (1.0 / 256.0);
    share * whole_map + (1.0 - share) * learned
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metrics::hypothesis::chi_square_test;

    const GRID: SphericalGrid =
        SphericalGrid { center: glam::Vec3::ZERO, columns: 4, rows: 2, faces: true, medium: false };

    #[test]
    fn samples_follow_the_mixture_that_gives_their_probability() {
        let energies: Vec<f64> = (0..200).map(|tile| f64::from(tile % 7 * tile)).collect();
        let grid =
            LightGrid::with_garbage_distributions(GRID, &energies, 3).expect("a map with light");
        assert!(grid.whole_map_share > 0);
        const COUNT: u32 = 200_000;
        for distribution in [WHOLE_MAP, 1, 2, 3] {
            let mut found = vec![0.0; energies.len()];
            for i in 0..COUNT {
                let choice = grid.sample(distribution, [hash(i), hash(!i)]);
                assert_eq!(choice.probability, grid.probability(distribution, choice.tile));
                found[choice.tile as usize] += 1.0;
            }
            let expected: Vec<f64> = (0..energies.len() as u32)
                .map(|tile| f64::from(grid.probability(distribution, tile)) * f64::from(COUNT))
                .collect();
            assert!((expected.iter().sum::<f64>() / f64::from(COUNT) - 1.0).abs() < 1e-6);
            let test = chi_square_test(&found, &expected, 1e-3).expect("enough samples");
            assert!(test.passed, "distribution {distribution}: {test:?}");
        }
    }

    #[test]
    fn both_parts_of_a_split_are_uniform_and_in_order() {
        for share in [1, 32, 128, 200, 255, 256] {
            for (start, end, is_below) in [(0, share, true), (share, 256, false)] {
                let (mut last, count) = (0, 1_u64 << 12);
                for i in 0..count * u64::from(start < end) {
                    let bits = ((u64::from(start) << 24)
                        + i * (u64::from(end - start) << 24) / count)
                        as u32;
                    let (found, part) = split(bits, hash(i as u32), share);
                    assert_eq!(found, is_below);
                    assert!(part >= last, "order is kept");
                    let expected = i as f64 / count as f64;
                    assert!((f64::from(part) / 4_294_967_296.0 - expected).abs() < 1e-6);
                    last = part;
                }
            }
        }
        assert_eq!(split(u32::MAX, u32::MAX, 32), (false, u32::MAX));
        assert_eq!(split((32 << 24) - 1, u32::MAX, 32), (true, u32::MAX));
    }

    #[test]
    fn what_is_missing_in_a_distribution_is_found_by_the_whole_maps_share() {
        let grid =
            LightGrid::with_garbage_distributions(GRID, &[1.0; 64], 5).expect("a map with light");
        let unreachable = |tile: &u32| grid.distributions().probability(1, *tile) == 0.0;
        let tile = (0..64).find(unreachable).expect("garbage has gaps");
        let share = grid.whole_map_share as f32 / 256.0;
        assert!((grid.probability(1, tile) * 64.0 / share - 1.0).abs() < 1e-5);
    }
}
