//! Ctrl-C, requests to end and closed terminals: at once while there is nothing to keep, then once to finish early and
//! keep what is done, twice to leave at once. A closed terminal is no hurry: its shell may say so again.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use crate::image::remove_unfinished;
use crate::system::{hang_up, on_request_to_end};
use crate::terminal::{leave_line, notice, tell};

/// What signals set.
pub(super) struct Interrupt {
    /// Becomes true when the work is to end early. Others may set it, too.
    pub(super) asked: Arc<AtomicBool>,
    /// Whether it was a signal that asked.
    signalled: Arc<AtomicBool>,
    has_work: Arc<AtomicBool>,
    /// Where frames are that are to become a video.
    frames: Arc<Mutex<Option<PathBuf>>>,
}

impl Interrupt {
    /// Watches from now on. `what` says what will be done when there is something to keep.
    pub(super) fn watch(what: &'static str) -> Self {
        let [asked, signalled, has_work] = [(); 3].map(|()| Arc::<AtomicBool>::default());
        let flags = [&asked, &signalled, &has_work].map(Arc::clone);
        let frames = Arc::<Mutex<Option<PathBuf>>>::default();
        let of_video = Arc::clone(&frames);
        let watching = on_request_to_end(move |signal| {
            let [asked, signalled, has_work] = &flags;
            let was_asked = signalled.load(Ordering::SeqCst);
            if was_asked && hang_up() == Some(signal) {
                return;
            }
            if was_asked || !has_work.load(Ordering::Relaxed) {
                if !was_asked {
                    leave_line();
                    tell("lightgrid: interrupted before there was anything to keep");
                }
                remove_unfinished();
                let frames = of_video.lock().unwrap_or_else(PoisonError::into_inner).take();
                match frames.filter(|folder| folder.exists()) {
                    Some(folder) if was_asked => {
                        tell(format_args!("the frames are kept in {}", folder.display()));
                    }
                    Some(folder) => drop(std::fs::remove_dir_all(folder)),
                    None => {}
                }
                std::process::exit(128 + signal);
            }
            signalled.store(true, Ordering::SeqCst);
            asked.store(true, Ordering::SeqCst);
            leave_line();
            tell(format_args!("lightgrid: {what} (again: leave now)"));
        });
        if watching.is_err() {
            notice("Ctrl-C cannot be caught here and will end the process at once");
        }
        Self { asked, signalled, has_work, frames }
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
