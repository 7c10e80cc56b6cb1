//! Geometry: no ray leaves a closed room, for any triangles and any size.

use glam::Vec3;
use rayon::prelude::*;

use super::case::{Entry, On, Setting};
use super::outcome::Outcome;
use super::scenes::{
    Mean, SIGMAS, constant, deviation, difference, lambert, luminances, mean, render, room, sealed,
    sky, view,
};
use crate::bvh::{Bvh, Ray, offset_origin};
use crate::error::Result;
use crate::path::{World, WorldBuilder};
use crate::render::{Sampling, View};
use crate::sampler::SplitMix;
use crate::scene::Camera;

pub(super) const CASES: &[Entry] = &[
    ("degenerate-and-duplicate", On::Any, degenerate),
    ("slivers-1e6-to-1", On::Cpu, |s| Ok(slivers(s))),
    ("coplanar-overlaps", On::Any, coplanar),
    ("room-of-1e-4-m", On::Any, |s| scaled_room(s, 2.5e-5)),
    ("room-of-1e6-m", On::Any, |s| scaled_room(s, 2.5e5)),
    ("rays-along-shared-edges", On::Cpu, |s| Ok(leaks_on_axes(s))),
    ("rays-anywhere", On::Cpu, |s| Ok(leaks_anywhere(s))),
    ("paths-in-a-closed-room", On::Cpu, |s| Ok(bouncing_leaks(s))),
    ("1e-3-m-room-on-1e4-m-ground", On::Any, small_beside_large),
];

/// A closed box in `[-size,size]^3` whose faces are cut into rectangles, each of them from two coordinates to two.
fn closed_box(size: f32, mut rectangles: impl FnMut() -> Vec<[[f32; 2]; 2]>) -> Bvh {
    let mut corners = Vec::new();
    for (axis, side) in (0..3).flat_map(|axis| [(axis, -size), (axis, size)]) {
        for [[i0, j0], [i1, j1]] in rectangles() {
            let [a, b, c, d] = [[i0, j0], [i1, j0], [i1, j1], [i0, j1]].map(|[i, j]| {
                let mut point = Vec3::splat(side);
                point[(axis + 1) % 3] = i;
                point[(axis + 2) % 3] = j;
                point
            });
            corners.extend([a, b, c, a, c, d]);
        }
    }
    let triangles: Vec<[u32; 3]> =
        (0..corners.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Bvh::build(&corners, &triangles)
}

/// A closed box of `2 n^2` triangles a face in `[-size,size]^3`.
fn cube(n: u32, size: f32) -> Bvh {
    let at = |i: u32| (i as f32 / n as f32 * 2.0 - 1.0) * size;
    let row = |i: u32| (0..n).map(move |j| [[at(i), at(j)], [at(i + 1), at(j + 1)]]);
    closed_box(size, || (0..n).flat_map(row).collect())
}

/// Number of rays among `count` that hit nothing.
fn leaks(tree: &Bvh, count: u64, ray: impl Fn(&mut SplitMix) -> (Vec3, Vec3) + Sync) -> f64 {
    const RUN: u64 = 1 << 16;
    let missed: u64 = (0..count.div_ceil(RUN))
        .into_par_iter()
        .map(|run| {
            let mut random = SplitMix(run.wrapping_mul(0x9e37_79b9_7f4a_7c15));
            (0..RUN.min(count - run * RUN))
                .filter(|_| {
                    let (origin, direction) = ray(&mut random);
                    let ray = Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
                    !tree.any_hit(&ray, |_| true)
                })
                .count() as u64
        })
        .sum();
    missed as f64
}

/// Rays with one or two zero components, in planes of mesh vertices and along the edges between.
fn leaks_on_axes(setting: &Setting) -> Outcome {
    let count = setting.count(10_000_000, 1_000_000_000);
    let mut outcome = Outcome::default();
    for n in [8_u32, 33] {
        let missed = leaks(&cube(n, 1.0), count / 2, |random| {
            let grid = |random: &mut SplitMix| {
                (1 + random.below(n as usize - 1)) as f32 / n as f32 * 2.0 - 1.0
            };
            let axis = random.below(3);
            let mut origin = Vec3::splat(random.next_f32() * 1.5 - 0.75);
            let mut direction = Vec3::ZERO;
            direction[axis] = if random.below(2) == 0 { 1.0 } else { -1.0 };
            origin[(axis + 1) % 3] = grid(random);
            match random.below(4) {
                0 => origin[(axis + 2) % 3] = grid(random),
                1 => direction[(axis + 2) % 3] = random.next_f32() - 0.5,
                2 => direction[(axis + 2) % 3] = 1e-30,
                _ => direction[(axis + 2) % 3] = -0.0,
            }
            (origin, direction)
        });
        outcome =
            outcome.at_most(format!("leaks of {} axis-parallel rays", count / 2), missed, 0.0);
    }
    outcome
}

fn leaks_anywhere(setting: &Setting) -> Outcome {
    let count = setting.count(1_000_000, 300_000_000);
    let mut outcome = Outcome::default();
    for size in [1e-4, 1.0, 1e6] {
        let missed = leaks(&cube(17, size), count, |random| {
            (random.next_in_cube() * 0.99 * size, random.next_direction())
        });
        outcome =
            outcome.at_most(format!("leaks of {count} rays in a box of {size} m"), missed, 0.0);
    }
    outcome
}

/// Paths whose rays start at the last hit, as the renderer's do, never leave.
fn bouncing_leaks(setting: &Setting) -> Outcome {
    let mut outcome = Outcome::default();
    for size in [1e-4_f32, 1.0, 1e4] {
        let tree = cube(5, size);
        let missed = |seed| bounce(&tree, seed, setting.count(20_000, 2_000_000));
        let missed: u32 = (0..64_u64).into_par_iter().map(missed).sum();
        let what = format!("paths that leave a box of {size} m");
        outcome = outcome.at_most(what, f64::from(missed), 0.0);
    }
    outcome
}

/// Number of times that a path of `bounces` diffuse reflections leaves the box around the origin.
fn bounce(tree: &Bvh, seed: u64, bounces: u32) -> u32 {
    let mut random = SplitMix(seed);
    let (mut origin, mut direction, mut missed) = (Vec3::ZERO, random.next_direction(), 0);
    for _ in 0..bounces {
        let ray = Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
        let Some(hit) = tree.closest_hit(&ray, |_| true) else {
            missed += 1;
            origin = Vec3::ZERO;
            continue;
        };
        // The box is centred and its walls face the axes.
        let point = origin + direction * hit.t;
        let axis = point.abs().max_position();
        let mut inward = Vec3::ZERO;
        inward[axis] = -point[axis].signum();
        origin = point;
        origin[axis] = -inward[axis] * tree.bounds().1[axis];
        origin = offset_origin(origin, inward);
        direction = random.next_direction();
        direction *= direction.dot(inward).signum();
    }
    missed
}

/// A closed box whose walls are cut into strips a millionth as wide as long.
fn slivers(setting: &Setting) -> Outcome {
    let mut random = SplitMix(8);
    // Cuts at random places, in pairs two millionths apart.
    let tree = closed_box(1.0, || {
        let mut cuts = vec![-1.0, 1.0];
        for _ in 0..100 {
            let at = random.next_f32() * 1.9 - 0.95;
            cuts.extend([at, at + 2e-6]);
        }
        cuts.sort_by(f32::total_cmp);
        cuts.windows(2).map(|pair| [[pair[0], -1.0], [pair[1], 1.0]]).collect()
    });
    let count = setting.count(2_000_000, 200_000_000);
    let missed =
        leaks(&tree, count, |random| (random.next_in_cube() * 0.9, random.next_direction()));
    Outcome::default().at_most(format!("leaks of {count} rays between slivers"), missed, 0.0)
}

/// Triangles without area, duplicates, and triangles with NaN or infinite corners change nothing.
fn degenerate(setting: &Setting) -> Result<Outcome> {
    let wall = lambert(0.7);
    let (builder, camera) = room(0.7, 1.0, Vec3::ZERO);
    let twice: Vec<[Vec3; 3]> = (0..4).map(|triangle| builder.scene.corners(triangle)).collect();
    let p = Vec3::new(0.1, 0.2, 0.3);
    let odd = [
        [p, p, p],
        [p, p, p + Vec3::X],
        [p, p + Vec3::X, p + 2.0 * Vec3::X],
        [p, p + Vec3::X, Vec3::splat(f32::NAN)],
        [p, p + Vec3::Y, Vec3::new(f32::INFINITY, 0.0, 0.0)],
    ];
    let (sound, again) = (builder.build(), room(0.7, 1.0, Vec3::ZERO).0);
    let spoilt = again.triangles(&wall, &odd).triangles(&wall, &twice).build();
    let environment = sky("day")?;
    let view = view(camera, Sampling::Plain, 4);
    let [a, b] = [&sound, &spoilt].map(|w| render(setting, (w, &environment), view.clone(), 32));
    let (a, b) = (a?, b?);
    let worst = luminances(&a).zip(luminances(&b)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let what = "pixels' largest change by useless triangles";
    Ok(Outcome::default().sound(&b).at_most(what, worst, 0.0))
}

/// Two coplanar walls: either may be visible, and nothing else.
fn coplanar(setting: &Setting) -> Result<Outcome> {
    let mut outcome = Outcome::default();
    for tilt in [0.0, 0.3] {
        let (a, b) = (Vec3::new(4.0, tilt, 0.0), Vec3::new(0.0, 0.2, -4.0));
        let corner = Vec3::new(-2.0, 0.0, 2.0);
        let world = WorldBuilder::default()
            .quad(&lambert(0.25), corner, a, b)
            .quad(&lambert(0.75), corner + 0.25 * a, a, b)
            .quad(&lambert(0.5), corner, b, a)
            .build();
        let camera = Camera::look_at(Vec3::new(0.2, 3.0, 0.1), Vec3::ZERO, 0.5);
        let film =
            render(setting, (&world, &constant(1.0)?), view(camera, Sampling::Plain, 4), 64)?;
        // A plane in uniform light shows its albedo.
        let most = luminances(&film).fold(0.0, f64::max);
        let least = luminances(&film).fold(f64::INFINITY, f64::min);
        outcome = outcome
            .sound(&film)
            .at_most("brightest pixel of albedos up to 0.75", most, 0.75 + 1e-3)
            .at_least("darkest pixel of albedos from 0.25", least, 0.25 - 1e-3);
    }
    Ok(outcome)
}

/// A scaled room has the same picture as the one of 4 m, and stays dark when it is sealed.
fn scaled_room(setting: &Setting, scale: f32) -> Result<Outcome> {
    let environment = sky("day")?;
    let of = |scale: f32| -> Result<Mean> {
        let (builder, camera) = room(0.7, scale, Vec3::ZERO);
        let view = View { learning_paths: 1 << 14, ..view(camera, Sampling::Adaptive, 4) };
        Ok(mean(&render(setting, (&builder.build(), &environment), view, 256)?))
    };
    let off = difference(of(1.0)?, of(scale)?);
    let (builder, camera) = sealed(scale);
    let film =
        render(setting, (&builder.build(), &environment), view(camera, Sampling::Plain, 8), 64)?;
    Ok(Outcome::default()
        .sound(&film)
        .at_most("against the room of 4 m: standard errors off", off, SIGMAS)
        .at_most("light in the sealed room", mean(&film).luminance, 0.0))
}

/// A room of a millimetre stands on a ground of ten kilometres, open and sealed.
fn small_beside_large(setting: &Setting) -> Result<Outcome> {
    let environment = constant(1.0)?;
    let scale = 2.5e-4;
    let (builder, camera) = sealed(scale);
    let world = builder.floor(&lambert(0.2), Vec3::new(0.0, -scale, 0.0), 1e4).build();
    let dark = render(setting, (&world, &environment), view(camera, Sampling::Plain, 8), 64)?;
    // The same scene at the room's usual size.
    let lit = |factor: f32| -> Result<Mean> {
        let (builder, camera) = room(0.8, factor, Vec3::ZERO);
        let floor = Vec3::new(0.0, -factor, 0.0);
        let world: World = builder.floor(&lambert(0.2), floor, 4e7 * factor).build();
        Ok(mean(&render(setting, (&world, &environment), view(camera, Sampling::Plain, 4), 256)?))
    };
    // Near zero the origins of rays are moved by 1.5e-5 m: a hundredth of this room, so its light may be
    // off by as much (1e-2 below). The sealed one must be dark all the same.
    let (large, small) = (lit(1.0)?, lit(scale)?);
    Ok(Outcome::default()
        .sound(&dark)
        .at_most("light in the sealed millimetre room", mean(&dark).luminance, 0.0)
        .at_most("open one: standard errors off", deviation(small, large.luminance, 1e-2), SIGMAS))
}
