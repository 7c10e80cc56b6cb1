//! Tests of what instances share: the same as copies, bit by bit, only smaller.

use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

use glam::{DAffine3, DMat3, DQuat, DVec3, Vec2, Vec3};
use lightgrid::bvh::{Bvh, Hit, Ray, Shared};
use lightgrid::environment::{Environment, EnvironmentOptions, sky};
use lightgrid::path::{PathLimits, World};
use lightgrid::render::{Sampling, Session, Sharing, View};
use lightgrid::sampler::SplitMix;
use lightgrid::scene::needs::is_emitter;
use lightgrid::scene::{Camera, Instance, Instances, Material, Placing, Scene, builtin};

use super::gltf_files::builder::Builder;

/// Maps that turn, scale unevenly, mirror and shear, at places up to `far` metres away.
pub(crate) fn placings(count: usize, far: f64) -> Vec<Placing> {
    let mut random = SplitMix(5);
    let mut between = |low: f64, high: f64| low + (high - low) * random.next_f64();
    let placing = |number: usize| {
        let turn = DQuat::from_axis_angle(
            DVec3::new(between(-1.0, 1.0), 1.0, between(-1.0, 1.0)).normalize(),
            between(0.0, 2.0 * PI),
        );
        let mut size = DVec3::new(between(0.3, 1.5), between(0.3, 1.5), between(0.3, 1.5));
        size *= if number % 3 == 1 { DVec3::new(-1.0, 1.0, 1.0) } else { DVec3::ONE };
        let shear = DMat3::from_cols(DVec3::X, DVec3::new(0.4, 1.0, 0.0), DVec3::Z);
        let place = DVec3::new(between(-far, far), between(-0.2, 0.6), between(-far, far));
        let linear = DMat3::from_quat(turn) * DMat3::from_diagonal(size) * shear;
        Placing::new(DAffine3::from_mat3_translation(linear, place))
    };
    (0..count).map(placing).collect()
}

/// The built-in scene of a name without its lamps, halved into two meshes that are shown in turn, on a
/// floor of its own.
pub(crate) fn many(name: &str, placings: &[Placing]) -> Scene {
    let mut scene = builtin::build(name).expect("built in");
    let first = scene.positions.len() as u32;
    let corners = [(-9.0, -9.0), (-9.0, 9.0), (9.0, 9.0), (9.0, -9.0)];
    scene.positions.extend(corners.map(|(x, z)| Vec3::new(x, -0.4, z)));
    scene.normals.resize(scene.positions.len(), Vec3::Y);
    let mut triangles = vec![[0, 1, 2], [0, 2, 3]].into_iter().map(|t| t.map(|i: u32| first + i));
    let mut own: Vec<[u32; 3]> = triangles.by_ref().collect();
    let mut materials = vec![scene.materials.len() as u32; own.len()];
    for (triangle, &material) in scene.triangles.iter().zip(&scene.triangle_materials) {
        if !is_emitter(&scene.materials[material as usize]) {
            own.push(*triangle);
            materials.push(material);
        }
    }
    scene.materials.push(Material::lambert(0.4));
    for uvs in &mut scene.uvs {
        pad(uvs, scene.positions.len());
    }
    pad(&mut scene.tangents, scene.positions.len());
    pad(&mut scene.colors, scene.positions.len());
    let end = own.len() as u32;
    let half = 2 + (end - 2) / 2;
    let instances = placings.iter().zip((0..2).cycle());
    let instances = instances.map(|(&placing, mesh)| Instance { mesh, placing }).collect();
    Scene {
        triangles: own,
        triangle_materials: materials,
        instances: Instances::new(vec![2..half, half..end], instances),
        ..scene
    }
}

fn pad<T: Clone + Default>(values: &mut Vec<T>, length: usize) {
    if !values.is_empty() {
        values.resize(length, T::default());
    }
}

/// The same with a copy of the triangles, and of all vertices, for each instance.
fn baked(scene: &Scene) -> Scene {
    let vertices = scene.positions.len();
    let mut baked = scene.clone();
    baked.instances = Instances::default();
    let own = scene.instances.meshes()[0].start as usize;
    baked.triangles.truncate(own);
    baked.triangle_materials.truncate(own);
    for instance in scene.instances.iter() {
        let first = baked.positions.len() as u32;
        let placing = instance.placing;
        baked.positions.extend(scene.positions.iter().map(|p| placing.position(*p)));
        baked.normals.extend(scene.normals.iter().map(|n| placing.normal(*n)));
        baked.tangents.extend(scene.tangents.iter().map(|t| placing.tangent(*t)));
        for (uvs, of_mesh) in baked.uvs.iter_mut().zip(&scene.uvs) {
            uvs.extend(of_mesh.iter().take(vertices));
        }
        baked.colors.extend(&scene.colors);
        for place in scene.instances.meshes()[instance.mesh as usize].clone() {
            let place = place as usize;
            let corners = scene.triangles[place].map(|vertex| first + vertex);
            baked.triangles.push(placing.turned(corners));
            baked.triangle_materials.push(scene.triangle_materials[place]);
        }
    }
    baked
}

/// Rays that start near the scene or far away, some along an axis.
fn rays(count: usize) -> impl Iterator<Item = Ray> {
    let mut random = SplitMix(9);
    (0..count).map(move |number| {
        let mut signed = || 2.0 * random.next_f32() - 1.0;
        let mut cube = || Vec3::new(signed(), signed(), signed());
        let (origin, target) =
            (cube() * [3.0, 300.0][number % 2], cube() * Vec3::new(3.0, 1.0, 3.0));
        let direction = if number % 7 == 0 { Vec3::AXES[number % 3] } else { target - origin };
        Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY }
    })
}

/// What a hit is, whatever the number of its triangle.
fn of(hit: Option<Hit>) -> Option<(f32, Vec2)> {
    hit.map(|hit| (hit.t, hit.barycentric))
}

#[test]
fn rays_hit_instances_as_they_hit_copies_bit_by_bit() {
    for (far, count) in [(2.0, 40), (2.0, 1), (2000.0, 40)] {
        let scene = many("materials", &placings(count, far));
        let [shared, copies] = [scene.clone(), baked(&scene)].map(World::new);
        assert_eq!(shared.scene.shown_triangles(), copies.scene.triangles.len() as u64);
        let trees = [shared.bvh.clone(), shared.bvh.clone().into_portable()];
        let (mut hits, mut misses) = (0, 0);
        for ray in rays(20_000) {
            let expected = copies.bvh.closest_hit(&ray, |_| true);
            let mut crossed = Vec::new();
            copies.bvh.any_hit(&ray, |hit| {
                crossed.push((hit.t.to_bits(), hit.barycentric.to_array().map(f32::to_bits)));
                false
            });
            crossed.sort_unstable();
            for tree in &trees {
                let found = tree.closest_hit(&ray, |_| true);
                assert_eq!(of(found), of(expected), "{ray:?}");
                let mut met = Vec::new();
                tree.any_hit(&ray, |hit| {
                    met.push((hit.t.to_bits(), hit.barycentric.to_array().map(f32::to_bits)));
                    false
                });
                met.sort_unstable();
                assert_eq!(met, crossed, "{ray:?}");
            }
            let Some((found, expected)) =
                shared.closest_hit(&ray, false).zip(copies.closest_hit(&ray, false))
            else {
                misses += 1;
                continue;
            };
            hits += 1;
            let [point, same] =
                [shared.point(&found, ray.direction), copies.point(&expected, ray.direction)];
            assert_eq!(
                (point.position, point.geometric_normal, point.shading_frame, point.front_face),
                (same.position, same.geometric_normal, same.shading_frame, same.front_face)
            );
            assert_eq!((point.material, &point.parameters), (same.material, &same.parameters));
            assert_eq!(
                shared.scene.corners(found.triangle),
                copies.scene.corners(expected.triangle)
            );
            assert_eq!(shared.transmittance(&ray), copies.transmittance(&ray));
        }
        assert!(hits > 3000 && misses > 300, "{hits} {misses}");
    }
}

/// Glass, bodies, masks, normal maps and coats; mirrored and sheared.
#[test]
fn pictures_of_instances_are_those_of_copies_bit_by_bit() {
    let map = sky::build("sunset", 64, 32).expect("a sky");
    let map = Environment::new(map, &EnvironmentOptions::default()).expect("sound");
    let camera = Camera::look_at(Vec3::new(0.5, 1.5, 4.0), Vec3::ZERO, 0.9);
    for (name, sharing) in
        [("materials", Sharing::Off), ("living-room", Sharing::Off), ("materials", Sharing::Small)]
    {
        let scene = many(name, &placings(9, 1.5));
        let view = View {
            sampling: Sampling::Plain,
            limits: PathLimits { bounces: 6, russian_roulette: true },
            sharing,
            layers: true,
            ..View::new(camera.clone(), [40, 30])
        };
        let films = [baked(&scene), scene].map(|scene| {
            let world = World::new(scene);
            let mut session = Session::new(&world, &map, view.clone());
            session.advance(4, &AtomicBool::new(false)).expect("the CPU does not fail");
            session.film().clone()
        });
        let differ =
            films[0].pixels().iter().zip(films[1].pixels()).filter(|(a, b)| a != b).count();
        assert_eq!(differ, 0, "{name}, {sharing:?}");
    }
}

/// A hundred thousand copies of a thousand triangles take as much as a few per instance.
#[test]
fn a_tree_of_many_instances_is_small() {
    let mut random = SplitMix(1);
    let mut positions = Vec::new();
    let triangles: Vec<[u32; 3]> = (0..1000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    for _ in 0..3000 {
        let mut signed = || 2.0 * random.next_f32() - 1.0;
        positions.push(Vec3::new(signed(), signed(), signed()));
    }
    let place = |i: u32| DVec3::new(f64::from(i % 316) * 3.0, 0.0, f64::from(i / 316) * 3.0);
    let instances = (0..100_000_u32).map(|i| {
        let placing = Placing::new(DAffine3::from_translation(place(i)));
        Instance { mesh: 0, placing }
    });
    let scene = Scene {
        positions,
        triangles,
        triangle_materials: vec![0; 1000],
        materials: vec![Material::lambert(0.5)],
        instances: Instances::new(std::iter::once(0..1000).collect(), instances.collect()),
        ..Scene::default()
    };
    assert_eq!(scene.shown_triangles(), 100_000_000);
    let one = Bvh::with_instances(&scene.positions, &scene.triangles, Shared::default());
    let world = World::new(scene);
    let bytes = world.bvh.memory_bytes() + world.scene.instances.memory_bytes();
    let per_instance = (bytes - one.memory_bytes()) / 100_000;
    eprintln!("{per_instance} bytes an instance");
    assert!(per_instance < 800, "{per_instance}");
    let mut last = 0;
    for i in [0, 1, 4711, 99_999] {
        let above = place(i).as_vec3() + Vec3::Y * 5.0;
        let ray = Ray { origin: above, direction: Vec3::NEG_Y, t_min: 0.0, t_max: f32::INFINITY };
        let hit = world.closest_hit(&ray, false).expect("there is one below");
        assert!(i == 0 || hit.triangle > last, "instances are numbered in order");
        let here = world.point(&hit, ray.direction).position;
        assert!((here.x - above.x).abs() < 1e-3 && (here.z - above.z).abs() < 1e-3, "{here}");
        last = hit.triangle;
    }
}

/// A grid of triangles and a lamp on it in a file, with so many instances of both.
fn file(instances: usize, places: &[f32], scales: &[f32]) -> Scene {
    let mut builder = Builder::default();
    let corner = |x: u16, y: u16| [f32::from(x), f32::from(y), 0.0];
    let corners = (0..25).flat_map(|y| (0..25).map(move |x| corner(x, y)));
    builder.floats("VEC3", corners.collect::<Vec<_>>().as_flattened());
    let quads = (0..24).flat_map(|y| (0..24).map(move |x| 25 * y + x));
    let indices: Vec<u16> = quads.flat_map(|i| [i, i + 1, i + 26, i, i + 26, i + 25]).collect();
    builder.indices(&indices);
    builder.indices(&[0, 1, 25]);
    let translation = builder.floats("VEC3", places);
    let scale = builder.floats("VEC3", scales);
    assert_eq!(places.len(), 3 * instances);
    builder.load(&format!(
        r#""extensionsUsed":["EXT_mesh_gpu_instancing"],
        "materials":[{{"name":"grid"}},{{"name":"lamp","emissiveFactor":[1,1,1]}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1,"material":0}},
        {{"attributes":{{"POSITION":0}},"indices":2,"material":1}}]}}],
        "nodes":[{{"mesh":0,"translation":[0,0,-5]}},{{"mesh":0,"translation":[0,1,0],"scale":[1,-1,1],"extensions":
        {{"EXT_mesh_gpu_instancing":{{"attributes":{{"TRANSLATION":{translation},"SCALE":{scale}}}}}}}}}]"#
    ))
}

/// All but lamps and what is flattened, of nodes and of the extension, wherever that spares much.
#[test]
fn a_mesh_that_a_file_shows_often_is_held_once() {
    let places: Vec<f32> = (0..1000).flat_map(|i| [30.0 * i as f32, 0.0, 1.0]).collect();
    let mut scales = vec![1.0; 3000];
    scales[5] = 0.0;
    let scene = file(1000, &places, &scales);
    // 1152 triangles of the grid are shared, and baked once where they are flattened, and 1001 lamps.
    assert_eq!((scene.instances.len(), scene.triangles.len()), (1000, 1152 + 1152 + 1001));
    assert_eq!(scene.shown_triangles(), 1001 * 1153);
    let world = World::new(scene);
    assert_eq!(world.lights.triangle_count(), 1001);
    let look = |x: f32, y: f32| {
        let origin = Vec3::new(x, y, 9.0);
        let ray = Ray { origin, direction: Vec3::NEG_Z, t_min: 0.0, t_max: f32::INFINITY };
        let hit = world.closest_hit(&ray, false).expect("a grid is there");
        (hit.t, world.point(&hit, ray.direction).front_face, world.scene.material_of(hit.triangle))
    };
    // The node's own, then two of the extension, which are mirrored and turned around with that.
    assert_eq!(look(12.25, 20.5), (14.0, true, 0));
    assert_eq!(look(30.0 * 500.0 + 12.25, -20.5), (8.0, true, 0));
    assert_eq!(look(30.0 * 999.0 + 0.25, 0.5), (8.0, true, 1));
    let (low, high) = world.bvh.bounds();
    assert!(low.abs_diff_eq(Vec3::new(0.0, -23.0, -5.0), 0.1), "{low}");
    assert!(high.abs_diff_eq(Vec3::new(30.0 * 999.0 + 24.0, 24.0, 1.0), 0.1), "{high}");
    assert!(world.bvh.memory_bytes() < 2_000_000, "{}", world.bvh.memory_bytes());

    // Where that spares less than a million, all are copies.
    let few = file(800, &places[..2400], &scales[..2400]);
    assert!(few.instances.is_empty());
    assert_eq!(few.triangles.len() as u64, few.shown_triangles());
    assert_eq!(few.shown_triangles(), 801 * 1153);
}
