//! All points of a report as comma-separated values.

use std::fmt::Write as _;

use super::super::measure::Point;
use super::super::summary::Report;

/// A line for each point of each run.
pub(super) fn table(report: &Report) -> String {
    let mut text = String::from(
        "row,scene,map,device,method,seed,seconds,render_seconds,samples_per_pixel,rays,mse,\
         rel_mse,trimmed_rel_mse,block_rel_mse,flip,mean_ratio,denoised_flip\n",
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
                let names = names.map(field).join(",");
                for run in &method.runs {
                    for point in &run.points {
                        let errors = point.errors.map_or_else(
                            || ",,,,,,".to_owned(),
                            |e| {
                                let values = [
                                    e.mse,
                                    e.rel_mse,
                                    e.trimmed_rel_mse,
                                    e.block_rel_mse,
                                    e.flip.unwrap_or(f64::NAN),
                                    e.mean_ratio,
                                    point.denoised_flip.unwrap_or(f64::NAN),
                                ];
                                values.map(|v| v.to_string()).join(",")
                            },
                        );
                        let seed = run.seed;
                        let Point { seconds, render_seconds, samples, rays, .. } = point;
                        let _ = writeln!(
                            text,
                            "{names},{seed},{seconds},{render_seconds},{samples},{rays},{errors}"
                        );
                    }
                }
            }
        }
    }
    text
}

/// A field as RFC 4180 wants it.
fn field(text: &str) -> String {
    if text.contains([',', '"', '\n']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}
