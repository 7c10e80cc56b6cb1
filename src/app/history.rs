//! Pictures kept for comparison.

use std::path::PathBuf;
use std::sync::Arc;

use super::album::Album;
use super::document::Document;
use super::kept::{Kept, Pixels};
use super::screen::color_image;
use crate::error::Result;
use crate::image::{Image, Rgb8};

/// Most pictures kept.
const MOST: usize = 12;

/// Width in pixels at which they are shown in the list.
pub const SMALL_WIDTH: u32 = 128;

/// Kept pictures, oldest first.
#[derive(Default)]
pub struct History {
    list: Vec<Kept>,
    count: u32,
    album: Option<Album>,
}

impl History {
    /// With a folder for the next window's sake; `report` is told what earlier ones left there, for
    /// [`Self::take_over`], and later what fails.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub fn of_folder(
        folder: PathBuf,
        report: impl Fn(Result<Vec<Kept>>) + Send + 'static,
    ) -> Result<Self> {
        Ok(Self { album: Some(Album::open(folder, report)?), ..Self::default() })
    }

    /// Takes over what earlier windows left; how many those are.
    pub fn take_over(&mut self, mut earlier: Vec<Kept>) -> usize {
        let number = |kept: &Kept| kept.name.rsplit(' ').next()?.parse().ok();
        self.count = earlier.iter().filter_map(number).fold(self.count, u32::max);
        let count = earlier.len();
        earlier.append(&mut self.list);
        self.list = earlier;
        count
    }

    /// Keeps a picture under a new name; its place in the list. `small` is it in small, for the list.
    ///
    /// # Errors
    /// If it cannot be kept for the next window.
    pub fn keep(
        &mut self,
        summary: String,
        image: &Arc<Image>,
        document: Document,
        small: &Rgb8,
    ) -> (usize, Result<()>) {
        self.count = self.count.saturating_add(1);
        let name = format!("Picture {}", self.count);
        let mut write = |album: &mut Album| album.write([&name, &summary], image, &document, small);
        let (file, failure) = match self.album.as_mut().map(&mut write).transpose() {
            Ok(file) => (file, Ok(())),
            Err(error) => (None, Err(error)),
        };
        let pixels = Arc::new(Pixels::of(Arc::clone(image)));
        let small = color_image(small);
        self.list.push(Kept { name, summary, pixels, document, small, texture: None, file });
        while self.list.len() > MOST {
            self.remove(0);
        }
        (self.list.len() - 1, failure)
    }

    /// One of them.
    pub fn get(&self, index: usize) -> Option<&Kept> {
        self.list.get(index)
    }

    /// All of them.
    pub fn list_mut(&mut self) -> &mut [Kept] {
        &mut self.list
    }

    /// Drops one, and its file.
    pub fn remove(&mut self, index: usize) {
        let kept = self.list.remove(index);
        if let (Some(album), Some(file)) = (&self.album, kept.file) {
            album.remove(file);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_picture_goes_and_names_are_not_given_again() {
        let mut history = History::default();
        for _ in 0..=MOST {
            let image = Arc::new(Image::filled(1, 1, [0.0; 3]));
            let small = Rgb8 { width: 1, height: 1, pixels: vec![[0; 3]] };
            history.keep(String::new(), &image, Document::default(), &small).1.expect("kept");
        }
        assert_eq!(history.list_mut().len(), MOST);
        assert_eq!(history.get(0).map(|kept| kept.name.as_str()), Some("Picture 2"));
        history.remove(0);
        assert_eq!(history.get(0).map(|kept| kept.name.as_str()), Some("Picture 3"));
    }
}
