//! The section of a row.

use std::fmt::Write as _;

use super::super::statistics::Estimate;
use super::super::summary::{Measure, Report, RowReport};
use super::format;
use super::pictures::{Window, data_uri, developed};
use super::plots::error_plot;
use super::tables::Table;
use super::{
    devices, escape,
    format::{baseline, is_long, percent},
    overview,
};
use crate::error::Result;
use crate::image::Rgb8;

/// One scene under one map.
pub(super) fn row(report: &Report, row: &RowReport, html: &mut String) -> Result<()> {
    let _ = writeln!(html, "<h2>{}</h2>", escape(&row.row.title));
    let _ = writeln!(html, "<p class=\"soft\">{}</p>", escape(&facts(row)));
    if is_long(report) {
        for device in &row.devices {
            overview::ratios_of_device(report, device, html);
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
        devices::errors(report, device, html);
        devices::costs(report, device, html);
    }
    biases(row, html);
    what_is_left(report, row, html);
    Ok(())
}

fn biases(row: &RowReport, html: &mut String) {
    if row.biases.is_empty() {
        return;
    }
    html.push_str("<h3>What is systematic</h3>\n");
    let mut table = Table::new(&["", "device", "of 8x8 blocks, rms", "squared"]);
    for bias in &row.biases {
        let squared = Estimate { mean: bias.squared, standard_error: bias.standard_error };
        table.row(&[
            bias.method.clone(),
            bias.device.clone(),
            percent(bias.root()),
            format::estimate(squared),
        ]);
    }
    html.push_str(&table.finish());
    html.push_str(
        "<p class=\"soft\">How far the mean of ever more runs would be from the reference, relative, \
         by what different runs err alike. Only cached paths have a bias; what others show is the \
         reference's noise, and chance.</p>\n",
    );
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
            format::duration(facts.seconds),
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
                format::error(noise.trimmed_rel_mse),
                percent(share),
                if reference.is_good { "" } else { ": too much" }
            );
        }
        _ => text.push_str(" Its own noise is not known."),
    }
    text
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
                    format!(", trimmed relMSE {}", format::error(e.trimmed_rel_mse))
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

fn what_is_left(report: &Report, row: &RowReport, html: &mut String) {
    if row.shares.is_empty() {
        return;
    }
    let baseline = baseline(report);
    html.push_str("<h3>Where the error is left</h3>\n");
    let first = &row.shares[0];
    let against = ["first", "later"].map(|part| format!("{part}, {} over it", first.method));
    let mut table = Table::new(&[
        "",
        "samples / pixel",
        "trimmed relMSE",
        "first vertex",
        "later vertices",
        "pixel filter",
        "together",
        &against[0],
        &against[1],
    ]);
    for s in &row.shares {
        let part = |value: f64| format!("{} ({})", format::error(value), percent(value / s.total));
        table.row(&[
            s.method.clone(),
            s.samples.to_string(),
            format::error(s.total),
            part(s.first_vertex),
            part(s.later_vertices),
            part(s.filter),
            percent(s.together() / s.total),
            format::ratio(first.first_vertex / s.first_vertex),
            format::ratio(first.later_vertices / s.later_vertices),
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
                format::verdict(found, target),
                format::speed_up(found)
            );
        }
    }
    for shares in &row.shares {
        let _ = writeln!(html, "<p>{}</p>", escape(&format::shares_sentence(shares)));
    }
    for device in &row.devices {
        if let Some(sentence) = format::bound_sentence(row, device, baseline) {
            let _ = writeln!(html, "<p>{}</p>", escape(&sentence));
        }
    }
}
