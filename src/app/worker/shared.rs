//! What the render thread shares with the window: the request that is worked on and what was asked for since, pictures,
//! and work that makes a GPU ready.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use super::request::Request;
use super::snapshot::{PublishThrottle, Snapshot};
use crate::app::threads::{Latest, Wake, lock};
use crate::render::gpu::Gpu;

pub(super) struct Shared {
    /// What is asked for; it stays there while it is worked on.
    pub(super) orders: Arc<Latest<Arc<Request>>>,
    /// How many [`Preparation`]s are under way.
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

/// Work that makes a GPU ready and is under way. It ends when dropped, be it by a panic.
pub(super) struct Preparation(Arc<Shared>);

impl Preparation {
    /// Begins, and has that shown.
    pub(super) fn begin(shared: &Arc<Shared>) -> Self {
        shared.preparations.fetch_add(1, Ordering::Relaxed);
        (shared.wake)();
        Self(Arc::clone(shared))
    }
}

impl Drop for Preparation {
    fn drop(&mut self) {
        // Whoever waits for its end looks for it with the lock held.
        self.0.orders.change(|_| _ = self.0.preparations.fetch_sub(1, Ordering::Relaxed));
        (self.0.wake)();
    }
}

/// The request that is worked on, beside the latest one.
pub(super) struct RequestWatch<'a> {
    pub(super) shared: &'a Arc<Shared>,
    pub(super) request: Arc<Request>,
}

impl RequestWatch<'_> {
    /// Takes up the latest request, if work goes on for it; whether it does.
    pub(super) fn takes_up_latest(&mut self) -> bool {
        let slot = self.shared.orders.slot();
        if slot.is_closed || slot.value.as_ref().is_some_and(|new| self.request.restarts(new)) {
            return false;
        }
        if let Some(new) = &slot.value {
            self.request = Arc::clone(new);
        }
        self.shared.cancel.store(false, Ordering::Relaxed);
        true
    }

    /// Lets passes go on that an alarm has cut short, unless work is to end.
    pub(super) fn go_on(&self) {
        let slot = self.shared.orders.slot();
        if !slot.is_closed && slot.value.as_ref().is_none_or(|new| !self.request.restarts(new)) {
            self.shared.cancel.store(false, Ordering::Relaxed);
        }
    }

    /// Whether work for this request is of no use for the latest one.
    pub(super) fn is_superseded(&self) -> bool {
        self.is_left_for(Request::restarts)
    }

    /// Whether something else is asked for than the next moment of a movement.
    pub(super) fn is_elsewhere(&self) -> bool {
        self.is_left_for(Request::is_ended_by)
    }

    fn is_left_for(&self, is_other: impl Fn(&Request, &Request) -> bool) -> bool {
        let slot = self.shared.orders.slot();
        slot.is_closed || slot.value.as_ref().is_some_and(|new| is_other(&self.request, new))
    }

    /// Whether the next picture can go on with the radiance cache of this one.
    pub(super) fn is_left_for_same_light(&self) -> bool {
        let is_lit_alike = |next: &Arc<Request>| {
            Arc::ptr_eq(&next.world, &self.request.world) && self.request.is_lit_like(next)
        };
        self.shared.orders.slot().value.as_ref().is_some_and(is_lit_alike)
    }
}
