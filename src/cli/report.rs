//! `lightgrid report`.

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use super::interrupt::kept;
use super::progress::Progress;
use super::values;
use crate::error::{Error, Result};
use crate::render::gpu::adapters;
use crate::render::{Gi, Sampling, Sharing};
use crate::report::{
    Device, Effort, Frame, Method, Options, Plan, Row, ablations, check, duration, make,
    markdown_table, sat, talk,
};
use crate::scene::builtin;
use crate::terminal::{notice, print, tell};

/// Arguments of `report`.
#[derive(Debug, clap::Args)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    after_help = "Results are on disk after every run: after Ctrl-C, or whatever else ended it, the same \
                  command goes on where it stopped. Other work on the machine makes the figures worthless."
)]
pub(super) struct ReportArguments {
    #[command(subcommand)]
    what: Option<What>,
    #[command(flatten)]
    places: PlaceArguments,
    /// How the map is sampled; the first one is what the others are held against.
    #[arg(long, value_delimiter = ',', default_value = "plain,talk,adaptive", value_name = "LIST")]
    sampling: Vec<Sampling>,
    /// Whether paths are followed to their end, end in the radiance cache, or are measured both ways.
    #[arg(long, value_delimiter = ',', default_value = "exact", value_name = "LIST")]
    gi: Vec<Gi>,
    /// Whether pixels of a tile share what their paths find, as `render` does, or not, as the window does.
    #[arg(long, default_value = "auto", value_name = "off|4x4|8x8|auto")]
    sharing: Sharing,
    /// A picture to take as the reference, linear, of the size of the runs (box filter, as many
    /// bounces); without it one is computed and kept.
    #[arg(long, value_name = "FILE")]
    reference: Option<PathBuf>,
    #[command(flatten)]
    effort: EffortArguments,
}

#[derive(Debug, clap::Subcommand)]
enum What {
    /// Measure the talk's whole table: all its scenes, on the CPU and, if there is one, on the GPU.
    Talk(EffortArguments),
    /// Measure what every default of the code is worth, one change at a time.
    Ablations(AblationArguments),
    /// Measure the importance tables on the talk's maps and an extreme one.
    Sat(SatArguments),
}

#[derive(Debug, clap::Args)]
struct AblationArguments {
    #[command(flatten)]
    places: PlaceArguments,
    /// Only changes whose name or group contains one of these words.
    #[arg(long, value_delimiter = ',', value_name = "WORD")]
    only: Vec<String>,
    #[command(flatten)]
    effort: EffortArguments,
}

#[derive(Debug, clap::Args)]
struct PlaceArguments {
    /// glTF files or built-in scenes.
    #[arg(value_name = "SCENE")]
    scenes: Vec<String>,
    /// Maps, each for every scene: .exr, .hdr, 8-bit pictures, or built-in skies.
    #[arg(long, value_name = "MAP", num_args = 1..)]
    env: Vec<String>,
}

#[derive(Debug, clap::Args)]
struct EffortArguments {
    /// The report's folder.
    #[arg(short, long, value_name = "DIR", required = true)]
    output: Option<PathBuf>,
    /// Where to measure: cpu, gpu (be it a software one), or both.
    #[arg(long, value_delimiter = ',', value_name = "LIST")]
    device: Vec<Device>,
    /// The GPU whose name or backend contains this; `lightgrid devices` lists them.
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Seconds of every run, learning included.
    #[arg(long, default_value = "30", value_parser = values::positive, allow_hyphen_values = true, value_name = "S")]
    seconds: f64,
    /// Independent runs of every combination; intervals need two and are worth something from four on.
    #[arg(long, default_value = "6", value_parser = values::whole::<u32>(1..=10_000), value_name = "N")]
    seeds: u32,
    /// Picture size in pixels.
    #[arg(long, default_value = "240x135", value_parser = values::size, allow_hyphen_values = true, value_name = "WxH")]
    size: (u32, u32),
    /// Vertices, on surfaces and in fog, at which a path gathers light; 1 is direct light only.
    #[arg(long, default_value = "5", value_parser = values::whole::<u32>(1..=1000), value_name = "N")]
    bounces: u32,
    /// The reference is rendered until its noise is this share of the smallest error.
    #[arg(long, default_value = "0.05", value_parser = share, allow_hyphen_values = true, value_name = "X")]
    reference_noise: f64,
    /// Folder that references are kept in, to share them between reports; without it, in the
    /// report's.
    #[arg(long, value_name = "DIR")]
    references: Option<PathBuf>,
    /// Threads; 0 uses every core.
    #[arg(long, default_value = "0", value_parser = values::whole::<u16>(0..=1024), value_name = "N")]
    threads: u16,
}

#[derive(Debug, clap::Args)]
struct SatArguments {
    /// Folder for sat.json and sat.csv; without it the table is only printed.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Makes the maps' sides this many times as long, for a quick look.
    #[arg(long, default_value = "1", value_parser = share, allow_hyphen_values = true, value_name = "X")]
    scale: f64,
}

/// A number above 0, at most 1.
fn share(text: &str) -> std::result::Result<f64, String> {
    let share = values::positive(text).ok().filter(|x| *x <= 1.0);
    share.ok_or_else(|| "expected a number above 0, at most 1".to_owned())
}

/// Measures and writes.
pub(super) fn run(arguments: &ReportArguments) -> Result<()> {
    let command = command_line();
    match &arguments.what {
        Some(What::Sat(arguments)) => tables(arguments),
        Some(What::Talk(arguments)) => {
            report(&talk::plan(effort(arguments, all_devices), command), arguments)
        }
        Some(What::Ablations(arguments)) => {
            let effort = effort(&arguments.effort, || vec![Device::Cpu]);
            let places = &arguments.places;
            let is_usual = places.scenes.is_empty() && places.env.is_empty();
            let rows = if is_usual { Vec::new() } else { rows(places) };
            let plan = ablations::plan(rows, &arguments.only, effort, command);
            if plan.methods.len() == 2 {
                return Err(Error::new(format!(
                    "--only {}: no change is called so; there are the groups {}",
                    arguments.only.join(","),
                    ablations::groups().join(", ")
                )));
            }
            report(&plan, &arguments.effort)
        }
        None => report(&free(arguments, command), &arguments.effort),
    }
}

/// The CPU, and the GPU if there is any.
fn all_devices() -> Vec<Device> {
    let mut devices = vec![Device::Cpu];
    match adapters().first() {
        Some(_) => devices.push(Device::Gpu),
        None => notice("there is no GPU; the CPU alone is measured"),
    }
    devices
}

fn effort(arguments: &EffortArguments, default: impl FnOnce() -> Vec<Device>) -> Effort {
    let mut devices: Vec<Device> = Vec::new();
    for device in &arguments.device {
        if !devices.contains(device) {
            devices.push(*device);
        }
    }
    if devices.is_empty() {
        devices = default();
    }
    Effort {
        devices,
        frame: Frame { size: arguments.size, bounces: arguments.bounces },
        seconds: arguments.seconds,
        seeds: arguments.seeds,
        reference_noise: arguments.reference_noise,
    }
}

/// Every scene under every map.
fn rows(places: &PlaceArguments) -> Vec<Row> {
    let or = |names: &[String], default: &str| {
        if names.is_empty() { vec![default.to_owned()] } else { names.to_vec() }
    };
    let maps = or(&places.env, "sky:day");
    or(&places.scenes, builtin::DEFAULT_SCENE)
        .iter()
        .flat_map(|scene| maps.iter().map(move |map| Row::new(scene, map)))
        .collect()
}

fn free(arguments: &ReportArguments, command: String) -> Plan {
    let mut methods: Vec<Method> = Vec::new();
    for gi in &arguments.gi {
        for sampling in &arguments.sampling {
            let mut method = Method::of(*sampling).with_gi(*gi);
            method.settings.sharing = arguments.sharing;
            if !methods.contains(&method) {
                methods.push(method);
            }
        }
    }
    Plan {
        title: "Error against run time",
        introduction: &[
            "How far pictures are from what they converge to, as a function of the time spent on them, \
             for several ways of sampling the environment map.",
        ],
        differences: &[],
        rows: rows(&arguments.places),
        methods,
        baselines: vec![0],
        effort: effort(&arguments.effort, || vec![Device::Cpu]),
        reference: arguments.reference.clone(),
        command,
    }
}

/// Makes a report and says what came out.
fn report(plan: &Plan, arguments: &EffortArguments) -> Result<()> {
    check(plan)?;
    super::render::start_threads(arguments.threads)?;
    let folder = arguments.output.clone().unwrap_or_default();
    let cancel = kept("stopping; what is measured is kept");
    tell(estimate(plan));
    let progress = Progress::start("starting");
    let options = Options {
        folder: &folder,
        references: arguments.references.as_deref(),
        adapter: arguments.adapter.as_deref(),
        cancel: &cancel.asked,
        progress: &|what| progress.say(what),
        tell: &|what| progress.tell(&what),
    };
    let made = make(plan, &options);
    progress.finish();
    let report = made?;
    tell(format_args!("the report is {}", folder.join("report.html").display()));
    if report.rows.iter().any(|row| !row.devices.is_empty()) {
        print(markdown_table(&report))?;
    }
    if report.is_finished {
        return Ok(());
    }
    Err(Error::at(&folder, "stopped before the end; the same command goes on from here"))
}

/// What it will take, if nothing of it is there yet.
fn estimate(plan: &Plan) -> String {
    let Effort { devices, seconds, seeds, reference_noise, .. } = &plan.effort;
    let reference = match plan.reference {
        Some(_) => String::new(),
        None => format!(", references of about {} each", duration(seconds / reference_noise)),
    };
    let rows = match &plan.rows[..] {
        [row] => row.title.clone(),
        rows => format!("{} rows", rows.len()),
    };
    format!(
        "about {} from nothing: {rows} x {} devices x {} methods x {seeds} runs of {seconds} s{reference}",
        duration(plan.expected_seconds()),
        devices.len(),
        plan.methods.len()
    )
}

/// The table of importance tables.
fn tables(arguments: &SatArguments) -> Result<()> {
    super::render::start_threads(0)?;
    let cancel = kept("stopping after this map");
    let progress = Progress::start("starting");
    let measured = sat::measure_all(
        arguments.scale,
        arguments.output.as_deref(),
        |case| {
            progress.say(format!("{}, {}x{}", case.title, case.size.0, case.size.1));
            cancel.asked.load(Ordering::Relaxed)
        },
        |measured| progress.tell(&format!("{}: {}", measured.title, measured.report)),
    );
    progress.finish();
    let measured = measured?;
    print(format_args!("{}\n{}", sat::markdown(&measured), sat::REMARK))?;
    if measured.len() < sat::cases().len() {
        return Err(Error::new("stopped before the end"));
    }
    Ok(())
}

/// What was typed, to be typed again.
fn command_line() -> String {
    let quoted = |word: String| {
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./:,=@".contains(c);
        let is_plain = !word.is_empty() && word.chars().all(is_plain);
        if is_plain { word } else { format!("'{}'", word.replace('\'', r"'\''")) }
    };
    let words = std::env::args_os().skip(1).map(|word| quoted(word.to_string_lossy().into_owned()));
    std::iter::once("lightgrid".to_owned()).chain(words).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        arguments: ReportArguments,
    }

    #[test]
    fn pixels_share_as_is_asked_for() {
        let methods = |line: &str| {
            let words = format!("report office -o out --sampling plain,adaptive {line}");
            let arguments = Line::try_parse_from(words.split_whitespace()).expect("as it is shown");
            free(&arguments.arguments, String::new()).methods
        };
        assert_eq!(methods(""), [Sampling::Plain, Sampling::Adaptive].map(Method::of));
        let sharing: Vec<_> = methods("--sharing off").iter().map(|m| m.settings.sharing).collect();
        assert_eq!(sharing, [Sharing::Off; 2]);
    }
}
