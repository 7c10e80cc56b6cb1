//! Fittings of walls, in a wall's frame: window frames, mouldings, doors, curtains.

use std::f32::consts::{PI, TAU};

use glam::{Affine3A, Vec2, Vec3};

use super::mesh::{Builder, LIFT, Mat};
use super::room::Wall;

/// A wooden window frame without panes in a wall's frame: `hole` as given to the wall, sitting
/// `depth` behind the inner face, with `columns` x `rows` lights and edges rounded by `bevel`.
pub(super) fn window_frame(
    b: &mut Builder,
    mat: Mat,
    hole: [f32; 4],
    depth: f32,
    [columns, rows]: [u32; 2],
    bevel: f32,
) {
    let [u0, v0, u1, v1] = hole;
    let (bar, thick, bury) = (0.045, 0.05, 0.006);
    let (z0, z1) = (-depth - thick, -depth);
    let mut piece = |u: [f32; 2], v: [f32; 2], z: [f32; 2]| {
        b.slab(mat, [u[0], v[0], z[0]], [u[1], v[1], z[1]], bevel);
    };
    piece([u0 - bury, u0 + bar], [v0 - bury, v1 + bury], [z0, z1]);
    piece([u1 - bar, u1 + bury], [v0 - bury, v1 + bury], [z0, z1]);
    piece([u0 + 0.01, u1 - 0.01], [v0 - bury, v0 + bar], [z0 + 0.001, z1 - 0.001]);
    piece([u0 + 0.01, u1 - 0.01], [v1 - bar, v1 + bury], [z0 + 0.001, z1 - 0.001]);
    for i in 1..columns {
        let u = u0 + (u1 - u0) * i as f32 / columns as f32;
        piece([u - 0.016, u + 0.016], [v0 + 0.01, v1 - 0.01], [z0 + 0.008, z1 - 0.008]);
    }
    for j in 1..rows {
        let v = v0 + (v1 - v0) * j as f32 / rows as f32;
        piece([u0 + 0.01, u1 - 0.01], [v - 0.013, v + 0.013], [z0 + 0.012, z1 - 0.012]);
    }
}

/// A window board that reaches into the room below a window.
pub(super) fn window_board(b: &mut Builder, mat: Mat, hole: [f32; 4], thickness: f32) {
    let [u0, v0, u1, _] = hole;
    let back = -thickness + 0.01;
    b.slab(mat, [u0 + 0.002, v0 - 0.02, back], [u1 - 0.002, v0 + 0.015, LIFT], 0.003);
    b.slab(mat, [u0 - 0.06, v0 - 0.018, -0.01], [u1 + 0.06, v0 + 0.014, 0.07], 0.008);
}

/// A flat moulding around a door on the room's side.
fn architrave(b: &mut Builder, mat: Mat, [u0, v0, u1, v1]: [f32; 4]) {
    let (w, z) = (0.07, [-0.005, 0.018]);
    b.slab(mat, [u0 - w, v0, z[0]], [u0, v1 + w, z[1]], 0.006);
    b.slab(mat, [u1, v0, z[0]], [u1 + w, v1 + w, z[1]], 0.006);
    b.slab(mat, [u0 - 0.003, v1 + 0.0006, z[0]], [u1 + 0.003, v1 + w - 0.001, z[1] - 0.001], 0.006);
}

/// Skirting and quarter-round cornices along the walls of a room, `heights` high; the last wall has
/// a door between `door` along it.
pub(super) fn edges(
    b: &mut Builder,
    walls: &[Wall; 4],
    [skirting, cornice]: [Mat; 2],
    ceiling: f32,
    door: [f32; 2],
    heights: [f32; 2],
) {
    for (i, wall) in walls.iter().enumerate() {
        b.part(wall.frame(), |b| {
            let (beside, whole) = ([[0.0, door[0]], [door[1], wall.width]], [[0.0, wall.width]]);
            let stretches: &[[f32; 2]] = if i == 3 { &beside } else { &whole };
            let [height, radius] = heights;
            for &[u0, u1] in stretches {
                b.slab(skirting, [u0, -0.01, -0.01], [u1, height - 0.025, 0.018], 0.002);
                let (low, high) =
                    ([u0 + 0.0005, height - 0.03, -0.009], [u1 - 0.0005, height, 0.012]);
                b.slab(skirting, low, high, 0.006);
            }
            b.sheet(cornice, [1, 12], Vec2::new(wall.width, radius), |u, v| {
                let (s, c) = (v * 0.5 * PI).sin_cos();
                let swell = 0.12 * radius * (v * TAU).sin();
                Vec3::new(
                    u * (wall.width + 0.02) - 0.01,
                    ceiling + 0.004 - radius * (1.0 - s) - 0.5 * swell,
                    radius * (1.0 - c) + 0.5 * swell,
                )
            });
        });
    }
}

/// Raised rectangular moulding on a wall, in the wall's frame.
pub(super) fn panel_moulding(b: &mut Builder, mat: Mat, [u0, v0, u1, v1]: [f32; 4]) {
    let (w, z0, z1) = (0.03, -0.004, 0.012);
    for (left, right) in [(u0, u0 + w), (u1 - w, u1)] {
        b.slab(mat, [left, v0, z0], [right, v1, z1], 0.006);
    }
    for v in [v0, v1 - w] {
        b.slab(mat, [u0 + 0.002, v + 0.0005, z0], [u1 - 0.002, v + w - 0.0005, z1 - 0.0008], 0.006);
    }
}

/// A closed panelled door of `width` x `height` with handle and architrave on the wall's inner face,
/// its left edge at `u`.
pub(super) fn door(b: &mut Builder, leaf: Mat, metal: Mat, u: f32, [width, height]: [f32; 2]) {
    b.slab(leaf, [u + 0.003, 0.005, -0.01], [u + width - 0.003, height - 0.003, 0.010], 0.003);
    architrave(b, leaf, [u, 0.001, u + width, height]);
    let (stile, middle) = (0.11, 0.92);
    let (u0, u1) = (u + stile, u + width - stile);
    for [v0, v1] in [[0.22, middle - 0.06], [middle + 0.06, height - 0.12]] {
        b.moved(Vec3::Z * 0.010, |b| panel_moulding(b, leaf, [u0, v0, u1, v1]));
        b.slab(leaf, [u0 + 0.06, v0 + 0.06, 0.0], [u1 - 0.06, v1 - 0.06, 0.017], 0.007);
    }
    let knob = Vec3::new(u + width - 0.06, 1.02, 0.012);
    b.part(Affine3A::from_translation(knob) * Affine3A::from_rotation_x(0.5 * PI), |b| {
        b.drum(metal, [-0.005, 0.006], [0.027, 0.026], 0.002);
    });
    let elbow = knob + Vec3::Z * 0.045;
    let grip = elbow - Vec3::X * 0.12;
    let path = [
        (knob, 0.009),
        (elbow - Vec3::Z * 0.008, 0.009),
        (elbow - Vec3::new(0.008, 0.0, 0.0), 0.009),
        (grip, 0.0085),
        (grip - Vec3::X * 0.003, 0.004),
    ];
    b.tube(metal, 14, path);
}

/// A curtain that hangs from `top` to `bottom` between `u` in a wall's frame, `offset` before the wall,
/// with `folds` folds, gathered a little at the top.
pub(super) fn curtain(
    b: &mut Builder,
    mat: Mat,
    u: [f32; 2],
    [bottom, top]: [f32; 2],
    offset: f32,
    folds: f32,
) {
    let width = u[1] - u[0];
    let length = width * 2.0;
    b.sheet(mat, [(folds * 16.0) as u32, 16], Vec2::new(length, top - bottom), |s, t| {
        let phase =
            s * folds * TAU + 0.9 * (s * 9.0 + u[0]).sin() + 0.25 * (t * 5.0 + s * 20.0).sin();
        let swell = 0.030 + 0.028 * (1.0 - t);
        let sway = 0.015 * (s * 7.0 + 1.0).sin() * (1.0 - t);
        Vec3::new(
            u[0] + width * (s + 0.004 * (2.0 * phase).sin()),
            bottom + (top - bottom) * t,
            offset + swell * phase.sin() + sway,
        )
    });
}

/// A curtain rod with end knobs and rings, in a wall's frame.
pub(super) fn curtain_rod(b: &mut Builder, mat: Mat, u: [f32; 2], height: f32, offset: f32) {
    b.rod(mat, Vec3::new(u[0], height, offset), Vec3::new(u[1], height, offset), 0.013);
    for end in u {
        b.ball(mat, Vec3::new(end, height, offset), 0.028);
    }
    for s in [0.08, 0.5, 0.92] {
        let at = u[0] + s * (u[1] - u[0]);
        b.rod(mat, Vec3::new(at, height, offset), Vec3::new(at, height, -0.01), 0.008);
    }
}
