//! Files of the scene and the map that another program has written: they are read again by themselves.
//!
//! They are looked at by the clock, for network drives and containers tell of no changes.

use std::collections::BTreeMap;
use std::fs;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, SystemTime};

use super::loader::Kind;
use super::threads::{Latest, LatestThread, Wake};
use crate::error::Result;

/// Time between two looks. Files that are the same at both are written to their end.
const PERIOD: Duration = Duration::from_millis(500);

/// Length and time of the last change; `None` of a file that is not there.
type Stamp = Option<(u64, SystemTime)>;

/// Files of the scene or of the map.
#[derive(Clone, Default)]
struct Watched {
    /// Empty if it is built in.
    own: String,
    others: Arc<[PathBuf]>,
    /// How often they were read.
    reads: u32,
}

/// Looks at files, and says whose have changed.
pub(super) struct Reload {
    thread: LatestThread<[Watched; 2]>,
    changed: Arc<[AtomicBool; 2]>,
    watched: [Watched; 2],
}

impl Reload {
    /// Looks at nothing yet; `wake` is called when something has changed.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub(super) fn start(wake: Wake) -> Result<Self> {
        let changed = Arc::<[AtomicBool; 2]>::default();
        let flags = Arc::clone(&changed);
        let thread = LatestThread::start("reload", Arc::default(), move |latest| {
            watch(latest, &flags, &wake);
        })?;
        Ok(Self { thread, changed, watched: Default::default() })
    }

    /// Looks at this file and at those that it names from now on.
    pub(super) fn watch(&mut self, kind: Kind, own: &str, others: &Arc<[PathBuf]>) {
        let watched = &mut self.watched[kind as usize];
        if (&*watched.own, &watched.others) != (own, others) {
            own.clone_into(&mut watched.own);
            watched.others = Arc::clone(others);
            self.send();
        }
    }

    /// Takes note that they are read now.
    pub(super) fn forget(&mut self, kind: Kind) {
        self.watched[kind as usize].reads += 1;
        self.changed[kind as usize].store(false, Ordering::Relaxed);
        self.send();
    }

    /// Whether they have changed since this was asked last.
    pub(super) fn takes(&self, kind: Kind) -> bool {
        self.changed[kind as usize].swap(false, Ordering::Relaxed)
    }

    fn send(&self) {
        self.thread.latest.change(|slot| slot.value = Some(self.watched.clone()));
    }
}

/// State of the files of one kind when they were read.
#[derive(Default)]
struct Known {
    files: BTreeMap<PathBuf, Stamp>,
    reads: u32,
    /// As they were at the last look, if that was another state than the one that was read.
    settling: Option<Vec<Stamp>>,
}

impl Known {
    fn watch(&mut self, Watched { own, others, reads }: Watched) {
        let before = std::mem::take(&mut self.files);
        let is_read = reads != self.reads;
        self.reads = reads;
        let own = (!own.is_empty()).then(|| PathBuf::from(own));
        self.files = own
            .into_iter()
            .chain(others.iter().cloned())
            .map(|file| {
                let known = before.get(&file).filter(|_| !is_read).copied();
                let stamp = known.unwrap_or_else(|| stamp(&file));
                (file, stamp)
            })
            .collect();
    }

    /// Whether they have changed and are written to their end.
    fn have_changed(&mut self) -> bool {
        let now: Vec<Stamp> = self.files.keys().map(stamp).collect();
        if now.iter().eq(self.files.values()) {
            self.settling = None;
            return false;
        }
        let is_settled = now.iter().all(Option::is_some) && self.settling.as_ref() == Some(&now);
        if is_settled {
            self.files.values_mut().zip(&now).for_each(|(known, now)| *known = *now);
        }
        self.settling = (!is_settled).then_some(now);
        is_settled
    }
}

fn stamp(file: &PathBuf) -> Stamp {
    let facts = fs::metadata(file).ok()?;
    Some((facts.len(), facts.modified().ok()?))
}

fn watch(latest: &Latest<[Watched; 2]>, changed: &[AtomicBool; 2], wake: &Wake) {
    let mut known = <[Known; 2]>::default();
    loop {
        let mut has_waited = false;
        // Without files nothing wakes the processor.
        let period = known.iter().any(|known| !known.files.is_empty()).then_some(PERIOD);
        // `None` to end; the files are looked at without the lock.
        let news = latest.wait(|slot| match slot.value.take() {
            _ if slot.is_closed => ControlFlow::Break(None),
            Some(news) => ControlFlow::Break(Some(Some(news))),
            None if has_waited => ControlFlow::Break(Some(None)),
            None => {
                has_waited = true;
                ControlFlow::Continue(period)
            }
        });
        match news {
            None => return,
            Some(Some(news)) => {
                known.iter_mut().zip(news).for_each(|(known, watched)| known.watch(watched));
            }
            Some(None) => {
                for (known, changed) in known.iter_mut().zip(changed) {
                    if known.have_changed() {
                        changed.store(true, Ordering::Relaxed);
                        wake();
                    }
                }
            }
        }
    }
}
