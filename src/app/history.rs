//! Pictures kept for comparison.

use std::sync::Arc;

use egui::{ColorImage, TextureHandle};

use super::document::Document;
use crate::image::Image;

/// Most pictures kept.
const MOST: usize = 12;

/// Width in pixels at which they are shown in the list.
pub const SMALL_WIDTH: u32 = 128;

/// A kept picture.
pub struct Kept {
    /// What to call it.
    pub name: String,
    /// What was done for it.
    pub summary: String,
    /// Linear radiance, as it was shown.
    pub image: Arc<Image>,
    /// The settings that made it.
    pub document: Document,
    /// It in small.
    pub small: ColorImage,
    /// The same on the device, once it was drawn.
    pub texture: Option<TextureHandle>,
}

/// Kept pictures, oldest first.
#[derive(Default)]
pub struct History {
    list: Vec<Kept>,
    count: u32,
}

impl History {
    /// Keeps a picture under a new name; its place in the list. `small` is it in small, for the list.
    pub fn keep(
        &mut self,
        summary: String,
        image: Arc<Image>,
        document: Document,
        small: ColorImage,
    ) -> usize {
        self.count += 1;
        let name = format!("Picture {}", self.count);
        self.list.push(Kept { name, summary, image, document, small, texture: None });
        if self.list.len() > MOST {
            self.list.remove(0);
        }
        self.list.len() - 1
    }

    /// One of them.
    pub fn get(&self, index: usize) -> Option<&Kept> {
        self.list.get(index)
    }

    /// All of them.
    pub fn list_mut(&mut self) -> &mut [Kept] {
        &mut self.list
    }

    /// Drops one.
    pub fn remove(&mut self, index: usize) {
        self.list.remove(index);
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
            history.keep(String::new(), image, Document::default(), ColorImage::default());
        }
        assert_eq!(history.list_mut().len(), MOST);
        assert_eq!(history.get(0).map(|kept| kept.name.as_str()), Some("Picture 2"));
        history.remove(0);
        assert_eq!(history.get(0).map(|kept| kept.name.as_str()), Some("Picture 3"));
    }
}
