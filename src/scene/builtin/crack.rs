//! A closed brick store room, 4 x 2.5 x 3 m, lit only by a slit 1.5 m x 2 cm in the -X wall.

use glam::{Vec2, Vec3};

use super::materials::{self, matte, textured};
use super::mesh::{Builder, Mat, placed};
use super::room::{self, Hole};
use super::{objects, textures};
use crate::scene::Scene;

const SIZE: [f32; 3] = [4.0, 2.5, 3.0];
const THICKNESS: f32 = 0.1;
const SLIT: [f32; 4] = [0.75, 1.6, 2.25, 1.62];

/// Builds the scene.
pub(super) fn build() -> Scene {
    let b = &mut Builder::new("crack");
    let bricks = textures::bricks([0.62, 0.42, 0.32], [0.60, 0.57, 0.52], 6, 18);
    let bricks = b.texture(bricks, Vec2::new(1.5, 1.35));
    let slabs = b.texture(textures::stones([0.46, 0.43, 0.39], 4, 3, 0.02), Vec2::splat(2.0));
    let pine = b.texture(textures::timber([0.58, 0.42, 0.25]), Vec2::new(1.2, 0.6));
    let brick = b.material(textured("brick", bricks, 0.9));
    let floor = b.material(textured("stone floor", slabs, 0.7));
    let ceiling = b.material(matte("lime wash", [0.74, 0.72, 0.68], 0.95));
    let wood = b.material(textured("pine", pine, 0.6));
    let iron = b.material(materials::metal("iron", [0.30, 0.28, 0.27], 0.5));
    let copper = b.material(materials::copper());
    let clay = b.material(matte("glazed clay", [0.50, 0.26, 0.14], 0.25));
    let sack = b.material(matte("sackcloth", [0.56, 0.46, 0.31], 0.95));

    let mats = [brick, brick, brick, brick, floor, ceiling];
    room::room(b, mats, SIZE, THICKNESS, [&[Hole::Rectangle(SLIT)], &[], &[], &[]]);
    for x in [-1.2, 0.0, 1.2] {
        b.slab(wood, [x - 0.07, SIZE[1] - 0.16, -1.52], [x + 0.07, SIZE[1] + 0.01, 1.52], 0.008);
    }
    for (at, yaw, size) in [
        ([-0.40, 0.0, -0.60], 20.0, [0.85, 0.58, 0.62]),
        ([-0.42, 0.58, -0.62], 8.0, [0.60, 0.40, 0.45]),
        ([0.75, 0.0, 0.22], -15.0, [0.62, 0.46, 0.52]),
    ] {
        b.standing(Vec3::from(at) + Vec3::Y * if at[1] > 0.0 { 0.001 } else { 0.0 }, yaw, |b| {
            crate_box(b, wood, iron, size);
        });
    }
    for (x, z, s) in [(-1.45, -1.0, 1.0), (-1.50, 0.95, 0.9)] {
        b.standing([x, 0.0, z], 30.0, |b| barrel(b, wood, iron, 0.85 * s));
    }
    b.standing([0.62, 0.461, 0.20], 30.0, |b| {
        objects::vase(b, clay, 0.34, &[0.20, 0.34, 0.38, 0.26, 0.11, 0.14]);
    });
    b.standing([0.88, 0.461, 0.28], 0.0, |b| objects::bowl(b, copper, 0.11, 0.07));
    b.standing([-0.50, 0.982, -0.62], 0.0, |b| {
        objects::vase(b, copper, 0.24, &[0.3, 0.42, 0.36, 0.2, 0.24]);
    });
    for (x, y, z, yaw, half) in [
        (0.55, 0.15, -1.15, 10.0, 0.30),
        (1.15, 0.14, -1.05, -25.0, 0.28),
        (0.85, 0.40, -1.12, 4.0, 0.27),
    ] {
        b.part(placed([x, y, z], [0.0, yaw, 3.0]), |b| {
            b.blob(sack, Vec3::ZERO, Vec3::new(half, 0.145, 0.22), [4.0, 2.4], 16);
        });
    }
    b.camera("slit", [1.75, 1.35, 1.30], [-1.0, 0.82, -0.45], 58.0);
    b.finish()
}

/// A boarded crate of `size` with corner battens.
fn crate_box(b: &mut Builder, wood: Mat, iron: Mat, [w, h, d]: [f32; 3]) {
    let (x, z, t) = (0.5 * w, 0.5 * d, 0.016);
    let boards = (h / 0.11) as u32;
    b.slab(wood, [-x + t, 0.004, -z + t], [x - t, h - 0.02, z - t], 0.0);
    for k in 0..boards {
        let (y0, y1) =
            (h * k as f32 / boards as f32 + 0.003, h * (k + 1) as f32 / boards as f32 - 0.003);
        for side in [-1.0, 1.0] {
            b.slab(wood, [-x, y0, side * z], [x, y1, side * (z - t - 0.002)], 0.003);
            let (near, far) = (side * (x - 0.001), side * (x - t - 0.003));
            let (low, high) =
                ([near, y0 + 0.0006, -z + t - 0.004], [far, y1 - 0.0006, z - t + 0.004]);
            b.slab(wood, low, high, 0.003);
        }
    }
    let lids = (d / 0.12) as u32;
    for k in 0..lids {
        let (z0, z1) =
            (d * k as f32 / lids as f32 - z + 0.002, d * (k + 1) as f32 / lids as f32 - z - 0.002);
        b.slab(wood, [-x - 0.004, h - 0.018, z0], [x + 0.004, h, z1], 0.003);
    }
    for (sx, sz) in [(-1., -1.), (1., -1.), (1., 1.), (-1., 1.)] {
        let (cx, cz) = (sx * (x - 0.035), sz * (z + 0.006));
        b.slab(wood, [cx - 0.035, 0.001, cz - 0.012], [cx + 0.035, h - 0.003, cz + 0.008], 0.003);
        for y in [0.06, h - 0.06] {
            b.ball(iron, Vec3::new(cx, y, cz + sz * 0.009), 0.006);
        }
    }
}

/// A barrel of `height` with staves and hoops.
fn barrel(b: &mut Builder, wood: Mat, iron: Mat, height: f32) {
    let radius = |t: f32| height * (0.27 + 0.075 * (std::f32::consts::PI * t).sin());
    let staves = (0..=16).map(|k| k as f32 / 16.0).map(|t| (radius(t), t * height));
    let mut profile = vec![(0.0, 0.01), (radius(0.0) - 0.02, 0.01), (radius(0.0) - 0.018, 0.0)];
    profile.extend(staves);
    let rim = radius(1.0);
    profile.extend([(rim - 0.018, height), (rim - 0.022, height - 0.03), (0.0, height - 0.03)]);
    b.lathe(wood, 48, profile);
    for t in [0.04, 0.22, 0.78, 0.96] {
        let (y, r) = (t * height, radius(t));
        let slope = (radius(t + 0.01) - r) * 100.0 / height * 0.02;
        let profile = [
            (r - slope, y - 0.02),
            (r - slope + 0.004, y - 0.02),
            (r + slope + 0.004, y + 0.02),
            (r + slope, y + 0.02),
        ];
        b.lathe(iron, 48, profile);
    }
}
