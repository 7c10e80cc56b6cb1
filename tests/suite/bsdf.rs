//! Tests of bsdf, and of the surfaces and textures that feed it.

mod layers;
mod physics;
mod sampling;
mod surfaces;
mod textures;

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::{DVec3, Vec2, Vec3};
use lightgrid::bsdf::SurfaceParameters;
use lightgrid::sampler::SplitMix;

/// Random numbers, points and directions.
struct Random(SplitMix);

impl Random {
    fn next(&mut self) -> f32 {
        self.0.next_f32()
    }

    fn next_vec2(&mut self) -> Vec2 {
        Vec2::new(self.next(), self.next())
    }

    fn next_vec3(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }

    fn direction(&mut self) -> Vec3 {
        spherical(2.0 * self.next() - 1.0, std::f32::consts::TAU * self.next())
    }
}

fn spherical(cos: f32, phi: f32) -> Vec3 {
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    Vec3::new(sin * phi.cos(), sin * phi.sin(), cos)
}

/// Neither scatters nor emits.
const BLACK: SurfaceParameters = SurfaceParameters {
    base_color: Vec3::ZERO,
    alpha: 1.0,
    metallic: 0.0,
    roughness: 1.0,
    ior: 1.5,
    specular: 0.0,
    specular_color: Vec3::ONE,
    transmission: 0.0,
    thin: true,
    absorption: Vec3::ZERO,
    anisotropy: 0.0,
    anisotropy_axis: Vec2::X,
    sheen_color: Vec3::ZERO,
    sheen_roughness: 0.0,
    diffuse_transmission: 0.0,
    diffuse_transmission_color: Vec3::ONE,
    iridescence: 0.0,
    iridescence_ior: 1.3,
    iridescence_thickness: 400.0,
    dispersion: 0.0,
    clearcoat: 0.0,
    clearcoat_roughness: 0.0,
    clearcoat_normal: Vec3::Z,
    emissive: Vec3::ZERO,
    unlit: false,
};
/// White dielectric without reflection: Lambert.
const WHITE: SurfaceParameters = SurfaceParameters { base_color: Vec3::ONE, ..BLACK };
const PLASTIC: SurfaceParameters = SurfaceParameters { specular: 1.0, roughness: 0.4, ..WHITE };
const METAL: SurfaceParameters = SurfaceParameters { metallic: 1.0, roughness: 0.5, ..WHITE };
const GLASS: SurfaceParameters = SurfaceParameters { transmission: 1.0, thin: false, ..PLASTIC };
const PANE: SurfaceParameters = SurfaceParameters { thin: true, ..GLASS };

fn colored(p: SurfaceParameters) -> SurfaceParameters {
    SurfaceParameters { base_color: Vec3::new(0.8, 0.5, 0.1), ..p }
}

/// Every lobe alone and in mixtures: name, parameters, whether the viewer is outside.
fn cases() -> Vec<(&'static str, SurfaceParameters, bool)> {
    let tilted = Vec3::new(0.3, -0.2, 1.0).normalize();
    let coat = |p| SurfaceParameters { clearcoat: 0.7, clearcoat_roughness: 0.5, ..p };
    let axis = Vec2::from_angle(0.7);
    let brushed = |anisotropy, p| SurfaceParameters { anisotropy, anisotropy_axis: axis, ..p };
    let velvet = |sheen_roughness, p| SurfaceParameters {
        sheen_color: Vec3::new(0.3, 0.9, 0.5),
        sheen_roughness,
        ..p
    };
    let filmed = |p| SurfaceParameters { iridescence: 0.9, iridescence_ior: 1.7, ..p };
    let leaf = |p| SurfaceParameters {
        diffuse_transmission: 0.4,
        diffuse_transmission_color: Vec3::new(0.2, 0.7, 0.1),
        ..p
    };
    let mut cases = vec![
        ("lambert", WHITE, true),
        ("plastic", colored(PLASTIC), true),
        ("rough plastic", SurfaceParameters { roughness: 1.0, ..PLASTIC }, true),
        ("diamond-like opaque", SurfaceParameters { ior: 3.0, ..PLASTIC }, true),
        ("smooth plastic", SurfaceParameters { roughness: 0.0, ..PLASTIC }, true),
        ("metal", colored(METAL), true),
        ("rough metal", SurfaceParameters { roughness: 1.0, ..METAL }, true),
        ("half metal", SurfaceParameters { metallic: 0.5, ..colored(PLASTIC) }, true),
        ("pane", colored(PANE), true),
        ("half pane", SurfaceParameters { transmission: 0.5, ..colored(PANE) }, true),
        ("coated plastic", coat(colored(PLASTIC)), true),
        ("tilted coat", SurfaceParameters { clearcoat_normal: tilted, ..coat(PLASTIC) }, true),
        ("brushed metal", brushed(0.8, colored(METAL)), true),
        ("brushed plastic", brushed(0.8, colored(PLASTIC)), true),
        ("brushed pane", brushed(0.3, PANE), true),
        ("velvet", velvet(0.5, colored(WHITE)), true),
        ("fine velvet", velvet(0.1, PLASTIC), true),
        ("velvet on metal", velvet(0.8, METAL), true),
        ("coated velvet", coat(velvet(0.5, PLASTIC)), true),
        ("leaf", leaf(colored(PLASTIC)), true),
        ("paper", SurfaceParameters { diffuse_transmission: 1.0, ..WHITE }, true),
        ("curtain", velvet(0.4, leaf(WHITE)), true),
        ("beetle", filmed(colored(PLASTIC)), true),
        ("anodised metal", filmed(colored(METAL)), true),
        ("bubble", filmed(PANE), true),
        ("smooth coat", SurfaceParameters { clearcoat_roughness: 0.0, ..coat(PLASTIC) }, true),
    ];
    for entering in [true, false] {
        cases.push(("glass", GLASS, entering));
        cases.push(("frosted", SurfaceParameters { roughness: 0.9, ..GLASS }, entering));
        cases.push((
            "faint glass",
            SurfaceParameters { ior: 1.2, roughness: 0.9, ..GLASS },
            entering,
        ));
        cases.push(("no bending", SurfaceParameters { ior: 1.0, ..GLASS }, entering));
        cases.push(("dense glass", SurfaceParameters { ior: 3.0, ..GLASS }, entering));
        cases.push(("milk", SurfaceParameters { transmission: 0.5, ..GLASS }, entering));
        cases.push(("coated glass", coat(GLASS), entering));
        cases.push(("filmed glass", filmed(GLASS), entering));
        cases.push(("flint glass", SurfaceParameters { dispersion: 4.0, ..GLASS }, entering));
        cases.push(("wax", SurfaceParameters { thin: false, ..leaf(PLASTIC) }, entering));
        cases.push((
            "fibrous milk",
            velvet(0.5, leaf(SurfaceParameters { transmission: 0.5, ..GLASS })),
            entering,
        ));
        cases.push(("brushed glass", brushed(0.4, GLASS), entering));
    }
    cases
}

/// glTF 2.0 appendix B.3 of a metal with GGX of this squared alpha: `F D V cos i`, written out in f64.
fn ggx_metal(a2: f64, f0: f64) -> impl Fn(DVec3, DVec3) -> f64 {
    move |o, i| {
        let h = (o + i).normalize();
        let d = FRAC_1_PI * a2 / (h.z * h.z * (a2 - 1.0) + 1.0).powi(2);
        let visible = |c: f64| 1.0 / (c + (a2 + (1.0 - a2) * c * c).sqrt());
        (f0 + (1.0 - f0) * (1.0 - o.dot(h)).powi(5)) * d * visible(o.z) * visible(i.z) * i.z
    }
}

/// Share of white light that a surface of this `f(o, i) * cos i` sends towards `o` by single scattering.
fn scattered_once(f: impl Fn(DVec3, DVec3) -> f64, o: DVec3, steps: u32) -> f64 {
    let mid = |i: u32| (f64::from(i) + 0.5) / f64::from(steps);
    let places = (0..steps).flat_map(|i| (0..steps).map(move |j| (mid(i), mid(j))));
    let sum: f64 = places.map(|(cos, turn)| f(o, upper(cos, turn))).sum();
    sum * TAU / f64::from(steps * steps)
}

/// What is scattered more than once, times `cos i`, by Kulla and Conty's formula in f64 for the single
/// scattering `f` of a white metal and the F0 of a coloured one.
fn scattered_again(f: impl Fn(DVec3, DVec3) -> f64, f0: f64, o: DVec3, i: DVec3) -> f64 {
    let lost = |v: DVec3, steps: u32| 1.0 - scattered_once(&f, v, steps);
    let mid = |n: u32| (f64::from(n) + 0.5) / 16.0;
    let mean: f64 = (0..256)
        .map(|n| (mid(n / 16), mid(n % 16)))
        .map(|(cos, turn)| 2.0 * cos * lost(upper(cos, turn), 64) / 256.0)
        .sum();
    let fresnel = f0 + (1.0 - f0) / 21.0;
    let color = fresnel * fresnel * (1.0 - mean) / (1.0 - fresnel * mean);
    color * lost(o, 128) * lost(i, 128) / mean * i.z * FRAC_1_PI
}

fn upper(cos: f64, turn: f64) -> DVec3 {
    let sin = (1.0 - cos * cos).sqrt();
    DVec3::new(sin * (TAU * turn).cos(), sin * (TAU * turn).sin(), cos)
}

fn viewers() -> impl Iterator<Item = Vec3> {
    [1.0, 0.7, 0.15].into_iter().map(|cos| spherical(cos, 0.4))
}
