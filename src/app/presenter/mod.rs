//! Makes ready what the screen is developed from, on its own threads: pictures on the device, their
//! exposure, overlays. The window never waits for a filter or an overlay, and develops by itself.

mod memory;
mod order;
mod rest;
mod source;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use memory::Memory;
pub(crate) use order::{Order, Shown};
use rest::{Work, rest_after};

use super::{Wake, lock};
use crate::error::{Error, Result};

/// No picture takes longer to be made ready.
const MAX_WAIT: Duration = Duration::from_secs(60);

/// Memory that was freed is given back so often, while pictures come: old ones, and their scenes, are gone then.
const RETURN: Duration = Duration::from_secs(10);

#[derive(Default)]
struct Slot {
    order: Option<Order>,
    quit: bool,
}

struct Shared {
    slot: Mutex<Slot>,
    changed: Condvar,
    shown: Mutex<Option<Arc<Shown>>>,
    wake: Wake,
}

/// The handle of the presenting thread; it ends when dropped.
pub(crate) struct Presenter {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    ordered: Option<Order>,
}

impl Presenter {
    /// Starts the thread; `wake` is called when there is something new to show.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub(crate) fn start(wake: Wake) -> Result<Self> {
        let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        // Not the render threads: those are busy for as long as a pass takes.
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads((cores / 2).max(1))
            .thread_name(|i| format!("present {i}"))
            .build()
            .map_err(|e| Error::new(format!("the display threads cannot be started: {e}")))?;
        let shared = Arc::new(Shared {
            slot: Mutex::default(),
            changed: Condvar::new(),
            shown: Mutex::default(),
            wake,
        });
        let inside = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("presenter".to_owned())
            .spawn(move || pool.install(|| run(&inside)))
            .map_err(|e| Error::new(format!("the display thread cannot be started: {e}")))?;
        Ok(Self { shared, thread: Some(thread), ordered: None })
    }

    /// Orders a picture; the latest order counts.
    pub(crate) fn order(&mut self, order: Order) {
        if self.ordered.as_ref() == Some(&order) {
            return;
        }
        self.ordered = Some(order.clone());
        lock(&self.shared.slot).order = Some(order);
        self.shared.changed.notify_all();
    }

    /// What there is to show.
    pub(crate) fn shown(&self) -> Option<Arc<Shown>> {
        lock(&self.shared.shown).clone()
    }

    /// Whether the last order is what is shown.
    pub(crate) fn is_settled(&self) -> bool {
        let shown = self.shown();
        shown.as_ref().map(|s| &s.order) == self.ordered.as_ref()
    }
}

impl Drop for Presenter {
    fn drop(&mut self) {
        lock(&self.shared.slot).quit = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            // A panic there was reported there.
            let _ = thread.join();
        }
    }
}

fn run(shared: &Shared) {
    let mut memory = Memory::default();
    // The last order, and until when one that only follows it waits.
    let mut last: Option<(Order, Instant)> = None;
    let mut returned = Instant::now();
    loop {
        let order = {
            let mut slot = lock(&shared.slot);
            loop {
                if slot.quit {
                    return;
                }
                let rest = match (&slot.order, &last) {
                    (Some(order), Some((before, until))) if order.only_follows(before) => {
                        until.saturating_duration_since(Instant::now())
                    }
                    (Some(_), _) => Duration::ZERO,
                    (None, _) => Duration::MAX,
                };
                if rest.is_zero()
                    && let Some(order) = slot.order.take()
                {
                    break order;
                }
                slot = if rest == Duration::MAX {
                    shared.changed.wait(slot).unwrap_or_else(PoisonError::into_inner)
                } else {
                    let waited = shared.changed.wait_timeout(slot, rest);
                    waited.unwrap_or_else(PoisonError::into_inner).0
                };
            }
        };
        let (start, kept) = (Instant::now(), order.clone());
        let work = Work::start();
        order.snapshot.rest.set_end(start + MAX_WAIT);
        match catch_unwind(AssertUnwindSafe(|| memory.present(order))) {
            Ok(Ok(shown)) => *lock(&shared.shown) = Some(Arc::new(shown)),
            // Where the device is lost, the window orders again on another.
            Ok(Err(_)) => {}
            // The panic is on the terminal; the next picture is another try.
            Err(_) => memory = Memory::default(),
        }
        let rest = rest_after(work.time(start.elapsed()), kept.snapshot.youngest_seconds());
        let end = Instant::now() + rest;
        kept.snapshot.rest.set_end(end);
        last = Some((kept, end));
        (shared.wake)();
        if returned.elapsed() > RETURN {
            crate::memory::return_freed();
            returned = Instant::now();
        }
    }
}
