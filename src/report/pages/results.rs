//! Speed-ups of all rows: the table of the page and of the terminal.

use std::fmt::Write as _;

use super::super::summary::{DeviceReport, Measure, MethodReport, Report, RowReport};
use super::format::{percent, ratio, speed_up_cell, verdict};

/// The table of speed-ups: a line for each row and device.
pub(super) struct Table<'a> {
    report: &'a Report,
    /// Names of the columns.
    pub(super) head: Vec<&'a str>,
    /// Whether there are published figures or targets.
    is_beside_talk: bool,
}

impl<'a> Table<'a> {
    pub(super) fn new(report: &'a Report) -> Self {
        let rows = &report.plan.rows;
        let is_beside_talk = rows.iter().any(|r| r.published.is_some() || r.target.is_some());
        let beside_talk: &[&str] = if is_beside_talk { &["published", "target"] } else { &[] };
        let mut head = vec!["row", "device"];
        head.extend(report.other_methods());
        head.extend(beside_talk);
        head.push("reference noise");
        Self { report, head, is_beside_talk }
    }

    /// A device's line; "-" where there is no figure.
    pub(super) fn cells(&self, row: &RowReport, device: &DeviceReport) -> Vec<String> {
        let baseline = self.report.baseline();
        let mut cells = vec![row.row.title.clone(), device.device.title().to_owned()];
        cells.extend(self.report.other_methods().map(|name| {
            let method = device.method(name);
            let cell = method.map(|m| speed_up_cell(m, baseline, Measure::TrimmedRelMse));
            cell.filter(|text| !text.is_empty()).unwrap_or_else(|| "-".to_owned())
        }));
        if self.is_beside_talk {
            let published = row.row.published_on(device.device);
            cells.push(published.map_or_else(|| "-".to_owned(), ratio));
            cells.push(match (row.row.target, device.adaptive_speed_up(baseline)) {
                (Some(target), Some(found)) => format!("{target}: {}", verdict(found, target)),
                (Some(target), None) => target.to_string(),
                (None, _) => "-".to_owned(),
            });
        }
        let share = row.reference.as_ref().and_then(|r| r.share);
        cells.push(share.map_or_else(|| "unknown".to_owned(), percent));
        cells
    }
}

/// Speed-ups of all rows as a Markdown table.
pub fn markdown_table(report: &Report) -> String {
    let table = Table::new(report);
    let mut text = format!("| {} |\n", table.head.join(" | "));
    let _ = writeln!(text, "|{}", "---|".repeat(table.head.len()));
    for row in &report.rows {
        for device in &row.devices {
            let _ = writeln!(text, "| {} |", table.cells(row, device).join(" | "));
        }
    }
    text
}

/// A finished row in a line, for a terminal.
pub fn row_sentence(report: &Report, row: &RowReport) -> String {
    let baseline = report.baseline();
    let of_device = |device: &DeviceReport| {
        let title = device.device.title();
        if let Some(reason) = &device.not_measured {
            return format!("{title}: {reason}");
        }
        let ratio = |m: &MethodReport| {
            let cell = speed_up_cell(m, baseline, Measure::TrimmedRelMse);
            (!cell.is_empty()).then(|| format!("{} {cell}", m.method.name))
        };
        let ratios: Vec<String> = device.methods.iter().filter_map(ratio).collect();
        format!("{title}: {}", ratios.join(", "))
    };
    let devices: Vec<String> = row.devices.iter().map(of_device).collect();
    format!("{} over {baseline}: {}", row.row.title, devices.join("; "))
}
