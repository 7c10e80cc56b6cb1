//! Tests of builtin.

use std::collections::HashMap;
use std::time::Instant;

use glam::{Vec2, Vec3};
use lightgrid::environment::sky;
use lightgrid::math::{direction_from_uv, texel_solid_angle};
use lightgrid::noise::Stream;
use lightgrid::scene::{Scene, builtin};

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
            if let Some(texture) = material.base_color_texture {
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

/// Separating-axis test of two triangles in one plane, each shrunk so that shared edges do not count.
fn overlap(a: [Vec2; 3], b: [Vec2; 3]) -> bool {
    let separated = |p: [Vec2; 3], q: [Vec2; 3]| {
        (0..3).any(|i| {
            let edge = p[(i + 1) % 3] - p[i];
            let normal = edge.perp().normalize_or_zero();
            let range = |t: [Vec2; 3]| {
                let d = t.map(|x| x.dot(normal));
                (d[0].min(d[1]).min(d[2]), d[0].max(d[1]).max(d[2]))
            };
            let ((p0, p1), (q0, q1)) = (range(p), range(q));
            p1 < q0 + 1e-3 || q1 < p0 + 1e-3
        })
    };
    !separated(a, b) && !separated(b, a)
}

#[test]
fn no_faces_that_look_the_same_way_lie_in_one_plane() {
    for name in builtin::names() {
        let scene = builtin::build(name).expect(name);
        let mut planes: HashMap<[i32; 4], Vec<usize>> = HashMap::new();
        for t in 0..scene.triangles.len() {
            let [a, b, c] = corners(&scene, t);
            let cross = (b - a).cross(c - a);
            if cross.length() < 2e-4 {
                continue;
            }
            let n = cross.normalize();
            let key = [n.x * 500.0, n.y * 500.0, n.z * 500.0, n.dot(a) * 4000.0]
                .map(|x| x.round() as i32);
            planes.entry(key).or_default().push(t);
        }
        let mut clashes: HashMap<[&str; 2], (usize, [Vec3; 3])> = HashMap::new();
        for group in planes.values().filter(|g| g.len() > 1) {
            let [a, b, c] = corners(&scene, group[0]);
            let n = (b - a).cross(c - a).normalize();
            let (x, y) = n.any_orthonormal_pair();
            let mut flat: Vec<(usize, [Vec2; 3])> = group
                .iter()
                .map(|&t| (t, corners(&scene, t).map(|p| Vec2::new(p.dot(x), p.dot(y)))))
                .collect();
            let left = |t: &[Vec2; 3]| t[0].x.min(t[1].x).min(t[2].x);
            let right = |t: &[Vec2; 3]| t[0].x.max(t[1].x).max(t[2].x);
            flat.sort_by(|a, b| left(&a.1).total_cmp(&left(&b.1)));
            for (i, (t, here)) in flat.iter().enumerate() {
                for (other, there) in flat[i + 1..].iter().take_while(|f| left(&f.1) < right(here))
                {
                    if overlap(*here, *there) {
                        let material = |t: usize| {
                            scene.materials[scene.triangle_materials[t] as usize].name.as_str()
                        };
                        let key = [material(*t), material(*other)];
                        let entry = clashes.entry(key).or_insert((0, corners(&scene, *t)));
                        entry.0 += 1;
                    }
                }
            }
        }
        assert!(clashes.is_empty(), "{name}: coplanar overlaps: {clashes:?}");
    }
}

/// Distance along the ray to the nearest triangle (Moeller and Trumbore).
fn nearest(triangles: &[[Vec3; 3]], origin: Vec3, direction: Vec3) -> Option<f32> {
    let mut best: Option<f32> = None;
    for &[a, b, c] in triangles {
        let (e1, e2) = (b - a, c - a);
        let p = direction.cross(e2);
        let inverse = e1.dot(p).recip();
        let s = origin - a;
        let u = s.dot(p) * inverse;
        let q = s.cross(e1);
        let v = direction.dot(q) * inverse;
        let t = e2.dot(q) * inverse;
        if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 1e-4 && best.is_none_or(|b| t < b) {
            best = Some(t);
        }
    }
    best
}

/// Rays from inside a room may leave only through its openings; checks it against the scene's large
/// triangles (shell) and gives the share that leaves.
fn escaping(name: &str, size: [f32; 3], rays: u32, through: impl Fn(Vec3) -> bool) -> f32 {
    let scene = builtin::build(name).expect(name);
    let triangles: Vec<[Vec3; 3]> = (0..scene.triangles.len())
        .map(|t| corners(&scene, t))
        .filter(|[a, b, c]| (*b - *a).cross(*c - *a).length() > 2e-3)
        .collect();
    let mut stream = Stream::new(5);
    let mut left = 0;
    for _ in 0..rays {
        let origin = Vec3::new(
            stream.between(-0.45, 0.45) * size[0],
            stream.between(0.3, 0.95) * size[1],
            stream.between(-0.45, 0.45) * size[2],
        );
        let y = stream.between(-1.0, 1.0);
        let (s, c) = stream.between(0.0, std::f32::consts::TAU).sin_cos();
        let ring = (1.0 - y * y).sqrt();
        let direction = Vec3::new(ring * c, y, ring * s);
        if nearest(&triangles, origin, direction).is_none() {
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
    let office = escaping("office", [6.0, 3.0, 4.0], 4000, |p| {
        p.x < -2.99 && within(p.y, 1.1, 2.2) && within(p.z.abs(), 0.4, 1.6)
    });
    let living = escaping("living-room", [6.0, 3.0, 5.0], 4000, |p| {
        let window = p.x > 2.99 && within(p.y, 0.49, 2.31) && p.z.abs() < 1.31;
        window || (p.z > 2.49 && Vec2::new(p.x + 1.4, p.y - 1.9).length() < 0.46)
    });
    let crack = escaping("crack", [4.0, 2.5, 3.0], 4000, |p| {
        p.x < -1.99 && within(p.y, 1.59, 1.63) && p.z.abs() < 0.76
    });
    eprintln!("escaping: office {office}, living-room {living}, crack {crack}");
    assert!(within(office, 0.004, 0.04) && within(living, 0.02, 0.12) && crack < 0.002);
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
