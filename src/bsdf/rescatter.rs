//! Light that rough metal and rough glass scatter more than once among their microfacets, which Smith's
//! masking takes for lost: at roughness 1 two thirds of it.
//!
//! It leaves as from a Lambertian surface, in proportion to what the single scattering of both directions
//! loses, `(1 - E(o)) (1 - E(i)) / (pi (1 - E_mean))`, which is reciprocal and adds up to 1 (Kulla and
//! Conty, *Revisiting Physically Based Shading at Imageworks*, SIGGRAPH 2017). A metal colours each
//! further scattering. The two sides of a solid give each other `a b / (a + b)`, where `a` and `b` are what
//! they lose on average, times their squared indices.

use std::f32::consts::FRAC_1_PI;
use std::sync::LazyLock;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::SurfaceParameters;
use super::albedo::{AlbedoTerms, split};
use super::diffuse::cosine_hemisphere;
use super::fresnel::{dielectric, reflect, refract};
use super::interface::Interface;
use super::microfacet::Ggx;
use crate::color::importance;

/// Nodes of the table of solid glass in the square root of the cosine, and in the roughness.
pub(crate) const NODES: usize = 16;
/// Its nodes in `(eta - 1) / (eta + 1)`, which goes from `-MAX_INDEX` to `MAX_INDEX`.
pub(crate) const INDICES: usize = 33;
pub(crate) const MAX_INDEX: f32 = 0.45;
/// Visible normals per entry.
const SAMPLES: u32 = 512;
/// Average losses below this count as none.
pub(crate) const MIN_LOSS: f32 = 1e-4;

/// What white glass loses by index, roughness and square root of the cosine; the last of a row is its
/// cosine-weighted mean.
static LOSSES: LazyLock<Vec<[f32; NODES + 1]>> = LazyLock::new(|| {
    let row = |row: usize| glass_row(row / NODES, (row % NODES) as f32 / LAST);
    (0..INDICES * NODES).into_par_iter().map(row).collect()
});
const LAST: f32 = (NODES - 1) as f32;

/// The lobe of one point, for one side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rescatter {
    /// Share of the lost light that leaves on this side, by colour.
    reflected: Vec3,
    /// The same on the far side; radiance through a solid's surface scales by the squared relative index.
    transmitted: Vec3,
    /// Probability of choosing the far side.
    through: f32,
    near: Loss,
    far: Loss,
}

/// What single scattering loses of white light.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Loss {
    albedo: Albedo,
    /// One over its cosine-weighted mean.
    inverse_mean: f32,
}

/// Where the albedo of single scattering is looked up.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Albedo {
    /// All is reflected, by either side of a thin wall too.
    Mirrors(AlbedoTerms),
    /// A solid of this relative index.
    Refracts(Ggx, f32),
}

impl Rescatter {
    /// `terms` are those of the interface. `None` where all microfacets lie in the surface or let nothing
    /// back.
    pub(super) fn new(
        p: &SurfaceParameters,
        terms: AlbedoTerms,
        interface: &Interface,
    ) -> Option<Self> {
        // Metal that is no mirror, or what an infinite index makes one (specular-glossiness).
        let is_metal = (p.metallic > 0.0 || p.ior == 0.0) && !interface.ggx.is_smooth();
        let glass = interface.rough_glass();
        if !is_metal && glass.is_none() {
            return None;
        }
        let mut near = Loss::of(Albedo::Mirrors(terms));
        let mut far = near;
        let mut reflected = match is_metal {
            true => metals_color(p, terms.mean()),
            false => Vec3::ZERO,
        };
        let mut transmitted = Vec3::ZERO;
        if let Some(glass) = glass {
            let share = (1.0 - p.metallic) * p.transmission;
            let (back, through) = if glass.thin {
                glass.normal
            } else {
                let eta = glass.eta;
                let sides = [eta, 1.0 / eta].map(|eta| Albedo::Refracts(interface.ggx, eta));
                [near, far] = sides.map(Loss::of);
                let [a, b] = [1.0 / near.inverse_mean, eta * eta / far.inverse_mean];
                let share = p.specular / (a + b);
                (Vec3::splat(a * share), b * share / (eta * eta))
            };
            reflected += share * back;
            transmitted = p.base_color * (share * through);
        }
        let [back, through] = [reflected, transmitted].map(importance);
        let through = if through > 0.0 { through / (back + through) } else { 0.0 };
        (back + through > 0.0).then_some(Self { reflected, transmitted, through, near, far })
    }

    /// What single scattering loses towards `wo`, above the surface.
    pub(super) fn lost(&self, wo: Vec3) -> f32 {
        self.near.at(wo)
    }

    /// Share of uniform light from everywhere that reaches a viewer towards whom `lost` is lost.
    pub(super) fn albedo(&self, lost: f32, radiance_scale: Vec3) -> Vec3 {
        (self.reflected + self.transmitted / radiance_scale) * lost
    }

    /// What the lobe weighs beside others.
    pub(super) fn importance(&self, lost: f32) -> f32 {
        importance(self.reflected + self.transmitted) * lost
    }

    /// A direction with density `cos / pi`, on the side that a uniform number chooses.
    pub(super) fn sample(&self, choice: f32, u: Vec2) -> Vec3 {
        let wi = cosine_hemisphere(u);
        if choice < self.through { -wi } else { wi }
    }

    /// `f * |cos wi|` for a viewer towards whom `lost` is lost, and the density of [`Self::sample`].
    pub(super) fn eval_pdf(&self, lost: f32, wi: Vec3) -> (Vec3, f32) {
        let lambert = wi.z.abs() * FRAC_1_PI;
        let (color, loss, v, probability) = if wi.z > 0.0 {
            (self.reflected, &self.near, wi, 1.0 - self.through)
        } else {
            (self.transmitted, &self.far, -wi, self.through)
        };
        if probability <= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let pair = lost * loss.at(v) * loss.inverse_mean;
        (color * (pair * lambert), lambert * probability)
    }
}

impl Loss {
    fn of(albedo: Albedo) -> Self {
        let mean = match albedo {
            Albedo::Mirrors(terms) => 1.0 - terms.mean().element_sum(),
            Albedo::Refracts(ggx, eta) => {
                glass_loss_at(eta, ggx.roughness_off_axis(FRAC, FRAC), NODES as f32)
            }
        };
        Self { albedo, inverse_mean: 1.0 / mean.max(MIN_LOSS) }
    }

    /// What is lost towards a unit `v` above the surface.
    fn at(&self, v: Vec3) -> f32 {
        match self.albedo {
            Albedo::Mirrors(terms) => (1.0 - terms.at(v).element_sum()).max(0.0),
            Albedo::Refracts(ggx, eta) => {
                let roughness =
                    if ggx.is_stretched() { ggx.roughness_towards(v) } else { ggx.alpha.sqrt() };
                glass_loss_at(eta, roughness, v.z.clamp(0.0, 1.0).sqrt() * LAST)
            }
        }
    }
}

/// Halfway between along and across the axis.
const FRAC: f32 = std::f32::consts::FRAC_1_SQRT_2;

/// What leaves of light that is scattered twice or more by metal, and by a dielectric of infinite index.
fn metals_color(p: &SurfaceParameters, mean: Vec2) -> Vec3 {
    let mut color = metal_color(p.base_color, mean) * p.metallic;
    if p.ior == 0.0 {
        let opaque = (1.0 - p.metallic) * (1.0 - p.transmission);
        let f0 = p.specular_color.min(Vec3::ONE);
        // The diffuse base has its share of what the reflection loses.
        color += metal_color(f0, mean) * (p.specular * opaque) * (1.0 - p.base_color);
    }
    color
}

/// What leaves of light that a metal of this F0 scatters twice or more, by the mean albedo terms.
fn metal_color(f0: Vec3, mean: Vec2) -> Vec3 {
    let escapes = mean.element_sum();
    // Cosine-weighted mean of Schlick's Fresnel.
    let fresnel = f0 + (1.0 - f0) * (1.0 / 21.0);
    fresnel * fresnel * escapes / (1.0 - fresnel * (1.0 - escapes))
}

/// What white glass loses, from the table, by a place in its row: [`NODES`] is the mean's.
fn glass_loss_at(eta: f32, roughness: f32, column: f32) -> f32 {
    let z = (((eta - 1.0) / (eta + 1.0)).clamp(-MAX_INDEX, MAX_INDEX) + MAX_INDEX)
        * ((INDICES - 1) as f32 / (2.0 * MAX_INDEX));
    let (index, index_rest) = split(z, INDICES - 2);
    let (row, row_rest) = split(roughness * LAST, NODES - 2);
    let (at, rest) = split(column, NODES);
    let last = if rest > 0.0 { at + 1 } else { at };
    let value = |row: usize| LOSSES[row][at] + (LOSSES[row][last] - LOSSES[row][at]) * rest;
    let between = |first: usize, second: usize, rest: f32| {
        let (a, b) = (value(first), value(second));
        a + (b - a) * rest
    };
    let near = between(index * NODES + row, index * NODES + row + 1, row_rest);
    let next = between((index + 1) * NODES + row, (index + 1) * NODES + row + 1, row_rest);
    near + (next - near) * index_rest
}

/// The row of [`LOSSES`] at a node of the relative index, and a roughness.
fn glass_row(index: usize, roughness: f32) -> [f32; NODES + 1] {
    let z = (2.0 * index as f32 / (INDICES - 1) as f32 - 1.0) * MAX_INDEX;
    let eta = (1.0 + z) / (1.0 - z);
    let ggx = Ggx::from_roughness(roughness);
    let mut row = [0.0; NODES + 1];
    for (i, entry) in row.iter_mut().take(NODES).enumerate() {
        *entry = glass_loss(ggx, eta, (i as f32 / LAST).powi(2).max(1e-5), SAMPLES);
    }
    // The integral of 2 cos L over each piece, linear in x = sqrt(cos): 4 x^3 (offset + slope x).
    let of_piece = |i: usize| {
        let (x0, x1) = (i as f32 / LAST, (i + 1) as f32 / LAST);
        let slope = (row[i + 1] - row[i]) * LAST;
        let offset = row[i] - slope * x0;
        offset * (x1.powi(4) - x0.powi(4)) + slope * (0.8 * (x1.powi(5) - x0.powi(5)))
    };
    row[NODES] = (0..NODES - 1).map(of_piece).sum();
    row
}

/// Share of light that the interface of a solid neither reflects nor refracts by single scattering, from
/// visible normals at the points of the R2 sequence, as for [`AlbedoTerms`].
fn glass_loss(ggx: Ggx, eta: f32, cos: f32, samples: u32) -> f32 {
    if ggx.is_smooth() {
        return 0.0;
    }
    let wo = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
    let masking = |wi: Vec3| 2.0 * wi.z * ggx.visibility(wi);
    let mut sum = 0.0;
    let mut u = Vec2::splat(0.5);
    for _ in 0..samples {
        u = (u + Vec2::new(0.754_877_7, 0.569_840_3)).fract();
        let h = ggx.sample_visible_normal(wo, u);
        let fresnel = dielectric(wo.dot(h), eta).unwrap_or(1.0);
        let back = reflect(wo, h);
        if back.z > 0.0 {
            sum += fresnel * masking(back);
        }
        if let Some(through) = refract(wo, h, eta).filter(|wi| wi.z < 0.0) {
            sum += (1.0 - fresnel) * masking(-through);
        }
    }
    (1.0 - sum / samples as f32).max(0.0)
}

/// The table of solid glass as `shaders/rescatter.wgsl` reads it: each entry with those of the next
/// roughness, the next index and both.
pub(crate) fn texels() -> Vec<[f32; 4]> {
    let mut texels = Vec::new();
    for index in 0..INDICES - 1 {
        for row in 0..NODES - 1 {
            let at = index * NODES + row;
            let rows = [at, at + 1, at + NODES, at + NODES + 1].map(|row| &LOSSES[row]);
            texels.extend((0..=NODES).map(|column| rows.map(|row| row[column])));
        }
    }
    texels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_close_to_fine_quadrature_between_its_nodes() {
        let mut worst = 0.0_f32;
        for (eta, r, c) in [0.45_f32, 0.66, 0.9, 1.2, 1.45, 1.8, 2.4]
            .into_iter()
            .flat_map(|eta| (0..8).flat_map(move |r| (0..8).map(move |c| (eta, r, c))))
        {
            let (roughness, cos) = ((r as f32 + 0.37) / 8.0, (c as f32 + 0.43) / 8.0);
            let exact = glass_loss(Ggx::from_roughness(roughness), eta, cos, 1 << 14);
            worst = worst.max((glass_loss_at(eta, roughness, cos.sqrt() * LAST) - exact).abs());
        }
        assert!(worst < 0.01, "{worst}");
    }
}
