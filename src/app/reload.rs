//! Files of the scene and the map that another program has written: they are read again by themselves.
//!
//! They are looked at by the clock, for network drives and containers tell of no changes.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, SystemTime};

use super::loader::Kind;
use super::threads::{Wake, spawn};
use crate::error::Result;

/// Time between two looks. Files that are the same at both are written to their end.
const PERIOD: Duration = Duration::from_millis(500);

/// Length and time of the last change; `None` of a file that is not there.
type Stamp = Option<(u64, SystemTime)>;

/// Files of the scene or the map to look at from now on; `None` after those that are looked at were read.
type News = (Kind, Option<Vec<PathBuf>>);

/// Looks at files, and says whose have changed.
pub(super) struct Reload {
    /// The thread ends with it.
    news: Sender<News>,
    changed: Arc<[AtomicBool; 2]>,
    /// The file of the scene and of the map, empty if it is built in, and those that it names.
    watched: [(String, Arc<[PathBuf]>); 2],
}

impl Reload {
    /// Looks at nothing yet; `wake` is called when something has changed.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub(super) fn start(wake: Wake) -> Result<Self> {
        let changed = Arc::<[AtomicBool; 2]>::default();
        let (sender, news) = channel();
        let flags = Arc::clone(&changed);
        // Nobody waits for it: it ends once nothing can be told to it, or when its disk answers.
        drop(spawn("reload", move || watch(&news, &flags, &wake))?);
        Ok(Self { news: sender, changed, watched: Default::default() })
    }

    /// Looks at this file and at those that it names from now on.
    pub(super) fn watch(&mut self, kind: Kind, own: &str, others: &Arc<[PathBuf]>) {
        let watched = &mut self.watched[kind as usize];
        if (&*watched.0, &watched.1) != (own, others) {
            *watched = (own.to_owned(), Arc::clone(others));
            let own = (!own.is_empty()).then(|| PathBuf::from(own));
            self.tell(kind, Some(own.into_iter().chain(others.iter().cloned()).collect()));
        }
    }

    /// Takes note that they are read now.
    pub(super) fn forget(&mut self, kind: Kind) {
        self.changed[kind as usize].store(false, Ordering::Relaxed);
        self.tell(kind, None);
    }

    /// Whether they have changed since this was asked last.
    pub(super) fn takes(&self, kind: Kind) -> bool {
        self.changed[kind as usize].swap(false, Ordering::Relaxed)
    }

    fn tell(&self, kind: Kind, files: Option<Vec<PathBuf>>) {
        // The thread ends after this does.
        let _ = self.news.send((kind, files));
    }
}

/// State of the files of one kind when they were read.
#[derive(Default)]
struct Known {
    files: BTreeMap<PathBuf, Stamp>,
    /// As they were at the last look, if that was another state than the one that was read.
    settling: Option<Vec<Stamp>>,
}

impl Known {
    fn watch(&mut self, files: Option<Vec<PathBuf>>) {
        let before = std::mem::take(&mut self.files);
        let (known, files) = match files {
            Some(files) => (before, files),
            None => (BTreeMap::new(), before.into_keys().collect()),
        };
        let stamped = |file: PathBuf| {
            let stamp = known.get(&file).copied().unwrap_or_else(|| stamp(&file));
            (file, stamp)
        };
        self.files = files.into_iter().map(stamped).collect();
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

fn watch(news: &Receiver<News>, changed: &[AtomicBool; 2], wake: &Wake) {
    let mut known = <[Known; 2]>::default();
    loop {
        // Without files nothing wakes the processor.
        let next = match known.iter().any(|known| !known.files.is_empty()) {
            true => news.recv_timeout(PERIOD),
            false => news.recv().map_err(RecvTimeoutError::from),
        };
        match next {
            Ok((kind, files)) => known[kind as usize].watch(files),
            Err(RecvTimeoutError::Timeout) => {
                for (known, changed) in known.iter_mut().zip(changed) {
                    if known.have_changed() {
                        changed.store(true, Ordering::Relaxed);
                        wake();
                    }
                }
            }
            Err(RecvTimeoutError::Disconnected) => return,
        }
    }
}
