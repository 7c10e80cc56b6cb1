//! Speed-ups of all rows: the table of the page and of the terminal.

use askama::Template;

use super::super::plan::Method;
use super::super::summary::{CLEAN_FLIP, DeviceReport, Measure, MethodReport, Report, RowReport};
use super::format::{percent, ratio, speed_up_cell, verdict};
use crate::denoise::Denoiser;

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
            cells.push(row.row.published_on(device.device).map_or_else(|| "-".to_owned(), ratio));
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

/// Names of the columns of seconds to clean pictures.
pub(super) fn clean_head(report: &Report) -> Vec<&str> {
    let methods = report.plan.methods.iter().map(|method| method.name.as_str());
    ["row", "device"].into_iter().chain(methods).collect()
}

/// A device's line of seconds to denoised pictures of each [`CLEAN_FLIP`]: "-" where the last picture is not as good,
/// nothing before errors are known.
pub(super) fn clean_cells(report: &Report, row: &RowReport, device: &DeviceReport) -> Vec<String> {
    let cell = |method: &Method| {
        let known = device.method(&method.name);
        let Some(known) = known.filter(|m| m.error(Measure::DenoisedFlip).is_some()) else {
            return String::new();
        };
        let seconds = known.clean_seconds.map(|reached| match reached {
            None => "-".to_owned(),
            Some((seconds, is_bound)) => {
                format!("{}{}", if is_bound { "≤ " } else { "" }, ratio(seconds))
            }
        });
        seconds.join(" / ")
    };
    let names = [row.row.title.clone(), device.device.title().to_owned()];
    names.into_iter().chain(report.plan.methods.iter().map(cell)).collect()
}

#[derive(Template)]
#[template(path = "results.md", escape = "none")]
struct Markdown<'a> {
    report: &'a Report,
    table: Table<'a>,
}

/// Speed-ups of all rows and, of few methods, seconds to clean pictures, as Markdown tables.
pub fn markdown_table(report: &Report) -> String {
    Markdown { report, table: Table::new(report) }.to_string()
}

/// What the table of seconds to clean pictures is called.
pub(super) fn clean_title() -> String {
    let flips = CLEAN_FLIP.map(|flip| format!("{flip:.2}")).join(" / ");
    format!("Seconds to FLIP {flips} of pictures denoised by {}", Denoiser::Best.name())
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
