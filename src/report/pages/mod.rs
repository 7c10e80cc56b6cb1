//! The files of a report: `report.html`, `report.csv`, `report.json`, and the plots as SVG.

use std::io::Write as _;
use std::path::Path;

use askama::Template;

mod format;
mod page;
mod pictures;
mod plots;
mod results;
pub(super) mod sat;

pub use format::duration;
pub use results::{markdown_table, row_sentence};

use super::summary::Report;
use crate::error::Result;
use crate::image::{make_folder, write_beside_and_rename};
use crate::output::record::write_json;

/// Writes all files of a report into a folder.
pub(super) fn write(report: &Report, folder: &Path) -> Result<()> {
    write_json(&folder.join("report.json"), report)?;
    write_text(&folder.join("report.csv"), &Csv { report }.to_string())?;
    let plots = folder.join("plots");
    make_folder(&plots)?;
    let page = page::Page::new(report)?;
    if let Some(plot) = page.overview.as_ref().filter(|_| !report.is_long()) {
        write_text(&plots.join("speed-ups.svg"), plot)?;
    }
    for section in &page.sections {
        for (device, plot) in &section.error_plots {
            let name = format!("{}-{}.svg", section.row.row.title, device.title());
            write_text(&plots.join(file_name(&name)), plot)?;
        }
    }
    write_text(&folder.join("report.html"), &page.to_string())
}

pub(super) fn write_text(path: &Path, text: &str) -> Result<()> {
    write_beside_and_rename(path, |file| file.write_all(text.as_bytes()))
}

/// A line for each point of each run.
#[derive(Template)]
#[template(path = "report.csv", escape = "none")]
struct Csv<'a> {
    report: &'a Report,
}

/// A field as RFC 4180 wants it.
fn field(text: &str) -> String {
    let is_quoted = text.contains([',', '"', '\n']);
    if is_quoted { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

/// A title as the name of a file.
fn file_name(title: &str) -> String {
    let keep =
        |c: char| if c.is_ascii_alphanumeric() || c == '.' { c.to_ascii_lowercase() } else { '-' };
    let name: String = title.chars().map(keep).collect();
    name.split('-').filter(|part| !part.is_empty()).collect::<Vec<_>>().join("-")
}
