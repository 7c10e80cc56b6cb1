//! What a person types, and what they read back.

use std::process::ExitCode;
use std::sync::LazyLock;

use clap::{CommandFactory as _, Parser, Subcommand};

pub use crate::out_of_memory::Allocator;

use crate::error::Result;
use crate::memory;
use crate::out_of_memory;
use crate::render::SAMPLES_VERSION;
use crate::system;
use crate::terminal;

#[cfg(not(all(feature = "window", feature = "report")))]
mod absent;
#[cfg(feature = "report")]
mod bench;
mod camera;
mod choices;
mod compare;
mod device;
mod generate;
mod info;
mod interrupt;
mod merge;
mod picture;
mod progress;
mod render;
#[cfg(feature = "report")]
mod report;
mod sat;
#[cfg(feature = "window")]
mod screenshot;
#[cfg(feature = "report")]
mod stability;
mod values;
#[cfg(feature = "window")]
mod view;

#[cfg(not(all(feature = "window", feature = "report")))]
use absent::*;

/// What a report of a fault should name: version, commit, features, and the version of the samples.
static LONG_VERSION: LazyLock<String> = LazyLock::new(|| {
    let features = [
        ("window", cfg!(feature = "window")),
        ("gpu", cfg!(feature = "gpu")),
        ("report", cfg!(feature = "report")),
        ("flip", cfg!(feature = "flip")),
        ("meshopt", cfg!(feature = "meshopt")),
    ];
    let features = features.iter().filter(|(_, has)| *has).map(|(name, _)| *name);
    format!(
        "{}\ncommit: {}\nfeatures: {}\nsamples: version {SAMPLES_VERSION}",
        env!("CARGO_PKG_VERSION"),
        option_env!("LIGHTGRID_COMMIT").unwrap_or("not known"),
        features.collect::<Vec<_>>().join(" "),
    )
});

/// A progressive path tracer for scenes lit by an HDR environment map. It learns which tiles of the
/// map each part of the picture can see, and samples only those.
#[derive(Debug, Parser)]
#[command(
    name = "lightgrid",
    version,
    long_version = LONG_VERSION.as_str(),
    after_help = "\
Without a command the window opens with the built-in living room.

Examples:
  lightgrid view kitchen.glb --env meadow.hdr
  lightgrid render office --env sky:sunset --spp 64 -o office.png"
)]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Open the window.
    #[cfg_attr(not(feature = "window"), command(hide = true))]
    View(Box<view::ViewArguments>),
    /// Draw the window's content into a file; no display is needed.
    #[cfg_attr(not(feature = "window"), command(hide = true))]
    Screenshot(Box<screenshot::ScreenshotArguments>),
    /// Render a scene into a picture.
    Render(Box<render::RenderArguments>),
    /// Join parts of a picture that were rendered apart.
    Merge(merge::MergeArguments),
    /// Measure how far a picture is from a reference.
    Compare(compare::CompareArguments),
    /// Say what is in a scene or a map, and what the renderer leaves out.
    Info(info::InfoArguments),
    /// List the GPUs and what they allow.
    Devices(device::DevicesArguments),
    /// Measure what this machine can do: rays and samples a second, waits, what the host costs.
    #[cfg_attr(not(feature = "report"), command(hide = true))]
    Bench(bench::BenchArguments),
    /// Measure error against run time: curves, speed-ups, the talk's table.
    #[cfg_attr(not(feature = "report"), command(hide = true))]
    Report(Box<report::ReportArguments>),
    /// Compare the importance tables' accuracy on maps (the talk's summed-area-table claim).
    Sat(sat::SatArguments),
    /// Try stiff and extreme cases on this machine; fails if one does.
    #[cfg_attr(not(feature = "report"), command(hide = true))]
    Stability(stability::StabilityArguments),
    /// Print what completes these commands in a shell.
    Completions(generate::CompletionsArguments),
    /// Write a manual page for each command.
    Man(generate::ManArguments),
}

/// Runs the command line; errors become one sentence on stderr and a non-zero exit.
pub fn main() -> ExitCode {
    system::prepare_process();
    out_of_memory::is_an_error();
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(answer) => return say(&answer),
    };
    match run(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // Else another thread is about to end the process.
            while !memory::has_last_word() {
                std::thread::park();
            }
            terminal::tell(format_args!("lightgrid: {error}"));
            system::show_error(&error.to_string());
            ExitCode::FAILURE
        }
    }
}

/// Prints help, a version or what is wrong with the arguments.
fn say(answer: &clap::Error) -> ExitCode {
    match answer.print() {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            let error = terminal::not_printed(&error);
            terminal::tell(format_args!("lightgrid: {error}"));
            ExitCode::FAILURE
        }
        _ => ExitCode::from(u8::try_from(answer.exit_code()).unwrap_or(1)),
    }
}

fn run(arguments: Arguments) -> Result<()> {
    let Some(command) = arguments.command else {
        return run(Arguments::parse_from(["lightgrid", "view"]));
    };
    if !matches!(command, Command::View(_)) {
        memory::refusal_ends();
    }
    match &command {
        Command::View(arguments) => view::run(arguments),
        Command::Screenshot(arguments) => screenshot::run(arguments),
        Command::Render(arguments) => render::run(arguments),
        Command::Merge(arguments) => merge::run(arguments),
        Command::Compare(arguments) => compare::run(arguments),
        Command::Info(arguments) => info::run(arguments),
        Command::Devices(arguments) => device::run(arguments),
        Command::Bench(arguments) => bench::run(arguments),
        Command::Report(arguments) => report::run(arguments),
        Command::Sat(arguments) => sat::run(arguments),
        Command::Stability(arguments) => stability::run(arguments),
        Command::Completions(arguments) => generate::completions(arguments, Arguments::command()),
        Command::Man(arguments) => generate::man(arguments, Arguments::command()),
    }
}

/// Whether these words after the program's name are a command line that would be run.
pub fn accepts(words: &[String]) -> bool {
    let program = "lightgrid".to_owned();
    Arguments::try_parse_from(std::iter::once(&program).chain(words)).is_ok()
}
