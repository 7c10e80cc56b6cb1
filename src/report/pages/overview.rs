//! What came out, in one table and one plot.

use std::fmt::Write as _;

use super::super::summary::{DeviceReport, Measure, MethodReport, Report, RowReport};
use super::escape;
use super::format::{self, baseline, is_long};
use super::plots::{Entry, ratio_plot};
use super::tables::Table;

/// What came out, in one table and one plot.
pub(super) fn overview(report: &Report, html: &mut String) {
    html.push_str("<h2>What came out</h2>\n");
    if is_long(report) {
        ablation_table(report, html);
        return;
    }
    if let Some(plot) = overview_plot(report) {
        let _ = writeln!(html, "<div class=\"plots\">{plot}</div>");
    }
    let mut table = Table::new(&format::results_head(report));
    for row in &report.rows {
        for device in &row.devices {
            if let Some(reason) = &device.not_measured {
                table.remark(&row.row.title, &format!("{}: {reason}", device.device.title()));
                continue;
            }
            table.row(&format::results_cells(report, row, device));
        }
    }
    let _ = writeln!(
        html,
        "<p>Time to equal trimmed relMSE: how many times sooner than <b>{}</b>, with learning and \
         tables counted.</p>",
        escape(baseline(report))
    );
    html.push_str(&table.finish());
}

/// The plot of all rows' speed-ups; `None` before there are any.
pub(super) fn overview_plot(report: &Report) -> Option<String> {
    if is_long(report) {
        return None;
    }
    let baseline = baseline(report);
    let mut entries = Vec::new();
    for row in &report.rows {
        for device in &row.devices {
            let ratios = device.methods.iter().filter_map(|m| {
                let found = m.speed_up(baseline, Measure::TrimmedRelMse)?;
                Some((m.method.name.clone(), found.ratio, found.interval))
            });
            entries.push(Entry {
                title: format!("{}, {}", row.row.title, device.device.title()),
                ratios: ratios.collect(),
                published: format::published(row, device.device),
                target: row.row.target,
            });
        }
    }
    ratio_plot("Time to equal error", baseline, &entries)
}

/// Methods down, rows across: speed-ups over the last baseline, and their geometric mean.
fn ablation_table(report: &Report, html: &mut String) {
    let plan = &report.plan;
    let Some(last) = plan.baselines.last().map(|b| plan.methods[*b].name.as_str()) else { return };
    let columns: Vec<(&RowReport, &DeviceReport)> =
        report.rows.iter().flat_map(|row| row.devices.iter().map(move |d| (row, d))).collect();
    let titles: Vec<String> =
        columns.iter().map(|(row, d)| format!("{}, {}", row.row.title, d.device.title())).collect();
    let mut head = vec!["", "mean"];
    head.extend(titles.iter().map(String::as_str));
    let mut table = Table::new(&head);
    let mut group = None;
    let mut entries = Vec::new();
    for method in &plan.methods {
        if method.group != group {
            group = method.group;
            table.group(group.unwrap_or_default());
        }
        let found: Vec<_> = columns
            .iter()
            .map(|(_, d)| d.method(&method.name)?.speed_up(last, Measure::TrimmedRelMse))
            .collect();
        let known: Vec<f64> = found.iter().flatten().map(|s| s.ratio.ln()).collect();
        // Of some of them it would not be that of the others' methods.
        let is_whole = !known.is_empty() && known.len() == found.len();
        let mean = is_whole.then(|| (known.iter().sum::<f64>() / known.len() as f64).exp());
        let mut cells = vec![method.name.clone()];
        cells.push(mean.map_or_else(String::new, format::ratio));
        cells.extend(found.into_iter().map(|s| s.map_or_else(String::new, format::speed_up)));
        table.row(&cells);
        if let Some(mean) = mean {
            let ratios = vec![(method.name.clone(), mean, None)];
            entries.push(Entry {
                title: method.name.clone(),
                ratios,
                published: None,
                target: None,
            });
        }
    }
    let _ = writeln!(
        html,
        "<p>Time to equal trimmed relMSE against <b>{0}</b> (above 1: faster than {0}), learning and \
         tables counted; the mean is geometric, over all columns.</p>",
        escape(last)
    );
    if let Some(plot) = ratio_plot("Geometric mean over all rows", last, &entries) {
        let _ = writeln!(html, "<div class=\"plots\">{plot}</div>");
    }
    html.push_str(&table.finish());
}

/// Ratios of many methods on one device.
pub(super) fn ratios_of_device(report: &Report, device: &DeviceReport, html: &mut String) {
    let plan = &report.plan;
    let Some(last) = plan.baselines.last().map(|b| plan.methods[*b].name.as_str()) else { return };
    let entry = |m: &MethodReport| {
        let found = m.speed_up(last, Measure::TrimmedRelMse)?;
        let name = m.method.name.clone();
        let ratios = vec![(name.clone(), found.ratio, found.interval)];
        Some(Entry { title: name, ratios, published: None, target: None })
    };
    let entries: Vec<Entry> = device.methods.iter().filter_map(entry).collect();
    if let Some(plot) = ratio_plot(device.device.title(), last, &entries) {
        let _ = writeln!(html, "<div class=\"plots\">{plot}</div>");
    }
}
