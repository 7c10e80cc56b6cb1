//! The clock that cuts passes short.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Sets the cancel flag after a while, so that a pass ends with what it has.
pub(crate) struct Alarm {
    state: Arc<(Mutex<AlarmState>, Condvar)>,
}

#[derive(Default)]
struct AlarmState {
    at: Option<Instant>,
    quit: bool,
}

impl Alarm {
    /// Starts its thread.
    pub(crate) fn start(cancel: Arc<AtomicBool>) -> Self {
        let state = Arc::new((Mutex::new(AlarmState::default()), Condvar::new()));
        let inside = Arc::clone(&state);
        // Without the thread passes are merely not cut short.
        let _ = std::thread::Builder::new().name("alarm".to_owned()).spawn(move || {
            let (mutex, changed) = &*inside;
            let mut state = lock(mutex);
            while !state.quit {
                state = match state.at.map(|at| at.saturating_duration_since(Instant::now())) {
                    None => changed.wait(state).unwrap_or_else(PoisonError::into_inner),
                    Some(Duration::ZERO) => {
                        cancel.store(true, Ordering::Relaxed);
                        state.at = None;
                        state
                    }
                    Some(left) => {
                        changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0
                    }
                };
            }
        });
        Self { state }
    }

    /// Sets the time, or unsets it.
    pub(crate) fn set(&self, at: Option<Instant>) {
        lock(&self.state.0).at = at;
        self.state.1.notify_all();
    }
}

fn lock(state: &Mutex<AlarmState>) -> MutexGuard<'_, AlarmState> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Drop for Alarm {
    fn drop(&mut self) {
        lock(&self.state.0).quit = true;
        self.state.1.notify_all();
    }
}
