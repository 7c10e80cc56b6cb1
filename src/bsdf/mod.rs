//! How light is scattered at a surface point: glTF 2.0 metallic-roughness with the extensions ior,
//! specular, transmission, volume, anisotropy, sheen, diffuse transmission,
//! iridescence, dispersion and clearcoat.
//!
//! From the outside in: a clearcoat, sheen, the base's GGX interface (`interface`), and a Lambertian
//! body (`diffuse`).
//! Where glTF's sample formulas gain energy or are not reciprocal, they are replaced (the
//! specification allows it): the body gets what the interface leaves over in both directions
//! (`albedo`), and the coat attenuates what is under it on the way in and on the way out. With
//! `specular = 0` a dielectric is exactly Lambert's `base_color / pi`; a metal is `F D G / (4 cos cos)`
//! with Schlick's Fresnel, and what its microfacets scatter more than once (`rescatter`).
//!
//! A point's scattering is `Bsdf::new(&point.parameters, point.front_face)`.
//!
//! Contract: directions are unit and local to the shading frame, whose z is the shading normal on
//! the viewer's side; they point away from the surface. `wi.z > 0` is reflection, `wi.z < 0`
//! transmission. The caller rejects a `wi` that lies on the other side of the geometric surface.

pub(crate) mod albedo;
pub(crate) mod coat;
mod diffuse;
pub(crate) mod fresnel;
pub(crate) mod interface;
pub(crate) mod iridescence;
pub(crate) mod lobes;
pub(crate) mod microfacet;
pub(crate) mod rescatter;
mod sample;
pub(crate) mod sheen;

use glam::{Vec2, Vec3};

use crate::color::importance;
pub use crate::scene::surface::SurfaceParameters;
use albedo::AlbedoTerms;
use coat::Coat;
use diffuse::Diffuse;
pub(crate) use diffuse::cosine_hemisphere;
use fresnel::normal_reflectance;
pub use interface::Hero;
use interface::Interface;
use lobes::{LobeWeights, MAX_NARROW_SHARE};
use rescatter::Rescatter;
pub use sample::BsdfSample;
use sample::LobeSample;
use sheen::Sheen;

/// The scattering at one point, for one side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bsdf {
    interface: Interface,
    diffuse: Diffuse,
    /// `None` if nothing is scattered more than once.
    rescatter: Option<Rescatter>,
    sheen: Sheen,
    coat: Coat,
    /// Whether there is nothing but Lambert's reflection: what most walls are, and cheap.
    pub(crate) is_lambert: bool,
    /// Which part of it this is.
    weights: LobeWeights,
}

/// The scattering towards one direction: what depends on that alone is known.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ViewedBsdf<'a> {
    /// The scattering towards everywhere.
    pub(crate) bsdf: &'a Bsdf,
    wo: Vec3,
    /// `None` if nothing is scattered there; Lambert's needs none.
    out: Option<Outgoing>,
}

/// What depends on `wo` alone: what the interface leaves for the body, and the probability of each
/// lobe, in proportion to its albedo.
#[derive(Debug, Clone, Copy, Default)]
struct Outgoing {
    diffuse_left: f32,
    /// What the interface's single scattering loses.
    lost: f32,
    coat_probability: f32,
    interface_probability: f32,
    sheen_probability: f32,
    rescatter_probability: f32,
    diffuse_probability: f32,
}

impl Bsdf {
    /// The scattering of a surface; `entering` says that the viewer is outside of the solid, i.e. on
    /// the front side. Thin walls are alike from both sides. Whether the surface is unlit is up to
    /// the caller.
    pub fn new(p: &SurfaceParameters, entering: bool) -> Self {
        let f90 = p.specular;
        let f0 = (normal_reflectance(p.ior) * p.specular_color).min(Vec3::ONE) * p.specular;
        let interface = Interface::new(p, f0, f90, entering);
        let f0_f90 = Vec2::new(interface.largest_f0(p, f0), f90);
        let terms = AlbedoTerms::of(interface.ggx, p.roughness);
        let diffuse = Diffuse::new(p, f0_f90, terms, &interface);
        let rescatter = Rescatter::new(p, terms, &interface);
        let (sheen, coat) = (Sheen::new(p, entering), Coat::new(p, entering));
        let is_lambert =
            diffuse.is_lambert() && interface.is_absent() && sheen.is_absent() && coat.is_absent();
        Self { interface, diffuse, rescatter, sheen, coat, is_lambert, weights: LobeWeights::ALL }
    }

    /// The same for a path of which one channel stands for all if a dispersive solid refracts it.
    /// Without a hero all channels are refracted alike.
    pub fn of_hero(self, hero: Hero) -> Self {
        Self { interface: self.interface.of_hero(hero), ..self }
    }

    /// `f(wo, wi) * |cos wi|` of all lobes that have a density, per steradian.
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        self.eval_pdf(wo, wi).0
    }

    /// A direction to continue in from three uniform numbers in `[0,1)`: the first chooses the lobe,
    /// the others the direction. `None` is absorption: the sample counts as zero.
    pub fn sample(&self, wo: Vec3, u: Vec3) -> Option<BsdfSample> {
        self.viewed_from(wo).sample(u)
    }

    /// The scattering towards `wo`, for whoever asks for it more than once.
    pub(crate) fn viewed_from(&self, wo: Vec3) -> ViewedBsdf<'_> {
        let out = if self.is_lambert { None } else { self.outgoing(wo) };
        ViewedBsdf { bsdf: self, wo, out }
    }

    /// Density per steradian of [`Self::sample`] at `wi`, perfect reflection and refraction left out;
    /// its integral is below 1 by the probability of those and of absorption.
    pub fn pdf_solid_angle(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.eval_pdf(wo, wi).1
    }

    /// [`Self::eval`] and [`Self::pdf_solid_angle`] at once.
    pub fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        self.viewed_from(wo).eval_pdf(wi)
    }

    /// Whether reflections are no narrower than GGX makes them with this alpha.
    pub(crate) fn is_broad(&self, min_alpha: f32) -> bool {
        self.narrow_lobes(min_alpha) == [false; 2]
    }

    /// Whether coat and interface are narrower than GGX makes them with this alpha.
    fn narrow_lobes(&self, min_alpha: f32) -> [bool; 2] {
        let Self { coat, interface, weights, .. } = self;
        [
            weights.coat > 0.0 && !coat.is_absent() && coat.ggx.alpha < min_alpha,
            weights.interface > 0.0 && !interface.is_absent() && interface.ggx.alpha < min_alpha,
        ]
    }

    /// Its narrow or its broad lobes, divided by the probability of that part; `None` if it does not have both. The
    /// narrow part has the probability of its share of the albedo towards the unit local direction `wo`, or this
    /// minimum. `u` draws a uniform number.
    pub(crate) fn split(
        &self,
        min_alpha: f32,
        (wo, min_probability): (Vec3, f32),
        u: impl FnOnce() -> f32,
    ) -> Option<Self> {
        let narrow @ [coat, interface] = self.narrow_lobes(min_alpha);
        let out = self.outgoing(wo).filter(|_| coat || interface)?;
        let by_interface = out.interface_probability + out.rescatter_probability;
        let share = f32::from(coat) * out.coat_probability + f32::from(interface) * by_interface;
        (share > 0.0 && share <= MAX_NARROW_SHARE).then(|| {
            let probability = share.max(min_probability);
            Self { weights: LobeWeights::of_part(narrow, probability, u()), ..*self }
        })
    }

    /// Whether it is no part of another one.
    pub(crate) fn is_whole(&self) -> bool {
        self.weights == LobeWeights::ALL
    }

    /// The factor of a part: 1 over its probability.
    pub(crate) fn weight(&self) -> f32 {
        self.weights.max()
    }

    /// Whether only the body scatters: then the BSDF is [`Self::left`] of one direction times a function of the other.
    pub(crate) fn is_body_only(&self) -> bool {
        let Self { interface, rescatter, weights, .. } = self;
        (weights.interface == 0.0 || interface.is_absent() && rescatter.is_none())
            && (weights.coat == 0.0 || self.coat.is_absent())
            && self.sheen.is_absent()
    }

    /// Share of the body's light that coat and interface transmit in the unit local direction `v`, in `[0,1]`.
    pub(crate) fn left(&self, v: Vec3) -> f32 {
        self.coat.attenuation(v) * self.diffuse.left(v)
    }

    /// The coat's local normal, if there is a coat.
    pub(crate) fn coat_normal(&self) -> Option<Vec3> {
        (!self.coat.is_absent()).then_some(self.coat.frame.z)
    }

    /// Whether next event estimation can find light: not for a part that only reflects perfectly.
    pub(crate) fn gathers(&self) -> bool {
        self.weights.others > 0.0 || !self.is_delta_only()
    }

    /// Light that goes straight through: smooth thin-walled transmission, tinted by the base colour.
    ///
    /// No part of it is in `eval` or `sample`: the integrator lets paths and shadow rays through
    /// alike. The wall's reflection is in `sample`, so the two are to be added, not mixed.
    pub fn straight_transmittance(&self, wo: Vec3) -> Vec3 {
        self.interface.straight_transmittance(wo.z.abs()) * self.left_by_layers(wo, wo)
    }

    /// The unit direction that smooth glass without coat or sheen refracts light from, and what radiance is
    /// multiplied with on the way, linear RGB; `None` where all is reflected.
    pub(crate) fn refracted(&self, wo: Vec3) -> Option<(Vec3, Vec3)> {
        self.interface.refracted(wo)
    }

    /// Whether all scattering is perfect reflection or refraction (or there is none), so that
    /// sampling lights at this point is useless.
    pub fn is_delta_only(&self) -> bool {
        let Self { interface, rescatter, weights, .. } = self;
        (weights.others == 0.0 || self.diffuse.is_absent() && self.sheen.is_hidden())
            && (weights.interface == 0.0 || interface.is_delta_or_absent() && rescatter.is_none())
            && (weights.coat == 0.0 || self.coat.is_delta_or_absent())
    }

    /// Share of uniform light from everywhere that reaches a viewer straight above, in `[0,1]`, or times the weight of a
    /// part; an estimate for guide layers of denoisers.
    pub fn albedo(&self) -> Vec3 {
        let up = Vec3::Z;
        let terms = self.diffuse.terms.at(up);
        let scale = self.interface.radiance_scale();
        let diffuse = self.diffuse.albedo(self.diffuse.left_of(terms), scale);
        let interface =
            self.interface.albedo(1.0, terms) + self.interface.straight_transmittance(1.0);
        let rescattered = self.rescatter.as_ref();
        let rescattered = rescattered.map_or(Vec3::ZERO, |lobe| lobe.albedo(lobe.lost(up), scale));
        let base =
            (interface + rescattered) * self.weights.interface + diffuse * self.weights.others;
        let base = self.sheen.left(up, Sheen::TYPICAL) * base;
        let under = self.coat.attenuation(up);
        let under = under * under * (self.sheen.colored_albedo(up) * self.weights.others + base);
        let albedo = self.coat.albedo(up) * self.weights.coat + under;
        albedo.clamp(Vec3::ZERO, Vec3::splat(self.weights.max()))
    }

    fn eval_pdf_with(&self, wo: Vec3, wi: Vec3, out: &Outgoing) -> (Vec3, f32) {
        let (mut value, mut pdf) = (Vec3::ZERO, 0.0);
        if out.diffuse_probability > 0.0 {
            let (diffuse, diffuse_pdf) = self.diffuse.eval_pdf(out.diffuse_left, wi);
            value += diffuse;
            pdf += out.diffuse_probability * diffuse_pdf;
        }
        if out.interface_probability > 0.0 {
            let (interface, interface_pdf) = self.interface.eval_pdf(wo, wi);
            value += interface;
            pdf += out.interface_probability * interface_pdf;
        }
        if let Some(rescatter) = &self.rescatter
            && out.rescatter_probability > 0.0
        {
            let (rescattered, rescatter_pdf) = rescatter.eval_pdf(out.lost, wi);
            value += rescattered;
            pdf += out.rescatter_probability * rescatter_pdf;
        }
        if !self.sheen.is_absent() {
            value *= self.sheen.left(wo, wi);
            if out.sheen_probability > 0.0 {
                let (sheen, sheen_pdf) = self.sheen.eval_pdf(wo, wi);
                value += sheen;
                pdf += out.sheen_probability * sheen_pdf;
            }
        }
        if !self.coat.is_absent() {
            value *= self.coat.attenuation(wo) * self.coat.attenuation(wi);
            if out.coat_probability > 0.0 {
                let (coat, coat_pdf) = self.coat.eval_pdf(wo, wi);
                value += Vec3::splat(coat);
                pdf += out.coat_probability * coat_pdf;
            }
        }
        (value * self.weights.max(), pdf)
    }

    /// What coat and sheen leave of the base's light between two directions.
    fn left_by_layers(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.coat.attenuation(wo) * self.coat.attenuation(wi) * self.sheen.left(wo, wi)
    }

    /// `None` if nothing is scattered towards `wo`.
    fn outgoing(&self, wo: Vec3) -> Option<Outgoing> {
        if wo.z.is_nan() || wo.z <= 0.0 {
            return None;
        }
        if self.coat.is_absent() && self.sheen.is_absent() && self.rescatter.is_none() {
            // One lobe, or none, needs no albedos.
            let (diffuse, interface) = (!self.diffuse.is_absent(), !self.interface.is_absent());
            if !(diffuse && interface) {
                return (diffuse || interface).then(|| Outgoing {
                    diffuse_left: 1.0,
                    interface_probability: f32::from(interface),
                    diffuse_probability: f32::from(diffuse),
                    ..Outgoing::default()
                });
            }
        }
        let terms = self.diffuse.terms.at(wo);
        let diffuse_left = self.diffuse.left_of(terms);
        let under = self.coat.attenuation(wo);
        let base = under * self.sheen.left(wo, wo);
        let weights = self.weights;
        let coat = weights.coat * self.coat.albedo(wo);
        let sheen = weights.others * under * importance(self.sheen.colored_albedo(wo));
        let diffuse = weights.others * base * diffuse_left * self.diffuse.importance();
        let base = weights.interface * base;
        let interface = base * importance(self.interface.albedo(wo.z, terms));
        let lost = self.rescatter.as_ref().map_or(0.0, |rescatter| rescatter.lost(wo));
        let rescatter = self.rescatter.as_ref().map_or(0.0, |r| base * r.importance(lost));
        let sum = coat + interface + sheen + rescatter + diffuse;
        (sum > 0.0).then(|| Outgoing {
            diffuse_left,
            lost,
            coat_probability: coat / sum,
            interface_probability: interface / sum,
            sheen_probability: sheen / sum,
            rescatter_probability: rescatter / sum,
            diffuse_probability: diffuse / sum,
        })
    }
}

impl<'a> ViewedBsdf<'a> {
    /// Shares of light that its interface, if it is smooth, reflects and transmits, linear RGB in `[0,1]`.
    pub(crate) fn smooth_shares(&self) -> [Vec3; 2] {
        self.bsdf.interface.smooth_shares(self.wo.z.abs())
    }

    /// Albedo towards the viewer: [`Bsdf::albedo`], scaled by what absent layers transmit towards the viewer relative
    /// to the normal.
    pub(crate) fn albedo(&self) -> Vec3 {
        let Bsdf { weights, coat, diffuse, .. } = self.bsdf;
        let transmitted = |v: Vec3| {
            let by_coat = if weights.coat == 0.0 { coat.attenuation(v) } else { 1.0 };
            by_coat * if weights.interface == 0.0 { diffuse.left(v) } else { 1.0 }
        };
        let up = transmitted(Vec3::Z);
        if up > 0.0 { self.bsdf.albedo() * (transmitted(self.wo) / up) } else { Vec3::ZERO }
    }

    /// See [`Bsdf::eval`].
    pub(crate) fn eval(&self, wi: Vec3) -> Vec3 {
        self.eval_pdf(wi).0
    }

    /// See [`Bsdf::eval_pdf`].
    pub(crate) fn eval_pdf(&self, wi: Vec3) -> (Vec3, f32) {
        let Self { bsdf, wo, out } = self;
        if bsdf.is_lambert {
            return if wo.z > 0.0 { bsdf.diffuse.lambert(wi) } else { (Vec3::ZERO, 0.0) };
        }
        out.as_ref().map_or((Vec3::ZERO, 0.0), |out| bsdf.eval_pdf_with(*wo, wi, out))
    }

    /// See [`Bsdf::sample`].
    pub(crate) fn sample(&self, u: Vec3) -> Option<BsdfSample> {
        let Self { bsdf, wo, out } = *self;
        let direction = Vec2::new(u.y, u.z);
        if bsdf.is_lambert {
            let wi = cosine_hemisphere(direction);
            return BsdfSample::spread(wi, self.eval_pdf(wi));
        }
        let out = out?;
        let choice = u.x - out.coat_probability;
        let lobe = if choice < 0.0 {
            bsdf.coat.sample(wo, direction, out.coat_probability)?
        } else if choice < out.interface_probability {
            let choice = (choice / out.interface_probability).min(1.0 - f32::EPSILON);
            bsdf.interface.sample(wo, choice, direction)?
        } else {
            let choice = choice - out.interface_probability;
            if choice < out.sheen_probability {
                LobeSample::Spread(Sheen::sample(direction))
            } else {
                let choice = choice - out.sheen_probability;
                LobeSample::Spread(match &bsdf.rescatter {
                    Some(rescatter) if choice < out.rescatter_probability => {
                        rescatter.sample(choice / out.rescatter_probability, direction)
                    }
                    _ => {
                        let choice = choice - out.rescatter_probability;
                        bsdf.diffuse.sample(choice / out.diffuse_probability, direction)
                    }
                })
            }
        };
        match lobe {
            LobeSample::Spread(wi) => BsdfSample::spread(wi, bsdf.eval_pdf_with(wo, wi, &out)),
            LobeSample::Coat(wi, weight) => BsdfSample::delta(wi, weight * bsdf.weights.max()),
            LobeSample::Interface(wi, weight) => {
                let left = bsdf.weights.max() * bsdf.left_by_layers(wo, wi);
                BsdfSample::delta(wi, weight * (left / out.interface_probability))
            }
        }
    }
}

/// Share of what is under a surface's coat that passes it towards a unit local `wo`, in `[0,1]`.
pub(crate) fn left_by_coat(p: &SurfaceParameters, entering: bool, wo: Vec3) -> f32 {
    Coat::new(p, entering).attenuation(wo)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// White, and nothing else.
    fn white() -> SurfaceParameters {
        SurfaceParameters {
            base_color: Vec3::ONE,
            ior: 1.5,
            specular_color: Vec3::ONE,
            thin: true,
            anisotropy_axis: Vec2::X,
            clearcoat_normal: Vec3::Z,
            ..SurfaceParameters::default()
        }
    }

    #[test]
    fn the_short_cut_is_taken_by_lambert_alone() {
        let lambert = |p: SurfaceParameters| Bsdf::new(&p, true).is_lambert;
        let white = white();
        assert!(
            lambert(white) && lambert(SurfaceParameters { roughness: 1.0, thin: false, ..white })
        );
        for other in [
            SurfaceParameters { base_color: Vec3::ZERO, ..white },
            SurfaceParameters { metallic: 0.5, ..white },
            SurfaceParameters { specular: 0.1, ..white },
            SurfaceParameters { transmission: 0.5, ..white },
            SurfaceParameters {
                diffuse_transmission: 0.5,
                diffuse_transmission_color: Vec3::ONE,
                ..white
            },
            SurfaceParameters { sheen_color: Vec3::X, ..white },
            SurfaceParameters { clearcoat: 0.1, ..white },
        ] {
            assert!(!lambert(other), "{other:?}");
        }
    }

    #[test]
    fn the_short_cut_changes_no_bit() {
        let color = Vec3::new(0.8, 0.3, 0.05);
        let short = Bsdf::new(&SurfaceParameters { base_color: color, ..white() }, true);
        let long = Bsdf { is_lambert: false, ..short };
        let random =
            |i: u32, n: u32| crate::sampler::unit_from_bits(crate::sampler::hash(8 * i + n));
        let direction = |i, n| Sheen::sample(Vec2::new(random(i, n), 2.0 * random(i, n + 1) - 1.0));
        for i in 0..10_000 {
            let (wo, wi) = (direction(i, 0), direction(i, 2));
            assert_eq!(short.eval_pdf(wo, wi), long.eval_pdf(wo, wi), "{wo} {wi}");
            let u = Vec3::new(random(i, 4), random(i, 5), random(i, 6));
            assert_eq!(short.sample(wo, u), long.sample(wo, u), "{wo} {u}");
        }
        let grazing = Vec3::X;
        assert_eq!(short.eval_pdf(grazing, Vec3::Z), long.eval_pdf(grazing, Vec3::Z));
        assert_eq!(short.eval_pdf(Vec3::Z, grazing), long.eval_pdf(Vec3::Z, grazing));
        assert_eq!(short.albedo(), long.albedo());
        assert_eq!(short.is_delta_only(), long.is_delta_only());
    }
}
