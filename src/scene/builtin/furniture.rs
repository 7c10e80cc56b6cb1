//! Pieces that stand on a floor: their origin is on the floor below their middle, front along +Z.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use super::mesh::{Builder, Mat};
use super::objects::books;
use crate::noise::Stream;

/// A table of `width` x `depth` x `height` on four tapered, slightly splayed legs.
pub(super) fn table(b: &mut Builder, top: Mat, legs: Mat, [width, depth, height]: [f32; 3]) {
    let (x, z) = (0.5 * width, 0.5 * depth);
    b.slab(top, [-x, height - 0.032, -z], [x, height, z], 0.006);
    for (back, front) in [(-z + 0.08, -z + 0.10), (z - 0.10, z - 0.08)] {
        b.slab(legs, [-x + 0.09, height - 0.10, back], [x - 0.09, height - 0.028, front], 0.003);
    }
    for (sx, sz) in [(-1., -1.), (1., -1.), (1., 1.), (-1., 1.)] {
        let head = Vec3::new(sx * (x - 0.09), height - 0.02, sz * (z - 0.09));
        let foot = Vec3::new(sx * (x - 0.05), 0.0, sz * (z - 0.05));
        b.tube(legs, 20, [(foot, 0.013), (head.lerp(foot, 0.3), 0.024), (head, 0.026)]);
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
    b.lathe(top, 96, profile);
    for k in 0..3 {
        let (s, c) = (k as f32 * TAU / 3.0 + 0.4).sin_cos();
        let out = Vec3::new(c, 0.0, s);
        let head = out * (radius * 0.55) + Vec3::Y * (height - 0.01);
        let path = [
            (out * radius * 0.85, 0.012),
            (out * radius * 0.62 + Vec3::Y * height * 0.75, 0.021),
            (head, 0.022),
        ];
        b.tube(legs, 20, path);
    }
}

/// An open shelf `width` x `height` x `depth` with `rows` boards and a back, filled with books and
/// room for ornaments: calls `ornament(builder, row, free width)` at the middle of each free stretch.
pub(super) fn bookcase(
    b: &mut Builder,
    wood: Mat,
    book: [Mat; 2],
    [width, height, depth]: [f32; 3],
    rows: u32,
    mut ornament: impl FnMut(&mut Builder, u32, f32),
) {
    let (x, z, t) = (0.5 * width, 0.5 * depth, 0.022);
    for side in [-1.0, 1.0] {
        b.slab(wood, [side * (x - t), 0.0, -z], [side * x, height, z], 0.002);
    }
    b.slab(wood, [-x + 0.01, 0.05, -z + 0.003], [x - 0.01, height - 0.01, -z + 0.012], 0.0);
    let top = height - 0.001;
    b.slab(wood, [-x + 0.006, height - t - 0.001, -z + 0.001], [x - 0.006, top, z + 0.006], 0.002);
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
        b.standing([start, y + t, 0.0], 0.0, |b| {
            books(b, book, filled, step - t - 0.02, depth - 0.03, row * 17 + 5);
        });
        let free = inside - filled;
        let middle = if left { 0.5 * (inside - free) } else { 0.5 * (free - inside) };
        b.standing([middle, y + t, 0.0], 0.0, |b| ornament(b, row, free));
    }
}

/// A cabinet with `columns` x `rows` drawer fronts and small handles, on a recessed plinth.
pub(super) fn drawers(b: &mut Builder, body: Mat, metal: Mat, size: [f32; 3], grid: [u32; 2]) {
    let ([width, height, depth], [columns, rows]) = (size, grid);
    let (x, z) = (0.5 * width, 0.5 * depth);
    b.slab(body, [-x + 0.02, 0.0, -z + 0.01], [x - 0.02, 0.07, z - 0.04], 0.0);
    b.slab(body, [-x, 0.06, -z], [x, height, z - 0.02], 0.004);
    let (w, h) = ((width - 0.012) / columns as f32, (height - 0.08) / rows as f32);
    for i in 0..columns {
        for j in 0..rows {
            let (u, v) = (-x + 0.006 + w * i as f32, 0.07 + h * j as f32);
            let (low, high) = ([u + 0.002, v + 0.002, z - 0.03], [u + w - 0.002, v + h - 0.002, z]);
            b.slab(body, low, high, 0.003);
            let (cu, cv) = (u + 0.5 * w, v + h - 0.25 * h.min(0.2));
            let (l, r) = (Vec3::new(cu - 0.06, cv, z + 0.025), Vec3::new(cu + 0.06, cv, z + 0.025));
            let into = Vec3::Z * 0.03;
            let bend = Vec3::X * 0.009;
            let path = [l - into, l - into * 0.3, l + bend, r - bend, r - into * 0.3, r - into];
            b.tube(metal, 10, path.map(|p| (p, 0.004)));
        }
    }
}

/// A column radiator `width` x `height` against the wall behind (-Z).
pub(super) fn radiator(b: &mut Builder, enamel: Mat, width: f32, height: f32) {
    let columns = (width / 0.055) as u32;
    for i in 0..columns {
        let x = (i as f32 + 0.5) * 0.055 - 0.5 * width;
        for z in [0.035, 0.095] {
            let path = [(Vec3::new(x, 0.10, z), 0.0135), (Vec3::new(x, height - 0.01, z), 0.0135)];
            b.tube(enamel, 12, path);
        }
        for y in [0.11, height - 0.02] {
            b.blob(enamel, Vec3::new(x, y, 0.065), Vec3::new(0.0275, 0.024, 0.055), [3.0, 2.5], 6);
        }
    }
    let end = -0.5 * width;
    let pipe = |x: f32, y: f32| Vec3::new(x, y, 0.065);
    b.rod(enamel, pipe(end, 0.11), pipe(end - 0.07, 0.11), 0.011);
    b.rod(enamel, pipe(end - 0.06, 0.11), pipe(end - 0.06, -0.01), 0.009);
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
            let length = side * stream.between(0.04, 0.06);
            let to = from + Vec3::new(length, -0.0035, stream.between(-0.012, 0.012));
            let path =
                [(from, 0.003), (from.lerp(to, 0.5) + Vec3::Y * 0.001, 0.0026), (to, 0.0012)];
            b.tube(fringe, 5, path);
        }
    }
}
