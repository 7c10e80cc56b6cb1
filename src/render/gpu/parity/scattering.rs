//! Fresnel, microfacets, albedo tables and whole materials.

use glam::{Vec2, Vec3};

use super::Probe;
use super::cases::{EDGE_UNITS, Part, Random, case, cases, edge_squares};
use super::twin::{Bound, EXACT, Twin, ulps};
use crate::bsdf::albedo::AlbedoTerms;
use crate::bsdf::fresnel::{dielectric, normal_reflectance, reflect, refract, schlick_weight};
use crate::bsdf::iridescence::Film;
use crate::bsdf::microfacet::Ggx;
use crate::bsdf::sheen::Sheen;
use crate::bsdf::{Bsdf, Hero, SurfaceParameters, cosine_hemisphere};

/// Reads the words of [`material`]; writes what [`expect_parameters`] compares.
pub(super) const PRELUDE: &str = "
fn take_parameters() -> SurfaceParameters {
    var p: SurfaceParameters;
    p.base_color = take3(); p.alpha = take(); p.metallic = take(); p.roughness = take();
    p.ior = take(); p.specular = take(); p.specular_color = take3(); p.transmission = take();
    p.thin = take_word() != 0u; p.clearcoat = take(); p.clearcoat_roughness = take();
    p.clearcoat_normal = take3(); p.anisotropy = take(); p.anisotropy_axis = take2();
    p.sheen_color = take3(); p.sheen_roughness = take(); p.diffuse_transmission = take();
    p.diffuse_transmission_color = take3(); p.iridescence = take(); p.iridescence_ior = take();
    p.iridescence_thickness = take(); p.dispersion = take();
    return p;
}
fn take_bsdf(p: SurfaceParameters) -> Bsdf {
    var bsdf = bsdf_new(p, take_word() != 0u);
    bsdf.interface_ = interface_of_hero(bsdf.interface_, Hero(take_word(), 0.25));
    return bsdf;
}
fn take_ggx() -> Ggx {
    let roughness = take(); let strength = take();
    return ggx_stretched(roughness, strength, take2());
}
fn put_parameters(p: SurfaceParameters) {
    put3(p.base_color); put(p.alpha); put(p.metallic); put(p.roughness); put(p.ior);
    put(p.specular); put3(p.specular_color); put(p.transmission); put_bool(p.thin);
    put(p.clearcoat); put(p.clearcoat_roughness); put3(p.clearcoat_normal);
    put(p.anisotropy); put2(p.anisotropy_axis); put3(p.sheen_color); put(p.sheen_roughness);
    put(p.diffuse_transmission); put3(p.diffuse_transmission_color);
    put(p.iridescence); put(p.iridescence_ior); put(p.iridescence_thickness); put(p.dispersion);
    put3(p.absorption); put3(p.emissive); put_bool(p.unlit);
}
";

/// The probes.
pub(super) fn probes() -> Vec<Probe<'static>> {
    let mut probes = fresnel();
    probes.extend(microfacets());
    probes.extend(albedos());
    probes.extend(films());
    probes.extend(sheens());
    probes.extend(materials());
    probes
}

/// Cosines and relative indices of refraction.
fn interfaces() -> Vec<Vec<u32>> {
    let edges = EDGE_UNITS.into_iter().chain([1.0]);
    let edges = edges.flat_map(|cos| [0.4, 1.0, 1.5].map(|eta| case(&[&cos, &eta])));
    cases(edges, |r| case(&[&r.unit(), &r.magnitude(0.3, 3.0)]))
}

/// Where refraction becomes grazing its cosine is a root of nearly nothing: rounding counts over it.
fn grazing(cos: f32, eta: f32) -> f32 {
    let cos2_t = 1.0 - (1.0 - cos * cos) / (eta * eta);
    1.0 / cos2_t.abs().max(f32::EPSILON).sqrt()
}

fn fresnel() -> Vec<Probe<'static>> {
    let facing = |r: &mut Random| (r.upper_direction(), r.upper_direction(), r.magnitude(0.3, 3.0));
    vec![
        Probe::new(
            "schlick_weight, normal_reflectance",
            "put(schlick_weight(take())); put(normal_reflectance(take()));",
            interfaces(),
            |t| {
                let (cos, ior) = (t.take(), t.take());
                t.near(schlick_weight(cos), ulps(2.0));
                t.near(normal_reflectance(ior), ulps(5.0));
            },
        ),
        Probe::new(
            "dielectric",
            "let cosine = take(); put(dielectric(cosine, take()));",
            interfaces(),
            |t| {
                let (cos, eta) = (t.take(), t.take());
                let right = dielectric(cos, eta).unwrap_or(-1.0);
                t.near(right, ulps(4.0).of(grazing(cos, eta)));
            },
        )
        .flips(1000),
        Probe::new(
            "reflected, refracted",
            "let wo = take3(); let h = take3(); put3(reflected(wo, h)); put3(refracted(wo, h, take()));",
            cases([], |r| {
                let (wo, h, eta) = facing(r);
                case(&[&wo, &if wo.dot(h) < 0.0 { -h } else { h }, &eta])
            }),
            |t| {
                let (wo, h, eta) = (t.take3(), t.take3(), t.take());
                t.near(reflect(wo, h), ulps(3.0).of(1.0));
                let right = refract(wo, h, eta).unwrap_or(Vec3::ZERO);
                t.near(right, ulps(4.0).of(grazing(wo.dot(h), eta)));
            },
        )
        .flips(1000),
    ]
}

fn microfacets() -> Vec<Probe<'static>> {
    let roughness = |r: &mut Random| r.magnitude(0.04, 1.0);
    let strength = |r: &mut Random| [0.0, r.unit()][r.below(2) as usize];
    let take_ggx = |t: &mut Twin<'_>| Ggx::stretched(t.take(), t.take(), t.take2());
    vec![
        Probe::new(
            "ggx_distribution, ggx_visibility, visible normals' density",
            "let ggx = take_ggx(); let wo = take3(); let h = take3();
            put_bool(is_smooth(ggx)); put(ggx_distribution(ggx, h));
            put(ggx_visibility(ggx, wo));
            put(ggx_visible_normal_pdf_solid_angle(ggx, wo, h));",
            cases([case(&[&0.0316_f32, &0.0_f32, &Vec2::X, &Vec3::Z, &Vec3::Z])], move |r| {
                let (wo, h) = (r.upper_direction(), r.upper_direction());
                case(&[&roughness(r), &strength(r), &r.axis(), &wo, &h])
            }),
            move |t| {
                let (ggx, wo, h) = (take_ggx(t), t.take3(), t.take3());
                t.same(ggx.is_smooth());
                t.near(ggx.distribution(h), ulps(12.0));
                t.near(ggx.visibility(wo), ulps(4.0));
                let pdf = ggx.visible_normal_pdf_solid_angle(wo, h);
                // The cosine between the two may cancel.
                let whole = 2.0 * ggx.visibility(wo) * ggx.distribution(h);
                t.near(pdf, ulps(12.0).of(whole));
            },
        ),
        Probe::new(
            "ggx_sample_visible_normal",
            "let ggx = take_ggx(); let wo = take3();
            put3(ggx_sample_visible_normal(ggx, wo, take2()));",
            cases(
                edge_squares()
                    .into_iter()
                    .map(|u| case(&[&0.5_f32, &0.0_f32, &Vec2::X, &Vec3::Z, &u])),
                move |r| {
                    let (wo, u) = (r.upper_direction(), r.unit2());
                    case(&[&roughness(r), &strength(r), &r.axis(), &wo, &u])
                },
            ),
            move |t| {
                let ggx = take_ggx(t);
                let (wo, u) = (t.take3(), t.take2());
                // The cap's point nearly cancels the viewer where `u.y` is nearly 1.
                let shortest = (1.0 - u.y).sqrt();
                t.near(ggx.sample_visible_normal(wo, u), ulps(8.0).of(1.0 / shortest));
            },
        ),
        Probe::new(
            "cosine_hemisphere",
            "put3(cosine_hemisphere(take2()));",
            cases(edge_squares().into_iter().map(|u| case(&[&u])), |r| case(&[&r.unit2()])),
            |t| {
                let right = cosine_hemisphere(t.take2());
                t.near(right, ulps(2.0).of(1.0));
            },
        ),
    ]
}

fn albedos() -> Vec<Probe<'static>> {
    let nodes = (0..=31).map(|i| i as f32 / 31.0);
    let of = |roughness: f32, cos: f32| {
        let v = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
        case(&[&roughness, &0.0_f32, &Vec2::X, &v])
    };
    let edges = nodes.flat_map(|x| [0.0, 0.5, 1.0].map(|y| [of(x, y), of(y, x)]));
    vec![Probe::new(
        "terms_towards, terms_mean",
        "let roughness = take(); let strength = take();
        let ggx = ggx_stretched(roughness, strength, take2());
        put2(terms_towards(ggx, roughness, take3())); put2(terms_mean(ggx, roughness));",
        cases(edges.flatten(), |r| {
            let strength = [0.0, r.unit()][r.below(2) as usize];
            case(&[&r.unit(), &strength, &r.axis(), &r.upper_direction()])
        }),
        |t| {
            // Between nodes that may be much larger, with fractions of 31.
            let roughness = t.take();
            let ggx = Ggx::stretched(roughness, t.take(), t.take2());
            let terms = AlbedoTerms::of(ggx, roughness);
            let at = terms.at(t.take3());
            t.near(at, ulps(16.0).of(1.0));
            t.near(terms.mean(), ulps(16.0).of(1.0));
        },
    )]
}

/// A material of one of the kinds that the code tells apart.
fn material(r: &mut Random) -> SurfaceParameters {
    let kind = r.below(12);
    let is_glass = (4..=8).contains(&kind);
    let is_coated = kind >= 10 || r.below(4) == 0;
    let smooth_or_not = |r: &mut Random| if r.below(3) == 0 { 0.0 } else { r.magnitude(0.04, 1.0) };
    SurfaceParameters {
        base_color: r.unit3(),
        alpha: 1.0,
        metallic: match kind {
            2 => 1.0,
            3 | 9 => r.unit(),
            _ => 0.0,
        },
        roughness: smooth_or_not(r),
        // 0 is infinitely high.
        ior: [1.5, 1.0, 0.0, r.between(1.0, 2.5)][r.below(6).min(3) as usize],
        specular: if kind == 0 { 0.0 } else { r.between(0.5, 1.0) },
        specular_color: if r.below(4) == 0 { r.unit3() } else { Vec3::ONE },
        transmission: if is_glass { [1.0, r.unit()][r.below(2) as usize] } else { 0.0 },
        thin: kind >= 7 || r.below(2) == 0,
        absorption: Vec3::ZERO,
        anisotropy: [0.0, r.unit()][r.below(2) as usize],
        anisotropy_axis: r.axis(),
        sheen_color: if r.below(3) == 0 { r.unit3() } else { Vec3::ZERO },
        sheen_roughness: r.unit(),
        iridescence: [0.0, 0.0, r.unit()][r.below(3) as usize],
        iridescence_ior: r.between(1.0, 2.2),
        iridescence_thickness: r.between(0.0, 900.0),
        dispersion: if r.below(2) == 0 { 0.0 } else { r.between(0.0, 8.0) },
        diffuse_transmission: [0.0, 0.0, 1.0, r.unit()][r.below(4) as usize],
        diffuse_transmission_color: r.unit3(),
        clearcoat: if is_coated { r.unit() } else { 0.0 },
        clearcoat_roughness: smooth_or_not(r),
        clearcoat_normal: (Vec3::Z + 0.4 * r.in_cube() * r.below(2) as f32).normalize(),
        emissive: Vec3::ZERO,
        unlit: false,
    }
}

impl Part for SurfaceParameters {
    fn push_to(&self, words: &mut Vec<u32>) {
        words.extend(case(&[
            &self.base_color,
            &self.alpha,
            &self.metallic,
            &self.roughness,
            &self.ior,
            &self.specular,
            &self.specular_color,
            &self.transmission,
            &self.thin,
            &self.clearcoat,
            &self.clearcoat_roughness,
            &self.clearcoat_normal,
            &self.anisotropy,
            &self.anisotropy_axis,
            &self.sheen_color,
            &self.sheen_roughness,
            &self.diffuse_transmission,
            &self.diffuse_transmission_color,
            &self.iridescence,
            &self.iridescence_ior,
            &self.iridescence_thickness,
            &self.dispersion,
        ]));
    }
}

fn take_parameters(t: &mut Twin<'_>) -> SurfaceParameters {
    SurfaceParameters {
        base_color: t.take3(),
        alpha: t.take(),
        metallic: t.take(),
        roughness: t.take(),
        ior: t.take(),
        specular: t.take(),
        specular_color: t.take3(),
        transmission: t.take(),
        thin: t.take_word() != 0,
        clearcoat: t.take(),
        clearcoat_roughness: t.take(),
        clearcoat_normal: t.take3(),
        anisotropy: t.take(),
        anisotropy_axis: t.take2(),
        sheen_color: t.take3(),
        sheen_roughness: t.take(),
        diffuse_transmission: t.take(),
        diffuse_transmission_color: t.take3(),
        iridescence: t.take(),
        iridescence_ior: t.take(),
        iridescence_thickness: t.take(),
        dispersion: t.take(),
        absorption: Vec3::ZERO,
        emissive: Vec3::ZERO,
        unlit: false,
    }
}

/// The device must have put these parameters.
pub(super) fn expect_parameters(t: &mut Twin<'_>, p: &SurfaceParameters, bound: Bound) {
    t.near(p.base_color, bound);
    for number in [p.alpha, p.metallic, p.roughness, p.ior, p.specular] {
        t.near(number, bound);
    }
    t.near(p.specular_color, bound);
    t.near(p.transmission, bound);
    t.same(p.thin);
    t.near(p.clearcoat, bound);
    t.near(p.clearcoat_roughness, bound);
    t.near(p.clearcoat_normal, bound);
    t.near(p.anisotropy, bound);
    t.near(p.anisotropy_axis, bound);
    t.near(p.sheen_color, bound);
    t.near(p.sheen_roughness, bound);
    t.near(p.diffuse_transmission, bound);
    t.near(p.diffuse_transmission_color, bound);
    for number in [p.iridescence, p.iridescence_ior, p.iridescence_thickness, p.dispersion] {
        t.near(number, bound);
    }
    t.near(p.absorption, bound);
    t.near(p.emissive, bound);
    t.same(p.unlit);
}

/// Which side, and the hero channel.
fn bsdf(t: &mut Twin<'_>, p: &SurfaceParameters) -> Bsdf {
    let bsdf = Bsdf::new(p, t.take_word() != 0);
    bsdf.of_hero(Hero { channel: t.take_word() as usize, probability: 0.25 })
}

/// The narrower a lobe, the more a facet's last bits count; sheen has powers of up to 100, a film
/// phases of some turns.
fn narrow(p: &SurfaceParameters) -> f32 {
    let alpha = |roughness: f32| (roughness * roughness).clamp(1e-3, 1.0);
    let layers = [(p.sheen_color != Vec3::ZERO, 64.0), (p.iridescence > 0.0, 32.0)];
    let layers = layers.into_iter().filter(|(is_there, _)| *is_there).map(|(_, by)| by);
    let base = layers.fold(1.0 / alpha(p.roughness), f32::max);
    if p.clearcoat > 0.0 { base.max(1.0 / alpha(p.clearcoat_roughness)) } else { base }
}

/// What is scattered more than once comes from what is lost of 1, which rounds as 1 does.
fn lost_of_one(p: &SurfaceParameters) -> f32 {
    if p.metallic > 0.0 || p.transmission > 0.0 { 1.0 } else { 0.0 }
}

/// A direction near the mirrored or the straight one, or any.
fn incoming(r: &mut Random, wo: Vec3) -> Vec3 {
    let mirrored = wo * Vec3::new(-1.0, -1.0, 1.0);
    let wi = match r.below(4) {
        0 => mirrored + 0.05 * r.in_cube(),
        1 => -wo + 0.1 * r.in_cube(),
        _ => r.direction(),
    };
    wi.normalize()
}

fn films() -> Vec<Probe<'static>> {
    vec![
        Probe::new(
            "film_reflectance",
            "var p: SurfaceParameters; p.iridescence_ior = take(); p.iridescence_thickness = take();
            let film = film_new(p); let cosine = take(); put3(film_reflectance(film, cosine, take3()));",
            cases([], |r| {
                let (ior, thickness) = (r.between(1.0, 2.5), r.between(0.0, 1200.0));
                case(&[&ior, &thickness, &r.unit(), &r.unit3()])
            }),
            |t| {
                let p = SurfaceParameters {
                    iridescence_ior: t.take(),
                    iridescence_thickness: t.take(),
                    ..material(&mut Random::default())
                };
                let (cos, f0) = (t.take(), t.take3());
                // Phases of some turns, matrix entries of 3.
                t.near(Film::new(&p).reflectance(cos, f0), ulps(64.0).of(1.0));
            },
        ),
        Probe::new(
            "hero_choose",
            "let throughput = take3(); let hero = hero_choose(throughput, take());
            put_word(hero.channel); put(hero.probability);",
            cases([case(&[&Vec3::X, &0.99_f32]), case(&[&Vec3::Z, &0.0_f32])], |r| {
                case(&[&(r.unit3() * r.magnitude(1e-20, 1e20)), &r.unit()])
            }),
            |t| {
                let hero = Hero::choose(t.take3(), t.take());
                t.same(hero.channel as u32);
                t.near(hero.probability, ulps(4.0));
            },
        )
        .flips(1000),
    ]
}

fn sheens() -> Vec<Probe<'static>> {
    let sheen = |t: &mut Twin<'_>| {
        let (color, roughness) = (t.take3(), t.take());
        let p = SurfaceParameters {
            sheen_color: color,
            sheen_roughness: roughness,
            ..material(&mut Random::default())
        };
        Sheen::new(&p, true)
    };
    vec![
        Probe::new(
            "sheen_eval_pdf, sheen_albedo, sheen_left",
            "var p: SurfaceParameters; p.sheen_color = take3(); p.sheen_roughness = take();
            let sheen = sheen_new(p, true); let wo = take3(); let wi = take3();
            let f = sheen_eval_pdf(sheen, wo, wi); put3(f.value); put(f.pdf_solid_angle);
            put(sheen_albedo(sheen, wo)); put(sheen_left(sheen, wo, wi));",
            cases([], |r| {
                case(&[&(r.unit3() + 0.01), &r.unit(), &r.upper_direction(), &r.upper_direction()])
            }),
            move |t| {
                let (sheen, wo, wi) = (sheen(t), t.take3(), t.take3());
                let (value, pdf) = sheen.eval_pdf(wo, wi);
                // Powers of up to 100 of numbers below 1, and exponentials of up to 20.
                t.near(value, ulps(512.0));
                t.near(pdf, EXACT);
                t.near(sheen.albedo(wo), ulps(32.0).of(1.0));
                t.near(sheen.left(wo, wi), ulps(32.0).of(1.0));
            },
        ),
        Probe::new(
            "sheen_sample",
            "put3(sheen_sample(take2()));",
            cases(edge_squares().into_iter().map(|u| case(&[&u])), |r| case(&[&r.unit2()])),
            |t| {
                let right = Sheen::sample(t.take2());
                t.near(right, ulps(4.0).of(1.0));
            },
        ),
    ]
}

fn materials() -> Vec<Probe<'static>> {
    vec![
        Probe::new(
            "bsdf_eval_pdf",
            "let p = take_parameters(); let bsdf = take_bsdf(p); let wo = take3();
            let f = bsdf_eval_pdf(bsdf, wo, take3()); put3(f.value); put(f.pdf_solid_angle);",
            cases([], |r| {
                let wo = r.upper_direction();
                case(&[&material(r), &r.below(2), &r.below(3), &wo, &incoming(r, wo)])
            }),
            |t| {
                let p = take_parameters(t);
                let bsdf = bsdf(t, &p);
                let (value, pdf) = bsdf.eval_pdf(t.take3(), t.take3());
                t.near(value, ulps(8.0).of(value.max_element() * narrow(&p) + lost_of_one(&p)));
                t.near(pdf, ulps(8.0).of(pdf * narrow(&p) + lost_of_one(&p)));
            },
        ),
        Probe::new(
            "bsdf_sample",
            "let p = take_parameters(); let bsdf = take_bsdf(p); let wo = take3();
            let s = bsdf_sample(bsdf, wo, take3());
            put3(s.weight); put3(s.wi); put(s.pdf_solid_angle); put_bool(s.is_delta);",
            cases([], |r| {
                case(&[&material(r), &r.below(2), &r.below(3), &r.upper_direction(), &r.unit3()])
            }),
            |t| {
                let p = take_parameters(t);
                let bsdf = bsdf(t, &p);
                match bsdf.sample(t.take3(), t.take3()) {
                    Some(s) => {
                        let weight = s.weight.max_element();
                        t.near(s.weight, ulps(64.0).of(weight * narrow(&p)));
                        t.near(s.wi, ulps(32.0).of(1.0));
                        t.near(s.pdf_solid_angle, ulps(64.0).of(s.pdf_solid_angle * narrow(&p)));
                        t.same(s.is_delta);
                    }
                    None => {
                        t.near(Vec3::ZERO, EXACT);
                        t.accept_rest();
                    }
                }
            },
        )
        .flips(500),
        Probe::new(
            "bsdf_is_delta_only, bsdf_straight_transmittance, bsdf_albedo",
            "let p = take_parameters(); let bsdf = bsdf_new(p, take_word() != 0u);
            put_bool(bsdf_is_delta_only(bsdf)); put3(bsdf_albedo(bsdf));
            put3(bsdf_straight_transmittance(bsdf, take3()));",
            cases([], |r| case(&[&material(r), &r.below(2), &r.upper_direction()])),
            |t| {
                let p = take_parameters(t);
                let bsdf = Bsdf::new(&p, t.take_word() != 0);
                t.same(bsdf.is_delta_only());
                t.near(bsdf.albedo(), ulps(8.0).of(1.0));
                let right = bsdf.straight_transmittance(t.take3());
                t.near(right, ulps(8.0).of(1.0));
            },
        ),
    ]
}

#[test]
fn material_cases_have_all_lobes() {
    let mut random = Random::default();
    let mut seen = [0; 6];
    for _ in 0..1000 {
        let p = material(&mut random);
        let wo = random.upper_direction();
        let bsdf = Bsdf::new(&p, true);
        let sample = bsdf.sample(wo, random.unit3());
        for (index, is_seen) in [
            sample.is_none(),
            sample.is_some_and(|s| s.is_delta && !s.is_transmission),
            sample.is_some_and(|s| s.is_delta && s.is_transmission),
            sample.is_some_and(|s| !s.is_delta && !s.is_transmission),
            sample.is_some_and(|s| !s.is_delta && s.is_transmission),
            bsdf.straight_transmittance(wo) != Vec3::ZERO,
        ]
        .into_iter()
        .enumerate()
        {
            seen[index] += u32::from(is_seen);
        }
    }
    assert!(seen.into_iter().all(|count| count >= 20), "{seen:?}");
}
