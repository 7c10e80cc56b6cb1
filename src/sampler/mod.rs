//! Owen-scrambled Sobol points: one sequence per pixel, and even across the pixels of a tile.
//!
//! Every request for a pair of numbers is a fresh 2D Sobol (0,2)-sequence, Owen-scrambled and with
//! its index shuffled by hashing (Burley, *Practical Hash-based Owen Scrambling*, JCGT 9(4), 2020).
//! All arithmetic is on `u32`, so any device gets the same points.
//!
//! The pixels of a tile take digital shifts of one sequence. The shifts are a Sobol net in Z-order, shuffled for each pair
//! (after Ahmed and Wonka, *Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error via Hierarchical Ordering of
//! Pixels*, TOG 39(6), 2020): any aligned block of 4x4, 8x8 or 16x16 pixels has a point in each elementary interval of its share of
//! the unit square. Means over blocks, which outlast a denoiser, have less noise than those of independent pixels.

mod split_mix;

use serde::{Deserialize, Serialize};

pub use self::split_mix::SplitMix;

/// A stream of low-discrepancy numbers for one sample of one pixel.
#[derive(Debug, Clone)]
pub struct Sampler {
    /// Index of the point, bits reversed: the low [`SHIFT_BITS`] bits choose a digital shift of the sequence.
    reversed_index: u32,
    sequence_seed: u32,
    pair: u32,
    points: Points,
}

/// Bits of an index that choose a digital shift: the high ones, which no sample of a pixel needs.
const SHIFT_BITS: u32 = 8;
/// Those bits of a reversed index.
const SHIFT: u32 = (1 << SHIFT_BITS) - 1;
/// Edge of a tile in pixels, each of which has a shift of its own.
const TILE: u32 = 1 << (SHIFT_BITS / 2);

/// Offset, in pairs, of the streams of repeated estimates from the stream of their sample; no stream has as many
/// pairs.
pub(crate) const PAIRS_OF_ESTIMATES: u32 = 1 << 24;

/// The random numbers of a picture from one sample on: each generation of tile distributions has a scramble of
/// its own.
///
/// Distributions depend on earlier samples of the same pixel, and points of one scrambled sequence avoid each
/// other: given such a distribution, the next point of the same sequence would not be uniform. Distributions of
/// generation `g` depend on samples of earlier generations only. With a new scramble for each generation, an
/// estimate is independent of the distribution it is drawn from, and hence unbiased.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Sequence {
    /// Generation of the distributions in use; 0 without any.
    pub(crate) generation: u32,
    /// First sample of a pixel that is one of this sequence's points.
    pub(crate) first_sample: u32,
}

impl Sequence {
    /// The seed of all its streams.
    pub(crate) fn seed(self, seed: u32) -> u32 {
        seed ^ hash(self.generation)
    }

    /// The stream of a pixel's sample, which is one of this sequence.
    pub(crate) fn sampler(
        self,
        points: Points,
        seed: u32,
        pixel: [u32; 2],
        sample: u32,
    ) -> Sampler {
        points.sampler(self.seed(seed), pixel, sample - self.first_sample)
    }
}

/// Point set of a pixel's samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Points {
    /// Owen-scrambled Sobol points: those of all samples together are stratified in the unit square.
    #[default]
    Sobol,
    /// Independent random points, for comparison.
    Independent,
}

impl Points {
    /// The stream of sample `index` of the pixel at column and row `pixel`.
    pub fn sampler(self, seed: u32, pixel: [u32; 2], index: u32) -> Sampler {
        let even = Sampler::of_pixel(seed, pixel, index);
        let point = even.reversed_index;
        match self {
            Self::Sobol => even,
            // The first point of a newly scrambled sequence is uniform.
            Self::Independent => Sampler { points: self, ..even.independent(point) },
        }
    }
}

impl Sampler {
    /// The stream of point `index` of a sequence; the same three numbers give the same stream.
    pub fn new(seed: u32, sequence: u32, index: u32) -> Self {
        // With a bitwise sum, another seed would only exchange the numbers of sequences.
        let sequence_seed = hash(hash(sequence).wrapping_add(hash(seed)));
        let points = Points::Sobol;
        Self { reversed_index: index.reverse_bits(), sequence_seed, pair: 0, points }
    }

    /// The stream of sample `index` of the pixel at column `x` and row `y`: its tile's sequence, shifted by its place there.
    pub fn of_pixel(seed: u32, [x, y]: [u32; 2], index: u32) -> Self {
        // The pixel's low bits, each followed by a zero.
        let spread = |value: u32| {
            let low = value % TILE;
            let pairs = (low | (low << 2)) & 0x33;
            (pairs | (pairs << 1)) & 0x55
        };
        let place = spread(x) | (spread(y) << 1);
        let tile = ((y / TILE) << 16) | (x / TILE);
        Self::new(seed, tile, index ^ (place << (32 - SHIFT_BITS)))
    }

    /// The stream of one of `count` estimates of the same integral within a sample. The numbers of all estimates of
    /// all samples are points of one sequence, so that those of one sample are stratified, too. A single estimate
    /// takes the sample's own stream.
    pub(crate) fn of_estimate(&self, count: u32, estimate: u32) -> Self {
        if count == 1 {
            return self.clone();
        }
        let pair = self.pair.wrapping_add((count - 1).wrapping_mul(PAIRS_OF_ESTIMATES));
        let stream = Self { pair, ..self.clone() };
        match self.points {
            Points::Sobol => {
                let index = (self.reversed_index & !SHIFT).reverse_bits();
                let index = index.wrapping_mul(count).wrapping_add(estimate);
                let shift = self.reversed_index & SHIFT;
                Self { reversed_index: index.reverse_bits() ^ shift, ..stream }
            }
            Points::Independent => stream.independent(estimate),
        }
    }

    /// The stream of a scrambled sequence of its own.
    fn independent(self, index: u32) -> Self {
        Self { reversed_index: 0, sequence_seed: hash(self.sequence_seed ^ index), ..self }
    }

    /// The next pair as 32-bit fractions of one.
    pub fn next_pair_bits(&mut self) -> [u32; 2] {
        let seed = hash(self.sequence_seed.wrapping_add(self.pair.wrapping_mul(0x9e37_79b9)));
        self.pair += 1;
        let mixed = mixed_place(self.reversed_index & SHIFT, seed);
        let place = owen_scramble_reversed(mixed, !seed).reverse_bits() >> (32 - SHIFT_BITS);
        let point = owen_scramble_reversed(self.reversed_index & !SHIFT, seed).reverse_bits();
        // Points of the same sequence, with lower digits that are not those of its other points.
        let x = point ^ place.wrapping_mul(0x9e37_79b9);
        let y = second_dimension(point) ^ second_dimension(place).wrapping_mul(0x85eb_ca6b);
        let x = owen_scramble_reversed(x, hash(seed ^ 0x5851_f42d));
        let y = owen_scramble_reversed(y, hash(seed ^ 0x1405_7b7e));
        // Reverses the bits of both at once.
        let both = (u64::from(y) << 32 | u64::from(x)).reverse_bits();
        [(both >> 32) as u32, both as u32]
    }

    /// Skips `pairs` pairs.
    pub(crate) fn skip(&mut self, pairs: u32) {
        self.pair = self.pair.wrapping_add(pairs);
    }

    /// The next pair in `[0,1)`.
    #[inline]
    pub fn next_pair(&mut self) -> [f32; 2] {
        self.next_pair_bits().map(unit_from_bits)
    }
}

/// A 32-bit fraction as the f32 in `[0,1)` below it.
pub fn unit_from_bits(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// Integer hash with low bias (Wellons' `lowbias32`).
pub fn hash(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Owen scrambling of a bit-reversed number: each bit is flipped depending on the bits below it
/// (Laine and Karras 2011; constants by Vegdahl, *Building a Better LK Hash*, 2021).
fn owen_scramble_reversed(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// A place with its reversed Morton code's fine bits, which tell pixels within 4x4 apart, added to each other as the seed has
/// it: without this, pixels side by side would take the same half of one pair's unit square where they take the same half of
/// another's.
fn mixed_place(place: u32, seed: u32) -> u32 {
    place ^ ((place >> 1) & seed & 0x70) ^ ((place >> 2) & (seed >> 8) & 0x30)
}

/// Sobol's second dimension of `index`, bits reversed; the first is the index itself. It is the Pascal matrix modulo 2:
/// bit `j` is the parity of the index bits whose position contains `j` as a subset (Lucas' theorem),
/// a five-step transform (Ahmed, *An Implementation Algorithm of 2D Sobol Sequence Fast, Elegant,
/// and Compact*, EGSR 2024).
fn second_dimension(index: u32) -> u32 {
    let mut y = index;
    y ^= y >> 16;
    y ^= (y >> 8) & 0x00ff_00ff;
    y ^= (y >> 4) & 0x0f0f_0f0f;
    y ^= (y >> 2) & 0x3333_3333;
    y ^ ((y >> 1) & 0x5555_5555)
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn second_dimension_has_sobols_direction_numbers() {
        let expected = [0x8000_0000, 0xc000_0000, 0xa000_0000, 0xf000_0000, 0x8800_0000_u32];
        for (k, &direction) in expected.iter().enumerate() {
            assert_eq!(second_dimension(1 << k).reverse_bits(), direction, "column {k}");
        }
    }

    /// Whether each elementary interval of area `1 / points.len()`, of any shape, holds one of these points.
    fn is_net(points: &[[u32; 2]]) -> bool {
        let log2 = points.len().ilog2();
        let mut shapes = 0..=log2;
        shapes.all(|columns| {
            let part = |value: u32, log2: u32| u64::from(value) >> (32 - log2);
            let cell = |[x, y]: &[u32; 2]| (part(*x, columns) << 32) | part(*y, log2 - columns);
            points.iter().map(cell).collect::<HashSet<_>>().len() == points.len()
        })
    }

    /// Pair number `pair` of a stream.
    fn nth(mut sampler: Sampler, pair: usize) -> [u32; 2] {
        (0..=pair).map(|_| sampler.next_pair_bits()).last().expect("one pair")
    }

    #[test]
    fn samples_of_a_pixel_are_a_net() {
        for (seed, pixel) in [(0, [0, 0]), (1, [7, 77]), (9, [1234, 5])] {
            for pair in 0..3 {
                let point = |index| nth(Sampler::of_pixel(seed, pixel, index), pair);
                assert!(is_net(&(0..256).map(point).collect::<Vec<_>>()));
            }
        }
    }

    #[test]
    fn pixels_of_a_block_are_a_net_whichever_sample_it_is() {
        for (corner, edge) in [([16, 32], 16), ([24, 32], 8), ([4, 12], 4)] {
            for (index, pair) in [(0, 0), (1, 2), (5, 1), (1_000, 4)] {
                let place = |at: u32| [corner[0] + at % edge, corner[1] + at / edge];
                let point = |at| nth(Sampler::of_pixel(3, place(at), index), pair);
                let points: Vec<_> = (0..edge * edge).map(point).collect();
                assert!(is_net(&points), "{edge} pixels wide, sample {index}, pair {pair}");
                // Blocks that do not begin where one in Z-order does have no such points.
                let beside = |at| [corner[0] + 1 + at % edge, corner[1] + at / edge];
                let point = |at| nth(Sampler::of_pixel(3, beside(at), index), pair);
                assert!(edge < 8 || !is_net(&(0..edge * edge).map(point).collect::<Vec<_>>()));
            }
        }
    }

    /// Of points that begin a sequence, or go on where a power of two ended, each interval has as many.
    #[test]
    fn estimates_of_all_samples_are_even_together_and_those_of_one_among_themselves() {
        for (count, columns) in [(4, 2), (4, 1), (4, 4), (8, 4), (2, 1)] {
            let mut seen = HashSet::new();
            for index in 0..64 / count {
                let sampler = Sampler::new(3, 5, index);
                let mut seen_of_sample = HashSet::new();
                for estimate in 0..count {
                    let [x, y] = sampler.of_estimate(count, estimate).next_pair_bits();
                    let rows = count / columns;
                    let cell = |x: u32, parts: u32| (u64::from(x) * u64::from(parts)) >> 32;
                    assert!(seen_of_sample.insert((cell(x, columns), cell(y, rows))));
                    assert!(seen.insert((cell(x, 8), cell(y, 8))));
                }
            }
        }
        for points in [Points::Sobol, Points::Independent] {
            let mut sampler = points.sampler(3, [5, 0], 9);
            let mut single = sampler.of_estimate(1, 0);
            assert_eq!(sampler.next_pair_bits(), single.next_pair_bits());
        }
        // Independent ones fall into the same half as often as not.
        let halves = (0..1000).filter(|index| {
            let sampler = Points::Independent.sampler(3, [5, 0], *index);
            let [a, b] =
                [0, 1].map(|estimate| sampler.of_estimate(2, estimate).next_pair_bits()[0]);
            (a ^ b) >> 31 == 0
        });
        let same = halves.count();
        assert!((420..580).contains(&same), "{same} of 1000");
    }

    /// Neither those of a pixel, nor those of one place in tiles side by side, nor, over the pixels of a tile, two pairs.
    #[test]
    fn pairs_and_tiles_are_uncorrelated() {
        let (mut single, mut of_tile) = (0.0_f64, 0.0_f64);
        let tiles = 64;
        let [product, numbers] = [
            |a: [f32; 2], b: [f32; 2]| f64::from((a[0] - 0.5) * (b[0] - 0.5)),
            |a: [f32; 2], b: [f32; 2]| f64::from((a[1] - 0.5) * (b[0] - 0.5)),
        ];
        for tile in 0..tiles {
            let mut sum = 0.0;
            for place in 0..TILE * TILE {
                let [x, y] = [tile * TILE + place % TILE, place / TILE];
                let mut here = Sampler::of_pixel(5, [x, y], 3);
                let beside = Sampler::of_pixel(5, [x + TILE * tiles, y], 3).next_pair();
                let (first, second) = (here.next_pair(), here.next_pair());
                single += product(first, beside) + product(first, second) + numbers(first, first);
                sum += product(first, second);
            }
            of_tile += sum * sum;
        }
        let points = f64::from(tiles * TILE * TILE);
        // Each product has variance 1/144; five standard errors of the sum of 3n of them.
        let limit = 5.0 * (3.0 * points / 144.0).sqrt();
        assert!(single.abs() < limit, "{single} against {limit}");
        // As many independent products would come to 1 on average, with a standard error of (2 / tiles)^(1/2).
        let relative = of_tile / points * 144.0;
        assert!(relative < 1.0 + 5.0 * (2.0 / f64::from(tiles)).sqrt(), "{relative}");
    }
}
