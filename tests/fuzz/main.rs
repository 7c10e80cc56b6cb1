//! Spoilt input: no panic, no hang, no memory that the file's size does not warrant.
//!
//! A seeded mutator spoils files made by our own code (`corpus`); a process of its own reads them one
//! after another and says where it is (`worker`), so that whatever kills it or holds it up is known by its
//! number. A failure says the command that repeats it:
//! `LIGHTGRID_FUZZ=KIND:NUMBER cargo test --release --test fuzz -- --ignored --nocapture`.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "who runs this reads it")]

mod bombs;
mod corpus;
#[path = "../guided/src/kept.rs"]
mod kept;
mod lists;
mod mutate;
mod read;
#[cfg(feature = "window")]
mod settings;
#[path = "../suite/shared.rs"]
#[allow(dead_code, reason = "the suite uses the rest")]
mod shared;
#[path = "../guided/src/targets.rs"]
mod targets;
mod worker;

use std::io::{BufRead, BufReader};
use std::ops::Range;
use std::process::{Command, Stdio};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use serde::{Deserialize, Serialize};

use shared::count;

/// Names the kind, the first number and, if it is not 1, the number of inputs that a worker reads.
const TASK: &str = "LIGHTGRID_FUZZ";

/// Memory an input may take beside four times its honest size: decoders' tables, a thread's stack,
/// what the allocator keeps.
const ALLOWANCE_BYTES: u64 = 64 << 20;

/// How long an input may take.
const PATIENCE: Duration = Duration::from_secs(40);

/// What is spoilt.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// `.gltf` and `.glb`, loaded and rendered.
    Gltf,
    /// `.hdr`, `.exr` and `.png`, read as maps.
    Maps,
    /// `.ktx2` and `.png`, read as textures.
    Textures,
    /// Words after the program's name.
    CommandLines,
    /// The window's settings.
    #[cfg(feature = "window")]
    Settings,
    /// Files that claim far more than they hold; not spoilt.
    Bombs,
    /// Sound files of many small objects; not spoilt.
    Lists,
    /// What a fuzzer guided by coverage (`tests/guided`) has kept.
    Kept,
}

impl Kind {
    const ALL: &[Self] = &[
        Self::Gltf,
        Self::Maps,
        Self::Textures,
        Self::CommandLines,
        #[cfg(feature = "window")]
        Self::Settings,
        Self::Bombs,
        Self::Lists,
        Self::Kept,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::Gltf => "gltf",
            Self::Maps => "maps",
            Self::Textures => "textures",
            Self::CommandLines => "command-lines",
            #[cfg(feature = "window")]
            Self::Settings => "settings",
            Self::Bombs => "bombs",
            Self::Lists => "lists",
            Self::Kept => "kept",
        }
    }
}

/// What a worker found.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
struct Tally {
    /// Inputs that were understood.
    accepted: u64,
    /// Inputs that were refused with a sentence.
    refused: u64,
    /// Of the refusals, those whose sentence is not one line.
    unclear: u64,
    /// Most bytes that an input took, less four times its honest size: what it delivers, or its own
    /// length if that is more.
    worst_excess_bytes: i64,
    /// The number of that input.
    worst: u64,
    /// Accepted inputs whose values are out of bounds or not finite.
    unsound: u64,
}

#[test]
fn gltf() {
    spoilt(Kind::Gltf, count(3000, 300_000));
}

#[test]
fn maps() {
    spoilt(Kind::Maps, count(4000, 400_000));
}

#[test]
fn textures() {
    spoilt(Kind::Textures, count(4000, 400_000));
}

#[test]
fn command_lines() {
    spoilt(Kind::CommandLines, count(5000, 500_000));
}

#[cfg(feature = "window")]
#[test]
fn settings_files() {
    spoilt(Kind::Settings, count(4000, 400_000));
}

#[test]
fn bombs_are_refused() {
    let count = bombs::all().len() as u64;
    assert_eq!(judged(Kind::Bombs, 0..count).refused, count, "false claims refused");
}

#[test]
fn long_lists_take_no_more_than_their_due() {
    // Each in a process of its own: what one takes would hide what the next does.
    for number in 0..lists::FILES.len() as u64 {
        assert_eq!(judged(Kind::Lists, number..number + 1).accepted, 1, "a sound file");
    }
}

#[test]
fn what_was_kept_is_read_or_refused() {
    let kept = kept::all();
    for (target, _) in kept::FILES {
        assert!(kept.iter().any(|(of, _)| *of == target), "nothing is kept of {target}");
    }
    let tally = judged(Kind::Kept, 0..kept.len() as u64);
    assert!(tally.accepted > 0, "{tally:?}");
}

/// The process that reads: [`read_by_worker`] starts it, or a person who wants an input again.
#[test]
#[ignore = "reads what LIGHTGRID_FUZZ=KIND:FIRST[:COUNT] names"]
fn worker_process() {
    let Ok(task) = std::env::var(TASK) else { return };
    let mut parts = task.split(':');
    let name = parts.next().unwrap_or_default();
    let kind = Kind::ALL.iter().find(|kind| kind.name() == name).expect("a kind of this name");
    let mut number =
        |usual: u64| parts.next().map_or(usual, |part| part.parse().expect("a number"));
    let (first, count) = (number(0), number(1));
    worker::work(*kind, first, count);
}

fn spoilt(kind: Kind, count: u64) {
    let tally = judged(kind, 0..count);
    // Both outcomes are met often, or the test would show little.
    for (what, found) in [("accepted", tally.accepted), ("refused", tally.refused)] {
        let share = found as f64 / count as f64;
        assert!(share >= 0.05, "share {what}: {share}");
    }
}

/// What a worker says of some inputs, after the checks that all kinds share.
fn judged(kind: Kind, inputs: Range<u64>) -> Tally {
    let count = inputs.end - inputs.start;
    let (tally, said) = read_by_worker(kind, inputs);
    eprintln!("{}: {tally:?}", kind.name());
    assert_eq!(tally.accepted + tally.refused, count, "panics and hangs: {said}");
    assert!(
        tally.worst_excess_bytes <= ALLOWANCE_BYTES as i64,
        "input {} took {} bytes beyond 4x its honest size{}: {said}",
        tally.worst,
        tally.worst_excess_bytes,
        again(kind, tally.worst)
    );
    assert_eq!(tally.unclear, 0, "refusals that are not one line: {said}");
    assert_eq!(tally.unsound, 0, "accepted, but out of bounds: {said}");
    tally
}

/// How a person reads an input again.
fn again(kind: Kind, number: u64) -> String {
    let release = if cfg!(debug_assertions) { "" } else { " --release" };
    let name = kind.name();
    format!(
        " (again: {TASK}={name}:{number} cargo test{release} --test fuzz -- --ignored --nocapture)"
    )
}

/// Runs a worker over some inputs; what it found, and what it said on stderr. It fails with the
/// number of an input that ends or stops the process.
fn read_by_worker(kind: Kind, inputs: Range<u64>) -> (Tally, String) {
    let folder = tempfile::tempdir().expect("a folder");
    // A panic's words may be more than a pipe holds.
    let complaints = folder.path().join("stderr");
    let mut child = guarded()
        .args(["worker_process", "--exact", "--ignored", "--nocapture"])
        .env(TASK, format!("{}:{}:{}", kind.name(), inputs.start, inputs.end - inputs.start))
        // One thread and one arena: what memory grows by is then the input's doing.
        .env("RAYON_NUM_THREADS", "1")
        .env("MALLOC_ARENA_MAX", "1")
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(std::fs::File::create(&complaints).expect("a file"))
        .spawn()
        .expect("a worker");
    let (sender, receiver) = channel();
    let lines = child.stdout.take().map(BufReader::new);
    let reader = std::thread::Builder::new().name("fuzzing".to_owned()).spawn(move || {
        let lines = lines.into_iter().flat_map(BufRead::lines);
        // Whoever listens no longer has an end to report.
        lines.map_while(Result::ok).all(|line| sender.send(line).is_ok())
    });
    let reader = reader.expect("a thread");
    let (mut at, mut tally) = (None, None);
    let end = loop {
        match receiver.recv_timeout(PATIENCE) {
            Ok(line) if line.starts_with('{') => tally = serde_json::from_str(&line).ok(),
            // The rest is the harness's.
            Ok(line) => at = line.parse().ok().or(at),
            Err(end) => break end,
        }
    };
    if end == RecvTimeoutError::Timeout {
        let _ = child.kill();
    }
    let status = child.wait().expect("it ends");
    let _ = reader.join();
    let said = String::from_utf8_lossy(&std::fs::read(&complaints).expect("a file")).into_owned();
    if let (Some(tally), true) = (tally, status.success()) {
        return (tally, said);
    }
    let end = match end {
        RecvTimeoutError::Timeout => format!("no progress for {PATIENCE:?}"),
        RecvTimeoutError::Disconnected => status.to_string(),
    };
    match at {
        Some(number) => panic!("{end} at input {number}{}: {said}", again(kind, number)),
        None => panic!("{end} before the first input: {said}"),
    }
}

/// This program, where a shell can do it with an end to its memory: a runaway must not take the machine
/// with it.
fn guarded() -> Command {
    let program = std::env::current_exe().expect("this program's file");
    if cfg!(unix) {
        let mut command = Command::new("/bin/sh");
        command.args(["-c", "ulimit -v 8000000; exec \"$0\" \"$@\""]).arg(program);
        command
    } else {
        Command::new(program)
    }
}
