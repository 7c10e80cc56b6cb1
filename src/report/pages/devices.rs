//! Tables of one row on one device: errors, speed-ups, time, memory.

use std::fmt::Write as _;

use super::super::summary::{DeviceReport, Measure, Report};
use super::format;
use super::tables::Table;

pub(super) fn errors(report: &Report, device: &DeviceReport, html: &mut String) {
    let title = device.device.title();
    let _ = writeln!(html, "<h3>{title}: errors after {} s</h3>", report.plan.effort.seconds);
    let mut head = vec!["", "runs"];
    head.extend(Measure::ALL.map(Measure::title));
    head.extend(["FLIP, denoised", "slope", "mean ratio"]);
    let mut table = Table::new(&head);
    for method in device.methods.iter().filter(|m| !m.runs.is_empty()) {
        let mut cells = vec![method.method.name.clone(), method.runs.len().to_string()];
        cells.extend(
            Measure::ALL.map(|m| method.error(m).map_or_else(String::new, format::estimate)),
        );
        cells.push(format::plain_estimate(method.denoised_flip, 4));
        let slope = method.slopes.iter().find(|(m, _)| *m == Measure::TrimmedRelMse);
        cells.push(format::plain_estimate(slope.map(|(_, s)| *s), 2));
        cells.push(format::plain_estimate(method.mean_ratio, 4));
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
        let over = |name: &str, measure| format::speed_up_cell(method, name, measure);
        cells.extend(names.iter().skip(1).map(|name| over(name, Measure::TrimmedRelMse)));
        cells.extend(Measure::ALL.iter().map(|m| over(names[0], *m)));
        cells.push(method.without_learning.map_or_else(String::new, format::ratio));
        table.row(&cells);
    }
    html.push_str(&table.finish());
}

pub(super) fn costs(report: &Report, device: &DeviceReport, html: &mut String) {
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
        "cells with a distribution",
        "map's table",
        "scene's tree",
        "all on the device",
    ]);
    for method in device.methods.iter().filter(|m| !m.runs.is_empty()) {
        let m = &method.memory;
        table.row(&[
            method.method.name.clone(),
            format::megabytes(m.grid_bytes),
            format::megabytes(m.grid_peak_bytes),
            format!("{:.0}", method.costs.learned_cells),
            format::megabytes(m.table_bytes),
            format::megabytes(m.bvh_bytes),
            m.device_bytes.map_or_else(String::new, format::megabytes),
        ]);
    }
    html.push_str(&table.finish());
}
