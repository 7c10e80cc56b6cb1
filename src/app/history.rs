//! Pictures kept for comparison.

use std::sync::Arc;

use super::worker::Snapshot;
use crate::image::Image;

/// Most pictures kept.
const MOST: usize = 12;

/// A kept picture.
pub struct Kept {
    /// What to call it.
    pub name: String,
    /// What was done for it.
    pub summary: String,
    /// Linear radiance.
    pub image: Arc<Image>,
}

/// Kept pictures, oldest first.
#[derive(Default)]
pub struct History {
    list: Vec<Kept>,
    count: u32,
}

impl History {
    /// Keeps what is rendered now.
    pub fn keep(&mut self, snapshot: &Snapshot, summary: String) {
        self.count += 1;
        let image = Arc::new(snapshot.main.film.image());
        self.list.push(Kept { name: format!("Picture {}", self.count), summary, image });
        if self.list.len() > MOST {
            self.list.remove(0);
        }
    }

    /// One of them.
    pub fn get(&self, index: usize) -> Option<&Kept> {
        self.list.get(index)
    }

    /// All of them.
    pub fn list(&self) -> &[Kept] {
        &self.list
    }

    /// Drops one.
    pub fn remove(&mut self, index: usize) {
        self.list.remove(index);
    }
}
