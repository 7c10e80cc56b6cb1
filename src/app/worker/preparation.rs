//! Work that makes a GPU ready.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::shared::Shared;

/// Some of it that is under way. It ends when dropped, be it by a panic.
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
