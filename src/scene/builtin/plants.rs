//! Plants: leaves, pots, shrubs and trees. Origins are on the ground below their middle.

use std::f32::consts::{PI, TAU};

use glam::{Affine3A, Quat, Vec2, Vec3};

use super::mesh::{Builder, Mat};
use crate::noise::{Stream, smoothstep};

/// Greens that tint leaves, linear.
const GREENS: [[f32; 3]; 5] =
    [[0.9, 1.0, 0.7], [0.7, 0.9, 0.6], [1.1, 1.1, 0.6], [0.75, 1.0, 0.9], [0.55, 0.75, 0.5]];

/// A leaf from the origin along +Z, front up: it folds along its rib and droops by `droop` radians.
fn leaf(b: &mut Builder, mat: Mat, [length, width]: [f32; 2], droop: f32, grid: [u32; 2]) {
    b.sheet(mat, grid, Vec2::new(width, length), |u, v| {
        let side = 2.0 * u - 1.0;
        let t = v.clamp(0.0, 1.0);
        let half = 0.5 * width * (PI * t.powf(0.8)).sin().max(0.0).powf(0.8) + 0.0004;
        let (s, c) = (droop * v).sin_cos();
        let bend = if droop.abs() > 1e-3 {
            Vec3::new(0.0, -(1.0 - c), s) * (length / droop)
        } else {
            Vec3::Z * (v * length)
        };
        let fold = 0.35 * half * side.abs();
        Vec3::new(-side * half, 0.0, 0.0) + bend + Vec3::new(0.0, c, s) * fold
    });
}

/// World from leaf for a leaf that grows from `at` along `direction`, front as high as it can be.
fn growing(at: Vec3, direction: Vec3) -> Affine3A {
    let z = direction.normalize_or(Vec3::Y);
    let x = Vec3::Y.cross(z).normalize_or(Vec3::X);
    let rotation = Quat::from_mat3(&glam::Mat3::from_cols(x, z.cross(x), z));
    Affine3A::from_rotation_translation(rotation, at)
}

/// The horizontal direction at an angle from +X towards +Z.
fn outward(angle: f32) -> Vec3 {
    let (sin, cos) = angle.sin_cos();
    Vec3::new(cos, 0.0, sin)
}

/// A flower pot with soil; returns the height of the soil.
pub(super) fn pot(b: &mut Builder, clay: Mat, soil: Mat, radius: f32, height: f32) -> f32 {
    let (r, h) = (radius, height);
    let profile = [
        (0.0, 0.0),
        (0.70 * r, 0.0),
        (0.72 * r, 0.01 * h),
        (0.93 * r, 0.80 * h),
        (0.99 * r, 0.81 * h),
        (r, 0.83 * h),
        (r, 0.97 * h),
        (0.98 * r, h),
        (0.92 * r, h),
        (0.90 * r, 0.97 * h),
        (0.86 * r, 0.80 * h),
    ];
    b.lathe(clay, 48, profile);
    b.lathe(soil, 40, [(0.90 * r, 0.88 * h), (0.5 * r, 0.91 * h), (0.0, 0.90 * h)]);
    0.9 * h
}

/// Stiff upright blades.
pub(super) fn blades(b: &mut Builder, mat: Mat, count: u32, height: f32, seed: u32) {
    let mut stream = Stream::new(seed);
    for i in 0..count {
        let out = outward(i as f32 * 2.4 + stream.between(-0.3, 0.3));
        let lean = stream.between(0.05, 0.32);
        let h = height * stream.between(0.6, 1.0);
        b.part(growing(out * (0.02 + 0.1 * lean * height), Vec3::Y + out * lean), |b| {
            b.tinted(GREENS[stream.index(GREENS.len())], |b| {
                leaf(b, mat, [h, 0.14 * height.sqrt() * 0.6], stream.between(-0.25, 0.25), [4, 10]);
            });
        });
    }
}

/// Long stalks that each bear one big leaf.
pub(super) fn big_leaves(b: &mut Builder, mat: Mat, count: u32, height: f32, seed: u32) {
    let mut stream = Stream::new(seed);
    for i in 0..count {
        let out = outward(i as f32 * 2.4 + stream.between(-0.4, 0.4));
        let t = (i as f32 + 0.5) / count as f32;
        let top = height * (1.0 - 0.62 * t) * stream.between(0.9, 1.05);
        let reach = height * (0.10 + 0.30 * t) * stream.between(0.8, 1.2);
        let tip = out * reach + Vec3::Y * top;
        let knee = out * (0.25 * reach) + Vec3::Y * (0.6 * top);
        b.tinted(GREENS[stream.index(GREENS.len())], |b| {
            let path = (0..=8).map(|k| {
                let f = k as f32 / 8.0;
                ((knee * (2.0 * f * (1.0 - f))) + tip * (f * f), 0.0075 - 0.004 * f)
            });
            b.tube(mat, 7, path);
            let size = height * stream.between(0.26, 0.36);
            let rise = stream.between(-0.1, 0.5);
            b.part(growing(tip, out + Vec3::Y * rise), |b| {
                leaf(b, mat, [size, 0.62 * size], stream.between(0.6, 1.3), [8, 12]);
            });
        });
    }
}

/// Trailing stems that hang over the rim of a pot of `radius`.
pub(super) fn trailing(b: &mut Builder, mat: Mat, radius: f32, length: f32, seed: u32) {
    let mut stream = Stream::new(seed);
    for i in 0..12 {
        let out = outward(i as f32 * TAU / 12.0 + stream.between(-0.2, 0.2));
        let drop = length * stream.between(0.35, 1.0);
        let reach = radius * stream.between(1.15, 1.5);
        let at = |f: f32| {
            out * (reach * smoothstep(0.0, 0.3, f))
                + Vec3::Y
                    * (0.05 * (1.0 - (2.0 * f - 0.3).powi(2)) - drop * (f - 0.2).max(0.0) / 0.8)
        };
        let path = (0..=10).map(|k| (at(k as f32 / 10.0), 0.0016));
        b.tinted(GREENS[i % GREENS.len()], |b| {
            b.tube(mat, 5, path);
            let leaves = (drop / 0.035) as u32 + 4;
            for k in 0..leaves {
                let f = (k as f32 + 0.5) / leaves as f32;
                let side = if k % 2 == 0 { 1.0 } else { -1.0 };
                let direction =
                    out * 0.6 + out.cross(Vec3::Y) * side + Vec3::Y * stream.between(-0.6, 0.2);
                b.part(growing(at(f), direction), |b| leaf(b, mat, [0.05, 0.038], 0.7, [2, 4]));
            }
        });
    }
}

/// Cut branches with small leaves, standing in a vase.
pub(super) fn twigs(b: &mut Builder, bark: Mat, mat: Mat, height: f32, seed: u32) {
    let mut stream = Stream::new(seed);
    for i in 0..6 {
        let out = outward(i as f32 * TAU / 6.0 + stream.between(-0.4, 0.4));
        let h = height * stream.between(0.75, 1.0);
        let lean = stream.between(0.15, 0.45);
        let at = |f: f32| out * (0.01 + lean * h * f * f) + Vec3::Y * (0.02 + h * f);
        let path = (0..=8).map(|k| (at(k as f32 / 8.0), 0.003 - 0.0002 * k as f32));
        b.tube(bark, 6, path);
        for k in 0..14 {
            let f = 0.42 + 0.58 * (k as f32 + 0.5) / 14.0;
            let (s, c) = (k as f32 * 2.4).sin_cos();
            let direction = Vec3::new(c, stream.between(0.1, 0.9), s);
            b.tinted(GREENS[stream.index(GREENS.len())], |b| {
                b.part(growing(at(f), direction), |b| leaf(b, mat, [0.075, 0.032], 0.5, [2, 5]));
            });
        }
    }
}

/// Leaves scattered through an ellipsoid of `half` extents about `centre`, denser towards its skin.
pub(super) fn foliage(
    b: &mut Builder,
    mat: Mat,
    centre: Vec3,
    half: Vec3,
    count: u32,
    size: f32,
    seed: u32,
) {
    let mut stream = Stream::new(seed);
    for _ in 0..count {
        let (y, angle) = (stream.between(-1.0, 1.0), stream.between(0.0, TAU));
        let ring = (1.0 - y * y).sqrt();
        let out = Vec3::new(ring * angle.cos(), y, ring * angle.sin());
        let depth = stream.between(0.0, 1.0).powf(0.3);
        let at = centre + out * half * depth * (1.0 + 0.18 * (7.0 * out.x + 5.0 * out.z).sin());
        let wander =
            Vec3::new(stream.between(-1., 1.), stream.between(-1., 0.6), stream.between(-1., 1.));
        let length = size * stream.between(0.7, 1.3);
        b.tinted(GREENS[stream.index(GREENS.len())], |b| {
            b.part(growing(at, out + wander), |b| {
                leaf(b, mat, [length, 0.6 * length], 0.6, [2, 2]);
            });
        });
    }
}

/// A tree with a forked trunk; `height` is that of its crown's top.
pub(super) fn tree(b: &mut Builder, bark: Mat, mat: Mat, height: f32, leaves: u32, seed: u32) {
    let mut stream = Stream::new(seed);
    let fork = Vec3::new(stream.between(-0.1, 0.1), 0.42 * height, stream.between(-0.1, 0.1));
    let thick = 0.022 * height;
    let kink =
        fork * 0.5 + Vec3::new(stream.between(-0.06, 0.06), 0.0, stream.between(-0.06, 0.06));
    let path = [
        (Vec3::Y * -0.05, 1.5 * thick),
        (Vec3::Y * 0.12, 1.1 * thick),
        (kink, 0.95 * thick),
        (fork, 0.8 * thick),
    ];
    b.tube(bark, 16, path);
    let limbs = 7;
    let leaf_length = 0.035 * height.sqrt() + 0.06;
    for i in 0..limbs {
        let (s, c) = (i as f32 * 2.4 + stream.between(-0.3, 0.3)).sin_cos();
        let reach = height * stream.between(0.16, 0.26) * if i == 0 { 0.2 } else { 1.0 };
        let top = height * stream.between(0.62, 0.85);
        let tip = Vec3::new(c * reach, top, s * reach);
        let elbow = fork.lerp(tip, 0.5) + Vec3::new(c, -0.4, s) * 0.04 * height;
        let path =
            [(fork - Vec3::Y * 0.08, 0.55 * thick), (elbow, 0.4 * thick), (tip, 0.15 * thick)];
        b.tube(bark, 8, path);
        let size = height * stream.between(0.13, 0.19);
        let half = Vec3::new(size, 0.8 * size, size);
        let centre = tip + Vec3::Y * 0.05 * height;
        foliage(b, mat, centre, half, leaves / limbs, leaf_length, seed * 13 + i);
    }
}
