//! Spoilt input: no panic, no hang, no memory that the file's size does not warrant.
//!
//! A seeded mutator spoils files made by our own code ([`corpus`]); a worker process reads them one
//! after another and says where it is, so that whatever kills it or holds it up is known by its
//! number, and `lightgrid stability --fuzz KIND --first NUMBER --count 1` repeats it.

mod bombs;
mod corpus;
mod mutate;
mod worker;

use std::io::{BufRead, BufReader, Read as _};
use std::process::{Command, Stdio};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use serde::{Deserialize, Serialize};

pub use self::worker::work;
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
    case("bombs", |s| claims(s)),
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
    let outcome = judged(setting, kind, count)?;
    Ok(match outcome {
        Ok((tally, outcome)) => outcome
            // Both outcomes are met often, or the case would show little.
            .at_least("share accepted", tally.accepted as f64 / count as f64, 0.02)
            .at_least("share refused", tally.refused as f64 / count as f64, 0.02),
        Err(broken) => broken,
    })
}

fn claims(setting: &Setting) -> Result<Outcome> {
    let count = bombs::all().len() as u64;
    Ok(match judged(setting, Kind::Bombs, count)? {
        Ok((tally, outcome)) => {
            outcome.at_least("false claims refused", tally.refused as f64, count as f64)
        }
        Err(broken) => broken,
    })
}

/// What a worker says of inputs `0..count`, and the figures all kinds share.
fn judged(
    setting: &Setting,
    kind: Kind,
    count: u64,
) -> Result<std::result::Result<(Tally, Outcome), Outcome>> {
    let tally = match run(setting, kind, count)? {
        Ok(tally) => tally,
        Err(end) => {
            let name = kind.name();
            return Ok(Err(Outcome::new()
                .at_most("inputs that end or stop the process", 1.0, 0.0)
                .remark(format!(
                    "{end}; repeat: lightgrid stability --fuzz {name} --first N --count 1"
                ))));
        }
    };
    let excess = (tally.worst_excess_bytes.max(0)) as f64;
    let outcome = Outcome::new()
        .at_most(format!("panics and hangs in {count} inputs"), 0.0, 0.0)
        .at_most("bytes beyond 4x the honest size", excess, ALLOWANCE_BYTES)
        .at_most("refusals that are not one line", tally.unclear as f64, 0.0)
        .at_most("accepted, but out of bounds", tally.unsound as f64, 0.0)
        .remark(format!("input {} took most", tally.worst));
    Ok(Ok((tally, outcome)))
}

/// Runs a worker over inputs `0..count`; the inner error says at which input it ended.
fn run(setting: &Setting, kind: Kind, count: u64) -> Result<std::result::Result<Tally, String>> {
    let failed = |e: std::io::Error| Error::new(format!("the fuzzing process: {e}"));
    let mut child = guarded(setting)
        .args(["stability", "--fuzz", kind.name(), "--first", "0", "--count", &count.to_string()])
        // One thread and one arena: what memory grows by is then the input's doing.
        .env("RAYON_NUM_THREADS", "1")
        .env("MALLOC_ARENA_MAX", "1")
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(failed)?;
    let (sender, receiver) = channel();
    let lines = child.stdout.take().map(BufReader::new);
    let reader = std::thread::spawn(move || {
        for line in lines.into_iter().flat_map(BufRead::lines).map_while(std::result::Result::ok) {
            if sender.send(line).is_err() {
                break;
            }
        }
    });
    let errors = child.stderr.take();
    let complaints = std::thread::spawn(move || {
        let mut text = String::new();
        errors.map(|mut pipe| pipe.read_to_string(&mut text));
        text
    });
    let mut at = "before the first input".to_owned();
    let mut tally = None;
    let mut hung = false;
    loop {
        match receiver.recv_timeout(PATIENCE) {
            Ok(line) if line.starts_with('{') => tally = serde_json::from_str(&line).ok(),
            Ok(line) => at = format!("at input {line}"),
            Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => {
                hung = true;
                let _ = child.kill();
                break;
            }
        }
    }
    let status = child.wait().map_err(failed)?;
    let (_, said) = (reader.join(), complaints.join().unwrap_or_default());
    if hung {
        return Ok(Err(format!("no progress for 10 s {at}")));
    }
    match tally {
        Some(tally) if status.success() => Ok(Ok(tally)),
        _ => {
            let said = said.lines().take(3).collect::<Vec<_>>().join(" ");
            Ok(Err(format!("{status} {at}: {said}")))
        }
    }
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
