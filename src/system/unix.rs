//! Unix systems.

use std::ffi::CString;
use std::io;
use std::os::unix::ffi::OsStrExt as _;
use std::os::unix::process::CommandExt as _;
use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;
use std::time::Duration;

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

#[cfg(target_os = "linux")]
mod linux;
#[cfg(target_os = "macos")]
mod macos;
#[cfg(not(any(target_os = "linux", target_os = "macos")))]
mod others;

#[cfg(target_os = "linux")]
pub(crate) use linux::*;
#[cfg(target_os = "macos")]
pub(crate) use macos::*;
#[cfg(not(any(target_os = "linux", target_os = "macos")))]
pub(crate) use others::*;

/// The signal of a terminal that is closed, unless it is ignored already: then somebody wants the process to
/// outlive its terminal, as `nohup` does.
pub(crate) fn hang_up() -> Option<i32> {
    // SAFETY: all zero is such a structure, and the call writes no more than that.
    let ignored = unsafe {
        let mut action: libc::sigaction = std::mem::zeroed();
        libc::sigaction(libc::SIGHUP, std::ptr::null(), &raw mut action) == 0
            && action.sa_sigaction == libc::SIG_IGN
    };
    (!ignored).then_some(libc::SIGHUP)
}

/// Answers requests to end from now on, by the number of the signal, in a thread of their own: Ctrl-C, the system's,
/// a closed terminal.
///
/// # Errors
/// If signals cannot be caught, or there is no thread.
pub(crate) fn on_request_to_end(answer: impl FnMut(i32) + Send + 'static) -> io::Result<()> {
    let mut signals = Signals::new([SIGINT, SIGTERM].into_iter().chain(hang_up()))?;
    let wait = move || signals.forever().for_each(answer);
    std::thread::Builder::new().name("signals".to_owned()).spawn(wait).map(drop)
}

/// Ends the process without running anything else of it. Takes no memory.
pub(crate) fn exit_now(code: i32) -> ! {
    // SAFETY: it may be called at any time.
    unsafe { libc::_exit(code) }
}

/// Writes to stderr without a lock and without memory.
pub(crate) fn write_stderr(text: &[u8]) {
    // SAFETY: the bytes are there. Nobody can be told if they cannot be written.
    unsafe { libc::write(libc::STDERR_FILENO, text.as_ptr().cast(), text.len()) };
}

/// Whether the system would back `bytes` more of memory now.
pub(crate) fn can_commit(bytes: usize) -> bool {
    let flags = libc::MAP_PRIVATE | libc::MAP_ANONYMOUS;
    let rights = libc::PROT_READ | libc::PROT_WRITE;
    // SAFETY: nothing else is there, and it is given back at once.
    unsafe {
        let memory = libc::mmap(std::ptr::null_mut(), bytes, rights, flags, -1, 0);
        memory != libc::MAP_FAILED && libc::munmap(memory, bytes) == 0
    }
}

/// Most bytes of the main thread's stack.
pub(crate) fn max_stack() -> usize {
    let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
    // SAFETY: the limit is written there.
    unsafe { libc::getrlimit(libc::RLIMIT_STACK, &raw mut limit) };
    usize::try_from(limit.rlim_cur).unwrap_or(usize::MAX)
}

/// What is asked at an abort.
static AT_ABORT: OnceLock<fn() -> bool> = OnceLock::new();

/// Has an abort end the process as an error where `is_error` says so. It may take no memory and no lock.
pub(crate) fn on_abort(is_error: fn() -> bool) {
    extern "C" fn handle(signal: libc::c_int) {
        if AT_ABORT.get().is_some_and(|is_error| is_error()) {
            exit_now(1);
        }
        // SAFETY: these may be called from a handler. The signal comes again when it returns.
        unsafe {
            libc::signal(signal, libc::SIG_DFL);
            libc::raise(signal);
        }
    }
    if AT_ABORT.set(is_error).is_ok() {
        let handler = handle as extern "C" fn(libc::c_int);
        // SAFETY: the handler calls nothing that may not be called from one.
        unsafe { libc::signal(libc::SIGABRT, handler as libc::sighandler_t) };
    }
}

/// CPU time of this thread, where the system says.
pub(crate) fn thread_cpu_time() -> Option<Duration> {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: plain system call, which writes into what it is given.
    let outcome = unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut time) };
    let seconds = u64::try_from(time.tv_sec).ok().filter(|_| outcome == 0)?;
    Some(Duration::new(seconds, u32::try_from(time.tv_nsec).ok()?))
}

/// A file's path as the system takes it.
#[derive(PartialEq)]
pub(crate) struct FileName(CString);

impl FileName {
    /// # Errors
    /// If no file can be called so.
    pub(crate) fn new(path: &Path) -> io::Result<Self> {
        Ok(Self(CString::new(path.as_os_str().as_bytes())?))
    }

    /// Removes the file, if it is there. Takes no memory.
    pub(crate) fn remove(&self) {
        // SAFETY: it is a name. Nothing is left to do if it cannot be removed.
        unsafe { libc::unlink(self.0.as_ptr()) };
    }
}

/// Keeps Ctrl-C in this process' terminal from a process to be started.
pub(crate) fn set_apart(command: &mut Command) {
    command.process_group(0);
}

/// No console is opened for a program here.
pub(crate) fn leave_own_console() -> bool {
    false
}

/// There is always stderr.
pub(crate) fn show_error(_: &str) {}
