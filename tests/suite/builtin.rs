//! Tests of builtin.

use std::cell::RefCell;
use std::collections::{HashMap, HashSet};
use std::time::Instant;

use glam::{Vec2, Vec3};
use lightgrid::bvh::{Bvh, Ray};
use lightgrid::environment::sky;
use lightgrid::math::{direction_from_uv, texel_solid_angle};
use lightgrid::noise::Stream;
use lightgrid::scene::{Projection, Scene, SceneOptions, TextureSlot, builtin};
use lightgrid::sources;

fn corners(scene: &Scene, triangle: usize) -> [Vec3; 3] {
    scene.triangles[triangle].map(|i| scene.positions[i as usize])
}

#[test]
fn scenes_are_complete_and_well_formed() {
    for name in builtin::names() {
        let started = Instant::now();
        let scene = builtin::build(name).expect(name);
        let seconds = started.elapsed().as_secs_f32();
        eprintln!("{name}: {} triangles, {seconds:.3} s", scene.triangles.len());
        assert!(
            (1_000..=200_000).contains(&scene.triangles.len()),
            "{name}: {}",
            scene.triangles.len()
        );
        let vertices = scene.positions.len();
        assert_eq!(scene.normals.len(), vertices);
        assert_eq!(scene.uvs[0].len(), vertices);
        assert_eq!(scene.colors.len(), vertices);
        assert_eq!(scene.triangle_materials.len(), scene.triangles.len());
        assert!(scene.positions.iter().all(|p| p.is_finite()), "{name}");
        assert!(scene.uvs[0].iter().all(|uv| uv.is_finite()), "{name}");
        for n in &scene.normals {
            assert!(*n == Vec3::ZERO || (n.length() - 1.0).abs() < 1e-3, "{name}: {n}");
        }
        assert!(!scene.cameras.is_empty() && scene.cameras.iter().all(|c| !c.name.is_empty()));
        for (m, material) in scene.materials.iter().enumerate() {
            assert!(
                scene.triangle_materials.contains(&(m as u32)),
                "{name}: {} is not used",
                material.name
            );
            if let Some(texture) = material.texture(TextureSlot::BaseColor) {
                let image = scene.textures[texture.texture as usize].image;
                assert!(scene.images[image as usize].width <= 1024);
            } else if material.metallic == 0.0 && material.transmission == 0.0 {
                assert!(material.base_color.truncate().max_element() <= 0.95, "{}", material.name);
            }
        }
    }
}

#[test]
fn shading_normals_agree_with_winding() {
    for name in builtin::names() {
        let scene = builtin::build(name).expect(name);
        let mut against: HashMap<&str, usize> = HashMap::new();
        for (t, triangle) in scene.triangles.iter().enumerate() {
            let [a, b, c] = corners(&scene, t);
            let face = (b - a).cross(c - a);
            assert!(face.length() > 1e-10, "{name}: triangle {t} has no area");
            let shading: Vec3 = triangle.iter().map(|&i| scene.normals[i as usize]).sum();
            if shading != Vec3::ZERO && shading.dot(face) < 0.0 {
                let material = &scene.materials[scene.triangle_materials[t] as usize];
                *against.entry(material.name.as_str()).or_default() += 1;
            }
        }
        assert!(against.is_empty(), "{name}: triangles shaded against their winding: {against:?}");
    }
}

/// Triangles met at one point of the ray whose fronts look the same way, beside the nearest one.
fn fighting(scene: &Scene, bvh: &Bvh, ray: &Ray) -> Option<[usize; 2]> {
    let met = RefCell::new(Vec::new());
    bvh.closest_hit(ray, |hit| {
        met.borrow_mut().push((hit.t, hit.triangle as usize));
        false
    });
    let met = met.into_inner();
    let &(t, first) = met.iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
    let normal = |triangle: usize| {
        let [a, b, c] = corners(scene, triangle);
        (b - a).cross(c - a).normalize()
    };
    let facing = normal(first);
    let second = met.iter().find(|&&(other, triangle)| {
        let apart = (other - t) * ray.direction.dot(facing).abs();
        let adjacent = corners(scene, first).iter().any(|p| corners(scene, triangle).contains(p));
        triangle != first && apart < 1e-4 && !adjacent && normal(triangle).dot(facing) > 0.999
    })?;
    Some([first, second.1])
}

#[test]
fn no_two_faces_fight_for_one_place() {
    for name in builtin::names() {
        let scene = builtin::build(name).expect(name);
        let bvh = Bvh::build(&scene.positions, &scene.triangles);
        let mut stream = Stream::new(3);
        let mut clashes: HashMap<[&str; 2], (u32, Vec3)> = HashMap::new();
        for k in 0..60_000 {
            let camera = &scene.cameras[k % scene.cameras.len()];
            let mut origin = Vec3::from(camera.world_from_camera.translation);
            origin += Vec3::new(
                stream.between(-0.2, 0.2),
                stream.between(-1.0, 0.4),
                stream.between(-0.2, 0.2),
            );
            let direction = uniform_direction(&mut stream);
            let ray = Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
            // Half the rays start where the first one landed.
            let ray = match bvh.closest_hit(&ray, |_| true) {
                Some(hit) if k % 2 == 0 => {
                    let direction = uniform_direction(&mut stream);
                    let origin = ray.origin + ray.direction * (hit.t - 0.002);
                    Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY }
                }
                _ => ray,
            };
            if let Some(pair) = fighting(&scene, &bvh, &ray) {
                let key = pair
                    .map(|t| scene.materials[scene.triangle_materials[t] as usize].name.as_str());
                clashes.entry(key).or_insert((0, corners(&scene, pair[0])[0])).0 += 1;
            }
        }
        assert!(clashes.is_empty(), "{name}: faces in one place: {clashes:?}");
    }
}

fn uniform_direction(stream: &mut Stream) -> Vec3 {
    let y = stream.between(-1.0, 1.0);
    let (s, c) = stream.between(0.0, std::f32::consts::TAU).sin_cos();
    let ring = (1.0 - y * y).sqrt();
    Vec3::new(ring * c, y, ring * s)
}

/// Rays from inside a room, which no glass stops, may leave only through its openings; gives the share that leaves.
fn escaping(name: &str, size: [f32; 3], rays: u32, through: impl Fn(Vec3) -> bool) -> f32 {
    let scene = builtin::build(name).expect(name);
    let bvh = Bvh::build(&scene.positions, &scene.triangles);
    let mut stream = Stream::new(5);
    let mut left = 0;
    for _ in 0..rays {
        let origin = Vec3::new(
            stream.between(-0.45, 0.45) * size[0],
            stream.between(0.3, 0.95) * size[1],
            stream.between(-0.45, 0.45) * size[2],
        );
        let direction = uniform_direction(&mut stream);
        let ray = Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
        let is_opaque = |triangle: u32| {
            let material = scene.triangle_materials[triangle as usize];
            scene.materials[material as usize].transmission == 0.0
        };
        if bvh.closest_hit(&ray, |hit| is_opaque(hit.triangle)).is_none() {
            left += 1;
            // Where the ray meets the inner face of the wall it left through.
            let half = Vec3::new(0.5 * size[0], 0.5 * size[1], 0.5 * size[2]);
            let from = origin - Vec3::Y * half.y;
            let t = ((half * direction.signum() - from) / direction).min_element();
            let exit = from + direction * t + Vec3::Y * half.y;
            assert!(through(exit), "{name}: a ray leaves at {exit}");
        }
    }
    left as f32 / rays as f32
}

#[test]
fn rooms_leak_only_through_their_openings() {
    let within = |x: f32, low: f32, high: f32| x > low && x < high;
    let office = escaping("office", [6.0, 3.0, 4.0], 100_000, |p| {
        p.x < -2.99 && within(p.y, 1.1, 2.2) && within(p.z.abs(), 0.4, 1.6)
    });
    let living = escaping("living-room", [6.0, 3.0, 5.0], 100_000, |p| {
        let window = p.x > 2.99 && within(p.y, 0.49, 2.31) && p.z.abs() < 1.31;
        window || (p.z > 2.49 && Vec2::new(p.x + 1.4, p.y - 1.9).length() < 0.46)
    });
    let crack = escaping("crack", [4.0, 2.5, 3.0], 100_000, |p| {
        p.x < -1.99 && within(p.y, 1.59, 1.63) && p.z.abs() < 0.76
    });
    let bathroom = escaping("bathroom", [4.4, 2.7, 3.2], 100_000, |p| {
        p.x > 2.19 && within(p.y, 0.91, 2.33) && within(p.z, -0.19, 1.27)
    });
    eprintln!(
        "escaping: office {office}, living-room {living}, crack {crack}, bathroom {bathroom}"
    );
    assert!(within(office, 0.004, 0.04) && within(living, 0.02, 0.12) && crack < 0.002);
    assert!(within(bathroom, 0.01, 0.10));
}

/// Across each edge of solid glass lies another face of it, wound the same way.
#[test]
fn solid_glass_is_closed() {
    for name in builtin::names() {
        let scene = builtin::build(name).expect(name);
        let mut edges: Vec<(u32, [Vec3; 2])> = Vec::new();
        for (t, &m) in scene.triangle_materials.iter().enumerate() {
            let material = &scene.materials[m as usize];
            if material.transmission > 0.0 && material.thickness > 0.0 {
                let [a, b, c] = corners(&scene, t);
                edges.extend([[a, b], [b, c], [c, a]].map(|edge| (m, edge)));
            }
        }
        assert!(name != &"bathroom" || edges.len() > 1000);
        let key = |m: u32, edge: [Vec3; 2]| (m, edge.map(|p| p.to_array().map(f32::to_bits)));
        let known: HashSet<_> = edges.iter().map(|&(m, edge)| key(m, edge)).collect();
        edges.retain(|&(m, [from, to])| !known.contains(&key(m, [to, from])));
        // Of these the corners on both sides differ by rounding.
        for (m, [from, to]) in &edges {
            let is_met = edges.iter().any(|(other, [start, end])| {
                m == other && start.distance(*to) < 1e-5 && end.distance(*from) < 1e-5
            });
            assert!(is_met, "{name}: {} is open at {from}", scene.materials[*m as usize].name);
        }
    }
}

#[test]
fn cameras_see_places_and_no_backs() {
    for name in builtin::names() {
        let scene = builtin::build(name).expect(name);
        let bvh = Bvh::build(&scene.positions, &scene.triangles);
        for camera in &scene.cameras {
            let Projection::Perspective { fov_y_radians } = camera.projection else {
                panic!("{name}: not a perspective camera");
            };
            let (mut hits, mut backs, mut near) = (0, HashMap::<&str, u32>::new(), f32::INFINITY);
            let mut stream = Stream::new(9);
            for _ in 0..20_000 {
                let half = (0.5 * fov_y_radians).tan();
                let (x, y) = (
                    stream.between(-1.0, 1.0) * half * 16.0 / 9.0,
                    stream.between(-1.0, 1.0) * half,
                );
                let direction = camera.world_from_camera.transform_vector3(Vec3::new(x, y, -1.0));
                let origin = Vec3::from(camera.world_from_camera.translation);
                let ray = Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
                let Some(hit) = bvh.closest_hit(&ray, |_| true) else { continue };
                hits += 1;
                near = near.min(hit.t);
                let t = hit.triangle as usize;
                let [a, b, c] = corners(&scene, t);
                let material = &scene.materials[scene.triangle_materials[t] as usize];
                if (b - a).cross(c - a).dot(direction) > 0.0 && !material.double_sided {
                    *backs.entry(material.name.as_str()).or_default() += 1;
                }
            }
            assert!(hits > 10_000, "{name}, {}: {hits} of 20000 rays hit", camera.name);
            assert!(near > 0.25, "{name}, {}: something {near} m before the lens", camera.name);
            assert!(backs.is_empty(), "{name}, {}: backs are seen: {backs:?}", camera.name);
        }
    }
}

#[test]
fn an_unknown_name_gets_the_list() {
    let message = builtin::build("garage").expect_err("no such scene").to_string();
    assert!(message.contains("garage") && message.contains("office"), "{message}");
    assert!(builtin::names().contains(&builtin::DEFAULT_SCENE));
    let message = sky::build("mars", 8, 4).expect_err("no such sky").to_string();
    assert!(message.contains("mars") && message.contains("sunset"), "{message}");
    assert!(sky::build("day", 0, 4).is_err() && sky::build("day", 20_000, 4).is_err());
}

/// Radiance integrated over the sphere, per channel.
fn flux(name: &str, width: u32, height: u32) -> [f64; 3] {
    let image = sky::build(name, width, height).expect(name);
    let mut sum = [0.0; 3];
    for y in 0..height {
        let solid_angle = texel_solid_angle(width, height, y);
        for x in 0..width {
            for (s, c) in sum.iter_mut().zip(image.at(x, y)) {
                assert!(c.is_finite() && c >= 0.0);
                *s += f64::from(c) * solid_angle;
            }
        }
    }
    sum
}

#[test]
fn the_energy_of_a_sky_does_not_depend_on_its_resolution() {
    for name in sky::names() {
        let fine = flux(name, 1024, 512);
        for (width, height) in [(1, 1), (3, 2), (64, 32), (555, 210), (2200, 1100)] {
            let other = flux(name, width, height);
            for k in 0..3 {
                let ratio = other[k] / fine[k];
                assert!((ratio - 1.0).abs() < 0.03, "{name} {width}x{height}: {other:?} {fine:?}");
            }
        }
    }
}

#[test]
fn the_day_sun_is_where_and_as_strong_as_it_should_be() {
    let (width, height) = (1024, 512);
    let image = sky::build("day", width, height).expect("day");
    let (mut sum, mut flux) = (Vec3::ZERO, 0.0);
    for y in 0..height {
        for x in 0..width {
            let green = image.at(x, y)[1];
            if green > 100.0 {
                let d = direction_from_uv(Vec2::new(
                    (x as f32 + 0.5) / width as f32,
                    (y as f32 + 0.5) / height as f32,
                ));
                let weight = green * texel_solid_angle(width, height, y) as f32;
                sum += d * weight;
                flux += weight;
            }
        }
    }
    let (azimuth, elevation) = (22_f32.to_radians(), 38_f32.to_radians());
    let sun = Vec3::new(
        elevation.cos() * azimuth.cos(),
        elevation.sin(),
        elevation.cos() * azimuth.sin(),
    );
    assert!(sum.normalize().dot(sun) > 0.1_f32.to_radians().cos(), "{}", sum.normalize());
    assert!((flux - 3.0).abs() < 0.06, "normal irradiance {flux}");
}

/// Built-in scenes are files, as far as their options go.
#[test]
fn a_material_of_a_built_in_scene_can_be_left_out() {
    let load = |name: &str| {
        let options = SceneOptions { hide: vec![name.to_owned()], ..SceneOptions::default() };
        sources::scene_with("office", &options)
    };
    let all = sources::scene("office").expect("built in").triangles.len();
    let without = load("wall").expect("there are walls").triangles.len();
    assert!(without < all, "{without} of {all} triangles");
    let says = load("cheese").expect_err("there is none").to_string();
    assert!(says.contains("office: no material is called \"cheese\"; there are "), "{says}");
}
