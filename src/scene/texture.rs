//! Reading textures: wrap modes, filtering, colour decoding.

use std::array;
use std::sync::LazyLock;

use glam::{Vec2, Vec3, Vec4};

use super::{Scene, TextureRef, Wrap};
use crate::color::linear_from_srgb;

static LINEAR_FROM_SRGB_BYTE: LazyLock<[f32; 256]> =
    LazyLock::new(|| UNIT_FROM_BYTE.map(linear_from_srgb));

static UNIT_FROM_BYTE: LazyLock<[f32; 256]> =
    LazyLock::new(|| array::from_fn(|byte| byte as f32 / 255.0));

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
    let x = texture.wrap_u.footprint(uv.x, image.width);
    let y = texture.wrap_v.footprint(uv.y, image.height);
    let unit = &*UNIT_FROM_BYTE;
    let color = if texture.srgb { &*LINEAR_FROM_SRGB_BYTE } else { unit };
    let (color, unit) = (|byte| color[usize::from(byte)], |byte| unit[usize::from(byte)]);
    let texels = &image.texels;
    let filter = Filter { x, y, width: image.width, nearest: texture.nearest };
    match texels.channels() {
        _ if texels.is_deep() => {
            filter.filtered(|at| deep_value(texels.deep_rgba(at), texture.srgb))
        }
        1 => filter.read(texels.chunks(), |[l]| Vec3::splat(color(l)).extend(1.0)),
        2 => filter.read(texels.chunks(), |[l, a]| Vec3::splat(color(l)).extend(unit(a))),
        3 => filter.read(texels.chunks(), |[r, g, b]| Vec4::new(color(r), color(g), color(b), 1.0)),
        _ => filter
            .read(texels.chunks(), |[r, g, b, a]| Vec4::new(color(r), color(g), color(b), unit(a))),
    }
}

/// The value of a texel of 16 bits a channel.
fn deep_value(texel: [u16; 4], srgb: bool) -> Vec4 {
    let value = Vec4::from(texel.map(f32::from)) / f32::from(u16::MAX);
    if srgb { value.truncate().map(linear_from_srgb).extend(value.w) } else { value }
}

/// Which texels of an image count how much.
struct Filter {
    x: Footprint,
    y: Footprint,
    width: u32,
    nearest: bool,
}

impl Filter {
    #[inline]
    fn read<T: Copy>(&self, texels: &[T], value: impl Fn(T) -> Vec4) -> Vec4 {
        self.filtered(|at| value(texels[at]))
    }

    /// Of the values of texels by their index.
    #[inline]
    fn filtered(&self, value: impl Fn(usize) -> Vec4) -> Vec4 {
        let read = |x, y| value(y as usize * self.width as usize + x as usize);
        let (x, y) = (&self.x, &self.y);
        if self.nearest {
            return read(x.nearest, y.nearest);
        }
        let top = read(x.low, y.low).lerp(read(x.high, y.low), x.fraction);
        let bottom = read(x.low, y.high).lerp(read(x.high, y.high), x.fraction);
        top.lerp(bottom, y.fraction)
    }
}

/// The texels along one axis that a coordinate reads.
struct Footprint {
    low: u32,
    high: u32,
    /// Weight of `high`.
    fraction: f32,
    nearest: u32,
}

impl Wrap {
    /// Along an axis of `size` texels.
    fn footprint(self, t: f32, size: u32) -> Footprint {
        let position = self.into_unit(t) * size as f32;
        let floor = floor(position - 0.5);
        let [low, high] = [0, 1].map(|next| self.neighbour(floor as i32 + next, size - 1));
        let nearest = (position as u32).min(size - 1);
        Footprint { low, high, fraction: position - 0.5 - floor, nearest }
    }

    /// Into `[0,1]` by the wrap mode.
    fn into_unit(self, t: f32) -> f32 {
        if !t.is_finite() {
            return 0.0;
        }
        match self {
            Self::Repeat => t - floor(t),
            Self::MirroredRepeat => {
                let half = 0.5 * t;
                1.0 - (2.0 * (half - floor(half)) - 1.0).abs()
            }
            Self::ClampToEdge => t.clamp(0.0, 1.0),
        }
    }

    /// The texel that an index from -1 to one after the last texel stands for: tiled, or the edge (which is its own
    /// mirror image).
    fn neighbour(self, index: i32, last: u32) -> u32 {
        let [before, after] = match self {
            Self::Repeat => [last, 0],
            Self::MirroredRepeat | Self::ClampToEdge => [0, last],
        };
        match u32::try_from(index) {
            Err(_) => before,
            Ok(index) if index > last => after,
            Ok(index) => index,
        }
    }
}

/// The largest whole number that is not above a finite `x`, without the call that the standard
/// library's makes where a machine need not have the instruction.
fn floor(x: f32) -> f32 {
    const WHOLE: f32 = (1 << 23) as f32;
    if x.abs() >= WHOLE {
        return x;
    }
    let toward_zero = x as i32 as f32;
    toward_zero - f32::from(toward_zero > x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floor_is_the_standard_librarys() {
        for bits in (0..=u32::MAX).step_by(997) {
            let x = f32::from_bits(bits);
            assert!(!x.is_finite() || floor(x) == x.floor(), "{x}");
        }
    }
}
