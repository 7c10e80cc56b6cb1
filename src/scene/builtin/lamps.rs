//! Lamps, lit if the materials of their bulbs and shades emit; their origin is below their middle, or at the
//! ceiling.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use glam::Vec3;

use super::mesh::{Builder, Mat, placed};

/// A floor lamp: a curved arm over a heavy foot, and a linen drum shade.
pub(super) fn arc_lamp(b: &mut Builder, metal: Mat, [shade, bulb]: [Mat; 2], stone: Mat) {
    let (height, reach) = (2.05, 0.85);
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
    b.tube(metal, 14, path);
    b.moved(tip - Vec3::Y * 0.09, |b| {
        b.drum(metal, [-0.05, 0.03], [0.022, 0.014], 0.003);
        drum_shade(b, shade, 0.21, 0.17, 0.25);
        b.ball(bulb, Vec3::new(0.0, -0.09, 0.0), 0.05);
    });
}

/// A lamp shade open at top and bottom, its top at y = 0.
pub(super) fn drum_shade(b: &mut Builder, cloth: Mat, bottom: f32, top: f32, height: f32) {
    let wall = 0.003;
    let profile = [
        (bottom - wall, -height),
        (bottom, -height),
        (top, 0.0),
        (top - wall, 0.0),
        (bottom - wall, -height),
    ];
    b.lathe(cloth, 64, profile);
    for k in 0..3 {
        let (s, c) = (k as f32 * TAU / 3.0).sin_cos();
        b.rod(cloth, Vec3::Y * -0.02, Vec3::new(top * s * 0.99, -0.012, top * c * 0.99), 0.002);
    }
}

/// A pendant on a cable from the ceiling at y = 0, its shade `drop` below.
pub(super) fn pendant(b: &mut Builder, mats: [Mat; 3], drop: f32, radius: f32) {
    let [metal, inside, bulb] = mats;
    b.drum(metal, [-0.03, 0.01], [0.05, 0.055], 0.004);
    b.rod(inside, Vec3::Y * -0.02, Vec3::Y * (0.10 - drop), 0.003);
    let outer = (0..=16).map(|i| {
        let (s, c) = (i as f32 / 16.0 * FRAC_PI_2).sin_cos();
        (radius * c.max(0.07), radius * 0.75 * s - drop)
    });
    b.lathe(metal, 64, outer.clone());
    let top = radius * 0.75 - drop;
    b.drum(metal, [top - 0.01, top + 0.05], [radius * 0.1, 0.012], 0.003);
    let inner = outer.rev().map(|(r, y)| (r - 0.002, y - 0.002 * (1.0 - r / radius)));
    b.lathe(inside, 64, inner);
    b.lathe(metal, 64, [(radius - 0.002, -drop), (radius, -drop)]);
    b.ball(bulb, Vec3::Y * (0.25 * radius - drop), 0.05);
}

/// A lamp in a wall's frame: a bulb on an arm in a shell of `radius`, whose wall is solid glass.
pub(super) fn globe_lamp(b: &mut Builder, metal: Mat, [glass, bulb]: [Mat; 2], radius: f32) {
    let (neck, arm) = (0.12 * PI, Vec3::Z * (radius + 0.05));
    b.rod(metal, Vec3::Z * -0.005, Vec3::Z * 0.018, 0.05);
    b.rod(metal, Vec3::Z * 0.01, arm, 0.008);
    b.moved(arm, |b| {
        let middle = 0.025 + radius * neck.cos();
        b.drum(metal, [-0.02, 0.032], [0.02, 0.046], 0.003);
        b.rod(metal, Vec3::ZERO, Vec3::Y * (middle - 0.25 * radius), 0.008);
        b.ball(bulb, Vec3::Y * middle, 0.32 * radius);
        let at = |r: f32, k: i32| {
            let (s, c) = (neck + (PI - neck) * k as f32 / 32.0).sin_cos();
            (r * s.max(0.0), middle - r * c)
        };
        let outside = (0..=32).map(|k| at(radius, k));
        let inside = (0..=32).rev().map(|k| at(radius - 0.004, k));
        b.lathe(glass, 64, outside.chain(inside).chain([at(radius, 0)]));
    });
}

/// A jointed desk lamp that bows towards +Z.
pub(super) fn desk_lamp(b: &mut Builder, metal: Mat, inside: Mat) {
    b.drum(metal, [0.0, 0.022], [0.085, 0.080], 0.006);
    let joints = [Vec3::new(0., 0.02, 0.), Vec3::new(0., 0.30, -0.13), Vec3::new(0., 0.50, 0.12)];
    for pair in joints.windows(2) {
        for side in [-0.011, 0.011] {
            b.rod(metal, pair[0] + Vec3::X * side, pair[1] + Vec3::X * side, 0.0045);
        }
    }
    for joint in &joints[1..] {
        b.rod(metal, *joint - Vec3::X * 0.02, *joint + Vec3::X * 0.02, 0.012);
    }
    b.part(placed([0.0, 0.50, 0.125], [-28.0, 0.0, 0.0]), |b| {
        let outer =
            [(0.018, 0.045), (0.026, 0.02), (0.035, -0.005), (0.062, -0.05), (0.078, -0.10)];
        b.lathe(metal, 40, outer.into_iter().rev().chain([(0.0, 0.05)]));
        let lining = outer.into_iter().skip(1).map(|(r, y)| (r - 0.002, y));
        b.lathe(inside, 40, [(0.0, 0.018)].into_iter().chain(lining));
        b.lathe(metal, 40, [(0.076, -0.10), (0.078, -0.10)]);
        b.ball(inside, Vec3::new(0.0, -0.035, 0.0), 0.025);
    });
}

/// A street lamp with a lantern.
pub(super) fn street_lamp(b: &mut Builder, metal: Mat, pane: Mat, height: f32) {
    let h = height;
    let profile = [
        (0.17, -0.01),
        (0.17, 0.10),
        (0.13, 0.14),
        (0.10, 0.55),
        (0.12, 0.58),
        (0.12, 0.64),
        (0.065, 0.70),
        (0.05, 0.75 * h),
        (0.075, 0.76 * h),
        (0.075, 0.775 * h),
        (0.042, 0.79 * h),
        (0.038, h - 0.62),
        (0.09, h - 0.58),
        (0.11, h - 0.55),
    ];
    b.lathe(metal, 24, profile);
    b.moved(Vec3::Y * (h - 0.56), |b| {
        b.lathe(pane, 6, [(0.10, 0.0), (0.19, 0.40)]);
        for k in 0..6 {
            let (s, c) = (k as f32 * PI / 3.0).sin_cos();
            let at = |radius: f32, y: f32| Vec3::new(radius * c, y, radius * s);
            b.rod(metal, at(0.10, 0.0), at(0.192, 0.40), 0.009);
        }
        let profile = [
            (0.0, 0.395),
            (0.215, 0.395),
            (0.22, 0.41),
            (0.13, 0.50),
            (0.05, 0.55),
            (0.05, 0.58),
            (0.022, 0.60),
            (0.0, 0.66),
        ];
        b.lathe(metal, 24, profile);
    });
}
