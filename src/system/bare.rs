//! Stubs for targets without an operating system, such as `wasm32-unknown-unknown`: the library compiles for them.

use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

#[path = "unix/others.rs"]
mod others;

pub(crate) use others::*;

/// There are no terminals.
pub(crate) fn hang_up() -> Option<i32> {
    None
}

/// There are no signals.
pub(crate) fn on_request_to_end(_: impl FnMut(i32) + Send + 'static) -> io::Result<()> {
    Ok(())
}

/// Ends the process.
pub(crate) fn exit_now(code: i32) -> ! {
    std::process::exit(code)
}

/// There is no stderr.
pub(crate) fn write_stderr(_: &[u8]) {}

/// Left to the allocator.
pub(crate) fn can_commit(_: usize) -> bool {
    true
}

/// Not known.
pub(crate) fn max_stack() -> usize {
    0
}

/// Left to the system.
pub(crate) fn on_abort(_: fn() -> bool) {}

/// Not known.
pub(crate) fn thread_cpu_time() -> Option<Duration> {
    None
}

/// A file's path.
#[derive(PartialEq)]
pub(crate) struct FileName(PathBuf);

impl FileName {
    /// # Errors
    /// Never.
    pub(crate) fn new(path: &Path) -> io::Result<Self> {
        Ok(Self(path.to_owned()))
    }

    /// Removes the file, if it is there.
    pub(crate) fn remove(&self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

/// There are no terminals.
pub(crate) fn set_apart(_: &mut Command) {}

/// There are no consoles.
pub(crate) fn leave_own_console() -> bool {
    false
}

/// There is no stderr.
pub(crate) fn show_error(_: &str) {}
