//! Procedural normal maps: tangent-space slopes of heights that belong to the colours of `textures`.

use glam::{IVec2, Vec2};

use super::textures::{Board, TIMBER, Thread, fibres, texel_by_texel};
use crate::noise::tiling_fbm;
use crate::scene::TextureImage;

/// The normal map of `height(u, v)` in metres over a texture that covers `size` metres and repeats.
fn relief(
    width: u32,
    height: u32,
    size: Vec2,
    surface: impl Fn(Vec2) -> f32 + Sync,
) -> TextureImage {
    let heights = texel_by_texel([width, height], |uv, _| surface(uv));
    let at = |x: u32, y: u32| heights[((y % height) * width + x % width) as usize];
    // Central differences over two texels.
    let scale = 0.5 * Vec2::new(width as f32, height as f32) / size;
    let byte = |x: f32| (127.5 + 127.5 * x).round() as u8;
    let texels = texel_by_texel([width, height], |_, [x, y]| {
        let along = at(x + width - 1, y) - at(x + 1, y);
        let across = at(x, y + height - 1) - at(x, y + 1);
        (Vec2::new(along, across) * scale).extend(1.0).normalize().to_array().map(byte)
    });
    TextureImage { width, height, texels: texels.into() }
}

/// Open pores and raised fibres.
fn grain(uv: Vec2, seed: u32) -> f32 {
    let (fibre, pore) = fibres(uv, seed);
    1.2e-4 * fibre - 2.2e-4 * pore
}

/// Of `textures::timber`.
pub(super) fn timber(size: Vec2) -> TextureImage {
    relief(512, 384, size, |uv| grain(uv, TIMBER))
}

/// Of a floor of boards, whose joints are half a millimetre deep.
fn floor(size: Vec2, board: impl Fn(Vec2) -> Board + Sync) -> TextureImage {
    relief(1024, 1024, size, |uv| {
        let board = board(uv);
        5e-4 * board.top + grain(board.wood, board.seed)
    })
}

/// Of `textures::planks`.
pub(super) fn planks(size: Vec2, rows: u32, boards: u32) -> TextureImage {
    floor(size, |uv| Board::of_planks(uv, rows, boards))
}

/// Of `textures::herringbone`.
pub(super) fn herringbone(size: Vec2) -> TextureImage {
    floor(size, Board::of_herringbone)
}

/// Of `textures::plaster`: traces of the trowel.
pub(super) fn plaster(size: Vec2) -> TextureImage {
    relief(256, 256, size, |uv| {
        8e-3 * tiling_fbm(uv * Vec2::new(9.0, 14.0), IVec2::new(9, 14), 5, 23)
    })
}

/// Of `textures::weave`: round threads that go over and under each other.
pub(super) fn weave(size: Vec2, threads: i32) -> TextureImage {
    relief(256, 256, size, |uv| {
        let thread = Thread::at(uv, threads);
        let along = (std::f32::consts::PI * thread.along).sin();
        let thickness = size.x / threads as f32;
        0.35 * thickness * thread.roundness() * (0.4 + 0.6 * along)
    })
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn a_slope_is_the_normal_it_should_be() {
        // One wave along u over 2 m: at u = 0 it rises by 0.1 pi a metre.
        let image =
            relief(256, 4, Vec2::new(2.0, 1.0), |uv| 0.1 * (std::f32::consts::TAU * uv.x).sin());
        let normal = |x: usize| {
            let [r, g, b, _] = image.texels.rgba()[x];
            Vec3::new(r.into(), g.into(), b.into()) / 127.5 - 1.0
        };
        let expected = Vec3::new(-0.1 * std::f32::consts::PI, 0.0, 1.0).normalize();
        assert!(normal(0).distance(expected) < 0.02, "{}", normal(0));
        assert!(normal(64).distance(Vec3::Z) < 0.02, "{}", normal(64));
    }
}
