//! Pictures on a device: linear ones, what is blended over them, and developed ones.

use crate::render::gpu::{DeviceFilm, Gpu, texture};

/// Texels of overlays and of developed pictures.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// Linear radiance on a device; clones share it, and only those are equal.
#[derive(Clone, PartialEq)]
pub(crate) struct LinearPicture {
    /// Its sums.
    pub(crate) film: DeviceFilm,
    /// Whether a renderer may still be adding to them.
    pub(crate) is_live: bool,
}

impl LinearPicture {
    /// Sums that nobody will change.
    pub(super) fn fixed(film: DeviceFilm) -> Self {
        Self { film, is_live: false }
    }

    /// Pixels across and down.
    pub(crate) fn size(&self) -> [u32; 2] {
        [self.film.width, self.film.height]
    }
}

/// Colours to be blended over a picture of the same size; clones share them, and only those are equal.
#[derive(Clone, PartialEq)]
pub(crate) struct OverlayTexture(pub(super) wgpu::TextureView);

impl OverlayTexture {
    pub(super) fn new(gpu: &Gpu, size: [u32; 2], texels: &[[u8; 4]]) -> Self {
        let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
        let texture = texture(&gpu.device, Some("overlay"), size, FORMAT, usage);
        let bytes_per_row = Some(4 * size[0]);
        let layout = wgpu::TexelCopyBufferLayout { bytes_per_row, ..Default::default() };
        let (place, texels) = (texture.as_image_copy(), bytemuck::cast_slice(texels));
        gpu.queue.write_texture(place, texels, layout, texture.size());
        Self(texture.create_view(&Default::default()))
    }
}

/// A developed picture; clones share it.
#[derive(Clone)]
pub(crate) struct DisplayTexture {
    /// For whoever draws it: 8-bit sRGB levels that are not to be decoded again, opaque.
    pub(crate) view: wgpu::TextureView,
}

impl DisplayTexture {
    /// A texture to develop pictures of this size into.
    pub(crate) fn new(gpu: &Gpu, size: [u32; 2]) -> Self {
        let usage = wgpu::TextureUsages::STORAGE_BINDING
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_SRC;
        let texture = texture(&gpu.device, Some("developed picture"), size, FORMAT, usage);
        Self { view: texture.create_view(&Default::default()) }
    }

    /// Pixels across and down.
    pub(crate) fn size(&self) -> [u32; 2] {
        let texture = self.view.texture();
        [texture.width(), texture.height()]
    }
}
