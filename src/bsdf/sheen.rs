//! `KHR_materials_sheen`: light that upright fibres scatter back at grazing angles.
//!
//! The microfacets are of Estevez and Kulla's distribution with their fit of its masking (*Production
//! Friendly Microfacet Sheen BRDF*, 2017), as the extension asks. Of narrow lobes that fit scatters
//! more than arrives, at most three times; such a lobe is divided by what it gains. What is under the
//! sheen gets what its tabulated albedo leaves of both directions, the smaller of the two.

use std::array;
use std::f32::consts::{PI, TAU};
use std::sync::LazyLock;

use glam::{Vec2, Vec3};

use super::SurfaceParameters;
use super::albedo::split;
use crate::math::sin_cos_turns;

pub(crate) const COSINES: usize = 32;
const ROUGHNESSES: usize = 32;
/// Steps of the quadrature in each direction: the table is within 0.01 of its limit, between nodes
/// too.
const STEPS: usize = 48;

/// Below this perceptual roughness the lobe is narrower than its table resolves.
pub(crate) const MIN_ROUGHNESS: f32 = 0.07;

/// Density per steradian of uniform directions above the surface.
const UNIFORM: f32 = 1.0 / TAU;

/// Albedos of white sheen by roughness, then at uniformly spaced square roots of the cosine.
static ALBEDOS: LazyLock<[[f32; COSINES]; ROUGHNESSES]> = LazyLock::new(|| {
    array::from_fn(|row| {
        let lobe = Charlie::new(row as f32 / (ROUGHNESSES - 1) as f32);
        array::from_fn(|i| lobe.albedo((i as f32 / (COSINES - 1) as f32).powi(2).max(1e-4), STEPS))
    })
});

/// The table as `shaders/sheen.wgsl` reads it: each entry with that of the row after it.
pub(crate) fn texels() -> Vec<[f32; 4]> {
    let pairs = ALBEDOS.windows(2).flat_map(|rows| rows[0].iter().zip(&rows[1]));
    pairs.map(|(here, next)| [*here, *next, 0.0, 0.0]).collect()
}

/// The sheen of one point, for one side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sheen {
    color: Vec3,
    /// Its largest component: what is taken from the base is grey.
    strength: f32,
    lobe: Charlie,
    thin: bool,
    entering: bool,
    roughness: f32,
}

impl Sheen {
    const ABSENT: Self = Self {
        color: Vec3::ZERO,
        strength: 0.0,
        lobe: Charlie { inverse_alpha: 1.0, fit: [0.0; 5] },
        thin: true,
        entering: true,
        roughness: 0.0,
    };

    /// Where light under a sheen mostly comes from, for estimates.
    pub(crate) const TYPICAL: Vec3 = Vec3::new(0.0, 0.76, 0.65);

    pub(crate) fn new(p: &SurfaceParameters, entering: bool) -> Self {
        if p.sheen_color == Vec3::ZERO {
            return Self::ABSENT;
        }
        let (color, roughness) = (p.sheen_color, p.sheen_roughness);
        let (strength, lobe) = (color.max_element(), Charlie::new(roughness));
        Self { color, strength, lobe, thin: p.thin, entering, roughness }
    }

    pub(super) fn is_absent(&self) -> bool {
        self.strength == 0.0
    }

    /// Whether there is none on the viewer's side.
    pub(super) fn is_hidden(&self) -> bool {
        self.is_absent() || !self.is_outside(1.0)
    }

    /// Share of the light towards `v` that it scatters, without colour; 0 inside of a solid.
    pub(crate) fn albedo(&self, v: Vec3) -> f32 {
        if self.is_outside(v.z) { self.gain(v.z.abs()).min(1.0) } else { 0.0 }
    }

    /// The same in colour. Without sheen the table, which takes long to make, is not asked.
    pub(super) fn colored_albedo(&self, v: Vec3) -> Vec3 {
        if self.is_absent() { Vec3::ZERO } else { self.color * self.albedo(v) }
    }

    /// What of a base's light is left between two directions.
    pub(crate) fn left(&self, wo: Vec3, wi: Vec3) -> f32 {
        if self.is_absent() {
            return 1.0;
        }
        1.0 - self.strength * self.albedo(wo).max(self.albedo(wi))
    }

    /// A direction above the surface with density `1 / 2pi`.
    pub(crate) fn sample(u: Vec2) -> Vec3 {
        let (sin_phi, cos_phi) = sin_cos_turns(u.x);
        let r = (1.0 - u.y * u.y).max(0.0).sqrt();
        Vec3::new(r * cos_phi, r * sin_phi, u.y)
    }

    /// `f * cos` and the density of [`Self::sample`].
    pub(crate) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Vec3, f32) {
        if wi.z <= 0.0 || !self.is_outside(wo.z) {
            return (Vec3::ZERO, 0.0);
        }
        let Some(h) = (wo + wi).try_normalize() else { return (Vec3::ZERO, UNIFORM) };
        let gain = self.gain(wo.z).max(self.gain(wi.z)).max(1.0);
        let value = self.lobe.distribution(h) * self.lobe.visibility(wo.z, wi.z) * wi.z;
        (self.color * (value / gain), UNIFORM)
    }

    /// What the lobe scatters towards this cosine of light 1 from everywhere; above 1 where it gains.
    fn gain(&self, cos: f32) -> f32 {
        let (row, down) = split(self.roughness * (ROUGHNESSES - 1) as f32, ROUGHNESSES - 2);
        let x = cos.clamp(0.0, 1.0).sqrt() * (COSINES - 1) as f32;
        let (column, across) = split(x, COSINES - 2);
        let in_row = |row: &[f32; COSINES]| row[column] + (row[column + 1] - row[column]) * across;
        let (here, next) = (in_row(&ALBEDOS[row]), in_row(&ALBEDOS[row + 1]));
        here + (next - here) * down
    }

    fn is_outside(&self, z: f32) -> bool {
        self.thin || (z > 0.0) == self.entering
    }
}

/// Estevez and Kulla's microfacets.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Charlie {
    inverse_alpha: f32,
    /// Terms of the fit of Smith's lambda: `a / (1 + b x^c) + d x + e`.
    fit: [f32; 5],
}

impl Charlie {
    fn new(roughness: f32) -> Self {
        let alpha = roughness.max(MIN_ROUGHNESS).powi(2);
        let t = (1.0 - alpha) * (1.0 - alpha);
        let mix = |rough: f32, smooth: f32| rough + (smooth - rough) * t;
        Self {
            inverse_alpha: 1.0 / alpha,
            fit: [
                mix(21.5473, 25.3245),
                mix(3.82987, 3.32435),
                mix(0.19823, 0.16801),
                mix(-1.97760, -1.27393),
                mix(-4.32054, -4.85967),
            ],
        }
    }

    fn distribution(&self, h: Vec3) -> f32 {
        let sin2 = (h.x * h.x + h.y * h.y).max(1e-30);
        (2.0 + self.inverse_alpha) * sin2.powf(0.5 * self.inverse_alpha) / TAU
    }

    fn visibility(&self, cos_o: f32, cos_i: f32) -> f32 {
        1.0 / ((1.0 + self.lambda(cos_o) + self.lambda(cos_i)) * (4.0 * cos_o * cos_i))
    }

    fn lambda(&self, cos: f32) -> f32 {
        let [a, b, c, d, e] = self.fit;
        let exponent = |x: f32| a / (1.0 + b * x.max(1e-9).powf(c)) + d * x + e;
        if cos < 0.5 {
            exponent(cos).exp()
        } else {
            (2.0 * exponent(0.5) - exponent(1.0 - cos)).exp()
        }
    }

    /// By midpoints, closer at grazing angles.
    fn albedo(&self, cos: f32, steps: usize) -> f32 {
        let wo = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
        let lambda_o = self.lambda(cos);
        let mid = |i: usize| (i as f32 + 0.5) / steps as f32;
        let mut sum = 0.0;
        for x in (0..steps).map(mid) {
            let z = x * x;
            let r = (1.0 - z * z).sqrt();
            let masking = 1.0 / ((1.0 + lambda_o + self.lambda(z)) * 4.0 * cos);
            let towards = |k: usize| {
                let (sin, cos) = (PI * mid(k)).sin_cos();
                self.distribution((wo + Vec3::new(r * cos, r * sin, z)).normalize())
            };
            let around: f32 = (0..steps).map(towards).sum();
            sum += around * masking * 2.0 * x;
        }
        sum * TAU / (steps * steps) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_close_to_fine_quadrature_between_its_nodes() {
        let mut worst = 0.0_f32;
        for r in 1..12 {
            for c in 0..12 {
                let (roughness, cos) = ((r as f32 + 0.37) / 12.5, (c as f32 + 0.43) / 12.0);
                let sheen = Sheen {
                    color: Vec3::ONE,
                    strength: 1.0,
                    lobe: Charlie::new(roughness),
                    thin: true,
                    entering: true,
                    roughness,
                };
                let error = sheen.gain(cos) - sheen.lobe.albedo(cos, 256);
                worst = worst.max(error.abs());
            }
        }
        assert!(worst < 0.01, "{worst}");
    }
}
