//! `lightgrid merge`.

use std::path::{Path, PathBuf};

use super::picture::{PictureArguments, say_written};
use super::progress::Progress;
use crate::error::{Error, Result};
use crate::image::{check_writable, is_same_file};
use crate::output::Films;
use crate::output::film_file::{FilmFacts, read_facts, read_film};
use crate::render::film::Film;
use crate::terminal::notice;

/// Arguments of `merge`.
#[derive(Debug, clap::Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
A checkpoint of `lightgrid render` is a part, too: with --allow-missing, a picture of how far that is.

Examples:
  lightgrid merge office.*.part -o office.exr -o office.png
  lightgrid merge office.checkpoint --allow-missing -o so-far.png"
)]
pub(super) struct MergeArguments {
    /// What `lightgrid render --part` wrote, in any order.
    #[arg(required = true, value_name = "PART")]
    parts: Vec<PathBuf>,
    /// The picture to write: .png or .exr; may be given twice.
    #[arg(short, long = "output", required = true, value_name = "FILE")]
    outputs: Vec<PathBuf>,
    /// Makes a picture of what is there, though parts or some of their samples are missing.
    #[arg(long)]
    allow_missing: bool,
    #[command(flatten)]
    picture: PictureArguments,
}

/// Reads, adds up, writes.
pub(super) fn run(arguments: &MergeArguments) -> Result<()> {
    super::render::start_threads(0)?;
    let MergeArguments { parts, outputs, picture, .. } = arguments;
    picture.check(outputs)?;
    for (i, output) in outputs.iter().enumerate() {
        if outputs[..i].iter().chain(parts).any(|other| is_same_file(other, output)) {
            return Err(Error::at(output, "would be written over a part or another output"));
        }
        check_writable(output)?;
    }
    picture.say_unused(outputs);
    let progress = Progress::start("looking at the parts");
    let parts = belonging_together(parts)?;
    let mut missing = missing_parts(&parts);
    let mut joined: Option<Film> = None;
    for (path, facts) in &parts {
        progress.say(format!("adding part {}", facts.part));
        let (_, film) = read_film(path)?;
        if picture.asks_for_surfaces(outputs) && !film.has_layers() {
            let advice = "render with --layers albedo,normal,depth";
            return Err(Error::at(path, format!("has no albedo, normal and depth: {advice}")));
        }
        missing.extend(missing_samples(facts, &film));
        match &mut joined {
            None => joined = Some(film),
            Some(joined) if joined.is_alike(&film) => joined.add_film(&film),
            Some(_) => return Err(Error::at(path, "has another size than the other parts")),
        }
    }
    progress.finish();
    let missing = missing.join("; ");
    if !missing.is_empty() && !arguments.allow_missing {
        let advice = "--allow-missing makes a picture of the rest";
        return Err(Error::new(format!("the picture is not whole: {missing} ({advice})")));
    }
    if !missing.is_empty() {
        notice(format_args!("the picture is not whole: {missing}"));
    }
    let Some(film) = joined else { return Err(Error::new("there is no part to be merged")) };
    let metadata = metadata(&parts, &film);
    let films = Films::from(&film);
    let denoised = picture.denoised(outputs, films);
    let films = Films { denoised: denoised.as_ref(), ..films };
    let write =
        |path: &PathBuf| picture.write(path, films, &metadata).map(|()| say_written(path)).err();
    Error::all(outputs.iter().filter_map(write).collect())
}

/// What the parts say about themselves, in the order of their numbers: sums in f64 depend on the order
/// in the last bit, and names shall not matter.
fn belonging_together(paths: &[PathBuf]) -> Result<Vec<(&Path, FilmFacts)>> {
    let mut parts: Vec<(&Path, FilmFacts)> = Vec::with_capacity(paths.len());
    for path in paths {
        let facts = read_facts(path)?;
        if let Some((first, of_first)) = parts.first() {
            let first = first.display();
            if let Some(difference) = facts.difference(&of_first.picture) {
                let cause = format!("does not belong to {first}: another {difference}");
                return Err(Error::at(path, cause));
            }
            if (facts.part.count, facts.samples) != (of_first.part.count, of_first.samples) {
                let [this, others] = [facts.share(), of_first.share()];
                return Err(Error::at(path, format!("is {this}, but {first} is {others}")));
            }
        }
        if let Some((other, _)) = parts.iter().find(|(_, other)| other.part == facts.part) {
            let cause = format!("is part {}, and so is {}", facts.part, other.display());
            return Err(Error::at(path, cause));
        }
        parts.push((path, facts));
    }
    parts.sort_by_key(|(_, facts)| facts.part.number);
    Ok(parts)
}

/// Which parts are not there, in words; empty if all are.
fn missing_parts(parts: &[(&Path, FilmFacts)]) -> Vec<String> {
    let count = parts.first().map_or(0, |(_, facts)| facts.part.count);
    let is_there = |number: &u32| parts.iter().any(|(_, facts)| facts.part.number == *number);
    let mut missing = (1..=count).filter(|number| !is_there(number));
    let shown: Vec<String> =
        missing.by_ref().take(MAX_NAMED).map(|number| number.to_string()).collect();
    let more = missing.count();
    match &shown[..] {
        [] => Vec::new(),
        [one] => vec![format!("part {one} of {count} is missing")],
        many if more > 0 => {
            vec![format!("parts {} and {more} more of {count} are missing", many.join(", "))]
        }
        many => vec![format!("parts {} of {count} are missing", many.join(", "))],
    }
}

/// Numbers of missing parts that are said.
const MAX_NAMED: usize = 20;

/// What a part that was ended early has too few of, in words.
fn missing_samples(facts: &FilmFacts, film: &Film) -> Option<String> {
    let wanted = facts.part.range(facts.samples?).len();
    let there = film.min_samples();
    ((there as usize) < wanted)
        .then(|| format!("part {} has {there} of its {wanted} samples", facts.part))
}

/// What the picture says about itself: as its first part, with the samples and seconds of all.
fn metadata(parts: &[(&Path, FilmFacts)], film: &Film) -> Vec<(String, String)> {
    let mut pairs = parts.first().map_or_else(Vec::new, |(_, facts)| facts.metadata.clone());
    let seconds: f64 = parts.iter().map(|(_, facts)| facts.figures.elapsed_seconds()).sum();
    for (key, value) in &mut pairs {
        match key.as_str() {
            "lightgrid.samples_per_pixel" => *value = film.min_samples().to_string(),
            "lightgrid.seconds" => *value = format!("{seconds:.3}"),
            _ => {}
        }
    }
    pairs
}
