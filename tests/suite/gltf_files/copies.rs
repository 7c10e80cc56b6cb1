//! Copies in the same place: what a doubled import or instances at the origin leave in a file.

use glam::Vec3;
use lightgrid::bvh::Ray;
use lightgrid::path::World;
use lightgrid::scene::Scene;

use super::builder::square;

/// The notice that says so many of something are copies.
fn says(scene: &Scene, copies: &str) -> bool {
    scene
        .notices
        .iter()
        .any(|it| it.starts_with(&format!("{copies} were left out: each is a copy")))
}

/// A square of a material, in scenes that have it once, as two nodes, as two meshes, and twice in one mesh; with
/// what is said of each.
fn squares(material: &str) -> Vec<(Scene, &'static str)> {
    let mut builder = square();
    // As an import reads it again.
    builder.floats("VEC3", &super::builder::SQUARE);
    let plain = r#"{"attributes":{"POSITION":0},"indices":1,"material":0}"#;
    let again = r#"{"attributes":{"POSITION":2},"indices":1,"material":0}"#;
    [
        (format!("[{plain}]"), r#"{"mesh":0}"#, ""),
        (
            format!("[{plain}]"),
            r#"{"mesh":0},{"mesh":0},{"mesh":0,"scale":[1,1,1]}"#,
            "2 instances",
        ),
        (
            format!(r#"[{plain}]}},{{"primitives":[{again}]"#),
            r#"{"mesh":0},{"mesh":1}"#,
            "2 triangles",
        ),
        (format!("[{plain},{again},{plain}]"), r#"{"mesh":0}"#, "4 triangles"),
    ]
    .map(|(primitives, nodes, copies)| {
        let scene = builder.load(&format!(
            r#""nodes":[{nodes}],"meshes":[{{"primitives":{primitives}}}],"materials":[{material}]"#
        ));
        (scene, copies)
    })
    .into()
}

#[test]
fn copies_are_left_out_and_said() {
    for (scene, copies) in squares(r#"{"doubleSided":true}"#) {
        assert_eq!(scene.shown_triangles(), 2, "{copies}");
        assert_eq!(scene.triangle_materials.len(), 2, "{copies}");
        assert!(copies.is_empty() == scene.notices.is_empty(), "{copies}");
        assert!(copies.is_empty() || says(&scene, copies), "{copies}");
    }
}

/// A lamp is sampled as often as it is met, and panes let through what one pane does.
#[test]
fn copies_of_lamps_and_panes_shine_and_darken_once() {
    for (scene, copies) in squares(r#"{"emissiveFactor":[1,1,1]}"#) {
        assert_eq!(World::new(scene).lights.triangle_count(), 2, "{copies}");
    }
    let pane = r#"{"alphaMode":"BLEND","pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.5]}}"#;
    for (scene, copies) in squares(pane) {
        let (origin, direction) = (Vec3::new(0.25, 0.5, 1.0), Vec3::NEG_Z);
        let ray = Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
        assert_eq!(World::new(scene).transmittance(&ray), Vec3::splat(0.5), "{copies}");
    }
}

/// Another place, the other side, another shape of the same mesh. Of another material, and opaque, it is never met.
#[test]
fn what_is_not_alike_stays() {
    let mut builder = square();
    builder.floats("VEC3", &[0.1; 12]);
    let targets = r#""targets":[{"POSITION":2}]"#;
    let scene = builder.load(&format!(
        r#""nodes":[{{"mesh":0}},{{"mesh":0,"translation":[0,0,1e-6]}},{{"mesh":0,"scale":[1,1,-1]}},
        {{"mesh":0,"weights":[1]}},{{"mesh":1}}],"materials":[{{}},{{"name":"other"}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1,"material":0,{targets}}}]}},
        {{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1,"material":1}}]}}]"#
    ));
    assert_eq!(scene.shown_triangles(), 8);
    assert!(says(&scene, "2 triangles"));
}

/// Hundreds of instances, each of a thousand triangles, all in one place: what each ray would test.
#[test]
fn instances_at_the_origin_are_one() {
    let mut builder = square();
    let corners = [0, 1, 2].repeat(1000);
    let indices = builder.indices(&corners);
    let nodes = vec![r#"{"mesh":0}"#; 3000].join(",");
    let scene = builder.load(&format!(
        r#""nodes":[{nodes}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":{indices}}}]}}]"#
    ));
    assert_eq!((scene.shown_triangles(), scene.instances.len()), (1, 0));
    assert!(says(&scene, "2999 instances") && says(&scene, "999 triangles"));
}
