//! Results on disk: a file for each run, written beside and renamed, so that a report can be resumed.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::error::Result;
use crate::image::{Image, make_folder, write_beside_and_rename};
use crate::output::record::write_json;

/// A report's folder: pages at the top, runs and references below.
#[derive(Debug, Clone)]
pub(super) struct Store {
    /// Where pages and plots go.
    pub(super) root: PathBuf,
    /// Where references are kept.
    pub(super) references: PathBuf,
}

impl Store {
    /// Makes the folders.
    ///
    /// # Errors
    /// If they cannot be made or written to.
    pub(super) fn open(root: &Path, references: Option<&Path>) -> Result<Self> {
        let references = references.map_or_else(|| root.join("references"), Path::to_owned);
        for folder in [root, &root.join("runs"), &references] {
            make_folder(folder)?;
            crate::image::check_writable(&folder.join("test"))?;
        }
        Ok(Self { root: root.to_owned(), references })
    }

    fn path(&self, key: &str, extension: &str) -> PathBuf {
        self.root.join("runs").join(format!("{key}.{extension}"))
    }

    /// The value stored under a name; `None` if it is missing or incomplete.
    pub(super) fn read<T: DeserializeOwned>(&self, key: &str) -> Option<T> {
        serde_json::from_slice(&fs::read(self.path(key, "json")).ok()?).ok()
    }

    /// Stores a value under a name.
    pub(super) fn write(&self, key: &str, value: &impl Serialize) -> Result<()> {
        write_json(&self.path(key, "json"), value)
    }

    /// The value stored under a name, or else what is made, which is stored.
    pub(super) fn kept<T: DeserializeOwned + Serialize>(
        &self,
        key: &str,
        make: impl FnOnce() -> Result<Option<T>>,
    ) -> Result<Option<T>> {
        let kept = self.read(key);
        let made = if kept.is_none() { make()? } else { None };
        made.iter().try_for_each(|made| self.write(key, made))?;
        Ok(kept.or(made))
    }

    /// The pictures stored under a name, all of one size.
    pub(super) fn read_pictures(&self, key: &str, size: (u32, u32)) -> Option<Vec<Image>> {
        let bytes = fs::read(self.path(key, "f32")).ok()?;
        let floats: Vec<f32> = bytes.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
        let pixels = size.0 as usize * size.1 as usize;
        if bytes.is_empty() || bytes.len() % (12 * pixels) != 0 {
            return None;
        }
        let (triples, _) = floats.as_chunks::<3>();
        let picture = |p: &[[f32; 3]]| Image { width: size.0, height: size.1, pixels: p.to_vec() };
        Some(triples.chunks(pixels).map(picture).collect())
    }

    /// Stores pictures of one size under a name, as little-endian floats without a header.
    pub(super) fn write_pictures(&self, key: &str, pictures: &[Image]) -> Result<()> {
        write_beside_and_rename(&self.path(key, "f32"), |file| {
            let mut values = pictures.iter().flat_map(|p| p.pixels.as_flattened());
            values.try_for_each(|x| file.write_all(&x.to_le_bytes()))
        })
    }

    /// Removes the value of a name (`json`) or its pictures (`f32`).
    pub(super) fn remove(&self, key: &str, extension: &str) {
        // A value that cannot be removed is overwritten by the next measurement; pictures only take space.
        let _ = fs::remove_file(self.path(key, extension));
    }
}
