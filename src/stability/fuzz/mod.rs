//! Spoilt input: no panic, no hang, no memory that the file's size does not warrant.
//!
//! A seeded mutator spoils files made by our own code (`corpus`); a worker process reads them one
//! after another and says where it is, so that whatever kills it or holds it up is known by its
//! number, and `lightgrid stability --fuzz KIND --first NUMBER --count 1` repeats it.

mod bombs;
mod corpus;
mod mutate;
mod worker;

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use serde::{Deserialize, Serialize};

pub use self::worker::work;
use super::scratch::Scratch;
use super::{Case, On, Outcome, Setting};
use crate::error::{Error, Result};

const fn case(name: &'static str, run: fn(&Setting) -> Result<Outcome>) -> Case {
    Case { group: "fuzz", name, on: On::Cpu, run }
}

pub(super) const CASES: &[Case] = &[
    case("gltf", |s| mutations(s, Kind::Gltf, s.count(3000, 300_000))),
    case("maps", |s| mutations(s, Kind::Maps, s.count(4000, 400_000))),
    case("command-lines", |s| mutations(s, Kind::CommandLines, s.count(5000, 500_000))),
    case("settings", |s| mutations(s, Kind::Settings, s.count(4000, 400_000))),
    case("bombs", claims),
];

/// What is spoilt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Kind {
    /// `.gltf` and `.glb`, loaded and rendered.
    Gltf,
    /// `.hdr`, `.exr` and `.png`, read as maps.
    Maps,
    /// Words after the program's name.
    CommandLines,
    /// The window's settings.
    Settings,
    /// Files that claim far more than they hold; not spoilt.
    Bombs,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Gltf => "gltf",
            Self::Maps => "maps",
            Self::CommandLines => "command-lines",
            Self::Settings => "settings",
            Self::Bombs => "bombs",
        }
    }
}

/// What a worker found.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Tally {
    /// Inputs that were understood.
    pub accepted: u64,
    /// Inputs that were refused with a sentence.
    pub refused: u64,
    /// Of the refusals, those whose sentence is not one line.
    pub unclear: u64,
    /// Most bytes that an input took, less four times its honest size: what it delivers, or its own
    /// length if that is more.
    pub worst_excess_bytes: i64,
    /// The number of that input.
    pub worst: u64,
    /// Accepted inputs whose values are out of bounds or not finite.
    pub unsound: u64,
}

/// Memory an input may take beside four times its honest size: decoders' tables, a thread's stack,
/// what the allocator keeps.
const ALLOWANCE_BYTES: f64 = (64 << 20) as f64;

/// Seconds an input may take.
const PATIENCE: Duration = Duration::from_secs(10);

fn mutations(setting: &Setting, kind: Kind, count: u64) -> Result<Outcome> {
    let (tally, outcome) = judged(setting, kind, count)?;
    // Both outcomes are met often, or the case would show little.
    Ok(outcome.at_least("share accepted", tally.accepted as f64 / count as f64, 0.05).at_least(
        "share refused",
        tally.refused as f64 / count as f64,
        0.05,
    ))
}

fn claims(setting: &Setting) -> Result<Outcome> {
    let count = bombs::all().len() as u64;
    let (tally, outcome) = judged(setting, Kind::Bombs, count)?;
    Ok(outcome.at_least("false claims refused", tally.refused as f64, count as f64))
}

/// What a worker says of inputs `0..count`, and the figures all kinds share.
fn judged(setting: &Setting, kind: Kind, count: u64) -> Result<(Tally, Outcome)> {
    let tally = run(setting, kind, count)?;
    let excess = tally.worst_excess_bytes.max(0) as f64;
    let read = (tally.accepted + tally.refused) as f64;
    let outcome = Outcome::new()
        .at_most(format!("{count} inputs: panics and hangs"), count as f64 - read, 0.0)
        .at_most(
            format!("{count} inputs: bytes beyond 4x the honest size"),
            excess,
            ALLOWANCE_BYTES,
        )
        .at_most("refusals that are not one line", tally.unclear as f64, 0.0)
        .at_most("accepted, but out of bounds", tally.unsound as f64, 0.0)
        .remark(format!("input {} took most", tally.worst));
    Ok((tally, outcome))
}

/// Runs a worker over inputs `0..count`.
///
/// # Errors
/// If an input ends or stops the process, with its number.
fn run(setting: &Setting, kind: Kind, count: u64) -> Result<Tally> {
    let failed = |e: std::io::Error| Error::new(format!("the fuzzing process: {e}"));
    let scratch = Scratch::new()?;
    // A panic's words may be more than a pipe holds.
    let complaints = std::fs::File::create(scratch.path("stderr")).map_err(failed)?;
    let mut child = guarded(setting)
        .args(["stability", "--fuzz", kind.name(), "--first", "0", "--count", &count.to_string()])
        // One thread and one arena: what memory grows by is then the input's doing.
        .env("RAYON_NUM_THREADS", "1")
        .env("MALLOC_ARENA_MAX", "1")
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(complaints)
        .spawn()
        .map_err(failed)?;
    let (sender, receiver) = channel();
    let lines = child.stdout.take().map(BufReader::new);
    let reader = std::thread::Builder::new().name("fuzzing".to_owned()).spawn(move || {
        let lines = lines.into_iter().flat_map(BufRead::lines);
        // Whoever listens no longer has an end to report.
        lines.map_while(std::result::Result::ok).all(|line| sender.send(line).is_ok())
    });
    let reader = reader.map_err(failed)?;
    let mut at = "before the first input".to_owned();
    let mut tally = None;
    let end = loop {
        match receiver.recv_timeout(PATIENCE) {
            Ok(line) if line.starts_with('{') => tally = serde_json::from_str(&line).ok(),
            Ok(line) => at = format!("at input {line}"),
            Err(end) => break end,
        }
    };
    if end == RecvTimeoutError::Timeout {
        let _ = child.kill();
    }
    let status = child.wait().map_err(failed)?;
    let _ = reader.join();
    if let (Some(tally), true) = (tally, status.success()) {
        return Ok(tally);
    }
    let end = match end {
        RecvTimeoutError::Timeout => "no progress for 10 s".to_owned(),
        RecvTimeoutError::Disconnected => status.to_string(),
    };
    let said = String::from_utf8_lossy(&scratch.read("stderr")?).replace('\n', " ");
    Err(Error::new(format!(
        "{end} {at} (repeat: lightgrid stability --fuzz {} --first NUMBER): {said}",
        kind.name()
    )))
}

/// The binary, where a shell can do it with an end to its memory: a runaway must not take the
/// machine with it.
fn guarded(setting: &Setting) -> Command {
    if cfg!(unix) {
        let mut command = Command::new("/bin/sh");
        command.args(["-c", "ulimit -v 8000000; exec \"$0\" \"$@\""]).arg(&setting.binary);
        command
    } else {
        Command::new(&setting.binary)
    }
}
