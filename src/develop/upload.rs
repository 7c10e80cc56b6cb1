//! Pictures from main memory on the device.

use rayon::prelude::*;

use super::{Developer, FORMAT, LinearPicture, OverlayTexture, filled};
use crate::image::Image;
use crate::render::film::{Film, Surface};
use crate::render::gpu::{DeviceFilm, Gpu, texture};

/// Bytes of a pixel's sums, and of its counts.
const PIXEL_BYTES: u64 = 16;

impl Developer {
    /// A film's sums; `layers` asks for its layers too, where it has them. A film that does not fit
    /// on the device becomes a smaller picture.
    pub(crate) fn upload_film(&self, film: &Film, layers: bool) -> LinearPicture {
        if !self.can_show(film.width, film.height) {
            return self.upload_image(&film.image());
        }
        let pixels = film.pixels();
        let sums: Vec<[f32; 4]> =
            pixels.par_iter().map(|pixel| pixel.sums().map(|sum| sum as f32)).collect();
        let counts: Vec<[u32; 4]> = pixels.par_iter().map(|p| [p.samples(), 0, 0, 0]).collect();
        let surfaces = (layers && film.has_layers()).then(|| {
            let sums = |surface: &Surface| surface.sums().map(|sum| sum as f32);
            let surfaces: Vec<[f32; 8]> = film.surfaces().par_iter().map(sums).collect();
            self.buffer(bytemuck::cast_slice(&surfaces))
        });
        LinearPicture::fixed(DeviceFilm {
            sum: self.buffer(bytemuck::cast_slice(&sums)),
            counts: self.buffer(bytemuck::cast_slice(&counts)),
            surfaces,
            width: film.width,
            height: film.height,
            scale: 1.0,
        })
    }

    /// A picture, smaller if it does not fit on the device.
    pub(crate) fn upload_image(&self, image: &Image) -> LinearPicture {
        let most = self.most_width(image.width, image.height);
        if most < image.width {
            return self.upload_image(&image.shrunk(most));
        }
        LinearPicture::fixed(DeviceFilm {
            sum: self.pixels(image),
            counts: self.buffer(bytemuck::cast_slice(&vec![[1_u32, 0, 0, 0]; image.pixels.len()])),
            surfaces: None,
            width: image.width,
            height: image.height,
            scale: 1.0,
        })
    }

    /// An overlay for a picture: colours of an sRGB display, row after row of `width` pixels, `None`
    /// where it has nothing to say.
    pub(crate) fn upload_overlay(
        &self,
        colors: &[Option<[u8; 3]>],
        width: u32,
        picture: &LinearPicture,
    ) -> OverlayTexture {
        let [to_width, to_height] = picture.size();
        let height = colors.len() as u64 / u64::from(width).max(1);
        // A picture that was too large is smaller than its overlay.
        let from = |to: u32, count: u32, all: u64| u64::from(to) * all / u64::from(count);
        let texels: Vec<[u8; 4]> = (0..to_height)
            .into_par_iter()
            .flat_map_iter(|y| {
                let row = from(y, to_height, height) * u64::from(width);
                (0..to_width).map(move |x| {
                    let [r, g, b] = colors[(row + from(x, to_width, width.into())) as usize]?;
                    Some([r, g, b, 255])
                })
            })
            .map(Option::unwrap_or_default)
            .collect();
        overlay(&self.gpu, picture.size(), &texels)
    }

    /// Whether a picture of this size fits on the device.
    pub(crate) fn can_show(&self, width: u32, height: u32) -> bool {
        self.most_width(width, height) >= width
    }

    /// Most pixels across for a picture of this shape to fit on the device.
    fn most_width(&self, width: u32, height: u32) -> u32 {
        let limits = &self.gpu.limits;
        let bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let side = f64::from(limits.max_texture_dimension_2d);
        let (width, height) = (f64::from(width), f64::from(height));
        let pixels = bytes as f64 / PIXEL_BYTES as f64;
        let scale = (side / width).min(side / height).min((pixels / (width * height)).sqrt());
        if scale >= 1.0 { width as u32 } else { (width * scale).max(1.0) as u32 }
    }

    fn pixels(&self, image: &Image) -> wgpu::Buffer {
        let pixels: Vec<[f32; 4]> =
            image.pixels.par_iter().map(|[r, g, b]| [*r, *g, *b, 0.0]).collect();
        self.buffer(bytemuck::cast_slice(&pixels))
    }

    pub(super) fn buffer(&self, bytes: &[u8]) -> wgpu::Buffer {
        filled(&self.gpu, wgpu::BufferUsages::STORAGE, bytes)
    }
}

pub(super) fn overlay(gpu: &Gpu, size: [u32; 2], texels: &[[u8; 4]]) -> OverlayTexture {
    let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
    let texture = texture(&gpu.device, Some("overlay"), size, FORMAT, usage);
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(4 * size[0]),
        rows_per_image: None,
    };
    let (place, texels) = (texture.as_image_copy(), bytemuck::cast_slice(texels));
    gpu.queue.write_texture(place, texels, layout, texture.size());
    OverlayTexture(texture.create_view(&Default::default()))
}
