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
        let empty = Self::default();
        for _ in 0..EMPTY_RAYS {
            drop(empty.start());
        }
        Some((self.mean()? - empty.mean()?).max(0.0))
    }

    fn mean(&self) -> Option<f64> {
        let rays = self.rays.load(Ordering::Relaxed);
        let nanoseconds = self.nanoseconds.load(Ordering::Relaxed);
        (rays > 0).then(|| nanoseconds as f64 / rays as f64)
    }
}

/// Rays that are none, to learn what the clock itself takes.
const EMPTY_RAYS: u32 = 1 << 16;

impl Drop for Running<'_> {
    fn drop(&mut self) {
        let nanoseconds = self.start.elapsed().as_nanos() as u64;
        self.clock.nanoseconds.fetch_add(nanoseconds, Ordering::Relaxed);
        self.clock.rays.fetch_add(1, Ordering::Relaxed);
    }
}
