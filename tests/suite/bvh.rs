//! Tests of bvh.

use std::collections::HashMap;

use glam::{DVec3, Vec2, Vec3};
use lightgrid::bvh::{Bvh, Hit, Ray, offset_origin};
use lightgrid::sampler::SplitMix;

type Mesh = (Vec<Vec3>, Vec<[u32; 3]>);

fn ray(origin: Vec3, direction: Vec3) -> Ray {
    Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY }
}

fn everything(_: &Hit) -> bool {
    true
}

fn soup(random: &mut SplitMix, count: usize, size: f32) -> Mesh {
    let mut positions = Vec::new();
    for _ in 0..count {
        let centre = random.next_in_cube();
        positions.extend([0; 3].map(|_| centre + random.next_in_cube() * size));
    }
    (positions, separate(count))
}

/// Triangles that share no vertices.
fn separate(count: usize) -> Vec<[u32; 3]> {
    (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect()
}

/// A closed box of `2 n^2` triangles a face, in `[-1,1]^3`, its inner vertices displaced by up to
/// `bump` inwards; no two corners of a face lie at the same place.
fn room(n: u32, bump: f32) -> Mesh {
    let mut index_of: HashMap<[i32; 3], u32> = HashMap::new();
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    let mut vertex = |at: [i32; 3]| {
        *index_of.entry(at).or_insert_with(|| {
            let p = Vec3::from_array(at.map(|x| x as f32 / n as f32 * 2.0 - 1.0));
            let wave = (p.x * 13.0).sin() * (p.y * 17.0).sin() * (p.z * 11.0).sin();
            positions.push(p * (1.0 - bump * wave.abs()));
            positions.len() as u32 - 1
        })
    };
    for axis in 0..3 {
        for side in [0, n as i32] {
            for i in 0..n as i32 {
                for j in 0..n as i32 {
                    let corner = |di: i32, dj: i32| {
                        let mut at = [side; 3];
                        at[(axis + 1) % 3] = i + di;
                        at[(axis + 2) % 3] = j + dj;
                        at
                    };
                    let [a, b, c, d] =
                        [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(x, y)| vertex(corner(x, y)));
                    triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
    }
    (positions, triangles)
}

/// Hit of one triangle in f64 (Moeller and Trumbore 1997), and how clear it is: the least distance
/// of the barycentric coordinates from 0.
fn exact_hit(r: &Ray, [a, b, c]: [Vec3; 3]) -> (f64, f64, [f64; 2]) {
    let [a, b, c]: [DVec3; 3] = [a, b, c].map(Vec3::as_dvec3);
    let (o, d) = (r.origin.as_dvec3(), r.direction.as_dvec3());
    let (e1, e2) = (b - a, c - a);
    let p = d.cross(e2);
    let determinant = e1.dot(p);
    let s = o - a;
    let v = s.dot(p) / determinant;
    let q = s.cross(e1);
    let w = d.dot(q) / determinant;
    (e2.dot(q) / determinant, v.min(w).min(1.0 - v - w), [v, w])
}

/// Compares closest hits of `count` rays with trying all triangles in f64.
///
/// Rays that the f64 test finds within `margin` of an edge, or two hits within a rounding of each
/// other, may go either way.
fn compare_with_brute_force((positions, triangles): &Mesh, rays: impl Iterator<Item = Ray>) {
    let bvh = Bvh::build(positions, triangles);
    let portable = bvh.clone().into_portable();
    let (mut hits, mut clear) = (0, 0);
    for r in rays {
        let found = bvh.closest_hit(&r, everything);
        assert_eq!(
            found,
            portable.closest_hit(&r, everything),
            "{} and portable: {r:?}",
            bvh.simd_name()
        );
        assert_eq!(bvh.any_hit(&r, everything), found.is_some(), "{r:?}");
        let margin = 1e-5;
        let mut nearest = f64::INFINITY;
        let mut unclear = f64::INFINITY;
        for triangle in triangles {
            let (t, inside, _) = exact_hit(&r, triangle.map(|i| positions[i as usize]));
            if t >= f64::from(r.t_min) && t <= f64::from(r.t_max) {
                if inside > margin {
                    nearest = nearest.min(t);
                } else if inside > -margin {
                    unclear = unclear.min(t);
                }
            }
        }
        hits += usize::from(found.is_some());
        let tolerance = |t: f64| 1e-4 * t + 1e-6 * f64::from(bvh.bounds().1.abs().max_element());
        match found {
            Some(hit) => {
                let t = f64::from(hit.t);
                assert!(
                    (t - nearest).abs() <= tolerance(t) || unclear <= t + tolerance(t),
                    "{hit:?}, but the nearest is at {nearest}: {r:?}"
                );
                clear += usize::from((t - nearest).abs() <= tolerance(t));
                let triangle = triangles[hit.triangle as usize].map(|i| positions[i as usize]);
                let (own_t, _, own) = exact_hit(&r, triangle);
                if (t - nearest).abs() <= tolerance(t) && unclear > 2.0 * t {
                    assert!((own_t - t).abs() <= tolerance(t), "{hit:?} at {own_t}");
                    let [v, w] = own.map(|x| x as f32);
                    assert!(hit.barycentric.abs_diff_eq(Vec2::new(v, w), 1e-2), "{hit:?} {own:?}");
                }
            }
            None => assert!(nearest.is_infinite(), "missed {nearest}: {r:?}"),
        }
    }
    assert!(hits > 20, "too few hits to say anything: {hits}");
    assert!(clear as f64 > 0.9 * hits as f64, "{clear} clear hits of {hits}");
}

fn rays_through(random: &mut SplitMix, count: usize, scale: f32) -> Vec<Ray> {
    let new = |_| ray(random.next_in_cube() * scale * 1.5, random.next_direction());
    (0..count).map(new).collect()
}

#[test]
fn agrees_with_brute_force_on_soups() {
    let mut random = SplitMix(1);
    for (count, size) in [(1, 1.0), (7, 1.0), (8, 1.0), (9, 1.0), (60, 0.5), (2000, 0.1)] {
        let mesh = soup(&mut random, count, size);
        let rays = rays_through(&mut random, 8000, 1.0);
        compare_with_brute_force(&mesh, rays.into_iter());
    }
}

#[test]
fn agrees_with_brute_force_on_rooms_of_all_sizes() {
    let mut random = SplitMix(2);
    for scale in [1e-4, 1.0, 1e6] {
        let (mut positions, triangles) = room(12, 0.2);
        positions.iter_mut().for_each(|p| *p *= scale);
        let rays = rays_through(&mut random, 3000, scale);
        compare_with_brute_force(&(positions, triangles), rays.into_iter());
    }
}

#[test]
fn agrees_with_brute_force_on_slivers_and_long_directions() {
    let mut random = SplitMix(3);
    let mut positions = Vec::new();
    for _ in 0..1500 {
        let (start, along) = (random.next_in_cube(), random.next_direction());
        positions.extend([
            start,
            start + along * 2.0,
            start + along + random.next_in_cube() * 0.02,
        ]);
    }
    let mesh = (positions, separate(1500));
    let mut rays = rays_through(&mut random, 4000, 1.0);
    rays.iter_mut().enumerate().for_each(|(i, r)| r.direction *= [1e-3, 1.0, 1e3][i % 3]);
    compare_with_brute_force(&mesh, rays.into_iter());
}

#[test]
fn respects_the_interval() {
    let mut random = SplitMix(4);
    let mesh = soup(&mut random, 1500, 0.2);
    let rays = rays_through(&mut random, 4000, 1.0).into_iter().map(|r| {
        let t_min = random.next_f32();
        Ray { t_min, t_max: t_min + random.next_f32(), ..r }
    });
    compare_with_brute_force(&mesh, rays);

    let bvh = Bvh::build(&[Vec3::ZERO, Vec3::X, Vec3::Y], &[[0, 1, 2]]);
    let at = |t_min, t_max| {
        let origin = Vec3::new(0.25, 0.25, 1.0);
        bvh.closest_hit(&Ray { origin, direction: Vec3::NEG_Z, t_min, t_max }, everything)
    };
    assert_eq!(at(1.0, 1.0).map(|hit| hit.t), Some(1.0), "both ends belong to the interval");
    assert_eq!(at(0.0, 0.999), None);
    assert_eq!(at(1.001, 9.0), None);
    assert_eq!(at(9.0, 0.0), None);
}

#[test]
fn ties_go_to_the_lowest_index_that_is_accepted() {
    let (positions, mut triangles) = room(6, 0.1);
    let count = triangles.len() as u32;
    for _ in 0..4 {
        triangles.extend_from_within(..count as usize);
    }
    let bvh = Bvh::build(&positions, &triangles);
    let mut random = SplitMix(5);
    for _ in 0..2000 {
        let r = ray(random.next_in_cube() * 0.5, random.next_direction());
        let first = bvh.closest_hit(&r, everything).expect("the room is closed");
        assert!(first.triangle < count, "{first:?}");
        let other = bvh.closest_hit(&r, |hit| hit.triangle >= count).expect("there is a copy");
        assert_eq!(other.t, first.t);
        assert_eq!(other.triangle % count, first.triangle);
    }
}

#[test]
fn any_hit_offers_each_hit_once_until_one_blocks() {
    let mut random = SplitMix(6);
    let mut positions = Vec::new();
    for _ in 0..300 {
        let z = random.next_f32();
        positions.extend([[-9.0, -9.0, z], [9.0, -9.0, z], [0.0, 9.0, z]].map(Vec3::from_array));
    }
    let bvh = Bvh::build(&positions, &separate(300));
    let r = ray(Vec3::new(0.1, 0.2, -1.0), Vec3::new(0.1, 0.0, 1.0));
    let mut offers = vec![0; 300];
    let blocked = bvh.any_hit(&r, |hit| {
        offers[hit.triangle as usize] += 1;
        false
    });
    assert!(!blocked);
    assert!(offers.iter().all(|&count| count == 1), "{offers:?}");
    let mut left = 10;
    let blocked = bvh.any_hit(&r, |_| {
        left -= 1;
        left == 0
    });
    assert!(blocked);
    assert_eq!(left, 0, "no offers after the one that blocks");
}

#[test]
fn unusable_input_is_left_out() {
    let empty = Bvh::build(&[], &[]);
    assert_eq!(empty.closest_hit(&ray(Vec3::ZERO, Vec3::X), everything), None);
    assert!(!empty.any_hit(&ray(Vec3::ZERO, Vec3::X), everything));
    assert_eq!(empty.bounds(), (Vec3::ZERO, Vec3::ZERO));

    let nan = Vec3::new(0.0, f32::NAN, 0.0);
    let positions = [Vec3::ZERO, Vec3::X, Vec3::Y, nan, Vec3::INFINITY, Vec3::X * 2.0];
    let triangles = [[0, 1, 3], [0, 1, 4], [0, 1, 5], [1, 1, 2], [0, 1, 77], [0, 1, 2]];
    let bvh = Bvh::build(&positions, &triangles);
    assert_eq!(bvh.bounds(), (Vec3::ZERO, Vec3::new(1.0, 1.0, 0.0)));
    let good = ray(Vec3::new(0.2, 0.2, 1.0), Vec3::NEG_Z);
    assert_eq!(bvh.closest_hit(&good, everything).map(|hit| hit.triangle), Some(5));
    let nowhere = [Vec3::ZERO, nan, Vec3::INFINITY];
    for direction in nowhere {
        assert_eq!(bvh.closest_hit(&ray(good.origin, direction), everything), None);
    }
    for origin in &nowhere[1..] {
        assert_eq!(bvh.closest_hit(&ray(*origin, Vec3::NEG_Z), everything), None);
    }
}

/// Triangles whose sizes and distances double make the binary tree as deep as it gets.
#[test]
fn deep_trees_stay_within_the_stack() {
    let mut positions = Vec::new();
    for i in 0..3000 {
        let size = 1.03_f32.powi(i % 2000) * 1e-12;
        positions.extend([Vec3::ZERO, Vec3::X * size, Vec3::Y * size].map(|p| p + Vec3::Z * size));
    }
    let bvh = Bvh::build(&positions, &separate(3000));
    let direction = Vec3::new(0.2, 0.2, 1.0);
    let mut offered = 0;
    bvh.any_hit(&ray(Vec3::ZERO, direction), |_| {
        offered += 1;
        false
    });
    assert_eq!(offered, 3000);
    let nearest = bvh.closest_hit(&ray(Vec3::ZERO, direction), everything).expect("3000 hits");
    assert_eq!(nearest.triangle, 0);
}

#[test]
fn building_again_gives_the_same_hits() {
    let mut random = SplitMix(7);
    let (positions, triangles) = soup(&mut random, 20_000, 0.05);
    let [a, b] = [1, 3].map(|threads| {
        let pool =
            rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a small pool");
        pool.install(|| Bvh::build(&positions, &triangles))
    });
    for r in rays_through(&mut random, 20_000, 1.0) {
        assert_eq!(a.closest_hit(&r, everything), b.closest_hit(&r, everything));
    }
}

/// Aims at points of the mesh where two or more triangles meet, along the axes, and anywhere.
#[test]
fn closed_rooms_do_not_leak() {
    for (bump, scale) in [(0.2, 1.0), (0.0, 1.0), (0.2, 1e-4), (0.1, 1e6)] {
        let (mut positions, triangles) = room(40, bump);
        positions.iter_mut().for_each(|p| *p *= scale);
        let bvh = Bvh::build(&positions, &triangles);
        let mut random = SplitMix(8);
        let mut leaks = Vec::new();
        for i in 0..300_000 {
            let origin = inner_origin(&mut random, &positions, scale);
            let triangle = triangles[random.below(triangles.len())].map(|i| positions[i as usize]);
            let direction = match i % 5 {
                0 => triangle[0] - origin,
                1 => triangle[0].lerp(triangle[1], random.next_f32()) - origin,
                2 => triangle[2].lerp(triangle[0], 0.5) - origin,
                3 => [Vec3::X, Vec3::Y, Vec3::Z][i / 5 % 3] * [1.0, -1.0][i / 15 % 2],
                _ => random.next_direction(),
            };
            let r = ray(origin, direction);
            if bvh.closest_hit(&r, everything).is_none() || !bvh.any_hit(&r, everything) {
                leaks.push(r);
            }
        }
        assert!(leaks.is_empty(), "{} leaks at bump {bump}, scale {scale}: {leaks:?}", leaks.len());
    }
}

/// A point well inside the room, some of whose coordinates are exactly those of a vertex, or zero.
fn inner_origin(random: &mut SplitMix, positions: &[Vec3], scale: f32) -> Vec3 {
    let mut origin = random.next_in_cube() * 0.6 * scale;
    for axis in 0..3 {
        let of_vertex = positions[random.below(positions.len())][axis];
        match random.below(4) {
            0 if of_vertex.abs() < 0.6 * scale => origin[axis] = of_vertex,
            1 => origin[axis] = 0.0,
            _ => {}
        }
    }
    origin
}

/// Directions with zero components through points whose other coordinates are those of a vertex:
/// rays in planes of mesh vertices, straight along edges, and through them.
#[test]
fn rays_along_grid_lines_do_not_leak() {
    for n in [8, 10, 33] {
        let (positions, triangles) = room(n, 0.0);
        let bvh = Bvh::build(&positions, &triangles);
        let at = |i: u32| i as f32 / n as f32 * 2.0 - 1.0;
        for i in 1..n {
            for j in 1..n {
                for axis in 0..3 {
                    let mut origin = Vec3::splat(0.125);
                    origin[(axis + 1) % 3] = at(i);
                    origin[(axis + 2) % 3] = at(j);
                    for (sign, slope) in
                        [(1.0, 0.0), (-1.0, -0.0), (1.0, 1e-30), (-1.0, 1e-9), (1.0, 0.5)]
                    {
                        let mut direction = Vec3::ZERO;
                        direction[axis] = sign;
                        direction[(axis + 1) % 3] = slope;
                        let r = ray(origin, direction);
                        assert!(bvh.closest_hit(&r, everything).is_some(), "{r:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn offset_origins_do_not_hit_their_own_surface() {
    let (positions, triangles) = room(30, 0.2);
    let bvh = Bvh::build(&positions, &triangles);
    let mut random = SplitMix(9);
    for _ in 0..50_000 {
        let r = ray(random.next_in_cube() * 0.3, random.next_direction());
        let hit = bvh.closest_hit(&r, everything).expect("the room is closed");
        let [a, b, c] = triangles[hit.triangle as usize].map(|i| positions[i as usize]);
        let [v, w] = hit.barycentric.to_array();
        let point = a * (1.0 - v - w) + b * v + c * w;
        let normal = (b - a).cross(c - a).normalize();
        let inward = if normal.dot(r.direction) > 0.0 { -normal } else { normal };
        let mut away = random.next_direction();
        away *= away.dot(inward).signum();
        let next = ray(offset_origin(point, inward), away);
        bvh.any_hit(&next, |other| {
            assert_ne!(other.triangle, hit.triangle, "{next:?}");
            false
        });
        assert!(bvh.closest_hit(&next, everything).is_some(), "the offset left the room: {next:?}");
    }
}
