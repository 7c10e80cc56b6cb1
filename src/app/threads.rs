//! Threads beside the window: what wakes it, the newest value that one of them works on, and the thread itself.

use std::ops::ControlFlow;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use crate::error::{Error, Result};

/// Called from any thread when there is something new.
pub type Wake = Arc<dyn Fn() + Send + Sync>;

/// Whom threads wake when there is something new.
#[derive(Clone)]
pub struct Wakes {
    /// There is something to draw.
    pub draw: Wake,
    /// The worker has something for the presenter: see [`super::App::relay`].
    pub relay: Wake,
}

/// Locks a mutex. A value is sound even if a thread has panicked while it held the lock.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Starts a thread.
///
/// # Errors
/// If the system gives none; the sentence has the thread's name.
pub(super) fn spawn(name: &str, work: impl FnOnce() + Send + 'static) -> Result<JoinHandle<()>> {
    let thread = Builder::new().name(name.to_owned()).spawn(work);
    thread.map_err(|cause| Error::new(format!("the thread `{name}` cannot be started: {cause}")))
}

/// A slot for the newest value, which another thread waits for. A value that nobody has taken is replaced by the
/// next one.
pub(super) struct Latest<T> {
    slot: Mutex<Slot<T>>,
    changed: Condvar,
}

/// Content of a [`Latest`].
pub(super) struct Slot<T> {
    /// The newest value; `None` before the first one, and once it was taken.
    pub(super) value: Option<T>,
    /// Whether no value will follow: whoever waits for one is to end.
    pub(super) is_closed: bool,
}

impl<T> Default for Latest<T> {
    fn default() -> Self {
        let slot = Slot { value: None, is_closed: false };
        Self { slot: Mutex::new(slot), changed: Condvar::new() }
    }
}

impl<T> Latest<T> {
    /// The slot, locked.
    pub(super) fn slot(&self) -> MutexGuard<'_, Slot<T>> {
        lock(&self.slot)
    }

    /// Changes the slot, and wakes whoever waits.
    pub(super) fn change(&self, change: impl FnOnce(&mut Slot<T>)) {
        change(&mut self.slot());
        self.changed.notify_all();
    }

    /// Waits until `look` breaks with a result. It looks at the slot now, after every change and after the time, if
    /// any, that it continues with.
    pub(super) fn wait<R>(
        &self,
        mut look: impl FnMut(&mut Slot<T>) -> ControlFlow<R, Option<Duration>>,
    ) -> R {
        let mut slot = self.slot();
        loop {
            slot = match look(&mut slot) {
                ControlFlow::Break(result) => return result,
                ControlFlow::Continue(None) => {
                    self.changed.wait(slot).unwrap_or_else(PoisonError::into_inner)
                }
                ControlFlow::Continue(Some(time)) => {
                    self.changed.wait_timeout(slot, time).unwrap_or_else(PoisonError::into_inner).0
                }
            };
        }
    }
}

/// A thread that works on the newest value it is given. Dropped, it is told to end and waited for.
pub(super) struct LatestThread<T> {
    /// What it is given.
    pub(super) latest: Arc<Latest<T>>,
    _thread: Joined,
}

/// A thread that is waited for when this is dropped.
pub(super) struct Joined(pub(super) Option<JoinHandle<()>>);

impl Drop for Joined {
    fn drop(&mut self) {
        if let Some(thread) = self.0.take() {
            // A panic there was reported there.
            let _ = thread.join();
        }
    }
}

impl<T: Send + 'static> LatestThread<T> {
    /// Starts a thread that runs `work`, which returns once the slot is closed.
    ///
    /// # Errors
    /// Those of [`spawn`].
    pub(super) fn start(
        name: &str,
        latest: Arc<Latest<T>>,
        work: impl FnOnce(&Latest<T>) + Send + 'static,
    ) -> Result<Self> {
        let inside = Arc::clone(&latest);
        let thread = spawn(name, move || work(&inside))?;
        Ok(Self { latest, _thread: Joined(Some(thread)) })
    }
}

impl<T> Drop for LatestThread<T> {
    fn drop(&mut self) {
        self.latest.change(|slot| slot.is_closed = true);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;

    #[test]
    fn a_thread_works_on_the_newest_value_and_ends_when_dropped() {
        let (sender, done) = channel();
        let (begin, begun) = channel();
        let latest = Arc::new(Latest::default());
        let thread = LatestThread::start("test", Arc::clone(&latest), move |latest| {
            let next = || {
                latest.wait(|slot| match slot.value.take() {
                    Some(value) => ControlFlow::Break(Some(value)),
                    None if slot.is_closed => ControlFlow::Break(None),
                    None => ControlFlow::Continue(None),
                })
            };
            while let Some(value) = next() {
                sender.send(value).expect("somebody listens");
                begun.recv().expect("somebody goes on");
            }
        });
        let thread = thread.expect("a thread");
        latest.change(|slot| slot.value = Some(1));
        assert_eq!(done.recv(), Ok(1));
        // Two come while it is at work; the first of them is out of date by then.
        latest.change(|slot| slot.value = Some(2));
        latest.change(|slot| slot.value = Some(3));
        (0..2).for_each(|_| begin.send(()).expect("it waits"));
        assert_eq!(done.recv(), Ok(3));
        drop(thread);
        assert!(done.recv().is_err(), "it has ended");
    }

    #[test]
    fn a_value_survives_a_panic_of_whoever_held_it() {
        let latest = Arc::new(Latest::default());
        let inside = Arc::clone(&latest);
        let thread = spawn("test", move || {
            inside.change(|slot| {
                slot.value = Some(7);
                panic!("expected by the test");
            });
        });
        assert!(thread.expect("a thread").join().is_err());
        assert_eq!(latest.slot().value, Some(7));
    }

    #[test]
    fn a_wait_ends_with_its_time() {
        let latest = Latest::<()>::default();
        let mut looks = 0;
        latest.wait(|_| {
            looks += 1;
            if looks < 3 {
                ControlFlow::Continue(Some(Duration::ZERO))
            } else {
                ControlFlow::Break(())
            }
        });
        assert_eq!(looks, 3);
    }
}
