//! Makes ready what the screen is developed from, on its own threads: pictures on the device, their
//! exposure, overlays. The window never waits for a filter or an overlay, and develops by itself.

mod carried;
mod memory;
mod order;
mod recent;
mod rest;
mod source;

use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use memory::Memory;
pub(crate) use order::{Order, Shown};
use rest::{MOVING_REST, rest_after, took};

use super::threads::{Latest, LatestThread, Wake, lock};
use crate::error::{Error, Result};
use crate::system::{return_freed, thread_cpu_time};

/// No picture takes longer to be made ready.
const MAX_WAIT: Duration = Duration::from_secs(60);

/// Memory that was freed is given back so often, while pictures come: old ones, and their scenes, are gone then.
const RETURN: Duration = Duration::from_secs(10);

/// The handle of the presenting thread; it ends when dropped.
pub(crate) struct Presenter {
    thread: LatestThread<Order>,
    /// What there is to show.
    pub(super) shown: Arc<Mutex<Option<Arc<Shown>>>>,
    /// What was ordered last.
    pub(super) ordered: Option<Order>,
    /// Set where the picture that is being made is no longer of what is asked for.
    cancel: Arc<AtomicBool>,
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
        let (shown, cancel) = (Arc::default(), Arc::default());
        let inside = (Arc::clone(&shown), Arc::clone(&cancel));
        let work = move |orders: &_| pool.install(|| run(orders, &inside.0, &inside.1, &wake));
        let thread = LatestThread::start("presenter", Arc::default(), work)?;
        Ok(Self { thread, shown, ordered: None, cancel })
    }

    /// Orders a picture; the latest order counts.
    pub(crate) fn order(&mut self, order: Order) {
        if self.ordered.as_ref() == Some(&order) {
            return;
        }
        let before = self.ordered.replace(order.clone());
        self.thread.latest.change(|slot| {
            if before.is_some_and(|before| !order.is_same_work(&before)) {
                self.cancel.store(true, Ordering::Relaxed);
            }
            slot.value = Some(order);
        });
    }
}

fn run(
    orders: &Latest<Order>,
    shown: &Mutex<Option<Arc<Shown>>>,
    cancel: &AtomicBool,
    wake: &Wake,
) {
    let mut memory = Memory::default();
    // The last order, and until when one that only follows it waits.
    let mut last: Option<(Order, Instant)> = None;
    let mut returned = Instant::now();
    let next = |last: Option<&(Order, Instant)>| {
        orders.wait(|slot| {
            let rest = match (&slot.value, last) {
                _ if slot.is_closed => return ControlFlow::Break(None),
                (None, _) => return ControlFlow::Continue(None),
                (Some(order), Some((before, until))) if order.only_follows(before) => {
                    until.saturating_duration_since(Instant::now())
                }
                (Some(_), _) => Duration::ZERO,
            };
            if !rest.is_zero() {
                return ControlFlow::Continue(Some(rest));
            }
            cancel.store(false, Ordering::Relaxed);
            ControlFlow::Break(slot.value.take())
        })
    };
    while let Some(order) = next(last.as_ref()) {
        let (start, kept) = (Instant::now(), order.presented());
        let worked = thread_cpu_time();
        order.snapshot.rest.set_end(start + MAX_WAIT);
        match catch_unwind(AssertUnwindSafe(|| memory.present(&order, cancel))) {
            Ok(Ok(Some(done))) => {
                if done.is_coarse {
                    orders.change(|slot| _ = slot.value.get_or_insert_with(|| order.clone()));
                }
                *lock(shown) = Some(Arc::new(done));
            }
            // It was cancelled; or the device is lost, and the window orders again on another.
            Ok(Ok(None) | Err(_)) => {}
            // The panic is on the terminal; the next picture is another try.
            Err(_) => memory = Memory::default(),
        }
        let took = took(worked, start.elapsed());
        let rest = match kept.snapshot.request.moving {
            true => took.mul_f64(MOVING_REST),
            false => rest_after(took, kept.snapshot.youngest_seconds()),
        };
        let end = Instant::now() + rest;
        kept.snapshot.rest.set_end(end);
        last = Some((kept, end));
        wake();
        if returned.elapsed() > RETURN {
            return_freed();
            returned = Instant::now();
        }
    }
}
