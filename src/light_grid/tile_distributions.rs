//! Probability distributions over tiles, sparse and exact.

use std::ops::Range;

use crate::prefetch::prefetch_all;
use crate::sampler::unit_from_bits;

/// The chosen tile, its probability, and the remainder of the random number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TileChoice {
    /// Tile index.
    pub tile: u32,
    /// Probability of the choice: the ratio of the integers that were searched.
    pub probability: f32,
    /// Position of the random number in the tile's share: a new uniform number, as a 32-bit fraction of one.
    pub remainder: u32,
}

/// Many discrete distributions over the same tiles, in flat arrays (distribution 0 is the whole map's).
///
/// A distribution keeps only the tiles it can choose: interiors see few. It holds a running sum in units of
/// `2^-32`, so that sampling is a binary search that keeps the order, and therefore the
/// stratification, of Sobol points; a bit mask with ranks finds a tile's entry in constant time.
#[derive(Debug, Clone, PartialEq)]
pub struct TileDistributions {
    tile_count: u32,
    pub(crate) words_per_distribution: u32,
    /// First entry of each distribution, and one more.
    pub(crate) starts: Vec<u32>,
    /// Bit masks of the tiles that each distribution can choose, `words_per_distribution` words each.
    pub(crate) masks: Vec<u64>,
    /// Entries before each word of the mask.
    pub(crate) ranks: Vec<u16>,
    /// Tile of each entry, ascending within a distribution.
    pub(crate) tiles: Vec<u16>,
    /// Largest 32-bit number that chooses this entry; ends with `u32::MAX` in every distribution.
    pub(crate) last: Vec<u32>,
}

impl TileDistributions {
    /// No distributions yet, over `tile_count` tiles (at most 65536).
    pub fn new(tile_count: u32) -> Self {
        assert!((1..=65536).contains(&tile_count), "tile indices are 16 bits wide");
        let words_per_distribution = tile_count.div_ceil(64);
        let (masks, ranks, tiles, last) = Default::default();
        Self { tile_count, words_per_distribution, starts: vec![0], masks, ranks, tiles, last }
    }

    /// Number of distributions.
    pub fn len(&self) -> u32 {
        self.starts.len() as u32 - 1
    }

    /// Whether there is no distribution.
    pub fn is_empty(&self) -> bool {
        self.starts.len() == 1
    }

    /// Number of tiles the distributions are over.
    pub fn tile_count(&self) -> u32 {
        self.tile_count
    }

    /// Number of tiles distribution `distribution` can choose.
    pub fn support(&self, distribution: u32) -> u32 {
        self.range(distribution).len() as u32
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.starts.capacity() * 4
            + self.masks.capacity() * 8
            + self.ranks.capacity() * 2
            + self.tiles.capacity() * 2
            + self.last.capacity() * 4
    }

    /// Bytes one more distribution over `support` tiles takes.
    pub fn distribution_bytes(tile_count: u32, support: u32) -> usize {
        4 + tile_count.div_ceil(64) as usize * 10 + support as usize * 6
    }

    /// Reserves exactly this much, so that growing never holds twice the memory.
    pub fn reserve_exact(&mut self, distributions: usize, entries: usize) {
        self.starts.reserve_exact(distributions);
        self.masks.reserve_exact(distributions * self.words_per_distribution as usize);
        self.ranks.reserve_exact(distributions * self.words_per_distribution as usize);
        self.tiles.reserve_exact(entries);
        self.last.reserve_exact(entries);
    }

    /// Appends the distribution proportional to `weights` (one per tile, finite, not negative) and gives its
    /// index; `None`, and nothing appended, when no weight is positive.
    ///
    /// Every tile with a positive weight gets at least `2^-32`, so none becomes unreachable.
    pub fn push(&mut self, weights: &[f64]) -> Option<u32> {
        assert_eq!(weights.len(), self.tile_count as usize, "one weight per tile");
        let total: f64 = weights.iter().filter(|w| **w > 0.0).sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let first = self.tiles.len();
        let support = weights.iter().filter(|w| **w > 0.0).count();
        let units = 4_294_967_296.0 - support as f64;
        let base = self.masks.len();
        self.masks.resize(base + self.words_per_distribution as usize, 0);
        let (mut sum, mut largest) = (0_u64, (0.0, 0));
        for (tile, &weight) in weights.iter().enumerate().filter(|(_, w)| **w > 0.0) {
            sum += 1 + (weight / total * units) as u64;
            if weight > largest.0 {
                largest = (weight, self.tiles.len());
            }
            self.masks[base + tile / 64] |= 1 << (tile % 64);
            self.tiles.push(tile as u16);
            self.last.push((sum - 1).min(u64::from(u32::MAX)) as u32);
        }
        // What rounding left over goes to the largest, where it is the smallest relative error.
        let rest = u32::MAX - self.last[self.last.len() - 1];
        for last in &mut self.last[largest.1..] {
            *last += rest;
        }
        let mut rank = 0;
        for word in &self.masks[base..] {
            self.ranks.push(rank as u16);
            rank += word.count_ones();
        }
        debug_assert_eq!(self.tiles.len() - first, support);
        self.starts.push(self.tiles.len() as u32);
        Some(self.len() - 1)
    }

    /// Appends all distributions of another set over the same tiles; gives the index of the first of them.
    pub fn append(&mut self, other: &Self) -> u32 {
        assert_eq!(self.tile_count, other.tile_count, "the same tiles");
        let (first, entries) = (self.len(), self.tiles.len() as u32);
        self.starts.extend(other.starts[1..].iter().map(|start| entries + start));
        self.masks.extend_from_slice(&other.masks);
        self.ranks.extend_from_slice(&other.ranks);
        self.tiles.extend_from_slice(&other.tiles);
        self.last.extend_from_slice(&other.last);
        first
    }

    /// Prefetches the sums that [`Self::sample`] searches.
    pub(crate) fn prefetch(&self, distribution: u32) {
        prefetch_all(&self.last[self.range(distribution)]);
        prefetch_all(&self.tiles[self.range(distribution)]);
    }

    /// Chooses a tile of distribution `distribution` with a uniform 32-bit number. `finer` is the bits below
    /// it, without which there would be no remainder of a tile that has few units of `2^-32`.
    pub fn sample(&self, distribution: u32, bits: u32, finer: u32) -> TileChoice {
        let range = self.range(distribution);
        let last = &self.last[range.clone()];
        let entry = last.partition_point(|&l| l < bits);
        let low = if entry == 0 { 0 } else { last[entry - 1] + 1 };
        let count = (last[entry] - low) as f32 + 1.0;
        let place = (bits - low) as f32 + unit_from_bits(finer);
        // Rounding may carry the quotient to 1, which belongs to the next tile.
        let remainder = (place / count).min(1.0 - f32::EPSILON / 2.0);
        TileChoice {
            tile: u32::from(self.tiles[range.start + entry]),
            probability: count * (1.0 / 4_294_967_296.0),
            remainder: ((remainder * 16_777_216.0) as u32) << 8 | finer & 0xff,
        }
    }

    /// Probability that distribution `distribution` chooses `tile`.
    pub fn probability(&self, distribution: u32, tile: u32) -> f32 {
        let word = (distribution * self.words_per_distribution + tile / 64) as usize;
        let bit = tile % 64;
        if self.masks[word] >> bit & 1 == 0 {
            return 0.0;
        }
        let rank = self.ranks[word] + (self.masks[word] & ((1 << bit) - 1)).count_ones() as u16;
        let entry = self.range(distribution).start + rank as usize;
        let low = if rank == 0 { 0 } else { self.last[entry - 1] + 1 };
        ((self.last[entry] - low) as f32 + 1.0) * (1.0 / 4_294_967_296.0)
    }

    fn range(&self, distribution: u32) -> Range<usize> {
        let at = distribution as usize;
        self.starts[at] as usize..self.starts[at + 1] as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn distributions_of(weights: &[f64]) -> TileDistributions {
        let mut distributions = TileDistributions::new(weights.len() as u32);
        distributions.push(&vec![1.0; weights.len()]).expect("uniform");
        distributions.push(weights).expect("positive");
        distributions
    }

    #[test]
    fn probabilities_are_the_weights_and_sum_to_one() {
        let mut weights: Vec<f64> = (0..512).map(|t| f64::from(t * 7919 % 101)).collect();
        weights[300] = 1e9;
        weights[301] = 1e-12;
        let distributions = distributions_of(&weights);
        let total: f64 = weights.iter().sum();
        let mut sum = 0.0;
        for (tile, weight) in weights.iter().enumerate() {
            let p = f64::from(distributions.probability(1, tile as u32));
            assert_eq!(p > 0.0, *weight > 0.0);
            assert!((p - weight / total).abs() < 520.0 / 4_294_967_296.0 + 1e-7 * p, "{tile}: {p}");
            sum += p;
        }
        assert!((sum - 1.0).abs() < 1e-6);
    }

    #[test]
    fn sample_agrees_with_probability_at_every_border() {
        let weights: Vec<f64> =
            (0..100).map(|t| if t % 3 == 0 { 0.0 } else { f64::from(t) }).collect();
        let distributions = distributions_of(&weights);
        let mut previous = 0;
        for step in 0..4096_u32 {
            for bits in [step << 20, (step << 20) + 0xf_ffff] {
                let choice = distributions.sample(1, bits, 0);
                assert!(choice.tile >= previous, "order is kept");
                previous = choice.tile;
                assert_eq!(choice.probability, distributions.probability(1, choice.tile));
            }
        }
        assert_eq!(distributions.sample(1, 0, 0).tile, 1);
        assert_eq!(distributions.sample(1, u32::MAX, 0).tile, 98);
    }

    /// A tile of a single unit is met by one number only: its remainder comes from the finer bits.
    #[test]
    fn remainders_are_uniform_however_small_a_tile_s_share() {
        for share in [1e-12, 1e-6, 0.1, 1.0] {
            let distributions = distributions_of(&[1.0 - share, share]);
            let range = (distributions.probability(1, 1) * 4_294_967_296.0) as u64;
            let mut counts = [0.0; 16];
            for i in 0..4096_u64 {
                let bits = u64::from(u32::MAX) - i * range / 4096;
                let finer = crate::sampler::hash(i as u32);
                let choice = distributions.sample(1, bits as u32, finer);
                assert_eq!(choice.tile, 1);
                counts[(choice.remainder >> 28) as usize] += 1.0;
            }
            let test = crate::metrics::hypothesis::chi_square_test(&counts, &[256.0; 16], 1e-4)
                .expect("enough");
            assert!(test.passed, "{share}: {test:?} {counts:?}");
        }
    }

    #[test]
    fn one_tile_gets_everything_and_nothing_gets_no_distribution() {
        let mut distributions = TileDistributions::new(70);
        assert_eq!(distributions.push(&[0.0; 70]), None);
        let mut weights = [0.0; 70];
        weights[69] = 1e-300;
        assert_eq!(distributions.push(&weights), Some(0));
        assert_eq!(distributions.probability(0, 69), 1.0);
        let choice = distributions.sample(0, u32::MAX, u32::MAX);
        assert_eq!((choice.tile, choice.probability), (69, 1.0));
        assert_eq!(choice.remainder, u32::MAX);
    }

    #[test]
    fn appended_distributions_are_the_same() {
        let mut all = distributions_of(&[3.0, 0.0, 1.0]);
        let mut other = distributions_of(&[0.0, 2.0, 5.0]);
        assert_eq!(all.append(&other), 2);
        other = distributions_of(&[3.0, 0.0, 1.0]);
        for weights in [[1.0; 3], [0.0, 2.0, 5.0]] {
            other.push(&weights);
        }
        assert_eq!(all, other);
    }

    #[test]
    fn memory_is_as_announced() {
        let mut distributions = TileDistributions::new(512);
        distributions.reserve_exact(3, 512 * 3);
        for _ in 0..3 {
            distributions.push(&[1.0; 512]);
        }
        assert_eq!(
            distributions.memory_bytes(),
            4 + 3 * TileDistributions::distribution_bytes(512, 512)
        );
    }
}
