//! `lightgrid compare`.

use std::path::PathBuf;

use crate::error::{Error, Result};
use crate::image::read_picture;
use crate::metrics::compare;

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
    let picture = read_picture(&arguments.picture)?;
    let reference = read_picture(&arguments.reference)?;
    let comparison = compare(&picture, &reference).map_err(|e| Error::at(&arguments.picture, e))?;
    if arguments.json {
        println!("{}", crate::output::record::to_json(&comparison)?);
    } else {
        println!("mean ratio        {:.5}", comparison.mean_ratio);
        println!("MSE               {:.4e}", comparison.mse);
        println!("relMSE            {:.4e}", comparison.rel_mse);
        println!("trimmed relMSE    {:.4e}", comparison.trimmed_rel_mse);
        println!("FLIP              {:.4}", comparison.flip);
    }
    Ok(())
}
