//! `lightgrid sat`.

use crate::environment::landmarks::Sun;
use crate::environment::sat_report;
use crate::error::{Error, Result};
use crate::terminal::{notice, one_line, print};

/// Arguments of `sat`.
#[derive(Debug, clap::Args)]
pub(super) struct SatArguments {
    /// Maps: files or built-in skies; without any, the talk's four cases.
    maps: Vec<String>,
    /// Print JSON instead of tables.
    #[arg(long)]
    json: bool,
}

/// The talk's maps: sizes from its table, contents from our skies.
const TALKS_CASES: [&str; 4] =
    ["sky:hallway@10000x5000", "sky:day@15000x7500", "sky:night@3000x1500", "sky:sunset@3000x1500"];

/// Samples drawn to time a table.
const SAMPLES: u32 = 1 << 20;

/// Prints one table a map.
pub(super) fn run(arguments: &SatArguments) -> Result<()> {
    let maps: Vec<&str> = if arguments.maps.is_empty() {
        TALKS_CASES.to_vec()
    } else {
        arguments.maps.iter().map(String::as_str).collect()
    };
    let mut reports = serde_json::Map::new();
    for name in maps {
        let (map, notices) = crate::sources::map(name)?;
        notices.iter().for_each(|sentence| notice(format_args!("{name}: {sentence}")));
        if Sun::of(&map).is_none() {
            notice(format_args!("{name}: the map is black, so there is nothing to be sampled"));
        }
        let report = sat_report(&map, SAMPLES).map_err(|e| Error::at(name, e))?;
        if arguments.json {
            reports.insert(name.to_owned(), crate::output::record::to_value(&report)?);
        } else {
            let title = one_line(&format!("{name}, {}x{}", map.width, map.height));
            print(format_args!("{title}\n{report}"))?;
        }
    }
    if arguments.json {
        print(crate::output::record::to_json(&reports)?)?;
    }
    Ok(())
}
