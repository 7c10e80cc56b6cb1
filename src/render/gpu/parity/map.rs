//! The map, its tables, the grid's cells and distributions.

use glam::Vec3;

use super::Probe;
use super::cases::{case, cases, edge_directions, edge_words};
use super::fixture::Fixture;
use super::functions::camera;
use super::twin::{Bound, EXACT, Twin, ulps};
use crate::environment::Environment;
use crate::light_grid::WHOLE_MAP;
use crate::light_grid::cells::dominant_face;
use crate::render::gpu::layout::unpack_radiance;

/// All probes of a map, and [`of_view`].
pub(super) fn probes(fixture: &Fixture) -> Vec<Probe<'_>> {
    let mut probes = look_ups(&fixture.environment);
    probes.extend(samples(&fixture.environment));
    probes.extend(of_view(fixture));
    probes
}

/// The probes that depend on the cells or the camera.
pub(super) fn of_view(fixture: &Fixture) -> Vec<Probe<'_>> {
    let mut probes = cells(fixture);
    probes.extend(distributions(fixture));
    probes.extend(camera(fixture));
    probes
}

/// The largest radiance that interpolation around a direction may mix, times the map's larger side:
/// a place on the map is known to some units in the last place of that.
fn contrast(environment: &Environment, direction: Vec3) -> f32 {
    let map = environment.map();
    let (column, row) = environment.patch_of(direction);
    let mut largest = 0.0_f32;
    for dy in 0..4 {
        for dx in [map.width - 2, map.width - 1, 0, 1] {
            let y = (row + dy).saturating_sub(2).min(map.height - 1);
            let pixel = map.at((column + dx) % map.width, y);
            largest = largest.max(Vec3::from(pixel).max_element());
        }
    }
    largest * map.width.max(map.height) as f32 * environment.rotation_and_intensity().1
}

/// A few units in the last place of a density, which is as well known as the radiance it follows.
fn density_bound(environment: &Environment, direction: Vec3, tile: u32) -> Bound {
    let energies = environment.tile_energies();
    let (_, intensity) = environment.rotation_and_intensity();
    ulps(8.0).of(contrast(environment, direction) / intensity / energies[tile as usize] as f32)
}

/// How much the last place of a random number within a row turns a sample, in such places: near a
/// pole by more than one.
fn polar(environment: &Environment, direction: Vec3) -> f32 {
    let row = std::f32::consts::PI / environment.map().height as f32;
    1.0 + row * row / direction.with_y(0.0).length()
}

fn look_ups(environment: &Environment) -> Vec<Probe<'_>> {
    let map = environment.map();
    let directions = || edge_directions().into_iter().map(|d| case(&[&d]));
    let radiance_bound = move |direction| ulps(4.0).of(contrast(environment, direction));
    vec![
        Probe::new(
            "unpack_radiance",
            "let low = take_word(); put3(unpack_radiance(vec2u(low, take_word())));",
            cases([case(&[&0_u32, &0_u32])], |r| {
                // An exponent of 255 is never stored.
                case(&[&r.word(), &(r.word() % (255 << 24))])
            }),
            |t| {
                let right = unpack_radiance([t.take_word(), t.take_word()]);
                t.near(Vec3::from(right), EXACT);
            },
        ),
        Probe::new(
            "map_point",
            "let point = map_point(take3()); put_word(point.at.x); put_word(point.at.y);
            put2(point.within);",
            cases(directions(), |r| case(&[&r.direction()])),
            |t| {
                let direction = t.take3();
                let right = environment.map_point(direction);
                let (column, row) = (t.device_word(), t.device_word());
                let [across, down] = [t.device(), t.device()];
                // A place on an edge may come out on its other side, also across the seam.
                let (width, rows) = (map.width as f32, environment.patch_grid().1);
                let off = |a: u32, within: f32, b: u32, other: f32| {
                    (a as f32 + within - b as f32 - other).abs()
                };
                let off_x = off(right.column, right.across, column, across);
                let off_y = off(right.row, right.down, row, down);
                let off = off_x.min(width - off_x).max(off_y);
                // Down a row, in units of the last place of the distance from its pole.
                let edges = environment.patches.rows[right.row as usize];
                let bound = 4.0 * f32::EPSILON * (width + 1.0 + edges.top / edges.extent.abs());
                t.check(off <= bound, || format!("off by {off:e} patches"));
                t.check(column < map.width && row < rows, || "not on the map".to_owned());
            },
        ),
        Probe::new(
            "environment_radiance",
            "put3(environment_radiance(take3()));",
            cases(directions(), |r| case(&[&r.direction()])),
            move |t| {
                let direction = t.take3();
                t.near(environment.radiance(direction), radiance_bound(direction));
            },
        )
        .flips(500),
        Probe::new(
            "radiance_and_tile_pdf",
            "let seen = radiance_and_tile_pdf(take3()); put_word(seen.tile);
            put3(seen.radiance); put(seen.pdf_solid_angle);",
            cases(directions(), |r| case(&[&r.direction()])),
            move |t| {
                let direction = t.take3();
                let (radiance, tile, pdf) = environment.radiance_and_tile_pdf(direction);
                t.same(tile);
                t.near(radiance, radiance_bound(direction));
                t.near(pdf, density_bound(environment, direction, tile));
            },
        )
        .flips(500),
    ]
}

/// Drawing from tiles.
pub(super) fn samples(environment: &Environment) -> Vec<Probe<'_>> {
    let tiles = environment.tile_count();
    let edges = (0..tiles).flat_map(|tile| edge_words().map(move |u| (tile, u)));
    let edges = edges.map(|(tile, [x, y])| case(&[&tile, &x, &y]));
    let draws = cases(edges, |r| case(&[&r.below(tiles), &r.word(), &r.word()]));
    let sample = Probe::new(
        "sample_in_tile",
        "let tile = take_word(); let sample = sample_in_tile(tile, vec2u(take_word(), take_word()));
        put(sample.pdf_solid_angle); put3(sample.direction); put3(sample.radiance);
        put(sample.weight);",
        draws,
        |t| {
            let (tile, u) = (t.take_word(), [t.take_word(), t.take_word()]);
            let Some(sample) = environment.sample_in_tile(tile, u) else {
                t.near(0.0, EXACT);
                return t.accept_rest();
            };
            let direction = sample.direction;
            let polar = polar(environment, direction);
            t.near(sample.pdf_solid_angle, density_bound(environment, direction, tile));
            t.near(direction, ulps(8.0).of(polar));
            t.near(environment.sampled_radiance(&sample), ulps(8.0).of(polar * contrast(environment, direction)));
            t.near(sample.weight, ulps(16.0));
        },
    );
    let density = Probe::new(
        "sample_in_tile and its density",
        "let tile = take_word(); let sample = sample_in_tile(tile, vec2u(take_word(), take_word()));
        put(sample.pdf_solid_angle); put3(sample.direction);
        if sample.pdf_solid_angle > 0.0 {
            let seen = radiance_and_tile_pdf(sample.direction);
            put_word(seen.tile); put(seen.pdf_solid_angle);
        }",
        // Within tiles: at an edge a direction may be found in the next one.
        cases([], |r| case(&[&r.below(tiles), &r.word(), &r.word()])),
        |t| {
            let (tile, _) = (t.take_word(), [t.take_word(), t.take_word()]);
            let pdf = t.device();
            let direction = Vec3::new(t.device(), t.device(), t.device());
            if pdf > 0.0 {
                t.same(tile);
                let polar = polar(environment, direction);
                t.near(pdf, density_bound(environment, direction, tile).widened(polar));
            }
        },
    );
    vec![sample.flips(500), density.flips(500)]
}

fn cells(fixture: &Fixture) -> Vec<Probe<'_>> {
    let center = fixture.rays.position;
    let edge_points = move || {
        let around = edge_directions().into_iter().map(move |d| (center + 3.0 * d, d));
        around.chain([(center, Vec3::ONE), (Vec3::splat(1e30), Vec3::ZERO)])
    };
    let edge_cases = move || edge_points().map(|(position, normal)| case(&[&position, &normal]));
    let equal = [Vec3::ONE, Vec3::new(1.0, -1.0, 1.0), Vec3::new(0.5, -1.0, -1.0), Vec3::ZERO];
    let mut probes = vec![Probe::new(
        "dominant_face",
        "put_word(dominant_face(take3()));",
        cases(equal.into_iter().chain(edge_directions()).map(|n| case(&[&n])), |r| {
            case(&[&r.direction()])
        }),
        |t| {
            let right = dominant_face(t.take3());
            t.same(right);
        },
    )];
    if let Some(grid) = fixture.grid.grid() {
        let cells = grid.cell_count();
        probes.push(Probe::new(
            "distribution_of_cell",
            "put_word(distribution_of_cell(take_word()));",
            cases([case(&[&0_u32]), case(&[&(cells - 1)])], |r| case(&[&r.below(cells)])),
            |t| {
                let distribution = fixture.grid.distribution_of_cell(t.take_word());
                t.same(distribution);
            },
        ));
        // Exact, but for points that lie on the border of cells.
        probes.push(
            Probe::new(
                "cell_of",
                "let position = take3(); put_word(cell_of(position, take3()));",
                cases(edge_cases(), |r| case(&[&(4.0 * r.in_cube()), &r.direction()])),
                move |t| {
                    let cell = grid.cell_of(t.take3(), t.take3());
                    t.same(cell);
                },
            )
            .flips(500),
        );
    }
    probes
}

/// A remainder is a quotient in f32, a few of whose 2^-24 a device may have otherwise.
fn near_remainder(t: &mut Twin<'_>, right: u32) {
    let device = t.device_word();
    let off = device.abs_diff(right);
    t.check(off <= 3 << 8, || format!("a remainder of {device:#x} instead of {right:#x}"));
}

fn distributions(fixture: &Fixture) -> Vec<Probe<'_>> {
    let distributions = fixture.grid.distributions();
    let tiles = distributions.tile_count();
    let ends = [0, 1, 0x7fff_ffff, 0x8000_0000, u32::MAX];
    let edges = (0..distributions.len())
        .flat_map(move |distribution| ends.map(|bits| case(&[&distribution, &bits, &!bits])));
    let all = (0..distributions.len())
        .flat_map(move |distribution| (0..tiles).map(move |tile| case(&[&distribution, &tile])));
    let edges_of_shares = (0..distributions.len()).flat_map(move |distribution| {
        [0, 32, 128, 256].map(|share| case(&[&distribution, &0x8000_0000_u32, &31_u32, &share]))
    });
    vec![
        Probe::new(
            "sample_tile",
            "let distribution = take_word(); let bits = take_word();
            let choice = sample_tile(distribution, bits, take_word());
            put_word(choice.tile); put(choice.probability); put_word(choice.remainder);",
            cases(edges, |r| case(&[&r.below(distributions.len()), &r.word(), &r.word()])),
            move |t| {
                let choice = distributions.sample(t.take_word(), t.take_word(), t.take_word());
                t.same(choice.tile);
                t.near(choice.probability, ulps(1.0));
                near_remainder(t, choice.remainder);
            },
        ),
        Probe::new(
            "choose_tile",
            "let distribution = take_word(); let bits = vec2u(take_word(), take_word());
            let choice = choose_tile(distribution, bits, take_word());
            put_word(choice.tile); put(choice.probability); put_word(choice.remainder);",
            cases(edges_of_shares, |r| {
                case(&[&r.below(distributions.len()), &r.word(), &r.word(), &r.below(257)])
            }),
            move |t| {
                let (distribution, bits) = (t.take_word(), [t.take_word(), t.take_word()]);
                let choice = fixture.grid.sample_sharing(distribution, bits, t.take_word());
                t.same(choice.tile);
                t.near(choice.probability, ulps(3.0));
                near_remainder(t, choice.remainder);
            },
        ),
        Probe::new(
            "choice_probability",
            "let distribution = take_word(); put(choice_probability(distribution, take_word()));",
            cases(all.clone(), |r| case(&[&r.below(distributions.len()), &r.below(tiles)])),
            move |t| {
                let right = fixture.grid.probability(t.take_word(), t.take_word());
                t.near(right, ulps(3.0));
            },
        ),
        Probe::new(
            "tile_probability",
            "let distribution = take_word(); put(tile_probability(distribution, take_word()));",
            cases(all, |r| case(&[&WHOLE_MAP, &r.below(tiles)])),
            move |t| {
                let right = distributions.probability(t.take_word(), t.take_word());
                t.near(right, ulps(1.0));
            },
        ),
    ]
}
