//! What a person types, and what they read back.

use std::process::ExitCode;

use clap::{Parser, Subcommand};

mod compare;
mod info;
mod interrupt;
mod progress;
mod render;
mod sat;
mod values;

/// A progressive path tracer for scenes lit by an HDR environment map. It learns which tiles of the
/// map each part of the picture can see, and samples only those.
#[derive(Debug, Parser)]
#[command(name = "lightgrid", version, arg_required_else_help = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Render a scene into a picture.
    Render(Box<render::RenderArguments>),
    /// Measure how far a picture is from a reference.
    Compare(compare::CompareArguments),
    /// Say what is in a scene or a map, and what the renderer leaves out.
    Info(info::InfoArguments),
    /// Compare the importance tables' accuracy on maps (the talk's summed-area-table claim).
    Sat(sat::SatArguments),
}

/// Runs the command line; errors become one sentence on stderr and a non-zero exit.
pub fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let result = match &arguments.command {
        Command::Render(arguments) => render::run(arguments),
        Command::Compare(arguments) => compare::run(arguments),
        Command::Info(arguments) => info::run(arguments),
        Command::Sat(arguments) => sat::run(arguments),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("lightgrid: {error}");
            ExitCode::FAILURE
        }
    }
}
