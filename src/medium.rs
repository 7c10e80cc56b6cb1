//! Homogeneous participating media: absorption and scattering between surfaces.
//!
//! A ray crosses a medium on the interval `from..to`. Free flight is sampled for one colour channel, chosen in
//! proportion to the path's throughput, and weighted by the density of all three (one-sample MIS): absorption of
//! blue then adds no variance to red. All values are finite for optical depths from 1e-6, where random numbers
//! still resolve distances, to 1e4, where transmittance vanishes.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use crate::math::{Frame, sin_cos_turns};
use crate::sampler::unit_from_bits;
use crate::scene::{Material, Medium};

/// Media without a box of their own fill the scene's box, enlarged by this share of its diagonal.
const MARGIN: f32 = 0.02;

/// Minimum magnitude of a direction's components.
pub(crate) const MIN_COMPONENT: f32 = 1e-18;

/// Maximum magnitude of the mean cosine of scattering.
pub const MAX_ANISOTROPY: f32 = 0.99;

/// Optical properties of a medium.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Interior {
    /// Scattering coefficient per metre, linear RGB.
    pub scattering: Vec3,
    /// Extinction coefficient (scattering plus absorption) per metre, linear RGB.
    pub extinction: Vec3,
    /// Phase function.
    pub phase: Phase,
}

impl Interior {
    /// The interior of a solid body, from its absorption coefficient.
    pub fn of_body(material: &Material, absorption: Vec3) -> Self {
        Self {
            scattering: material.scattering,
            extinction: absorption + material.scattering,
            phase: Phase::new(material.scatter_anisotropy),
        }
    }

    /// Whether it neither scatters nor absorbs.
    pub fn is_clear(&self) -> bool {
        self.extinction == Vec3::ZERO
    }

    /// Whether it scatters.
    pub fn scatters(&self) -> bool {
        self.scattering != Vec3::ZERO
    }

    /// Transmittance over `distance` metres.
    pub fn transmittance(&self, distance: f32) -> Vec3 {
        (-self.extinction * distance).exp()
    }

    /// Where a ray that carries `throughput` and has `length` metres to go is scattered, from 64
    /// random bits.
    pub fn fly(&self, throughput: Vec3, length: f32, bits: [u32; 2]) -> Flight {
        let pair = throughput.x + throughput.y;
        let sum = pair + throughput.z;
        // Not normalised first, so that a channel without throughput is never chosen.
        let target = unit_from_bits(bits[1]) * sum;
        let channel = usize::from(target >= throughput.x) + usize::from(target >= pair);
        let choice = throughput / sum;
        let depth = optical_depth(bits[0]);
        let scatters = depth < self.extinction[channel] * length;
        let distance = if scatters { depth / self.extinction[channel] } else { length };
        let left = self.transmittance(distance);
        let weight = if scatters {
            self.scattering * left / choice.dot(self.extinction * left)
        } else {
            left / choice.dot(left)
        };
        Flight { scattered_at: scatters.then_some(distance), weight }
    }

    /// Weight and density of the first `distance` metres of a ray with this throughput, which may not be black:
    /// up to the place where it is scattered, or else to the end of the medium. Without scattering all rays pass.
    pub fn crossing(&self, throughput: Vec3, distance: f32, is_scattered: bool) -> Crossing {
        let left = self.transmittance(distance);
        let choice = throughput / throughput.element_sum();
        if is_scattered {
            let density = choice.dot(self.extinction * left);
            return Crossing { weight: self.scattering * left, density };
        }
        Crossing { weight: left, density: if self.scatters() { choice.dot(left) } else { 1.0 } }
    }
}

/// A segment of a path, as [`Interior::fly`] samples it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Transmittance to its end, linear RGB; if the end lies in the medium, times the scattering coefficient there.
    pub weight: Vec3,
    /// Probability of passing to its end or, per metre, of scattering there.
    pub density: f32,
}

impl Crossing {
    /// A segment without a medium.
    pub const CLEAR: Self = Self { weight: Vec3::ONE, density: 1.0 };
}

/// A sampled free flight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flight {
    /// Distance to the scattering event in metres; `None` if it passed through.
    pub scattered_at: Option<f32>,
    /// Factor on the throughput, linear RGB.
    pub weight: Vec3,
}

/// `-ln(1 - u)` of a 32-bit fraction u: exponentially distributed, at most 22.2. The series keeps
/// the precision of small u, on which thin media depend.
pub(crate) fn optical_depth(bits: u32) -> f32 {
    let u = bits as f32 * (1.0 / 4_294_967_296.0);
    if u < 1.0 / 16.0 {
        u * (1.0 + u * (0.5 + u * (1.0 / 3.0 + u * (0.25 + u * (0.2 + u * (1.0 / 6.0))))))
    } else {
        -(((!bits) as f32 + 1.0) * (1.0 / 4_294_967_296.0)).ln()
    }
}

/// Henyey and Greenstein's phase function (*Diffuse radiation in the galaxy*, 1941).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Phase {
    /// Mean cosine between the directions of travel before and after; 0 is isotropic.
    mean_cosine: f32,
}

impl Phase {
    /// The phase function of this mean cosine, clamped to the range that can be sampled.
    pub fn new(mean_cosine: f32) -> Self {
        Self { mean_cosine: mean_cosine.clamp(-MAX_ANISOTROPY, MAX_ANISOTROPY) }
    }

    /// Mean cosine between the directions of travel before and after, in `[-0.99, 0.99]`.
    pub fn mean_cosine(&self) -> f32 {
        self.mean_cosine
    }

    /// A direction for light that travels along `direction`, in proportion to the phase function.
    pub fn sample(&self, direction: Vec3, u: Vec2) -> Vec3 {
        let g = self.mean_cosine;
        let s = 2.0 * u.x - 1.0;
        // The inverse of the cumulative distribution, written without a division by g.
        let numerator =
            s * (1.0 + g * g) + 0.5 * g * (s * s + 3.0) - 0.5 * g * g * g * (1.0 - s * s);
        let denominator = (1.0 + g * s) * (1.0 + g * s);
        let cos = (numerator / denominator).clamp(-1.0, 1.0);
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let (sin_phi, cos_phi) = sin_cos_turns(u.y);
        Frame::from_z(direction).world_from_local(Vec3::new(sin * cos_phi, sin * sin_phi, cos))
    }

    /// Density per steradian of [`Self::sample`], which is the phase function itself; `cos` is
    /// between the directions of travel before and after.
    pub fn pdf_solid_angle(&self, cos: f32) -> f32 {
        let g = self.mean_cosine;
        let squared = (1.0 + g * g - 2.0 * g * cos).max(1e-6);
        (1.0 - g * g) / (4.0 * PI * squared * squared.sqrt())
    }
}

/// A medium in its box, ready for rays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fog {
    /// The medium in the box.
    pub interior: Interior,
    /// Lower and upper corner in metres.
    pub bounds: [Vec3; 2],
}

impl Fog {
    /// A medium in its own box, else in the scene's; `None` if it is clear or its box is empty.
    pub fn new(medium: &Medium, scene_bounds: (Vec3, Vec3)) -> Option<Self> {
        let (low, high) = scene_bounds;
        let margin = MARGIN * low.distance(high);
        let bounds = medium.bounds.unwrap_or([low - margin, high + margin]);
        let interior = Interior {
            scattering: medium.scattering,
            extinction: medium.scattering + medium.absorption,
            phase: Phase::new(medium.anisotropy),
        };
        let fills = bounds[0].cmplt(bounds[1]).all();
        (!interior.is_clear() && fills).then_some(Self { interior, bounds })
    }

    /// The interval of a ray inside the box, up to `distance` metres.
    pub fn stretch(&self, origin: Vec3, direction: Vec3, distance: f32) -> Option<(f32, f32)> {
        // No division by zero: on a face it would be NaN.
        let direction = direction.map(|d| d.abs().max(MIN_COMPONENT).copysign(d));
        let (a, b) = ((self.bounds[0] - origin) / direction, (self.bounds[1] - origin) / direction);
        let from = a.min(b).max_element().max(0.0);
        let to = a.max(b).min_element().min(distance);
        (from < to).then_some((from, to))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depths_are_exponential_to_the_last_bits() {
        for bits in [1_u32, 77, 1 << 12, (1 << 28) - 1, 1 << 28, 1 << 31, u32::MAX - 5, u32::MAX] {
            let exact = -(-f64::from(bits) / 4_294_967_296.0).ln_1p();
            let error = (f64::from(optical_depth(bits)) - exact).abs();
            assert!(error < 4e-7 * exact, "{bits}: off by {error} of {exact}");
        }
        assert_eq!(optical_depth(0), 0.0);
    }

    #[test]
    fn a_stretch_is_what_lies_in_the_box() {
        let medium = Medium {
            scattering: Vec3::ONE,
            bounds: Some([Vec3::splat(-1.0), Vec3::ONE]),
            ..Medium::default()
        };
        let fog = Fog::new(&medium, (Vec3::ZERO, Vec3::ZERO)).expect("not clear");
        let at = |origin: [f32; 3], direction: [f32; 3], distance: f32| {
            fog.stretch(origin.into(), direction.into(), distance)
        };
        assert_eq!(at([-3.0, 0.0, 0.0], [1.0, 0.0, 0.0], f32::INFINITY), Some((2.0, 4.0)));
        assert_eq!(at([-3.0, 0.0, 0.0], [1.0, 0.0, 0.0], 3.0), Some((2.0, 3.0)));
        assert_eq!(at([-3.0, 0.0, 0.0], [1.0, 0.0, 0.0], 1.0), None);
        assert_eq!(at([-3.0, 0.0, 0.0], [-1.0, 0.0, 0.0], 9.0), None);
        assert_eq!(at([0.5, 0.0, 0.0], [0.0, 0.0, -1.0], 9.0), Some((0.0, 1.0)));
        assert_eq!(at([0.0, 1.5, 0.0], [0.0, 0.0, -1.0], 9.0), None);
    }

    #[test]
    fn crossings_have_the_weights_and_densities_of_flights() {
        let extinction = Vec3::new(0.25, 1.0, 0.5);
        let scattering = extinction * Vec3::new(0.9, 0.5, 1.0);
        let interior = Interior { scattering, extinction, phase: Phase::default() };
        let throughput = Vec3::new(1.0, 0.5, 0.8);
        let mut sampler = crate::sampler::Sampler::new(3, 9, 0);
        for _ in 0..100 {
            let flight = interior.fly(throughput, 2.0, sampler.next_pair_bits());
            let (distance, is_scattered) =
                flight.scattered_at.map_or((2.0, false), |distance| (distance, true));
            let crossing = interior.crossing(throughput, distance, is_scattered);
            let weight = crossing.weight / crossing.density;
            assert!((weight - flight.weight).abs().max_element() < 1e-5, "{flight:?} {crossing:?}");
        }
        // Light is scattered somewhere or passes through.
        const STEPS: u32 = 10_000;
        let density = |i: u32| {
            interior.crossing(throughput, (i as f32 + 0.5) * 2.0 / STEPS as f32, true).density
        };
        let scattered =
            (0..STEPS).map(density).map(f64::from).sum::<f64>() * 2.0 / f64::from(STEPS);
        let through = f64::from(interior.crossing(throughput, 2.0, false).density);
        assert!((scattered + through - 1.0).abs() < 1e-5, "{scattered} {through}");
        let absorbing = Interior { scattering: Vec3::ZERO, ..interior };
        assert_eq!(absorbing.crossing(throughput, 2.0, false).density, 1.0);
    }

    #[test]
    fn flight_is_unbiased_for_every_channel_at_any_depth() {
        const COUNT: u32 = 1 << 16;
        for depth in [1e-6_f64, 1e-3, 0.5, 4.0, 1e4] {
            let extinction = Vec3::new(0.25, 1.0, 0.5) * depth as f32;
            let scattering = extinction * Vec3::new(0.9, 0.5, 1.0);
            let interior = Interior { scattering, extinction, phase: Phase::default() };
            let mut sums = [[0.0_f64; 3]; 2];
            for i in 0..COUNT {
                let mut sampler = crate::sampler::Sampler::new(3, 9, i);
                let bits = sampler.next_pair_bits();
                let flight = interior.fly(Vec3::new(1.0, 0.5, 0.8), 1.0, bits);
                assert!(flight.weight.is_finite() && flight.weight.min_element() >= 0.0);
                let sum = &mut sums[usize::from(flight.scattered_at.is_some())];
                for (sum, weight) in sum.iter_mut().zip(flight.weight.to_array()) {
                    *sum += f64::from(weight) / f64::from(COUNT);
                }
            }
            for c in 0..3 {
                let passed = (-f64::from(extinction[c])).exp();
                let albedo = f64::from(scattering[c] / extinction[c]);
                assert!((sums[0][c] - passed).abs() < 2e-3, "{depth}: passed {}", sums[0][c]);
                let scattered = albedo * (1.0 - passed);
                let error = (sums[1][c] - scattered).abs();
                assert!(error < 2e-3, "{depth}: scattered {} for {scattered}", sums[1][c]);
            }
        }
    }
}
