//! The parts of the page: the overview, and one section a row.

use std::fmt::Write as _;

use super::super::summary::{DeviceReport, Measure, MethodReport, Report, RowReport};
use super::pictures::{Window, data_uri, developed};
use super::plots::{Entry, error_plot, ratio_plot};
use super::tables::Table;
use super::words;
use super::{escape, words::percent};
use crate::error::Result;
use crate::image::Rgb8;

/// With more methods than this a row shows ratios instead of curves and pictures.
const MANY: usize = 6;

fn is_long(report: &Report) -> bool {
    report.plan.methods.len() > MANY
}

fn baseline(report: &Report) -> &str {
    &report.plan.methods[report.plan.baselines[0]].name
}

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
    let plan = &report.plan;
    let baseline = baseline(report);
    let others: Vec<&str> =
        plan.methods.iter().map(|m| m.name.as_str()).filter(|name| *name != baseline).collect();
    let mut head = vec!["", "device"];
    head.extend(&others);
    let is_beside_talk =
        plan.rows.iter().any(|row| row.published.is_some() || row.target.is_some());
    if is_beside_talk {
        head.extend(["published", "target"]);
    }
    head.push("reference noise");
    let mut table = Table::new(&head);
    for row in &report.rows {
        for device in &row.devices {
            if let Some(reason) = &device.not_measured {
                table.remark(&row.row.title, &format!("{}: {reason}", device.device.title()));
                continue;
            }
            let mut cells = vec![row.row.title.clone(), device.device.title().to_owned()];
            cells.extend(others.iter().map(|name| ratio_cell(device, name, baseline)));
            if is_beside_talk {
                let published = words::published(row, device.device);
                cells.push(published.map_or_else(String::new, words::ratio));
                cells.push(words::target_cell(row, device, baseline).trim_matches('-').to_owned());
            }
            let share = row.reference.as_ref().and_then(|r| r.share);
            cells.push(share.map_or_else(|| "unknown".to_owned(), percent));
            table.row(&cells);
        }
    }
    let _ = writeln!(
        html,
        "<p>Time to equal trimmed relMSE: how many times sooner than <b>{}</b>, with learning and \
         tables counted.</p>",
        escape(baseline)
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
                published: words::published(row, device.device),
                target: row.row.target,
            });
        }
    }
    ratio_plot("Time to equal error", baseline, &entries)
}

fn ratio_cell(device: &DeviceReport, name: &str, baseline: &str) -> String {
    let method = device.method(name);
    method.map_or_else(String::new, |m| words::speed_up_cell(m, baseline, Measure::TrimmedRelMse))
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
        let mean =
            (!known.is_empty()).then(|| (known.iter().sum::<f64>() / known.len() as f64).exp());
        let mut cells = vec![method.name.clone()];
        cells.push(mean.map_or_else(String::new, words::ratio));
        cells.extend(found.into_iter().map(|s| s.map_or_else(String::new, words::speed_up)));
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

/// One scene under one map.
pub(super) fn row(report: &Report, row: &RowReport, html: &mut String) -> Result<()> {
    let _ = writeln!(html, "<h2>{}</h2>", escape(&row.row.title));
    let _ = writeln!(html, "<p class=\"soft\">{}</p>", escape(&facts(row)));
    if is_long(report) {
        for device in &row.devices {
            ratios_of_device(report, device, html);
        }
    } else {
        html.push_str("<div class=\"plots\">\n");
        for device in &row.devices {
            let plot = error_plot(device, Measure::TrimmedRelMse, report.plan.effort.seconds);
            html.push_str(&plot.unwrap_or_default());
        }
        html.push_str("</div>\n");
        pictures(report, row, html)?;
    }
    for device in &row.devices {
        if let Some(reason) = &device.not_measured {
            let _ = writeln!(html, "<p>{}: {}.</p>", device.device.title(), escape(reason));
            continue;
        }
        errors(report, device, html);
        costs(report, device, html);
    }
    what_is_left(report, row, html);
    Ok(())
}

fn facts(row: &RowReport) -> String {
    let mut text = format!(
        "{} ({} triangles) under {} ({}x{}).",
        row.row.scene, row.triangles, row.row.map, row.map_size.0, row.map_size.1
    );
    let Some(reference) = &row.reference else { return text + " There is no reference yet." };
    if let Some(facts) = &reference.facts {
        let _ = write!(
            text,
            " Reference: {} pictures of {} samples per pixel, rendered in {} on {}.",
            facts.pictures,
            facts.samples_per_picture,
            words::duration(facts.seconds),
            facts.device
        );
    }
    if let Some(file) = &reference.file {
        let _ = write!(text, " Reference: {file}.");
    }
    match (reference.noise, reference.share) {
        (Some(noise), Some(share)) => {
            let _ = write!(
                text,
                " Its own trimmed relMSE is {}, {} of the smallest error{}.",
                words::error(noise.trimmed_rel_mse),
                percent(share),
                if reference.is_good { "" } else { ": too much" }
            );
        }
        _ => text.push_str(" Its own noise is not known."),
    }
    text
}

/// Ratios of many methods on one device.
fn ratios_of_device(report: &Report, device: &DeviceReport, html: &mut String) {
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

/// The reference, and the same part of all pictures at equal time, device by device.
fn pictures(report: &Report, row: &RowReport, html: &mut String) -> Result<()> {
    let Some(reference) = &row.pictures.reference else { return Ok(()) };
    let Some((.., noisiest)) = row.pictures.runs.first() else { return Ok(()) };
    let window = Window::most_telling(noisiest, reference);
    let whole = developed(reference, reference);
    html.push_str("<div class=\"pictures\">\n");
    let caption =
        format!("the reference; below, the part of it where {} is noisiest", baseline(report));
    figure(html, &whole, WHOLE_WIDTH, &escape(&caption))?;
    for device in &row.devices {
        let pictures = row.pictures.runs.iter().filter(|(d, ..)| *d == device.device);
        let mut pictures = pictures.peekable();
        if pictures.peek().is_none() {
            continue;
        }
        html.push_str("</div>\n<div class=\"pictures\">\n");
        for (_, name, picture) in pictures {
            let last = device.method(name).and_then(|m| m.runs.first()?.points.last().copied());
            let caption = last.map_or_else(String::new, |point| {
                let error = point.errors.map_or_else(String::new, |e| {
                    format!(", trimmed relMSE {}", words::error(e.trimmed_rel_mse))
                });
                format!("{:.1} s, {} samples{error}", point.seconds, point.samples)
            });
            let caption = format!("<b>{}</b>, {}, {caption}", escape(name), device.device.title());
            figure(html, &window.of(&developed(picture, reference)), PART_WIDTH, &caption)?;
        }
        figure(html, &window.of(&whole), PART_WIDTH, "<b>reference</b>")?;
    }
    html.push_str("</div>\n");
    Ok(())
}

/// Widths on the page, in CSS pixels.
const WHOLE_WIDTH: u32 = 520;
const PART_WIDTH: u32 = 264;

fn figure(html: &mut String, picture: &Rgb8, width: u32, caption: &str) -> Result<()> {
    let source = data_uri(picture)?;
    let _ = writeln!(
        html,
        "<figure style=\"width:{width}px\"><img src=\"{source}\" style=\"width:{width}px\" \
         alt=\"\"><figcaption>{caption}</figcaption></figure>"
    );
    Ok(())
}

fn errors(report: &Report, device: &DeviceReport, html: &mut String) {
    let title = device.device.title();
    let _ = writeln!(html, "<h3>{title}: errors after {} s</h3>", report.plan.effort.seconds);
    let mut head = vec!["", "runs"];
    head.extend(Measure::ALL.map(Measure::title));
    head.extend(["slope", "mean ratio"]);
    let mut table = Table::new(&head);
    for method in device.methods.iter().filter(|m| !m.runs.is_empty()) {
        let mut cells = vec![method.method.name.clone(), method.runs.len().to_string()];
        cells.extend(
            Measure::ALL.map(|m| method.error(m).map_or_else(String::new, words::estimate)),
        );
        let slope = method.slopes.iter().find(|(m, _)| *m == Measure::TrimmedRelMse);
        cells.push(words::plain_estimate(slope.map(|(_, s)| *s), 2));
        cells.push(words::plain_estimate(method.mean_ratio, 4));
        table.row(&cells);
    }
    html.push_str(&table.finish());

    let _ = writeln!(html, "<h3>{title}: how much sooner to the same error</h3>");
    let names: Vec<&str> =
        report.plan.baselines.iter().map(|b| report.plan.methods[*b].name.as_str()).collect();
    let mut head: Vec<String> = vec![String::new()];
    head.extend(names.iter().skip(1).map(|name| format!("over {name}")));
    head.push(format!("over {}", names[0]));
    head.extend(Measure::ALL[1..].iter().map(|m| format!("by {}", m.title())));
    head.push("without learning".to_owned());
    let mut table = Table::new(&head.iter().map(String::as_str).collect::<Vec<_>>());
    for method in device.methods.iter().filter(|m| !m.runs.is_empty()) {
        let mut cells = vec![method.method.name.clone()];
        let over = |name: &str, measure| words::speed_up_cell(method, name, measure);
        cells.extend(names.iter().skip(1).map(|name| over(name, Measure::TrimmedRelMse)));
        cells.extend(Measure::ALL.iter().map(|m| over(names[0], *m)));
        cells.push(method.without_learning.map_or_else(String::new, words::ratio));
        table.row(&cells);
    }
    html.push_str(&table.finish());
}

fn costs(report: &Report, device: &DeviceReport, html: &mut String) {
    let title = device.device.title();
    let _ = writeln!(html, "<h3>{title}: where the time goes</h3>");
    let mut table = Table::new(&[
        "",
        "learning",
        "tables",
        "rays",
        "shading",
        "samples / pixel",
        "rays / sample",
        "Mrays / s",
        "learning paths",
    ]);
    let (width, height) = report.plan.effort.frame.size;
    for method in device.methods.iter().filter(|m| !m.runs.is_empty()) {
        let c = &method.costs;
        let rays = c.rays_per_sample * c.samples * f64::from(width) * f64::from(height);
        let shading = c.ray_seconds.map(|rays| c.render_seconds - rays);
        let rendering = format!("{:.2} s in all", c.render_seconds);
        table.row(&[
            method.method.name.clone(),
            format!("{:.2} s", c.learn_seconds),
            format!("{:.2} s", c.table_seconds),
            c.ray_seconds.map_or(rendering, |s| format!("{s:.2} s")),
            shading.map_or_else(String::new, |s| format!("{s:.2} s")),
            format!("{:.0}", c.samples),
            format!("{:.2}", c.rays_per_sample),
            format!("{:.2}", rays / c.render_seconds.max(1e-9) / 1e6),
            c.learning_paths.to_string(),
        ]);
    }
    html.push_str(&table.finish());
    let remark = if device.methods.iter().any(|m| m.costs.ray_seconds.is_some()) {
        "Rays: their number times what one took when they were timed one by one, in a measurement of \
         its own with what the first run had learned; shading is the rest of rendering."
    } else {
        "A GPU's kernel traces and shades in one: the two are not told apart."
    };
    let _ = writeln!(html, "<p class=\"soft\">{remark}</p>");
    memory(device, html);
}

fn memory(device: &DeviceReport, html: &mut String) {
    let _ = writeln!(html, "<h3>{}: memory, MB</h3>", device.device.title());
    let mut table = Table::new(&[
        "",
        "Light Grid",
        "while learning, at most",
        "cells with a law",
        "map's table",
        "scene's tree",
        "all on the device",
    ]);
    for method in device.methods.iter().filter(|m| !m.runs.is_empty()) {
        let m = &method.memory;
        table.row(&[
            method.method.name.clone(),
            words::megabytes(m.grid_bytes),
            words::megabytes(m.grid_peak_bytes),
            format!("{:.0}", method.costs.learned_cells),
            words::megabytes(m.table_bytes),
            words::megabytes(m.bvh_bytes),
            m.device_bytes.map_or_else(String::new, words::megabytes),
        ]);
    }
    html.push_str(&table.finish());
}

fn what_is_left(report: &Report, row: &RowReport, html: &mut String) {
    if row.shares.is_empty() {
        return;
    }
    let baseline = baseline(report);
    html.push_str("<h3>Where the error is left</h3>\n");
    let mut table = Table::new(&[
        "",
        "samples / pixel",
        "trimmed relMSE",
        "first vertex",
        "later vertices",
        "pixel filter",
        "together",
    ]);
    for s in &row.shares {
        let part = |value: f64| format!("{} ({})", words::error(value), percent(value / s.total));
        table.row(&[
            s.method.clone(),
            s.samples.to_string(),
            words::error(s.total),
            part(s.first_vertex),
            part(s.later_vertices),
            part(s.filter),
            percent(s.together() / s.total),
        ]);
    }
    html.push_str(&table.finish());
    for device in &row.devices {
        let found = device.method("adaptive");
        let found = found.and_then(|m| m.speed_up(baseline, Measure::TrimmedRelMse));
        if let Some((target, found)) = row.row.target.zip(found) {
            let _ = writeln!(
                html,
                "<p><b>{}: {} of the target of {target}</b> ({}).</p>",
                device.device.title(),
                words::verdict(found, target),
                words::speed_up(found)
            );
        }
    }
    for shares in &row.shares {
        let _ = writeln!(html, "<p>{}</p>", escape(&words::shares_sentence(shares)));
    }
    for device in &row.devices {
        if let Some(sentence) = words::bound_sentence(row, device, baseline) {
            let _ = writeln!(html, "<p>{}</p>", escape(&sentence));
        }
    }
}
