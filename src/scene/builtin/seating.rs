//! Sofas and chairs: their origin is on the floor below their middle, front along +Z.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use super::mesh::{Builder, Mat, placed};
use crate::noise::smoothstep;

/// A sofa of `width` for `seats`, with loose cushions.
pub(super) fn sofa(b: &mut Builder, cloth: Mat, wood: Mat, width: f32, seats: u32) {
    let (x, depth) = (0.5 * width, 0.92);
    let arm = 0.17;
    for (sx, z) in [(-1., 0.08), (1., 0.08), (-1., depth - 0.1), (1., depth - 0.1)] {
        let foot = Vec3::new(sx * (x - 0.1), 0.0, z - 0.5 * depth);
        b.tube(wood, 16, [(foot, 0.014), (foot + Vec3::Y * 0.16, 0.024)]);
    }
    let z = 0.5 * depth;
    b.slab(cloth, [-x + 0.02, 0.13, -z + 0.02], [x - 0.02, 0.30, z - 0.03], 0.025);
    for side in [-1.0, 1.0] {
        let middle = Vec3::new(side * (x - 0.5 * arm), 0.37, 0.0);
        b.blob(cloth, middle, Vec3::new(0.5 * arm, 0.245, z), [9.0, 7.0], 16);
    }
    b.part(placed([0.0, 0.48, -z + 0.12], [-8.0, 0.0, 0.0]), |b| {
        b.blob(cloth, Vec3::ZERO, Vec3::new(x - 0.06, 0.33, 0.11), [10.0, 6.0], 20);
    });
    let seat = (width - 2.0 * arm) / seats as f32;
    for k in 0..seats {
        let middle = -x + arm + seat * (k as f32 + 0.5);
        let lean = 0.8 * ((k * 2) as f32 - 1.0);
        b.part(placed([middle, 0.375, 0.09], [1.5, lean, 0.0]), |b| {
            b.blob(cloth, Vec3::ZERO, Vec3::new(0.497 * seat, 0.105, 0.40), [9.0, 3.2], 18);
        });
        b.part(placed([middle, 0.63, -z + 0.27], [-14.0, lean, 0.0]), |b| {
            b.blob(cloth, Vec3::ZERO, Vec3::new(0.485 * seat, 0.24, 0.10), [3.2, 4.5], 18);
        });
    }
}

/// A pillow lying in its own x-z plane.
pub(super) fn pillow(b: &mut Builder, cloth: Mat, half: f32) {
    b.blob(cloth, Vec3::ZERO, Vec3::new(half, 0.075, half), [5.5, 1.75], 18);
}

/// An armchair: an upholstered shell on splayed wooden legs.
pub(super) fn armchair(b: &mut Builder, cloth: Mat, wood: Mat) {
    for (sx, sz) in [(-1., -1.), (1., -1.), (1., 1.), (-1., 1.)] {
        let foot = Vec3::new(sx * 0.33, 0.0, sz * 0.30);
        let head = Vec3::new(sx * 0.26, 0.24, sz * 0.24);
        b.tube(wood, 16, [(foot, 0.011), (head, 0.021)]);
    }
    b.blob(cloth, Vec3::new(0.0, 0.27, 0.0), Vec3::new(0.35, 0.075, 0.34), [5.0, 4.0], 16);
    b.blob(cloth, Vec3::new(0.0, 0.385, 0.03), Vec3::new(0.27, 0.075, 0.31), [5.0, 3.0], 16);
    // The shell: a rounded wall around the seat, highest behind.
    let wall = |turn: f32, inward: f32, up: f32| {
        let angle = PI + (turn - 0.5) * 1.32 * PI;
        let (s, c) = angle.sin_cos();
        let behind = 0.5 + 0.5 * (angle - PI).cos();
        let height = 0.30 + 0.26 * smoothstep(0.25, 0.95, behind);
        let lean = 1.0 + 0.18 * up * (height - 0.25);
        let r = 0.37 - inward;
        Vec3::new(r * s * lean, 0.26 + up * height, r * c * lean * 0.98)
    };
    // `turn` runs once around the shell's section: outside, top, inside, bottom.
    let section = |along: f32, turn: f32| {
        let (s, c) = (turn * TAU).sin_cos();
        let up = 0.5 - 0.5 * c.signum() * c.abs().powf(0.35);
        let inward = 0.045 * (1.0 - s.signum() * s.abs().powf(0.6));
        wall(along, inward, up)
    };
    b.sheet(cloth, [48, 24], Vec2::new(1.6, 1.2), section);
    for end in [0.0, 1.0] {
        b.sheet(cloth, [8, 24], Vec2::new(0.1, 1.2), |u, v| {
            let turn = if end > 0.5 { 1.0 - v } else { v };
            let middle = wall(end, 0.045, 0.5);
            let bulge = Vec3::new((end - 0.5) * -0.05, 0.0, 0.035) * (1.0 - u * u);
            middle.lerp(section(end, turn), u) + bulge
        });
    }
}

/// A kitchen or visitor chair of wood with a padded seat.
pub(super) fn side_chair(b: &mut Builder, wood: Mat, seat: Mat) {
    for sx in [-1.0, 1.0] {
        let (front, back) = (Vec3::new(sx * 0.19, 0.0, 0.19), Vec3::new(sx * 0.18, 0.0, -0.21));
        b.tube(wood, 14, [(front, 0.012), (Vec3::new(sx * 0.18, 0.44, 0.17), 0.018)]);
        let path = [
            (back, 0.012),
            (Vec3::new(sx * 0.175, 0.44, -0.17), 0.018),
            (Vec3::new(sx * 0.17, 0.66, -0.185), 0.016),
            (Vec3::new(sx * 0.165, 0.84, -0.225), 0.012),
        ];
        b.tube(wood, 14, path);
        b.rod(wood, Vec3::new(sx * 0.186, 0.22, 0.18), Vec3::new(sx * 0.178, 0.22, -0.19), 0.009);
    }
    b.slab(wood, [-0.20, 0.40, -0.19], [0.20, 0.435, 0.20], 0.008);
    b.blob(seat, Vec3::new(0.0, 0.445, 0.005), Vec3::new(0.205, 0.028, 0.195), [6.0, 2.6], 7);
    b.sheet(wood, [8, 12], Vec2::new(0.4, 0.12), |u, v| {
        // A bent back rest, closed around its section.
        let x = (u - 0.5) * 0.32;
        let (s, c) = (v * TAU).sin_cos();
        Vec3::new(x, 0.775 + 0.055 * s, -0.213 - 0.012 * s - 0.14 * (0.04 - x * x) + 0.009 * c)
    });
}

/// A swivel chair on castors with arm rests.
pub(super) fn office_chair(b: &mut Builder, cloth: Mat, plastic: Mat, metal: Mat) {
    for k in 0..5 {
        let (s, c) = (k as f32 * TAU / 5.0).sin_cos();
        let out = Vec3::new(s, 0.0, c);
        let path = [
            (Vec3::Y * 0.11, 0.026),
            (out * 0.17 + Vec3::Y * 0.10, 0.022),
            (out * 0.30 + Vec3::Y * 0.075, 0.015),
        ];
        b.tube(plastic, 12, path);
        for side in [-0.014, 0.014] {
            let hub = out * 0.30 + out.cross(Vec3::Y) * side + Vec3::Y * 0.027;
            let axle = out.cross(Vec3::Y) * 0.009;
            b.tube(plastic, 18, [(hub - axle, 0.027), (hub + axle, 0.027)]);
        }
    }
    b.drum(metal, [0.09, 0.44], [0.024, 0.024], 0.002);
    b.drum(plastic, [0.08, 0.27], [0.036, 0.032], 0.004);
    b.slab(plastic, [-0.10, 0.40, -0.14], [0.10, 0.445, 0.12], 0.01);
    b.blob(cloth, Vec3::new(0.0, 0.475, 0.01), Vec3::new(0.25, 0.045, 0.245), [4.5, 2.8], 16);
    let path = [
        (Vec3::new(0.0, 0.425, -0.10), 0.020),
        (Vec3::new(0.0, 0.43, -0.27), 0.020),
        (Vec3::new(0.0, 0.52, -0.305), 0.020),
        (Vec3::new(0.0, 0.78, -0.285), 0.018),
    ];
    b.tube(plastic, 12, path);
    let shape = |u: f32, v: f32, side: f32| {
        let (x, y) = ((u - 0.5) * 2.0, (v - 0.5) * 2.0);
        let half = 0.225 - 0.03 * y * y;
        let belly = 0.035 * (1.0 - y * y) - 0.02 * y;
        let rim = ((1.0 - x.abs().powi(6)) * (1.0 - y.abs().powi(6))).max(0.0).sqrt();
        let z = -0.275 + 0.07 * x * x + belly * 0.5 + side * 0.026 * rim;
        Vec3::new(x * half, 0.83 + 0.28 * y, z)
    };
    b.sheet(cloth, [20, 20], Vec2::new(0.46, 0.56), |u, v| shape(u, v, 1.0));
    b.sheet(cloth, [20, 20], Vec2::new(0.46, 0.56), |u, v| shape(1.0 - u, v, -1.0));
    for sx in [-1.0, 1.0] {
        let path = [
            (Vec3::new(sx * 0.10, 0.43, -0.02), 0.014),
            (Vec3::new(sx * 0.27, 0.44, -0.02), 0.014),
            (Vec3::new(sx * 0.29, 0.50, -0.02), 0.014),
            (Vec3::new(sx * 0.285, 0.66, -0.03), 0.014),
        ];
        b.tube(plastic, 12, path);
        let (middle, half) = (Vec3::new(sx * 0.285, 0.675, 0.0), Vec3::new(0.04, 0.016, 0.13));
        b.blob(plastic, middle, half, [4.0, 3.0], 8);
    }
}
