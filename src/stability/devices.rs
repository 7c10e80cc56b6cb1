//! Devices: compared with each other and with f64, lost, and with too little memory.

use std::sync::atomic::AtomicBool;

use glam::Vec3;

use super::case::{Entry, On, Setting};
use super::maps::sun;
use super::outcome::Outcome;
use super::reference::FloorReference;
use super::scenes::{
    FIRST_TEXTURE, glass, lambert, light, luminances, mean, render, room, sky, view, with_texel,
};
use crate::error::{Error, Result};
use crate::path::WorldBuilder;
use crate::render::gpu::{Gpu, UploadedScene};
use crate::render::{Sampling, Session, View};
use crate::scene::{Camera, Material, TextureSlot};

pub(super) const CASES: &[Entry] = &[
    ("f32-against-f64", On::Any, against_f64),
    ("gpu-against-cpu", On::Gpu, |s| against_cpu(s, room(0.7, 1.0, Vec3::ZERO))),
    ("gpu-against-cpu-glass", On::Gpu, |s| against_cpu(s, glasses())),
    ("gpu-against-cpu-textured", On::Gpu, |s| against_cpu(s, textured())),
    ("device-lost", On::Gpu, device_lost),
    ("out-of-gpu-memory", On::Gpu, out_of_gpu_memory),
];

/// Differences of pixels, relative to the pixel plus a thousandth of the picture's mean.
struct Deviations {
    worst: f64,
    mean: f64,
    /// Share of pixels that are more than 0.2 % apart.
    apart: f64,
}

impl Deviations {
    fn of(found: impl Iterator<Item = f64>, expected: &[f64]) -> Self {
        let count = expected.len() as f64;
        let floor = 1e-3 * expected.iter().sum::<f64>() / count;
        let all: Vec<f64> = found.zip(expected).map(|(a, b)| (a - b).abs() / (b + floor)).collect();
        Self {
            worst: all.iter().copied().fold(0.0, f64::max),
            mean: all.iter().sum::<f64>() / count,
            apart: all.iter().filter(|d| **d > 2e-3).count() as f64 / count,
        }
    }
}

/// One sample per pixel, so that errors do not average out, and then many.
fn against_f64(setting: &Setting) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    for (name, environment) in [("day", sky("day")?), ("sun of 1e5", light(sun(96, 48, 1e5))?)] {
        let world = WorldBuilder::default().floor(&lambert(0.5), Vec3::ZERO, 1e4).build();
        let reference = FloorReference::new(&environment, 0.5);
        let reference = reference.ok_or_else(|| Error::new("the sky is black"))?;
        for (side, samples) in [(setting.count(96, 512), 1), (16, setting.count(256, 4096))] {
            // Directed down so that no pixel sees the floor's edge.
            let camera = Camera::look_at(Vec3::new(0.3, 1.0, 0.2), Vec3::new(0.0, 0.0, -0.5), 0.6);
            let view = View { width: side, height: side, ..view(camera, Sampling::Plain, 1) };
            let film = render(setting, (&world, &environment), view.clone(), samples)?;
            let found = Deviations::of(luminances(&film), &reference.picture(&view, samples));
            let what = format!("{name}, {samples} a pixel");
            // The density is discontinuous at texel edges: the few samples that rounding moves across an edge are
            // off by per cents.
            outcome = outcome
                .sound(&film)
                .at_most(format!("{what}: mean deviation from f64"), found.mean, 1e-3)
                .at_most(format!("{what}: pixels off by 0.2 %"), found.apart, 0.02)
                .info(format!("{what}: worst deviation from f64"), found.worst);
        }
    }
    Ok(outcome)
}

/// The same seed gives the same paths except for rounding, and the same expectation.
fn against_cpu(setting: &Setting, (builder, camera): (WorldBuilder, Camera)) -> Result<Outcome> {
    let (world, environment) = (builder.build(), sky("day")?);
    let view = View { width: 32, height: 32, ..view(camera, Sampling::Plain, 3) };
    let lit = (&world, &environment);
    let samples = setting.count(16, 256);
    let cpu = render(&Setting { gpu: None, ..*setting }, lit, view.clone(), samples)?;
    let gpu = render(setting, lit, view, samples)?;
    let expected: Vec<f64> = luminances(&cpu).collect();
    let found = Deviations::of(luminances(&gpu), &expected);
    let ratio = mean(&gpu).luminance / mean(&cpu).luminance;
    Ok(Outcome::default()
        .sound(&gpu)
        // Paths that rounding moves to another triangle, texel or side of a lobe.
        .at_most("share of pixels off by 0.2 %", found.apart, 0.05)
        .at_most("mean of the picture off, relative", (ratio - 1.0).abs(), 5e-3)
        .info("mean deviation of a pixel", found.mean)
        .info("worst deviation of a pixel", found.worst))
}

/// A lost device keeps the film, and the CPU continues. The case opens a device of its own, so that others are not
/// affected.
fn device_lost(setting: &Setting) -> Result<Outcome> {
    let Some(known) = &setting.gpu else { return Ok(Outcome::skipped("needs --device gpu")) };
    let gpu = Gpu::open(Some(&known.facts().name))?;
    let (builder, camera) = room(0.7, 1.0, Vec3::ZERO);
    let (world, environment) = (builder.build(), sky("day")?);
    let never = AtomicBool::new(false);
    let on_gpu = UploadedScene::new(&gpu, &world, &environment)?;
    let view = view(camera, Sampling::Plain, 2);
    let mut session = Session::on((&world, &environment), view, Some(&on_gpu))?;
    session.advance(4, &never)?;
    let before = session.film().clone();
    gpu.lose();
    let failure = session.advance(2, &never).err().map(|e| e.to_string()).unwrap_or_default();
    let kept = *session.film() == before;
    session.continue_on_cpu();
    session.advance(4, &never)?;
    let named = failure.contains(&gpu.facts().name) && !failure.contains('\n');
    let yes = |condition: bool| f64::from(u8::from(condition));
    let goes_on = session.samples() == 8 && mean(session.film()).luminance > 0.0;
    Ok(Outcome::default()
        .sound(session.film())
        .at_least("the loss is one sentence with the device's name", yes(named), 1.0)
        .at_least("what was rendered is kept", yes(kept), 1.0)
        .at_least("the CPU goes on", yes(goes_on), 1.0))
}

/// A picture too large for the device's memory is refused with the sizes; a small one still works.
fn out_of_gpu_memory(setting: &Setting) -> Result<Outcome> {
    let Some(gpu) = &setting.gpu else { return Ok(Outcome::skipped("needs --device gpu")) };
    let allowed = gpu.facts().storage_binding_bytes.min(gpu.facts().buffer_bytes);
    // 16 bytes of a pixel in each of its buffers on the device, 48 in the film.
    let side = ((allowed / 16 + 1) as f64).sqrt().ceil() as u32 + 1;
    if side > 8192 {
        let gibibytes = allowed >> 30;
        return Ok(Outcome::skipped(format!(
            "the device takes {gibibytes} GiB in one piece: the film in main memory would not fit first"
        )));
    }
    let world = WorldBuilder::default().floor(&lambert(0.5), Vec3::ZERO, 1.0).build();
    let environment = sky("day")?;
    let uploaded = UploadedScene::new(gpu, &world, &environment)?;
    let small = view(Camera::look_at(Vec3::ONE, Vec3::ZERO, 0.5), Sampling::Plain, 1);
    let large = View { width: side, height: side, ..small.clone() };
    let refusal = Session::on((&world, &environment), large, Some(&uploaded)).err();
    let refusal = refusal.map(|e| e.to_string()).unwrap_or_default();
    let clear = refusal.contains("MiB") && !refusal.contains('\n');
    let mut session = Session::on((&world, &environment), small, Some(&uploaded))?;
    session.advance(1, &AtomicBool::new(false))?;
    Ok(Outcome::default()
        .at_least("refused with the numbers", f64::from(u8::from(clear)), 1.0)
        .at_least("a small picture afterwards", mean(session.film()).luminance, 1e-3)
        .remark(refusal))
}

/// Spheres of smooth and rough glass on the room's floor.
fn glasses() -> (WorldBuilder, Camera) {
    let (builder, camera) = room(0.7, 1.0, Vec3::ZERO);
    let smoked = Material {
        attenuation_color: Vec3::new(0.9, 0.5, 0.2),
        attenuation_distance: 0.5,
        ..glass(1.5, 0.0)
    };
    let builder = builder.sphere(&smoked, Vec3::new(0.2, 0.5, 0.3), 0.4);
    (builder.sphere(&glass(1.5, 0.3), Vec3::new(-0.3, 0.4, 0.9), 0.3), camera)
}

/// A floor with a normal map beside the room's block.
fn textured() -> (WorldBuilder, Camera) {
    let mapped = Material { metallic: 0.5, roughness: 0.4, ..lambert(0.8) }
        .with_texture(TextureSlot::Normal, FIRST_TEXTURE);
    let builder =
        with_texel(WorldBuilder::default().floor(&mapped, Vec3::ZERO, 4.0), [170, 110, 220, 255]);
    (builder, Camera::look_at(Vec3::new(0.5, 1.5, 1.5), Vec3::ZERO, 0.8))
}
