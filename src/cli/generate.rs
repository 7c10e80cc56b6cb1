//! `lightgrid completions` and `lightgrid man`: what shells and `man` know about the commands.

use std::path::PathBuf;

use clap::Command;
use clap_complete::Shell;
use clap_mangen::Man;

use super::picture::say_written;
use crate::error::{Error, Result};
use crate::image::write_beside_and_rename;
use crate::terminal::print;

/// Arguments of `completions`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example:
  lightgrid completions bash > ~/.local/share/bash-completion/completions/lightgrid")]
pub(super) struct CompletionsArguments {
    /// The shell.
    shell: Shell,
}

/// Arguments of `man`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Example:
  lightgrid man ~/.local/share/man/man1")]
pub(super) struct ManArguments {
    /// An existing folder.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

/// Prints what completes the commands of `program` in a shell.
pub(super) fn completions(arguments: &CompletionsArguments, mut program: Command) -> Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut program, "lightgrid", &mut script);
    print(String::from_utf8_lossy(&script).trim_end())
}

/// Writes a manual page for each command of `program`.
pub(super) fn man(arguments: &ManArguments, program: Command) -> Result<()> {
    let ManArguments { folder } = arguments;
    if !folder.is_dir() {
        return Err(Error::at(folder, "is no folder that exists"));
    }
    let mut program = program.disable_help_subcommand(true);
    program.build();
    let write = |command: &Command| {
        let page = Man::new(command.clone());
        let path = folder.join(page.get_filename());
        write_beside_and_rename(&path, |file| page.render(file)).map(|()| say_written(&path)).err()
    };
    Error::all(with_subcommands(&program).into_iter().filter_map(write).collect())
}

/// A command and those beneath it that are shown.
fn with_subcommands(command: &Command) -> Vec<&Command> {
    let shown = command.get_subcommands().filter(|command| !command.is_hide_set());
    std::iter::once(command).chain(shown.flat_map(with_subcommands)).collect()
}
