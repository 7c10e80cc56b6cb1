//! A street between houses, with an arcade, a café under an awning, lamps and trees; the sky is
//! partly occluded. `fog` is the same place in mist, seen along its lamps towards the light.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::facade::{self, HouseMats};
use super::materials::{self, matte, palette, textured, two_sided};
use super::mesh::{Builder, Mat};
use super::room::Wall;
use super::{lamps, objects, plants, seating, textures};
use crate::scene::{Medium, Scene};

palette! {
    new(b) {
        let cobbles =
            b.texture(textures::stones([0.40, 0.38, 0.35], 16, 10, 0.07), Vec2::new(2.4, 2.0));
        let flags = b.texture(textures::stones([0.50, 0.48, 0.44], 4, 3, 0.012), Vec2::splat(2.4));
        let bricks = textures::bricks([0.52, 0.26, 0.18], [0.52, 0.48, 0.42], 8, 24);
        let bricks = b.texture(bricks, Vec2::new(2.0, 1.8));
        let ochre = b.texture(textures::plaster([0.72, 0.52, 0.28], 0.30), Vec2::splat(4.0));
        let pale = b.texture(textures::plaster([0.74, 0.68, 0.57], 0.28), Vec2::splat(4.0));
        let ashlar =
            b.texture(textures::stones([0.60, 0.56, 0.49], 6, 4, 0.01), Vec2::new(3.0, 2.4));
        let stripes = textures::stripes([0.74, 0.70, 0.62], [0.50, 0.10, 0.07], 4);
        let stripes = b.texture(stripes, Vec2::new(1.6, 1.0));
        let teak = b.texture(textures::timber([0.42, 0.27, 0.15]), Vec2::new(1.4, 0.7));
        let brick = b.material(textured("brick", bricks, 0.9));
        let ochre = b.material(textured("ochre plaster", ochre, 0.9));
        let pale = b.material(textured("pale plaster", pale, 0.9));
        let ashlar = b.material(textured("ashlar", ashlar, 0.85));
        let trim = b.material(matte("limestone", [0.66, 0.62, 0.54], 0.8));
        let frame = b.material(matte("window paint", [0.70, 0.69, 0.65], 0.4));
        let pane = b.material(matte("dark room", [0.035, 0.04, 0.045], 0.08));
        let roof = b.material(matte("roof tiles", [0.30, 0.15, 0.10], 0.85));
        let green = b.material(matte("green shutter", [0.10, 0.20, 0.15], 0.45));
        let blue = b.material(matte("blue shutter", [0.16, 0.26, 0.36], 0.45));
        let house =
            |wall, shutter| HouseMats { wall, base: ashlar, trim, frame, pane, roof, shutter };
    }
    cobbles = textured("cobbles", cobbles, 0.6),
    kerb = textured("flagstones", flags, 0.7),
    iron = matte("painted iron", [0.03, 0.04, 0.04], 0.4),
    lantern = matte("frosted glass", [0.72, 0.70, 0.64], 0.25),
    awning = two_sided(textured("awning", stripes, 0.9)),
    wood = textured("teak", teak, 0.55),
    cane = matte("cane", [0.58, 0.42, 0.22], 0.6),
    marble = matte("marble", [0.70, 0.69, 0.67], 0.2),
    ceramic = materials::ceramic(),
    coffee = matte("coffee", [0.04, 0.02, 0.01], 0.1),
    clay = matte("terracotta", [0.52, 0.24, 0.14], 0.8),
    soil = matte("soil", [0.06, 0.04, 0.03], 1.0),
    bark = matte("bark", [0.20, 0.15, 0.11], 0.95),
    leaf = two_sided(matte("leaf", [0.13, 0.26, 0.07], 0.5)),
    brick_house: HouseMats = house(brick, None),
    ochre_house: HouseMats = house(ochre, Some(green)),
    pale_house: HouseMats = house(pale, Some(blue)),
    stone_house: HouseMats = house(ashlar, None),
}

/// Builds the scene `exterior`.
pub(super) fn exterior() -> Scene {
    let mut b = street("exterior");
    b.camera("street", [-3.7, 1.62, 6.1], [-0.25, 2.15, -6.0], 55.0);
    b.camera("arcade", [5.6, 1.55, 5.6], [3.4, 1.75, -6.0], 58.0);
    b.camera("café", [0.9, 1.45, 2.6], [-5.4, 1.35, -3.4], 55.0);
    b.finish()
}

/// Builds the scene `fog`.
pub(super) fn fog() -> Scene {
    let mut b = street("fog");
    b.camera("lamps", [-1.2, 1.55, -27.0], [1.0, 2.9, -8.0], 55.0);
    b.camera("street", [-3.7, 1.62, 6.1], [-0.25, 2.15, -6.0], 55.0);
    Scene { medium: Some(FOG), ..b.finish() }
}

/// A third of the light along a street is scattered on 20 metres, mostly forward, as by mist.
const FOG: Medium = Medium {
    scattering: Vec3::splat(0.02),
    absorption: Vec3::splat(0.0005),
    anisotropy: 0.6,
    bounds: Some([Vec3::new(-60.0, -0.5, -60.0), Vec3::new(60.0, 20.0, 60.0)]),
};

fn street(name: &str) -> Builder {
    let mut builder = Builder::new(name);
    let b = &mut builder;
    let m = &Palette::new(b);
    b.quad(m.cobbles, Vec3::new(-60.0, 0.0, 60.0), Vec3::X * 120.0, Vec3::NEG_Z * 120.0);
    b.slab(m.kerb, [-6.995, -0.05, -29.5], [-2.0, 0.09, 8.8], 0.02);
    b.slab(m.kerb, [2.9, -0.05, -33.5], [6.995, 0.0905, 8.8], 0.02);
    houses(b, m);
    arcade(b, m);
    cafe(b, m);
    greenery(b, m);
    let (right, left) = (2.55, -1.75);
    let on_right = [-24.0, -17.0, -10.0, -3.0, 4.0].map(|z| (right, z));
    for (x, z) in on_right.into_iter().chain([(left, -20.5), (left, -13.5)]) {
        b.standing([x, 0.0, z], 0.0, |b| lamps::street_lamp(b, m.iron, m.lantern, 3.7));
    }
    builder
}

fn houses(b: &mut Builder, m: &Palette) {
    for (mats, plan, height, fronts, windows) in [
        (&m.brick_house, [-14.0, -30.0, -6.0, -8.0], 11.0, [false, true, false, true], (2, true)),
        (&m.pale_house, [5.0, -34.0, 14.0, -10.0], 14.0, [true, false, false, true], (3, true)),
        (&m.stone_house, [-5.0, -41.0, 4.0, -35.0], 18.0, [false, false, false, true], (4, false)),
        (&m.ochre_house, [-16.0, -6.0, -7.0, 9.0], 9.0, [false, true, true, false], (2, true)),
        (&m.ochre_house, [7.0, -7.5, 16.0, 9.0], 6.6, [true, false, true, false], (1, false)),
    ] {
        facade::house(b, mats, plan, height, fronts, windows);
    }
}

/// A vaulted walk along the houses on the +X side.
fn arcade(b: &mut Builder, m: &Palette) {
    let stone = m.stone_house.trim;
    let (x, z0, bay, spring, top) = (3.25, -9.0, 2.33, 2.35, 3.75);
    for k in 0..7 {
        b.standing([x + 0.2, 0.09, z0 + bay * k as f32], 0.0, |b| {
            facade::column(b, stone, spring - 0.09, 0.17);
        });
    }
    let wall = Wall { origin: Vec3::new(x, 0.0, z0 - 0.22), along: Vec3::Z, width: 6.0 * bay };
    // Towards the street the wall looks along -X.
    b.part(wall.frame(), |b| {
        for k in 0..6 {
            let u = bay * k as f32;
            facade::arch(b, stone, [u + 0.44, u + bay], [spring - 0.002, top]);
            b.slab(stone, [u, spring - 0.004, -0.4], [u + 0.44, top, 0.0], 0.0);
        }
        let end = 6.0 * bay;
        b.slab(stone, [end, spring - 0.004, -0.4], [end + 0.44, top, 0.0], 0.0);
        b.slab(stone, [-0.08, top - 0.03, -0.5], [end + 0.52, top + 0.12, 0.10], 0.03);
    });
    let end = z0 + 6.0 * bay + 0.2;
    b.slab(m.stone_house.base, [x + 0.05, top - 0.10, z0 - 0.2], [7.1, top + 0.05, end], 0.01);
}

fn cafe(b: &mut Builder, m: &Palette) {
    for z in [-6.8, -3.2, 0.4, 3.8] {
        b.standing([-2.3, 0.09, z], 0.0, |b| {
            b.drum(m.iron, [-0.01, 0.05], [0.09, 0.08], 0.01);
            b.drum(m.iron, [0.03, 2.86], [0.032, 0.028], 0.004);
            b.ball(m.iron, Vec3::Y * 2.88, 0.05);
        });
        b.rod(m.iron, Vec3::new(-2.3, 2.93, z), Vec3::new(-7.05, 3.32, z), 0.022);
    }
    b.rod(m.iron, Vec3::new(-2.3, 2.93, -6.95), Vec3::new(-2.3, 2.93, 3.95), 0.024);
    b.sheet(m.awning, [88, 10], Vec2::new(11.0, 4.8), |u, v| {
        let sag = 0.07
            * (u * 3.0 * TAU * 0.5).sin().abs().powf(0.7)
            * (v * std::f32::consts::PI).sin().max(0.0);
        Vec3::new(-2.2 - 4.85 * v, 2.965 + 0.40 * v - sag, -7.0 + 11.0 * u)
    });
    b.sheet(m.awning, [264, 4], Vec2::new(11.0, 0.3), |u, v| {
        let scallop = 0.24 - 0.07 * (1.0 - (u * 27.5 * std::f32::consts::PI).sin().abs());
        Vec3::new(-2.195 + 0.018 * (u * 40.0).sin() * v, 2.962 - scallop * v, -7.0 + 11.0 * u)
    });
    for (k, (x, z)) in
        [(-4.0, -4.9), (-5.6, -3.0), (-3.5, -1.6), (-5.3, 0.4), (-3.7, 2.0)].into_iter().enumerate()
    {
        b.standing([x, 0.09, z], 25.0 * k as f32, |b| {
            b.drum(m.iron, [0.0, 0.03], [0.22, 0.20], 0.008);
            b.drum(m.iron, [0.02, 0.70], [0.025, 0.022], 0.004);
            b.drum(m.marble, [0.70, 0.728], [0.36, 0.36], 0.008);
            for (x, z, yaw) in [(0.12, 0.05, 60.0), (-0.15, 0.10, 200.0)] {
                b.standing([x, 0.728, z], yaw, |b| objects::mug(b, m.ceramic, m.coffee));
            }
            b.standing([-0.02, 0.728, -0.10], 0.0, |b| {
                b.drum(m.ceramic, [0.0, 0.05], [0.03, 0.04], 0.003);
                let half = Vec3::new(0.05, 0.06, 0.05);
                plants::foliage(b, m.leaf, Vec3::Y * 0.10, half, 24, 0.05, k as u32);
            });
            for turn in [0.0, 130.0, 235.0].into_iter().take(2 + k % 2) {
                let (s, c) = f32::to_radians(turn + 7.0 * k as f32).sin_cos();
                b.standing([0.68 * s, 0.0, 0.68 * c], 180.0 + turn, |b| {
                    seating::side_chair(b, m.wood, m.cane);
                });
            }
        });
    }
}

fn greenery(b: &mut Builder, m: &Palette) {
    for (x, z, height, seed) in [(1.7, -14.0, 5.6, 1), (1.75, -21.5, 5.2, 2), (-1.2, -9.2, 4.8, 4)]
    {
        b.standing([x, 0.0, z], seed as f32 * 50.0, |b| {
            plants::tree(b, m.bark, m.leaf, height, 1250, seed);
            b.drum(m.iron, [-0.01, 0.012], [0.55, 0.55], 0.004);
        });
    }
    for (k, (x, z)) in [(-2.45, -5.4), (-2.45, -0.1), (-2.45, 2.7), (2.95, -5.4), (2.95, 0.6)]
        .into_iter()
        .enumerate()
    {
        b.standing([x, 0.09, z], 20.0 * k as f32, |b| {
            let soil = plants::pot(b, m.clay, m.soil, 0.27, 0.46);
            let (centre, half) = (Vec3::Y * (soil + 0.26), Vec3::new(0.30, 0.32, 0.30));
            plants::foliage(b, m.leaf, centre, half, 300, 0.10, k as u32 + 3);
        });
    }
}
