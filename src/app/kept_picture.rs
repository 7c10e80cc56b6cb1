//! A picture that was kept.

use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use egui::{ColorImage, TextureHandle};

use super::document::Document;
use crate::error::Decoded;
use crate::image::{Image, read_picture};
use crate::scene::SceneOptions;

/// A kept picture.
pub struct KeptPicture {
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
    pub small: ColorImage,
    /// The same on the device, once it was drawn.
    pub texture: Option<TextureHandle>,
    /// Where it is for the next window.
    pub file: Option<PathBuf>,
}

/// Linear radiance of a kept picture.
pub enum Pixels {
    /// It was made in this window.
    Here(Arc<Image>),
    /// It is of an earlier window and is read when it is first needed.
    InFile(PathBuf, OnceLock<Arc<Image>>),
}

impl Pixels {
    /// Those of a file.
    pub fn of_file(file: PathBuf) -> Self {
        Self::InFile(file, OnceLock::new())
    }

    /// They.
    ///
    /// # Errors
    /// If their file cannot be read.
    pub fn get(&self) -> Decoded<Arc<Image>> {
        match self {
            Self::Here(image) => Ok(Arc::clone(image)),
            // What failed once, as where memory was short, may work later.
            Self::InFile(file, known) => match known.get() {
                Some(image) => Ok(Arc::clone(image)),
                None => {
                    let image = read_picture(file).map_err(|error| error.to_string())?;
                    Ok(Arc::clone(known.get_or_init(|| Arc::new(image))))
                }
            },
        }
    }
}
