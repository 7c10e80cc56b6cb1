//! `lightgrid compare`.

use std::path::{Path, PathBuf};

use crate::error::{At as _, Error, Result};
use crate::image::{Image, is_film, read_with_linearity};
use crate::metrics::{Comparison, compare};
use crate::output::film_file::read_film;
use crate::terminal::print;

/// Arguments of `compare`.
#[derive(Debug, clap::Args)]
pub(super) struct CompareArguments {
    /// The picture to judge; a part of one (.part) or a checkpoint will do.
    picture: PathBuf,
    /// The reference it is held against.
    reference: PathBuf,
    /// Print JSON instead of a table.
    #[arg(long)]
    json: bool,
}

/// Prints the errors of a picture against a reference.
pub(super) fn run(arguments: &CompareArguments) -> Result<()> {
    super::render::start_threads(0)?;
    let [(picture, is_linear_picture), (reference, is_linear_reference)] =
        [read(&arguments.picture)?, read(&arguments.reference)?];
    if is_linear_picture != is_linear_reference {
        let (developed, linear) = match is_linear_picture {
            true => (&arguments.reference, &arguments.picture),
            false => (&arguments.picture, &arguments.reference),
        };
        let linear = linear.display();
        let cause =
            format!("is developed for a display and {linear} is linear: that is no comparison");
        return Err(Error::at(developed, cause));
    }
    let comparison = compare(&picture, &reference).at(&arguments.picture)?;
    if arguments.json {
        return print(crate::output::record::to_json(&comparison)?);
    }
    let Comparison { mean_ratio, mse, rel_mse, trimmed_rel_mse, block_rel_mse, flip, .. } =
        comparison;
    print(format_args!("mean ratio        {mean_ratio:.5}"))?;
    print(format_args!("MSE / mean^2      {mse:.4e}"))?;
    print(format_args!("relMSE            {rel_mse:.4e}"))?;
    print(format_args!("trimmed relMSE    {trimmed_rel_mse:.4e}"))?;
    print(format_args!("of 8x8 blocks     {block_rel_mse:.4e}"))?;
    match flip {
        Some(flip) => print(format_args!("FLIP              {flip:.4}")),
        None => print("FLIP              not built in (feature `flip`)"),
    }
}

/// The picture in a file, or that of the film in it, and whether it is radiance, as films are.
fn read(path: &Path) -> Result<(Image, bool)> {
    if is_film(path) { Ok((read_film(path)?.1.image(), true)) } else { read_with_linearity(path) }
}
