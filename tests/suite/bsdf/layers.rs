//! Known values and limits of the material extensions.

use glam::{Vec2, Vec3};
use lightgrid::bsdf::{Bsdf, SurfaceParameters};

use super::physics::furnace;
use super::{METAL, PLASTIC, Random, colored, spherical, viewers};
use crate::shared::SplitMix;

/// Two directions above the surface.
fn pair(random: &mut Random) -> [Vec3; 2] {
    [(); 2].map(|()| {
        let d = random.direction();
        Vec3::new(d.x, d.y, d.z.abs().max(0.05)).normalize()
    })
}

/// `KHR_materials_anisotropy`, appendix: `F D V` with `alpha_t = mix(alpha, 1, strength^2)`, in f64.
#[test]
fn brushed_metal_is_the_specified_formula() {
    let turn = Vec2::from_angle(0.4);
    let brushed = SurfaceParameters { anisotropy: 0.7, anisotropy_axis: turn, ..colored(METAL) };
    let bsdf = Bsdf::new(&brushed, true);
    let across = f64::from(brushed.roughness).powi(2);
    let along = across + (1.0 - across) * 0.49;
    let mut random = Random(SplitMix(21));
    for _ in 0..200 {
        let [wo, wi] = pair(&mut random);
        let h = (wo + wi).normalize().as_dvec3();
        let (o, i) = (wo.as_dvec3(), wi.as_dvec3());
        let (t, b) = (turn.as_dvec2(), turn.perp().as_dvec2());
        let scaled = |v: glam::DVec3, by: [f64; 2]| {
            [v.truncate().dot(t) * by[0], v.truncate().dot(b) * by[1]]
        };
        let [x, y] = scaled(h, [1.0 / along, 1.0 / across]);
        let d = 1.0 / (std::f64::consts::PI * along * across * (x * x + y * y + h.z * h.z).powi(2));
        let length = |v: glam::DVec3| {
            let [x, y] = scaled(v, [along, across]);
            (x * x + y * y + v.z * v.z).sqrt()
        };
        let visible = 1.0 / ((o.z + length(o)) * (i.z + length(i)));
        let f0 = f64::from(brushed.base_color.y);
        let f = f0 + (1.0 - f0) * (1.0 - o.dot(h)).powi(5);
        let expected = f * d * visible * i.z;
        let value = f64::from(bsdf.eval(wo, wi).y);
        assert!((value - expected).abs() < 1e-4 * expected + 1e-6, "{value} {expected}");
    }
}

#[test]
fn without_strength_nothing_is_stretched() {
    let mut random = Random(SplitMix(22));
    for base in [colored(METAL), PLASTIC] {
        let plain = Bsdf::new(&base, true);
        let axis = Vec2::from_angle(1.3);
        let none = Bsdf::new(&SurfaceParameters { anisotropy_axis: axis, ..base }, true);
        let little = SurfaceParameters { anisotropy: 0.01, anisotropy_axis: axis, ..base };
        let little = Bsdf::new(&little, true);
        for _ in 0..200 {
            let ([wo, wi], u) = (pair(&mut random), random.next_vec3());
            assert_eq!(plain.eval_pdf(wo, wi), none.eval_pdf(wo, wi));
            assert_eq!(plain.sample(wo, u), none.sample(wo, u));
            let (a, b) = (plain.eval(wo, wi).y, little.eval(wo, wi).y);
            assert!((a - b).abs() < 2e-3 * a + 1e-6, "{a} {b}");
        }
    }
}

#[test]
fn brushed_plastic_hardly_loses_and_never_gains() {
    for strength in [0.5, 1.0] {
        for (wo, azimuth) in viewers().flat_map(|v| [0.0, 0.8, 1.57].map(|azimuth| (v, azimuth))) {
            let brushed = SurfaceParameters { anisotropy: strength, ..PLASTIC };
            let wo = spherical(wo.z, azimuth);
            let (energy, error) = furnace(&brushed, true, wo, 20_000);
            // Grazing across the axis its table takes too much away.
            let least = if wo.z < 0.5 { 0.92 } else { 0.985 };
            assert!(energy < 1.004 + 4.0 * error, "{strength} {wo}: {energy}");
            assert!(energy > least - 4.0 * error, "{strength} {wo}: {energy}");
        }
    }
}
