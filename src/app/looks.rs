//! Looks that are laid over the picture: each is read once, when it is asked for.

use std::collections::BTreeMap;

use super::document::Look;
use super::dropped::is_look;
use super::small_maps::files_beside;
use crate::error::Result;
use crate::tone::{Grade, Lut, Tone};

/// A look that was read.
pub(super) struct ReadLook {
    pub(super) name: String,
    lut: Result<Lut>,
    /// All looks in its folder.
    beside: Vec<String>,
}

/// Looks that were read, by name.
#[derive(Default)]
pub(super) struct Looks {
    /// `None` while one is read.
    read: BTreeMap<String, Option<Lut>>,
    /// Name of the look in use: the last one that was read.
    pub(super) last: Option<String>,
    /// Files in the folder of the one that was read last.
    pub(super) listed: Vec<String>,
}

impl Looks {
    /// Reads the look that is asked for, unless that was done.
    pub(super) fn read(&mut self, look: &Look) -> Option<impl FnOnce() -> ReadLook + use<>> {
        let is_there = |name: &String| self.read.get(name).is_some_and(Option::is_some);
        if look.lut.as_ref().is_none_or(is_there) {
            self.last.clone_from(&look.lut);
        }
        let name = look.lut.clone().filter(|name| !self.read.contains_key(name))?;
        self.read.insert(name.clone(), None);
        Some(move || {
            let is_file = !Lut::is_built_in(&name);
            let beside = if is_file { files_beside(&name, is_look) } else { Vec::new() };
            ReadLook { lut: Lut::read(&name), name, beside }
        })
    }

    /// Takes a look that was read.
    ///
    /// # Errors
    /// Why it cannot be had.
    pub(super) fn take(&mut self, ReadLook { name, lut, beside }: ReadLook) -> Result<()> {
        self.read.remove(&name);
        self.read.insert(name, Some(lut?));
        if !beside.is_empty() {
            self.listed = beside;
        }
        Ok(())
    }

    /// Reads it again when it is asked for next.
    pub(super) fn forget(&mut self, name: &str) {
        self.read.remove(name);
    }

    /// Tone curve and look as they are asked for; with the look before while one is read.
    pub(super) fn tone(&self, look: &Look) -> Tone {
        let read = |name: &String| self.read.get(name)?.clone();
        let asked = look.lut.as_ref();
        let lut = asked.and_then(|name| read(name).or_else(|| read(self.last.as_ref()?)));
        let grade = lut.map(|lut| Grade { lut, strength: look.lut_strength });
        Tone { curve: look.curve, grade }
    }
}
