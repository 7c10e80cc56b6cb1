//! What the window is drawn on: a device, and what develops and draws pictures there. All are made anew when the
//! device is lost; nothing else of the window depends on them.

use std::collections::HashMap;
use std::sync::Arc;

use egui::epaint::{ImageData, ImageDelta};
use egui::{Color32, ColorImage, TextureId, TexturesDelta};
use egui_wgpu::{Renderer, RendererOptions};

use super::blit::{Blit, Source};
use crate::develop::{DevelopSettings, Developer, DisplayTexture, LinearPicture, OverlayTexture};
use crate::error::Result;
use crate::image::Rgb8;
use crate::render::gpu::Gpu;

/// The device and what draws there; clones share it.
#[derive(Clone)]
pub struct Screen {
    pub(super) developer: Arc<Developer>,
    blit: Arc<Blit>,
}

impl Screen {
    /// Makes the device ready for developing pictures and drawing them into frames of a format.
    ///
    /// # Errors
    /// If the driver refuses what is needed.
    pub(super) fn new(gpu: &Gpu, frames: wgpu::TextureFormat) -> Result<Self> {
        let blit = Arc::new(Blit::new(gpu, frames));
        // It asks whether the driver took both.
        let developer = Arc::new(Developer::new(gpu)?);
        Ok(Self { developer, blit })
    }

    /// The device.
    pub(super) fn gpu(&self) -> &Gpu {
        &self.developer.gpu
    }
}

/// How egui draws: without dither, which developed pictures have already.
pub(super) fn renderer_options() -> RendererOptions {
    RendererOptions { dithering: false, ..RendererOptions::default() }
}

/// A picture as egui wants it.
pub(super) fn color_image(picture: &Rgb8) -> ColorImage {
    let pixels = picture.pixels.iter().map(|[r, g, b]| Color32::from_rgb(*r, *g, *b)).collect();
    ColorImage::new([picture.width as usize, picture.height as usize], pixels)
}

/// What a developed picture was made from.
#[derive(Clone, PartialEq)]
pub(super) struct Recipe {
    pub(super) picture: LinearPicture,
    pub(super) overlay: Option<OverlayTexture>,
    pub(super) settings: DevelopSettings,
    /// Number of the snapshot it is of, where the picture changes by itself.
    pub(super) number: Option<u64>,
}

/// A developed picture that can be drawn.
pub(super) struct Developed {
    pub(super) display: DisplayTexture,
    pub(super) source: Source,
    recipe: Recipe,
}

impl Developed {
    /// Develops `recipe` into the slot's texture, unless it holds that already and it cannot have
    /// changed; returns what draws it.
    pub(super) fn update(
        slot: &mut Option<Self>,
        screen: &Screen,
        recipe: Recipe,
        changes: bool,
    ) -> Source {
        let developer = &screen.developer;
        let size = recipe.picture.size();
        let develop = |display: &DisplayTexture, recipe: &Recipe| {
            let Recipe { picture, overlay, settings, .. } = recipe;
            developer.develop(picture, overlay.as_ref(), settings, display);
        };
        if let Some(old) = slot.as_mut().filter(|old| old.display.size() == size) {
            if changes || old.recipe != recipe {
                develop(&old.display, &recipe);
                old.recipe = recipe;
            }
            return old.source.clone();
        }
        let display = DisplayTexture::new(&developer.gpu, size);
        develop(&display, &recipe);
        let source = screen.blit.source(screen.gpu(), &display);
        *slot = Some(Self { display, source: source.clone(), recipe });
        source
    }
}

/// egui's own textures. egui hands each out once; another renderer needs them again.
#[derive(Default)]
pub(super) struct TextureCopies(HashMap<TextureId, ImageDelta>);

impl TextureCopies {
    /// Notes what a renderer is about to be given.
    pub(super) fn follow(&mut self, delta: &TexturesDelta) {
        for (id, changes) in &delta.set {
            for change in changes {
                match self.0.get_mut(id).zip(change.pos) {
                    Some((whole, corner)) => paste(whole, &change.image, corner),
                    None => drop(self.0.insert(*id, change.clone())),
                }
            }
        }
        for id in &delta.free {
            self.0.remove(id);
        }
    }

    /// Gives them all to a renderer that has none.
    pub(super) fn upload(&self, gpu: &Gpu, renderer: &mut Renderer) {
        for (id, image) in &self.0 {
            renderer.update_texture(&gpu.device, &gpu.queue, *id, image);
        }
    }
}

fn paste(whole: &mut ImageDelta, patch: &ImageData, [left, top]: [usize; 2]) {
    let (ImageData::Color(whole), ImageData::Color(patch)) = (&mut whole.image, patch);
    let whole = Arc::make_mut(whole);
    let [width, _] = whole.size;
    for (row, pixels) in patch.pixels.chunks_exact(patch.size[0].max(1)).enumerate() {
        let start = (top + row) * width + left;
        whole.pixels[start..][..pixels.len()].copy_from_slice(pixels);
    }
}

#[cfg(test)]
mod tests {
    use egui::TextureOptions;

    use super::*;

    #[test]
    fn copies_follow_whole_images_patches_and_freeing() {
        let image = |size, level| ColorImage::filled(size, Color32::from_gray(level));
        let mut copies = TextureCopies::default();
        let (id, other) = (TextureId::Managed(0), TextureId::Managed(1));
        let mut delta = TexturesDelta::default();
        delta.push(id, ImageDelta::full(image([4, 3], 10), TextureOptions::LINEAR));
        delta.push(id, ImageDelta::partial([2, 1], image([2, 2], 20), TextureOptions::LINEAR));
        delta.push(other, ImageDelta::full(image([1, 1], 30), TextureOptions::LINEAR));
        copies.follow(&delta);
        let ImageData::Color(kept) = &copies.0[&id].image;
        let levels: Vec<u8> = kept.pixels.iter().map(Color32::r).collect();
        assert_eq!(levels, [10, 10, 10, 10, 10, 10, 20, 20, 10, 10, 20, 20]);
        assert!(copies.0[&id].is_whole());
        let mut delta = TexturesDelta::default();
        delta.free(other);
        copies.follow(&delta);
        assert!(!copies.0.contains_key(&other) && copies.0.contains_key(&id));
    }
}
