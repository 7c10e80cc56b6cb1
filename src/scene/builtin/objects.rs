//! Small things that stand on furniture or hang on walls: their origin is below their middle.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use glam::{Affine3A, Vec2, Vec3};

use super::mesh::{Builder, LIFT, Mat, placed};
use super::tableware::spline;
use crate::noise::Stream;

/// Cloth and paper covers, linear albedo.
pub(super) const COVERS: [[f32; 3]; 12] = [
    [0.42, 0.08, 0.06],
    [0.09, 0.16, 0.28],
    [0.62, 0.50, 0.30],
    [0.10, 0.22, 0.17],
    [0.70, 0.66, 0.58],
    [0.35, 0.20, 0.12],
    [0.55, 0.28, 0.10],
    [0.06, 0.07, 0.08],
    [0.30, 0.36, 0.40],
    [0.72, 0.60, 0.18],
    [0.24, 0.12, 0.20],
    [0.50, 0.52, 0.47],
];

/// One book standing on its lower edge, spine along +Z: (thickness, height, depth).
fn book(b: &mut Builder, [cover, paper]: [Mat; 2], [t, h, d]: [f32; 3], stream: &mut Stream) {
    let tone = COVERS[stream.index(COVERS.len())];
    let shade = stream.between(0.75, 1.15);
    let (x, z) = (0.5 * t, 0.5 * d);
    b.tinted(tone.map(|c| c * shade), |b| {
        b.slab(cover, [-x, 0.0, -z], [-x + 0.0025, h, z - 0.001], 0.0);
        b.slab(cover, [x - 0.0025, 0.0, -z], [x, h, z - 0.001], 0.0);
        b.slab(cover, [-x + 0.0002, 0.0003, z - 0.004], [x - 0.0002, h - 0.0003, z], 0.002);
    });
    b.slab(paper, [-x + 0.002, 0.003, -z + 0.004], [x - 0.002, h - 0.004, z - 0.002], 0.0);
}

/// A row of books from x = 0 to `width`, no higher than `room`, spines at z = `depth` / 2.
pub(super) fn books(b: &mut Builder, mats: [Mat; 2], width: f32, room: f32, depth: f32, seed: u32) {
    let mut stream = Stream::new(seed);
    let mut x = 0.003;
    let mut leaning = 0.0;
    loop {
        let t = stream.between(0.014, 0.042);
        if x + t > width {
            break;
        }
        let h = room.min(stream.between(0.68, 0.98) * room.min(0.30));
        let d = depth.min(0.22) * stream.between(0.74, 0.98);
        if stream.between(0.0, 1.0) < 0.04 {
            leaning = stream.between(4.0, 9.0);
            x += h * f32::sin(leaning.to_radians());
        }
        let back = stream.between(0.0, 0.02);
        let z = 0.5 * (depth - d) - back;
        b.part(placed([x + 0.5 * t, 0.0003, z], [0.0, 0.0, leaning]), |b| {
            let rise = 0.5 * t * leaning.to_radians().sin();
            b.moved(Vec3::Y * rise, |b| book(b, mats, [t, h, d], &mut stream));
        });
        x += (t + 0.0012) / leaning.to_radians().cos();
        if stream.between(0.0, 1.0) < 0.3 {
            leaning = 0.0;
        }
    }
}

/// Books lying on each other.
pub(super) fn book_stack(b: &mut Builder, mats: [Mat; 2], count: u32, seed: u32) {
    let mut stream = Stream::new(seed);
    let mut y = 0.0;
    for i in 0..count {
        let t = stream.between(0.02, 0.038);
        let size = 0.9 - 0.11 * i as f32;
        let lying = placed([0.0, y + 0.5 * t, 0.0], [90.0, 0.0, 0.0]);
        let turn = Affine3A::from_rotation_y(stream.between(-0.3, 0.3));
        b.part(turn * lying * placed([0.0, 0.0, 0.0], [0.0, 90.0, 0.0]), |b| {
            b.moved(Vec3::Y * (-0.13 * size), |b| {
                book(b, mats, [t, 0.27 * size, 0.20 * size], &mut stream);
            });
        });
        y += t + LIFT;
    }
}

/// A mug with a handle and a dark drink.
pub(super) fn mug(b: &mut Builder, glaze: Mat, drink: Mat) {
    let profile = [
        (0.0, 0.0),
        (0.032, 0.0),
        (0.039, 0.006),
        (0.041, 0.02),
        (0.041, 0.091),
        (0.0402, 0.0945),
        (0.0385, 0.0945),
        (0.0375, 0.091),
        (0.0375, 0.012),
        (0.030, 0.006),
        (0.0, 0.006),
    ];
    b.lathe(glaze, 40, profile);
    b.lathe(drink, 40, [(0.0378, 0.078), (0.0, 0.078)]);
    let path = (0..=12).map(|i| {
        let (s, c) = (i as f32 / 12.0 * PI - FRAC_PI_2).sin_cos();
        (Vec3::new(0.038 + 0.028 * c, 0.048 + 0.026 * s, 0.0), 0.0048)
    });
    b.tube(glaze, 10, path);
}

/// A vase thrown from a profile of radii (fractions of `height`) at even heights, with a thin wall.
pub(super) fn vase(b: &mut Builder, mat: Mat, height: f32, radii: &[f32]) {
    const STEPS: u32 = 24;
    let last = radii.len() as f32 - 1.0;
    let radius = |t: f32| {
        let x = (t * last).clamp(0.0, last - 1e-4);
        let at = |k: isize| radii[(x as isize + k).clamp(0, last as isize) as usize];
        spline([-1, 0, 1, 2].map(|k| Vec2::new(at(k), 0.0)), x.fract()).x
    };
    let wall = 0.014;
    let mut profile = vec![(0.0, 0.0), (radii[0] * height - 0.002, 0.0)];
    let share = |k: u32| k as f32 / STEPS as f32;
    profile.extend((0..=STEPS).map(share).map(|t| (radius(t) * height, 0.003 + t * height)));
    profile.push((radius(1.0) * height - 0.3 * wall * height, 0.003 + height * 1.004));
    let inside = (3..=STEPS).rev().map(share);
    profile.extend(inside.map(|t| ((radius(t) - wall) * height, t * height)));
    profile.push((0.0, 0.06 * height));
    b.lathe(mat, 48, profile);
}

/// A shallow bowl.
pub(super) fn bowl(b: &mut Builder, mat: Mat, radius: f32, height: f32) {
    let mut profile = vec![(0.0, 0.0), (0.35 * radius, 0.0), (0.36 * radius, 0.006)];
    let curve = |t: f32, inset: f32| {
        let (s, c) = (t * FRAC_PI_2 * 0.92).sin_cos();
        ((0.36 + 0.64 * s) * radius - inset, 0.006 + (height - 0.006) * (1.0 - c) / 0.8747)
    };
    profile.extend((1..=20).map(|i| curve(i as f32 / 20.0, 0.0)));
    profile.push((radius * 0.993 - 0.003, height + 0.0015));
    profile
        .extend((1..=20).rev().map(|i| curve(i as f32 / 20.0, 0.005)).map(|(r, y)| (r, y + 0.001)));
    profile.push((0.0, 0.011));
    b.lathe(mat, 56, profile);
}

/// A heap of round fruit in a bowl of `radius`.
pub(super) fn fruit(b: &mut Builder, skin: Mat, stalk: Mat, radius: f32, floor: f32) {
    let mut place = |x: f32, y: f32, z: f32, tone: [f32; 3], r: f32| {
        b.part(placed([x * radius, floor + y, z * radius], [25.0 * x, 80.0 * z, 30.0 * z]), |b| {
            b.tinted(tone, |b| {
                b.blob(skin, Vec3::ZERO, Vec3::new(r, 0.93 * r, r), [2.0, 2.15], 10);
            });
            b.rod(stalk, Vec3::Y * 0.85 * r, Vec3::new(0.004, 1.16 * r, 0.002), 0.0018);
        });
    };
    let (orange, apple, green) = ([0.85, 0.32, 0.03], [0.55, 0.06, 0.04], [0.42, 0.52, 0.08]);
    place(-0.34, 0.045, -0.12, orange, 0.040);
    place(0.30, 0.045, -0.22, apple, 0.038);
    place(0.05, 0.044, 0.36, green, 0.039);
    place(0.0, 0.088, -0.02, orange, 0.039);
}

/// A framed picture with its lower left corner at the origin of a wall's frame; `art` covers
/// texture coordinates `[0, width] x [0, height]` with v downwards.
pub(super) fn picture(b: &mut Builder, mats: [Mat; 3], [width, height]: [f32; 2], border: f32) {
    let [frame, mount, art] = mats;
    let (w, z) = (0.022, 0.028);
    b.slab(frame, [0.0, 0.0, 0.002], [w, height, z], 0.003);
    b.slab(frame, [width - w, 0.0, 0.002], [width, height, z], 0.003);
    b.slab(frame, [0.001, 0.0004, 0.0025], [width - 0.001, w, z - 0.0006], 0.003);
    b.slab(frame, [0.001, height - w, 0.0025], [width - 0.001, height - 0.0004, z - 0.0006], 0.003);
    b.slab(mount, [0.01, 0.01, 0.003], [width - 0.01, height - 0.01, 0.012], 0.0);
    let (x0, x1, y0, y1) = (w + border, width - w - border, w + border, height - w - border);
    let corner = |x: f32, y: f32| {
        let uv = Vec2::new((x - x0) / (x1 - x0), (y1 - y) / (y1 - y0));
        (Vec3::new(x, y, 0.0132), Vec3::ZERO, uv)
    };
    b.polygon(art, &[corner(x0, y0), corner(x1, y0), corner(x1, y1), corner(x0, y1)], Vec3::Z);
}

/// A wall clock, its centre at the origin of a wall's frame.
pub(super) fn clock(b: &mut Builder, rim: Mat, face: Mat, hands: Mat, radius: f32) {
    b.part(Affine3A::from_rotation_x(FRAC_PI_2), |b| {
        let profile = [
            (radius, -0.002),
            (radius, 0.024),
            (radius - 0.004, 0.034),
            (radius - 0.012, 0.04),
            (radius - 0.02, 0.034),
            (radius - 0.02, 0.02),
        ];
        b.lathe(rim, 64, profile);
        b.lathe(face, 64, [(radius - 0.018, 0.024), (0.0, 0.024)]);
    });
    for hour in 0..12 {
        b.part(Affine3A::from_rotation_z(hour as f32 * TAU / 12.0), |b| {
            b.slab(hands, [-0.003, radius * 0.72, 0.023], [0.003, radius * 0.82, 0.0255], 0.0);
        });
    }
    for (turn, length, width, z) in [(1.12, 0.48, 0.0075, 0.0275), (-2.3, 0.72, 0.005, 0.031)] {
        b.part(Affine3A::from_rotation_z(turn), |b| {
            b.slab(hands, [-width, -0.03, z], [width, length * radius, z + 0.002], 0.0005);
        });
    }
}

/// A waste-paper basket.
pub(super) fn basket(b: &mut Builder, mat: Mat) {
    let profile = [
        (0.0, 0.0),
        (0.11, 0.0),
        (0.115, 0.004),
        (0.145, 0.30),
        (0.149, 0.305),
        (0.147, 0.31),
        (0.142, 0.305),
        (0.112, 0.01),
        (0.0, 0.009),
    ];
    b.lathe(mat, 40, profile);
}
