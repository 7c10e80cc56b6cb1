//! Pictures from main memory on the device.

use rayon::prelude::*;

use super::passes::stored;
use super::picture::{LinearPicture, OverlayTexture};
use crate::image::Image;
use crate::render::film::{Film, Surface};
use crate::render::gpu::{DeviceFilm, Gpu};

/// Bytes of a pixel's sums, and of its counts.
const PIXEL_BYTES: u64 = 16;

impl LinearPicture {
    /// Whether a picture of this size fits on the device.
    pub(crate) fn fits(gpu: &Gpu, width: u32, height: u32) -> bool {
        most_width(gpu, width, height) >= width
    }

    /// A film's sums; `layers` asks for its layers too, where it has them. A film that does not fit
    /// on the device becomes a smaller picture.
    pub(crate) fn of_film(gpu: &Gpu, film: &Film, layers: bool) -> Self {
        let Film { width, height, .. } = *film;
        if !Self::fits(gpu, width, height) {
            return Self::of_image(gpu, &film.image());
        }
        let pixels = film.pixels();
        let sums: Vec<[f32; 4]> =
            pixels.par_iter().map(|pixel| pixel.sums.map(|sum| sum as f32)).collect();
        let counts: Vec<[u32; 4]> = pixels.par_iter().map(|p| [p.samples(), 0, 0, 0]).collect();
        let surfaces = (layers && film.has_layers()).then(|| {
            let sums = |surface: &Surface| surface.sums().map(|sum| sum as f32);
            let surfaces: Vec<[f32; 8]> = film.surfaces.par_iter().map(sums).collect();
            stored(gpu, &surfaces)
        });
        let (sum, counts) = (stored(gpu, &sums), stored(gpu, &counts));
        Self::fixed(DeviceFilm { sum, counts, surfaces, width, height, scale: 1.0 })
    }

    /// A picture, smaller if it does not fit on the device.
    pub(crate) fn of_image(gpu: &Gpu, image: &Image) -> Self {
        let Image { width, height, .. } = *image;
        let most = most_width(gpu, width, height);
        if most < width {
            return Self::of_image(gpu, &image.shrunk(most));
        }
        let pixels: Vec<[f32; 4]> =
            image.pixels.par_iter().map(|[r, g, b]| [*r, *g, *b, 0.0]).collect();
        let counts = stored(gpu, &vec![[1_u32, 0, 0, 0]; pixels.len()]);
        let sum = stored(gpu, &pixels);
        Self::fixed(DeviceFilm { sum, counts, surfaces: None, width, height, scale: 1.0 })
    }
}

impl OverlayTexture {
    /// An overlay for a picture: colours of an sRGB display, row after row of `width` pixels, `None`
    /// where it has nothing to say.
    pub(crate) fn of_colors(
        gpu: &Gpu,
        colors: &[Option<[u8; 3]>],
        width: u32,
        picture: &LinearPicture,
    ) -> Self {
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
        Self::new(gpu, picture.size(), &texels)
    }
}

/// Most pixels across for a picture of this shape to fit on the device.
fn most_width(gpu: &Gpu, width: u32, height: u32) -> u32 {
    let limits = &gpu.limits;
    let bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    let side = f64::from(limits.max_texture_dimension_2d);
    let (width, height) = (f64::from(width), f64::from(height));
    let pixels = bytes as f64 / PIXEL_BYTES as f64;
    let scale = (side / width).min(side / height).min((pixels / (width * height)).sqrt());
    if scale >= 1.0 { width as u32 } else { (width * scale).max(1.0) as u32 }
}
