//! Panes, solids and partial coverage, against closed forms.

use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

use glam::{Vec3, Vec4};
use lightgrid::environment::{Environment, EnvironmentOptions};
use lightgrid::image::Image;
use lightgrid::path::{PathLimits, World, WorldBuilder};
use lightgrid::render::{Sampling, Session, View};
use lightgrid::scene::{Camera, Material};

use super::known_light::{at_the_origin, over_rectangle, shaft};
use super::scenes::{
    black, blended, half_masked, lambert, lamp, orthographic, pane, smoked_glass, sunlight,
    with_half_texture,
};
use super::{MODES, constant, expect, mean, probe, render, view};

/// Reflectance of index 1.5 at normal incidence.
const F0: f64 = 0.04;

/// Fresnel's reflectance of unpolarised light from air into index 1.5.
fn fresnel(cosine: f64) -> f64 {
    let inside = (1.0 - (1.0 - cosine * cosine) / 2.25).sqrt();
    let s = (cosine - 1.5 * inside) / (cosine + 1.5 * inside);
    let p = (1.5 * cosine - inside) / (1.5 * cosine + inside);
    0.5 * (s * s + p * p)
}

/// What a pane of two faces lets through, all reflections between them included.
fn pane_transmittance(cosine: f64) -> f64 {
    let f = fresnel(cosine);
    (1.0 - f) / (1.0 + f)
}

/// A wall facing the camera, ten metres wide.
fn wall(builder: WorldBuilder, material: &Material, z: f32) -> WorldBuilder {
    builder.quad(material, [-5.0, -5.0, z], [10.0, 0.0, 0.0], [0.0, 10.0, 0.0])
}

fn ahead() -> Camera {
    probe([0.0; 3], [0.0, 0.0, -1.0])
}

fn tinted() -> Material {
    Material { base_color: Vec4::new(0.5, 0.8, 0.2, 1.0), ..pane() }
}

#[test]
fn a_camera_sees_through_panes_and_veils() {
    let t = pane_transmittance(1.0);
    for (what, screen, bounces, share) in [
        ("pane", pane(), 1, t),
        ("pane without any bounce", pane(), 0, t),
        ("veil", blended(black(), 0.5), 2, 0.5),
        ("nothing", blended(black(), 0.0), 1, 1.0),
        ("half a pane", blended(pane(), 0.5), 1, 0.5 + 0.5 * t),
    ] {
        let world = wall(wall(WorldBuilder::default(), &lamp(2.0), -2.0), &screen, -1.0).build();
        let film = render(&world, &constant(0.0), view(ahead(), Sampling::Plain, bounces), 1024);
        expect(what, &film, 2.0 * share, 0.01);
    }
}

#[test]
fn a_tinted_pane_colours_what_is_behind_once() {
    let world = wall(wall(WorldBuilder::default(), &lamp(1.0), -2.0), &tinted(), -1.0).build();
    let seen = mean(&render(&world, &constant(0.0), view(ahead(), Sampling::Plain, 1), 1024));
    let lit = WorldBuilder::default()
        .floor(&lambert(1.0), [0.0; 3], 10.0)
        .quad(&tinted(), [-5.0, 0.7, 5.0], [10.0, 0.0, 0.0], [0.0, 0.0, -10.0])
        .light(sunlight(Vec3::NEG_Y, std::f32::consts::PI));
    let view = view(probe([0.1, 0.5, 0.2], [0.0, 0.0, 0.3]), Sampling::Plain, 1);
    let lit = mean(&render(&lit.build(), &constant(0.0), view, 16));
    for (channel, tint) in [0.5, 0.8, 0.2].into_iter().enumerate() {
        let expected = tint * pane_transmittance(1.0);
        let error = seen.rgb[channel] - expected;
        assert!(error.abs() < 0.005, "seen, channel {channel}: off by {error}");
        let error = lit.rgb[channel] - expected;
        assert!(error.abs() < 1e-4, "lit, channel {channel}: off by {error}");
    }
}

#[test]
fn a_pane_in_uniform_light_is_invisible() {
    let world = wall(WorldBuilder::default(), &pane(), -1.0).build();
    let oblique = probe([0.0; 3], [0.9, 0.3, -1.0]);
    for mode in MODES {
        let film = render(&world, &constant(1.5), view(oblique.clone(), mode, 1), 16);
        expect(&format!("{mode:?}"), &film, 1.5, 0.01);
    }
}

#[test]
fn shadow_rays_pass_panes_and_veils() {
    let below = |screen: &Material| {
        with_half_texture()
            .floor(&lambert(0.6), [0.0; 3], 10.0)
            .quad(screen, [-5.0, 1.0, 5.0], [10.0, 0.0, 0.0], [0.0, 0.0, -10.0])
            .light(sunlight(Vec3::NEG_Y, 3.0))
            .build()
    };
    let full = 0.6 * 3.0 / PI;
    // Off the diagonals, where rays meet both triangles of a quad by rounding.
    let floor_at = |x: f32| probe([x + 0.1, 0.5, 0.2], [x, 0.0, 0.3]);
    let lit = |world: &World, x: f32| {
        let film = render(world, &constant(0.0), view(floor_at(x), Sampling::Plain, 1), 16);
        mean(&film).luminance
    };
    for (what, screen, share) in [
        ("pane", pane(), pane_transmittance(1.0)),
        ("veil", blended(black(), 0.5), 0.5),
        ("half a pane", blended(pane(), 0.5), 0.5 + 0.5 * pane_transmittance(1.0)),
    ] {
        let found = lit(&below(&screen), 0.0);
        assert!((found - full * share).abs() < 1e-4, "{what}: {found}, not {}", full * share);
    }
    let cut = below(&half_masked(black()));
    assert_eq!(lit(&cut, -1.0), 0.0, "under the covered half");
    assert!((lit(&cut, 1.0) - full).abs() < 1e-4, "under the clear half");
}

#[test]
fn a_mask_cuts_what_the_camera_sees() {
    let builder = with_half_texture().quad(
        &half_masked(black()),
        [-1.0, -1.0, -1.0],
        [2.0, 0.0, 0.0],
        [0.0, 2.0, 0.0],
    );
    let world = wall(builder, &lamp(2.0), -2.0).build();
    let film =
        render(&world, &constant(0.0), view(orthographic(Vec3::ZERO), Sampling::Plain, 1), 4);
    for (i, pixel) in film.pixels().iter().enumerate() {
        let expected = if i % 16 < 8 { 0.0 } else { 2.0 };
        assert_eq!(pixel.mean(), [expected; 3], "pixel {i}");
    }
}

#[test]
fn a_glazed_shaft_is_lit_alike_by_every_mode() {
    let glazed = shaft(WorldBuilder::default(), 0.7, Some(&pane()));
    let expected = 0.7 * 2.0 * over_rectangle(|cosine, _| pane_transmittance(cosine));
    for mode in MODES {
        let film = render(&glazed, &constant(2.0), view(at_the_origin(), mode, 1), 1024);
        expect(&format!("pane, {mode:?}"), &film, expected, 0.01);
    }
}

#[test]
fn the_sun_shines_through_a_pane_with_every_tile_distribution() {
    let map = Image::from_fn(128, 64, |x, y| [if (x, y) == (77, 0) { 1e5 } else { 0.0 }; 3]);
    let environment = Environment::new(map, &EnvironmentOptions::default()).expect("a sound map");
    // As bright as at its centre up to the zenith, the topmost texel fades in the next row, linearly in
    // the cosine: until 4.2 degrees, where the pane is as clear as at the zenith. Across it is a tent,
    // whose integral is that of one texel.
    let [center, end] = [1.0, 3.0].map(|halves: f64| (PI / 128.0 * halves).cos());
    let within = 0.5 * (1.0 - center * center);
    let fading = (center - end) * (2.0 * center + end) / 6.0;
    let irradiance = 1e5 * 2.0 * PI / 128.0 * (within + fading);
    let expected = 0.7 / PI * irradiance * pane_transmittance(1.0);
    let glazed = shaft(WorldBuilder::default(), 0.7, Some(&pane()));
    for mode in [Sampling::Plain, Sampling::Talk, Sampling::Adaptive] {
        let film = render(&glazed, &environment, view(at_the_origin(), mode, 1), 256);
        expect(&format!("{mode:?}"), &film, expected, 0.01);
    }
}

/// Transmittance and reflectance at normal incidence of a slab that lets `a` through on each way.
fn slab(a: f64) -> (f64, f64) {
    let between = 1.0 - (F0 * a) * (F0 * a);
    let t = (1.0 - F0).powi(2) * a / between;
    (t, F0 + (1.0 - F0).powi(2) * F0 * a * a / between)
}

#[test]
fn a_slab_of_smoked_glass_absorbs_and_reflects_inside() {
    let (low, high) = (Vec3::new(-5.0, -5.0, -1.5), Vec3::new(5.0, 5.0, -1.0));
    let solid = || WorldBuilder::default().faces(&smoked_glass(), low, high, 0..6);
    let (t, r) = slab(0.5_f64.sqrt());
    for russian_roulette in [false, true] {
        let limited = |mode| {
            let view = view(ahead(), mode, 32);
            View { limits: PathLimits { bounces: 32, russian_roulette }, ..view }
        };
        let before_lamp = wall(solid(), &lamp(2.0), -2.0).build();
        let film = render(&before_lamp, &constant(0.0), limited(Sampling::Plain), 1024);
        expect("before a lamp", &film, 2.0 * t, 0.01);
        let film = render(&solid().build(), &constant(1.0), limited(Sampling::Adaptive), 1024);
        expect("in uniform light", &film, t + r, 0.01);
    }
}

#[test]
fn roulette_does_not_take_refraction_for_darkness() {
    // Inside of clear glass radiance is divided by the squared index; nothing is lost though.
    let clear = Material { attenuation_distance: f32::INFINITY, ..smoked_glass() };
    let (low, high) = (Vec3::splat(-1.0), Vec3::splat(1.0));
    let world = WorldBuilder::default().faces(&clear, low, high, 0..6).build();
    let camera = Camera::look_at(Vec3::new(2.0, 2.5, 3.0), Vec3::ZERO, 0.4);
    let rays = [false, true].map(|russian_roulette| {
        let limits = PathLimits { bounces: 64, russian_roulette };
        let view = View { limits, ..view(camera.clone(), Sampling::Bsdf, 64) };
        let bright = constant(1.0);
        let mut session = Session::new(&world, &bright, view);
        session.advance(64, &AtomicBool::new(false)).expect("the CPU does not fail");
        expect("clear cube", session.film(), 1.0, 0.02);
        session.figures().rays as f64
    });
    assert!((rays[1] / rays[0] - 1.0).abs() < 0.01, "roulette shortens paths in glass: {rays:?}");
}

#[test]
fn light_is_absorbed_on_its_way_inside_of_a_solid() {
    // A solid of index 1 neither bends nor reflects: it only absorbs. Floor and lamp lie in it.
    let smoke = Material { ior: 1.0, attenuation_distance: 0.4, ..smoked_glass() };
    let (low, high) = (Vec3::new(-2.0, -1.0, -2.0), Vec3::new(2.0, 1.5, 2.0));
    let builder =
        WorldBuilder::default().faces(&smoke, low, high, 0..6).floor(&lambert(0.7), [0.0; 3], 10.0);
    let (x, y, z) = (0.5, 0.7, 0.8);
    let world =
        builder.quad(&lamp(3.0), [-x, y, -z], [2.0 * x, 0.0, 0.0], [0.0, 0.0, 2.0 * z]).build();
    let eye = Vec3::new(2.5, 0.5, 0.0);
    let inside = eye.length() as f64 * 2.0 / 2.5;
    let transmitted = |distance: f64| 0.5_f64.powf(distance / 0.4);
    let expected = 0.7 * 3.0 * transmitted(inside) * over_rectangle(|_, d| transmitted(d));
    let film = render(&world, &constant(0.0), view(probe(eye, [0.0; 3]), Sampling::Plain, 2), 1024);
    expect("through smoke", &film, expected, 0.01);
}
