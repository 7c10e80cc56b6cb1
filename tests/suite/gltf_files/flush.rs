//! Decals and glass that lie exactly on what is opaque look as they do a millimetre off it.

use glam::Vec3;
use lightgrid::environment::Environment;
use lightgrid::image::Image;
use lightgrid::path::World;
use lightgrid::render::film::Film;
use lightgrid::render::{Sampling, View};
use lightgrid::scene::Camera;

use super::builder::square;
use crate::estimator::{mean, render, view};
use crate::z_test::expect_same_pixels;

/// A wall, and on it a blended decal, a pane of thin glass and a body of glass, all of them so far off it.
fn scene(gap: f32, decal_is_first: bool) -> World {
    let mut builder = square();
    builder.floats("VEC3", &[0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.]);
    builder.indices(&[0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]);
    let mesh = |[positions, indices, material]: [u32; 3]| {
        format!(
            r#"{{"primitives":[{{"attributes":{{"POSITION":{positions}}},"indices":{indices},"material":{material}}}]}}"#
        )
    };
    let wall = mesh([0, 1, 0]);
    let others = [[0, 1, 1], [0, 1, 2], [2, 3, 3]].map(mesh).join(",");
    let (meshes, shift) = if decal_is_first {
        (format!("{others},{wall}"), 0)
    } else {
        (format!("{wall},{others}"), 1)
    };
    World::new(builder.load(&format!(
        r#""meshes":[{meshes}],"nodes":[
        {{"mesh":{},"scale":[4,4,4],"translation":[-2,-2,0]}},
        {{"mesh":{},"translation":[-1.2,-0.2,{gap}]}},
        {{"mesh":{},"scale":[0.5,0.5,1],"translation":[0.1,0.7,{gap}]}},
        {{"mesh":{},"translation":[0.2,-0.5,{gap}]}}],
        "materials":[{{"pbrMetallicRoughness":{{"baseColorFactor":[0.3,0.5,0.7,1],"metallicFactor":0}}}},
        {{"alphaMode":"BLEND","pbrMetallicRoughness":{{"baseColorFactor":[1,0,0,0.4],"metallicFactor":0}}}},
        {{"pbrMetallicRoughness":{{"baseColorFactor":[0.9,1,0.8,1],"metallicFactor":0,"roughnessFactor":0}},
        "extensions":{{"KHR_materials_transmission":{{"transmissionFactor":1}}}}}},
        {{"pbrMetallicRoughness":{{"metallicFactor":0,"roughnessFactor":0}},
        "extensions":{{"KHR_materials_transmission":{{"transmissionFactor":1}},
        "KHR_materials_volume":{{"thicknessFactor":1}}}}}}]"#,
        if decal_is_first { 3 } else { 0 },
        shift,
        shift + 1,
        shift + 2,
    )))
}

fn picture(gap: f32, decal_is_first: bool, seed: u32) -> Film {
    let environment = Environment::new(Image::filled(16, 8, [1.0; 3]), &Default::default());
    let camera = Camera::look_at(Vec3::new(0.3, -2.0, 2.4), Vec3::new(0.0, 0.1, 0.0), 0.7);
    let view = View { width: 32, height: 24, seed, ..view(camera, Sampling::Plain, 4) };
    render(&scene(gap, decal_is_first), &environment.expect("a sound map"), view, 256)
}

#[test]
fn what_lies_on_a_wall_looks_as_a_millimetre_off_it() {
    let apart = picture(1e-3, false, 1);
    for (seed, gap, decal_is_first) in [(2, 0.0, false), (3, 0.0, true), (4, 1e-5, false)] {
        let what = format!("{gap} m, decal first: {decal_is_first}");
        let flush = picture(gap, decal_is_first, seed);
        let [found, expected] = [&flush, &apart].map(mean);
        let noise = 4.0 * found.standard_error.hypot(expected.standard_error);
        eprintln!("{what}: {} for {}, noise {noise}", found.luminance, expected.luminance);
        assert!(noise < 0.01 * expected.luminance, "{what}: too noisy to tell");
        assert!((found.luminance - expected.luminance).abs() < noise, "{what}");
        expect_same_pixels(&what, &flush, &apart, 1e-3);
    }
}
