//! Work that makes a GPU ready.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::Orders;
use crate::app::lock;

/// Some of it that is under way. It ends when dropped, be it by a panic.
pub(super) struct Preparation(Arc<Orders>);

impl Preparation {
    /// Begins, and has that shown.
    pub(super) fn begin(orders: &Arc<Orders>) -> Self {
        orders.preparations.fetch_add(1, Ordering::Relaxed);
        (orders.wake)();
        Self(Arc::clone(orders))
    }
}

impl Drop for Preparation {
    fn drop(&mut self) {
        self.0.preparations.fetch_sub(1, Ordering::Relaxed);
        // Whoever waits for it looks for it with the lock held: either it is gone by then, or this wakes them.
        drop(lock(&self.0.slot));
        self.0.changed.notify_all();
        (self.0.wake)();
    }
}
