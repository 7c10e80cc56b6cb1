//! Numbers, directions and random points: `math`, `sampler` and what needs no scene.

use glam::{UVec2, Vec2, Vec3, Vec4};

use super::Probe;
use super::cases::{Random, case, cases, edge_directions, edge_squares, edge_words};
use super::fixture::Fixture;
use super::twin::{EXACT, ulps};
use crate::bvh::offset_origin;
use crate::color::{importance, luminance};
use crate::environment::refine;
use crate::math::{Frame, atan2, balance_heuristic, sin_cos_turns, uv_from_direction};
use crate::path::camera::disk_from_square;
use crate::sampler::{Sampler, hash, unit_from_bits};

/// The probes that need no map.
pub(super) fn probes(fixture: &Fixture) -> Vec<Probe<'_>> {
    let mut probes = numbers();
    probes.extend(directions());
    probes.extend(random_points());
    probes.extend(camera(fixture));
    probes.push(long_sums());
    probes
}

/// Small numbers added to a large one, which alone would swallow all or most of them.
fn long_sums() -> Probe<'static> {
    const ADDED: u32 = 1000;
    Probe::new(
        "add_to_sum",
        "var sum = Sum(take4(), vec4f(0.0)); let x = take4();
        for (var i = 0u; i < 1000u; i++) { sum = add_to_sum(sum, x); }
        put4(sum.high); put4(sum.low);",
        cases([case(&[&Vec4::splat(1e6), &Vec4::splat(0.1)])], |r| {
            let size = r.magnitude(1e-10, 1e10);
            let x = r.unit3().extend(0.3) * size;
            case(&[&(r.unit3().extend(1.0) * (r.magnitude(1.0, 1e7) * size)), &x])
        }),
        |t| {
            let (start, x) = (t.take4().to_array(), t.take4().to_array());
            let high = [(); 4].map(|()| f64::from(t.device()));
            let low = [(); 4].map(|()| f64::from(t.device()));
            for i in 0..4 {
                // A thousand f64 additions lose 1e-13 of the sum at most.
                let sum = (0..ADDED).fold(f64::from(start[i]), |sum, _| sum + f64::from(x[i]));
                let off = (high[i] + low[i] - sum).abs();
                t.check(off <= 1e-12 * sum, || format!("{sum:e} is off by {off:e}"));
                t.check(low[i].abs() <= 1e-7 * high[i], || "the low part is low".to_owned());
            }
        },
    )
}

/// Of all magnitudes, both signs, at zero, subnormal and huge.
fn any_number(random: &mut Random) -> f32 {
    random.signed(1e-44, 3e38)
}

fn numbers() -> Vec<Probe<'static>> {
    let odd = [0.0, -0.0, 1e-45, -1e-40, f32::MAX, f32::INFINITY, -f32::INFINITY, f32::NAN, 1.0];
    let odd_pairs = || odd.into_iter().flat_map(move |x| odd.map(move |y| case(&[&x, &y])));
    let weights = [0.0, 1e-30, 1.0, 1e30, f32::MAX];
    let weights = weights.into_iter().flat_map(|x| weights.map(|y| case(&[&x, &y])));
    vec![
        Probe::new(
            "copysign, is_finite",
            "let x = take(); let y = take();
            put(copysign(x, y)); put_bool(is_finite(x)); put_bool(is_finite3(vec3f(1.0, x, y)));",
            cases(odd_pairs(), |r| case(&[&any_number(r), &any_number(r)])),
            |t| {
                let (x, y) = (t.take(), t.take());
                t.same(x.copysign(y).to_bits());
                t.same(x.is_finite());
                t.same(x.is_finite() && y.is_finite());
            },
        ),
        Probe::new(
            "balance_heuristic",
            "let pdf = take(); put(balance_heuristic(pdf, take()));",
            cases(weights, |r| case(&[&r.magnitude(1e-15, 1e15), &r.magnitude(1e-15, 1e15)])),
            |t| {
                // The shaders' infinity is the largest number.
                let pdf = t.take();
                let pdf = if pdf == f32::MAX { f32::INFINITY } else { pdf };
                let other = t.take();
                t.near(balance_heuristic(pdf, other), ulps(3.0));
            },
        ),
        Probe::new(
            "luminance, importance",
            "let rgb = take3(); put(luminance(rgb)); put(importance(rgb)); put(max_element(rgb));",
            cases([case(&[&Vec3::ZERO]), case(&[&Vec3::Y])], |r| {
                case(&[&(r.unit3() * r.magnitude(1e-30, 1e30))])
            }),
            |t| {
                let rgb = t.take3();
                t.near(luminance(rgb), ulps(3.0));
                t.near(importance(rgb), ulps(4.0));
                t.near(rgb.max_element(), EXACT);
            },
        ),
        Probe::new(
            "multiply_wide",
            "let a = take_word(); let p = multiply_wide(a, take_word());
            put_word(p.x); put_word(p.y);",
            cases([case(&[&u32::MAX, &u32::MAX]), case(&[&0_u32, &u32::MAX])], |r| {
                case(&[&(r.word() >> r.below(32)), &(r.word() >> r.below(32))])
            }),
            |t| {
                let product = u64::from(t.take_word()) * u64::from(t.take_word());
                t.same((product >> 32) as u32);
                t.same(product as u32);
            },
        ),
    ]
}

fn directions() -> Vec<Probe<'static>> {
    let each_direction = || edge_directions().into_iter().map(|d| case(&[&d]));
    let axes = [0.0, -0.0, 1e-30, -1e-30, 1.0, -1.0, 0.41421357, 1e30, -1e30];
    let axes = axes.into_iter().flat_map(|x| axes.map(|y| case(&[&x, &y])));
    let eighths = (-24..=24).map(|i| case(&[&(i as f32 / 8.0)]));
    let ends = [Vec3::ZERO, Vec3::splat(1e30), Vec3::splat(-3e38), Vec3::X * 1e-18];
    vec![
        // Squares that are subnormal, which devices may take for zero, are left out.
        Probe::new(
            "normalize_or",
            "let v = take3(); put3(normalize_or(v, take3()));",
            cases(ends.map(|v| case(&[&v, &Vec3::Y])), |r| {
                case(&[&(r.direction() * r.magnitude(1e-17, 1e18)), &r.direction()])
            }),
            |t| {
                let (v, fallback) = (t.take3(), t.take3());
                t.near(v.try_normalize().unwrap_or(fallback), ulps(3.0).of(1.0));
            },
        ),
        Probe::new(
            "frame_from_z and back",
            "let frame = frame_from_z(take3()); let v = take3(); put3(frame.x); put3(frame.y);
            put3(local_from_world(frame, v)); put3(world_from_local(frame, v));",
            cases(edge_directions().into_iter().map(|d| case(&[&d, &Vec3::ONE])), |r| {
                case(&[&r.direction(), &r.in_cube()])
            }),
            |t| {
                let (frame, v) = (Frame::from_z(t.take3()), t.take3());
                t.near(frame.x, ulps(3.0).of(1.0));
                t.near(frame.y, ulps(3.0).of(1.0));
                t.near(frame.local_from_world(v), ulps(4.0).of(1.0));
                t.near(frame.world_from_local(v), ulps(4.0).of(1.0));
            },
        ),
        Probe::new(
            "angle_of",
            "let y = take(); put(angle_of(y, take()));",
            cases(axes, |r| case(&[&r.signed(1e-10, 1e10), &r.signed(1e-10, 1e10)])),
            |t| {
                let (y, x) = (t.take(), t.take());
                t.near(atan2(y, x), ulps(4.0));
            },
        ),
        Probe::new(
            "sin_cos_turns",
            "put2(sin_cos_turns(take()));",
            cases(eighths, |r| case(&[&r.between(-3.0, 3.0)])),
            |t| {
                let (sin, cos) = sin_cos_turns(t.take());
                t.near(Vec2::new(sin, cos), ulps(2.0).of(1.0));
            },
        ),
        Probe::new(
            "uv_from_direction",
            "put2(uv_from_direction(take3()));",
            cases(each_direction(), |r| case(&[&r.direction()])),
            |t| {
                let uv = uv_from_direction(t.take3());
                t.near(uv.x, ulps(3.0).of(1.0));
                t.near(uv.y, ulps(4.0));
            },
        ),
        Probe::new(
            "offset_origin",
            "let position = take3(); put3(offset_origin(position, take3()));",
            cases(edge_directions().into_iter().map(|d| case(&[&(d / 32.0), &d])), |r| {
                case(&[&(r.direction() * r.magnitude(1e-6, 1e6)), &r.direction()])
            }),
            |t| {
                let (position, normal) = (t.take3(), t.take3());
                // Away from zero it counts bits; near it, it adds.
                for (right, at) in
                    offset_origin(position, normal).to_array().iter().zip(position.to_array())
                {
                    t.near(*right, if at.abs() < 1.0 / 32.0 { ulps(1.0).of(at) } else { EXACT });
                }
            },
        ),
    ]
}

fn random_points() -> Vec<Probe<'static>> {
    let squares = || edge_squares().into_iter().map(|u| case(&[&u]));
    let indices = [0, 1, 0x8000_0000, u32::MAX].map(|i| case(&[&i, &i, &i]));
    vec![
        Probe::new(
            "hash",
            "put_word(hash(take_word()));",
            cases([0, 1, u32::MAX].map(|x| case(&[&x])), |r| case(&[&r.word()])),
            |t| {
                let right = hash(t.take_word());
                t.same(right);
            },
        ),
        Probe::new(
            "sampler",
            "let seed = take_word(); let pixel = take_word();
            var sampler = sampler_new(seed, pixel, take_word());
            for (var i = 0; i < 3; i++) {
                let bits = next_pair_bits(&sampler); put_word(bits.x); put_word(bits.y);
            }
            put2(next_pair(&sampler)); put2(lens_point(&sampler));
            var estimate = sampler_of_estimate(sampler, 3u, 2u);
            put_word(next_pair_bits(&estimate).y);
            estimate = sampler_of_estimate(sampler, 1u, 0u);
            put_word(next_pair_bits(&estimate).y);
            var of_pixel = sampler_of_pixel(seed, vec2u(pixel & 0xffffu, pixel >> 16u), 5u);
            put_word(next_pair_bits(&of_pixel).x);",
            cases(indices, |r| case(&[&r.word(), &r.word(), &(r.word() >> r.below(32))])),
            |t| {
                let [seed, pixel, index] = [t.take_word(), t.take_word(), t.take_word()];
                let mut sampler = Sampler::new(seed, pixel, index);
                for _ in 0..3 {
                    sampler.next_pair_bits().into_iter().for_each(|bits| t.same(bits));
                }
                t.near(Vec2::from(sampler.next_pair()), EXACT);
                t.near(Vec2::from(sampler.next_pair()), EXACT);
                t.same(sampler.of_estimate(3, 2).next_pair_bits()[1]);
                t.same(sampler.of_estimate(1, 0).next_pair_bits()[1]);
                let place = [pixel & 0xffff, pixel >> 16];
                t.same(Sampler::of_pixel(seed, place, 5).next_pair_bits()[0]);
            },
        ),
        Probe::new(
            "unit_from_bits",
            "put(unit_from_bits(take_word()));",
            cases([0, 255, 256, u32::MAX].map(|x| case(&[&x])), |r| case(&[&r.word()])),
            |t| {
                let right = unit_from_bits(t.take_word());
                t.near(right, EXACT);
            },
        ),
        Probe::new(
            "refine",
            "let fine = refine(vec2u(take_word(), take_word()));
            put_word(fine[0].x); put_word(fine[0].y); put_word(fine[1].x); put_word(fine[1].y);",
            cases(edge_words().map(|[x, y]| case(&[&x, &y])), |r| case(&[&r.word(), &r.word()])),
            |t| {
                for bits in refine([t.take_word(), t.take_word()]) {
                    t.same((bits >> 32) as u32);
                    t.same(bits as u32);
                }
            },
        ),
        Probe::new(
            "disk_from_square",
            "put2(disk_from_square(take2()));",
            cases(squares(), |r| case(&[&r.unit2()])),
            |t| {
                let right = disk_from_square(t.take2());
                t.near(right, ulps(3.0).of(1.0));
            },
        ),
    ]
}

/// Cameras and filters; which ones depends on the fixture.
pub(super) fn camera(fixture: &Fixture) -> Vec<Probe<'_>> {
    let Fixture { view, rays, .. } = fixture;
    let size = Vec2::new(view.width as f32, view.height as f32);
    let corners = [Vec2::ZERO, size, 0.5 * size].map(|p| case(&[&p, &Vec2::splat(0.5)]));
    let reach = rays.position.length() + rays.focus_distance;
    vec![
        Probe::new(
            "camera_ray",
            "let pixel = take2(); let ray = camera_ray(pixel, take2());
            put3(ray.origin); put3(ray.direction);",
            cases(corners, |r| case(&[&(r.unit2() * size), &r.unit2()])),
            move |t| {
                let ray = rays.ray(t.take2(), t.take2());
                t.near(ray.origin, ulps(2.0).of(reach));
                t.near(ray.direction, ulps(4.0).of(1.0));
            },
        ),
        Probe::new(
            "filter_sample",
            "put2(filter_sample(take2()));",
            cases(edge_squares().into_iter().map(|u| case(&[&u])), |r| case(&[&r.unit2()])),
            |t| {
                let right = view.filter.sample(t.take2());
                t.near(right, ulps(3.0).of(1.0));
            },
        ),
        Probe::new(
            "start_sample",
            "let x = take_word(); let y = take_word(); let path = start_sample(x, y, take_word());
            put3(path.ray.origin); put3(path.ray.direction);
            var sampler = path.sampler; put_word(next_pair_bits(&sampler).x);",
            cases([], |r| case(&[&r.below(view.width), &r.below(view.height), &r.below(4096)])),
            move |t| {
                let pixel = UVec2::new(t.take_word(), t.take_word());
                let (ray, mut sampler) = fixture.start_sample(pixel, t.take_word());
                t.near(ray.origin, ulps(4.0).of(reach));
                t.near(ray.direction, ulps(8.0).of(1.0));
                t.same(sampler.next_pair_bits()[0]);
            },
        ),
    ]
}
