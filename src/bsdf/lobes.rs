//! The split of a BSDF into its narrow and its broad lobes: varnish reflects a narrow cone, the paint below it scatters
//! to all sides. A path that samples either part, divided by the probability of that part, is unbiased.

/// Maximum share of narrow lobes at which a BSDF is split: a black screen has little below its polish.
pub(crate) const MAX_NARROW_SHARE: f32 = 0.5;

/// Weights of lobes: 0 for absent ones, the same value for the rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LobeWeights {
    pub(super) coat: f32,
    /// Of what its microfacets scatter once and more often.
    pub(super) interface: f32,
    /// Of body and sheen.
    pub(super) others: f32,
}

impl LobeWeights {
    pub(super) const ALL: Self = Self { coat: 1.0, interface: 1.0, others: 1.0 };

    /// Weights of one part, over its probability: of the narrow lobes if the uniform number `u` is below the probability
    /// of these, else of the others. `narrow` says whether coat and interface are narrow.
    pub(super) fn of_part([coat, interface]: [bool; 2], probability: f32, u: f32) -> Self {
        let is_narrow = u < probability;
        let weight = 1.0 / if is_narrow { probability } else { 1.0 - probability };
        let weight_of = |lobe: bool| if lobe == is_narrow { weight } else { 0.0 };
        Self { coat: weight_of(coat), interface: weight_of(interface), others: weight_of(false) }
    }

    /// The weight of the lobes that are present.
    pub(super) fn max(self) -> f32 {
        self.coat.max(self.interface).max(self.others)
    }
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};

    use crate::bsdf::{Bsdf, BsdfSample, SurfaceParameters};
    use crate::sampler::{hash, unit_from_bits};

    const MIN_ALPHA: f32 = 0.02;

    fn polished() -> SurfaceParameters {
        SurfaceParameters {
            base_color: Vec3::new(0.7, 0.4, 0.1),
            ior: 1.5,
            specular: 1.0,
            specular_color: Vec3::ONE,
            roughness: 0.1,
            thin: true,
            anisotropy_axis: Vec2::X,
            clearcoat_normal: Vec3::Z,
            ..SurfaceParameters::default()
        }
    }

    /// Surfaces that have both kinds of lobes.
    fn cases() -> Vec<(&'static str, SurfaceParameters)> {
        let p = polished();
        let rough = SurfaceParameters { roughness: 0.4, ..p };
        let coat = |clearcoat_roughness, under| SurfaceParameters {
            clearcoat: 0.8,
            clearcoat_roughness,
            ..under
        };
        let bent = Vec3::new(0.3, 0.1, 0.9).normalize();
        vec![
            ("polish", p),
            ("mirror over paint", SurfaceParameters { roughness: 0.0, ..p }),
            ("coat", coat(0.1, rough)),
            ("mirror over all", coat(0.0, rough)),
            ("both narrow", coat(0.05, p)),
            ("broad coat over polish", coat(0.5, p)),
            ("over metal", coat(0.1, SurfaceParameters { metallic: 1.0, ..rough })),
            (
                "over cloth",
                SurfaceParameters {
                    sheen_color: Vec3::splat(0.5),
                    sheen_roughness: 0.6,
                    ..coat(0.1, rough)
                },
            ),
            ("partly metal", SurfaceParameters { metallic: 0.1, ..p }),
            ("stretched", SurfaceParameters { anisotropy: 0.05, ..p }),
            (
                "cloth",
                SurfaceParameters {
                    diffuse_transmission: 0.5,
                    diffuse_transmission_color: Vec3::ONE,
                    ..p
                },
            ),
            ("bent", SurfaceParameters { clearcoat_normal: bent, ..coat(0.1, rough) }),
        ]
    }

    fn random(i: u32, n: u32) -> f32 {
        unit_from_bits(hash(hash(i).wrapping_add(n)))
    }

    fn direction(i: u32, n: u32) -> Vec3 {
        let z = 0.02 + 0.98 * random(i, n);
        let (sin, cos) = (std::f32::consts::TAU * random(i, n + 1)).sin_cos();
        Vec3::new(cos * (1.0 - z * z).sqrt(), sin * (1.0 - z * z).sqrt(), z)
    }

    /// The narrow and the broad part, and the probability of the narrow one.
    fn parts(bsdf: &Bsdf, wo: Vec3, min_probability: f32) -> Option<([Bsdf; 2], f32)> {
        let split = |u| bsdf.split(MIN_ALPHA, (wo, min_probability), || u);
        let [narrow, broad] = [split(0.0)?, split(1.0 - f32::EPSILON)?];
        let probability = 1.0 / narrow.weights.max();
        for (u, is_broad) in [(0.0, false), (-1e-4, false), (1e-4, true), (0.5, true)] {
            let u = if u == 0.0 { 0.0 } else { (probability + u).min(1.0 - f32::EPSILON) };
            let part = split(u).expect("as before");
            assert_eq!(part.is_broad(MIN_ALPHA), is_broad, "{u} of {probability}");
        }
        Some(([narrow, broad], probability))
    }

    #[test]
    fn the_mean_of_both_parts_is_the_whole() {
        for (name, p) in cases() {
            let bsdf = Bsdf::new(&p, true);
            let mut compared = 0;
            for i in 0..2000 {
                let (wo, wi) = (direction(i, 0), direction(i, 2));
                // Near the mirrored direction, too.
                let wi = if i % 2 == 0 {
                    wi
                } else {
                    (wi * 0.1 - wo + 2.0 * wo.z * Vec3::Z).normalize()
                };
                let Some(([narrow, broad], probability)) = parts(&bsdf, wo, 0.1 * (i % 5) as f32)
                else {
                    continue;
                };
                let mean = |of: &dyn Fn(&Bsdf) -> Vec3| {
                    probability * of(&narrow) + (1.0 - probability) * of(&broad)
                };
                let near = |found: Vec3, whole: Vec3| {
                    let allowed = 1e-5 * (whole.max_element() + 1.0);
                    assert!(
                        (found - whole).abs().max_element() < allowed,
                        "{name}: {found} {whole}"
                    );
                };
                compared += 1;
                near(mean(&|part| part.eval(wo, wi)), bsdf.eval(wo, wi));
                near(mean(&Bsdf::albedo), bsdf.albedo());
            }
            assert!(compared > 1000, "{name}: {compared}");
        }
    }

    /// Weights over densities against values, and perfect reflections against those of the whole.
    #[test]
    fn samples_of_a_part_cover_it() {
        const SAMPLES: u32 = 100_000;
        for (name, p) in cases() {
            let bsdf = Bsdf::new(&p, true);
            let wo = Vec3::new(0.6, 0.0, 0.8);
            let (parts, probability) = parts(&bsdf, wo, 0.3).expect("it has both");
            let uniform = |n| Vec3::new(random(n, 0), random(n, 1), random(n, 2));
            let sum_of = |part: &Bsdf, is_delta: bool| -> [f64; 2] {
                let found = |n| part.sample(wo, uniform(n)).filter(|s| s.is_delta == is_delta);
                let weights =
                    (0..SAMPLES).filter_map(found).map(|s: BsdfSample| f64::from(s.weight.x));
                weights.fold([0.0; 2], |[sum, squares], w| [sum + w, squares + w * w])
            };
            let count = f64::from(SAMPLES);
            for (index, part) in parts.iter().enumerate() {
                // Integrated by directions of the whole, which are wherever the part is.
                let found = |n| bsdf.sample(wo, uniform(n)).filter(|s| !s.is_delta);
                let values = (0..SAMPLES).filter_map(found);
                let values = values.map(|s| f64::from(part.eval(wo, s.wi).x / s.pdf_solid_angle));
                let [truth, truth_squares] =
                    values.fold([0.0; 2], |[sum, squares], w| [sum + w, squares + w * w]);
                let [sum, squares] = sum_of(part, false);
                let variance = (squares + truth_squares) / count;
                let off = (sum - truth) / count;
                assert!(off.abs() <= 5.0 * (variance / count).sqrt(), "{name}, {index}: {off}");
            }
            let [delta, _] = sum_of(&parts[0], true);
            let [whole, squares] = sum_of(&bsdf, true);
            let off = (delta * f64::from(probability) - whole) / count;
            assert!(off.abs() <= 5.0 * squares.sqrt() / count, "{name}: {off}");
            assert_eq!(sum_of(&parts[1], true)[0], 0.0, "{name}");
        }
    }

    #[test]
    fn what_is_of_one_kind_stays_whole() {
        let p = polished();
        for (what, p) in [
            ("broad", SurfaceParameters { roughness: 0.3, ..p }),
            ("metal", SurfaceParameters { metallic: 1.0, ..p }),
            ("screen", SurfaceParameters { base_color: Vec3::splat(0.012), ..p }),
        ] {
            let bsdf = Bsdf::new(&p, true);
            assert_eq!(
                bsdf.split(MIN_ALPHA, (Vec3::Z, 0.4), || panic!("nothing to choose")),
                None,
                "{what}"
            );
        }
    }
}
