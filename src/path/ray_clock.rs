//! How long rays take, when it is asked for: a measurement beside rendering, never part of it.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// Adds up the time that calls for a ray take, on all threads.
#[derive(Debug, Default)]
pub(super) struct RayClock {
    nanoseconds: AtomicU64,
    rays: AtomicU64,
}

/// A ray under way; it is counted when this is dropped.
pub(super) struct Running<'a> {
    clock: &'a RayClock,
    start: Instant,
}

impl RayClock {
    /// Starts timing a ray.
    pub(super) fn start(&self) -> Running<'_> {
        Running { clock: self, start: Instant::now() }
    }

    /// Mean nanoseconds of a ray, without what reading the clock takes; `None` without rays.
    pub(super) fn nanoseconds_per_ray(&self) -> Option<f64> {
        let empty = (0..EMPTY_BATCHES).filter_map(|_| {
            let empty = Self::default();
            for _ in 0..EMPTY_RAYS {
                drop(empty.start());
            }
            empty.mean()
        });
        // The least: in others another process took the core.
        Some((self.mean()? - empty.min_by(f64::total_cmp)?).max(0.0))
    }

    fn mean(&self) -> Option<f64> {
        let rays = self.rays.load(Ordering::Relaxed);
        let nanoseconds = self.nanoseconds.load(Ordering::Relaxed);
        (rays > 0).then(|| nanoseconds as f64 / rays as f64)
    }
}

/// Rays that are none, to learn what the clock itself takes, and how often so many.
const EMPTY_RAYS: u32 = 1 << 10;
const EMPTY_BATCHES: u32 = 64;

impl Drop for Running<'_> {
    fn drop(&mut self) {
        let nanoseconds = self.start.elapsed().as_nanos() as u64;
        self.clock.nanoseconds.fetch_add(nanoseconds, Ordering::Relaxed);
        self.clock.rays.fetch_add(1, Ordering::Relaxed);
    }
}
