//! Random numbers spent on one choice after another, in integers.

use crate::sampler::hash;

/// The part of the unit interval that some choices have left: so many units of one size.
///
/// As in range coding (Martin, *Range encoding*, 1979) an interval is cut where a share of it ends,
/// rounded to a unit, and units are halved as long as 32 bits can count them. So the probability of
/// a chain of choices is a ratio of integers, whatever the shares were rounded to; whoever cuts at
/// the same shares finds the same one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Interval {
    /// From `2^31` up.
    width: u32,
    /// A power of two.
    unit: f32,
}

impl Interval {
    /// Nothing chosen yet.
    pub(super) const WHOLE: Self = Self { width: 1 << 31, unit: 1.0 / 2_147_483_648.0 };

    /// Probability of the choices that left this.
    pub(super) fn probability(&self) -> f32 {
        self.width as f32 * self.unit
    }

    /// Chooses: the first `share / 2^32` or the rest.
    pub(super) fn choose(&mut self, share: u32, first: bool) {
        let cut = self.cut(share);
        self.keep(if first { cut } else { self.width - cut });
    }

    /// Units of the first of two parts: at least one, and of [`share_of`] not all.
    fn cut(&self, share: u32) -> u32 {
        ((u64::from(self.width) * u64::from(share)) >> 32) as u32 + 1
    }

    /// Keeps `width` units; returns how often they were halved then.
    fn keep(&mut self, width: u32) -> u32 {
        let halvings = width.leading_zeros();
        self.width = width << halvings;
        self.unit *= f32::from_bits((127 - halvings) << 23);
        halvings
    }
}

/// A share in `[0,1]` in units of `2^-32`, such that neither it nor the rest is without chance.
pub(super) fn share_of(share: f32) -> u32 {
    (share.min(1.0 - f32::EPSILON) * 4_294_967_296.0) as u32
}

/// All there is, in units of `2^-32`.
pub(super) const ALL: u32 = u32::MAX;

/// A uniform random number and what choices made with it have left.
///
/// Order is kept: larger numbers choose later parts. Halved units take bits hashed from the number,
/// 32 in all, so that whatever has a chance of more than `2^-32` leaves 31 bits or more.
#[derive(Debug, Clone, Copy)]
pub(super) struct Draw {
    left: Interval,
    /// Less than the interval's width.
    offset: u32,
    /// Bits below those of `offset`.
    below: u32,
}

impl Draw {
    /// Begins with a uniform 32-bit number.
    pub(super) fn new(bits: u32) -> Self {
        Self { left: Interval::WHOLE, offset: bits >> 1, below: hash(bits) }
    }

    /// Whether the first `share / 2^32` of what is left is chosen.
    pub(super) fn chooses_first(&mut self, share: u32) -> bool {
        let cut = self.left.cut(share);
        let first = self.offset < cut;
        let halvings = if first {
            self.left.keep(cut)
        } else {
            self.offset -= cut;
            self.left.keep(self.left.width - cut)
        };
        self.offset = self.offset << halvings | (self.below >> 1) >> (31 - halvings);
        self.below <<= halvings;
        first
    }

    /// Probability of what was chosen.
    pub(super) fn probability(&self) -> f32 {
        self.left.probability()
    }

    /// What is left, in `[0,1)`: a fresh uniform number.
    pub(super) fn remainder(&self) -> f32 {
        // Rounding may carry the quotient to 1.
        (self.offset as f32 / self.left.width as f32).min(1.0 - f32::EPSILON / 2.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_chooses_with_the_probability_it_says() {
        // All 16-bit numbers, in order; the chance of each sequence of choices is its share of them.
        let shares = [share_of(0.3), share_of(0.5), share_of(0.9), share_of(0.01)];
        let mut counts = [0_u32; 16];
        let mut probabilities = [0.0; 16];
        let mut previous = (0, 0.0);
        for step in 0..1_u32 << 16 {
            let mut draw = Draw::new(step << 16);
            let mut chosen = Interval::WHOLE;
            let index = shares.iter().fold(0, |index, &share| {
                let first = draw.chooses_first(share);
                chosen.choose(share, first);
                2 * index + usize::from(!first)
            });
            assert_eq!(draw.probability(), chosen.probability());
            let here = (index, draw.remainder());
            assert!(here > previous || step == 0, "order is kept: {previous:?}, {here:?}");
            previous = here;
            counts[index] += 1;
            probabilities[index] = draw.probability();
        }
        assert!((probabilities.iter().sum::<f32>() - 1.0).abs() < 1e-6);
        for (count, probability) in counts.into_iter().zip(probabilities) {
            assert!((count as f32 - 65_536.0 * probability).abs() <= 2.0, "{count} {probability}");
        }
    }

    #[test]
    fn whatever_the_share_both_parts_have_a_chance() {
        for share in [0.0, 1e-30, 0.5, 1.0 - f32::EPSILON / 2.0, 1.0] {
            for width in [1 << 31, (1 << 31) + 1, u32::MAX] {
                let interval = Interval { width, ..Interval::WHOLE };
                let cut = interval.cut(share_of(share));
                assert!(cut > 0 && cut < width, "{share} of {width}");
            }
        }
        assert_eq!(Interval::WHOLE.cut(ALL), 1 << 31);
    }

    /// A thing of probability 2^-30 still has a fine remainder.
    #[test]
    fn long_chains_of_choices_do_not_use_the_number_up() {
        let mut remainders: Vec<f32> = (0..4096_u32)
            .map(|i| {
                let mut draw = Draw::new(hash(i));
                for _ in 0..30 {
                    draw.chooses_first(1 << 31);
                }
                draw.remainder()
            })
            .collect();
        remainders.sort_by(f32::total_cmp);
        for (i, remainder) in remainders.iter().enumerate() {
            assert!((remainder - i as f32 / 4096.0).abs() < 0.04, "{i}: {remainder}");
        }
        remainders.dedup();
        assert!(remainders.len() > 4080, "{}", remainders.len());
    }
}
