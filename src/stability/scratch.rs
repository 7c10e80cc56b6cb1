//! A folder of its own for a case that writes files, and the binary run in it.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use super::Setting;
use crate::error::{Error, Result};

/// A folder that is gone when this value is.
pub(super) struct Scratch {
    folder: PathBuf,
}

/// What a process left behind.
pub(super) struct Finished {
    /// Exit code; `None` if a signal ended it.
    pub(super) code: Option<i32>,
    /// What it said on stderr.
    pub(super) says: String,
}

impl Finished {
    /// Whether it refused in a sentence, without panic or signal.
    pub(super) fn refused(&self) -> bool {
        let sentences = self.says.lines().filter(|line| line.starts_with("lightgrid: ")).count();
        self.code == Some(1) && sentences == 1 && !self.says.contains("panicked")
    }
}

static NUMBER: AtomicU32 = AtomicU32::new(0);

impl Scratch {
    pub(super) fn new() -> Result<Self> {
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let name = format!("lightgrid-stability-{}-{number}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&folder).map_err(|e| Error::at(&folder, e))?;
        Ok(Self { folder })
    }

    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    pub(super) fn write(&self, name: &str, bytes: &[u8]) -> Result<PathBuf> {
        let path = self.path(name);
        std::fs::write(&path, bytes).map_err(|e| Error::at(&path, e))?;
        Ok(path)
    }

    pub(super) fn read(&self, name: &str) -> Result<Vec<u8>> {
        let path = self.path(name);
        std::fs::read(&path).map_err(|e| Error::at(&path, e))
    }

    /// Names of the files here, sorted.
    pub(super) fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(&self.folder).into_iter().flatten().flatten();
        let mut names: Vec<String> =
            entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// The binary with the words of `line`, in this folder.
    pub(super) fn lightgrid(&self, setting: &Setting, line: &str) -> Command {
        let mut command = Command::new(&setting.binary);
        command.current_dir(&self.folder).args(line.split_whitespace());
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        command
    }

    /// The binary under limits that a shell sets, such as `ulimit -v 1000000`.
    #[cfg(unix)]
    pub(super) fn limited(&self, setting: &Setting, limits: &str, line: &str) -> Command {
        let mut command = Command::new("/bin/sh");
        command.current_dir(&self.folder).arg("-c").arg(format!("{limits}; exec \"$0\" \"$@\""));
        command.arg(&setting.binary).args(line.split_whitespace());
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        command
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

/// Runs a command to its end, but ends it after `seconds`.
///
/// # Errors
/// If it cannot be started, or had to be ended.
pub(super) fn finish(command: &mut Command, seconds: u64) -> Result<Finished> {
    let failed = |e: std::io::Error| Error::new(format!("a process of lightgrid: {e}"));
    let mut child = command.spawn().map_err(failed)?;
    let start = Instant::now();
    while child.try_wait().map_err(failed)?.is_none() {
        if start.elapsed() > Duration::from_secs(seconds) {
            let _ = child.kill();
            let _ = child.wait();
            return Err(Error::new(format!("a process of lightgrid was not done in {seconds} s")));
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    // What it says fits a pipe's buffer: a few sentences.
    let output = child.wait_with_output().map_err(failed)?;
    let says = String::from_utf8_lossy(&output.stderr).into_owned();
    Ok(Finished { code: output.status.code(), says })
}
