//! `lightgrid compare`.

use std::path::PathBuf;

use crate::error::{Error, Result};
use crate::image::{is_linear, read_picture};
use crate::metrics::{Comparison, compare};
use crate::terminal::print;

/// Arguments of `compare`.
#[derive(Debug, clap::Args)]
pub(super) struct CompareArguments {
    /// The picture to judge.
    picture: PathBuf,
    /// The reference it is held against.
    reference: PathBuf,
    /// Print JSON instead of a table.
    #[arg(long)]
    json: bool,
}

/// Prints the errors of a picture against a reference.
pub(super) fn run(arguments: &CompareArguments) -> Result<()> {
    let [is_linear_picture, is_linear_reference] =
        [is_linear(&arguments.picture)?, is_linear(&arguments.reference)?];
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
    let picture = read_picture(&arguments.picture)?;
    let reference = read_picture(&arguments.reference)?;
    let comparison = compare(&picture, &reference).map_err(|e| Error::at(&arguments.picture, e))?;
    if arguments.json {
        return print(crate::output::record::to_json(&comparison)?);
    }
    let Comparison { mean_ratio, mse, rel_mse, trimmed_rel_mse, block_rel_mse, flip, .. } =
        comparison;
    print(format_args!("mean ratio        {mean_ratio:.5}"))?;
    print(format_args!("MSE               {mse:.4e}"))?;
    print(format_args!("relMSE            {rel_mse:.4e}"))?;
    print(format_args!("trimmed relMSE    {trimmed_rel_mse:.4e}"))?;
    print(format_args!("of 8x8 blocks     {block_rel_mse:.4e}"))?;
    match flip {
        Some(flip) => print(format_args!("FLIP              {flip:.4}")),
        None => print("FLIP              not built in (feature `flip`)"),
    }
}
