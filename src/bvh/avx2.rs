//! Lanes in one AVX register, and the walk compiled for machines that have AVX2 and FMA.

use std::arch::x86_64::{
    __m256, _CMP_EQ_OQ, _CMP_LE_OQ, _mm256_add_ps, _mm256_cmp_ps, _mm256_div_ps, _mm256_fmadd_ps,
    _mm256_loadu_ps, _mm256_max_ps, _mm256_min_ps, _mm256_movemask_ps, _mm256_mul_ps,
    _mm256_set1_ps, _mm256_storeu_ps, _mm256_sub_ps,
};

use super::build::Tree;
use super::lanes::Lanes;
use super::traverse;
use super::wide::{PerLane, WIDTH};
use super::{Hit, Ray};

/// Whether this machine may call the functions below.
pub(super) fn is_available() -> bool {
    is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
}

/// Eight lanes. Values exist only inside [`closest_hit`] and [`any_hit`] below, that is on machines
/// with AVX2 and FMA: every SAFETY comment of this file rests on that.
#[derive(Clone, Copy)]
struct Avx2(__m256);

/// Operations on two registers.
macro_rules! of_two {
    ($($name:ident = $intrinsic:ident;)+) => {
        $(
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                // SAFETY: the machine has AVX2, see `Avx2`.
                Self(unsafe { $intrinsic(self.0, other.0) })
            }
        )+
    };
}

impl Lanes for Avx2 {
    #[inline(always)]
    fn splat(value: f32) -> Self {
        // SAFETY: the machine has AVX2, see `Avx2`.
        Self(unsafe { _mm256_set1_ps(value) })
    }
    #[inline(always)]
    fn load(values: &PerLane) -> Self {
        // SAFETY: the machine has AVX2, see `Avx2`; the array holds eight f32.
        Self(unsafe { _mm256_loadu_ps(values.as_ptr()) })
    }
    #[inline(always)]
    fn store(self) -> PerLane {
        let mut values = [0.0; WIDTH];
        // SAFETY: the machine has AVX2, see `Avx2`; the array holds eight f32.
        unsafe { _mm256_storeu_ps(values.as_mut_ptr(), self.0) };
        values
    }
    of_two! {
        add = _mm256_add_ps;
        sub = _mm256_sub_ps;
        mul = _mm256_mul_ps;
        div = _mm256_div_ps;
        min = _mm256_min_ps;
        max = _mm256_max_ps;
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        // SAFETY: the machine has FMA, see `Avx2`.
        Self(unsafe { _mm256_fmadd_ps(self.0, factor.0, term.0) })
    }
    #[inline(always)]
    fn le(self, other: Self) -> u32 {
        // SAFETY: the machine has AVX2, see `Avx2`.
        let mask = unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0)) };
        mask.cast_unsigned()
    }
    #[inline(always)]
    fn eq(self, other: Self) -> u32 {
        // SAFETY: the machine has AVX2, see `Avx2`.
        let mask = unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_EQ_OQ>(self.0, other.0)) };
        mask.cast_unsigned()
    }
}

/// [`traverse::closest_hit`] on AVX2 lanes. Call only if [`is_available`].
#[target_feature(enable = "avx2,fma")]
pub(super) fn closest_hit<const LEVELS: usize>(
    tree: &Tree,
    ray: &Ray,
    accept: impl Fn(&Hit) -> bool,
) -> Option<Hit> {
    traverse::closest_hit::<Avx2, LEVELS>(tree, ray, accept)
}

/// [`traverse::any_hit`] on AVX2 lanes. Call only if [`is_available`].
#[target_feature(enable = "avx2,fma")]
pub(super) fn any_hit<const LEVELS: usize>(
    tree: &Tree,
    ray: &Ray,
    blocks: impl FnMut(&Hit) -> bool,
) -> bool {
    traverse::any_hit::<Avx2, LEVELS>(tree, ray, blocks)
}
