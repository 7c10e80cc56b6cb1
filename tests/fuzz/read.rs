//! Reads input as the program does, and judges what comes of it.

use std::path::Path;

use lightgrid::image::ldr::decode_ldr;
use lightgrid::image::read_map;
use lightgrid::scene::Scene;

/// What an input turned out to be.
pub(crate) enum Found {
    /// Understood; it delivers this many bytes, and whether they are sound.
    Accepted { honest_bytes: u64, is_sound: bool },
    /// Refused with this sentence.
    Refused(String),
}

/// A file as a map.
pub(crate) fn map(path: &Path) -> Found {
    match read_map(path) {
        Ok(map) => {
            let pixels = &map.image.pixels;
            Found::Accepted {
                honest_bytes: pixels.len() as u64 * 12,
                is_sound: pixels.as_flattened().iter().all(|v| v.is_finite() && *v >= 0.0),
            }
        }
        Err(error) => Found::Refused(error.to_string()),
    }
}

/// A texture.
pub(crate) fn texture(bytes: &[u8], name: &str) -> Found {
    match decode_ldr(bytes, name) {
        Ok(image) => Found::Accepted {
            honest_bytes: image.pixels.bytes().len() as u64,
            is_sound: image.pixels.len() == image.width as usize * image.height as usize,
        },
        Err(error) => Found::Refused(error.to_string()),
    }
}

/// A scene that was loaded: every number is finite and refers to what is there.
pub(crate) fn scene(scene: &Scene) -> Found {
    let texels: usize = scene.images.iter().map(|image| image.texels.bytes().len()).sum();
    let (vertices, triangles) = (scene.positions.len(), scene.triangles.len());
    let is_full = |count: usize| count == 0 || count == vertices;
    let counts = [scene.normals.len(), scene.tangents.len(), scene.colors.len()];
    let uvs = scene.uvs.iter().map(Vec::len);
    let numbers = scene.positions.iter().all(|p| p.is_finite())
        && scene.normals.iter().all(|n| n.is_finite())
        && scene.tangents.iter().all(|t| t.is_finite())
        && scene.colors.iter().all(|c| c.is_finite())
        && scene.uvs.iter().flatten().all(|uv| uv.is_finite())
        && scene.cameras.iter().all(|camera| camera.world_from_camera.is_finite())
        && scene.medium.is_none_or(|medium| medium.is_sound());
    let references = scene.triangles.as_flattened().iter().all(|&v| (v as usize) < vertices)
        && scene.triangle_materials.len() == triangles
        && scene.triangle_materials.iter().all(|&m| (m as usize) < scene.materials.len())
        && scene.textures.iter().all(|texture| (texture.image as usize) < scene.images.len());
    // Triangles were read that are not there, for they coincide with others: at least one for three vertices.
    let read = triangles.max(vertices / 3);
    Found::Accepted {
        honest_bytes: (vertices * 64 + read * 128 + texels) as u64,
        is_sound: numbers && references && counts.into_iter().chain(uvs).all(is_full),
    }
}
