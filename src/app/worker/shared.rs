//! What the render thread shares with the window.

use std::sync::atomic::{AtomicBool, AtomicUsize};
use std::sync::{Arc, Mutex};

use super::request::Request;
use super::snapshot::{PublishThrottle, Snapshot};
use crate::app::threads::{Latest, Wake, lock};
use crate::render::gpu::Gpu;

pub(super) struct Shared {
    /// What is asked for; it stays there while it is worked on.
    pub(super) orders: Arc<Latest<Arc<Request>>>,
    /// How many [`super::preparation::Preparation`]s are under way.
    pub(super) preparations: AtomicUsize,
    /// Called when there is something new.
    pub(super) wake: Wake,
    /// Ends the pass that is under way.
    pub(super) cancel: Arc<AtomicBool>,
    /// The latest picture.
    pub(super) snapshot: Mutex<Option<Arc<Snapshot>>>,
    /// When the window will want the next one.
    pub(super) throttle: Arc<PublishThrottle>,
    /// Failures of GPUs, a sentence each.
    pub(super) failures: Mutex<Vec<String>>,
    /// The sentence about a panic.
    pub(super) panic: Mutex<Option<String>>,
    /// The device the window is drawn on.
    pub(super) screen: Arc<Mutex<Gpu>>,
}

impl Shared {
    pub(super) fn new(wake: Wake, screen: Gpu) -> Self {
        Self {
            orders: Arc::default(),
            preparations: AtomicUsize::default(),
            wake,
            cancel: Arc::default(),
            snapshot: Mutex::default(),
            throttle: Arc::new(PublishThrottle::new()),
            failures: Mutex::default(),
            panic: Mutex::default(),
            screen: Arc::new(Mutex::new(screen)),
        }
    }

    /// Publishes a picture.
    pub(super) fn publish(&self, snapshot: Snapshot) {
        *lock(&self.snapshot) = Some(Arc::new(snapshot));
        (self.wake)();
    }

    /// Reports the failure of a GPU.
    pub(super) fn report_failure(&self, sentence: String) {
        lock(&self.failures).push(sentence);
        (self.wake)();
    }

    /// Reports that rendering has ended with a panic.
    pub(super) fn report_panic(&self) {
        *lock(&self.panic) = Some("rendering has failed; R begins again".to_owned());
        (self.wake)();
    }
}
