//! What a measurement belongs to, as a short name: the same content gives the same name.

use std::fmt;
use std::sync::atomic::AtomicBool;

use super::plan::{Frame, Settings};
use crate::environment::Environment;
use crate::error::Result;
use crate::path::World;
use crate::render::{Sampling, Session};
use crate::scene::Camera;

/// A running 64-bit digest; not for secrets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Digest(u64);

impl Digest {
    /// Of nothing.
    pub(super) fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    /// Takes in eight bytes; the finaliser is MurmurHash3's.
    fn word(&mut self, word: u64) {
        let mut x = (self.0 ^ word).wrapping_mul(0xff51_afd7_ed55_8ccd);
        x = (x ^ (x >> 33)).wrapping_mul(0xc4ce_b9fe_1a85_ec53);
        self.0 = x ^ (x >> 29);
    }

    /// Takes in bytes and their number.
    pub(super) fn bytes(mut self, bytes: &[u8]) -> Self {
        let (words, rest) = bytes.as_chunks::<8>();
        words.iter().for_each(|word| self.word(u64::from_le_bytes(*word)));
        let mut last = [0; 8];
        last[..rest.len()].copy_from_slice(rest);
        self.word(u64::from_le_bytes(last));
        self.word(bytes.len() as u64);
        self
    }

    /// Takes in what a value prints.
    pub(super) fn debug(self, value: &impl fmt::Debug) -> Self {
        self.bytes(format!("{value:?}").as_bytes())
    }
}

impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}

/// What a picture converges to: scene, map, camera, size, bounces, and the renderer itself, by a tiny
/// picture that any change of it is likely to change. So a reference of an older renderer is not
/// taken for one of this.
pub(super) fn of_picture(
    world: &World,
    environment: &Environment,
    camera: &Camera,
    frame: &Frame,
) -> Result<Digest> {
    let scene = &world.scene;
    let mut digest = Digest::new()
        .bytes(bytemuck::cast_slice(&scene.positions))
        .bytes(bytemuck::cast_slice(&scene.normals))
        .bytes(bytemuck::cast_slice(&scene.tangents))
        .bytes(bytemuck::cast_slice(&scene.uvs[0]))
        .bytes(bytemuck::cast_slice(&scene.uvs[1]))
        .bytes(bytemuck::cast_slice(&scene.colors))
        .bytes(bytemuck::cast_slice(scene.triangles.as_flattened()))
        .bytes(bytemuck::cast_slice(&scene.triangle_materials))
        .debug(&scene.materials)
        .debug(&scene.textures)
        .debug(&scene.lights)
        .debug(&scene.medium)
        .debug(camera)
        .debug(frame);
    for image in &scene.images {
        digest = digest.bytes(image.texels.as_flattened());
    }
    digest = digest.bytes(bytemuck::cast_slice(environment.map().pixels.as_flattened()));
    let size = PROBE_SIZE;
    let settings = Settings::of(Sampling::Plain);
    let view = settings.view(camera, &Frame { size, ..frame.clone() }, 0);
    let mut session = Session::new(world, environment, view);
    session.advance(PROBE_SAMPLES, &AtomicBool::new(false))?;
    session.settle()?;
    let probe = session.film().image();
    Ok(digest.bytes(bytemuck::cast_slice(probe.pixels.as_flattened())))
}

const PROBE_SIZE: (u32, u32) = (48, 27);
const PROBE_SAMPLES: u32 = 4;
