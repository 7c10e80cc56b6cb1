//! Hypothesis tests: does a histogram match its density, how far may chance carry a mean?

use statrs::distribution::{ChiSquared, ContinuousCDF as _, StudentsT};
use statrs::function::erf::erfc;

use crate::error::{Error, Result};

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
    let distribution = ChiSquared::new(degrees_of_freedom as f64).expect("at least one degree");
    let p_value = distribution.sf(statistic);
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

/// Chance that a standard normal variable is at least `z >= 0` away from 0; 0 for NaN.
pub fn two_sided_p(z: f64) -> f64 {
    if z.is_nan() { 0.0 } else { erfc(z * std::f64::consts::FRAC_1_SQRT_2) }
}

/// How many standard errors around a mean hold 95 % of Student's distribution with so many degrees of
/// freedom, at least one.
pub fn student_975(degrees_of_freedom: usize) -> f64 {
    let distribution = StudentsT::new(0.0, 1.0, degrees_of_freedom.max(1) as f64);
    distribution.expect("at least one degree").inverse_cdf(0.975)
}
