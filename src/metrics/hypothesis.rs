//! Hypothesis tests: do two noisy estimates agree, does a histogram match its density?

use crate::error::{Error, Result};

/// Estimates of many quantities (pixels, cells), each with the variance of its mean, i.e. the
/// sample variance divided by the number of samples.
#[derive(Debug, Clone, Copy)]
pub struct Means<'a> {
    /// Mean of each quantity.
    pub mean: &'a [f64],
    /// Variance of each mean, `>= 0`.
    pub variance_of_mean: &'a [f64],
}

/// What [`z_test`] found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZTest {
    /// Share of the quantities whose p-value is above [`Self::corrected_alpha`], in `[0,1]`.
    pub passing_share: f64,
    /// The smallest two-sided p-value.
    pub smallest_p: f64,
    /// The per-quantity significance level after Sidak's correction.
    pub corrected_alpha: f64,
}

impl ZTest {
    /// Whether no quantity differs significantly.
    pub fn passed(&self) -> bool {
        self.smallest_p > self.corrected_alpha
    }
}

/// Two-sample Z-test of every quantity (Welch's statistic with the normal distribution, so each mean should
/// come from some 30 samples or more), as in Mitsuba 3's `test_renders.py`.
///
/// `alpha` is the chance that equal estimates fail anywhere; each quantity is tested at the level
/// that Sidak's correction leaves it. A standard deviation below `1e-6` of the means counts as that
/// much: two sums of `f32` differ by rounding. A quantity that is NaN in either estimate fails.
///
/// # Errors
/// If the four slices are empty or differ in length.
pub fn z_test(a: Means<'_>, b: Means<'_>, alpha: f64) -> Result<ZTest> {
    let count = a.mean.len();
    if [a.variance_of_mean.len(), b.mean.len(), b.variance_of_mean.len()] != [count; 3] {
        return Err(Error::new("the two estimates to be tested differ in size"));
    }
    if count == 0 {
        return Err(Error::new("there is nothing to test: both estimates are empty"));
    }
    let corrected_alpha = sidak(alpha, count);
    let mut passing = 0usize;
    let mut smallest_p = 1.0f64;
    for i in 0..count {
        let rounding = 1e-6 * a.mean[i].abs().max(b.mean[i].abs());
        let variance = a.variance_of_mean[i] + b.variance_of_mean[i] + rounding * rounding;
        let difference = (a.mean[i] - b.mean[i]).abs();
        let p = if difference == 0.0 { 1.0 } else { two_sided_p(difference / variance.sqrt()) };
        passing += usize::from(p > corrected_alpha);
        smallest_p = smallest_p.min(p);
    }
    Ok(ZTest { passing_share: passing as f64 / count as f64, smallest_p, corrected_alpha })
}

/// What [`chi_square_test`] found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChiSquareTest {
    /// Pearson's statistic over the pooled cells.
    pub statistic: f64,
    /// Pooled cells less one.
    pub degrees_of_freedom: usize,
    /// Chance of a statistic at least this large if the histogram follows the expectation.
    pub p_value: f64,
    /// Whether `p_value` is above the level asked for.
    pub passed: bool,
}

/// Expected counts below this are pooled: Pearson's statistic is not chi-square distributed there.
const MIN_EXPECTED: f64 = 5.0;

/// Pearson's chi-square test of a histogram at significance level `alpha`.
///
/// `expected` are counts with the total of `observed`. Cells are pooled in order of rising
/// expectation until each pool expects 5 counts or more, as in Mitsuba 3's `chi2.py`. Counts in a
/// cell where none are expected fail the test outright (`statistic` infinite, `p_value` 0).
///
/// # Errors
/// If the lengths differ, an expectation is negative or NaN, or fewer than two cells remain.
pub fn chi_square_test(observed: &[f64], expected: &[f64], alpha: f64) -> Result<ChiSquareTest> {
    if observed.len() != expected.len() {
        return Err(Error::new("the observed and the expected histogram differ in size"));
    }
    if expected.iter().any(|&e| e.is_nan() || e < 0.0) {
        return Err(Error::new("an expected count is negative or not a number"));
    }
    let impossible = observed.iter().zip(expected).any(|(&o, &e)| e == 0.0 && o > 0.0);
    let pools = pooled_cells(observed, expected);
    if pools.len() < 2 {
        return Err(Error::new("a chi-square test needs two cells that expect 5 counts or more"));
    }
    let statistic = if impossible {
        f64::INFINITY
    } else {
        pools.iter().map(|(o, e)| (o - e) * (o - e) / e).sum()
    };
    let degrees_of_freedom = pools.len() - 1;
    let p_value = upper_gamma(0.5 * degrees_of_freedom as f64, 0.5 * statistic);
    Ok(ChiSquareTest { statistic, degrees_of_freedom, p_value, passed: p_value > alpha })
}

/// `(observed, expected)` of the cells that expect 5 or more and of the pools of the rest. What is
/// left over at the end joins the last pool.
fn pooled_cells(observed: &[f64], expected: &[f64]) -> Vec<(f64, f64)> {
    let mut cells: Vec<(f64, f64)> =
        observed.iter().copied().zip(expected.iter().copied()).collect();
    cells.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut pools: Vec<(f64, f64)> = Vec::with_capacity(cells.len());
    let mut open = (0.0, 0.0);
    for (o, e) in cells {
        open = (open.0 + o, open.1 + e);
        if open.1 >= MIN_EXPECTED {
            pools.push(open);
            open = (0.0, 0.0);
        }
    }
    if let Some(last) = pools.last_mut() {
        *last = (last.0 + open.0, last.1 + open.1);
    }
    pools
}

/// Sidak's correction: the level for each of `tests` independent tests so that all of them together
/// fail by chance with probability `alpha`.
pub fn sidak(alpha: f64, tests: usize) -> f64 {
    -((-alpha).ln_1p() / tests.max(1) as f64).exp_m1()
}

/// Chance that a standard normal variable is at least `z >= 0` away from 0; 0 for NaN.
pub fn two_sided_p(z: f64) -> f64 {
    if z.is_nan() { 0.0 } else { erfc(z * std::f64::consts::FRAC_1_SQRT_2) }
}

/// Complementary error function, from the incomplete gamma function (DLMF 7.11.2); relative error
/// below `1e-12` while the result is a normal number.
pub fn erfc(x: f64) -> f64 {
    if x < 0.0 { 2.0 - erfc(-x) } else { upper_gamma(0.5, x * x) }
}

/// Regularised upper incomplete gamma function `Q(a, x)`, `a > 0`, `x >= 0`.
///
/// Power series of `P` below `x = a + 1` (DLMF 8.11.4), Legendre's continued fraction above it
/// (DLMF 8.9.2) evaluated by Lentz's method, as both converge quickly on their side.
pub fn upper_gamma(a: f64, x: f64) -> f64 {
    if x.is_nan() {
        return f64::NAN;
    }
    if x <= 0.0 {
        return 1.0;
    }
    if x == f64::INFINITY {
        return 0.0;
    }
    let front = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 { 1.0 - front * lower_series(a, x) } else { front * upper_fraction(a, x) }
}

/// Terms after which both expansions have converged for any `a` below a million or so.
const MAX_TERMS: usize = 10_000;

/// `sum of x^n / (a (a+1) ... (a+n))`.
fn lower_series(a: f64, x: f64) -> f64 {
    let mut term = 1.0 / a;
    let mut sum = term;
    for n in 1..MAX_TERMS {
        term *= x / (a + n as f64);
        sum += term;
        if term < sum * f64::EPSILON {
            break;
        }
    }
    sum
}

/// `1/(x+1-a - 1(1-a)/(x+3-a - 2(2-a)/(x+5-a - ...)))`.
fn upper_fraction(a: f64, x: f64) -> f64 {
    const TINY: f64 = 1e-300;
    let mut b = x + 1.0 - a;
    let mut c = 1.0 / TINY;
    let mut d = 1.0 / b;
    let mut value = d;
    for n in 1..MAX_TERMS {
        let n = n as f64;
        let numerator = -n * (n - a);
        b += 2.0;
        d = 1.0 / not_zero(numerator * d + b, TINY);
        c = not_zero(b + numerator / c, TINY);
        let factor = d * c;
        value *= factor;
        if (factor - 1.0).abs() < f64::EPSILON {
            break;
        }
    }
    value
}

/// `x`, or `tiny` in place of a number that near zero.
fn not_zero(x: f64, tiny: f64) -> f64 {
    if x.abs() < tiny { tiny } else { x }
}

/// Natural logarithm of the gamma function for `x > 0`: Lanczos's approximation with `g = 7` and
/// Godfrey's nine coefficients, relative error of gamma about `1e-15`.
pub fn ln_gamma(x: f64) -> f64 {
    const G: f64 = 7.0;
    const FIRST: f64 = 0.999_999_999_999_809_9;
    const REST: [f64; 8] = [
        676.520_368_121_885_1,
        -1_259.139_216_722_402_8,
        771.323_428_777_653_1,
        -176.615_029_162_140_6,
        12.507_343_278_686_905,
        -0.138_571_095_265_720_12,
        9.984_369_578_019_572e-6,
        1.505_632_735_149_311_6e-7,
    ];
    let z = x - 1.0;
    let series: f64 =
        REST.iter().enumerate().map(|(i, c)| c / (z + i as f64 + 1.0)).sum::<f64>() + FIRST;
    let t = z + G + 0.5;
    0.5 * std::f64::consts::TAU.ln() + (z + 0.5) * t.ln() - t + series.ln()
}
