//! A sculpture terrace: objects on a wide plane with nothing above, so that nothing occludes the sky.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::materials::{self, matte, textured};
use super::mesh::{Builder, Mat, placed};
use super::{objects, textures};
use crate::scene::Scene;

/// Builds the scene.
pub(super) fn build() -> Scene {
    let b = &mut Builder::new("open");
    let paving = b.texture(textures::stones([0.62, 0.55, 0.45], 4, 4, 0.012), Vec2::splat(3.6));
    let oak = b.texture(textures::timber([0.46, 0.30, 0.17]), Vec2::new(1.4, 0.7));
    let ground = b.material(textured("paving", paving, 0.75));
    let stone = b.material(matte("limestone", [0.66, 0.63, 0.57], 0.8));
    let red = b.material(matte("red lacquer", [0.62, 0.07, 0.05], 0.22));
    let blue = b.material(matte("blue glaze", [0.06, 0.17, 0.36], 0.15));
    let wood = b.material(textured("oak", oak, 0.5));
    let bronze = b.material(materials::metal("bronze", [0.66, 0.46, 0.26], 0.30));
    let steel = b.material(materials::metal("polished steel", [0.72, 0.72, 0.73], 0.12));
    let ceramic = b.material(materials::ceramic());

    b.quad(ground, Vec3::new(-50.0, 0.0, 50.0), Vec3::X * 100.0, Vec3::NEG_Z * 100.0);
    b.standing(Vec3::ZERO, 0.0, |b| plinth(b, stone, 0.45, 0.32));
    b.standing(Vec3::Y * 0.32, 0.0, |b| knot(b, bronze));
    b.ball(red, Vec3::new(-1.9, 0.70, -0.7), 0.70);
    b.ball(steel, Vec3::new(-1.05, 0.26, 0.75), 0.26);
    b.standing([1.75, 0.0, -0.9], 25.0, |b| {
        b.slab(stone, [-0.55, 0.0, -0.55], [0.55, 1.1, 0.55], 0.03);
        b.standing(Vec3::Y * 1.1, 0.0, |b| {
            objects::vase(b, blue, 0.62, &[0.2, 0.36, 0.40, 0.27, 0.11, 0.17]);
        });
    });
    b.standing([1.35, 0.0, 0.75], -20.0, |b| bench(b, wood, steel));
    b.standing([-3.3, 0.0, -2.6], 12.0, |b| {
        for (k, turn) in [0.0, 16.0, -9.0, 30.0].into_iter().enumerate() {
            let s = 0.48 - 0.075 * k as f32;
            b.part(placed([0.0, 0.62 * k as f32 + 0.001 * k as f32, 0.0], [0.0, turn, 0.0]), |b| {
                b.slab(stone, [-s, 0.0, -s], [s, 0.62, s], 0.02);
            });
        }
    });
    b.standing([3.6, 0.0, -3.2], 0.0, |b| {
        objects::vase(b, ceramic, 1.5, &[0.14, 0.25, 0.30, 0.22, 0.10, 0.13]);
    });
    b.camera("terrace", [0.6, 1.6, 6.0], [0.0, 0.78, 0.0], 40.0);
    b.finish()
}

/// A square block in two steps.
fn plinth(b: &mut Builder, mat: Mat, half: f32, height: f32) {
    let foot = half + 0.12;
    b.slab(mat, [-foot, 0.0, -foot], [foot, 0.4 * height, foot], 0.012);
    b.slab(mat, [-half, 0.3 * height, -half], [half, height, half], 0.012);
}

/// A trefoil knot on its edge.
fn knot(b: &mut Builder, mat: Mat) {
    let curve = |t: f32| {
        let (s1, c1) = t.sin_cos();
        let (s2, c2) = (2.0 * t).sin_cos();
        Vec3::new(s1 + 2.0 * s2, c1 - 2.0 * c2, -(3.0 * t).sin()) * 0.235
    };
    b.moved(Vec3::Y * 0.80, |b| {
        b.sheet(mat, [240, 24], Vec2::new(6.0, 0.8), |u, v| {
            let t = u * TAU;
            let forward = (curve(t + 1e-2) - curve(t - 1e-2)).normalize();
            let side = forward.cross(curve(t).normalize_or(Vec3::Z)).normalize();
            let (s, c) = (v * TAU).sin_cos();
            curve(t) + (side * c - forward.cross(side) * s) * 0.115
        });
    });
}

/// A slatted bench.
fn bench(b: &mut Builder, wood: Mat, metal: Mat) {
    for k in 0..5 {
        let z = -0.2 + 0.09 * k as f32;
        b.slab(wood, [-0.75, 0.42, z], [0.75, 0.455, z + 0.075], 0.008);
    }
    for x in [-0.58, 0.58] {
        b.slab(metal, [x - 0.03, 0.0, -0.19], [x + 0.03, 0.02, 0.23], 0.004);
        b.slab(metal, [x - 0.025, 0.4, -0.19], [x + 0.025, 0.422, 0.23], 0.004);
        b.slab(metal, [x - 0.02, 0.01, -0.01], [x + 0.02, 0.41, 0.05], 0.004);
    }
}
