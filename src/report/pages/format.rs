//! Numbers as the page and the terminal show them.

use std::fmt::{self, Display, Formatter};

use super::super::statistics::{Estimate, SpeedUp};
use super::super::summary::{Measure, MethodReport};

/// Seconds in words.
pub fn duration(seconds: f64) -> String {
    let seconds = seconds.round() as u64;
    match (seconds / 3600, seconds / 60 % 60) {
        (0, 0) => format!("{seconds} s"),
        (0, minutes) => format!("{minutes} min {} s", seconds % 60),
        (hours, minutes) => format!("{hours} h {minutes} min"),
    }
}

/// A ratio to two or three significant digits.
pub(super) fn ratio(value: f64) -> String {
    match value {
        v if v >= 99.5 => format!("{v:.0}"),
        v if v >= 9.95 => format!("{v:.1}"),
        v => format!("{v:.2}"),
    }
}

/// An error: two digits and a power of ten.
pub(super) fn error(value: f64) -> String {
    if value >= 0.01 { format!("{value:.3}") } else { format!("{value:.1e}") }
}

/// An error with its standard error; nothing for `None`.
pub(super) fn estimate(estimate: Option<Estimate>) -> String {
    let Some(Estimate { mean, standard_error }) = estimate else { return String::new() };
    let Some(s) = standard_error else { return error(mean) };
    if mean >= 0.01 {
        let digits = if s < 5e-4 { 4 } else { 3 };
        return format!("{mean:.digits$} ± {s:.digits$}");
    }
    // Both in the same power of ten.
    let exponent = mean.abs().max(f64::MIN_POSITIVE).log10().floor() as i32;
    let unit = 10f64.powi(exponent);
    format!("({:.2} ± {:.2})e{exponent}", mean / unit, s / unit)
}

/// A share as percent.
pub(super) fn percent(share: f64) -> String {
    let value = 100.0 * share;
    if value.abs() >= 9.95 { format!("{value:.0} %") } else { format!("{value:.1} %") }
}

/// Bytes as MB.
pub(super) fn megabytes(bytes: u64) -> String {
    format!("{:.1}", bytes as f64 / 1e6)
}

/// A number with its standard error, to this many digits after the point; nothing for `None`.
pub(super) fn plain_estimate(estimate: Option<Estimate>, digits: usize) -> String {
    let Some(Estimate { mean, standard_error }) = estimate else { return String::new() };
    let error = standard_error.map(|error| format!(" ± {error:.digits$}"));
    format!("{mean:.digits$}{}", error.unwrap_or_default())
}

impl Display for SpeedUp {
    /// The ratio with its interval.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let bound = match (self.is_bound, self.ratio >= 1.0) {
            (false, _) => "",
            (true, true) => "≥ ",
            (true, false) => "≤ ",
        };
        write!(f, "{bound}{}", ratio(self.ratio))?;
        self.interval.map_or(Ok(()), |i| write!(f, " [{}, {}]", ratio(i.low), ratio(i.high)))
    }
}

/// A method's speed-up over another, or why there is none.
pub(super) fn speed_up_cell(method: &MethodReport, baseline: &str, measure: Measure) -> String {
    match method.speed_up(baseline, measure) {
        Some(found) => found.to_string(),
        None if method.method.name == baseline || method.runs.is_empty() => String::new(),
        None => {
            let firsts = method.runs.iter().filter_map(|run| Some(run.points.first()?.seconds));
            format!("no picture before {:.1} s", firsts.fold(0.0, f64::max))
        }
    }
}

/// Whether the target is reached; surely so if the whole interval says it.
pub(super) fn verdict(found: SpeedUp, target: f64) -> &'static str {
    match (found.ratio >= target, found.interval) {
        (true, Some(i)) if i.low >= target => "reached",
        (false, Some(i)) if i.high < target => "short",
        (true, _) => "reached, not surely",
        (false, _) => "short, not surely",
    }
}
