//! The outer interface of the base material: a GGX surface that reflects, and refracts or passes
//! light if the material is transmissive.
//!
//! The reflection of metal and of opaque dielectric are both Schlick's, so they are one lobe with
//! F0 and F90 added by share. The transmissive share uses the dielectric's exact Fresnel, stretched
//! from `[F0_exact, 1]` to the `[F0, F90]` of `KHR_materials_specular`.

use glam::{Vec2, Vec3};

use super::SurfaceParameters;
use super::fresnel::{dielectric, normal_reflectance, reflect, refract, schlick_weight};
use super::iridescence::Film;
use super::microfacet::Ggx;
use super::sample::LobeSample;
use crate::color::importance;

/// Relative indices closer to 1 than this refract straight on: f32 half vectors vanish.
pub(crate) const STRAIGHT_ETA: f32 = 1e-3;

/// The channel whose index of refraction decides where a dispersive solid sends a path.
///
/// What is refracted carries that channel alone, over the probability of having chosen it; what is
/// reflected carries all of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hero {
    /// 0 to 2: red, green, blue.
    pub channel: usize,
    /// Probability of having chosen it, above 0.
    pub probability: f32,
}

impl Hero {
    /// Chooses among what a path carries, in proportion, by a uniform number. A path of one channel
    /// keeps it.
    pub fn choose(throughput: Vec3, u: f32) -> Self {
        let share = throughput / throughput.max_element();
        let share = share / share.element_sum();
        let [red, green] = [u < share.x, u < share.x + share.y];
        let channel = if red || (share.y == 0.0 && share.z == 0.0) {
            0
        } else if green || share.z == 0.0 {
            1
        } else {
            2
        };
        Self { channel, probability: share[channel] }
    }
}

/// Reflection and transmission at one microfacet.
#[derive(Debug, Clone, Copy)]
struct Facet {
    reflectance: Vec3,
    transmittance: Vec3,
}

impl Facet {
    /// Probability of reflecting there.
    fn reflection_probability(self) -> f32 {
        let (r, t) = (importance(self.reflectance), importance(self.transmittance));
        if t > 0.0 { r / (r + t) } else { 1.0 }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Interface {
    /// The microfacets.
    pub(super) ggx: Ggx,
    /// Opaque share: metal and dielectric, weights included.
    f0: Vec3,
    f90: f32,
    /// Transmissive share in `[0,1]` and the F0 and F90 of its dielectric.
    glass: f32,
    glass_f0: Vec3,
    glass_f90: f32,
    /// Colour per crossing times the transmissive share.
    tint: Vec3,
    /// Index of refraction on the far side over this side; of the hero channel if there is one.
    eta: f32,
    /// The same for each channel.
    etas: Vec3,
    /// What the hero channel's refraction counts for.
    hero: Vec3,
    thin: bool,
    film: Film,
    /// What is under the film: F0 and share of the opaque dielectric and of the metal.
    under_film: [(Vec3, f32); 2],
}

/// Glass that spreads what it lets through.
pub(super) struct RoughGlass {
    pub(super) thin: bool,
    /// Index of refraction on the far side over this side.
    pub(super) eta: f32,
    /// Reflectance and transmittance at normal incidence.
    pub(super) normal: (Vec3, f32),
}

impl Interface {
    /// `f0` and `f90` are the dielectric's at normal and grazing incidence.
    pub(super) fn new(p: &SurfaceParameters, f0: Vec3, f90: f32, entering: bool) -> Self {
        let glass = (1.0 - p.metallic) * p.transmission;
        let opaque = (1.0 - p.metallic) * (1.0 - p.transmission);
        let eta_of = |ior: f32| {
            let ior = ior.max(1.0);
            if (ior - 1.0).abs() < STRAIGHT_ETA {
                1.0
            } else if entering || p.thin {
                ior
            } else {
                1.0 / ior
            }
        };
        let eta = eta_of(p.ior);
        let mut etas = Vec3::splat(eta);
        if p.dispersion > 0.0 && p.ior > 0.0 {
            let spread = (p.ior - 1.0) * (0.025 * p.dispersion);
            etas = Vec3::new(eta_of(p.ior - spread), eta, eta_of(p.ior + spread));
        }
        let film = Film::new(p);
        let base_f0 = (normal_reflectance(p.ior) * p.specular_color).min(Vec3::ONE);
        Self {
            ggx: Ggx::stretched(p.roughness, p.anisotropy, p.anisotropy_axis),
            f0: f0 * opaque + p.base_color * p.metallic,
            f90: f90 * opaque + p.metallic,
            glass,
            glass_f0: f0,
            glass_f90: f90,
            tint: p.base_color * glass,
            eta,
            etas,
            hero: Vec3::ONE,
            thin: p.thin,
            film,
            under_film: [(base_f0, p.specular * opaque), (p.base_color, p.metallic)],
        }
    }

    /// By what radiance scales on its way through: the inside of a solid is denser with it.
    pub(super) fn radiance_scale(&self) -> Vec3 {
        if self.thin { Vec3::ONE } else { 1.0 / (self.etas * self.etas) }
    }

    /// The same for a path that will be of one channel if it is refracted.
    pub(super) fn of_hero(self, hero: Hero) -> Self {
        if !self.is_dispersive() {
            return self;
        }
        let mut weights = Vec3::ZERO;
        weights[hero.channel] = 1.0 / hero.probability;
        Self { eta: self.etas[hero.channel], hero: weights, ..self }
    }

    fn is_dispersive(&self) -> bool {
        self.etas.x != self.etas.z && self.glass > 0.0
    }

    /// The dielectric's largest F0, that of its film too if there is one.
    pub(super) fn largest_f0(&self, p: &SurfaceParameters, f0: Vec3) -> f32 {
        let plain = f0.max_element();
        if self.film.is_absent() || self.under_film[0].1 == 0.0 {
            return plain;
        }
        self.film.largest_f0(self.under_film[0].0, p.specular).max(plain)
    }

    /// Whether nothing is reflected or transmitted.
    pub(super) fn is_absent(&self) -> bool {
        self.glass == 0.0 && self.f90 == 0.0 && self.f0 == Vec3::ZERO
    }

    /// Whether there is no lobe: all is perfect reflection, refraction or straight passage.
    pub(super) fn is_delta_or_absent(&self) -> bool {
        let reflects_nothing =
            self.f90 == 0.0 && self.f0 == Vec3::ZERO && self.glass_f0 == Vec3::ZERO;
        self.ggx.is_smooth() || self.is_absent() || (self.transmits_delta() && reflects_nothing)
    }

    /// The glass, if it is spread on its way through.
    pub(super) fn rough_glass(&self) -> Option<RoughGlass> {
        (self.glass > 0.0 && !self.transmits_delta()).then(|| RoughGlass {
            thin: self.thin,
            eta: self.eta,
            normal: self.glass_at(1.0, self.eta),
        })
    }

    /// Reflectance and transmittance of a facet seen at this cosine.
    ///
    /// A thin wall is two interfaces and all orders of reflection between them:
    /// `R = 2F / (1 + F)`, `T = (1 - F) / (1 + F)`. Coloured F0 takes its largest component away
    /// from what passes (`KHR_materials_specular`), so that white light stays white.
    fn facet(&self, cos: f32) -> Facet {
        let opaque = self.opaque(cos);
        if self.glass == 0.0 {
            return Facet { reflectance: opaque, transmittance: Vec3::ZERO };
        }
        let (mut reflected, passed) = self.glass_at(cos, self.eta);
        if self.is_dispersive() {
            // Each channel is reflected as its own index says; the hero's passes.
            reflected = Vec3::from_array([0, 1, 2].map(|c| self.glass_at(cos, self.etas[c]).0[c]));
        }
        Facet { reflectance: opaque + self.glass * reflected, transmittance: self.tint * passed }
    }

    /// Reflectance of the opaque share.
    fn opaque(&self, cos: f32) -> Vec3 {
        let plain = self.f0 + (self.f90 - self.f0) * schlick_weight(cos);
        if self.film.is_absent() {
            return plain;
        }
        let filmed = |(f0, share): (Vec3, f32)| {
            if share > 0.0 { self.film.reflectance(cos, f0) * share } else { Vec3::ZERO }
        };
        plain.lerp(filmed(self.under_film[0]) + filmed(self.under_film[1]), self.film.share)
    }

    /// Reflectance of the transmissive share, and what passes it, at a relative index.
    fn glass_at(&self, cos: f32, eta: f32) -> (Vec3, f32) {
        let Some(exact) = dielectric(cos, eta) else { return (Vec3::ONE, 0.0) };
        let exact_f0 = normal_reflectance(eta);
        let weight = ((exact - exact_f0) / (1.0 - exact_f0)).clamp(0.0, 1.0);
        let mut fresnel = self.glass_f0 + (self.glass_f90 - self.glass_f0) * weight;
        if !self.film.is_absent() {
            // Both sides see the film alike: by the angle outside.
            let sin2 = (1.0 - cos * cos) / if eta < 1.0 { eta * eta } else { 1.0 };
            let filmed = self.film.reflectance((1.0 - sin2).max(0.0).sqrt(), self.under_film[0].0);
            fresnel = fresnel.lerp(filmed * self.glass_f90, self.film.share);
        }
        let most = fresnel.max_element();
        if self.thin {
            (2.0 * fresnel / (1.0 + fresnel), (1.0 - most) / (1.0 + most))
        } else {
            (fresnel, 1.0 - most)
        }
    }

    /// Light that passes straight through a smooth thin wall.
    pub(super) fn straight_transmittance(&self, cos: f32) -> Vec3 {
        if self.passes_straight() { self.facet(cos).transmittance } else { Vec3::ZERO }
    }

    /// Smooth thin walls: the integrator passes through them.
    fn passes_straight(&self) -> bool {
        self.glass > 0.0 && self.thin && self.ggx.is_smooth()
    }

    /// Transmission without a lobe though the reflection may have one.
    fn transmits_delta(&self) -> bool {
        self.ggx.is_smooth() || (!self.thin && self.eta == 1.0)
    }

    /// The facet as far as `eval` and `sample` answer for it.
    fn scattering_facet(&self, cos: f32) -> Facet {
        let facet = self.facet(cos);
        if self.passes_straight() { Facet { transmittance: Vec3::ZERO, ..facet } } else { facet }
    }

    /// Probability of reflecting at a facet; delta refraction is chosen before the facet is.
    fn reflection_probability(&self, facet: Facet, wo: Vec3) -> f32 {
        if self.glass == 0.0 {
            1.0
        } else if self.transmits_delta() {
            self.scattering_facet(wo.z).reflection_probability()
        } else {
            facet.reflection_probability()
        }
    }

    /// A direction from two uniform numbers and one that chooses between reflection and transmission.
    pub(super) fn sample(&self, wo: Vec3, choice: f32, u: Vec2) -> Option<LobeSample> {
        let smooth = self.ggx.is_smooth();
        let h = if smooth { Vec3::Z } else { self.ggx.sample_visible_normal(wo, u) };
        let facet = self.scattering_facet(wo.dot(h));
        let probability = self.reflection_probability(facet, wo);
        if choice < probability {
            let wi = reflect(wo, h);
            return if smooth {
                Some(LobeSample::Interface(wi, facet.reflectance / probability))
            } else {
                (wi.z > 0.0).then_some(LobeSample::Spread(wi))
            };
        }
        if self.transmits_delta() {
            let (wi, radiance) = self.refracted(wo)?;
            return Some(LobeSample::Interface(wi, radiance * self.hero / (1.0 - probability)));
        }
        let wi = if self.thin {
            reflect(wo, h) * Vec3::new(1.0, 1.0, -1.0)
        } else {
            refract(wo, h, self.eta)?
        };
        (wi.z < 0.0).then_some(LobeSample::Spread(wi))
    }

    /// The direction that a smooth solid refracts light from, and the radiance that comes of it; `None` where
    /// all is reflected.
    pub(super) fn refracted(&self, wo: Vec3) -> Option<(Vec3, Vec3)> {
        let wi = refract(wo, Vec3::Z, self.eta)?;
        Some((wi, self.scattering_facet(wo.z).transmittance / (self.eta * self.eta)))
    }

    /// Shares of light that a smooth facet reflects and transmits at this cosine.
    pub(super) fn smooth_shares(&self, cos: f32) -> [Vec3; 2] {
        let Facet { reflectance, transmittance } = self.facet(cos);
        [reflectance, transmittance]
    }

    /// `f * |cos wi|` of the lobes, and the density of [`Self::sample`] choosing `wi` from them.
    pub(super) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        if self.ggx.is_smooth() {
            return (Vec3::ZERO, 0.0);
        }
        if wi.z > 0.0 {
            return self.eval_pdf_mirrored(wo, wi, true);
        }
        if self.glass == 0.0 || self.transmits_delta() {
            (Vec3::ZERO, 0.0)
        } else if self.thin {
            // KHR_materials_transmission: the reflection lobe, mirrored to the far side.
            self.eval_pdf_mirrored(wo, wi * Vec3::new(1.0, 1.0, -1.0), false)
        } else {
            self.eval_pdf_refracted(wo, wi)
        }
    }

    fn eval_pdf_mirrored(&self, wo: Vec3, wi: Vec3, reflected: bool) -> (Vec3, f32) {
        let Some(h) = (wo + wi).try_normalize() else { return (Vec3::ZERO, 0.0) };
        let facet = self.facet(wo.dot(h));
        let probability = self.reflection_probability(facet, wo);
        let (color, probability) = if reflected {
            (facet.reflectance, probability)
        } else {
            (facet.transmittance, 1.0 - probability)
        };
        let common = self.ggx.distribution(h) * self.ggx.visibility(wo);
        // Visible normals over the Jacobian 4 (wo . h).
        (color * (common * self.ggx.visibility(wi) * wi.z), 0.5 * common * probability)
    }

    /// Walter et al., *Microfacet Models for Refraction through Rough Surfaces*, EGSR 2007, eq. 21,
    /// times `1 / eta^2` for radiance.
    fn eval_pdf_refracted(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        let none = (Vec3::ZERO, 0.0);
        let Some(h) = (wo + self.eta * wi).try_normalize() else { return none };
        let h = if h.z < 0.0 { -h } else { h };
        let (cos_o, cos_i) = (wo.dot(h), wi.dot(h));
        if cos_o <= 0.0 || cos_i >= 0.0 {
            return none;
        }
        let facet = self.facet(cos_o);
        let denominator = cos_o + self.eta * cos_i;
        let jacobian = -cos_i / (denominator * denominator);
        let visible = self.ggx.visible_normal_pdf_solid_angle(wo, h) * jacobian;
        let masking = 2.0 * -wi.z * self.ggx.visibility(-wi);
        let probability = 1.0 - facet.reflection_probability();
        let value = facet.transmittance * self.hero * (visible * masking);
        (value, visible * self.eta * self.eta * probability)
    }

    /// Estimate of all that [`Self::sample`] carries, given the albedo terms at `wo`.
    pub(super) fn albedo(&self, cos: f32, terms: Vec2) -> Vec3 {
        let opaque = if self.film.is_absent() {
            self.f0 * terms.x + self.f90 * terms.y
        } else {
            self.opaque(cos) * (terms.x + terms.y)
        };
        if self.glass == 0.0 {
            return opaque;
        }
        let under_film = self.under_film.map(|(f0, _)| (f0, 0.0));
        let passing = Self { f0: Vec3::ZERO, f90: 0.0, under_film, ..*self }.scattering_facet(cos);
        opaque + passing.reflectance + passing.transmittance
    }
}
