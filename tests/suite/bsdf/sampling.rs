//! Samples against densities and values.

use std::f32::consts::TAU;

use glam::{DVec3, Vec3};
use lightgrid::bsdf::Bsdf;
use lightgrid::metrics::hypothesis::chi_square_test;
use lightgrid::sampler::SplitMix;

use super::{METAL, PANE, Random, WHITE, cases, ggx_metal, scattered_once, spherical, viewers};

const ROWS: usize = 32;
const COLUMNS: usize = 32;
const STEPS: usize = 16;

/// Integrals of `f` over a grid of equal solid angles, the last entry left at 0. The grid's pole is
/// +X: no lobe's peak lies there, and columns end at the horizon.
fn integrate_cells(f: impl Fn(Vec3) -> f32) -> Vec<f64> {
    let mut cells = vec![0.0; ROWS * COLUMNS + 1];
    let solid_angle = 2.0 * f64::from(TAU) / (ROWS * COLUMNS * STEPS * STEPS) as f64;
    for y in 0..ROWS * STEPS {
        for x in 0..COLUMNS * STEPS {
            let cos = -1.0 + 2.0 * (y as f32 + 0.5) / (ROWS * STEPS) as f32;
            let phi = TAU * (x as f32 + 0.5) / (COLUMNS * STEPS) as f32;
            let cell = (y / STEPS) * COLUMNS + x / STEPS;
            let polar = spherical(cos, phi);
            let direction = Vec3::new(polar.z, polar.x, polar.y);
            cells[cell] += f64::from(f(direction)) * solid_angle;
        }
    }
    cells
}

fn cell_of(wi: Vec3) -> usize {
    let y = ((wi.x + 1.0) * 0.5 * ROWS as f32) as usize;
    let x = ((wi.z.atan2(wi.y) / TAU).rem_euclid(1.0) * COLUMNS as f32) as usize;
    y.min(ROWS - 1) * COLUMNS + x.min(COLUMNS - 1)
}

/// Chi-square of the samples against the density; the value's integral against the mean weight.
#[test]
fn samples_follow_their_density_and_cover_the_value() {
    const SAMPLES: usize = 40_000;
    let mut random = Random(SplitMix(1));
    for (name, parameters, entering) in cases() {
        let bsdf = Bsdf::new(&parameters, entering);
        for wo in viewers() {
            let what = format!("{name}, entering {entering}, cos {}", wo.z);
            let expected = integrate_cells(|wi| bsdf.pdf_solid_angle(wo, wi));
            let value: f64 = integrate_cells(|wi| bsdf.eval(wo, wi).y).iter().sum();
            let mut observed = vec![0.0; expected.len()];
            let (mut mean, mut square) = (0.0, 0.0);
            for _ in 0..SAMPLES {
                match bsdf.sample(wo, random.next_vec3()) {
                    Some(s) if !s.is_delta => {
                        observed[cell_of(s.wi)] += 1.0;
                        mean += f64::from(s.weight.y) / SAMPLES as f64;
                        square += f64::from(s.weight.y).powi(2) / SAMPLES as f64;
                    }
                    _ => observed[ROWS * COLUMNS] += 1.0,
                }
            }
            let total: f64 = expected.iter().sum();
            assert!(total < 1.001, "{what}: the density integrates to {total}");
            let deviation = ((square - mean * mean).max(0.0) / SAMPLES as f64).sqrt();
            let tolerance = 4.5 * deviation + 0.001 * value + 1e-6;
            assert!((mean - value).abs() < tolerance, "{what}: weight {mean}, value {value}");
            check_histogram(&what, &observed, expected, SAMPLES);
        }
    }
}

fn check_histogram(what: &str, observed: &[f64], mut expected: Vec<f64>, samples: usize) {
    let last = expected.len() - 1;
    // Quadrature leaves a residue where nothing fails.
    expected[last] = (1.0 - expected.iter().sum::<f64>()).max(0.0);
    if expected[last] > 1.0 - 1e-6 {
        assert_eq!(observed[last], samples as f64, "{what}: all samples are delta");
        return;
    }
    let scale = samples as f64 / expected.iter().sum::<f64>();
    expected.iter_mut().for_each(|e| *e *= scale);
    // Midpoints may miss the corner that a sharp-edged lobe (refraction) has in a cell; `sample` never
    // returns a direction of density 0.
    expected.iter_mut().for_each(|e| *e = e.max(1e-6));
    let test = chi_square_test(observed, &expected, 1e-4).expect("two cells or more");
    assert!(test.passed, "{what}: {test:?}");
}

#[test]
fn densities_integrate_to_known_totals() {
    let lambert = Bsdf::new(&WHITE, true);
    for wo in viewers() {
        let total: f64 = integrate_cells(|wi| lambert.pdf_solid_angle(wo, wi)).iter().sum();
        assert!((total - 1.0).abs() < 1e-4, "{total}");
    }
    // Facing GGX, the share of normals beyond 45 degrees mirrors below the horizon. A lobe is chosen in
    // proportion to its albedo: of glass that is all, of metal what single scattering leaves.
    for (parameters, is_metal) in [(METAL, true), (PANE, false)] {
        let bsdf = Bsdf::new(&parameters, true);
        let total: f64 = integrate_cells(|wi| bsdf.pdf_solid_angle(Vec3::Z, wi)).iter().sum();
        let a2 = f64::from(parameters.roughness).powi(4);
        let lost = 1.0 - scattered_once(ggx_metal(a2, 1.0), DVec3::Z, 256);
        let again = lost / if is_metal { 1.0 } else { 1.0 + lost };
        let expected = (1.0 - again) / (1.0 + a2) + again;
        assert!((total - expected).abs() < 1e-3, "{total} {expected}");
    }
}

#[test]
fn sample_and_eval_agree() {
    let mut random = Random(SplitMix(2));
    for (name, parameters, entering) in cases() {
        let bsdf = Bsdf::new(&parameters, entering);
        let mut spread = 0;
        for _ in 0..500 {
            let wo = random.direction();
            let wo = Vec3::new(wo.x, wo.y, wo.z.abs());
            let Some(s) = bsdf.sample(wo, random.next_vec3()) else { continue };
            assert!((s.wi.length() - 1.0).abs() < 1e-5, "{name}");
            assert_eq!(s.is_transmission, s.wi.z < 0.0, "{name}");
            let (value, pdf) = bsdf.eval_pdf(wo, s.wi);
            if s.is_delta {
                continue;
            }
            spread += 1;
            assert_eq!((value, pdf), (bsdf.eval(wo, s.wi), bsdf.pdf_solid_angle(wo, s.wi)));
            assert_eq!(pdf, s.pdf_solid_angle, "{name}");
            assert_eq!(value / pdf, s.weight, "{name}");
        }
        assert_eq!(spread == 0, bsdf.is_delta_only(), "{name}");
    }
}
