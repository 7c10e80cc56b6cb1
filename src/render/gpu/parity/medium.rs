//! Fog: free flight, the phase function, its box and its cells.

use glam::Vec3;

use super::Probe;
use super::cases::{case, cases, edge_squares};
use super::stand::Stand;
use super::twin::{EXACT, Twin, ulps};
use crate::medium::{Interior, MAX_ANISOTROPY, Phase, optical_depth};

/// Probes on a stand with fog.
pub(super) fn probes(stand: &Stand) -> Vec<Probe<'_>> {
    let mut probes = scattering();
    probes.extend(places(stand));
    probes
}

fn scattering() -> Vec<Probe<'static>> {
    let ends = [0, 1, 1 << 12, (1 << 28) - 1, 1 << 28, 1 << 31, u32::MAX];
    vec![
        Probe::new(
            "optical_depth",
            "put(optical_depth(take_word()));",
            cases(ends.map(|bits| case(&[&bits])), |r| case(&[&(r.word() >> r.below(32))])),
            |t| {
                let right = optical_depth(t.take_word());
                // A logarithm near 1 is known to 2^-21, of at least 1/16.
                t.near(right, ulps(4.0).of(if right > 0.06 { 1.0 } else { right }));
            },
        ),
        Probe::new(
            "fly_through",
            "let scattering = take3(); let interior = Interior(scattering, 0.0, take3());
            let throughput = take3(); let length_ = take(); let first = take_word();
            let flight = fly_through(interior, throughput, length_, vec2u(first, take_word()));
            put_bool(flight.scattered_at < F32_MAX); put(min(flight.scattered_at, length_));
            put3(flight.weight);",
            cases([], |r| {
                let density = r.magnitude(1e-6, 1e4);
                let scattering = density * r.unit3();
                let extinction = scattering + density * r.unit3() + 1e-9;
                let length = r.magnitude(1e-2, 10.0);
                case(&[&scattering, &extinction, &r.unit3(), &length, &r.word(), &r.word()])
            }),
            |t| {
                let (scattering, extinction) = (t.take3(), t.take3());
                let interior = Interior { scattering, extinction, phase: Phase::default() };
                let (throughput, length) = (t.take3(), t.take());
                let flight = interior.fly(throughput, length, [t.take_word(), t.take_word()]);
                t.same(flight.scattered_at.is_some());
                let distance = flight.scattered_at.unwrap_or(length);
                t.near(
                    distance,
                    ulps(4.0).of(distance.max(2.0 / extinction.min_element()).min(length)),
                );
                // An exponential is as exact as the depth in its exponent.
                let depth = 1.0 + (extinction * distance).max_element();
                let largest = flight.weight.max_element();
                t.near(flight.weight, ulps(32.0).of(largest * depth));
            },
        )
        .flips(500),
        Probe::new(
            "sample_phase, phase_pdf_solid_angle",
            "let g = take(); let direction = take3(); put3(sample_phase(g, direction, take2()));
            put(phase_pdf_solid_angle(g, take()));",
            cases(
                edge_squares().into_iter().map(|u| case(&[&0.0_f32, &Vec3::Z, &u, &1.0_f32])),
                |r| {
                    let g = r.between(-MAX_ANISOTROPY, MAX_ANISOTROPY);
                    case(&[&g, &r.direction(), &r.unit2(), &r.between(-1.0, 1.0)])
                },
            ),
            |t| {
                let g = t.take();
                let phase = Phase::new(g);
                let right = phase.sample(t.take3(), t.take2());
                // The cosine is a quotient of terms that nearly cancel, and the sine its root.
                t.near(right, ulps(64.0).of(1.0 / (1.0 - g.abs())));
                let right = phase.pdf_solid_angle(t.take());
                t.near(right, ulps(8.0).of(right / (1.0 - g.abs())));
            },
        )
        .flips(100),
    ]
}

fn places(stand: &Stand) -> Vec<Probe<'_>> {
    let fog = stand.view.fog(&stand.world).expect("this stand has fog");
    let grid = stand.grid.grid().expect("this stand has cells");
    vec![
        Probe::new(
            "fog_stretch",
            "let origin = take3(); let direction = take3();
            let stretch = fog_stretch(origin, direction, take());
            let is_inside = stretch.start < stretch.end; put_bool(is_inside);
            if is_inside { put(stretch.start); put(stretch.end); }
            put3(stretch.interior.scattering); put3(stretch.interior.extinction);
            put(stretch.interior.mean_cosine);",
            cases(Vec3::AXES.map(|axis| case(&[&(0.3 * axis), &-axis, &f32::MAX])), |r| {
                case(&[&(8.0 * r.in_cube()), &r.direction(), &r.magnitude(0.1, 100.0)])
            }),
            move |t: &mut Twin<'_>| {
                let (origin, direction) = (t.take3(), t.take3());
                let stretch = fog.stretch(origin, direction, t.take());
                t.same(stretch.is_some());
                if let Some((from, to)) = stretch {
                    // Where a ray nearly misses, its ends are differences.
                    t.near(from, ulps(8.0).of(20.0));
                    t.near(to, ulps(8.0).of(20.0));
                }
                t.near(fog.interior.scattering, EXACT);
                t.near(fog.interior.extinction, EXACT);
                t.near(fog.interior.phase.mean_cosine(), EXACT);
            },
        )
        .flips(500),
        // Exact, but for points that lie on the border of cells.
        Probe::new(
            "cell_in_medium, law_in_medium",
            "let position = take3(); put_word(cell_in_medium(position));
            put_word(law_in_medium(position));",
            cases([], |r| case(&[&(4.0 * r.in_cube())])),
            move |t| {
                let position = t.take3();
                t.same(grid.cell_in_medium(position));
                t.same(stand.grid.law_in_medium(position));
            },
        )
        .flips(500),
    ]
}
