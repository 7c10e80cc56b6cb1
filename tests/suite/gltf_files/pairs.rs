//! Faces in pairs, front and back in one place: each is met from its own front alone.

use glam::Vec3;
use lightgrid::bvh::Ray;
use lightgrid::path::World;

use super::builder::Builder;

/// Corners of a regular hexagon in the xy plane, counter-clockwise seen from +Z.
fn hexagon() -> Builder {
    let mut builder = Builder::default();
    let corner = |i: usize| {
        let (sin, cos) = (std::f32::consts::TAU * i as f32 / 6.0).sin_cos();
        [cos, sin, 0.0]
    };
    builder.floats("VEC3", &(0..6).flat_map(corner).collect::<Vec<_>>());
    builder
}

/// A front of green and a back of red, which is cut along these lines, each with more in its material.
fn pair(front: &[u16], back: &[u16], more: &str) -> World {
    let mut builder = hexagon();
    let [front, back] = [front, back].map(|corners| builder.indices(corners));
    let face = |indices: usize, material: u32| {
        format!(r#"{{"attributes":{{"POSITION":0}},"indices":{indices},"material":{material}}}"#)
    };
    let material = |color: &str| {
        format!(r#"{{"pbrMetallicRoughness":{{"baseColorFactor":[{color},0.5]}}{more}}}"#)
    };
    World::new(builder.load(&format!(
        r#""nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{},{}]}}],"materials":[{},{}]"#,
        face(front, 0),
        face(back, 1),
        material("0,1,0"),
        material("1,0,0"),
    )))
}

fn ray(from: Vec3) -> Ray {
    let target = Vec3::new(0.1, 0.07, 0.0);
    let direction = (target - from).normalize();
    Ray { origin: from, direction, t_min: 0.0, t_max: f32::INFINITY }
}

const ABOVE: Vec3 = Vec3::new(0.2, 0.1, 1.0);
const BELOW: Vec3 = Vec3::new(0.2, 0.1, -1.0);

/// The colour that a ray which is no camera's meets.
fn met(world: &World, from: Vec3) -> Option<Vec3> {
    let ray = ray(from);
    let hit = world.closest_hit(&ray, false)?;
    Some(world.point(&hit, ray.direction).parameters.base_color)
}

const FAN: [u16; 12] = [0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 5];

/// Ways to cut the back: as the front, from the same corner on, from another one, in strips, as two quadrangles.
const BACKS: [[u16; 12]; 4] = [
    [0, 2, 1, 0, 3, 2, 0, 4, 3, 0, 5, 4],
    [3, 2, 1, 3, 1, 0, 3, 0, 5, 3, 5, 4],
    [1, 0, 5, 1, 5, 2, 2, 5, 4, 2, 4, 3],
    [0, 3, 1, 1, 3, 2, 0, 5, 4, 0, 4, 3],
];

#[test]
fn each_face_of_a_pair_is_met_from_its_front() {
    for back in BACKS {
        let world = pair(&FAN, &back, "");
        assert_eq!(met(&world, ABOVE), Some(Vec3::Y), "{back:?}");
        assert_eq!(met(&world, BELOW), Some(Vec3::X), "{back:?}");
        assert_eq!(world.transmittance(&ray(ABOVE)), Vec3::ZERO, "{back:?}");
    }
}

#[test]
fn a_pane_of_two_faces_is_one_pane() {
    for back in BACKS {
        let world = pair(&FAN, &back, r#","alphaMode":"BLEND""#);
        for from in [ABOVE, BELOW] {
            assert_eq!(world.transmittance(&ray(from)), Vec3::splat(0.5), "{back:?}");
        }
    }
}

/// A back that covers a part of the front, a front twice, both sides in one, and solid bodies.
#[test]
fn what_is_no_pair_keeps_its_back() {
    let volume = r#","extensions":{"KHR_materials_transmission":{"transmissionFactor":1},
        "KHR_materials_volume":{"thicknessFactor":1}}"#;
    for (what, world) in [
        ("smaller", pair(&FAN, &[0, 4, 2], "")),
        ("same side", pair(&FAN, &FAN, "")),
        ("double-sided", pair(&FAN, &BACKS[1], r#","doubleSided":true"#)),
        ("solid", pair(&FAN, &BACKS[1], volume)),
    ] {
        assert!(world.scene.materials.iter().all(|material| !material.backed), "{what}");
        assert!(met(&world, BELOW).is_some(), "{what}");
    }
}

/// A material of which a part has a back keeps another part as it is.
#[test]
fn only_paired_faces_are_passed_from_behind() {
    let world = pair(&[0, 1, 2, 3, 4, 5], &[4, 3, 5], "");
    let materials = &world.scene.triangle_materials;
    let backed: Vec<bool> =
        materials.iter().map(|&m| world.scene.materials[m as usize].backed).collect();
    assert_eq!(backed, [false, true, true]);
    assert_eq!(world.scene.materials[materials[1] as usize].base_color.y, 1.0);
}
