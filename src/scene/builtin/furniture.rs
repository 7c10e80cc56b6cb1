//! Pieces that stand on a floor: their origin is on the floor below their middle, front along +Z.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use glam::{Affine3A, EulerRot, Quat, Vec2, Vec3};

use super::mesh::{Builder, LIFT, Mat};
use super::objects::books;
use crate::noise::{Stream, smoothstep};

/// A rotation by degrees about X, then Y, then Z, and a translation.
pub(super) fn placed(at: [f32; 3], degrees: [f32; 3]) -> Affine3A {
    let [x, y, z] = degrees.map(f32::to_radians);
    Affine3A::from_rotation_translation(Quat::from_euler(EulerRot::YXZ, y, x, z), Vec3::from(at))
}

/// A table of `width` x `depth` x `height` on four tapered, slightly splayed legs.
pub(super) fn table(b: &mut Builder, top: Mat, legs: Mat, [width, depth, height]: [f32; 3]) {
    let (x, z) = (0.5 * width, 0.5 * depth);
    b.slab(top, [-x, height - 0.032, -z], [x, height, z], 0.006);
    b.slab(
        legs,
        [-x + 0.09, height - 0.10, -z + 0.08],
        [x - 0.09, height - 0.028, -z + 0.10],
        0.003,
    );
    b.slab(legs, [-x + 0.09, height - 0.10, z - 0.10], [x - 0.09, height - 0.028, z - 0.08], 0.003);
    for (sx, sz) in [(-1., -1.), (1., -1.), (1., 1.), (-1., 1.)] {
        let head = Vec3::new(sx * (x - 0.09), height - 0.02, sz * (z - 0.09));
        let foot = Vec3::new(sx * (x - 0.05), 0.0, sz * (z - 0.05));
        b.tube(legs, 20, &[(foot, 0.013), (head.lerp(foot, 0.3), 0.024), (head, 0.026)]);
    }
}

/// A round table with a thick rounded top on three legs.
pub(super) fn round_table(b: &mut Builder, top: Mat, legs: Mat, radius: f32, height: f32) {
    let t = 0.034;
    let mut profile = vec![(0.0, height - t), (radius - 0.05, height - t)];
    for i in 0..=8 {
        let (s, c) = (PI * (i as f32 / 8.0 - 0.5)).sin_cos();
        profile.push((radius - 0.018 + 0.018 * c, height - 0.5 * t + 0.5 * t * s));
    }
    profile.push((0.0, height));
    b.lathe(top, 96, &profile);
    for k in 0..3 {
        let (s, c) = (k as f32 * TAU / 3.0 + 0.4).sin_cos();
        let out = Vec3::new(c, 0.0, s);
        let head = out * (radius * 0.55) + Vec3::Y * (height - 0.01);
        b.tube(
            legs,
            20,
            &[
                (out * radius * 0.85, 0.012),
                (out * radius * 0.62 + Vec3::Y * height * 0.75, 0.021),
                (head, 0.022),
            ],
        );
    }
}

/// A sofa of `width` for `seats`, with loose cushions.
pub(super) fn sofa(b: &mut Builder, cloth: Mat, wood: Mat, width: f32, seats: u32) {
    let (x, depth) = (0.5 * width, 0.92);
    let arm = 0.17;
    for (sx, z) in [(-1., 0.08), (1., 0.08), (-1., depth - 0.1), (1., depth - 0.1)] {
        let foot = Vec3::new(sx * (x - 0.1), 0.0, z - 0.5 * depth);
        b.tube(wood, 16, &[(foot, 0.014), (foot + Vec3::Y * 0.16, 0.024)]);
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
        b.tube(wood, 16, &[(foot, 0.011), (head, 0.021)]);
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
    b.sheet(cloth, [48, 24], Vec2::new(1.6, 1.2), |u, v| {
        // v runs once around the shell's section: outside, top, inside, bottom.
        let (s, c) = (v * TAU).sin_cos();
        let up = 0.5 - 0.5 * c.signum() * c.abs().powf(0.35);
        let inward = 0.045 * (1.0 - s.signum() * s.abs().powf(0.6));
        wall(u, inward, up)
    });
    for end in [0.0, 1.0] {
        b.sheet(cloth, [8, 24], Vec2::new(0.1, 1.2), |u, v| {
            let turn = if end > 0.5 { 1.0 - v } else { v };
            let (s, c) = (turn * TAU).sin_cos();
            let up = 0.5 - 0.5 * c.signum() * c.abs().powf(0.35);
            let inward = 0.045 * (1.0 - s.signum() * s.abs().powf(0.6));
            let middle = wall(end, 0.045, 0.5);
            let bulge = Vec3::new((end - 0.5) * -0.05, 0.0, 0.035) * (1.0 - u * u);
            middle.lerp(wall(end, inward, up), u) + bulge
        });
    }
}

/// A kitchen or visitor chair of wood with a padded seat.
pub(super) fn side_chair(b: &mut Builder, wood: Mat, seat: Mat) {
    for sx in [-1.0, 1.0] {
        let (front, back) = (Vec3::new(sx * 0.19, 0.0, 0.19), Vec3::new(sx * 0.18, 0.0, -0.21));
        b.tube(wood, 14, &[(front, 0.012), (Vec3::new(sx * 0.18, 0.44, 0.17), 0.018)]);
        b.tube(
            wood,
            14,
            &[
                (back, 0.012),
                (Vec3::new(sx * 0.175, 0.44, -0.17), 0.018),
                (Vec3::new(sx * 0.17, 0.66, -0.185), 0.016),
                (Vec3::new(sx * 0.165, 0.84, -0.225), 0.012),
            ],
        );
        b.rod(wood, Vec3::new(sx * 0.186, 0.22, 0.18), Vec3::new(sx * 0.178, 0.22, -0.19), 0.009);
    }
    b.slab(wood, [-0.20, 0.40, -0.19], [0.20, 0.435, 0.20], 0.008);
    b.blob(seat, Vec3::new(0.0, 0.445, 0.005), Vec3::new(0.205, 0.028, 0.195), [6.0, 2.6], 7);
    b.sheet(wood, [8, 12], Vec2::new(0.4, 0.12), |u, v| {
        // A bent back rest, closed around its section.
        let x = (u - 0.5) * 0.39;
        let (s, c) = (v * TAU).sin_cos();
        Vec3::new(x, 0.775 + 0.055 * s, -0.225 - 0.14 * (0.04 - x * x) + 0.009 * c)
    });
}

/// A swivel chair on castors with arm rests.
pub(super) fn office_chair(b: &mut Builder, cloth: Mat, plastic: Mat, metal: Mat) {
    for k in 0..5 {
        let (s, c) = (k as f32 * TAU / 5.0).sin_cos();
        let out = Vec3::new(s, 0.0, c);
        b.tube(
            plastic,
            12,
            &[
                (Vec3::Y * 0.11, 0.026),
                (out * 0.17 + Vec3::Y * 0.10, 0.022),
                (out * 0.30 + Vec3::Y * 0.075, 0.015),
            ],
        );
        for side in [-0.014, 0.014] {
            let hub = out * 0.30 + out.cross(Vec3::Y) * side + Vec3::Y * 0.027;
            let axle = out.cross(Vec3::Y) * 0.009;
            b.tube(plastic, 18, &[(hub - axle, 0.027), (hub + axle, 0.027)]);
        }
    }
    b.drum(metal, [0.09, 0.44], [0.024, 0.024], 0.002);
    b.drum(plastic, [0.08, 0.27], [0.036, 0.032], 0.004);
    b.slab(plastic, [-0.10, 0.40, -0.14], [0.10, 0.445, 0.12], 0.01);
    b.blob(cloth, Vec3::new(0.0, 0.475, 0.01), Vec3::new(0.25, 0.045, 0.245), [4.5, 2.8], 16);
    b.tube(
        plastic,
        12,
        &[
            (Vec3::new(0.0, 0.425, -0.10), 0.020),
            (Vec3::new(0.0, 0.43, -0.27), 0.020),
            (Vec3::new(0.0, 0.52, -0.305), 0.020),
            (Vec3::new(0.0, 0.78, -0.285), 0.018),
        ],
    );
    let shape = |u: f32, v: f32, side: f32| {
        let (x, y) = ((u - 0.5) * 2.0, (v - 0.5) * 2.0);
        let half = 0.225 - 0.03 * y * y;
        let belly = 0.035 * (1.0 - y * y) - 0.02 * y;
        let rim = ((1.0 - x.abs().powi(6)) * (1.0 - y.abs().powi(6))).max(0.0).sqrt();
        Vec3::new(
            x * half,
            0.83 + 0.28 * y,
            -0.275 + 0.07 * x * x + belly * 0.5 + side * 0.026 * rim,
        )
    };
    b.sheet(cloth, [20, 20], Vec2::new(0.46, 0.56), |u, v| shape(u, v, 1.0));
    b.sheet(cloth, [20, 20], Vec2::new(0.46, 0.56), |u, v| shape(1.0 - u, v, -1.0));
    for sx in [-1.0, 1.0] {
        b.tube(
            plastic,
            12,
            &[
                (Vec3::new(sx * 0.10, 0.43, -0.02), 0.014),
                (Vec3::new(sx * 0.27, 0.44, -0.02), 0.014),
                (Vec3::new(sx * 0.29, 0.50, -0.02), 0.014),
                (Vec3::new(sx * 0.285, 0.66, -0.03), 0.014),
            ],
        );
        b.blob(
            plastic,
            Vec3::new(sx * 0.285, 0.675, 0.0),
            Vec3::new(0.04, 0.016, 0.13),
            [4.0, 3.0],
            8,
        );
    }
}

/// An open shelf `width` x `height` x `depth` with `rows` boards and a back, filled with books and
/// room for ornaments: calls `ornament(builder, row, free width)` at the middle of each free stretch.
pub(super) fn bookcase(
    b: &mut Builder,
    [wood, book, paper]: [Mat; 3],
    [width, height, depth]: [f32; 3],
    rows: u32,
    mut ornament: impl FnMut(&mut Builder, u32, f32),
) {
    let (x, z, t) = (0.5 * width, 0.5 * depth, 0.022);
    for side in [-1.0, 1.0] {
        let inner = side * (x - t);
        b.slab(wood, [inner.min(side * x), 0.0, -z], [inner.max(side * x), height, z], 0.002);
    }
    b.slab(wood, [-x + 0.01, 0.05, -z + 0.003], [x - 0.01, height - 0.01, -z + 0.012], 0.0);
    b.slab(
        wood,
        [-x + 0.006, height - t - 0.001, -z + 0.001],
        [x - 0.006, height - 0.001, z + 0.006],
        0.002,
    );
    b.slab(wood, [-x + 0.01, 0.001, z - 0.045], [x - 0.01, 0.07, z - 0.03], 0.0);
    let step = (height - t - 0.08) / rows as f32;
    let mut stream = Stream::new(rows * 31 + (width * 100.0) as u32);
    for row in 0..rows {
        let y = 0.07 + step * row as f32;
        b.slab(wood, [-x + 0.01, y, -z + 0.004], [x - 0.01, y + t, z - 0.006], 0.0015);
        let inside = width - 2.0 * t - 0.01;
        let filled = inside * stream.between(0.42, 0.80);
        let left = row % 2 == 0;
        let start = if left { -0.5 * inside } else { 0.5 * inside - filled };
        b.standing(Vec3::new(start, y + t, 0.0), 0.0, |b| {
            books(b, [book, paper], filled, step - t - 0.02, depth - 0.03, row * 17 + 5);
        });
        let free = inside - filled;
        let middle = if left { 0.5 * (inside - free) } else { 0.5 * (free - inside) };
        b.standing(Vec3::new(middle, y + t, 0.0), 0.0, |b| ornament(b, row, free));
    }
}

/// A cabinet with `columns` x `rows` drawer fronts and small handles, on a recessed plinth.
pub(super) fn drawers(
    b: &mut Builder,
    body: Mat,
    metal: Mat,
    size: [f32; 3],
    [columns, rows]: [u32; 2],
) {
    let [width, height, depth] = size;
    let (x, z) = (0.5 * width, 0.5 * depth);
    b.slab(body, [-x + 0.02, 0.0, -z + 0.01], [x - 0.02, 0.07, z - 0.04], 0.0);
    b.slab(body, [-x, 0.06, -z], [x, height, z - 0.02], 0.004);
    let (w, h) = ((width - 0.012) / columns as f32, (height - 0.08) / rows as f32);
    for i in 0..columns {
        for j in 0..rows {
            let (u, v) = (-x + 0.006 + w * i as f32, 0.07 + h * j as f32);
            b.slab(
                body,
                [u + 0.002, v + 0.002, z - 0.03],
                [u + w - 0.002, v + h - 0.002, z],
                0.003,
            );
            let (cu, cv) = (u + 0.5 * w, v + h - 0.25 * h.min(0.2));
            let (l, r) = (Vec3::new(cu - 0.06, cv, z + 0.025), Vec3::new(cu + 0.06, cv, z + 0.025));
            let into = Vec3::Z * 0.03;
            b.tube(
                metal,
                10,
                &[
                    (l - into, 0.005),
                    (l - into * 0.15, 0.005),
                    (l + Vec3::X * 0.004, 0.005),
                    (r - Vec3::X * 0.004, 0.005),
                    (r - into * 0.15, 0.005),
                    (r - into, 0.005),
                ],
            );
        }
    }
}

/// A column radiator `width` x `height` against the wall behind (-Z).
pub(super) fn radiator(b: &mut Builder, enamel: Mat, width: f32, height: f32) {
    let columns = (width / 0.055) as u32;
    for i in 0..columns {
        let x = (i as f32 + 0.5) * 0.055 - 0.5 * width;
        for z in [0.035, 0.095] {
            b.tube(
                enamel,
                12,
                &[(Vec3::new(x, 0.10, z), 0.0135), (Vec3::new(x, height - 0.01, z), 0.0135)],
            );
        }
        for y in [0.11, height - 0.02] {
            b.blob(enamel, Vec3::new(x, y, 0.065), Vec3::new(0.0275, 0.024, 0.055), [3.0, 2.5], 6);
        }
    }
    b.rod(
        enamel,
        Vec3::new(-0.5 * width, 0.11, 0.065),
        Vec3::new(-0.5 * width - 0.07, 0.11, 0.065),
        0.011,
    );
    b.rod(
        enamel,
        Vec3::new(-0.5 * width - 0.06, 0.11, 0.065),
        Vec3::new(-0.5 * width - 0.06, -0.01, 0.065),
        0.009,
    );
    for x in [-0.4 * width, 0.4 * width] {
        b.rod(enamel, Vec3::new(x, height - 0.1, 0.03), Vec3::new(x, height - 0.1, -0.05), 0.01);
    }
}

/// A rug with fringes, `width` x `depth`; `pattern` covers it once in texture coordinates of metres
/// over `width` x `depth`.
pub(super) fn rug(b: &mut Builder, pattern: Mat, fringe: Mat, [width, depth]: [f32; 2]) {
    b.sheet(pattern, [64, 48], Vec2::new(width, depth), |u, v| {
        let lift = 0.010 + 0.0025 * ((u * 23.0).sin() * (v * 17.0).cos());
        let edge = (u.min(1.0 - u) * width).min(v.min(1.0 - v) * depth);
        let round = (edge / 0.012).clamp(0.0, 1.0).sqrt();
        Vec3::new((u - 0.5) * width, lift * round, (0.5 - v) * depth)
    });
    let mut stream = Stream::new(77);
    let count = (depth / 0.016) as u32;
    for side in [-1.0, 1.0] {
        for i in 0..count {
            let z = ((i as f32 + 0.5) / count as f32 - 0.5) * depth * 0.99;
            let from = Vec3::new(side * (0.5 * width - 0.004), 0.005, z);
            let to = from
                + Vec3::new(
                    side * stream.between(0.04, 0.06),
                    -0.0035,
                    stream.between(-0.012, 0.012),
                );
            b.tube(
                fringe,
                5,
                &[(from, 0.003), (from.lerp(to, 0.5) + Vec3::Y * 0.001, 0.0026), (to, 0.0012)],
            );
        }
    }
}

/// A floor lamp: a curved arm over a heavy foot, and a linen drum shade (unlit).
pub(super) fn arc_lamp(
    b: &mut Builder,
    metal: Mat,
    shade: Mat,
    stone: Mat,
    height: f32,
    reach: f32,
) {
    b.drum(stone, [0.0, 0.05], [0.17, 0.17], 0.012);
    let mut path = vec![(Vec3::Y * 0.04, 0.011), (Vec3::Y * height * 0.55, 0.011)];
    for i in 1..=24 {
        let t = i as f32 / 24.0;
        let (s, c) = (t * 0.62 * PI).sin_cos();
        path.push((
            Vec3::new(reach * 0.5 * (1.0 - c) * 1.5, height * (0.55 + 0.45 * s), 0.0),
            0.011 - 0.003 * t,
        ));
    }
    let tip = path[path.len() - 1].0;
    path.push((tip - Vec3::Y * 0.08, 0.008));
    b.tube(metal, 14, &path);
    b.part(Affine3A::from_translation(tip - Vec3::Y * 0.09), |b| {
        b.drum(metal, [-0.05, 0.03], [0.022, 0.014], 0.003);
        drum_shade(b, shade, 0.21, 0.17, 0.25);
        b.ball(shade, Vec3::new(0.0, -0.09, 0.0), 0.05);
    });
}

/// A lamp shade open at top and bottom, its top at y = 0.
pub(super) fn drum_shade(b: &mut Builder, cloth: Mat, bottom: f32, top: f32, height: f32) {
    let wall = 0.003;
    b.lathe(
        cloth,
        64,
        &[
            (bottom - wall, -height),
            (bottom, -height),
            (top, 0.0),
            (top - wall, 0.0),
            (bottom - wall, -height),
        ],
    );
    for k in 0..3 {
        let (s, c) = (k as f32 * TAU / 3.0).sin_cos();
        b.rod(cloth, Vec3::Y * -0.02, Vec3::new(top * s * 0.99, -0.012, top * c * 0.99), 0.002);
    }
}

/// A pendant on a cable from the ceiling at y = 0, its shade `drop` below (unlit).
pub(super) fn pendant(b: &mut Builder, metal: Mat, inside: Mat, drop: f32, radius: f32) {
    b.drum(metal, [-0.03, 0.01], [0.05, 0.055], 0.004);
    b.rod(inside, Vec3::Y * -0.02, Vec3::Y * (0.10 - drop), 0.003);
    let mut outer = Vec::new();
    for i in 0..=16 {
        let (s, c) = (i as f32 / 16.0 * FRAC_PI_2).sin_cos();
        outer.push((radius * c.max(0.07), radius * 0.75 * s - drop));
    }
    b.lathe(metal, 64, &outer);
    b.drum(
        metal,
        [radius * 0.75 - drop - 0.01, radius * 0.75 - drop + 0.05],
        [radius * 0.1, 0.012],
        0.003,
    );
    let inner: Vec<(f32, f32)> =
        outer.iter().rev().map(|&(r, y)| (r - 0.002, y - 0.002 * (1.0 - r / radius))).collect();
    b.lathe(inside, 64, &inner);
    b.lathe(
        metal,
        64,
        &[(radius - 0.002, -drop - 0.0002), (radius - 0.001, -drop - LIFT), (radius, -drop)],
    );
    b.ball(inside, Vec3::Y * (0.25 * radius - drop), 0.05);
}
