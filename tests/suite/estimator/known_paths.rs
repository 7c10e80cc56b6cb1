//! Whole paths, cameras and the background, against closed forms.

use glam::{Vec2, Vec3};
use lightgrid::environment::sky;
use lightgrid::image::Image;
use lightgrid::math::direction_from_uv;
use lightgrid::path::{PathLimits, World, WorldBuilder};
use lightgrid::render::{Sampling, View};
use lightgrid::scene::{Camera, Material};

use super::scenes::{lambert, lamp, room, unlit};
use super::{MODES, constant, environment, expect, expect_same_mean, mean, probe, render, view};

#[test]
fn a_white_corner_vanishes_in_uniform_light() {
    let (low, high) = (Vec3::ZERO, Vec3::ONE);
    let world = WorldBuilder::default().faces(&lambert(1.0), low, high, [1, 3, 5]).build();
    let camera = Camera::look_at(Vec3::splat(2.0), Vec3::splat(0.2), 0.3);
    for mode in MODES {
        let film = render(&world, &constant(1.5), view(camera.clone(), mode, 500), 256);
        expect(&format!("{mode:?}"), &film, 1.5, 0.01);
    }
}

#[test]
fn a_white_room_is_as_bright_as_what_its_window_shows() {
    let (low, high) = (Vec3::splat(-1.0), Vec3::ONE);
    // Half of a wall is missing.
    let world = WorldBuilder::default()
        .faces(&lambert(1.0), low, high, 1..6)
        .quad(&lambert(1.0), [1.0, -1.0, -1.0], [0.0, 1.0, 0.0], [0.0, 0.0, 2.0])
        .build();
    let camera = Camera::look_at(Vec3::new(0.5, 0.2, 0.3), Vec3::new(-1.0, -0.3, -0.8), 0.8);
    for mode in MODES {
        let film = render(&world, &constant(1.5), view(camera.clone(), mode, 1000), 64);
        expect(&format!("{mode:?}"), &film, 1.5, 0.04);
    }
}

#[test]
fn a_glowing_cavity_brightens_with_every_bounce() {
    let glowing = Material { emissive: Vec3::splat(0.5), ..lambert(0.6) };
    let (low, high) = (Vec3::new(-1.0, -0.8, -1.3), Vec3::new(1.2, 0.9, 1.0));
    let world = WorldBuilder::default().faces(&glowing, low, high, 0..6).build();
    let camera = Camera::look_at(Vec3::new(0.1, 0.2, 0.3), Vec3::new(-1.0, -0.7, -1.0), 1.0);
    for bounces in [0, 1, 2, 5, 40] {
        let series: f64 = (0..=bounces).map(|n| 0.6_f64.powi(n)).sum();
        let film = render(
            &world,
            &constant(0.0),
            view(camera.clone(), Sampling::Plain, bounces as u32),
            256,
        );
        expect(&format!("{bounces} bounces"), &film, 0.5 * series, 0.02);
    }
}

#[test]
fn roulette_changes_the_noise_alone() {
    let (world, camera) = room(0.7, None);
    let environment = environment(sky::build("overcast", 64, 32).expect("a sky"));
    let films = [false, true].map(|russian_roulette| {
        let view = View {
            limits: PathLimits { bounces: 60, russian_roulette },
            seed: u32::from(russian_roulette),
            ..view(camera.clone(), Sampling::Adaptive, 60)
        };
        render(&world, &environment, view, 1024)
    });
    expect_same_mean("with and without roulette", &films[0], &films[1], 0.02);
}

#[test]
fn unlit_surfaces_show_their_colour_and_end_paths() {
    let world = WorldBuilder::default().floor(&unlit(0.42), [0.0; 3], 10.0).build();
    for bounces in [0, 3] {
        let camera = probe([0.3, 1.0, 0.2], [0.0; 3]);
        let film = render(&world, &constant(9.0), view(camera, Sampling::Plain, bounces), 4);
        expect("unlit", &film, 0.42, 1e-6);
    }
}

/// By Schlick's approximation of an index of 1.5, as `KHR_materials_clearcoat` says.
#[test]
fn a_coat_keeps_back_what_it_reflects_of_emitted_light() {
    let coated = Material { clearcoat: 0.5, ..lamp(2.0) };
    let world = WorldBuilder::default().quad(
        &coated,
        [-50.0, -50.0, 0.0],
        [100.0, 0.0, 0.0],
        [0.0, 100.0, 0.0],
    );
    let world = world.build();
    for cosine in [1.0_f32, 0.5, 0.25] {
        let eye = Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine) * 4.0;
        let camera = Camera::look_at(eye, Vec3::ZERO, 0.001);
        let film = render(&world, &constant(0.0), view(camera, Sampling::Plain, 1), 1);
        let fresnel = 0.04 + 0.96 * (1.0 - cosine).powi(5);
        let expected = f64::from(2.0 * (1.0 - 0.5 * fresnel));
        let found = mean(&film).luminance;
        assert!((found / expected - 1.0).abs() < 0.01, "{cosine}: {found}, not {expected}");
    }
}

#[test]
fn a_lens_keeps_what_lies_in_its_focal_plane() {
    // Each pixel of a striped, unlit wall; the lens takes its numbers after the pixel has.
    let striped = |distance: f32| -> World {
        (0..24)
            .fold(WorldBuilder::default(), |builder, i| {
                let x = -3.0 + 0.25 * i as f32;
                let wall = unlit(if i % 2 == 0 { 0.2 } else { 0.8 });
                builder.quad(&wall, [x, -3.0, -distance], [0.25, 0.0, 0.0], [0.0, 6.0, 0.0])
            })
            .build()
    };
    let pinhole = Camera::look_at(Vec3::ZERO, Vec3::NEG_Z * 4.0, 0.9);
    let lens = Camera { lens_radius: 0.6, ..pinhole.clone() };
    let difference = |world: &World| {
        let films = [&pinhole, &lens].map(|camera| {
            render(world, &constant(0.0), view((*camera).clone(), Sampling::Plain, 0), 64)
        });
        let [a, b] = films.each_ref().map(|film| film.pixels());
        let worst = a.iter().zip(b).map(|(a, b)| (a.mean()[0] - b.mean()[0]).abs());
        worst.fold(0.0, f64::max)
    };
    let (sharp, blurred) = (difference(&striped(4.0)), difference(&striped(3.0)));
    // A sample may fall on the other side of a stripe's edge by rounding.
    assert!(sharp <= 2.0 * 0.6 / 64.0, "in focus: {sharp}");
    assert!(blurred > 0.1, "out of focus: {blurred}");
}

#[test]
fn the_background_is_the_bilinear_map() {
    let map = Image::from_fn(7, 5, |x, y| {
        [(x * 3 + y) as f32 % 5.0, (x + 2 * y) as f32 % 3.0, (x * y) as f32 % 4.0]
    });
    let lookup = |uv: Vec2| -> [f64; 3] {
        let (x, y) = (f64::from(uv.x) * 7.0 - 0.5, (f64::from(uv.y) * 5.0 - 0.5).clamp(0.0, 4.0));
        // Linear in longitude and in the cosine of the polar angle.
        let cosine = |row: f64| (std::f64::consts::PI * (row + 0.5) / 5.0).cos();
        let (top, bottom) = (cosine(y.floor()), cosine(y.floor() + 1.0));
        let (fx, fy) = (x - x.floor(), (top - cosine(y)) / (top - bottom));
        let texel = |dx: i64, dy: i64| {
            let column = (x.floor() as i64 + dx).rem_euclid(7) as u32;
            map.at(column, (y.floor() as i64 + dy).min(4) as u32)
        };
        [0, 1, 2].map(|c| {
            let value = |dx, dy| f64::from(texel(dx, dy)[c]);
            (1.0 - fy) * ((1.0 - fx) * value(0, 0) + fx * value(1, 0))
                + fy * ((1.0 - fx) * value(0, 1) + fx * value(1, 1))
        })
    };
    let world = WorldBuilder::default().build();
    let environment = environment(map.clone());
    for i in 0..400_u32 {
        let uv = Vec2::new((i as f32 * 0.618_034).fract(), (i as f32 + 0.5) / 400.0);
        let camera = Camera::look_at(Vec3::ZERO, direction_from_uv(uv), 1e-5);
        let view = View { width: 1, height: 1, ..view(camera, Sampling::Plain, 2) };
        let seen = render(&world, &environment, view, 4).pixels()[0].mean();
        for (seen, expected) in seen.into_iter().zip(lookup(uv)) {
            // The pixel is 1e-5 radian wide, up to 0.02 texels next to a pole.
            assert!((seen - expected).abs() < 0.02, "at {uv}: {seen} instead of {expected}");
        }
    }
}
