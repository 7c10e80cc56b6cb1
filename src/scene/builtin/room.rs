//! Thick walls with rectangular and round openings.

use std::f32::consts::TAU;

use glam::{Affine3A, Mat3, Vec2, Vec3};

use super::mesh::{Builder, Mat};

/// Overlap of adjacent parts in metres, so that no faces are coplanar and no light leaks.
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
    /// World from wall frame: x along, y up, z into the room, origin on the inner face.
    pub(super) fn frame(&self) -> Affine3A {
        let axes = Mat3::from_cols(self.along, Vec3::Y, self.along.cross(Vec3::Y));
        Affine3A::from_mat3_translation(axes, self.origin)
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

/// A closed room `[-sx/2, sx/2] x [0, sy] x [-sz/2, sz/2]` with `holes` in its walls; materials are
/// those of the walls -X, +X, -Z, +Z, the floor and the ceiling.
pub(super) fn room(
    b: &mut Builder,
    [mats @ .., floor, ceiling]: [Mat; 6],
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
            pierced(b, mats[i], span, thickness, holes[i]);
        });
    }
    let (x, z) = (0.5 * sx + thickness - 0.01, 0.5 * sz + thickness - 0.01);
    b.slab(floor, [-x, -thickness, -z], [x, 0.0, z], 0.0);
    b.slab(ceiling, [-x, sy, -z], [x, sy + thickness, z], 0.0);
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
            for (i, j, at, along, across) in [
                (left, Some(j), at, dv, depth),
                (Some(i + 1), Some(j), at + du, depth, dv),
                (Some(i), below, at, depth, du),
                (Some(i), Some(j + 1), at + dv, du, depth),
            ] {
                if open(i, j) {
                    b.quad(mat, at, along, across);
                }
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
            (centre + n * r + Vec3::Z * z, -n, Vec2::new(z, n.y.atan2(n.x) / TAU * r))
        };
        let soffit = [at(n0, 0.0), at(n1, 0.0), at(n1, -thickness), at(n0, -thickness)];
        b.polygon(mat, &soffit, -n0 - n1);
    }
}
