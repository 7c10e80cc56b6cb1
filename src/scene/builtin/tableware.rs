//! Well-shaped things for a still life: their origin is below their middle.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use super::mesh::{Builder, Mat};

/// A smooth curve of `steps` pieces between each two of the profile's `points`.
pub(super) fn smooth(points: &[(f32, f32)], steps: u32) -> Vec<(f32, f32)> {
    let last = points.len() - 1;
    let point = |i: isize| Vec2::from(points[i.clamp(0, last as isize) as usize]);
    let at = |k: u32| {
        let (i, f) = ((k / steps) as isize, (k % steps) as f32 / steps as f32);
        let p = spline([i - 1, i, i + 1, i + 2].map(point), f);
        (p.x.max(0.0), p.y)
    };
    (0..=last as u32 * steps).map(at).collect()
}

/// Catmull and Rom's spline, `f` of the way from the second point to the third.
pub(super) fn spline([p0, p1, p2, p3]: [Vec2; 4], f: f32) -> Vec2 {
    0.5 * (2.0 * p1
        + f * (p2 - p0
            + f * (2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3 + f * (3.0 * p1 - p0 - 3.0 * p2 + p3))))
}

/// A teapot 15 cm high, its spout along +X.
pub(super) fn teapot(b: &mut Builder, glaze: Mat, knob: Mat) {
    let mut body = vec![(0.0, 0.0), (0.050, 0.0), (0.052, 0.005)];
    body.extend(smooth(
        &[
            (0.054, 0.008),
            (0.083, 0.033),
            (0.095, 0.066),
            (0.086, 0.098),
            (0.061, 0.117),
            (0.050, 0.121),
        ],
        6,
    ));
    body.push((0.0485, 0.1195));
    body.extend(smooth(&[(0.0480, 0.1205), (0.044, 0.127), (0.026, 0.135), (0.0, 0.137)], 5));
    b.lathe(glaze, 72, body);
    let top = [(0.007, 0.135), (0.006, 0.142), (0.014, 0.150), (0.010, 0.159), (0.0, 0.161)];
    b.lathe(knob, 32, smooth(&top, 4));
    let spline = smooth(&[(0.075, 0.048), (0.110, 0.066), (0.130, 0.098), (0.152, 0.122)], 6);
    let last = spline.len() as f32 - 1.0;
    let spout = spline
        .into_iter()
        .enumerate()
        .map(|(k, (x, y))| (Vec3::new(x, y, 0.0), 0.024 - 0.0145 * (k as f32 / last).powf(0.7)));
    b.tube(glaze, 24, spout);
    let handle = (0..=24).map(|k| {
        let (s, c) = (PI * (k as f32 / 24.0 * 1.08 - 0.58)).sin_cos();
        (Vec3::new(-0.083 - 0.055 * c, 0.068 + 0.042 * s, 0.0), 0.0072)
    });
    b.tube(glaze, 16, handle);
}

/// A carafe of one thin wall, `height` high, with a drink in it.
pub(super) fn carafe(b: &mut Builder, glass: Mat, drink: Mat, height: f32) {
    let shape = [
        (0.0, 0.004),
        (0.24, 0.008),
        (0.315, 0.06),
        (0.335, 0.20),
        (0.27, 0.42),
        (0.135, 0.62),
        (0.112, 0.82),
        (0.165, 1.0),
    ];
    let wall: Vec<_> =
        smooth(&shape, 8).into_iter().map(|(r, y)| (r * height, y * height)).collect();
    b.lathe(glass, 72, wall.iter().copied());
    let full = 0.50 * height;
    let inside = wall.into_iter().map(|(r, y)| ((r - 0.0015).max(0.0), y + 0.0012));
    let mut body: Vec<_> = inside.take_while(|&(_, y)| y < full).collect();
    let (r, y) = body[body.len() - 1];
    body.extend([(r, y + 1e-4), (0.0, y + 1e-4)]);
    b.lathe(drink, 72, body);
}

/// A brilliant of `radius` on its girdle, 0.609 of it above a table on which it lies tilted by 35.75 degrees.
pub(super) fn brilliant(b: &mut Builder, mat: Mat, radius: f32) {
    let ring = |eighths: f32, r: f32, y: f32| {
        let (s, c) = (eighths * TAU / 8.0).sin_cos();
        Vec3::new(r * c, y, r * s) * radius
    };
    let table = |k: u32| ring(k as f32, 0.56, 0.36);
    let bezel = |k: u32| ring(k as f32 + 0.5, 0.79, 0.205);
    let girdle = |half: u32, y: f32| ring(half as f32 * 0.5, 1.0, y);
    let lower = |k: u32| ring(k as f32 + 0.5, 0.30, -0.565);
    let culet = Vec3::NEG_Y * (0.75 * radius);
    let mut facet = |corners: &[Vec3]| {
        let middle = corners.iter().sum::<Vec3>();
        let corners: Vec<_> =
            corners.iter().map(|&p| (p, Vec3::ZERO, Vec2::new(p.x, p.z))).collect();
        b.polygon(mat, &corners, middle);
    };
    facet(&[0, 1, 2, 3, 4, 5, 6, 7].map(table));
    for k in 0..8 {
        let (left, here, right) =
            (girdle(2 * k, 0.0), girdle(2 * k + 1, 0.0), girdle(2 * k + 2, 0.0));
        facet(&[table(k), table(k + 1), bezel(k)]);
        facet(&[table(k), bezel(k), left]);
        facet(&[table(k + 1), right, bezel(k)]);
        facet(&[bezel(k), here, left]);
        facet(&[bezel(k), right, here]);
        for half in [2 * k, 2 * k + 1] {
            let edge = [girdle(half, 0.0), girdle(half + 1, 0.0)];
            facet(&[edge[0], edge[1], girdle(half + 1, -0.03), girdle(half, -0.03)]);
        }
        let [left, here, right] = [2 * k, 2 * k + 1, 2 * k + 2].map(|half| girdle(half, -0.03));
        facet(&[lower(k), left, here]);
        facet(&[lower(k), here, right]);
        facet(&[culet, left, lower(k)]);
        facet(&[culet, lower(k), right]);
    }
}

/// A nautilus shell in its own x-y plane, its opening towards +X; `radius` is that of its last turn.
pub(super) fn nautilus(b: &mut Builder, mat: Mat, radius: f32) {
    const TURNS: f32 = 2.6;
    const GROWTH: f32 = 3.0;
    b.sheet(mat, [220, 40], Vec2::new(1.0, 0.25), |u, v| {
        let angle = (u - 1.0) * TURNS * TAU;
        let size = radius * GROWTH.powf((u - 1.0) * TURNS);
        // Growth lines.
        let rib = 1.0 + 0.012 * (u * 95.0 * TAU).sin() * (1.0 - (v * TAU).cos()).min(1.0);
        let (s, c) = (v * TAU).sin_cos();
        let out = size * (0.60 + 0.40 * c * rib);
        Vec3::new(out * angle.cos(), out * angle.sin(), -0.36 * size * s * rib)
    });
}

/// A candle of `radius` and `height`, melted around its wick.
pub(super) fn candle(b: &mut Builder, wax: Mat, wick: Mat, radius: f32, height: f32) {
    let (r, h) = (radius, height);
    let mut profile = vec![(0.0, 0.0), (r - 0.002, 0.0), (r, 0.002), (r, h - 0.004)];
    profile.extend(smooth(
        &[
            (r, h - 0.004),
            (r - 0.003, h),
            (r - 0.008, h - 0.003),
            (0.4 * r, h - 0.009),
            (0.0, h - 0.010),
        ],
        5,
    ));
    profile.dedup();
    b.lathe(wax, 48, profile);
    let path = [
        (Vec3::Y * (h - 0.0095), 0.0012),
        (Vec3::Y * (h + 0.004), 0.0012),
        (Vec3::new(0.003, h + 0.009, 0.0), 0.001),
    ];
    b.tube(wick, 8, path);
}

/// A round paper lantern over hoops, its lower rim at y = 0, open above and below.
pub(super) fn lantern(b: &mut Builder, paper: Mat, radius: f32) {
    const HOOPS: u32 = 13;
    const STEPS: u32 = 4;
    let profile = (0..=HOOPS * STEPS).map(|k| {
        let along = k as f32 / STEPS as f32;
        let (s, c) = (PI * (0.11 + 0.78 * along / HOOPS as f32)).sin_cos();
        // Paper sags between two hoops.
        let sag = 1.0 - 0.022 * (PI * along.fract()).sin();
        (radius * s * sag, radius * 0.86 * (0.94 - c))
    });
    b.lathe(paper, 72, profile);
}

/// A cloth that lies along a board and falls over its front edge: from `back` to `front` at y = 0, then
/// `drop` down, in folds.
pub(super) fn runner(b: &mut Builder, mat: Mat, width: f32, [back, front]: [f32; 2], drop: f32) {
    const BEND: f32 = 0.012;
    let flat = front - back;
    let quarter = 0.5 * PI * BEND;
    let length = flat + quarter + drop;
    b.sheet(mat, [72, 120], Vec2::new(width, length), |u, v| {
        let along = v * length;
        let x = (u - 0.5) * width;
        let fallen = (along - flat - quarter).max(0.0);
        let hang = (fallen / drop).clamp(0.0, 1.0);
        let fold = (u * 3.5 * TAU + 0.8 * (u * 9.0).sin()).sin();
        let ripple = 0.0006 * (u * 13.0 + v * 5.0).sin();
        if along < flat {
            Vec3::new(x, 0.0012 + ripple, back + along)
        } else if fallen <= 0.0 {
            let (s, c) = ((along - flat) / BEND).sin_cos();
            Vec3::new(x, 0.0012 + ripple * c - BEND * (1.0 - c), front + (BEND + ripple) * s)
        } else {
            let out = BEND + 0.0012 + 0.022 * hang * (1.0 + fold);
            Vec3::new(x * (1.0 - 0.06 * hang), -BEND - fallen, front + out)
        }
    });
}
