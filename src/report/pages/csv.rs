//! All points of a report as comma-separated values.

use askama::Template;

use super::super::summary::Report;

/// A line for each point of each run.
#[derive(Template)]
#[template(path = "report.csv", escape = "none")]
pub(super) struct Table<'a> {
    pub(super) report: &'a Report,
}

/// A field as RFC 4180 wants it.
fn field(text: &str) -> String {
    if text.contains([',', '"', '\n']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}
