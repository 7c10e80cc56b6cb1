//! The request that is worked on, and what was asked for since.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use super::request::Request;
use super::shared::Shared;

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
