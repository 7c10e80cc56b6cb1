//! Objects on a desk: origins are below the middle, fronts along +Z.

use glam::Vec3;

use super::mesh::{Builder, Mat, placed};
use super::objects::COVERS;
use crate::noise::Stream;

/// A flat monitor on a foot, screen towards +Z.
pub(super) fn monitor(b: &mut Builder, body: Mat, screen: Mat, [width, height]: [f32; 2]) {
    b.slab(body, [-0.12, 0.0, -0.10], [0.12, 0.012, 0.09], 0.005);
    b.slab(body, [-0.03, 0.006, -0.075], [0.03, 0.36, -0.058], 0.006);
    b.part(placed([0.0, 0.13, -0.035], [-4.0, 0.0, 0.0]), |b| {
        let x = 0.5 * width;
        b.slab(body, [-x, 0.0, -0.018], [x, height, 0.006], 0.006);
        b.slab(body, [-0.14, 0.08, -0.045], [0.14, height - 0.08, -0.012], 0.015);
        b.slab(screen, [-x + 0.008, 0.018, 0.0], [x - 0.008, height - 0.008, 0.0072], 0.0006);
    });
}

/// A keyboard of five rows.
pub(super) fn keyboard(b: &mut Builder, body: Mat, keys: Mat) {
    b.part(placed([0.0, 0.004, 0.0], [2.5, 0.0, 0.0]), |b| {
        b.slab(body, [-0.215, 0.0, -0.062], [0.215, 0.011, 0.062], 0.004);
        for row in 0..5 {
            let z = -0.055 + 0.022 * row as f32;
            let mut x = -0.208;
            let mut column = 0;
            while x < 0.19 {
                let w: f32 = match (row, column) {
                    (4, 4) => 0.128,
                    (1..=3, 0) => 0.026 + 0.004 * row as f32,
                    _ => 0.0195,
                };
                let right = if x + w > 0.185 { 0.208 } else { x + w };
                b.slab(keys, [x, 0.009, z], [right, 0.0155, z + 0.0195], 0.0018);
                x = right + 0.0022;
                column += 1;
            }
        }
    });
}

/// A computer mouse.
pub(super) fn mouse(b: &mut Builder, body: Mat) {
    b.blob(body, Vec3::new(0.0, 0.014, 0.0), Vec3::new(0.031, 0.0135, 0.054), [2.6, 2.4], 10);
}

/// Loose sheets of A4 paper.
pub(super) fn papers(b: &mut Builder, paper: Mat, count: u32, seed: u32) {
    let mut stream = Stream::new(seed);
    for i in 0..count {
        let at = [stream.between(-0.02, 0.02), 0.0011 * i as f32, stream.between(-0.02, 0.02)];
        b.part(placed(at, [0.0, stream.between(-12.0, 12.0), 0.0]), |b| {
            b.slab(paper, [-0.105, 0.0, -0.1485], [0.105, 0.0005, 0.1485], 0.0);
        });
    }
}

/// A cup of pencils.
pub(super) fn pencils(b: &mut Builder, cup: Mat, wood: Mat) {
    let profile = [
        (0.0, 0.0),
        (0.036, 0.0),
        (0.038, 0.002),
        (0.038, 0.098),
        (0.036, 0.1),
        (0.034, 0.098),
        (0.034, 0.006),
        (0.0, 0.005),
    ];
    b.lathe(cup, 32, profile);
    let mut stream = Stream::new(3);
    for k in 0..7 {
        let (s, c) = (k as f32 * 0.9).sin_cos();
        let foot = Vec3::new(-0.018 * c, 0.008, -0.018 * s);
        let tip = Vec3::new(0.034 * c, stream.between(0.15, 0.19), 0.034 * s);
        b.tinted(COVERS[stream.index(COVERS.len())], |b| {
            b.tube(wood, 6, [(foot, 0.0036), (tip.lerp(foot, 0.1), 0.0036), (tip, 0.0006)]);
        });
    }
}
