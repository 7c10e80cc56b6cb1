//! Materials and paths: in uniform light of radiance 1 (a furnace) no picture is brighter than 1, and every value
//! is finite.

use glam::Vec3;

use super::case::{Entry, On, Setting};
use super::outcome::Outcome;
use super::scenes::{
    FIRST_TEXTURE, Mean, SIGMAS, constant, deviation, glass, lambert, mean, render, room, view,
    with_texel,
};
use crate::error::Result;
use crate::path::{World, WorldBuilder};
use crate::render::film::Film;
use crate::render::{Sampling, View};
use crate::sampler::SplitMix;
use crate::scene::{Camera, Material, Medium, TextureSlot};

pub(super) const CASES: &[Entry] = &[
    ("roughness-0-to-1e-4", On::Any, nearly_smooth),
    ("ior-1-and-3", On::Any, indices),
    ("white-room-1000-bounces", On::Any, white_room),
    ("normals-under-the-surface", On::Any, buried_normals),
    ("near-grazing", On::Any, grazing),
    ("nested-glass", On::Any, nested),
    ("optical-depths", On::Any, optical_depths),
    ("media-of-all-depths", On::Any, media),
    ("random-materials", On::Any, random_materials),
    ("overflow-is-counted", On::Any, overflow),
];

/// Maximum energy gain by tabulated albedos, as in the BSDF's own tests.
const TABLE_ERROR: f64 = 4e-3;

/// White metal.
fn metal(roughness: f32) -> Material {
    Material { metallic: 1.0, specular: 1.0, roughness, ..lambert(1.0) }
}

/// White plastic.
fn plastic(roughness: f32) -> Material {
    Material { specular: 1.0, roughness, ..lambert(1.0) }
}

/// A thin pane.
fn pane(roughness: f32) -> Material {
    Material { thickness: 0.0, ..glass(1.5, roughness) }
}

/// A ball of one metre and a camera that it fills.
fn ball(material: &Material) -> (World, Camera) {
    let world = WorldBuilder::default().sphere(material, Vec3::ZERO, 1.0).build();
    (world, Camera::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO, 0.4))
}

/// A picture of a scene in uniform light of radiance 1.
fn furnace(setting: &Setting, (world, camera): (World, Camera), bounces: u32) -> Result<Film> {
    let view = View { width: 12, height: 12, ..view(camera, Sampling::Plain, bounces) };
    render(setting, (&world, &constant(1.0)?), view, setting.count(32, 512))
}

/// The brightest and the darkest of several furnaces, beyond their noise.
struct Furnaces {
    outcome: Outcome,
    brightest: f64,
    darkest: f64,
}

impl Furnaces {
    fn new() -> Self {
        Self { outcome: Outcome::default(), brightest: 0.0, darkest: f64::INFINITY }
    }

    fn add(&mut self, film: &Film) {
        self.outcome = std::mem::take(&mut self.outcome).sound(film);
        let Mean { luminance, error } = mean(film);
        self.brightest = self.brightest.max(luminance - SIGMAS * error);
        self.darkest = self.darkest.min(luminance + SIGMAS * error);
    }

    fn judged(self, what: &str) -> Outcome {
        let what = format!("{what}: brightest in light of 1");
        self.outcome.at_most(what, self.brightest, 1.0 + TABLE_ERROR)
    }
}

/// Nearly perfect mirrors, whose densities reach 1e16.
fn nearly_smooth(setting: &Setting) -> Result<Outcome> {
    let all = [0.0, 1e-6, 1e-5, 1e-4, 1e-3, 0.031, 0.032, 0.04];
    // Software Vulkan takes seconds to compile a kernel for each kind of material.
    let values = if setting.gpu.is_some() { &all[..1] } else { &all[..] };
    let mut furnaces = Furnaces::new();
    for roughness in values.iter().chain(&[1e-4]) {
        for material in
            [metal(*roughness), plastic(*roughness), glass(1.5, *roughness), pane(*roughness)]
        {
            furnaces.add(&furnace(setting, ball(&material), 64)?);
        }
    }
    let darkest = furnaces.darkest;
    Ok(furnaces.judged("roughness").at_least("darkest of what loses nothing", darkest, 0.99))
}

fn indices(setting: &Setting) -> Result<Outcome> {
    let mut furnaces = Furnaces::new();
    let mut invisible: f64 = 0.0;
    for ior in [1.0, 1.0001, 3.0] {
        for roughness in [0.0, 0.4] {
            let film = furnace(setting, ball(&glass(ior, roughness)), 200)?;
            if ior == 1.0 {
                invisible = invisible.max(deviation(mean(&film), 1.0, 1e-5));
            }
            furnaces.add(&film);
        }
        furnaces.add(&furnace(setting, ball(&Material { ior, ..plastic(0.3) }), 64)?);
    }
    furnaces.add(&furnace(setting, ball(&Material { ior: 0.0, ..plastic(0.3) }), 64)?);
    Ok(furnaces.judged("index").at_most("index 1 is visible: standard errors", invisible, SIGMAS))
}

/// A white room: every path finally leaves through the window.
fn white_room(setting: &Setting) -> Result<Outcome> {
    let (builder, camera) = room(1.0, 1.0, Vec3::ZERO);
    let (world, view) = (builder.build(), view(camera, Sampling::Plain, 1000));
    // The block has half the walls' albedo: make it white.
    let mut scene = world.scene;
    scene.materials.iter_mut().for_each(|m| m.base_color = Vec3::ONE.extend(1.0));
    let film =
        render(setting, (&World::new(scene), &constant(1.0)?), view, setting.count(32, 512))?;
    let found = mean(&film);
    Ok(Outcome::default()
        .sound(&film)
        .at_most("off 1: standard errors", deviation(found, 1.0, 1e-3), SIGMAS)
        .at_most("noise", found.error, 0.02))
}

/// Normal maps whose normals lie in the surface, under it, or are zero.
fn buried_normals(setting: &Setting) -> Result<Outcome> {
    let mut furnaces = Furnaces::new();
    for [x, y, z] in [[255, 128, 0], [128, 128, 0], [0, 0, 0], [128, 128, 128], [255, 255, 128]] {
        for base in [lambert(1.0), metal(0.0), metal(0.5), plastic(0.2)] {
            let material = base.with_texture(TextureSlot::Normal, FIRST_TEXTURE);
            let floor = WorldBuilder::default().floor(&material, Vec3::ZERO, 100.0);
            let builder = with_texel(floor, [x, y, z, 255]);
            let camera = Camera::look_at(Vec3::new(0.0, 1.0, 2.0), Vec3::ZERO, 0.4);
            furnaces.add(&furnace(setting, (builder.build(), camera), 16)?);
        }
    }
    Ok(furnaces.judged("buried normals"))
}

/// A camera a millimetre above a floor of ten kilometres.
fn grazing(setting: &Setting) -> Result<Outcome> {
    let mut furnaces = Furnaces::new();
    for material in
        [lambert(1.0), metal(0.0), metal(0.3), plastic(0.0), plastic(0.6), pane(0.0), pane(0.3)]
    {
        for drop in [1e-2, 1e-5] {
            let world = WorldBuilder::default().floor(&material, Vec3::ZERO, 1e4).build();
            let eye = Vec3::new(0.3, 1e-3, 0.2);
            let camera = Camera::look_at(eye, eye + Vec3::new(1.0, -drop, 0.3), 1e-4);
            furnaces.add(&furnace(setting, (world, camera), 16)?);
        }
    }
    Ok(furnaces.judged("grazing"))
}

/// Glass in glass, a bubble in it, spheres that intersect, and one that touches another.
fn nested(setting: &Setting) -> Result<Outcome> {
    let mut furnaces = Furnaces::new();
    let (outer, inner) = (glass(1.5, 0.0), glass(3.0, 0.0));
    for (center, radius) in [(Vec3::ZERO, 0.5), (Vec3::X * 0.8, 0.5), (Vec3::X * 0.5, 0.5)] {
        for material in [&inner, &outer, &glass(1.5, 0.3)] {
            let builder = WorldBuilder::default()
                .sphere(&outer, Vec3::ZERO, 1.0)
                .sphere(material, center, radius);
            let camera = Camera::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO, 0.5);
            furnaces.add(&furnace(setting, (builder.build(), camera), 200)?);
        }
    }
    Ok(furnaces.judged("nested glass"))
}

/// Absorption from none to total, and products beyond the range of f32.
fn optical_depths(setting: &Setting) -> Result<Outcome> {
    let mut furnaces = Furnaces::new();
    let mut clearest: f64 = 0.0;
    for distance in [1e-45, 1e-38, 1e-20, 1e-6, 1.0, 1e6, 1e30, f32::MAX] {
        for roughness in [0.0, 0.3] {
            let material = Material {
                attenuation_color: Vec3::new(1.0, 0.5, 0.0),
                attenuation_distance: distance,
                ..glass(1.5, roughness)
            };
            let film = furnace(setting, ball(&material), 64)?;
            clearest = clearest.max(mean(&film).luminance);
            furnaces.add(&film);
        }
    }
    Ok(furnaces.judged("absorbing glass").at_least("clearest glass", clearest, 0.95))
}

/// Fog without absorption around a floor, from thin to opaque; and milk in a glass ball.
fn media(setting: &Setting) -> Result<Outcome> {
    let mut furnaces = Furnaces::new();
    let mut thinnest = 0.0_f64;
    let camera = Camera::look_at(Vec3::new(0.3, 1.0, 0.2), Vec3::ZERO, 0.5);
    for scattering in [1e-40, 1e-20, 1e-3, 1.0, 1e3, 1e10, 1e30] {
        for anisotropy in [-0.99, 0.0, 0.99] {
            let fog = Medium {
                scattering: Vec3::new(scattering, 0.5 * scattering, 0.0),
                absorption: Vec3::ZERO,
                anisotropy,
                bounds: Some([Vec3::splat(-2.0), Vec3::splat(2.0)]),
            };
            let world = WorldBuilder::default().floor(&lambert(1.0), Vec3::ZERO, 3.0).build();
            let view = View {
                width: 12,
                height: 12,
                medium: Some(fog),
                ..view(camera.clone(), Sampling::Plain, 64)
            };
            let film = render(setting, (&world, &constant(1.0)?), view, setting.count(16, 512))?;
            if scattering < 1e-3 {
                thinnest = thinnest.max(deviation(mean(&film), 1.0, 1e-3));
            }
            furnaces.add(&film);
            let milk = Material {
                scattering: Vec3::splat(scattering),
                scatter_anisotropy: anisotropy,
                ..glass(1.5, 0.0)
            };
            furnaces.add(&furnace(setting, ball(&milk), 64)?);
        }
    }
    Ok(furnaces.judged("media").at_most("thinnest fog: standard errors off", thinnest, SIGMAS))
}

/// Random valid materials: a ball of each in a room of each.
fn random_materials(setting: &Setting) -> Result<Outcome> {
    let mut random = SplitMix(6);
    let mut furnaces = Furnaces::new();
    let count = if setting.gpu.is_some() { 4 } else { setting.count(150, 5000) };
    for _ in 0..count {
        let mut pick = |choices: &[f32]| choices[random.below(choices.len())];
        let material = Material {
            metallic: pick(&[0.0, 0.0, 0.5, 1.0]),
            roughness: pick(&[0.0, 1e-4, 0.03, 0.1, 0.4, 1.0]),
            ior: pick(&[0.0, 1.0, 1.0005, 1.5, 3.0, 1e6]),
            specular: pick(&[0.0, 1e-10, 0.5, 1.0]),
            specular_color: Vec3::new(pick(&[0.0, 1.0, 100.0]), 1.0, pick(&[0.0, 1.0])),
            transmission: pick(&[0.0, 0.0, 1e-6, 0.5, 1.0]),
            thickness: pick(&[0.0, 1.0]),
            anisotropy: pick(&[0.0, 0.0, 1e-10, 1.0]),
            sheen_color: Vec3::splat(pick(&[0.0, 0.0, 1e-10, 1.0])),
            sheen_roughness: pick(&[0.0, 0.3, 1.0]),
            diffuse_transmission: pick(&[0.0, 0.0, 1e-10, 1.0]),
            iridescence: pick(&[0.0, 0.0, 1e-10, 1.0]),
            iridescence_ior: pick(&[1.0, 1.33, 3.0]),
            dispersion: pick(&[0.0, 0.0, 1.0, 100.0]),
            clearcoat: pick(&[0.0, 0.0, 1e-10, 1.0]),
            clearcoat_roughness: pick(&[0.0, 0.3, 1.0]),
            ..lambert(1.0)
        };
        furnaces.add(&furnace(setting, ball(&material), 32)?);
    }
    Ok(furnaces.judged("random materials"))
}

/// Light beyond the range of f32: samples overflow, are left out, counted and reported.
fn overflow(setting: &Setting) -> Result<Outcome> {
    let material = Material { emissive: Vec3::splat(f32::MAX), ..lambert(1.0) };
    let world = WorldBuilder::default().floor(&material, Vec3::ZERO, 10.0).build();
    let environment = constant(f32::MAX)?;
    let camera = Camera::look_at(Vec3::new(0.3, 1.0, 0.2), Vec3::ZERO, 0.3);
    let film = render(setting, (&world, &environment), view(camera, Sampling::Plain, 2), 16)?;
    let odd = film.pixels().iter().filter(|p| !p.mean().iter().all(|c| c.is_finite())).count();
    let remarks = crate::output::remarks(&film, &environment);
    let told = remarks.iter().filter(|s| s.contains("not finite")).count();
    Ok(Outcome::default()
        .at_least("samples counted as not finite", film.invalid_samples() as f64, 1.0)
        .at_most("pixels that are NaN or infinite", odd as f64, 0.0)
        .at_least("sentences that say so", told as f64, 1.0))
}
