//! The render thread: takes the latest request, publishes the latest picture.
//!
//! The only place that runs a [`crate::render::Session`]. A request that differs in what is seen starts anew; one
//! that differs in when to stop or whether to pause is taken on the way. A film begins with every eighth
//! pixel of every eighth row, then every fourth and second, so that there is a picture of the whole
//! view at once and no sample is lost.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;

mod device;
mod job;
mod kept;
mod preparation;
mod request;
mod snapshot;
#[cfg(test)]
pub(super) mod tests;

use job::PictureTask;
use kept::SessionCache;
pub(crate) use request::{Reference, Request};
use snapshot::PublishThrottle;
pub(crate) use snapshot::{Activity, Backdrop, NoCache, Origin, Point, SessionSnapshot, Snapshot};

use super::{Wake, lock};
use crate::alarm::Alarm;
use crate::error::{Error, Result};
use crate::render::gpu::{Gpu, RayChoice};

/// What there is to do.
struct Orders {
    slot: Mutex<Slot>,
    changed: Condvar,
    /// How many [`preparation::Preparation`]s are under way.
    preparations: AtomicUsize,
    wake: Wake,
}

struct Shared {
    orders: Arc<Orders>,
    cancel: Arc<AtomicBool>,
    snapshot: Mutex<Option<Arc<Snapshot>>>,
    rest: Arc<PublishThrottle>,
    failures: Mutex<Vec<String>>,
    /// What is said of a panic.
    panic: Mutex<Option<String>>,
    /// The device the window is drawn on.
    screen: Arc<Mutex<Gpu>>,
}

#[derive(Default)]
struct Slot {
    request: Option<Arc<Request>>,
    quit: bool,
}

/// The handle of the render thread; it ends when dropped.
pub(crate) struct Worker {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    pool: Arc<rayon::ThreadPool>,
}

impl Worker {
    /// Starts the thread; `wake` is called at every new snapshot, `gpu` names the GPU to take
    /// where one is wanted and what finds surfaces there, and `screen` is the one to share if it is that.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub(crate) fn start(wake: Wake, gpu: (Option<String>, RayChoice), screen: Gpu) -> Result<Self> {
        let no_thread = |e: &dyn std::fmt::Display| {
            Error::new(format!("the render threads cannot be started: {e}"))
        };
        let pool = rayon::ThreadPoolBuilder::new()
            .thread_name(|i| format!("render {i}"))
            .start_handler(|_| lower_priority())
            .build()
            .map_err(|e| no_thread(&e))?;
        let pool = Arc::new(pool);
        let orders = Orders {
            slot: Mutex::default(),
            changed: Condvar::new(),
            preparations: AtomicUsize::default(),
            wake,
        };
        let shared = Arc::new(Shared {
            orders: Arc::new(orders),
            cancel: Arc::default(),
            snapshot: Mutex::default(),
            rest: Arc::new(PublishThrottle::new()),
            failures: Mutex::default(),
            panic: Mutex::default(),
            screen: Arc::new(Mutex::new(screen)),
        });
        let (inside, render_pool) = (Arc::clone(&shared), Arc::clone(&pool));
        let thread = std::thread::Builder::new()
            .name("worker".to_owned())
            .spawn(move || run(&inside, &render_pool, &gpu))
            .map_err(|e| no_thread(&e))?;
        Ok(Self { shared, thread: Some(thread), pool })
    }

    /// Says which device the window is drawn on now.
    pub(crate) fn move_to(&self, screen: Gpu) {
        *lock(&self.shared.screen) = screen;
    }

    /// Asks for a picture; the latest request counts.
    pub(crate) fn submit(&self, request: Request) {
        let mut slot = lock(&self.shared.orders.slot);
        if slot.request.as_ref().is_some_and(|old| old.is_same(&request)) {
            return;
        }
        if slot.request.as_ref().is_some_and(|old| old.is_ended_by(&request)) {
            self.shared.cancel.store(true, Ordering::Relaxed);
        }
        slot.request = Some(Arc::new(request));
        self.shared.orders.changed.notify_all();
    }

    /// The latest picture.
    pub(crate) fn snapshot(&self) -> Option<Arc<Snapshot>> {
        lock(&self.shared.snapshot).clone()
    }

    /// Whether a picture is what was asked for last.
    pub(super) fn has_answered(&self, snapshot: &Snapshot) -> bool {
        let slot = lock(&self.shared.orders.slot);
        slot.request.as_ref().is_some_and(|latest| snapshot.request.is_same(latest))
    }

    /// Whether a picture is of what was asked for last, whatever else is wanted with it.
    pub(super) fn is_of_latest(&self, snapshot: &Snapshot) -> bool {
        let slot = lock(&self.shared.orders.slot);
        slot.request.as_ref().is_some_and(|latest| !snapshot.request.restarts(latest))
    }

    /// Whether a GPU is being opened, filled or programmed.
    pub(crate) fn is_preparing(&self) -> bool {
        self.shared.orders.preparations.load(Ordering::Relaxed) > 0
    }

    /// What there is to say if rendering has ended with a panic since this was asked last.
    pub(crate) fn take_panic(&self) -> Option<String> {
        lock(&self.shared.panic).take()
    }

    /// Failures of GPUs since this was asked last, a sentence each.
    pub(crate) fn take_failures(&self) -> Vec<String> {
        std::mem::take(&mut lock(&self.shared.failures))
    }

    /// Threads that render.
    pub(crate) fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        lock(&self.shared.orders.slot).quit = true;
        self.shared.cancel.store(true, Ordering::Relaxed);
        self.shared.orders.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            // A panic there was reported there.
            let _ = thread.join();
        }
        // Drivers do not stand it that the process ends while they compile.
        let mut slot = lock(&self.shared.orders.slot);
        while self.is_preparing() {
            slot = self.shared.orders.changed.wait(slot).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

/// The window comes first: render threads give way to it.
fn lower_priority() {
    #[cfg(target_os = "linux")]
    // SAFETY: plain system call; 0 names the calling thread, and failing is harmless.
    unsafe {
        libc::setpriority(libc::PRIO_PROCESS, 0, 5);
    }
}

fn run(shared: &Arc<Shared>, pool: &rayon::ThreadPool, gpu: &(Option<String>, RayChoice)) {
    let fresh = || SessionCache::new(gpu.clone(), Arc::clone(&shared.screen));
    let mut kept = fresh();
    let alarm = Alarm::start(Arc::clone(&shared.cancel));
    let mut done: Option<Arc<Request>> = None;
    loop {
        let request = {
            let mut slot = lock(&shared.orders.slot);
            loop {
                if slot.quit {
                    return;
                }
                match &slot.request {
                    Some(new) if done.as_ref().is_none_or(|old| !old.is_same(new)) => {
                        // What was to be ended has ended.
                        shared.cancel.store(false, Ordering::Relaxed);
                        break Arc::clone(new);
                    }
                    _ => {
                        slot = shared
                            .orders
                            .changed
                            .wait(slot)
                            .unwrap_or_else(PoisonError::into_inner);
                    }
                }
            }
        };
        let world = Arc::clone(&request.world);
        let environment = Arc::clone(&request.environment);
        kept.leave_other_worlds(&request);
        let asked = Arc::clone(&request);
        let worked = catch_unwind(AssertUnwindSafe(|| {
            let mut job = PictureTask::new(shared, &alarm, &mut kept, request);
            pool.install(|| {
                if job.is_moving() {
                    job.follow(&world, &environment);
                } else {
                    job.render(&world, &environment);
                }
            });
            job.into_request()
        }));
        done = Some(worked.unwrap_or_else(|_| {
            // The panic is on the terminal. Nothing of what it left is trusted.
            kept = fresh();
            alarm.set(None);
            *lock(&shared.panic) = Some("rendering has failed; R begins again".to_owned());
            (shared.orders.wake)();
            asked
        }));
    }
}
