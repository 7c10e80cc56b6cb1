//! Flights, phase function and the fog's box: `medium`.

use glam::{Vec2, Vec3};

use super::Probe;
use super::cases::{case, cases, edge_directions, edge_squares};
use super::fixture::Fixture;
use super::twin::ulps;
use crate::medium::{Interior, Phase};

/// The probes of what lies between surfaces.
pub(super) fn probes(fixture: &Fixture) -> Vec<Probe<'_>> {
    let fog = fixture.view.fog(&fixture.world).expect("this fixture has fog");
    let anisotropies = [0.0, 0.5, -0.9, 0.99];
    let squares = move || {
        let squares = edge_squares().into_iter();
        squares.flat_map(move |u| anisotropies.map(|g| case(&[&g, &Vec3::Z, &u])))
    };
    let corners = fog.bounds.into_iter();
    let corners = corners.flat_map(|corner| {
        let at = edge_directions().into_iter();
        at.flat_map(move |d| [1.0, f32::MAX].map(|far| case(&[&corner, &d, &far])))
    });
    let extremes = [1e-30, 1e-6, 1.0, 1e4, 1e30];
    let extremes = extremes.into_iter().flat_map(|extinction| {
        [0_u32, 1, u32::MAX >> 4, u32::MAX].map(|bits| {
            let extinction = extinction * Vec3::new(1.0, 0.5, 0.0);
            case(&[&extinction, &Vec3::ONE, &2.0_f32, &bits, &bits])
        })
    });
    vec![
        // The device's logarithm and exponential are not the host's: WGSL asks for 3 + 2 |x| ulp of
        // exp, and an absolute 2^-21 of log near 1. The weight is a quotient of such.
        Probe::new(
            "fly_through, optical_depth",
            "let extinction = take3(); let throughput = take3(); let length = take();
            let bits = vec2u(take_word(), take_word());
            let flight = fly_through(Interior(0.7 * extinction, 0.0, extinction), throughput, length,
                bits);
            put_bool(flight.scattered_at < F32_MAX); put(flight.scattered_at); put3(flight.weight);",
            cases(extremes, |r| {
                let extinction = r.unit3() * r.magnitude(1e-6, 1e2);
                let throughput = r.unit3() + Vec3::splat(1e-3);
                case(&[&extinction, &throughput, &r.magnitude(1e-3, 1e3), &r.word(), &r.word()])
            }),
            |t| {
                let (extinction, throughput, length) = (t.take3(), t.take3(), t.take());
                let bits = [t.take_word(), t.take_word()];
                let phase = Phase::new(0.0);
                let interior = Interior { scattering: 0.7 * extinction, extinction, phase };
                let flight = interior.fly(throughput, length, bits);
                t.same(flight.scattered_at.is_some());
                t.near(flight.scattered_at.unwrap_or(f32::MAX), ulps(16.0));
                let depth = extinction.max_element() * flight.scattered_at.unwrap_or(length);
                if depth < 40.0 {
                    t.near(flight.weight, ulps(32.0 + 8.0 * depth).of(flight.weight.max_element()));
                } else {
                    // Channels that carry nothing any more divide by nearly nothing.
                    t.accept_rest();
                }
            },
        )
        .flips(1000),
        Probe::new(
            "crossing",
            "let extinction = take3(); let scattering = extinction * take();
            let way = crossing(Interior(scattering, 0.0, extinction), take3(), take(), take() > 0.5);
            put3(way.weight); put(way.density);",
            cases([], |r| {
                let extinction = r.unit3() * r.magnitude(1e-6, 1e2);
                let albedo = [0.0, 0.7][r.word() as usize % 2];
                let throughput = r.unit3() + Vec3::splat(1e-3);
                let (distance, is_scattered) = (r.magnitude(1e-3, 1e2), r.unit());
                case(&[&extinction, &albedo, &throughput, &distance, &is_scattered])
            }),
            |t| {
                let extinction = t.take3();
                let scattering = extinction * t.take();
                let interior = Interior { scattering, extinction, phase: Phase::new(0.0) };
                let (throughput, distance) = (t.take3(), t.take());
                let way = interior.crossing(throughput, distance, t.take() > 0.5);
                let depth = extinction.max_element() * distance;
                let largest = way.weight.max_element().max(way.density);
                t.near(way.weight, ulps(32.0 + 8.0 * depth).of(largest));
                t.near(way.density, ulps(32.0 + 8.0 * depth).of(largest));
            },
        ),
        Probe::new(
            "sample_phase, phase_pdf_solid_angle",
            "let g = take(); let direction = take3(); let to = sample_phase(g, direction, take2());
            put3(to); put(phase_pdf_solid_angle(g, dot(direction, to)));",
            cases(squares(), |r| {
                case(&[&r.between(-0.99, 0.99), &r.direction(), &r.unit2()])
            }),
            |t| {
                let (g, direction, u): (f32, Vec3, Vec2) = (t.take(), t.take3(), t.take2());
                let phase = Phase::new(g);
                let to = phase.sample(direction, u);
                // Near the peak the sine is the root of a difference, and the density a power of one.
                t.near(to, ulps(4096.0).of(1.0));
                let pdf = phase.pdf_solid_angle(direction.dot(to));
                let peak = phase.pdf_solid_angle(g.signum());
                t.near(pdf, ulps(16.0 / (1.0 - g.abs()).powi(2)).of(peak));
            },
        ),
        // A ray along a face of the box may be inside or outside.
        Probe::new(
            "fog_stretch",
            "let origin = take3(); let direction = take3();
            let stretch = fog_stretch(origin, direction, take());
            let is_in = stretch.start < stretch.end; put_bool(is_in);
            put2(select(vec2f(0.0), vec2f(stretch.start, stretch.end), is_in));",
            cases(corners, |r| {
                case(&[&(8.0 * r.in_cube()), &r.direction(), &r.magnitude(1e-2, 1e3)])
            }),
            move |t| {
                let (origin, direction, distance) = (t.take3(), t.take3(), t.take());
                let stretch = fog.stretch(origin, direction, distance);
                t.same(stretch.is_some());
                let (start, end) = stretch.unwrap_or_default();
                t.near(start, ulps(4.0).of(16.0));
                t.near(end, ulps(4.0).of(16.0));
            },
        )
        .flips(200),
        Probe::new(
            "cell_in_medium",
            "put_word(cell_in_medium(take3()));",
            cases(edge_directions().into_iter().map(|d| case(&[&(2.0 * d)])), |r| {
                case(&[&(4.0 * r.in_cube())])
            }),
            move |t| {
                let cells = fixture.grid.grid().expect("stands in fog have one");
                let cell = cells.cell_in_medium(t.take3());
                t.same(cell);
            },
        )
        .flips(500),
    ]
}
