//! What rays find: surface points, textures, lights, hits; then whole paths.

use glam::{UVec2, Vec2, Vec3, Vec4, Vec4Swizzles};

use super::Probe;
use super::cases::{Random, case, cases};
use super::fixture::Fixture;
use super::scattering::expect_parameters;
use super::twin::{EXACT, Twin, ulps};
use crate::bvh::Ray;
use crate::path::Receiver;
use crate::scene::surface::{Sides, SurfacePoint, alpha_at};
use crate::scene::texture::sample_texture;
use crate::scene::{Scene, TextureRef};

/// The probes but for whole paths.
pub(super) fn probes(fixture: &Fixture) -> Vec<Probe<'_>> {
    let mut probes = textures(&fixture.world.scene);
    probes.extend(points(fixture));
    probes.extend(lights(fixture));
    probes.extend(hits(fixture));
    probes
}

/// A triangle and a place in it.
fn place(r: &mut Random, scene: &Scene) -> (u32, Vec2) {
    let u = r.unit2();
    let barycentric = if u.x + u.y < 1.0 { u } else { 1.0 - u };
    let instances = scene.instances.for_tree();
    if instances.is_empty() || r.below(3) == 0 {
        return (r.below(scene.own_triangles().end), barycentric);
    }
    let instance = &instances[r.below(instances.len() as u32) as usize];
    let triangles = scene.instances.meshes()[instance.mesh as usize].len() as u32;
    (instance.first + r.below(triangles), barycentric)
}

fn textures(scene: &Scene) -> Vec<Probe<'_>> {
    let references: Vec<TextureRef> =
        scene.materials.iter().flat_map(|m| &m.textures).flatten().map(|t| **t).collect();
    let count = references.len() as u32;
    let edge_uvs = [0.0, 0.5, 1.0, -1.0, 1e9].map(|x| Vec4::new(x, -x, x, x));
    let edges = (0..count).flat_map(move |i| edge_uvs.map(|uvs| case(&[&i, &uvs])));
    vec![
        // Colours are decoded by `pow` on the device and by a table here.
        Probe::new(
            "read_texture",
            "let reference = take_word(); put4(read_texture(reference, take4()));",
            cases(edges, move |r| {
                let uvs = Vec4::from((r.unit2(), r.unit2())) * 6.0 - 3.0;
                case(&[&r.below(count), &uvs])
            }),
            move |t| {
                let reference = references[t.take_word() as usize];
                let uvs = t.take4();
                let uv = if reference.uv_set == 1 { uvs.zw() } else { uvs.xy() };
                t.near(sample_texture(scene, &reference, uv), ulps(64.0).of(1.0));
            },
        )
        .flips(500),
        Probe::new(
            "alpha_at",
            "let triangle = take_word(); put(alpha_at(triangle, take2()));",
            cases([], |r| {
                let (triangle, barycentric) = place(r, scene);
                case(&[&triangle, &barycentric])
            }),
            move |t| {
                let right = alpha_at(scene, t.take_word(), t.take2());
                t.near(right, ulps(64.0).of(1.0));
            },
        )
        .flips(500),
    ]
}

/// Of a triangle over the longer of two sides.
fn height([a, b, c]: [Vec3; 3]) -> f32 {
    (b - a).cross(c - a).length() / (b - a).length().max((c - a).length())
}

fn points(fixture: &Fixture) -> Vec<Probe<'_>> {
    let scene = &fixture.world.scene;
    let case_of = |r: &mut Random| {
        let (triangle, barycentric) = place(r, scene);
        case(&[&triangle, &barycentric, &r.direction()])
    };
    let corners = [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::splat(0.5)];
    let last = scene.triangles.len() as u32 - 1;
    let own = scene.own_triangles().end;
    let edges = || {
        [0, 5, last].into_iter().flat_map(move |triangle| {
            corners.map(move |barycentric| case(&[&triangle, &barycentric, &Vec3::NEG_Y]))
        })
    };
    vec![
        Probe::new(
            "surface_at",
            "let triangle = take_word(); let barycentric = take2();
            let point = surface_at(triangle, barycentric, take3());
            put3(point.position); put3(point.geometric_normal); put_bool(point.front_face);
            put(point.lift);
            put3(point.shading_frame.x); put3(point.shading_frame.z);
            put_parameters(point.parameters);",
            cases(edges(), case_of),
            move |t| {
                let triangle = t.take_word();
                let point = SurfacePoint::at(scene, triangle, t.take2(), t.take3());
                t.near(point.position, ulps(3.0).of(4.0));
                // An instance's corners are rounded where they are, which turns small triangles.
                let turned =
                    if triangle < own { 1.0 } else { 8.0 / height(scene.corners(triangle)) };
                t.near(point.geometric_normal, ulps(8.0).of(turned));
                t.same(point.front_face);
                t.near(point.lift, ulps(64.0).of(turned));
                t.near(point.shading_frame.x, ulps(256.0).of(turned));
                t.near(point.shading_frame.z, ulps(256.0).of(turned));
                expect_parameters(t, &point.parameters, ulps(256.0).of(1.0));
            },
        )
        .flips(500),
        Probe::new(
            "origin_toward",
            "let triangle = take_word(); let barycentric = take2();
            let point = surface_at(triangle, barycentric, take3());
            let direction = take3();
            put_bool(is_above(point, direction)); put3(origin_toward(point, direction));",
            cases([], |r| {
                let (triangle, barycentric) = place(r, scene);
                case(&[&triangle, &barycentric, &r.direction(), &r.direction()])
            }),
            move |t| {
                let (triangle, barycentric, seen) = (t.take_word(), t.take2(), t.take3());
                let point = SurfacePoint::at(scene, triangle, barycentric, seen);
                let sides = Sides::of(&point);
                let direction = t.take3();
                t.same(sides.is_above(direction));
                let origin = sides.origin_toward(point.position, direction);
                t.near(origin, ulps(64.0).of(4.0));
            },
        )
        .flips(500),
        Probe::new(
            "straight_through",
            "let triangle = take_word(); let barycentric = take2(); let direction = take3();
            put3(straight_through(surface_at(triangle, barycentric, direction), direction));",
            cases(edges(), case_of),
            move |t| {
                let (triangle, barycentric, direction) = (t.take_word(), t.take2(), t.take3());
                let point = SurfacePoint::at(scene, triangle, barycentric, direction);
                t.near(fixture.world.straight_through(&point, direction), ulps(32.0).of(1.0));
            },
        )
        .flips(500),
    ]
}

/// A place to be lit: anywhere, on a light's corner or far away; a third of them from all sides.
fn receiver(r: &mut Random, scene: &Scene) -> (Vec3, Vec3) {
    let position = match r.below(16) {
        0 => scene.positions[r.below(scene.positions.len() as u32) as usize],
        1 => scene.lights[r.below(scene.lights.len() as u32) as usize].position,
        2 => 1e4 * r.in_cube(),
        _ => 4.0 * r.in_cube(),
    };
    (position, if r.below(3) == 0 { Vec3::ZERO } else { r.direction() })
}

fn take_receiver(t: &mut Twin<'_>) -> Receiver {
    Receiver { position: t.take3(), normal: t.take3() }
}

// Cosines that are differences of angles have lost some bits, more on each level of the tree.
fn lights(fixture: &Fixture) -> Vec<Probe<'_>> {
    let world = &fixture.world;
    let scene = &world.scene;
    let triangles = scene.triangles.len() as u32;
    let edges = [0, 1, u32::MAX / 2, u32::MAX].map(|x| case(&[&Vec3::ONE, &Vec3::ZERO, &x, &x]));
    vec![
        Probe::new(
            "sample_local_light",
            "let position = take3(); let receiver = Receiver(position, take3());
            let x = take_word(); let sample = sample_local_light(receiver, vec2u(x, take_word()));
            put3(sample.radiance_over_pdf); put3(sample.direction); put(sample.distance);
            put(sample.pdf_solid_angle);",
            cases(edges, |r| {
                let (position, normal) = receiver(r, scene);
                case(&[&position, &normal, &r.word(), &r.word()])
            }),
            move |t| {
                let receiver = take_receiver(t);
                let (bits, point_at) =
                    ([t.take_word(), t.take_word()], |hit: &_, v| world.point(hit, v));
                match world.lights.sample(scene, &receiver, bits, point_at) {
                    Some(light) => {
                        let largest = light.radiance_over_pdf.max_element();
                        t.near(light.radiance_over_pdf, ulps(512.0).of(largest));
                        t.near(light.direction, ulps(64.0).of(1.0));
                        t.near(light.distance.min(f32::MAX), ulps(64.0));
                        t.near(light.pdf_solid_angle.min(f32::MAX), ulps(512.0));
                    }
                    None => {
                        t.near(Vec3::ZERO, EXACT);
                        t.accept_rest();
                    }
                }
            },
        )
        .flips(500),
        Probe::new(
            "local_light_pdf_solid_angle",
            "let triangle = take_word(); let position = take3();
            let receiver = Receiver(position, take3()); let direction = take3();
            put(local_light_pdf_solid_angle(triangle, receiver, direction, take()));",
            cases([], |r| {
                let (position, normal) = receiver(r, scene);
                let distance = r.magnitude(0.1, 20.0);
                case(&[&r.below(triangles), &position, &normal, &r.direction(), &distance])
            }),
            move |t| {
                let (triangle, receiver) = (t.take_word(), take_receiver(t));
                let (direction, distance) = (t.take3(), t.take());
                let lights = &world.lights;
                let right = lights.sample_pdf_solid_angle(
                    scene,
                    triangle,
                    &receiver,
                    (direction, distance),
                );
                t.near(right, ulps(256.0));
            },
        ),
    ]
}

/// From anywhere in any direction, along an axis, or at a vertex.
fn ray(r: &mut Random, scene: &Scene) -> (Vec3, Vec3) {
    let origin = 5.0 * r.in_cube();
    let target = scene.positions[r.below(scene.positions.len() as u32) as usize];
    match r.below(8) {
        0 => (origin, Vec3::AXES[r.below(3) as usize]),
        1 => (origin, (target - origin).normalize()),
        _ => (origin, r.direction()),
    }
}

fn hits(fixture: &Fixture) -> Vec<Probe<'_>> {
    let world = &fixture.world;
    let scene = &world.scene;
    let away = case(&[&Vec3::splat(1e6), &Vec3::ONE, &1e30_f32, &0_u32]);
    vec![
        // Rays that meet an edge may go either way.
        Probe::new(
            "closest_hit",
            "let origin = take3(); let direction = take3(); let ray = Ray(origin, direction, take());
            let hit = closest_hit(ray, take_word() != 0u);
            put_bool(hit.t < MISS);
            if hit.t < MISS { put_word(hit.triangle); put(hit.t); put2(hit.barycentric); }",
            cases([away], |r| {
                let (origin, direction) = ray(r, scene);
                let t_max = if r.below(4) == 0 { r.magnitude(0.1, 10.0) } else { f32::MAX };
                case(&[&origin, &direction, &t_max, &r.below(2)])
            }),
            move |t| {
                let (origin, direction) = (t.take3(), t.take3());
                let ray = Ray { origin, direction, t_min: 0.0, t_max: t.take() };
                let hit = world.closest_hit(&ray, t.take_word() != 0);
                t.same(hit.is_some());
                if let Some(hit) = hit {
                    t.same(hit.triangle);
                    // A grazing ray meets a triangle's plane far from where it should.
                    let corners = scene.corners(hit.triangle);
                    let [a, b, c] = corners;
                    let normal = (b - a).cross(c - a);
                    let steep = normal.dot(direction).abs() / normal.length();
                    t.near(hit.t, ulps(8.0).of(8.0 / steep));
                    let size = height(corners);
                    t.near(hit.barycentric, ulps(8.0).of(8.0 / (steep * size)));
                }
            },
        )
        .flips(500),
        Probe::new(
            "transmittance_along",
            "let origin = take3(); let direction = take3();
            meets_glass = false;
            let share = transmittance_along(Ray(origin, direction, take()));
            put3(select(share, vec3f(0.0), meets_glass));",
            cases([], |r| {
                let (origin, direction) = ray(r, scene);
                case(&[&origin, &direction, &r.magnitude(0.3, 10.0)])
            }),
            move |t| {
                let (origin, direction) = (t.take3(), t.take3());
                let ray = Ray { origin, direction, t_min: 0.0, t_max: t.take() };
                t.near(world.transmittance(&ray), ulps(32.0).of(1.0));
            },
        )
        .flips(500),
    ]
}

/// Paths from the camera to their ends. Rounding sends one in a few hundred to another triangle,
/// texel or lobe; what it meets from there on differs.
pub(super) fn path_probes(fixture: &Fixture) -> Vec<Probe<'_>> {
    let Fixture { view, .. } = fixture;
    vec![
        Probe::new(
            "path_step until the end",
            "let x = take_word(); let y = take_word(); var path = start_sample(x, y, take_word());
            while path_step(&path) {}
            put_word(path.rays); put3(path.radiance); put(path.first_hit.hits);
            put3(path.first_hit.albedo); put3(path.first_hit.normal); put(path.first_hit.depth);",
            cases([], |r| case(&[&r.below(view.width), &r.below(view.height), &r.below(4096)])),
            move |t| {
                let pixel = UVec2::new(t.take_word(), t.take_word());
                let (ray, sampler) = fixture.start_sample(pixel, t.take_word());
                let path = fixture.tracer().radiance(ray, sampler);
                t.same(path.rays);
                t.near(path.radiance, ulps(8192.0).of(path.radiance.max_element()));
                let hits = if path.is_minor { -1.0 } else { 0.0 };
                t.near(path.first_hit.map_or(hits, |_| 1.0), EXACT);
                if let Some(hit) = path.first_hit {
                    t.near(hit.albedo, ulps(512.0).of(1.0));
                    t.near(hit.normal, ulps(512.0).of(1.0));
                    t.near(hit.depth, ulps(512.0));
                } else {
                    t.near(Vec3::ZERO, EXACT);
                    t.near(Vec3::ZERO, EXACT);
                    t.near(0.0, EXACT);
                }
            },
        )
        .flips(100),
    ]
}

#[test]
fn rays_hit_and_miss() {
    let [fixture, ..] = super::fixture::all();
    let mut random = Random::default();
    let mut hits = 0;
    for _ in 0..1000 {
        let (origin, direction) = ray(&mut random, &fixture.world.scene);
        let ray = Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
        hits += u32::from(fixture.world.closest_hit(&ray, false).is_some());
    }
    assert!((300..900).contains(&hits), "{hits}");
}
