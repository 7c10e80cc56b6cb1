//! Light that reaches a surface directly, against closed forms.

use std::f64::consts::PI;

use glam::Vec3;
use lightgrid::environment::{Environment, EnvironmentOptions, TableKind};
use lightgrid::image::Image;
use lightgrid::path::{World, WorldBuilder};
use lightgrid::render::Sampling;
use lightgrid::scene::{Material, PunctualKind, PunctualLight};

use super::scenes::{
    black, blended, half_masked, lambert, lamp, sunlight, unlit, with_half_texture,
};
use super::{MODES, constant, expect, probe, render, view};

/// Half extents and height of the rectangle above the origin that lights the floor.
const HALF_X: f64 = 0.5;
const HALF_Z: f64 = 0.8;
const HEIGHT: f64 = 0.7;

/// Share of the light a horizontal element at the origin gets from the rectangle: four times the
/// configuration factor from a differential element to a parallel rectangle with a corner above it
/// (Howell, *A Catalog of Radiation Heat Transfer Configuration Factors*, B-3).
pub(super) fn rectangle_factor() -> f64 {
    let (x, y) = (HALF_X / HEIGHT, HALF_Z / HEIGHT);
    let (p, q) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    4.0 / (2.0 * PI) * (x / p * (y / p).atan() + y / q * (x / q).atan())
}

/// Integral over the rectangle of `f(cosine, distance)` times the configuration factor's density.
pub(super) fn over_rectangle(f: impl Fn(f64, f64) -> f64) -> f64 {
    const STEPS: u32 = 400;
    let (dx, dz) = (HALF_X / f64::from(STEPS), HALF_Z / f64::from(STEPS));
    let mut sum = 0.0;
    for i in 0..STEPS {
        for j in 0..STEPS {
            let (x, z) = ((f64::from(i) + 0.5) * dx, (f64::from(j) + 0.5) * dz);
            let squared = x * x + z * z + HEIGHT * HEIGHT;
            let cosine = HEIGHT / squared.sqrt();
            sum += f(cosine, squared.sqrt()) * cosine * cosine / (PI * squared);
        }
    }
    4.0 * sum * dx * dz
}

/// The floor of a shaft: black walls up to the rectangle, which is of `top` if there is one, facing
/// down.
pub(super) fn shaft(builder: WorldBuilder, albedo: f32, top: Option<&Material>) -> World {
    let high = Vec3::new(HALF_X as f32, HEIGHT as f32, HALF_Z as f32);
    let low = Vec3::new(-high.x, 0.0, -high.z);
    let builder =
        builder.faces(&black(), low, high, [0, 1, 4, 5]).face(&lambert(albedo), low, high, 3);
    let Some(top) = top else { return builder.build() };
    let (width, depth) = (high.x - low.x, high.z - low.z);
    builder.quad(top, [low.x, high.y, low.z], [width, 0.0, 0.0], [0.0, 0.0, depth]).build()
}

/// Looks at the origin from inside the shaft.
pub(super) fn at_the_origin() -> lightgrid::scene::Camera {
    probe([0.1, 0.5, 0.15], [0.0; 3])
}

fn black_map() -> Environment {
    constant(0.0)
}

#[test]
fn the_rectangle_integral_is_the_catalogued_factor() {
    assert!((over_rectangle(|_, _| 1.0) / rectangle_factor() - 1.0).abs() < 1e-5);
}

#[test]
fn a_convex_sphere_in_uniform_light_shows_its_albedo() {
    let world = WorldBuilder::default().sphere(&lambert(0.8), Vec3::ZERO, 1.0).build();
    let camera = lightgrid::scene::Camera::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO, 0.3);
    for mode in MODES {
        let film = render(&world, &constant(1.5), view(camera.clone(), mode, 1), 1024);
        expect(&format!("{mode:?}"), &film, 0.8 * 1.5, 0.01);
        if mode == Sampling::Bsdf {
            // Every sample is the answer.
            assert!(film.pixels().iter().all(|p| (p.mean()[0] / 1.2 - 1.0).abs() < 1e-5));
        }
    }
    let film = render(&world, &constant(1.5), view(camera, Sampling::Plain, 0), 4);
    assert!(film.pixels().iter().all(|p| p.mean() == [0.0; 3]), "no vertex, no light");
}

#[test]
fn a_shaft_gets_the_share_of_sky_that_its_mouth_shows() {
    let world = shaft(WorldBuilder::default(), 0.7, None);
    for mode in MODES {
        let film = render(&world, &constant(2.0), view(at_the_origin(), mode, 1), 1024);
        expect(&format!("{mode:?}"), &film, 0.7 * 2.0 * rectangle_factor(), 0.01);
    }
}

#[test]
fn an_emissive_rectangle_lights_by_its_configuration_factor() {
    let facing_down = Material { double_sided: false, ..lamp(3.0) };
    let full = 0.7 * 3.0 * rectangle_factor();
    for (what, top, expected) in [
        ("one side", facing_down, full),
        ("both sides", lamp(3.0), full),
        ("blended", blended(lamp(3.0), 0.4), 0.4 * full),
        ("half cut out", half_masked(lamp(3.0)), 0.5 * full),
        ("unlit", unlit(0.9), 0.7 * 0.9 * rectangle_factor()),
    ] {
        let world = shaft(with_half_texture(), 0.7, Some(&top));
        for mode in [Sampling::Plain, Sampling::Bsdf] {
            let film = render(&world, &black_map(), view(at_the_origin(), mode, 1), 1024);
            expect(&format!("{what}, {mode:?}"), &film, expected, 0.01);
        }
    }
}

#[test]
fn the_back_of_a_one_sided_lamp_is_dark_and_not_seen() {
    let lamp = Material { double_sided: false, ..lamp(3.0) };
    let up = WorldBuilder::default().floor(&lambert(0.7), [0.0; 3], 10.0).quad(
        &lamp,
        [-1.0, 1.0, 1.0],
        [2.0, 0.0, 0.0],
        [0.0, 0.0, -2.0],
    );
    let world = up.build();
    let film = render(
        &world,
        &black_map(),
        view(probe([0.2, 0.5, 0.1], [0.0; 3]), Sampling::Plain, 2),
        64,
    );
    assert!(film.pixels().iter().all(|p| p.mean() == [0.0; 3]), "nothing shines down");
    // From below the camera looks through the lamp at the map.
    let upwards = view(probe([0.2, 0.5, 0.1], [0.2, 2.0, 0.2]), Sampling::Plain, 2);
    expect("through the back", &render(&world, &constant(0.25), upwards, 16), 0.25, 1e-6);
    let downwards = view(probe([0.2, 2.0, 0.1], [0.2, 1.0, 0.2]), Sampling::Plain, 0);
    expect("the front", &render(&world, &black_map(), downwards, 16), 3.0, 1e-6);
}

#[test]
fn emitters_behind_and_beside_share_with_the_map() {
    // Map and lamp at once: the sum of both, each seen through the same rectangle.
    let world = shaft(WorldBuilder::default(), 0.7, Some(&blended(lamp(3.0), 0.5)));
    for mode in MODES {
        let film = render(&world, &constant(2.0), view(at_the_origin(), mode, 1), 1024);
        let expected = 0.7 * (0.5 * 3.0 + 0.5 * 2.0) * rectangle_factor();
        expect(&format!("{mode:?}"), &film, expected, 0.01);
    }
}

#[test]
fn punctual_lights_follow_the_inverse_square_and_the_cone() {
    let point = PunctualLight {
        kind: PunctualKind::Point,
        position: Vec3::new(1.0, 2.0, 0.5),
        ..sunlight(Vec3::NEG_Y, 5.0)
    };
    let squared = 1.0 + 4.0 + 0.25_f64;
    let cosine = 2.0 / squared.sqrt();
    let irradiance = 5.0 * cosine / squared;
    // The spot looks straight down; the origin is at this angle from its axis.
    let angle = cosine.acos();
    let spot = |inner: f64, outer: f64| PunctualLight {
        kind: PunctualKind::Spot { inner_radians: inner as f32, outer_radians: outer as f32 },
        ..point.clone()
    };
    let (inner, outer) = (angle - 0.2, angle + 0.3);
    let ramp = (cosine - outer.cos()) / (inner.cos() - outer.cos());
    let window = 1.0 - (squared / 16.0).powi(2);
    let cases = [
        ("point", vec![point.clone()], irradiance),
        ("limited", vec![PunctualLight { range: 4.0, ..point.clone() }], irradiance * window),
        ("within the cone", vec![spot(angle + 0.05, angle + 0.1)], irradiance),
        ("in the penumbra", vec![spot(inner, outer)], irradiance * ramp * ramp),
        ("sun", vec![sunlight(Vec3::new(1.0, -2.0, 2.0), 3.0)], 3.0 * 2.0 / 3.0),
        ("both", vec![point.clone(), sunlight(Vec3::NEG_Y, 0.2)], irradiance + 0.2),
    ];
    for (what, lights, expected) in cases {
        let world = lights
            .into_iter()
            .fold(WorldBuilder::default().floor(&lambert(0.6), [0.0; 3], 10.0), |builder, light| {
                builder.light(light)
            })
            .build();
        let film = render(
            &world,
            &black_map(),
            view(probe([0.5, 1.0, 0.5], [0.0; 3]), Sampling::Plain, 1),
            256,
        );
        expect(what, &film, 0.6 / PI * expected, 0.02);
    }
    let outside = WorldBuilder::default()
        .floor(&lambert(0.6), [0.0; 3], 10.0)
        .light(spot(0.1, angle - 0.05))
        .build();
    let film = render(
        &outside,
        &black_map(),
        view(probe([0.5, 1.0, 0.5], [0.0; 3]), Sampling::Plain, 1),
        16,
    );
    assert!(film.pixels().iter().all(|p| p.mean() == [0.0; 3]), "outside of the cone");
}

/// A map of one bright texel.
fn sun_map(width: u32, height: u32, column: u32, row: u32, radiance: f32) -> Image {
    Image::from_fn(width, height, |x, y| [if (x, y) == (column, row) { radiance } else { 0.0 }; 3])
}

/// Irradiance of the horizontal floor from a texel of [`sun_map`] in `row`, of radiance 1. Interpolation makes
/// it a tent of two texels either way; along the row its integral is that of one.
fn sun_irradiance(map: &Image, row: u32) -> f64 {
    const STEPS: u32 = 10_000;
    let (center, step) = (f64::from(row) + 0.5, 2.0 / f64::from(STEPS));
    let sum: f64 = (0..STEPS)
        .map(|i| (f64::from(i) + 0.5) * step - 1.0)
        .map(|from_center| (from_center, PI * (center + from_center) / f64::from(map.height)))
        .map(|(from_center, theta)| (1.0 - from_center.abs()) * theta.sin() * theta.cos())
        .sum();
    sum * (step * PI / f64::from(map.height)) * (2.0 * PI / f64::from(map.width))
}

#[test]
fn a_sun_of_one_texel_gives_its_irradiance_with_every_table() {
    let world = WorldBuilder::default().floor(&lambert(0.5), [0.0; 3], 10.0).build();
    let (width, height, row) = (256, 128, 37);
    let map = sun_map(width, height, 200, row, 1e4);
    let expected = 0.5 / PI * 1e4 * sun_irradiance(&map, row);
    for table in TableKind::ALL {
        let options = EnvironmentOptions { table, ..Default::default() };
        let environment = Environment::new(map.clone(), &options).expect("a sound map");
        for mode in [Sampling::Plain, Sampling::Talk, Sampling::Adaptive] {
            let view = view(probe([0.4, 1.0, 0.4], [0.0; 3]), mode, 1);
            let film = render(&world, &environment, view, 256);
            expect(&format!("{table} {mode:?}"), &film, expected, 0.02);
        }
    }
}
