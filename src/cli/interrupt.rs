//! Ctrl-C, requests to end and closed terminals: at once while there is nothing to keep, then once to finish early and
//! keep what is done, twice to leave at once. A closed terminal is no hurry: its shell may say so again.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use crate::image::remove_unfinished;
use crate::system::{hang_up, on_request_to_end};
use crate::terminal::{leave_line, notice, tell};

/// What signals set.
#[derive(Clone, Default)]
pub(super) struct Interrupt {
    /// Becomes true when the work is to end early. Others may set it, too.
    pub(super) asked: Arc<AtomicBool>,
    /// Whether it was a signal that asked.
    signalled: Arc<AtomicBool>,
    has_work: Arc<AtomicBool>,
    /// Where frames are that are to become a video.
    frames: Arc<Mutex<Option<PathBuf>>>,
    /// What will be done when there is something to keep.
    what: &'static str,
}

impl Interrupt {
    /// Watches from now on. `what` says what will be done when there is something to keep.
    pub(super) fn watch(what: &'static str) -> Self {
        let interrupt = Self { what, ..Self::default() };
        let on_signal = interrupt.clone();
        if on_request_to_end(move |signal| on_signal.end(signal)).is_err() {
            notice("Ctrl-C cannot be caught here and will end the process at once");
        }
        interrupt
    }

    /// Takes the end of standard input for a signal, too.
    pub(super) fn follow_input(&self) {
        /// That of Ctrl-C.
        const INTERRUPT: i32 = 2;
        let interrupt = self.clone();
        let follow = move || {
            // What cannot be read has ended.
            let _ = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
            interrupt.end(INTERRUPT);
        };
        if std::thread::Builder::new().name("input".to_owned()).spawn(follow).is_err() {
            notice("the end of standard input will not end the work: no thread can be started");
        }
    }

    /// What a signal does.
    fn end(&self, signal: i32) {
        let was_asked = self.was_signalled();
        if was_asked && hang_up() == Some(signal) {
            return;
        }
        if was_asked || !self.has_work.load(Ordering::Relaxed) {
            if !was_asked {
                leave_line();
                tell("lightgrid: interrupted before there was anything to keep");
            }
            remove_unfinished();
            let frames = self.frames.lock().unwrap_or_else(PoisonError::into_inner).take();
            match frames.filter(|folder| folder.exists()) {
                Some(folder) if was_asked => {
                    tell(format_args!("the frames are kept in {}", folder.display()));
                }
                Some(folder) => drop(std::fs::remove_dir_all(folder)),
                None => {}
            }
            std::process::exit(128 + signal);
        }
        self.signalled.store(true, Ordering::SeqCst);
        self.asked.store(true, Ordering::SeqCst);
        leave_line();
        tell(format_args!("lightgrid: {} (again: leave now)", self.what));
    }

    /// From now on there is something to keep.
    pub(super) fn keep(&self) {
        self.has_work.store(true, Ordering::Relaxed);
    }

    /// Frames of a video come into this folder: it goes with them, or is named, should the process be left at once.
    pub(super) fn has_frames_in(&self, folder: &Path) {
        let mut frames = self.frames.lock().unwrap_or_else(PoisonError::into_inner);
        *frames = Some(folder.to_owned());
    }

    /// Whether a signal asked.
    pub(super) fn was_signalled(&self) -> bool {
        self.signalled.load(Ordering::SeqCst)
    }

    /// Lets the work go on unless a signal wants its end: for somebody who only cut it short.
    pub(super) fn go_on(&self) {
        self.asked.store(false, Ordering::SeqCst);
        // A signal may have come in between.
        if self.was_signalled() {
            self.asked.store(true, Ordering::SeqCst);
        }
    }
}

/// Watches where every moment's work is kept.
pub(super) fn kept(what: &'static str) -> Interrupt {
    let interrupt = Interrupt::watch(what);
    interrupt.keep();
    interrupt
}
