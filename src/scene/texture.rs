//! Reading textures: wrap modes, filtering, colour decoding.

use std::array;
use std::sync::LazyLock;

use glam::{Vec2, Vec4};

use super::{Scene, TextureImage, TextureRef, Wrap};
use crate::color::linear_from_srgb;

static LINEAR_FROM_SRGB_BYTE: LazyLock<[f32; 256]> =
    LazyLock::new(|| array::from_fn(|i| linear_from_srgb(i as f32 / 255.0)));

/// The linear RGBA value of a texture at mesh coordinates `uv` (of the reference's set).
///
/// Texel centres lie at half-integers; colours are decoded before they are filtered. Coordinates
/// that are not finite read as 0, an image without texels as white. Indices are valid in any scene
/// that was loaded.
pub fn sample_texture(scene: &Scene, texture_ref: &TextureRef, uv: Vec2) -> Vec4 {
    let texture = &scene.textures[texture_ref.texture as usize];
    let image = &scene.images[texture.image as usize];
    if image.texels.is_empty() {
        return Vec4::ONE;
    }
    let uv = texture_ref.transform.transform_point2(uv);
    let x = Axis { size: image.width, wrap: texture.wrap_u }.footprint(uv.x);
    let y = Axis { size: image.height, wrap: texture.wrap_v }.footprint(uv.y);
    let read = |x, y| texel(image, texture.srgb, x, y);
    if texture.nearest {
        return read(x.nearest, y.nearest);
    }
    let top = read(x.low, y.low).lerp(read(x.high, y.low), x.fraction);
    let bottom = read(x.low, y.high).lerp(read(x.high, y.high), x.fraction);
    top.lerp(bottom, y.fraction)
}

fn texel(image: &TextureImage, srgb: bool, x: u32, y: u32) -> Vec4 {
    let [r, g, b, a] = image.texels[y as usize * image.width as usize + x as usize];
    let unit = |byte: u8| f32::from(byte) / 255.0;
    if srgb {
        let linear = |byte: u8| LINEAR_FROM_SRGB_BYTE[usize::from(byte)];
        Vec4::new(linear(r), linear(g), linear(b), unit(a))
    } else {
        Vec4::new(unit(r), unit(g), unit(b), unit(a))
    }
}

/// One axis of an image.
#[derive(Clone, Copy)]
struct Axis {
    size: u32,
    wrap: Wrap,
}

/// The texels along one axis that a coordinate reads.
struct Footprint {
    low: u32,
    high: u32,
    /// Weight of `high`.
    fraction: f32,
    nearest: u32,
}

impl Axis {
    fn footprint(self, t: f32) -> Footprint {
        let last = self.size - 1;
        let position = self.into_unit(t) * self.size as f32;
        let floor = (position - 0.5).floor();
        Footprint {
            low: self.neighbour(floor as i64),
            high: self.neighbour(floor as i64 + 1),
            fraction: position - 0.5 - floor,
            nearest: (position as u32).min(last),
        }
    }

    /// Into `[0,1]` by the wrap mode.
    fn into_unit(self, t: f32) -> f32 {
        if !t.is_finite() {
            return 0.0;
        }
        match self.wrap {
            Wrap::Repeat => t - t.floor(),
            Wrap::MirroredRepeat => {
                let half = 0.5 * t;
                1.0 - (2.0 * (half - half.floor()) - 1.0).abs()
            }
            Wrap::ClampToEdge => t.clamp(0.0, 1.0),
        }
    }

    /// The texel an index just outside of the image stands for: tiled, or the edge (which is its own
    /// mirror image).
    fn neighbour(self, index: i64) -> u32 {
        let size = i64::from(self.size);
        let wrapped = match self.wrap {
            Wrap::Repeat => index.rem_euclid(size),
            Wrap::MirroredRepeat | Wrap::ClampToEdge => index.clamp(0, size - 1),
        };
        wrapped as u32
    }
}
