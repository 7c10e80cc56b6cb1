//! Houses: a plain core behind pierced fronts with windows, doors, sills and cornices.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use super::fittings::window_frame;
use super::mesh::{Builder, Mat};
use super::room::{Hole, Wall, pierced};

/// Materials of a house.
#[derive(Debug, Clone, Copy)]
pub(super) struct HouseMats {
    /// Walls.
    pub(super) wall: Mat,
    /// Base course.
    pub(super) base: Mat,
    /// Sills, lintels, cornices.
    pub(super) trim: Mat,
    /// Window frames.
    pub(super) frame: Mat,
    /// Surfaces behind windows.
    pub(super) pane: Mat,
    /// Roof.
    pub(super) roof: Mat,
    /// Shutters and doors, if any.
    pub(super) shutter: Option<Mat>,
}

/// Usual distance of windows in metres.
const BAY: f32 = 3.0;
/// How far fronts stand before the core.
const FRONT: f32 = 0.28;
/// Height of a ground floor in metres.
const GROUND: f32 = 3.6;

/// A house over `[x0, x1] x [z0, z1]` of `height`; fronts with windows on the sides marked in
/// the order -X, +X, -Z, +Z. `windows`: number of floors above the ground floor, and whether that has shop windows.
pub(super) fn house(
    b: &mut Builder,
    m: &HouseMats,
    [x0, z0, x1, z1]: [f32; 4],
    height: f32,
    fronts: [bool; 4],
    windows: (u32, bool),
) {
    let inset = fronts.map(|front| if front { FRONT - 0.02 } else { 0.0 });
    let [left, right, far, near] = inset;
    b.slab(m.pane, [x0 + left, -0.02, z0 + far], [x1 - right, height - 0.05, z1 - near], 0.0);
    let sides = [
        (Vec3::new(x0, 0., z0), Vec3::Z, z1 - z0),
        (Vec3::new(x1, 0., z1), Vec3::NEG_Z, z1 - z0),
        (Vec3::new(x1, 0., z0), Vec3::NEG_X, x1 - x0),
        (Vec3::new(x0, 0., z1), Vec3::X, x1 - x0),
    ];
    for (side, (origin, along, width)) in sides.into_iter().enumerate() {
        if fronts[side] {
            // Seen from the street the front looks "into the room".
            let wall = Wall { origin, along, width };
            b.part(wall.frame(), |b| front(b, m, [width, height], windows, side));
        }
    }
    for (over, bottom, top) in
        [(0.28, height - 0.22, height + 0.06), (0.12, height - 0.42, height - 0.20)]
    {
        b.slab(m.trim, [x0 - over, bottom, z0 - over], [x1 + over, top, z1 + over], 0.03);
    }
    b.slab(m.roof, [x0 + 0.1, height, z0 + 0.1], [x1 - 0.1, height + 0.5, z1 - 0.1], 0.05);
}

fn front(b: &mut Builder, m: &HouseMats, size: [f32; 2], rows: (u32, bool), side: usize) {
    let ([width, height], (floors, shops)) = (size, rows);
    let bays = (width / BAY).round().max(1.0) as u32;
    let bay = width / bays as f32;
    let storey = (height - GROUND - 0.4) / floors as f32;
    let (w, h) = ((0.42 * bay).min(1.15), (0.60 * storey).min(1.9));
    let (mut windows, mut openings) = (Vec::new(), Vec::new());
    for i in 0..bays {
        let middle = bay * (i as f32 + 0.5);
        for j in 0..floors {
            let sill = GROUND + storey * j as f32 + 0.24 * storey;
            windows.push([middle - 0.5 * w, sill, middle + 0.5 * w, sill + h]);
        }
        let is_door = i % 3 == 1;
        let (half, sill) = match (is_door, shops) {
            (true, _) => (0.55, 0.02),
            (false, true) => ((0.36 * bay).min(1.3), 0.55),
            (false, false) => (0.5 * w, 1.0),
        };
        openings.push(([middle - half, sill, middle + half, 0.80 * GROUND], is_door));
    }
    let holes: Vec<Hole> =
        windows.iter().copied().chain(openings.iter().map(|o| o.0)).map(Hole::Rectangle).collect();
    // Each front ends a little behind the face of its neighbour.
    let reach = if side < 2 { -0.006 } else { -0.004 };
    pierced(b, m.wall, [-reach, -0.03, width + reach, height - 0.1], FRONT, &holes);
    b.slab(m.trim, [-0.03, GROUND - 0.14, -0.05], [width + 0.03, GROUND, 0.07], 0.02);
    // The base course, interrupted by doors.
    let mut from = -0.035;
    for ([u0, _, u1, _], _) in openings.iter().filter(|o| o.1) {
        b.slab(m.base, [from, -0.03, -0.05], [u0 - 0.10, 0.45, 0.055], 0.015);
        from = u1 + 0.10;
    }
    b.slab(m.base, [from, -0.03, -0.05], [width + 0.035, 0.45, 0.055], 0.015);
    for window in &windows {
        window_frame(b, m.frame, *window, 0.12, [2, 3], 0.0);
        sill(b, m.trim, *window);
        let [u0, v0, u1, v1] = *window;
        b.slab(m.trim, [u0 - 0.10, v1 + 0.001, -0.05], [u1 + 0.10, v1 + 0.16, 0.03], 0.012);
        let Some(shutter) = m.shutter else { continue };
        let w = 0.5 * (u1 - u0);
        for (left, right) in [(u0 - w - 0.012, u0 - 0.012), (u1 + 0.012, u1 + w + 0.012)] {
            b.slab(shutter, [left, v0 + 0.02, 0.004], [right, v1 - 0.002, 0.03], 0.004);
            let louvres = ((v1 - v0) / 0.15) as u32;
            for k in 0..louvres {
                let v = v0 + 0.09 + (v1 - v0 - 0.16) * k as f32 / louvres as f32;
                b.slab(shutter, [left + 0.05, v, 0.02], [right - 0.05, v + 0.08, 0.042], 0.0);
            }
        }
    }
    for (opening, is_door) in &openings {
        let [u0, v0, u1, v1] = *opening;
        if *is_door {
            let leaf = m.shutter.unwrap_or(m.frame);
            let light = v1 - 0.5;
            b.slab(leaf, [u0 - 0.01, v0 - 0.04, -0.21], [u1 + 0.01, light, -0.15], 0.006);
            window_frame(b, m.frame, [u0, light, u1, v1], 0.13, [3, 1], 0.0);
            let middle = 0.5 * (u0 + u1);
            for (left, right) in [(u0 + 0.07, middle - 0.04), (middle + 0.04, u1 - 0.07)] {
                for (low, high) in [(v0 + 0.2, v0 + 0.9), (v0 + 1.05, light - 0.15)] {
                    b.slab(leaf, [left, low, -0.16], [right, high, -0.13], 0.018);
                }
            }
            b.ball(m.trim, Vec3::new(middle + 0.02, v0 + 1.0, -0.12), 0.028);
            b.slab(m.base, [u0 - 0.08, -0.02, -0.27], [u1 + 0.08, 0.015, 0.30], 0.01);
        } else {
            window_frame(b, m.frame, *opening, 0.10, [if shops { 3 } else { 2 }, 2], 0.0);
            sill(b, m.trim, *opening);
        }
        b.slab(m.trim, [u0 - 0.14, v1 + 0.001, -0.05], [u1 + 0.14, v1 + 0.19, 0.045], 0.012);
    }
}

fn sill(b: &mut Builder, mat: Mat, [u0, v0, u1, _]: [f32; 4]) {
    b.slab(mat, [u0 - 0.08, v0 - 0.09, -0.10], [u1 + 0.08, v0 + 0.012, 0.09], 0.012);
}

/// A round arch in a wall's frame between columns at `u0` and `u1`: the wall above it from
/// `spring` to `top`, 40 cm deep behind z = 0.
pub(super) fn arch(b: &mut Builder, mat: Mat, [u0, u1]: [f32; 2], [spring, top]: [f32; 2]) {
    const STEPS: u32 = 24;
    let (middle, r) = (0.5 * (u0 + u1), 0.5 * (u1 - u0));
    let at = |k: u32| {
        let (s, c) = (PI * k as f32 / STEPS as f32).sin_cos();
        (Vec3::new(-c, s, 0.0), Vec3::new(middle - r * c, spring + r * s, 0.0))
    };
    let back = Vec3::NEG_Z * 0.4;
    for k in 0..STEPS {
        let ((n0, p0), (n1, p1)) = (at(k), at(k + 1));
        let high = |p: Vec3| Vec3::new(p.x, top, 0.0);
        for (offset, outward) in [(Vec3::ZERO, Vec3::Z), (back, Vec3::NEG_Z)] {
            let face =
                [p0, p1, high(p1), high(p0)].map(|p| (p + offset, Vec3::ZERO, Vec2::new(p.x, p.y)));
            b.polygon(mat, &face[..3], outward);
            b.polygon(mat, &[face[0], face[2], face[3]], outward);
        }
        let soffit = [(p0, n0), (p1, n1), (p1 + back, n1), (p0 + back, n0)]
            .map(|(p, n)| (p, -n, Vec2::new(p.z, r * PI * k as f32 / STEPS as f32)));
        b.polygon(mat, &soffit, -n0 - n1);
    }
}

/// A column with base and capital up to `height`.
pub(super) fn column(b: &mut Builder, mat: Mat, height: f32, radius: f32) {
    let r = radius;
    b.slab(mat, [-1.45 * r, -0.02, -1.45 * r], [1.45 * r, 0.14, 1.45 * r], 0.012);
    b.slab(mat, [-1.5 * r, height - 0.13, -1.5 * r], [1.5 * r, height, 1.5 * r], 0.012);
    let mut profile = vec![(1.35 * r, 0.13)];
    for k in 0..=8 {
        let (s, c) = (PI * (k as f32 / 8.0 - 0.5)).sin_cos();
        profile.push((1.2 * r + 0.15 * r * c, 0.17 + 0.04 * s));
    }
    profile.push((1.05 * r, 0.22));
    for k in 0..=10 {
        let t = k as f32 / 10.0;
        profile.push((r * (1.0 - 0.12 * t * t), 0.25 + (height - 0.62) * t));
    }
    let neck = [(0.98 * r, height - 0.34), (0.98 * r, height - 0.31), (0.9 * r, height - 0.29)];
    profile.extend(neck);
    for k in 0..=6 {
        let (s, c) = (k as f32 / 6.0 * 0.5 * PI).sin_cos();
        profile.push((0.9 * r + 0.45 * r * (1.0 - c), height - 0.27 + 0.15 * s));
    }
    b.lathe(mat, 28, profile);
}
