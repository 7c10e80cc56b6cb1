//! Numbers and findings in words.

use std::fmt::Write as _;

use super::super::plan::Device;
use super::super::shares::Shares;
use super::super::statistics::{Estimate, SpeedUp};
use super::super::summary::{DeviceReport, Measure, MethodReport, Report, RowReport};

/// Seconds in words.
pub fn duration(seconds: f64) -> String {
    let seconds = seconds.round() as u64;
    match (seconds / 3600, seconds / 60 % 60) {
        (0, 0) => format!("{seconds} s"),
        (0, minutes) => format!("{minutes} min {} s", seconds % 60),
        (hours, minutes) => format!("{hours} h {minutes} min"),
    }
}

/// A ratio: two or three digits that matter.
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

/// An error with its standard error.
pub(super) fn estimate(estimate: Estimate) -> String {
    let Some(s) = estimate.standard_error else { return error(estimate.mean) };
    if estimate.mean >= 0.01 {
        let digits = if s < 5e-4 { 4 } else { 3 };
        return format!("{:.digits$} ± {s:.digits$}", estimate.mean);
    }
    // Both in the same power of ten.
    let exponent = estimate.mean.abs().max(f64::MIN_POSITIVE).log10().floor() as i32;
    let unit = 10f64.powi(exponent);
    format!("({:.2} ± {:.2})e{exponent}", estimate.mean / unit, s / unit)
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

/// A number with its standard error, to so many digits after the point.
pub(super) fn plain_estimate(estimate: Option<Estimate>, digits: usize) -> String {
    match estimate {
        None => String::new(),
        Some(Estimate { mean, standard_error: None }) => format!("{mean:.digits$}"),
        Some(Estimate { mean, standard_error: Some(s) }) => {
            format!("{mean:.digits$} ± {s:.digits$}")
        }
    }
}

/// A method's speed-up over another, or why there is none.
pub(super) fn speed_up_cell(method: &MethodReport, baseline: &str, measure: Measure) -> String {
    match method.speed_up(baseline, measure) {
        Some(found) => speed_up(found),
        None if method.method.name == baseline || method.runs.is_empty() => String::new(),
        None => {
            let firsts = method.runs.iter().filter_map(|run| Some(run.points.first()?.seconds));
            format!("no picture before {:.1} s", firsts.fold(0.0, f64::max))
        }
    }
}

/// A speed-up with its interval.
pub(super) fn speed_up(found: SpeedUp) -> String {
    let bound = match (found.is_bound, found.ratio >= 1.0) {
        (false, _) => "",
        (true, true) => "≥ ",
        (true, false) => "≤ ",
    };
    match found.interval {
        Some(i) => format!("{bound}{} [{}, {}]", ratio(found.ratio), ratio(i.low), ratio(i.high)),
        None => format!("{bound}{}", ratio(found.ratio)),
    }
}

/// What the talk published for a device.
pub(super) fn published(row: &RowReport, device: Device) -> Option<f64> {
    let [cpu, gpu] = row.row.published?;
    Some(match device {
        Device::Cpu => cpu,
        Device::Gpu => gpu,
    })
}

/// Whether the target is reached: by the figure, and surely so if by the whole interval.
pub(super) fn verdict(found: SpeedUp, target: f64) -> &'static str {
    match (found.ratio >= target, found.interval) {
        (true, Some(i)) if i.low >= target => "reached",
        (false, Some(i)) if i.high < target => "short",
        (true, _) => "reached, not surely",
        (false, _) => "short, not surely",
    }
}

/// Where a method's error is left.
pub(super) fn shares_sentence(shares: &Shares) -> String {
    let part = |value: f64| percent(value / shares.total);
    let together = shares.together() / shares.total;
    let mut text = format!(
        "Of what {} errs by ({} at {} samples per pixel), {} is left at the first vertex, {} at \
         later vertices and {} in the pixel filter",
        shares.method,
        error(shares.total),
        shares.samples,
        part(shares.first_vertex),
        part(shares.later_vertices),
        part(shares.filter),
    );
    let tail = if together > 0.01 {
        format!("; the rest, {}, is where these err together.", percent(together))
    } else if together < -0.01 {
        format!("; these sum to more than 100 % for they partly cancel ({}).", percent(together))
    } else {
        ".".to_owned()
    };
    text.push_str(&tail);
    text
}

/// How far better sampling of the first vertex alone could carry.
pub(super) fn bound_sentence(
    row: &RowReport,
    device: &DeviceReport,
    baseline: &str,
) -> Option<String> {
    let ours = row.shares.iter().find(|s| s.method == "adaptive")?;
    let found = device.method("adaptive")?.speed_up(baseline, Measure::TrimmedRelMse)?;
    let left = |part: f64| found.ratio * ours.total / (ours.total - part).max(1e-3 * ours.total);
    Some(format!(
        "{}: with the same rays, a first vertex without any noise would carry {} from {} to {} times \
         {baseline}, later vertices without noise to {}.",
        device.device.title(),
        ours.method,
        ratio(found.ratio),
        ratio(left(ours.first_vertex)),
        ratio(left(ours.later_vertices)),
    ))
}

/// A finished row in a line, for a terminal.
pub fn row_sentence(report: &Report, row: &RowReport) -> String {
    let baseline = &report.plan.methods[report.plan.baselines[0]].name;
    let mut parts = Vec::new();
    for device in &row.devices {
        if let Some(reason) = &device.not_measured {
            parts.push(format!("{}: {reason}", device.device.title()));
            continue;
        }
        let ratios: Vec<String> = device
            .methods
            .iter()
            .filter_map(|m| {
                let cell = speed_up_cell(m, baseline, Measure::TrimmedRelMse);
                (!cell.is_empty()).then(|| format!("{} {cell}", m.method.name))
            })
            .collect();
        parts.push(format!("{}: {}", device.device.title(), ratios.join(", ")));
    }
    format!("{} over {baseline}: {}", row.row.title, parts.join("; "))
}

/// Speed-ups of all rows as a Markdown table.
pub fn markdown_table(report: &Report) -> String {
    let head = results_head(report);
    let mut text = String::new();
    let _ = writeln!(text, "| {} |", head.join(" | "));
    let _ = writeln!(text, "|{}", "---|".repeat(head.len()));
    for row in &report.rows {
        for device in &row.devices {
            let _ = writeln!(text, "| {} |", results_cells(report, row, device).join(" | "));
        }
    }
    text
}

/// Names of the columns of a table of speed-ups.
pub(super) fn results_head(report: &Report) -> Vec<String> {
    let mut head = vec!["row".to_owned(), "device".to_owned()];
    head.extend(others(report).map(str::to_owned));
    if is_beside_talk(report) {
        head.extend(["published", "target"].map(str::to_owned));
    }
    head.push("reference noise".to_owned());
    head
}

/// A device's row of that table; "-" is what there is not.
pub(super) fn results_cells(
    report: &Report,
    row: &RowReport,
    device: &DeviceReport,
) -> Vec<String> {
    let mut cells = vec![row.row.title.clone(), device.device.title().to_owned()];
    cells.extend(others(report).map(|name| {
        let method = device.method(name);
        let cell = method.map(|m| speed_up_cell(m, baseline(report), Measure::TrimmedRelMse));
        cell.filter(|text| !text.is_empty()).unwrap_or_else(|| "-".to_owned())
    }));
    if is_beside_talk(report) {
        cells.push(published(row, device.device).map_or_else(|| "-".to_owned(), ratio));
        cells.push(target_cell(row, device, baseline(report)));
    }
    let share = row.reference.as_ref().and_then(|r| r.share);
    cells.push(share.map_or_else(|| "unknown".to_owned(), percent));
    cells
}

/// Names of the methods that are compared with the baseline.
fn others(report: &Report) -> impl Iterator<Item = &str> {
    let names = report.plan.methods.iter().map(|m| m.name.as_str());
    names.filter(|name| *name != baseline(report))
}

/// Whether there are published figures or targets.
fn is_beside_talk(report: &Report) -> bool {
    report.plan.rows.iter().any(|row| row.published.is_some() || row.target.is_some())
}

/// The target and what became of it.
fn target_cell(row: &RowReport, device: &DeviceReport, baseline: &str) -> String {
    let Some(target) = row.row.target else { return "-".to_owned() };
    let found = device.method("adaptive");
    let found = found.and_then(|m| m.speed_up(baseline, Measure::TrimmedRelMse));
    let found = found.map_or("", |found| verdict(found, target));
    format!("{target}: {found}").trim_end_matches(": ").to_owned()
}

/// With more methods than this a row shows ratios instead of curves and pictures.
const MANY: usize = 7;

pub(super) fn is_long(report: &Report) -> bool {
    report.plan.methods.len() > MANY
}

pub(super) fn baseline(report: &Report) -> &str {
    &report.plan.methods[report.plan.baselines[0]].name
}
