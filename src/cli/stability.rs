//! `lightgrid stability`.

use std::path::PathBuf;

use serde_json::json;

use super::picture::say_written;
use crate::error::{Error, Result};
use crate::image::check_writable;
use crate::output::record::write_json;
use crate::render::gpu::Gpu;
use crate::report::Device;
use crate::stability::{Case, CaseReport, Setting, Verdict, cases, run as run_case};
use crate::terminal::print;

/// Arguments of `stability`.
#[derive(Debug, clap::Args)]
pub(super) struct StabilityArguments {
    /// What renders: on the CPU all cases but those about a GPU, on a GPU the cases that render.
    #[arg(long, default_value = "cpu")]
    device: Device,
    /// The GPU whose name or backend contains this; `lightgrid devices` lists them.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Only cases whose name contains this, such as `maps` or `grid/crack`; may be given more than once.
    #[arg(long = "case", value_name = "NAME")]
    cases: Vec<String>,
    /// Writes every figure as JSON.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// The long counts: 1e9 rays, maps of a gigabyte, 1e8 learning paths. Hours.
    #[arg(long)]
    nightly: bool,
    /// Prints the names of the cases and runs none.
    #[arg(long)]
    list: bool,
}

/// Runs the cases, prints a line for each; an error if one fails.
pub(super) fn run(arguments: &StabilityArguments) -> Result<()> {
    super::render::start_threads(0)?;
    let chosen = choose(arguments)?;
    if arguments.list {
        return chosen.iter().try_for_each(|case| print(case.title()));
    }
    if let Some(file) = &arguments.json {
        check_writable(file)?;
    }
    let gpu = match arguments.device {
        Device::Cpu if arguments.adapter.is_some() => {
            return Err(Error::new("--adapter and --device cpu exclude each other"));
        }
        Device::Cpu => None,
        Device::Gpu => Some(Gpu::open(arguments.adapter.as_deref())?),
    };
    let device = gpu.as_ref().map_or("CPU".to_owned(), |gpu| gpu.facts().name.clone());
    let setting = Setting { gpu, nightly: arguments.nightly };
    let mut reports = Vec::new();
    for case in chosen {
        let report = run_case(case, &setting);
        print(report.line())?;
        reports.push(report);
    }
    if let Some(file) = &arguments.json {
        let all: Vec<_> = reports.iter().map(CaseReport::to_json).collect();
        let value = json!({
            "software": concat!("lightgrid ", env!("CARGO_PKG_VERSION")),
            "device": device,
            "nightly": arguments.nightly,
            "cases": all,
        });
        write_json(file, &value)?;
        say_written(file);
    }
    conclude(&reports)
}

fn choose(arguments: &StabilityArguments) -> Result<Vec<Case>> {
    let with_gpu = arguments.device == Device::Gpu;
    // A whole name means that case or that group; part of one, all that contain it.
    let is_named = |case: &Case, name: &str| {
        if cases().any(|other| other.group == name || other.title() == name) {
            case.group == name || case.title() == name
        } else {
            case.title().contains(name)
        }
    };
    let named = |case: &Case| {
        arguments.cases.is_empty() || arguments.cases.iter().any(|name| is_named(case, name))
    };
    let chosen: Vec<Case> = cases().filter(|case| case.runs(with_gpu) && named(case)).collect();
    if chosen.is_empty() {
        return Err(Error::new(format!(
            "no case for this device is called {}; lightgrid stability --list names them",
            arguments.cases.join(" or ")
        )));
    }
    Ok(chosen)
}

/// The last line, or the error that names what failed.
fn conclude(reports: &[CaseReport]) -> Result<()> {
    let of =
        |verdict: Verdict| reports.iter().filter(move |report| report.outcome.verdict() == verdict);
    let [passed, failed, skipped] =
        [Verdict::Passed, Verdict::Failed, Verdict::Skipped].map(|verdict| of(verdict).count());
    let seconds: f64 = reports.iter().map(|report| report.seconds).sum();
    print(format_args!("{passed} passed, {failed} failed, {skipped} skipped in {seconds:.0} s"))?;
    let failed: Vec<&str> = of(Verdict::Failed).map(|report| report.title.as_str()).collect();
    match &failed[..] {
        [] => Ok(()),
        failed => Err(Error::new(format!("failed: {}", failed.join(", ")))),
    }
}
