//! Tests of bsdf, and of the surfaces and textures that feed it.

mod layers;
mod physics;
mod sampling;
mod surfaces;
mod textures;

use glam::{Vec2, Vec3};
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

fn viewers() -> impl Iterator<Item = Vec3> {
    [1.0, 0.7, 0.15].into_iter().map(|cos| spherical(cos, 0.4))
}
