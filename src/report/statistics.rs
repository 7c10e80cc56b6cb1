//! Statistics of several independent runs: means, slopes, times to equal error, and confidence intervals.

use serde::{Deserialize, Serialize};

use crate::metrics::hypothesis::{student_975, two_sided_p};
use crate::sampler::hash;

/// A mean over runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The mean.
    pub mean: f64,
    /// Its standard error; `None` for a single run.
    pub standard_error: Option<f64>,
}

impl Estimate {
    /// The estimate from values; `None` unless there are some and all are finite.
    pub fn of(values: &[f64]) -> Option<Self> {
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
        let standard_error = (values.len() > 1).then(|| (squares / (count - 1.0) / count).sqrt());
        mean.is_finite().then_some(Self { mean, standard_error })
    }
}

/// An interval of 95 % confidence.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Slope of a power law through positive points, by least squares in logarithms; `None` for fewer
/// than two different abscissae.
pub fn power_law_slope(points: &[(f64, f64)]) -> Option<f64> {
    let positive = points.iter().filter(|(x, y)| *x > 0.0 && *y > 0.0);
    let logs: Vec<(f64, f64)> = positive.map(|(x, y)| (x.ln(), y.ln())).collect();
    let count = logs.len() as f64;
    let (mean_x, mean_y) =
        logs.iter().fold((0.0, 0.0), |sum, p| (sum.0 + p.0 / count, sum.1 + p.1 / count));
    let covariance: f64 = logs.iter().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    let variance: f64 = logs.iter().map(|(x, _)| (x - mean_x).powi(2)).sum();
    (variance > 1e-12).then(|| covariance / variance)
}

/// Error against time of one run, in order of time.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Seconds and error, both positive.
    pub points: Vec<(f64, f64)>,
}

impl Curve {
    /// Error at a time, by a power law between the points around it; `None` outside of them.
    pub fn at(&self, seconds: f64) -> Option<f64> {
        let after = self.points.partition_point(|(t, _)| *t < seconds);
        let &(t1, e1) = self.points.get(after)?;
        if t1 == seconds {
            return Some(e1);
        }
        let &(t0, e0) = self.points.get(after.checked_sub(1)?)?;
        Some(power_law(e0, e1, (seconds / t0).ln() / (t1 / t0).ln()))
    }

    /// Time of the first error.
    pub fn start(&self) -> f64 {
        self.points.first().map_or(f64::INFINITY, |(t, _)| *t)
    }
}

/// Geometric interpolation, or linear where a value is not positive.
fn power_law(a: f64, b: f64, t: f64) -> f64 {
    if a > 0.0 && b > 0.0 { a * (b / a).powf(t) } else { a + (b - a) * t }
}

/// Error against time of several runs, at common times.
#[derive(Debug, Clone, PartialEq)]
pub struct Bundle {
    /// Times of the errors, ascending; the last one is the end.
    pub seconds: Vec<f64>,
    /// For each run, an error for each of `seconds`.
    pub errors: Vec<Vec<f64>>,
}

/// Number of times of a bundle.
const STEPS: u32 = 64;

impl Bundle {
    /// Interpolates curves that all last until `end` at common times; `None` without curves, or if one begins after
    /// the end.
    pub fn new(curves: &[Curve], end: f64) -> Option<Self> {
        let start = curves.iter().map(Curve::start).fold(0.0, f64::max);
        if curves.is_empty() || start > end {
            return None;
        }
        let step = |i: u32| start * (end / start).powf(f64::from(i) / f64::from(STEPS - 1));
        let mut seconds: Vec<f64> = (0..STEPS).map(step).collect();
        seconds[0] = start;
        seconds[STEPS as usize - 1] = end;
        let of_curve = |curve: &Curve| seconds.iter().map(|t| curve.at(*t)).collect();
        let errors = curves.iter().map(of_curve).collect::<Option<Vec<Vec<f64>>>>()?;
        Some(Self { seconds, errors })
    }

    /// Indices of all runs.
    fn runs(&self) -> Vec<usize> {
        (0..self.errors.len()).collect()
    }

    /// Mean error at every time over the runs of these indices, which may repeat.
    fn mean(&self, runs: &[usize]) -> Vec<f64> {
        let mut mean = vec![0.0; self.seconds.len()];
        for &run in runs {
            mean.iter_mut().zip(&self.errors[run]).for_each(|(m, e)| *m += e / runs.len() as f64);
        }
        mean
    }

    /// Seconds from which on the mean error stays at or below `error`, and whether it is so at the first measured time; `None` if it
    /// is above at the end.
    pub fn seconds_to(&self, error: f64) -> Option<(f64, bool)> {
        let mean = self.mean(&self.runs());
        mean.last().is_some_and(|last| *last <= error).then(|| time_to(&self.seconds, &mean, error))
    }

    /// Mean error and its standard error at every time.
    pub fn estimates(&self) -> Vec<Option<Estimate>> {
        let errors = |i: usize| self.errors.iter().map(|run| run[i]).collect::<Vec<_>>();
        (0..self.seconds.len()).map(|i| Estimate::of(&errors(i))).collect()
    }
}

/// Time from which on a falling mean curve stays at or below `error`, and whether that is its first point.
fn time_to(seconds: &[f64], errors: &[f64], error: f64) -> (f64, bool) {
    let Some(above) = errors.iter().rposition(|e| *e > error) else { return (seconds[0], true) };
    let Some(&after) = seconds.get(above + 1) else { return (seconds[above], false) };
    let (e0, e1) = (errors[above], errors[above + 1]);
    let t = if e1 > 0.0 { (e0 / error).ln() / (e0 / e1).ln() } else { (e0 - error) / (e0 - e1) };
    (power_law(seconds[above], after, t.clamp(0.0, 1.0)), false)
}

/// Ratio of the times in which two methods reach the same error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SpeedUp {
    /// Time of the baseline over time of the method.
    pub ratio: f64,
    /// Its interval of 95 % confidence, by bootstrap over runs; `None` with a single run.
    pub interval: Option<Interval>,
    /// The error at which both are compared: the larger of their mean errors at the end.
    pub error: f64,
    /// Whether one method reached it before its first measured point, so that the ratio is only a bound.
    pub is_bound: bool,
}

impl SpeedUp {
    /// The speed-up of `method` over `baseline`, both measured until the same end.
    pub fn new(baseline: &Bundle, method: &Bundle) -> Option<Self> {
        let (ratio, error, is_bound) = ratio(baseline, method, &baseline.runs(), &method.runs());
        let counts = [baseline.errors.len(), method.errors.len()];
        let interval = bootstrap(counts, |[a, b]| self::ratio(baseline, method, a, b).0);
        ratio.is_finite().then_some(Self { ratio, interval, error, is_bound })
    }
}

/// Ratio of the times, the error at which it is taken, and whether it is only a bound.
fn ratio(baseline: &Bundle, method: &Bundle, a: &[usize], b: &[usize]) -> (f64, f64, bool) {
    let (plain, ours) = (baseline.mean(a), method.mean(b));
    let last = |errors: &[f64]| errors.last().copied().unwrap_or(f64::NAN);
    let error = last(&plain).max(last(&ours));
    let (plain_time, plain_bound) = time_to(&baseline.seconds, &plain, error);
    let (our_time, our_bound) = time_to(&method.seconds, &ours, error);
    (plain_time / our_time, error, plain_bound || our_bound)
}

/// Number of resamples of a bootstrap.
const RESAMPLES: u32 = 2000;

/// Interval of 95 % confidence of a statistic of two groups of runs: the expanded percentile interval
/// (Hesterberg, *What Teachers Should Know About the Bootstrap*, 2015), whose percentiles are widened to match
/// Student's interval in small groups. It is deterministic. `None` if a group has fewer than two runs, or the statistic is not finite.
pub fn bootstrap(counts: [usize; 2], statistic: impl Fn([&[usize]; 2]) -> f64) -> Option<Interval> {
    let smaller = counts[0].min(counts[1]);
    if smaller < 2 {
        return None;
    }
    let mut states = 1..;
    let mut draw = |count: usize| -> Vec<usize> {
        let of_state = |state| ((u64::from(hash(state)) * count as u64) >> 32) as usize;
        states.by_ref().take(count).map(of_state).collect()
    };
    let resample = |_| statistic(counts.map(&mut draw).each_ref().map(Vec::as_slice));
    let mut values: Vec<f64> = (0..RESAMPLES).map(resample).collect();
    if !values.iter().all(|v| v.is_finite()) {
        return None;
    }
    values.sort_unstable_by(f64::total_cmp);
    // The share of resamples to leave out at each end.
    let count = smaller as f64;
    let tail = 0.5 * two_sided_p(student_975(smaller - 1) * (count / (count - 1.0)).sqrt());
    let at = |share: f64| values[(share * f64::from(RESAMPLES - 1)).round() as usize];
    Some(Interval { low: at(tail), high: at(1.0 - tail) })
}
