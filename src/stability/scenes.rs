//! Small scenes with known results, and pictures of them on the device under test.

use std::sync::atomic::AtomicBool;

use glam::{Affine2, Vec2, Vec3};

use super::case::Setting;
use super::outcome::Outcome;
use crate::environment::{Environment, EnvironmentOptions};
use crate::error::Result;
use crate::image::Image;
use crate::path::{Lit, PathLimits, WorldBuilder};
use crate::render::film::{Film, Pixel};
use crate::render::filter::PixelFilter;
use crate::render::gpu::UploadedScene;
use crate::render::{Driver, Sampling, Session, StopRule, View};
use crate::scene::{Camera, Material, Texture, TextureImage, TextureRef, Wrap};

/// [`Material::lambert`].
pub(super) fn lambert(albedo: f32) -> Material {
    Material::lambert(albedo)
}

/// Clear solid glass.
pub(super) fn glass(ior: f32, roughness: f32) -> Material {
    Material { transmission: 1.0, thickness: 1.0, specular: 1.0, ior, roughness, ..lambert(1.0) }
}

/// Gives all surfaces tangents and texture coordinates along X, and a texture of one texel.
pub(super) fn with_texel(mut builder: WorldBuilder, texel: [u8; 4]) -> WorldBuilder {
    let scene = &mut builder.scene;
    let count = scene.positions.len();
    scene.uvs[0] = scene.positions.iter().map(|p| Vec2::new(p.x, -p.z)).collect();
    scene.normals = vec![Vec3::Y; count];
    scene.tangents = vec![Vec3::X.extend(1.0); count];
    scene.images.push(TextureImage { width: 1, height: 1, texels: vec![texel].into() });
    let wrap = Wrap::Repeat;
    let texture = Texture { image: 0, wrap_u: wrap, wrap_v: wrap, nearest: true, srgb: false };
    scene.textures.push(texture);
    builder
}

/// Texture 0 at the first texture coordinates.
pub(super) const FIRST_TEXTURE: TextureRef =
    TextureRef { texture: 0, uv_set: 0, transform: Affine2::IDENTITY };

/// A room of 4 x 2.5 x 3 units, `scale` metres each, around `center`, with a window in its +X wall
/// and a block on the floor; a camera that looks at the block.
pub(super) fn room(albedo: f32, scale: f32, center: Vec3) -> (WorldBuilder, Camera) {
    let at = |x: f32, y: f32, z: f32| center + Vec3::new(x, y, z) * scale;
    let walls = lambert(albedo);
    let (low, high) = (at(-2.0, 0.0, -1.5), at(2.0, 2.5, 1.5));
    let mut builder = WorldBuilder::default().faces(&walls, low, high, 1..6);
    for (y, z) in [
        ([0.0, 0.75], [-1.5, 1.5]),
        ([2.25, 2.5], [-1.5, 1.5]),
        ([0.75, 2.25], [-1.5, -1.0]),
        ([0.75, 2.25], [1.0, 1.5]),
    ] {
        let (corner, top, side) = (at(2.0, y[0], z[0]), at(2.0, y[1], z[0]), at(2.0, y[0], z[1]));
        builder = builder.quad(&walls, corner, top - corner, side - corner);
    }
    let block = lambert(0.5 * albedo);
    let builder =
        builder.faces(&block, at(-1.25, 0.0, -0.75), at(-0.5, 1.0, 0.25), [0, 1, 2, 4, 5]);
    (builder, Camera::look_at(at(1.75, 1.5, 1.25), at(-1.0, 0.75, -0.5), 1.0))
}

/// The room without its window.
pub(super) fn sealed(scale: f32) -> (WorldBuilder, Camera) {
    let (builder, camera) = room(0.8, scale, Vec3::ZERO);
    let low = Vec3::new(-2.0, 0.0, -1.5) * scale;
    let high = Vec3::new(2.0, 2.5, 1.5) * scale;
    (builder.faces(&lambert(0.8), low, high, [0]), camera)
}

/// A map of one radiance.
pub(super) fn constant(radiance: f32) -> Result<Environment> {
    light(Image::filled(16, 8, [radiance; 3]))
}

/// A map with default options.
pub(super) fn light(map: Image) -> Result<Environment> {
    Environment::new(map, &EnvironmentOptions::default())
}

/// A small built-in sky.
pub(super) fn sky(name: &str) -> Result<Environment> {
    light(crate::environment::sky::build(name, 128, 64)?)
}

/// A small picture without Russian roulette.
pub(super) fn view(camera: Camera, sampling: Sampling, bounces: u32) -> View {
    View {
        filter: PixelFilter::Box,
        sampling,
        limits: PathLimits { bounces, russian_roulette: false },
        seed: 1,
        learning_paths: 1 << 13,
        ..View::new(camera, [16, 16])
    }
}

/// A session on the device under test, before its learning.
pub(super) fn session<'a>(setting: &Setting, lit: Lit<'a>, view: View) -> Result<Session<'a>> {
    let upload = |gpu| UploadedScene::new(gpu, lit.0, lit.1);
    Session::on(lit, view, setting.gpu.as_ref().map(upload).transpose()?.as_ref())
}

/// A session that has done its learning.
pub(super) fn learned<'a>(setting: &Setting, lit: Lit<'a>, view: View) -> Result<Session<'a>> {
    let mut driver = Driver::new(session(setting, lit, view)?, StopRule::default());
    driver.learn(&AtomicBool::new(false))?;
    Ok(driver.session)
}

/// Learns if the view asks for it, then renders.
pub(super) fn render(setting: &Setting, lit: Lit<'_>, view: View, samples: u32) -> Result<Film> {
    let mut session = learned(setting, lit, view)?;
    session.advance(samples, &AtomicBool::new(false))?;
    session.settle()?;
    Ok(session.film().clone())
}

/// Luminances of a film's pixels.
pub(super) fn luminances(film: &Film) -> impl Iterator<Item = f64> {
    film.pixels().iter().map(Pixel::mean_luminance)
}

/// Mean luminance of a picture and its standard error from the samples' own spread.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mean {
    pub(super) luminance: f64,
    pub(super) error: f64,
}

pub(super) fn mean(film: &Film) -> Mean {
    let count = film.pixels().len() as f64;
    let average = |f: fn(&Pixel) -> f64| film.pixels().iter().map(f).sum::<f64>() / count;
    Mean {
        luminance: average(Pixel::mean_luminance),
        error: (average(Pixel::variance_of_mean) / count).sqrt(),
    }
}

/// Distance of a mean from its expected value, in standard errors; `rounding` is an additional relative error of
/// the expected value.
pub(super) fn deviation(found: Mean, expected: f64, rounding: f64) -> f64 {
    let off = (found.luminance - expected).abs();
    let error = found.error.hypot(rounding * expected.abs());
    if off == 0.0 { 0.0 } else { off / error }
}

/// Difference of two means, in joint standard errors.
pub(super) fn difference(a: Mean, b: Mean) -> f64 {
    deviation(Mean { error: a.error.hypot(b.error), ..b }, a.luminance, ROUNDING)
}

/// Relative rounding error of a mean: ray origins are moved by 2^-16.
pub(super) const ROUNDING: f64 = 1e-4;

/// Limit of errors in standard errors: a correct estimate exceeds it once in 150,000 cases.
pub(super) const SIGMAS: f64 = 4.5;

impl Outcome {
    /// Adds the number of samples and pixels of a film that are NaN or infinite, with limit 0.
    pub(super) fn sound(self, film: &Film) -> Self {
        let odd = film.pixels().iter().filter(|p| !p.mean().iter().all(|c| c.is_finite())).count();
        let invalid = film.invalid_samples() as f64 + odd as f64;
        self.at_most("samples and pixels that are NaN or infinite", invalid, 0.0)
    }
}
