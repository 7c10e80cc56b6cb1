//! Scenes far from the origin, tiny and huge ones: what is rendered is what it is near the origin.

use glam::{DVec3, Vec3};
use lightgrid::scene::{Medium, Projection, PunctualKind, Scene};

use super::builder::{ONE_MESH, square};

/// Squares ten metres wide, a lamp, a camera and fog below a node that places and scales all of it.
fn scene(center: DVec3, scale: f64) -> Scene {
    let [x, y, z] = center.to_array();
    let builder = square();
    builder.load(&format!(
        r#""scene":0,"scenes":[{{"nodes":[0]}}],"extensionsUsed":["KHR_lights_punctual"],
        "extensions":{{"KHR_lights_punctual":{{"lights":[{{"type":"point","intensity":{},"range":{}}}]}}}},
        "cameras":[{{"type":"orthographic","orthographic":{{"xmag":1,"ymag":{},"znear":0,"zfar":1}}}}],
        "nodes":[{{"translation":[{x},{y},{z}],"scale":[{scale},{scale},{scale}],"children":[1,2,3,4,5]}},
        {{"mesh":0,"scale":[10,10,10]}},{{"mesh":0,"translation":[0,0,-3],"rotation":[0,0.6,0,0.8]}},
        {{"translation":[1,2,3],"extensions":{{"KHR_lights_punctual":{{"light":0}}}}}},
        {{"translation":[4,5,6],"rotation":[0.6,0,0,0.8],"camera":0}},
        {{"translation":[5,5,0],"scale":[2,2,2],"extras":{{"fog":{{"scattering":{}}}}}}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1,"material":0}}]}}],
        "materials":[{{"extensions":{{"KHR_materials_transmission":{{"transmissionFactor":1}},
        "KHR_materials_volume":{{"thicknessFactor":1,"attenuationDistance":2,"attenuationColor":[0.5,0.5,0.5]}}}}}}]"#,
        // As bright, as far and as thick as seen from there.
        scale * scale,
        30.0 * scale,
        2.0 * scale,
        0.1 / scale,
    ))
}

/// Numbers of a scene in metres, as they are in its file.
fn lengths(scene: &Scene) -> Vec<f64> {
    let frame = scene.frame;
    let point = |p: Vec3| frame.point_in_file(p).to_array();
    let light = &scene.lights[0];
    assert_eq!(light.kind, PunctualKind::Point);
    let camera = &scene.cameras[0];
    let Projection::Orthographic { half_height } = camera.projection else { panic!("it is not") };
    let fog = scene.medium.expect("there is one");
    let corners = fog.bounds.expect("a box");
    let points = scene
        .positions
        .iter()
        .copied()
        .chain(corners)
        .chain([light.position, camera.world_from_camera.translation.into()]);
    points
        .flat_map(point)
        .chain([light.range, half_height].map(|length| f64::from(frame.length_in_file(length))))
        .collect()
}

#[test]
fn what_is_rendered_lies_where_the_file_says() {
    let near = scene(DVec3::ZERO, 1.0);
    assert!(near.frame.is_identity());
    for (center, scale) in [
        (DVec3::new(512_000.0, 12.0, -5_173_000.0), 1.0),
        (DVec3::new(1e7, 0.0, 1e7), 1.0),
        (DVec3::ZERO, 1e-6),
        (DVec3::new(3.0, 0.0, 0.0), 1e-4),
        (DVec3::new(0.0, 1e9, 0.0), 1e6),
    ] {
        let what = format!("{center} {scale}");
        let scene = scene(center, scale);
        assert!(!scene.frame.is_identity(), "{what}");
        let all = lengths(&scene);
        let points = all.len() - 2;
        for (place, (found, expected)) in all.into_iter().zip(lengths(&near)).enumerate() {
            let origin = if place < points { center[place % 3] } else { 0.0 };
            let found = (found - origin) / scale;
            // The file's own f32 number of the node.
            let rounding = 1e-7 * origin.abs() / scale;
            assert!(
                (found - expected).abs() < 1e-4 + rounding,
                "{what}, {place}: {found} {expected}"
            );
        }
        let size = scene.positions.iter().fold(0.0_f32, |most, p| most.max(p.abs().max_element()));
        assert!((2.0..50.0).contains(&size), "{what}: {size}");
        // As much light arrives, and as much of it is left.
        let lit = |scene: &Scene| {
            let light = &scene.lights[0];
            light.intensity / (light.position - scene.positions[0]).length_squared()
        };
        assert!((lit(&scene) / lit(&near) - 1.0).abs().max_element() < 1e-4, "{what}");
        let depth = |scene: &Scene| {
            let Medium { scattering, bounds, .. } = scene.medium.expect("fog");
            let [low, high] = bounds.expect("a box");
            scattering * (high - low).x
        };
        assert!((depth(&scene) / depth(&near) - 1.0).abs().max_element() < 1e-4, "{what}");
        // The squares are sheets of their thickness.
        let tint = |scene: &Scene| scene.materials.last().expect("a sheet").base_color;
        let expected = tint(&near).powf(scale as f32);
        assert!((tint(&scene) - expected).abs().max_element() < 1e-4, "{what}");
    }
}

/// A frame is found by what a file states of its positions, which may be wrong.
#[test]
fn bounds_that_are_not_those_of_the_positions_change_nothing() {
    for bound in ["3.4e38", "1e9", "1e-9", "0"] {
        let mut builder = square();
        let stated =
            format!(r#","min":[-{bound},-{bound},-{bound}],"max":[{bound},{bound},{bound}]}}"#);
        builder.accessors[0] = builder.accessors[0].replacen('}', &stated, 1);
        let scene = builder.load(ONE_MESH);
        assert!(scene.frame.is_identity(), "{bound}");
        assert_eq!((scene.positions[2], scene.shown_triangles()), (Vec3::new(1.0, 1.0, 0.0), 2));
        // Those of a scene that is far away, too.
        let far = builder.load(
            r#""meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
            "nodes":[{"mesh":0,"translation":[500000,0,0]}]"#,
        );
        let corner = far.frame.point_in_file(far.positions[2]);
        assert!(corner.abs_diff_eq(DVec3::new(500_001.0, 1.0, 0.0), 1e-3), "{bound}: {corner}");
        assert!(!far.frame.is_identity() || bound == "0", "{bound}");
    }
}
