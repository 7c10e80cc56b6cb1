//! Pictures and videos that processes of their own render for the window, one after the other.

use std::io::{BufRead as _, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{ChildStdin, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Instant;

use super::document::Document;
use super::theme::file_name;
use super::threads::{Wake, lock, spawn};
use crate::error::{At as _, Error, Result};
use crate::system::set_apart;

/// Files to be rendered.
pub(super) struct RenderQueue {
    /// This program.
    program: PathBuf,
    /// In the order in which they were asked for, those that have ended among them.
    pub(super) jobs: Vec<Job>,
    wake: Wake,
}

/// A file to be rendered.
pub(super) struct Job {
    /// The file.
    pub(super) path: PathBuf,
    /// Arguments of the program.
    words: Vec<String>,
    /// How far it is.
    state: Arc<Mutex<State>>,
    /// The process' input, which ends it early when it closes.
    input: Option<ChildStdin>,
    /// What reads its output, as long as it runs.
    thread: Option<JoinHandle<()>>,
    /// Whether it is to end before it is done.
    is_cut_short: bool,
    /// Document that a reference shows; `None` for a file that a person asked for.
    pub(super) reference_of: Option<Box<Document>>,
}

/// How far a job is.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) enum State {
    /// Others come first.
    #[default]
    Waiting,
    /// It is rendered.
    Running {
        /// Since then.
        since: Instant,
        /// Share of the work that is done, `[0,1]`.
        share: f32,
    },
    /// It has ended; why it failed, if it did.
    Ended(std::result::Result<(), String>),
}

impl Job {
    /// How far it is.
    pub(super) fn state(&self) -> State {
        lock(&self.state).clone()
    }

    fn start(&mut self, program: &Path, wake: Wake) -> Result<()> {
        let mut command = Command::new(program);
        command.args(&self.words).arg("--watched");
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
        // What ends the window lets it write what it has.
        set_apart(&mut command);
        let mut child = command.spawn().at(program)?;
        let output = child.stderr.take().ok_or_else(|| Error::at(program, "it says nothing"))?;
        self.input = child.stdin.take();
        let state = Arc::clone(&self.state);
        *lock(&state) = State::Running { since: Instant::now(), share: 0.0 };
        let follow = move || {
            let last = read_progress(output, &state, &wake);
            let ended = match child.wait() {
                Ok(status) if status.success() => Ok(()),
                Ok(_) => Err(last),
                Err(error) => Err(error.to_string()),
            };
            *lock(&state) = State::Ended(ended);
            wake();
        };
        self.thread = Some(spawn("final render", follow)?);
        Ok(())
    }
}

/// Reads what the process says until it ends; its last sentence that is neither a notice nor progress.
fn read_progress(output: impl Read, state: &Mutex<State>, wake: &Wake) -> String {
    let mut last = String::new();
    for line in BufReader::new(output).lines().map_while(std::result::Result::ok) {
        let sentence = line.strip_prefix("lightgrid: ").unwrap_or(&line);
        let percent = sentence.split_once("% ").and_then(|(number, _)| number.parse::<f32>().ok());
        match (percent, &mut *lock(state)) {
            (Some(percent), State::Running { share, .. }) => *share = percent / 100.0,
            _ if !line.starts_with("notice: ") => sentence.clone_into(&mut last),
            _ => {}
        }
        wake();
    }
    last
}

impl RenderQueue {
    /// An empty one; `wake` is called whenever a job is farther.
    pub(super) fn new(program: PathBuf, wake: Wake) -> Self {
        Self { program, jobs: Vec::new(), wake }
    }

    /// Adds a file that the program with these arguments writes; a reference comes with the document that it shows.
    pub(super) fn add(
        &mut self,
        path: PathBuf,
        words: Vec<String>,
        reference_of: Option<Box<Document>>,
    ) {
        let state = Arc::default();
        let (input, thread, is_cut_short) = (None, None, false);
        self.jobs.push(Job { path, words, state, input, thread, is_cut_short, reference_of });
    }

    /// Starts the next job where none runs; what there is to say of one that has ended.
    pub(super) fn advance(&mut self) -> Option<std::result::Result<String, String>> {
        if let Some(job) = self.jobs.iter_mut().find(|job| job.thread.is_some()) {
            let State::Ended(ended) = job.state() else { return None };
            job.thread = None;
            let name = file_name(&job.path.display().to_string());
            return Some(match ended {
                Ok(()) if job.reference_of.is_some() => return None,
                Ok(()) if job.is_cut_short => Ok(format!("{name} was ended early and written")),
                Ok(()) => Ok(format!("{name} is rendered")),
                Err(why) => Err(format!("{name} is not rendered: {why}")),
            });
        }
        let next = self.jobs.iter_mut().find(|job| job.state() == State::Waiting)?;
        let failure = next.start(&self.program, Arc::clone(&self.wake)).err()?.to_string();
        *lock(&next.state) = State::Ended(Err(failure.clone()));
        Some(Err(failure))
    }

    /// Takes a rendered reference from the list: its file, and the document that it shows.
    pub(super) fn take_reference(&mut self) -> Option<(PathBuf, Box<Document>)> {
        let is_there =
            |job: &Job| job.reference_of.is_some() && job.state() == State::Ended(Ok(()));
        let index = self.jobs.iter().position(is_there)?;
        let job = self.jobs.remove(index);
        Some((job.path, job.reference_of?))
    }

    /// Unfinished files that a person asked for.
    pub(super) fn unfinished(&self) -> usize {
        let is_unfinished =
            |job: &&Job| job.reference_of.is_none() && !matches!(job.state(), State::Ended(_));
        self.jobs.iter().filter(is_unfinished).count()
    }

    /// Lets a job that runs end early, and write what it has; takes any other from the list.
    pub(super) fn end(&mut self, index: usize) {
        let Some(job) = self.jobs.get_mut(index) else { return };
        if job.thread.is_none() {
            self.jobs.remove(index);
        } else {
            job.input = None;
            job.is_cut_short = true;
        }
    }

    /// Ends all early, and waits for what they write; a sentence on each file that is not there.
    pub(super) fn finish(&mut self) -> Vec<String> {
        let mut failures = Vec::new();
        for mut job in self.jobs.drain(..) {
            job.input = None;
            // What panics has said so.
            let was_running = job.thread.take().map(JoinHandle::join).is_some();
            let path = job.path.display();
            failures.extend(match job.state() {
                _ if job.reference_of.is_some() => {
                    // The process may have ended before it wrote.
                    let _ = std::fs::remove_file(&job.path);
                    None
                }
                State::Waiting => Some(format!("{path}: not rendered: the window was closed")),
                State::Ended(Err(why)) if was_running => {
                    Some(format!("{path}: not rendered: {why}"))
                }
                _ => None,
            });
        }
        failures
    }
}
