//! What something was made of, as a short name: the same content gives the same name.

use std::fmt;

use crate::image::Image;
use crate::scene::{Instances, Scene};

/// A running 64-bit digest; not for secrets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Digest(u64);

impl Digest {
    /// Of nothing.
    pub(crate) fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    /// Takes in eight bytes; the finaliser is MurmurHash3's.
    fn word(&mut self, word: u64) {
        let mut x = (self.0 ^ word).wrapping_mul(0xff51_afd7_ed55_8ccd);
        x = (x ^ (x >> 33)).wrapping_mul(0xc4ce_b9fe_1a85_ec53);
        self.0 = x ^ (x >> 29);
    }

    /// Takes in bytes and their number.
    pub(crate) fn bytes(mut self, bytes: &[u8]) -> Self {
        let (words, rest) = bytes.as_chunks::<8>();
        words.iter().for_each(|word| self.word(u64::from_le_bytes(*word)));
        let mut last = [0; 8];
        last[..rest.len()].copy_from_slice(rest);
        self.word(u64::from_le_bytes(last));
        self.word(bytes.len() as u64);
        self
    }

    /// Takes in all of a scene that a picture depends on. Tangents follow from the rest.
    pub(crate) fn scene(self, scene: &Scene) -> Self {
        let digest = self
            .bytes(bytemuck::cast_slice(&scene.positions))
            .bytes(bytemuck::cast_slice(&scene.normals))
            .bytes(bytemuck::cast_slice(&scene.uvs[0]))
            .bytes(bytemuck::cast_slice(&scene.uvs[1]))
            .bytes(bytemuck::cast_slice(&scene.colors))
            .bytes(bytemuck::cast_slice(scene.triangles.as_flattened()))
            .bytes(bytemuck::cast_slice(&scene.triangle_materials))
            .debug(&scene.materials)
            .debug(&scene.textures)
            .debug(&scene.lights)
            .debug(&scene.medium);
        let digest = digest.instances(&scene.instances);
        let texels = scene.images.iter().map(|image| image.texels.bytes());
        texels.fold(digest, Self::bytes)
    }

    /// Takes in what is shared; nothing if nothing is.
    fn instances(self, instances: &Instances) -> Self {
        if instances.is_empty() {
            return self;
        }
        let meshes = self.debug(&instances.meshes());
        instances.iter().fold(meshes, |digest, instance| digest.debug(instance))
    }

    /// Takes in a map.
    pub(crate) fn map(self, map: &Image) -> Self {
        self.bytes(bytemuck::cast_slice(map.pixels.as_flattened()))
    }

    /// Takes in a built-in scene, as far as code decides it: its numbers as they are, and values of the last bits
    /// of which another processor's sines may differ as [`Self::rounded`].
    pub(crate) fn built_in_scene(self, scene: &Scene) -> Self {
        let Scene { materials, lights, medium, .. } = scene;
        let meshes = scene.instances.meshes();
        let places = scene.instances.iter().map(|instance| instance.placing.affine());
        let texels = scene.images.iter().flat_map(|image| image.texels.bytes());
        self.bytes(bytemuck::cast_slice(scene.triangles.as_flattened()))
            .bytes(bytemuck::cast_slice(&scene.triangle_materials))
            .debug(&(&scene.textures, meshes))
            .bytes(format!("{materials:.3?} {lights:.3?} {medium:.3?}").as_bytes())
            .rounded(scene.positions.iter().flat_map(|position| position.to_array()))
            .rounded(scene.normals.iter().flat_map(|normal| normal.to_array()))
            .rounded(scene.uvs.iter().flatten().flat_map(|uv| uv.to_array()))
            .rounded(places.flat_map(|place| place.to_cols_array()))
            .rounded(texels.map(|byte| f32::from(*byte)))
    }

    /// Takes in a built-in sky as [`Self::built_in_scene`] does a scene.
    pub(crate) fn built_in_map(self, map: &Image) -> Self {
        self.debug(&(map.width, map.height)).rounded(map.pixels.iter().flatten().copied())
    }

    /// Takes in how many values there are, and two sums of them to five digits, one with weights: which is where.
    fn rounded(self, values: impl Iterator<Item = f32>) -> Self {
        let (mut count, mut sum, mut weighted) = (0_u32, 0.0, 0.0);
        for value in values.map(f64::from) {
            sum += value.abs();
            weighted += value * f64::from(count % 31);
            count += 1;
        }
        self.bytes(format!("{count} {sum:.4e} {:.4}", weighted / sum).as_bytes())
    }

    /// The digest as a number.
    pub(crate) fn value(self) -> u64 {
        self.0
    }

    /// Takes in what a value prints.
    pub(crate) fn debug(self, value: &impl fmt::Debug) -> Self {
        self.bytes(format!("{value:?}").as_bytes())
    }
}

impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}
