//! The page `report.html`: what the template shows beside the report itself.

use askama::Template;

use super::super::plan::{Device, Method};
use super::super::statistics::SpeedUp;
use super::super::summary::{DeviceReport, Measure, MethodReport, Report, RowReport};
use super::pictures::{Window, data_uri, developed};
use super::plots::{Bar, Group, error_plot, speed_up_plot};
use super::{format, results};
use crate::error::Result;

/// The page of a report.
#[derive(Template)]
#[template(path = "report.html", whitespace = "minimize")]
pub(super) struct Page<'a> {
    report: &'a Report,
    /// The plot above all rows.
    pub(super) overview: Option<String>,
    ablations: Vec<AblationLine<'a>>,
    pub(super) sections: Vec<Section<'a>>,
}

/// A method's speed-ups over the last baseline.
struct AblationLine<'a> {
    method: &'a Method,
    /// Whether it is the first of its group.
    begins_group: bool,
    /// For each row and device.
    speed_ups: Vec<Option<SpeedUp>>,
    /// Geometric mean; `None` where some are missing, for it would be of other rows than other methods'.
    mean: Option<f64>,
}

/// What is shown of a row.
pub(super) struct Section<'a> {
    pub(super) row: &'a RowReport,
    pub(super) error_plots: Vec<(Device, String)>,
    /// Plots on the page.
    plots: Vec<String>,
    pictures: Option<Pictures<'a>>,
}

/// Pictures as values of `src`.
struct Pictures<'a> {
    reference: String,
    /// The part of it that is shown of all pictures.
    reference_crop: String,
    /// The same part of all methods' pictures, device by device.
    crops: Vec<(Device, Vec<(&'a MethodReport, String)>)>,
}

impl<'a> Page<'a> {
    pub(super) fn new(report: &'a Report) -> Result<Self> {
        let ablations = if report.is_long() { ablations(report) } else { Vec::new() };
        let overview = if report.is_long() {
            let mean = |(index, line): (usize, &AblationLine<'a>)| {
                Some(Group::of_method(Bar::new(&line.method.name, index, line.mean?, None)))
            };
            let groups = ablations.iter().enumerate().filter_map(mean).collect();
            speed_up_plot("Geometric mean over all rows", report.last_baseline(), groups)
        } else {
            let devices =
                report.rows.iter().flat_map(|row| row.devices.iter().map(move |d| (row, d)));
            let groups = devices.map(|(row, device)| Group::of_row(report, row, device)).collect();
            speed_up_plot("Time to equal error", report.baseline(), groups)
        };
        let sections =
            report.rows.iter().map(|row| Section::new(report, row)).collect::<Result<_>>()?;
        Ok(Self { report, overview, ablations, sections })
    }
}

/// All methods' speed-ups over the last baseline.
fn ablations<'a>(report: &'a Report) -> Vec<AblationLine<'a>> {
    let mut group = None;
    let line = |method: &'a Method| {
        let devices = report.rows.iter().flat_map(|row| &row.devices);
        let speed_up = |device: &DeviceReport| {
            device.method(&method.name)?.speed_up(report.last_baseline(), Measure::TrimmedRelMse)
        };
        let speed_ups: Vec<Option<SpeedUp>> = devices.map(speed_up).collect();
        let logarithms: Option<Vec<f64>> =
            speed_ups.iter().map(|found| found.map(|s| s.ratio.ln())).collect();
        let mean = logarithms.filter(|all| !all.is_empty());
        let mean = mean.map(|all| (all.iter().sum::<f64>() / all.len() as f64).exp());
        let begins_group = method.group != group;
        group = method.group;
        AblationLine { method, begins_group, speed_ups, mean }
    };
    report.plan.methods.iter().map(line).collect()
}

impl<'a> Section<'a> {
    fn new(report: &'a Report, row: &'a RowReport) -> Result<Self> {
        let of_errors = |device: &DeviceReport| {
            Some((device.device, error_plot(device, report.plan.effort.seconds)?))
        };
        let error_plots: Vec<_> = row.devices.iter().filter_map(of_errors).collect();
        if !report.is_long() {
            let plots = error_plots.iter().map(|(_, plot)| plot.clone()).collect();
            return Ok(Self { row, error_plots, plots, pictures: Pictures::new(row)? });
        }
        let baseline = report.last_baseline();
        let of_speed_ups = |device: &'a DeviceReport| {
            let groups = Bar::all(device, baseline).map(Group::of_method).collect();
            speed_up_plot(device.device.title(), baseline, groups)
        };
        let plots = row.devices.iter().filter_map(of_speed_ups).collect();
        Ok(Self { row, error_plots, plots, pictures: None })
    }
}

impl<'a> Pictures<'a> {
    /// `None` if there is no reference or no picture.
    fn new(row: &'a RowReport) -> Result<Option<Self>> {
        let Some(reference) = &row.pictures.reference else { return Ok(None) };
        let Some((.., noisiest)) = row.pictures.runs.first() else { return Ok(None) };
        let window = Window::most_telling(noisiest, reference);
        let whole = developed(reference, reference);
        let mut crops = Vec::new();
        for device in &row.devices {
            let mut of_device = Vec::new();
            for (_, name, picture) in row.pictures.runs.iter().filter(|(d, ..)| *d == device.device)
            {
                if let Some(method) = device.method(name) {
                    of_device.push((method, data_uri(&window.of(&developed(picture, reference)))?));
                }
            }
            if !of_device.is_empty() {
                crops.push((device.device, of_device));
            }
        }
        let reference_crop = data_uri(&window.of(&whole))?;
        Ok(Some(Self { reference: data_uri(&whole)?, reference_crop, crops }))
    }
}
