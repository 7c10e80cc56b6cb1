//! What runs beside the window: reading and writing files, and asking the desktop.

use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;

use super::camera_pictures::CameraPicture;
use super::document::Document;
use super::inspect::Truth;
use super::kept_picture::KeptPicture;
use super::learning_steps::LearningSteps;
use super::looks::ReadLook;
use super::small_maps::SmallMapsFound;
use super::threads::{Wake, spawn};
use super::worker::Reference;
use crate::error::Result;
use crate::image::read_picture;

/// What comes back from a task.
pub(super) enum TaskResult {
    /// A file was chosen in the dialogue of this number, or none.
    Chosen(u32, Option<String>),
    /// A file was written.
    Done(String),
    /// Something failed.
    Failed(String),
    /// What errors are to be measured against, and what it shows if that is known.
    Reference(Arc<Reference>, Option<Box<Document>>),
    /// A look that was read.
    Look(ReadLook),
    /// How the picture has learned.
    LearningSteps(LearningSteps),
    /// What is true at the inspected point.
    Truth(Truth),
    /// Pictures that earlier windows kept.
    KeptPictures(Vec<KeptPicture>),
    /// What a camera sees in small.
    CameraPicture(CameraPicture),
    /// Maps in small.
    SmallMaps(SmallMapsFound),
}

/// Reads a picture that errors are to be measured against.
///
/// # Errors
/// If the file is no linear picture.
pub(super) fn read_reference(
    name: String,
    path: &Path,
    of: Option<Box<Document>>,
) -> Result<TaskResult> {
    Ok(TaskResult::Reference(Arc::new(Reference { name, image: read_picture(path)? }), of))
}

/// Threads for one task each, and their results.
pub(super) struct Tasks {
    sender: Sender<TaskResult>,
    /// Results that have come.
    pub(super) receiver: Receiver<TaskResult>,
    wake: Wake,
    /// Threads that write files.
    writing: Vec<JoinHandle<()>>,
}

impl Tasks {
    /// `wake` is called at every result.
    pub(super) fn new(wake: Wake) -> Self {
        let (sender, receiver) = channel();
        Self { sender, receiver, wake, writing: Vec::new() }
    }

    /// A function that other threads report a result by. A failure is one, too.
    pub(super) fn reporter(&self) -> impl Fn(Result<TaskResult>) + Send + 'static + use<> {
        let (sender, wake) = (self.sender.clone(), self.wake.clone());
        move |result| {
            let failed = |error: crate::error::Error| TaskResult::Failed(error.to_string());
            // The window may have gone meanwhile.
            let _ = sender.send(result.unwrap_or_else(failed));
            wake();
        }
    }

    /// Runs something slow on a thread, unless the system gives none. A failure is a result, too.
    pub(super) fn run(
        &self,
        name: &str,
        work: impl FnOnce() -> Result<TaskResult> + Send + 'static,
    ) -> Option<JoinHandle<()>> {
        let [report, refuse] = [(); 2].map(|()| self.reporter());
        spawn(name, move || report(work())).map_err(|error| refuse(Err(error))).ok()
    }

    /// The same for a file that is written: the end of the window waits for it.
    pub(super) fn write(
        &mut self,
        name: &str,
        work: impl FnOnce() -> Result<TaskResult> + Send + 'static,
    ) {
        self.writing.retain(|thread| !thread.is_finished());
        self.writing.extend(self.run(name, work));
    }

    /// Waits until all files are written; the failures that have not been reported yet.
    pub(super) fn finish(&mut self) -> Vec<String> {
        for thread in self.writing.drain(..) {
            // What panics has said so.
            let _ = thread.join();
        }
        let failed = |result| match result {
            TaskResult::Failed(sentence) => Some(sentence),
            _ => None,
        };
        self.receiver.try_iter().filter_map(failed).collect()
    }
}
