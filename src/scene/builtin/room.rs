//! Thick walls with openings, and what is fitted to walls: frames, skirting, doors, curtains.

use std::f32::consts::{PI, TAU};

use glam::{Affine3A, Mat3, Vec2, Vec3};

use super::mesh::{Builder, LIFT, Mat};

/// How far parts that meet reach into each other, so that no faces are coplanar and nothing leaks.
const OVERLAP: f32 = 0.02;

/// A hole through a wall, in metres along and up from the wall's inner lower corner.
#[derive(Debug, Clone, Copy)]
pub(super) enum Hole {
    /// From (u, v) to (u, v).
    Rectangle([f32; 4]),
    /// Centre (u, v) and radius.
    Round([f32; 3]),
}

impl Hole {
    /// Its bounding rectangle.
    fn bounds(self) -> [f32; 4] {
        match self {
            Self::Rectangle(bounds) => bounds,
            Self::Round([u, v, r]) => [u - r, v - r, u + r, v + r],
        }
    }
}

/// One side of a room: `along x +Y` looks into the room, `origin` is the inner lower corner.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wall {
    /// Inner lower corner where `along` starts.
    pub(super) origin: Vec3,
    /// Horizontal unit direction.
    pub(super) along: Vec3,
    /// Length in metres.
    pub(super) width: f32,
}

impl Wall {
    /// Unit direction into the room.
    fn inward(&self) -> Vec3 {
        self.along.cross(Vec3::Y)
    }

    /// World from wall frame: x along, y up, z into the room, origin on the inner face.
    pub(super) fn frame(&self) -> Affine3A {
        Affine3A::from_mat3_translation(
            Mat3::from_cols(self.along, Vec3::Y, self.inward()),
            self.origin,
        )
    }
}

/// The four walls of a box room centred on the origin, in the order -X, +X, -Z, +Z.
pub(super) fn walls([sx, _, sz]: [f32; 3]) -> [Wall; 4] {
    let (x, z) = (0.5 * sx, 0.5 * sz);
    let wall = |origin, along, width| Wall { origin, along, width };
    [
        wall(Vec3::new(-x, 0., z), Vec3::NEG_Z, sz),
        wall(Vec3::new(x, 0., -z), Vec3::Z, sz),
        wall(Vec3::new(-x, 0., -z), Vec3::X, sx),
        wall(Vec3::new(x, 0., z), Vec3::NEG_X, sx),
    ]
}

/// Materials of a room's shell.
pub(super) struct Shell {
    /// Of the walls -X, +X, -Z, +Z.
    pub(super) walls: [Mat; 4],
    /// Floor.
    pub(super) floor: Mat,
    /// Ceiling.
    pub(super) ceiling: Mat,
}

/// A closed room `[-sx/2, sx/2] x [0, sy] x [-sz/2, sz/2]` with `holes` in its walls.
pub(super) fn room(
    b: &mut Builder,
    shell: &Shell,
    size: [f32; 3],
    thickness: f32,
    holes: [&[Hole]; 4],
) {
    let [sx, sy, sz] = size;
    for (i, wall) in walls(size).iter().enumerate() {
        // The X walls run past the corners; the Z walls end inside them.
        let reach = if i < 2 { thickness } else { OVERLAP };
        b.part(wall.frame(), |b| {
            let span = [-reach, -OVERLAP, wall.width + reach, sy + OVERLAP];
            pierced(b, shell.walls[i], span, thickness, holes[i]);
        });
    }
    let (x, z) = (0.5 * sx + thickness - 0.01, 0.5 * sz + thickness - 0.01);
    b.slab(shell.floor, [-x, -thickness, -z], [x, 0.0, z], 0.0);
    b.slab(shell.ceiling, [-x, sy, -z], [x, sy + thickness, z], 0.0);
}

/// A plate `span` = (u0, v0, u1, v1) wide, its face at z = 0 and its back at z = -thickness.
pub(super) fn pierced(b: &mut Builder, mat: Mat, span: [f32; 4], thickness: f32, holes: &[Hole]) {
    let cuts = |lo: usize, hi: usize| {
        let mut cuts = vec![span[lo], span[hi]];
        cuts.extend(holes.iter().flat_map(|h| [h.bounds()[lo], h.bounds()[hi]]));
        cuts.sort_by(f32::total_cmp);
        cuts.dedup();
        cuts
    };
    let (us, vs) = (cuts(0, 2), cuts(1, 3));
    let hole_at = |i: usize, j: usize| {
        let (u, v) = (0.5 * (us[i] + us[i + 1]), 0.5 * (vs[j] + vs[j + 1]));
        holes.iter().find(|h| {
            let [u0, v0, u1, v1] = h.bounds();
            u0 < u && u < u1 && v0 < v && v < v1
        })
    };
    // A cell that is air: outside the plate or in a rectangular hole.
    let open = |i: Option<usize>, j: Option<usize>| match (i, j) {
        (Some(i), Some(j)) if i + 1 < us.len() && j + 1 < vs.len() => {
            matches!(hole_at(i, j), Some(Hole::Rectangle(_)))
        }
        _ => true,
    };
    let depth = Vec3::NEG_Z * thickness;
    for i in 0..us.len() - 1 {
        for j in 0..vs.len() - 1 {
            if hole_at(i, j).is_some() {
                continue;
            }
            let at = Vec3::new(us[i], vs[j], 0.0);
            let (du, dv) = (Vec3::X * (us[i + 1] - us[i]), Vec3::Y * (vs[j + 1] - vs[j]));
            face(b, mat, at, du, dv);
            face(b, mat, at + depth, dv, du);
            let (left, below) = (i.checked_sub(1), j.checked_sub(1));
            if open(left, Some(j)) {
                b.quad(mat, at, dv, depth);
            }
            if open(Some(i + 1), Some(j)) {
                b.quad(mat, at + du, depth, dv);
            }
            if open(Some(i), below) {
                b.quad(mat, at, depth, du);
            }
            if open(Some(i), Some(j + 1)) {
                b.quad(mat, at + dv, du, depth);
            }
        }
    }
    for hole in holes {
        if let Hole::Round(circle) = *hole {
            round_hole(b, mat, circle, thickness);
        }
    }
}

/// A wall face with texture coordinates continuous over the whole wall.
fn face(b: &mut Builder, mat: Mat, at: Vec3, a: Vec3, c: Vec3) {
    let corners = [at, at + a, at + a + c, at + c].map(|p| (p, Vec3::ZERO, Vec2::new(p.x, p.y)));
    b.polygon(mat, &corners, a.cross(c));
}

/// The square plate around a round hole, both faces and the smooth reveal.
fn round_hole(b: &mut Builder, mat: Mat, [u, v, r]: [f32; 3], thickness: f32) {
    const SEGMENTS: u32 = 64;
    let spoke = |k: u32| {
        // Corners of the square fall on multiples of SEGMENTS / 8.
        let (s, c) = (k as f32 * TAU / SEGMENTS as f32).sin_cos();
        let reach = r / s.abs().max(c.abs());
        (Vec3::new(c, s, 0.0), Vec3::new(reach * c, reach * s, 0.0))
    };
    let centre = Vec3::new(u, v, 0.0);
    let depth = Vec3::NEG_Z * thickness;
    for k in 0..SEGMENTS {
        let ((n0, q0), (n1, q1)) = (spoke(k), spoke(k + 1));
        for (offset, outward) in [(Vec3::ZERO, Vec3::Z), (depth, Vec3::NEG_Z)] {
            let ring = [n0 * r, q0, q1, n1 * r].map(|p| p + centre + offset);
            let corners = ring.map(|p| (p, Vec3::ZERO, Vec2::new(p.x, p.y)));
            b.polygon(mat, &corners[..3], outward);
            b.polygon(mat, &[corners[0], corners[2], corners[3]], outward);
        }
        let at = |n: Vec3, z: f32| {
            let p = centre + n * r + Vec3::Z * z;
            (p, -n, Vec2::new(z, n.y.atan2(n.x) / TAU * r))
        };
        b.polygon(
            mat,
            &[at(n0, 0.0), at(n1, 0.0), at(n1, -thickness), at(n0, -thickness)],
            -n0 - n1,
        );
    }
}

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
    b.slab(
        mat,
        [u0 + 0.002, v0 - 0.02, -thickness + 0.01],
        [u1 - 0.002, v0 + 0.015, 0.0 + LIFT],
        0.003,
    );
    b.slab(mat, [u0 - 0.06, v0 - 0.018, -0.01], [u1 + 0.06, v0 + 0.014, 0.07], 0.008);
}

/// A flat moulding around an opening on the room's side, open at the bottom if `to_floor`.
pub(super) fn architrave(b: &mut Builder, mat: Mat, hole: [f32; 4], to_floor: bool) {
    let [u0, v0, u1, v1] = hole;
    let (w, z) = (0.07, [-0.005, 0.018]);
    let foot = if to_floor { v0 } else { v0 - w };
    b.slab(mat, [u0 - w, foot, z[0]], [u0, v1 + w, z[1]], 0.006);
    b.slab(mat, [u1, foot, z[0]], [u1 + w, v1 + w, z[1]], 0.006);
    b.slab(mat, [u0 - 0.003, v1 + 0.0006, z[0]], [u1 + 0.003, v1 + w - 0.001, z[1] - 0.001], 0.006);
    if !to_floor {
        b.slab(
            mat,
            [u0 - 0.003, foot + 0.001, z[0]],
            [u1 + 0.003, v0 - 0.0006, z[1] - 0.001],
            0.006,
        );
    }
}

/// Skirting along a wall between the given stretches (u from, u to), in the wall's frame.
pub(super) fn skirting(b: &mut Builder, mat: Mat, stretches: &[[f32; 2]], height: f32) {
    for &[u0, u1] in stretches {
        b.slab(mat, [u0, -0.01, -0.01], [u1, height - 0.025, 0.018], 0.002);
        b.slab(mat, [u0 + 0.0005, height - 0.03, -0.009], [u1 - 0.0005, height, 0.012], 0.006);
    }
}

/// A quarter-round ceiling moulding along a wall of `width`, in the wall's frame.
pub(super) fn cornice(b: &mut Builder, mat: Mat, width: f32, height: f32, radius: f32) {
    b.sheet(mat, [1, 12], Vec2::new(width, radius), |u, v| {
        let (s, c) = (v * 0.5 * PI).sin_cos();
        let swell = 0.12 * radius * (v * TAU).sin();
        Vec3::new(
            u * (width + 0.02) - 0.01,
            height - radius * (1.0 - s) - 0.5 * swell,
            radius * (1.0 - c) + 0.5 * swell,
        )
    });
}

/// Raised rectangular moulding on a wall, in the wall's frame.
pub(super) fn panel_moulding(b: &mut Builder, mat: Mat, [u0, v0, u1, v1]: [f32; 4]) {
    let (w, z) = (0.03, [-0.004, 0.012]);
    for (u, v) in [([u0, u0 + w], [v0, v1]), ([u1 - w, u1], [v0, v1])] {
        b.slab(mat, [u[0], v[0], z[0]], [u[1], v[1], z[1]], 0.006);
    }
    for v in [v0, v1 - w] {
        b.slab(
            mat,
            [u0 + 0.002, v + 0.0005, z[0]],
            [u1 - 0.002, v + w - 0.0005, z[1] - 0.0008],
            0.006,
        );
    }
}

/// A closed panelled door of `width` x `height` with handle and architrave on the wall's inner face,
/// its left edge at `u`.
pub(super) fn door(b: &mut Builder, leaf: Mat, metal: Mat, u: f32, [width, height]: [f32; 2]) {
    b.slab(leaf, [u + 0.003, 0.005, -0.01], [u + width - 0.003, height - 0.003, 0.010], 0.003);
    architrave(b, leaf, [u, 0.001, u + width, height], true);
    let (stile, middle) = (0.11, 0.92);
    for [v0, v1] in [[0.22, middle - 0.06], [middle + 0.06, height - 0.12]] {
        panel_moulding_at(b, leaf, [u + stile, v0, u + width - stile, v1], 0.010);
        b.slab(
            leaf,
            [u + stile + 0.06, v0 + 0.06, 0.0],
            [u + width - stile - 0.06, v1 - 0.06, 0.017],
            0.007,
        );
    }
    let knob = Vec3::new(u + width - 0.06, 1.02, 0.012);
    b.part(Affine3A::from_translation(knob) * Affine3A::from_rotation_x(0.5 * PI), |b| {
        b.drum(metal, [-0.005, 0.006], [0.027, 0.026], 0.002);
    });
    let elbow = knob + Vec3::Z * 0.045;
    let grip = elbow - Vec3::X * 0.12;
    b.tube(
        metal,
        14,
        &[
            (knob, 0.009),
            (elbow - Vec3::Z * 0.008, 0.009),
            (elbow - Vec3::new(0.008, 0.0, 0.0), 0.009),
            (grip, 0.0085),
            (grip - Vec3::X * 0.003, 0.004),
        ],
    );
}

/// [`panel_moulding`] raised to stand on a leaf of thickness `z`.
fn panel_moulding_at(b: &mut Builder, mat: Mat, panel: [f32; 4], z: f32) {
    b.part(Affine3A::from_translation(Vec3::Z * z), |b| panel_moulding(b, mat, panel));
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
            u[0] + width * (s + 0.006 * (2.0 * phase).sin()),
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
