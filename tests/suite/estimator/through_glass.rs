//! Light through smooth solid glass, which shadow rays follow: what paths find by the BSDF alone is the reference.

use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

use glam::{Vec3, Vec4};
use lightgrid::environment::{Environment, sky};
use lightgrid::light_grid::LightGrid;
use lightgrid::light_grid::cells::SphericalGrid;
use lightgrid::path::{PathLimits, World, WorldBuilder};
use lightgrid::render::{Sampling, Session, Sharing, View};
use lightgrid::scene::{AlphaMode, Camera, Material, Medium, PunctualKind, PunctualLight};

use super::scenes::{lambert, lamp, pane, room, smoked_glass, sunlight, unlit};
use super::unbiased::expect_agreement;
use super::{constant, environment, expect, mean, probe, render, view};

/// Reflectance of index 1.5 at normal incidence.
const F0: f64 = 0.04;

fn glass() -> Material {
    Material { thickness: 1.0, ..pane() }
}

fn green() -> Material {
    Material {
        base_color: Vec4::new(0.9, 0.95, 0.8, 1.0),
        attenuation_color: Vec3::new(0.5, 0.8, 0.6),
        attenuation_distance: 0.02,
        ..glass()
    }
}

fn overcast() -> Environment {
    environment(sky::build("overcast", 64, 32).expect("a sky"))
}

/// Before the window of [`room`], so many metres from it.
fn slab(builder: WorldBuilder, glass: &Material, [near, far]: [f32; 2]) -> WorldBuilder {
    let (low, high) = (Vec3::new(2.0 + near, 0.6, -1.2), Vec3::new(2.0 + far, 2.4, 1.2));
    builder.faces(glass, low, high, 0..6)
}

/// A wedge before the window, thick below.
fn prism(builder: WorldBuilder) -> WorldBuilder {
    let at = |x: f32, y: f32, z: f32| Vec3::new(2.0 + x, y, z);
    let [a, b, c] = [(0.05, 0.6), (0.6, 0.6), (0.05, 2.4)].map(|(x, y)| at(x, y, 1.2));
    let [d, e, f] = [a, b, c].map(|corner| corner - Vec3::Z * 2.4);
    let corners =
        [[a, b, c], [d, f, e], [a, d, e], [a, e, b], [b, e, f], [b, f, c], [c, f, d], [c, d, a]];
    builder.triangles(&glass(), &corners)
}

/// The room with glass in it.
fn glazed(add: impl FnOnce(WorldBuilder) -> WorldBuilder) -> (World, Camera) {
    let (world, camera) = room(0.7, None);
    (add(WorldBuilder { scene: world.scene }).build(), camera)
}

/// Asserts that what NEE finds through glass is what paths find.
fn expect_same_as_bsdf(what: &str, (world, camera): &(World, Camera), medium: Option<Medium>) {
    let map = overcast();
    let film = |sampling, seed, samples| {
        let view = View { seed, medium, ..view(camera.clone(), sampling, 3) };
        render(world, &map, view, samples)
    };
    let found = film(Sampling::Bsdf, 1, 2048);
    for (seed, mode) in [(2, Sampling::Plain), (3, Sampling::Adaptive)] {
        expect_agreement(&format!("{what}, {mode:?}"), &found, &film(mode, seed, 512), 0.06);
    }
}

#[test]
fn panes_of_all_kinds_let_the_same_light_in() {
    let open = |builder: WorldBuilder| {
        let (low, high) = (Vec3::new(2.05, 0.6, -1.2), Vec3::new(2.1, 2.4, 1.2));
        builder.faces(&glass(), low, high, [0, 1, 3, 4])
    };
    for (what, place) in [
        ("pane", glazed(|b| slab(b, &glass(), [0.01, 0.03]))),
        ("double", glazed(|b| slab(slab(b, &glass(), [0.01, 0.03]), &glass(), [0.06, 0.08]))),
        ("tinted", glazed(|b| slab(b, &green(), [0.01, 0.03]))),
        ("with a hole", glazed(open)),
        ("touching the wall", glazed(|b| slab(b, &glass(), [0.0, 0.02]))),
    ] {
        expect_same_as_bsdf(what, &place, None);
    }
}

#[test]
fn glass_of_all_shapes_lets_the_same_light_in() {
    let ball = |b: WorldBuilder| b.sphere(&glass(), [2.0, 1.5, 0.0], 0.8);
    let nested = |b: WorldBuilder| {
        b.sphere(&glass(), [2.0, 1.5, 0.0], 0.8).sphere(&green(), [2.0, 1.5, 0.0], 0.3)
    };
    let around_the_camera = |b: WorldBuilder| b.sphere(&green(), [1.7, 1.6, 1.2], 0.25);
    let with_something_inside = |b: WorldBuilder| {
        let b = b.sphere(&glass(), [-0.8, 1.5, -0.4], 0.5);
        b.sphere(&lambert(0.6), [-0.8, 1.5, -0.4], 0.2)
    };
    for (what, place) in [
        ("ball", glazed(ball)),
        ("prism", glazed(prism)),
        ("nested", glazed(nested)),
        ("around the camera", glazed(around_the_camera)),
        ("with something inside", glazed(with_something_inside)),
    ] {
        expect_same_as_bsdf(what, &place, None);
    }
}

#[test]
fn glass_in_fog_lets_the_same_light_in() {
    let fog = Medium {
        scattering: Vec3::new(0.15, 0.2, 0.3),
        absorption: Vec3::new(0.02, 0.01, 0.0),
        anisotropy: 0.6,
        bounds: None,
    };
    expect_same_as_bsdf("pane", &glazed(|b| slab(b, &green(), [0.01, 0.03])), Some(fog));
    expect_same_as_bsdf("ball", &glazed(|b| b.sphere(&glass(), [1.0, 1.5, 0.0], 0.6)), Some(fog));
    let cloudy = Material { scattering: Vec3::splat(2.0), ..glass() };
    expect_same_as_bsdf("cloudy", &glazed(|b| b.sphere(&cloudy, [1.0, 1.5, 0.0], 0.6)), None);
}

#[test]
fn what_was_learned_does_not_matter() {
    let (world, camera) = glazed(|b| prism(slab(b, &glass(), [0.01, 0.03])));
    let map = overcast();
    let found = render(&world, &map, view(camera.clone(), Sampling::Bsdf, 3), 2048);
    let center = camera.world_from_camera.translation.into();
    let grid = SphericalGrid { center, columns: 32, rows: 16, faces: true, medium: false };
    let garbage = LightGrid::with_garbage_distributions(grid, map.tile_energies(), 5);
    let mut session =
        Session::new(&world, &map, View { seed: 2, ..view(camera, Sampling::Plain, 3) });
    session.set_grid(garbage.expect("a map with light")).expect("the CPU does not fail");
    session.advance(512, &AtomicBool::new(false)).expect("the CPU does not fail");
    expect_agreement("garbage", &found, session.film(), 0.06);
}

/// A sun of one texel, which paths hardly find: a slab before it does what it does at each of its two faces.
#[test]
fn the_sun_shines_through_a_slab() {
    let map = |x, y| [if (x, y) == (77, 0) { 1e5 } else { 0.0 }; 3];
    let map = environment(lightgrid::image::Image::from_fn(128, 64, map));
    let lit = |slab: Option<&Material>| {
        let mut builder = WorldBuilder::default().floor(&lambert(0.7), [0.0; 3], 10.0);
        if let Some(slab) = slab {
            let (low, high) = (Vec3::new(-2.0, 1.0, -2.0), Vec3::new(2.0, 1.1, 2.0));
            builder = builder.faces(slab, low, high, 0..6);
        }
        let camera = probe([0.1, 0.9, 0.2], [0.0, 0.0, 0.3]);
        mean(&render(&builder.build(), &map, view(camera, Sampling::Adaptive, 1), 256)).luminance
    };
    // Light that is reflected inside of the slab is left out: paths find it by chance.
    let once = (1.0 - F0) * (1.0 - F0);
    let share = lit(Some(&glass())) / lit(None);
    assert!((share - once).abs() < 0.005, "{share} of the light, not {once}");
}

#[test]
fn lamps_behind_glass_light_the_same_as_those_that_are_found() {
    let shell = |builder: WorldBuilder, center: Vec3, radius: f32| {
        let inner = Material { ior: 1.0, ..glass() };
        builder.sphere(&glass(), center, radius).sphere(&inner, center, 0.9 * radius)
    };
    let bulb = |panel: &Material| {
        let center = Vec3::new(-1.0, 1.6, 0.6);
        let (world, camera) = room(0.7, None);
        let builder = WorldBuilder { scene: world.scene }.sphere(panel, center, 0.2);
        (shell(builder, center, 0.35).build(), camera)
    };
    // One hides half of the other.
    let panels = |panel: &Material| {
        let (world, camera) = room(0.7, None);
        let (low, high) = (Vec3::new(-1.4, 1.3, 0.3), Vec3::new(-0.9, 1.9, 0.9));
        let builder = WorldBuilder { scene: world.scene }.faces(&glass(), low, high, 0..6);
        let quad = |builder: WorldBuilder, x: f32, z: f32| {
            builder.quad(panel, [x, 1.4, z], [0.0, 0.4, 0.0], [0.0, 0.0, 0.25])
        };
        (quad(quad(builder, -1.3, 0.35), -1.05, 0.475).build(), camera)
    };
    let film = |(world, camera): &(World, Camera), seed, samples| {
        let view = View { seed, ..view(camera.clone(), Sampling::Plain, 3) };
        render(world, &constant(0.1), view, samples)
    };
    let (opaque, sheer) = ((1.0, AlphaMode::Opaque), (0.5, AlphaMode::Blend));
    for (what, place, (alpha, alpha_mode)) in [
        ("bulb", &bulb as &dyn Fn(&Material) -> (World, Camera), opaque),
        ("panels", &panels, opaque),
        ("sheer panels", &panels, sheer),
    ] {
        let [found, sampled] = [unlit(0.9), lamp(0.9)].map(|panel| {
            let base_color = panel.base_color.with_w(alpha);
            place(&Material { base_color, alpha_mode, ..panel })
        });
        expect_agreement(what, &film(&found, 1, 4096), &film(&sampled, 2, 1024), 0.05);
    }
}

#[test]
fn lights_without_size_shine_straight_through() {
    let below = |slab: Option<&Material>, light: PunctualLight| {
        let mut builder = WorldBuilder::default().floor(&lambert(0.6), [0.0; 3], 10.0).light(light);
        if let Some(slab) = slab {
            let (low, high) = (Vec3::new(-2.0, 1.0, -2.0), Vec3::new(2.0, 1.5, 2.0));
            builder = builder.faces(slab, low, high, 0..6);
        }
        let view = view(probe([0.1, 0.5, 0.2], [0.0, 0.0, 0.3]), Sampling::Plain, 1);
        mean(&render(&builder.build(), &constant(0.0), view, 16)).rgb
    };
    let point = |y: f32| PunctualLight {
        kind: PunctualKind::Point,
        position: Vec3::new(0.0, y, 0.3),
        ..sunlight(Vec3::NEG_Y, PI as f32)
    };
    let tinted = Material { base_color: Vec4::new(0.5, 0.8, 0.2, 1.0), ..smoked_glass() };
    let once = 1.0 - F0;
    for (what, light, crossed, faces) in [
        ("sun", sunlight(Vec3::NEG_Y, PI as f32), 0.5, 2),
        ("point", point(3.0), 0.5, 2),
        ("point inside", point(1.25), 0.25, 1),
    ] {
        let (bare, seen) = (below(None, light.clone()), below(Some(&tinted), light));
        for (channel, tint) in [0.5_f64, 0.8, 0.2].into_iter().enumerate() {
            let expected = (once * tint).powi(faces) * 0.5_f64.powf(crossed);
            let share = seen[channel] / bare[channel];
            assert!((share - expected).abs() < 1e-3, "{what}: {share}, not {expected}");
        }
    }
}

/// What the camera sees through glass and in mirrors is what guides tell, whichever way a sample goes.
#[test]
fn layers_look_through_glass_and_into_mirrors() {
    let wall = |builder: WorldBuilder, material: &Material, z: f32| {
        builder.quad(material, [-5.0, -5.0, z], [10.0, 0.0, 0.0], [0.0, 10.0, 0.0])
    };
    let red = Material { base_color: Vec4::new(0.6, 0.2, 0.1, 1.0), ..lambert(0.5) };
    let tinted =
        |material: Material| Material { base_color: Vec4::new(1.0, 0.5, 1.0, 1.0), ..material };
    let (low, high) = (Vec3::new(-5.0, -5.0, -1.5), Vec3::new(5.0, 5.0, -1.0));
    let behind = || wall(WorldBuilder::default(), &red, -3.0);
    // Behind the camera, red too, but seen in reflections alone.
    let mirror = Material { metallic: 1.0, roughness: 0.0, ..tinted(lambert(1.0)) };
    let mirrored = wall(wall(WorldBuilder::default(), &mirror, -1.0), &red, 1.0);
    // What is seen through a pane and what it reflects, in proportion.
    let (once, twice) = (1.0 - F0 as f32, (1.0 - F0 as f32) * (1.0 - F0 as f32));
    let solid = |albedo: f32| albedo * twice + F0 as f32 * (1.0 + once);
    let reflected = 2.0 * F0 as f32 / (1.0 + F0 as f32);
    let thin = |albedo: f32, tint: f32| albedo * tint * (1.0 - reflected) + reflected;
    for (what, builder, albedo, depth) in [
        ("nothing", behind(), [0.6, 0.2, 0.1], 3.0),
        ("solid", behind().faces(&glass(), low, high, 0..6), [0.6, 0.2, 0.1].map(solid), 3.0),
        (
            "thin",
            wall(behind(), &tinted(pane()), -1.0),
            [thin(0.6, 1.0), thin(0.2, 0.5), thin(0.1, 1.0)],
            3.0,
        ),
        ("mirror", mirrored, [0.6, 0.1, 0.1], 3.0),
    ] {
        let view =
            View { layers: true, ..view(probe([0.0; 3], [0.0, 0.0, -1.0]), Sampling::Plain, 2) };
        let film = render(&builder.build(), &constant(1.0), view, 16);
        let layers = film.surface_layers().expect("asked for");
        for pixel in 0..layers.depth.len() {
            let normal = layers.normal[pixel];
            assert!((layers.depth[pixel] - depth).abs() < 1e-3, "{what}: {}", layers.depth[pixel]);
            assert!(normal[2].abs() > 0.999, "{what}: {normal:?}");
            for (found, expected) in layers.albedo[pixel].into_iter().zip(albedo) {
                assert!((found - expected).abs() < 2e-3, "{what}: {:?}", layers.albedo[pixel]);
            }
        }
    }
}

#[test]
fn white_stays_white_through_glass() {
    // A white ball in a shell of glass, under light from all over, so large that what has entered hits it.
    let builder = WorldBuilder::default().sphere(&glass(), [0.0; 3], 1.0).sphere(
        &lambert(1.0),
        [0.0; 3],
        0.75,
    );
    let camera = Camera::look_at(Vec3::new(0.0, 0.4, 3.0), Vec3::ZERO, 0.5);
    let world = builder.build();
    for (what, sampling, sharing) in [
        ("by the BSDF", Sampling::Bsdf, Sharing::Off),
        ("plain", Sampling::Plain, Sharing::Off),
        ("shared", Sampling::Adaptive, Sharing::Large),
    ] {
        let view = View { sharing, ..view(camera.clone(), sampling, 200) };
        let found = mean(&render(&world, &constant(1.0), view, 512)).luminance;
        // Flat faces catch a little light for longer than a path follows it.
        assert!((found - 1.0).abs() < 0.005, "{what}: {found}");
    }
}

/// Panes and mirrors take none of the vertices that scatter.
#[test]
fn perfect_interfaces_take_no_bounce() {
    let wall = |builder: WorldBuilder, material: &Material, z: f32| {
        builder.quad(material, [-5.0, -5.0, z], [10.0, 0.0, 0.0], [0.0, 10.0, 0.0])
    };
    let panes = (0..8).fold(WorldBuilder::default(), |builder, i| {
        let near = -1.0 - 0.2 * i as f32;
        let (low, high) = (Vec3::new(-5.0, -5.0, near - 0.1), Vec3::new(5.0, 5.0, near));
        builder.faces(&glass(), low, high, 0..6)
    });
    let ahead = || probe([0.0; 3], [0.0, 0.0, -1.0]);
    // So many interfaces in a row let through as much as they would reflect in another order.
    let through = (1.0 - F0) / (1.0 + (2.0 * 8.0 - 1.0) * F0);
    for (bounces, lit, expected) in [
        (0, lamp(2.0), 2.0 * through),
        // Lit by the map through the panes, and seen through them.
        (1, lambert(0.5), 0.0),
    ] {
        let is_lamp = lit.emissive != Vec3::ZERO;
        let world = wall(panes.clone(), &lit, -3.0).build();
        let map = constant(if is_lamp { 0.0 } else { 1.0 });
        let film = |bounces| {
            let view = View {
                limits: PathLimits { bounces, russian_roulette: false },
                ..view(ahead(), Sampling::Plain, bounces)
            };
            render(&world, &map, view, 2048)
        };
        if is_lamp {
            expect("a lamp behind eight panes", &film(bounces), expected, 0.02);
        } else {
            assert!(mean(&film(bounces)).luminance > 0.2, "the wall is lit through the panes");
        }
    }
    let mirror = Material { metallic: 1.0, roughness: 0.0, ..lambert(1.0) };
    let facing = wall(wall(WorldBuilder::default(), &mirror, -1.0), &unlit(0.9), 1.0).build();
    expect(
        "a mirror",
        &render(&facing, &constant(0.0), view(ahead(), Sampling::Plain, 0), 16),
        0.9,
        0.01,
    );
}
