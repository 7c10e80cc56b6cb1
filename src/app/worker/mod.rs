//! The render thread: takes the latest request, publishes the latest picture.
//!
//! The only place that runs a [`crate::render::Session`]. A request that differs in what is seen starts anew; one
//! that differs in when to stop or whether to pause is taken on the way. A film begins with every eighth
//! pixel of every eighth row, then every fourth and second, so that there is a picture of the whole
//! view at once and no sample is lost.

use std::cell::OnceCell;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::Ordering;

mod device;
mod inspection;
mod mix_task;
mod preview;
mod request;
mod session_cache;
mod sessions;
mod shared;
mod snapshot;
mod task;
#[cfg(test)]
pub(super) mod tests;

use device::Device;
use mix_task::MixTask;
pub(crate) use request::{Reference, Request};
use session_cache::SessionCache;
use sessions::Sessions;
use shared::{RequestWatch, Shared};
pub(crate) use snapshot::{Activity, Backdrop, NoCache, Point, SessionSnapshot, Snapshot};
use task::PictureTask;

use super::threads::{LatestThread, Wake, lock};
use crate::alarm::Alarm;
use crate::error::{Error, Result};
use crate::render::gpu::{Gpu, RayChoice};
use crate::render::light_groups::LightGroup;
use crate::system::lower_thread_priority;

/// The handle of the render thread; it ends when dropped.
pub(crate) struct Worker {
    shared: Arc<Shared>,
    thread: Option<LatestThread<Arc<Request>>>,
    pool: Arc<rayon::ThreadPool>,
}

impl Worker {
    /// Starts the thread; `wake` is called at every new snapshot, `gpu` names the GPU to take
    /// where one is wanted and what finds surfaces there, and `screen` is the one to share if it is that.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub(crate) fn start(wake: Wake, gpu: (Option<String>, RayChoice), screen: Gpu) -> Result<Self> {
        let pool = rayon::ThreadPoolBuilder::new()
            .thread_name(|i| format!("render {i}"))
            // The window comes first: threads that render give way to it.
            .start_handler(|_| lower_thread_priority())
            .build()
            .map_err(|e| Error::new(format!("the render threads cannot be started: {e}")))?;
        let pool = Arc::new(pool);
        let shared = Arc::new(Shared::new(wake, screen));
        let (inside, render_pool) = (Arc::clone(&shared), Arc::clone(&pool));
        let work = move |_: &_| run(&inside, &render_pool, &gpu);
        let thread = LatestThread::start("worker", Arc::clone(&shared.orders), work)?;
        Ok(Self { shared, thread: Some(thread), pool })
    }

    /// Says which device the window is drawn on now.
    pub(crate) fn move_to(&self, screen: Gpu) {
        *lock(&self.shared.screen) = screen;
    }

    /// Asks for a picture; the latest request counts.
    pub(crate) fn submit(&self, request: Request) {
        self.shared.orders.change(|slot| {
            if slot.value.as_ref().is_some_and(|old| old.is_same(&request)) {
                return;
            }
            let is_cut = |old: &Arc<Request>| old.is_ended_by(&request) || old.mix != request.mix;
            if slot.value.as_ref().is_some_and(is_cut) {
                self.shared.cancel.store(true, Ordering::Relaxed);
            }
            slot.value = Some(Arc::new(request));
        });
    }

    /// The latest picture.
    pub(crate) fn snapshot(&self) -> Option<Arc<Snapshot>> {
        lock(&self.shared.snapshot).clone()
    }

    /// What was asked for last.
    pub(super) fn latest(&self) -> Option<Arc<Request>> {
        self.shared.orders.slot().value.clone()
    }

    /// Whether a picture is what was asked for last.
    pub(super) fn has_answered(&self, snapshot: &Snapshot) -> bool {
        self.latest().is_some_and(|latest| snapshot.request.is_same(&latest))
    }

    /// Whether a picture is of what was asked for last, whatever else is wanted with it.
    pub(super) fn is_of_latest(&self, snapshot: &Snapshot) -> bool {
        let request = &snapshot.request;
        self.latest().is_some_and(|latest| !request.restarts(&latest) && request.mix == latest.mix)
    }

    /// Whether a GPU is being opened, filled or programmed.
    pub(crate) fn is_preparing(&self) -> bool {
        self.shared.preparations.load(Ordering::Relaxed) > 0
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
        let shared = &self.shared;
        shared.orders.change(|slot| {
            slot.is_closed = true;
            shared.cancel.store(true, Ordering::Relaxed);
        });
        self.thread = None;
        // Drivers do not stand it that the process ends while they compile.
        shared.orders.wait(|_| match self.is_preparing() {
            true => ControlFlow::Continue(None),
            false => ControlFlow::Break(()),
        });
    }
}

fn run(shared: &Arc<Shared>, pool: &rayon::ThreadPool, gpu: &(Option<String>, RayChoice)) {
    let fresh = || (Device::new(gpu.clone(), Arc::clone(&shared.screen)), SessionCache::default());
    let (mut device, mut kept) = fresh();
    let alarm = Alarm::start(Arc::clone(&shared.cancel));
    let mut done: Option<Arc<Request>> = None;
    let next = |done: Option<&Request>| {
        shared.orders.wait(|slot| match &slot.value {
            _ if slot.is_closed => ControlFlow::Break(None),
            Some(new) if done.is_none_or(|old| !old.is_same(new)) => {
                // What was to be ended has ended.
                shared.cancel.store(false, Ordering::Relaxed);
                ControlFlow::Break(Some(Arc::clone(new)))
            }
            _ => ControlFlow::Continue(None),
        })
    };
    while let Some(request) = next(done.as_deref()) {
        kept.leave_other_worlds(&request);
        let worked = catch_unwind(AssertUnwindSafe(|| {
            let say = |failure: &Error| shared.report_failure(failure.to_string());
            let (map, mix) = (&request.environment, request.mix.as_ref());
            // A moving picture is lit as the mix is.
            let lit = mix
                .filter(|_| request.moving)
                .map(|factors| pool.install(|| kept.lit_by(map, factors)).inspect_err(say));
            let environment = lit.as_ref().and_then(|lit| lit.as_ref().ok()).unwrap_or(map);
            let groups = mix.filter(|_| !request.moving).map(|_| {
                let parted = pool.install(|| kept.parted(map)).inspect_err(say)?;
                Ok::<_, Error>(LightGroup::all_of((&request.world, map), parted, &request.view))
            });
            let sessions = Sessions {
                world: &request.world,
                environment,
                watch: RequestWatch { shared, request: Arc::clone(&request) },
                device: &mut device,
                kept: &mut kept,
                alarm: &alarm,
                cut_off: OnceCell::new(),
            };
            pool.install(|| match &groups {
                Some(Ok(groups)) => MixTask::new(sessions).work(groups),
                _ => PictureTask::new(sessions).work(),
            })
        }));
        done = Some(worked.unwrap_or_else(|_| {
            // The panic is on the terminal. Nothing of what it left is trusted.
            (device, kept) = fresh();
            alarm.set(None);
            shared.report_panic();
            request
        }));
    }
}
