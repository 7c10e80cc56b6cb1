//! Digests that name measurements: equal only for the same picture by the same renderer.

use std::sync::atomic::AtomicBool;

use super::plan::{Frame, Settings};
use crate::digest::Digest;
use crate::error::Result;
use crate::path::Lit;
use crate::render::{Sampling, Session};
use crate::scene::Camera;

/// Digest of all that a picture converges to: scene, map, camera, size and bounces. A tiny rendered picture
/// is part of it, which nearly any change of the renderer changes: references of an older renderer are
/// therefore not reused.
pub(super) fn of_picture(lit: Lit<'_>, camera: &Camera, frame: &Frame) -> Result<Digest> {
    let (world, environment) = lit;
    let digest =
        Digest::new().scene(&world.scene).debug(camera).debug(frame).map(environment.map());
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
