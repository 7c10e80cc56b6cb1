//! Owen-scrambled Sobol points, one sequence per pixel.
//!
//! Every request for a pair of numbers is a fresh 2D Sobol (0,2)-sequence, Owen-scrambled and with
//! its index shuffled by hashing (Burley, *Practical Hash-based Owen Scrambling*, JCGT 9(4), 2020).
//! All arithmetic is on `u32`, so any device gets the same points.

mod split_mix;

use serde::{Deserialize, Serialize};

pub use self::split_mix::SplitMix;

/// A stream of low-discrepancy numbers for one sample of one pixel.
#[derive(Debug, Clone)]
pub struct Sampler {
    /// Index of the sample, bits reversed.
    reversed_index: u32,
    pixel_seed: u32,
    pair: u32,
    points: Points,
}

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
    pub(crate) fn sampler(self, points: Points, seed: u32, pixel: u32, sample: u32) -> Sampler {
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
    /// The stream of sample `index` of pixel `pixel`.
    pub fn sampler(self, seed: u32, pixel: u32, index: u32) -> Sampler {
        let even = Sampler::new(seed, pixel, index);
        match self {
            Self::Sobol => even,
            // The first point of a newly scrambled sequence is uniform.
            Self::Independent => Sampler { points: self, ..even.independent(index) },
        }
    }
}

impl Sampler {
    /// The stream of sample `index` of pixel `pixel`; the same three numbers give the same stream.
    pub fn new(seed: u32, pixel: u32, index: u32) -> Self {
        // With a bitwise sum, another seed would only exchange the numbers of pixels.
        let pixel_seed = hash(hash(pixel).wrapping_add(hash(seed)));
        let points = Points::Sobol;
        Self { reversed_index: index.reverse_bits(), pixel_seed, pair: 0, points }
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
                let index = self.reversed_index.reverse_bits();
                let index = index.wrapping_mul(count).wrapping_add(estimate);
                Self { reversed_index: index.reverse_bits(), ..stream }
            }
            Points::Independent => stream.independent(estimate),
        }
    }

    /// The stream of a scrambled sequence of its own.
    fn independent(self, index: u32) -> Self {
        Self { reversed_index: 0, pixel_seed: hash(self.pixel_seed ^ index), ..self }
    }

    /// The next pair as 32-bit fractions of one.
    pub fn next_pair_bits(&mut self) -> [u32; 2] {
        let seed = hash(self.pixel_seed.wrapping_add(self.pair.wrapping_mul(0x9e37_79b9)));
        self.pair += 1;
        let shuffled = owen_scramble_reversed(self.reversed_index, seed).reverse_bits();
        let [x, y] = sobol_reversed(shuffled);
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

/// First two Sobol dimensions of `index`, bits reversed. The second is the Pascal matrix modulo 2:
/// bit `j` is the parity of the index bits whose position contains `j` as a subset (Lucas' theorem),
/// a five-step transform (Ahmed, *An Implementation Algorithm of 2D Sobol Sequence Fast, Elegant,
/// and Compact*, EGSR 2024).
fn sobol_reversed(index: u32) -> [u32; 2] {
    let mut y = index;
    y ^= y >> 16;
    y ^= (y >> 8) & 0x00ff_00ff;
    y ^= (y >> 4) & 0x0f0f_0f0f;
    y ^= (y >> 2) & 0x3333_3333;
    y ^= (y >> 1) & 0x5555_5555;
    [index, y]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn second_dimension_has_sobols_direction_numbers() {
        let expected = [0x8000_0000, 0xc000_0000, 0xa000_0000, 0xf000_0000, 0x8800_0000_u32];
        for (k, &direction) in expected.iter().enumerate() {
            assert_eq!(sobol_reversed(1 << k)[1].reverse_bits(), direction, "column {k}");
        }
    }

    #[test]
    fn every_elementary_interval_of_a_power_of_two_holds_one_point() {
        for (seed, pixel) in [(0, 0), (1, 77), (9, 12_345)] {
            for pair in 0..3 {
                let points: Vec<[u32; 2]> = (0..256)
                    .map(|i| {
                        let mut sampler = Sampler::new(seed, pixel, i);
                        (0..=pair).map(|_| sampler.next_pair_bits()).last().expect("one pair")
                    })
                    .collect();
                for columns_log2 in 0..=8_u32 {
                    let mut seen = [false; 256];
                    for [x, y] in &points {
                        let column = u64::from(*x) >> (32 - columns_log2);
                        let row = u64::from(*y) >> (24 + columns_log2);
                        let cell = (column << (8 - columns_log2)) + row;
                        assert!(!std::mem::replace(&mut seen[cell as usize], true));
                    }
                }
            }
        }
    }

    /// Of points that begin a sequence, or go on where a power of two ended, each interval has as many.
    #[test]
    fn estimates_of_all_samples_are_even_together_and_those_of_one_among_themselves() {
        for (count, columns) in [(4, 2), (4, 1), (4, 4), (8, 4), (2, 1)] {
            let mut seen = std::collections::HashSet::new();
            for index in 0..64 / count {
                let sampler = Sampler::new(3, 5, index);
                let mut seen_of_sample = std::collections::HashSet::new();
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
            let mut sampler = points.sampler(3, 5, 9);
            let mut single = sampler.of_estimate(1, 0);
            assert_eq!(sampler.next_pair_bits(), single.next_pair_bits());
        }
        // Independent ones fall into the same half as often as not.
        let halves = (0..1000).filter(|index| {
            let sampler = Points::Independent.sampler(3, 5, *index);
            let [a, b] =
                [0, 1].map(|estimate| sampler.of_estimate(2, estimate).next_pair_bits()[0]);
            (a ^ b) >> 31 == 0
        });
        let same = halves.count();
        assert!((420..580).contains(&same), "{same} of 1000");
    }

    #[test]
    fn pairs_and_pixels_are_uncorrelated() {
        let mut sum = 0.0_f64;
        let count = 4096;
        for pixel in 0..count {
            let mut a = Sampler::new(5, pixel, 3);
            let mut b = Sampler::new(5, pixel + 1, 3);
            let ([x, _], [y, _]) = (a.next_pair(), b.next_pair());
            let [z, _] = a.next_pair();
            sum += f64::from((x - 0.5) * (y - 0.5)) + f64::from((x - 0.5) * (z - 0.5));
        }
        // Each product has variance 1/144; five standard errors of the sum of 2n of them.
        let limit = 5.0 * (2.0 * f64::from(count) / 144.0).sqrt();
        assert!(sum.abs() < limit, "{sum} against {limit}");
    }
}
