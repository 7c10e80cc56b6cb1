//! Known values and limits of the material extensions.

use glam::{DVec3, Vec2, Vec3};
use lightgrid::bsdf::{Bsdf, Hero, SurfaceParameters};
use lightgrid::sampler::SplitMix;

use super::physics::furnace;
use super::{
    GLASS, METAL, PANE, PLASTIC, Random, WHITE, colored, scattered_again, spherical, viewers,
};

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
    let (t, b) = (turn.as_dvec2(), turn.perp().as_dvec2());
    let single = |f0: f64| {
        move |o: DVec3, i: DVec3| {
            let scaled = |v: DVec3, by: [f64; 2]| {
                let [x, y] = [v.truncate().dot(t) * by[0], v.truncate().dot(b) * by[1]];
                x * x + y * y + v.z * v.z
            };
            let h = (o + i).normalize();
            let spread = scaled(h, [1.0 / along, 1.0 / across]);
            let d = 1.0 / (std::f64::consts::PI * along * across * spread * spread);
            let length = |v: DVec3| scaled(v, [along, across]).sqrt();
            let visible = 1.0 / ((o.z + length(o)) * (i.z + length(i)));
            (f0 + (1.0 - f0) * (1.0 - o.dot(h)).powi(5)) * d * visible * i.z
        }
    };
    let f0 = f64::from(brushed.base_color.y);
    let mut random = Random(SplitMix(21));
    for _ in 0..40 {
        let [wo, wi] = pair(&mut random);
        let (o, i) = (wo.as_dvec3(), wi.as_dvec3());
        let (once, again) = (single(f0)(o, i), scattered_again(single(1.0), f0, o, i));
        let value = f64::from(bsdf.eval(wo, wi).y);
        // The table of stretched lobes is an approximation, which what it scatters again multiplies.
        let lambert = i.z * std::f64::consts::FRAC_1_PI;
        let tolerance = 1e-4 * once + 0.6 * again + 0.01 * lambert;
        assert!((value - once - again).abs() < tolerance, "{value} {once} {again}");
    }
}

/// Factors of zero leave every bit as it is, whatever the other parameters say.
#[test]
fn what_is_absent_changes_no_bit() {
    let mut random = Random(SplitMix(23));
    for base in [colored(PLASTIC), colored(METAL), GLASS, PANE] {
        let with = SurfaceParameters {
            anisotropy_axis: Vec2::from_angle(2.0),
            sheen_roughness: 0.4,
            diffuse_transmission_color: Vec3::new(0.1, 0.2, 0.3),
            iridescence_ior: 1.9,
            iridescence_thickness: 300.0,
            ..base
        };
        for entering in [true, false] {
            let hero = Hero { channel: 2, probability: 0.3 };
            let plain = Bsdf::new(&base, entering);
            let with = Bsdf::new(&with, entering).of_hero(hero);
            assert_eq!(plain.albedo(), with.albedo());
            for _ in 0..100 {
                let (wo, wi) = (pair(&mut random)[0], random.direction());
                assert_eq!(plain.eval_pdf(wo, wi), with.eval_pdf(wo, wi));
                let u = random.next_vec3();
                assert_eq!(plain.sample(wo, u), with.sample(wo, u));
                assert_eq!(plain.straight_transmittance(wo), with.straight_transmittance(wo));
            }
        }
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

/// `KHR_materials_sheen`, implementation notes, in f64: Charlie's distribution and the fit of its
/// masking; on black nothing else is left.
#[test]
fn sheen_is_the_specified_formula() {
    let roughness = 0.6;
    let fibres = SurfaceParameters {
        base_color: Vec3::ZERO,
        sheen_color: Vec3::new(0.2, 0.5, 0.9),
        sheen_roughness: roughness,
        ..WHITE
    };
    let bsdf = Bsdf::new(&fibres, true);
    let alpha = f64::from(roughness).powi(2);
    let mix = |rough: f64, smooth: f64| rough + (smooth - rough) * (1.0 - alpha).powi(2);
    let [a, b, c] = [mix(21.5473, 25.3245), mix(3.82987, 3.32435), mix(0.19823, 0.16801)];
    let [d, e] = [mix(-1.97760, -1.27393), mix(-4.32054, -4.85967)];
    let l = |x: f64| a / (1.0 + b * x.powf(c)) + d * x + e;
    let lambda = |x: f64| if x < 0.5 { l(x).exp() } else { (2.0 * l(0.5) - l(1.0 - x)).exp() };
    let mut random = Random(SplitMix(24));
    for _ in 0..200 {
        let [wo, wi] = pair(&mut random);
        let h = (wo + wi).normalize().as_dvec3();
        let sine = (1.0 - h.z * h.z).max(0.0).sqrt();
        let density = (2.0 + 1.0 / alpha) * sine.powf(1.0 / alpha) / std::f64::consts::TAU;
        let (o, i) = (f64::from(wo.z), f64::from(wi.z));
        let masking = (1.0 + lambda(o) + lambda(i)) * 4.0 * o;
        let expected = 0.9 * density / masking;
        let value = f64::from(bsdf.eval(wo, wi).z);
        assert!((value - expected).abs() < 1e-3 * expected + 1e-6, "{value} {expected}");
    }
}

/// The sheen and what it leaves never exceed 1; over white the loss is what differs between the
/// tabulated albedos of both directions.
#[test]
fn sheen_takes_from_the_base_what_it_scatters() {
    for roughness in [0.0, 0.1, 0.2, 0.4, 0.7, 1.0] {
        for wo in viewers().chain([spherical(0.05, 0.4), spherical(0.01, 0.4)]) {
            for base in [WHITE, PLASTIC, METAL] {
                let white = SurfaceParameters {
                    sheen_color: Vec3::ONE,
                    sheen_roughness: roughness,
                    ..base
                };
                let (energy, error) = furnace(&white, true, wo, 20_000);
                assert!(energy < 1.01 + 4.0 * error, "{roughness} {wo}: {energy}+-{error}");
                if base == WHITE {
                    assert!(energy > 0.7 - 4.0 * error, "{roughness} {wo}: {energy}+-{error}");
                }
            }
        }
    }
}

#[test]
fn diffuse_transmission_is_lambert_on_both_sides() {
    let (back, through) = (Vec3::new(0.8, 0.5, 0.1), Vec3::new(0.2, 0.6, 0.9));
    let leaf = SurfaceParameters {
        diffuse_transmission: 0.25,
        diffuse_transmission_color: through,
        ..colored(WHITE)
    };
    let bsdf = Bsdf::new(&leaf, true);
    let mut random = Random(SplitMix(25));
    let mut passed = 0;
    for _ in 0..1000 {
        let wi = random.direction();
        let color = if wi.z > 0.0 { back * 0.75 } else { through * 0.25 };
        let expected = color * (wi.z.abs() * std::f32::consts::FRAC_1_PI);
        assert!((bsdf.eval(Vec3::Z, wi) - expected).abs().max_element() < 1e-6);
        let sample = bsdf.sample(Vec3::Z, random.next_vec3()).expect("nothing is absorbed unseen");
        passed += u32::from(sample.is_transmission);
    }
    assert!((150..500).contains(&passed), "{passed}");
    assert!((bsdf.albedo() - (back * 0.75 + through * 0.25)).abs().max_element() < 1e-6);
}

#[test]
fn a_film_that_is_none_reflects_as_without() {
    let mut random = Random(SplitMix(26));
    for base in [colored(METAL), colored(PLASTIC), GLASS] {
        for (ior, thickness) in [(1.0, 400.0), (1.6, 0.0)] {
            let film = SurfaceParameters {
                iridescence: 1.0,
                iridescence_ior: ior,
                iridescence_thickness: thickness,
                ..base
            };
            let (plain, film) = (Bsdf::new(&base, true), Bsdf::new(&film, true));
            for _ in 0..200 {
                let [wo, wi] = pair(&mut random);
                let (a, b) = (plain.eval(wo, wi), film.eval(wo, wi));
                // Glass is compared with Fresnel's formulas, which Schlick's only nearly are.
                let tolerance = if base == GLASS { 0.3 } else { 2e-3 };
                let off = (a - b).abs().max_element();
                assert!(off < tolerance * a.max_element() + 1e-5, "{ior} {thickness}: {a} {b}");
            }
        }
    }
}

/// A film of water in air: none is seen where it is thin, four times one face's reflectance where both
/// are in step, and violet where green is out of step.
#[test]
fn a_soap_film_has_its_colours() {
    let soap = |thickness: f32| {
        let p = SurfaceParameters {
            base_color: Vec3::ZERO,
            roughness: 0.0,
            ior: 1.0,
            specular: 1.0,
            iridescence: 1.0,
            iridescence_ior: 1.33,
            iridescence_thickness: thickness,
            ..WHITE
        };
        Bsdf::new(&p, true).sample(Vec3::Z, Vec3::splat(0.5)).map_or(Vec3::ZERO, |s| s.weight)
    };
    let face = (0.33_f32 / 2.33).powi(2);
    let black = soap(10.0);
    assert!(black.max_element() < 0.5 * face, "{black}");
    let bright = soap(550.0 / 4.0 / 1.33);
    assert!((bright.y / (4.0 * face) - 1.0).abs() < 0.15, "{bright}");
    let violet = soap(550.0 / 2.0 / 1.33);
    assert!(violet.y < violet.x && violet.x < violet.z, "{violet}");
}

/// Each channel is bent by its own index, `ior -+ (ior - 1) * 0.025 * dispersion`.
#[test]
fn dispersion_bends_each_channel_by_its_index() {
    let prism = SurfaceParameters { dispersion: 4.0, roughness: 0.0, ..GLASS };
    let wo = Vec3::new(0.6, 0.0, 0.8);
    for (channel, ior) in [1.45, 1.5, 1.55].into_iter().enumerate() {
        let hero = Hero { channel, probability: 0.25 };
        let bsdf = Bsdf::new(&prism, true).of_hero(hero);
        let s = bsdf.sample(wo, Vec3::new(0.9, 0.5, 0.5)).expect("it refracts");
        assert!(s.is_transmission && (s.wi.x + 0.6 / ior).abs() < 1e-5, "{}", s.wi);
        for c in 0..3 {
            let expected = if c == channel { 4.0 / (ior * ior) } else { 0.0 };
            assert!((s.weight[c] - expected).abs() < 2e-3, "{c}: {}", s.weight);
        }
        let s = bsdf.sample(wo, Vec3::ZERO).expect("it reflects");
        assert!(!s.is_transmission && s.weight.min_element() > 0.5, "{}", s.weight);
    }
}

/// Whatever the path carries, a dispersive white furnace returns it: heroes weigh what they stand for.
#[test]
fn heroes_lose_and_gain_nothing() {
    let prism = SurfaceParameters { dispersion: 8.0, roughness: 0.0, ..GLASS };
    let mut random = Random(SplitMix(27));
    for carried in [Vec3::ONE, Vec3::new(0.9, 0.1, 0.4), Vec3::X, Vec3::new(0.0, 0.3, 0.5)] {
        for entering in [true, false] {
            let count = 400_000;
            let mut sum = Vec3::ZERO;
            for _ in 0..count {
                let hero = Hero::choose(carried, random.next());
                let bsdf = Bsdf::new(&prism, entering).of_hero(hero);
                let wo = Vec3::new(0.3, 0.0, 0.91_f32.sqrt());
                let s = bsdf.sample(wo, random.next_vec3()).expect("it loses nothing");
                let ior = 1.5 + [-0.1, 0.0, 0.1][hero.channel];
                let eta = if entering { ior } else { 1.0 / ior };
                sum += carried * s.weight * if s.is_transmission { eta * eta } else { 1.0 };
            }
            let off = (sum / count as f32 - carried).abs();
            assert!((off.cmple(carried * 0.03)).all(), "{carried}: {}", sum / count as f32);
        }
    }
}
