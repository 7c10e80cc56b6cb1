//! A picture that was kept.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, Weak};

use egui::TextureHandle;

use super::document::Document;
use super::threads::lock;
use crate::error::Decoded;
use crate::image::{Image, Rgb8, read_picture};
use crate::scene::SceneOptions;

/// Most pictures kept.
pub(super) const MAX_PICTURES: usize = 12;

/// Width in pixels at which they are shown in the list.
pub(super) const SMALL_WIDTH: u32 = 128;

/// A kept picture.
pub(crate) struct KeptPicture {
    /// What to call it.
    pub name: String,
    /// What was done for it.
    pub summary: String,
    /// Linear radiance, as it was shown.
    pub pixels: Arc<Pixels>,
    /// The settings that made it.
    pub document: Document,
    /// What was asked of the scene's file besides.
    pub of_scene: SceneOptions,
    /// It in small.
    pub small: Rgb8,
    /// The same on the device, once it was drawn.
    pub texture: Option<TextureHandle>,
    /// Where it is for the next window.
    pub file: Option<PathBuf>,
}

/// Linear radiance of a kept picture: in memory until it is in a file, then where somebody looks at it.
pub(crate) struct Pixels(Mutex<Source>);

enum Source {
    Here(Arc<Image>),
    InFile(PathBuf, Weak<Image>),
}

impl Pixels {
    /// Those of a picture that is in no file.
    pub(crate) fn new(image: Arc<Image>) -> Self {
        Self(Mutex::new(Source::Here(image)))
    }

    /// Those of a file.
    pub(crate) fn of_file(file: PathBuf) -> Self {
        Self(Mutex::new(Source::InFile(file, Weak::new())))
    }

    /// Leaves them to a file that they were written to.
    pub(crate) fn leave_to(&self, file: PathBuf) {
        let mut source = lock(&self.0);
        if let Source::Here(image) = &*source {
            *source = Source::InFile(file, Arc::downgrade(image));
        }
    }

    /// They; read again if nobody looks at them.
    ///
    /// # Errors
    /// If their file cannot be read.
    pub(crate) fn get(&self) -> Decoded<Arc<Image>> {
        match &mut *lock(&self.0) {
            Source::Here(image) => Ok(Arc::clone(image)),
            Source::InFile(file, known) => {
                if let Some(image) = known.upgrade() {
                    return Ok(image);
                }
                let image = Arc::new(read_picture(file).map_err(|error| error.to_string())?);
                *known = Arc::downgrade(&image);
                Ok(image)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{ExrPicture, write_exr};

    #[test]
    fn pixels_in_a_file_are_in_memory_while_somebody_looks_at_them() {
        let temporary = tempfile::tempdir().expect("a folder");
        let file = temporary.path().join("kept.exr");
        let image = Arc::new(Image::filled(3, 2, [0.25, 1e-3, 700.0]));
        let (expected, held) = ((*image).clone(), Arc::downgrade(&image));
        let picture = ExrPicture { image: &image, layers: vec![], metadata: &[], preview: None };
        write_exr(&file, picture).expect("written");
        let pixels = Pixels::new(image);
        assert!(held.upgrade().is_some());
        pixels.leave_to(file.clone());
        assert!(held.upgrade().is_none(), "nobody looks at it");
        let (first, second) = (pixels.get().expect("read"), pixels.get().expect("known"));
        assert!(Arc::ptr_eq(&first, &second) && *first == expected);
        std::fs::remove_file(&file).expect("removed");
        assert!(pixels.get().is_ok(), "still looked at");
        drop((first, second));
        assert!(pixels.get().expect_err("it is gone").contains("kept.exr"));
    }
}
