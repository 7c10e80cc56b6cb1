//! `lightgrid sat`.

use crate::environment::sun::Sun;
use crate::environment::{TALKS_MAPS, TIMED_SAMPLES, sat_report};
use crate::error::{At as _, Result};
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

/// Prints one table a map.
pub(super) fn run(arguments: &SatArguments) -> Result<()> {
    super::render::start_threads(0)?;
    let talks = TALKS_MAPS.map(|(title, (width, height), _)| {
        format!("sky:{}@{width}x{height}", title.to_lowercase())
    });
    let maps = if arguments.maps.is_empty() { &talks[..] } else { &arguments.maps[..] };
    let mut reports = serde_json::Map::new();
    for name in maps {
        let (map, notices) = crate::sources::map(name)?;
        notices.iter().for_each(|sentence| notice(format_args!("{name}: {sentence}")));
        if Sun::of(&map).is_none() {
            notice(format_args!("{name}: the map is black, so there is nothing to be sampled"));
        }
        let report = sat_report(&map, TIMED_SAMPLES).at(name)?;
        if arguments.json {
            reports.insert(name.to_owned(), crate::output::record::to_value(&report)?);
        } else {
            let title = one_line(&format!("{name}, {}x{}", map.width, map.height));
            print(format_args!("{title}\n{report}"))?;
        }
    }
    if arguments.json { print(crate::output::record::to_json(&reports)?) } else { Ok(()) }
}
