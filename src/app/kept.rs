//! A picture that was kept.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use egui::{ColorImage, TextureHandle};

use super::document::Document;
use crate::error::Decoded;
use crate::image::{Image, read_picture};

/// A kept picture.
pub struct Kept {
    /// What to call it.
    pub name: String,
    /// What was done for it.
    pub summary: String,
    /// Linear radiance, as it was shown.
    pub pixels: Arc<Pixels>,
    /// The settings that made it.
    pub document: Document,
    /// It in small.
    pub small: ColorImage,
    /// The same on the device, once it was drawn.
    pub texture: Option<TextureHandle>,
    /// Where it is for the next window.
    pub file: Option<PathBuf>,
}

/// Linear radiance of a kept picture; of one of an earlier window it is read when it is first needed.
pub struct Pixels {
    image: OnceLock<Decoded<Arc<Image>>>,
    file: Option<PathBuf>,
}

impl Pixels {
    /// Those.
    pub fn of(image: Arc<Image>) -> Self {
        Self { image: Ok(image).into(), file: None }
    }

    /// Those of a file.
    pub fn of_file(file: PathBuf) -> Self {
        Self { image: OnceLock::new(), file: Some(file) }
    }

    /// They.
    ///
    /// # Errors
    /// If their file cannot be read.
    pub fn get(&self) -> Decoded<Arc<Image>> {
        let read = || {
            let file = self.file.as_deref().unwrap_or(Path::new(""));
            read_picture(file).map(Arc::new).map_err(|error| error.to_string())
        };
        self.image.get_or_init(read).clone()
    }
}
