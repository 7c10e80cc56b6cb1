//! What a report leaves behind: `report.html`, `report.csv`, `report.json`, and the plots as SVG.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

mod devices;
mod format;
mod html;
mod overview;
mod pictures;
mod plots;
mod sections;
mod svg;
mod tables;

pub use format::{duration, markdown_table, row_sentence};

use super::summary::{Measure, Report};
use crate::error::Result;
use crate::image::{make_folder, write_beside_and_rename};
use crate::output::record::{to_value, write_json};

/// Writes all files of a report into a folder.
pub(super) fn write(report: &Report, folder: &Path) -> Result<()> {
    write_json(&folder.join("report.json"), &to_value(report)?)?;
    write_text(&folder.join("report.csv"), &csv(report))?;
    let plots = folder.join("plots");
    make_folder(&plots)?;
    if let Some(plot) = overview::overview_plot(report) {
        write_text(&plots.join("speed-ups.svg"), &plot)?;
    }
    for row in &report.rows {
        for device in &row.devices {
            let plot =
                plots::error_plot(device, Measure::TrimmedRelMse, report.plan.effort.seconds);
            if let Some(plot) = plot {
                let name = format!("{}-{}.svg", row.row.title, device.device.title());
                write_text(&plots.join(file_name(&name)), &plot)?;
            }
        }
    }
    write_text(&folder.join("report.html"), &html::page(report)?)
}

fn write_text(path: &Path, text: &str) -> Result<()> {
    write_beside_and_rename(path, |file| file.write_all(text.as_bytes()))
}

/// A title as the name of a file.
fn file_name(title: &str) -> String {
    let keep =
        |c: char| if c.is_ascii_alphanumeric() || c == '.' { c.to_ascii_lowercase() } else { '-' };
    let name: String = title.chars().map(keep).collect();
    name.split('-').filter(|part| !part.is_empty()).collect::<Vec<_>>().join("-")
}

/// Text inside HTML or SVG.
fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// One line a point of each run.
fn csv(report: &Report) -> String {
    let mut text = String::from(
        "row,scene,map,device,method,seed,seconds,render_seconds,samples_per_pixel,rays,mse,\
         rel_mse,trimmed_rel_mse,block_rel_mse,flip,mean_ratio\n",
    );
    for row in &report.rows {
        for device in &row.devices {
            for method in &device.methods {
                let names = [
                    &row.row.title,
                    &row.row.scene,
                    &row.row.map,
                    device.device.title(),
                    &method.method.name,
                ];
                let names = names.map(csv_text).join(",");
                for run in &method.runs {
                    for point in &run.points {
                        let errors = point.errors.map_or_else(
                            || ",,,,,".to_owned(),
                            |e| {
                                let values = [
                                    e.mse,
                                    e.rel_mse,
                                    e.trimmed_rel_mse,
                                    e.block_rel_mse,
                                    e.flip.unwrap_or(f64::NAN),
                                    e.mean_ratio,
                                ];
                                values.map(|v| v.to_string()).join(",")
                            },
                        );
                        let _ = writeln!(
                            text,
                            "{names},{},{},{},{},{},{errors}",
                            run.seed,
                            point.seconds,
                            point.render_seconds,
                            point.samples,
                            point.rays
                        );
                    }
                }
            }
        }
    }
    text
}

/// A field as RFC 4180 wants it.
fn csv_text(text: &str) -> String {
    if text.contains([',', '"', '\n']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}
