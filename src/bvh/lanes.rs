//! Eight numbers at a time, on every machine.

use super::wide::{PerLane, WIDTH};

/// Eight lanes of f32. Comparisons return one bit a lane and are false for NaN.
pub(super) trait Lanes: Copy {
    fn splat(value: f32) -> Self;
    fn load(values: &PerLane) -> Self;
    fn store(self) -> PerLane;
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    fn div(self, other: Self) -> Self;
    /// `self * factor + term`; whether it is rounded once or twice is up to the machine.
    fn mul_add(self, factor: Self, term: Self) -> Self;
    fn min(self, other: Self) -> Self;
    fn max(self, other: Self) -> Self;
    fn le(self, other: Self) -> u32;
    fn eq(self, other: Self) -> u32;
}

/// Lanes for every machine: loops that the compiler turns into whatever vectors it may use.
#[derive(Clone, Copy)]
pub(super) struct Portable(PerLane);

impl Portable {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], other.0[i])))
    }

    #[inline(always)]
    fn mask(self, other: Self, f: impl Fn(f32, f32) -> bool) -> u32 {
        (0..WIDTH).fold(0, |mask, i| mask | u32::from(f(self.0[i], other.0[i])) << i)
    }
}

/// Makes operations of what they do with two numbers.
macro_rules! by_lane {
    ($($name:ident -> $result:ty = $for_all:ident($operation:expr);)+) => {
        $(
            #[inline(always)]
            fn $name(self, other: Self) -> $result {
                self.$for_all(other, $operation)
            }
        )+
    };
}

impl Lanes for Portable {
    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self([value; WIDTH])
    }
    #[inline(always)]
    fn load(values: &PerLane) -> Self {
        Self(*values)
    }
    #[inline(always)]
    fn store(self) -> PerLane {
        self.0
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        self.mul(factor).add(term)
    }
    by_lane! {
        add -> Self = zip(|a, b| a + b);
        sub -> Self = zip(|a, b| a - b);
        mul -> Self = zip(|a, b| a * b);
        div -> Self = zip(|a, b| a / b);
        min -> Self = zip(|a, b| if a < b { a } else { b });
        max -> Self = zip(|a, b| if a > b { a } else { b });
        le -> u32 = mask(|a, b| a <= b);
        eq -> u32 = mask(|a, b| a == b);
    }
}

/// The positions of set bits among the lowest eight.
pub(super) struct Bits(pub(super) u32);

impl Iterator for Bits {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        if self.0 == 0 {
            return None;
        }
        let lane = self.0.trailing_zeros() as usize % WIDTH;
        self.0 &= self.0 - 1;
        Some(lane)
    }
}
