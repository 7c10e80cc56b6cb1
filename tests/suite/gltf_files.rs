//! glTF files: real ones, malformed ones, spoilt ones, and (in `features`) one for each feature; KTX 2 textures.

pub(crate) mod builder;
mod copies;
mod far;
mod features;
mod flush;
mod ktx2;
mod pairs;

use std::path::Path;

use lightgrid::sampler::SplitMix;
use lightgrid::scene::{Projection, TextureSlot, gltf};

use crate::shared::shared;
use builder::{check_consistency, square, textured_material};

/// File, triangles (instances counted), of which without area, materials used, images used.
/// The triangles are those the files' index tells; the others were counted from the JSON.
const FILES: &[(&str, usize, usize, usize, usize)] = &[
    // One of its materials of bodies is on a sheet, too.
    ("data/interiors/country-kitchen.glb", 1_021_815, 219, 84, 11),
    ("data/interiors/home-theater/home-theater.gltf", 7915, 10, 20, 0),
    ("data/interiors/room-anex.glb", 47_402, 0, 16, 15),
    ("data/interiors/white-room-mjp.glb", 132, 4, 1, 0),
    ("data/interiors/zdm2-arena.glb", 58_772, 1134, 2, 0),
    ("data/exteriors/camp/camp.gltf", 6285, 16, 12, 0),
    ("data/exteriors/spaceship.glb", 255_852, 8, 11, 0),
    ("data/objects/01_alpha_mask/01_alpha_mask.gltf", 2, 0, 1, 1),
    ("data/objects/03_skinned_cylinder/03_skinned_cylinder.gltf", 316, 0, 1, 0),
    ("data/objects/13_texture_wrapping/13_texture_wrapping.gltf", 4, 0, 2, 1),
    ("data/objects/24_gpu_instancing/24_gpu_instancing.gltf", 7_656_770, 0, 2, 0),
    ("data/objects/AttenuationTest.glb", 292, 0, 18, 2),
    ("data/objects/ClearCoatTest.glb", 37_116, 0, 19, 6),
    ("data/objects/Fox.glb", 576, 0, 1, 1),
    ("data/objects/NormalTangentTest.glb", 7774, 0, 1, 3),
    ("data/objects/TransmissionRoughnessTest.glb", 77_792, 0, 9, 5),
    ("data/objects/gltf_primitives.glb", 12, 0, 4, 0),
    ("data/objects/morph-stress-test.glb", 2412, 0, 2, 2),
    ("data/objects/simple-instancing.glb", 1500, 0, 1, 0),
    // Some of its primitives have no material, so the default one is there too.
    ("data/objects/usd-shaderball-ball.glb", 63_856, 0, 3, 2),
    ("data/malformed/gltf-assimp/BoxBadNormals-glTF-Binary/BoxBadNormals.glb", 12, 0, 1, 0),
    ("peers/crack.glb", 148, 0, 3, 0),
    ("peers/exterior.glb", 4270, 0, 6, 0),
    ("peers/living.glb", 12_608, 0, 9, 0),
    ("peers/office.glb", 472, 0, 7, 0),
    ("peers/open.glb", 3994, 0, 4, 0),
    ("peers/probe.glb", 65_024, 0, 1, 0),
];

/// Malformed files and what the error must say about them.
const MALFORMED: &[(&str, &str)] = &[
    ("gltf/accessor/unresolved_bufferviews.gltf", "no triangles"),
    // What is not used is not read.
    ("gltf/buffer/not_found.gltf", "no triangles"),
    ("gltf/buffer_view/invalid_length.gltf", "no triangles"),
    ("gltf/glb/chunk_too_big.glb", "13 bytes, too few"),
    ("gltf/glb/empty_file.glb", "the file is empty"),
    ("gltf/glb/invalid_json_chunk.glb", "valid glTF JSON"),
    ("gltf/glb/length_mismatch.glb", "promises 49 bytes and there are 48"),
    ("gltf/glb/truncated_chunk_data.glb", "promises 48 bytes and there are 47"),
    ("gltf/glb/zero_length.glb", "0 bytes, too few"),
    ("gltf/image/invalid_image_data.gltf", "no triangles"),
    ("gltf/mesh_data/index_buffer_oob.gltf", "no triangles"),
    ("gltf/node/node_loop.gltf", "form a loop"),
    ("gltf-assimp/IndexOutOfRange/IndexOutOfRange.gltf", "index 255 is beyond its 24 vertices"),
    ("gltf-assimp/MissingBin/BoxTextured.gltf", "`BoxTextured0.bin`: there is no such file"),
    ("gltf-assimp/RecursiveNodes/RecursiveNodes.gltf", "form a loop"),
];

#[test]
fn real_files_have_all_their_triangles() {
    for &(file, triangles, flat, materials, images) in FILES {
        let Some(path) = shared(file) else { continue };
        let scene = gltf::load(&path).unwrap();
        check_consistency(&scene);
        assert_eq!(scene.shown_triangles() as usize, triangles - flat, "{file}");
        let said = format!("{flat} triangles without area");
        assert_eq!(scene.notices.iter().any(|it| it.starts_with(&said)), flat > 0, "{file}");
        assert_eq!((scene.materials.len(), scene.images.len()), (materials, images), "{file}");
        assert_eq!(scene.name, path.file_name().unwrap().to_str().unwrap());
    }
}

#[test]
fn malformed_files_give_one_sentence_with_name_and_cause() {
    for &(file, cause) in MALFORMED {
        let Some(path) = shared(&format!("data/malformed/{file}")) else { continue };
        let error = gltf::load(&path).unwrap_err().to_string();
        assert!(error.starts_with(&path.display().to_string()), "{error}");
        assert!(error.contains(cause), "{error} does not say: {cause}");
        assert!(!error.contains('\n'), "{error}");
    }
    let error = gltf::load(Path::new("nowhere/absent.glb")).unwrap_err().to_string();
    assert!(error.contains("absent.glb: there is no such file"), "{error}");
}

/// Made tangents agree with those that the file brings (by the tool that made the file).
#[test]
fn made_tangents_agree_with_the_files_own() {
    let Some(path) = shared("data/objects/ClearCoatTest.glb") else { return };
    let bytes = std::fs::read(&path).unwrap();
    let own = gltf::load_slice(&bytes, None, "own").unwrap();
    // An unknown attribute name of the same length takes the tangents away.
    let mut without = bytes.clone();
    for start in 0..without.len() - 9 {
        if &without[start..start + 9] == b"\"TANGENT\"" {
            without[start..start + 9].copy_from_slice(b"\"_ANGENT\"");
        }
    }
    let made = gltf::load_slice(&without, None, "made").unwrap();
    let mut mapped = 0;
    for (index, (own_corners, made_corners)) in
        own.triangles.iter().zip(&made.triangles).enumerate()
    {
        let material = &own.materials[own.triangle_materials[index] as usize];
        if material.has_normal_map() {
            mapped += 1;
            for (&a, &b) in own_corners.iter().zip(made_corners) {
                let (a, b) = (own.tangents[a as usize], made.tangents[b as usize]);
                assert!(a.truncate().dot(b.truncate()) > 0.99 && a.w == b.w, "{a} {b}");
            }
        }
    }
    assert_eq!(mapped, 14_420);
}

#[test]
fn cameras_and_glass_of_the_kitchen() {
    let Some(path) = shared("data/interiors/country-kitchen.glb") else { return };
    let scene = gltf::load(&path).unwrap();
    assert_eq!(scene.cameras.len(), 1);
    let Projection::Perspective { fov_y_radians } = scene.cameras[0].projection else {
        panic!("perspective")
    };
    assert!(fov_y_radians > 0.2 && fov_y_radians < 2.0);
    assert!(scene.materials.iter().any(|material| material.transmission > 0.9));
    assert!(
        scene.materials.iter().any(|material| material.texture(TextureSlot::BaseColor).is_some())
    );
}

#[test]
fn spoilt_files_never_panic() {
    let mut builder = square();
    builder.floats("VEC3", &[0., 0., 1., 0., 0., 1., 0., 0., 1., 0., 0., 1.]);
    builder.floats("VEC2", &[0., 1., 1., 1., 1., 0., 0., 0.]);
    let joints = builder.add(&[0; 16], 5121, "VEC4", 4, "");
    let weights = builder.floats("VEC4", &[0.25; 16]);
    let sound = builder.glb(&format!(
        r#""scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"children":[1,2]}},{{"mesh":0,"skin":0}},
        {{"camera":0,"mesh":0,"weights":[1],"extensions":{{"EXT_mesh_gpu_instancing":{{"attributes":{{"TRANSLATION":2}}}}}}}}],
        "cameras":[{{"type":"perspective","perspective":{{"yfov":0.5,"znear":0.1}}}}],"skins":[{{"joints":[0]}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":2,"TEXCOORD_0":3,"JOINTS_0":{joints},
        "WEIGHTS_0":{weights}}},"indices":1,"material":0,"mode":4,"targets":[{{"POSITION":2}}]}}]}}],{}"#,
        textured_material(r#""normalTexture":{"index":0,"scale":1}"#, "{}")
    ));
    assert_eq!(gltf::load_slice(&sound, None, "sound").unwrap().triangles.len(), 4);
    let binary = sound.windows(4).position(|it| it == b"BIN\0").unwrap();
    // Numbers and binary data: spoiling them keeps the JSON whole and reaches further.
    let values: Vec<usize> =
        (20..sound.len()).filter(|&at| at > binary || sound[at].is_ascii_digit()).collect();
    let mut random = SplitMix(1);
    let mut loaded = 0;
    for round in 0..20_000 {
        let mut spoilt = sound.clone();
        for _ in 0..=round % 4 {
            let choice = random.next_bits() as usize;
            let anywhere = round % 4 == 0;
            let at = if anywhere { choice % spoilt.len() } else { values[choice % values.len()] };
            spoilt[at] = match random.next_bits() {
                bits if at > binary || anywhere => bits as u8,
                bits => b'0' + (bits % 10) as u8,
            };
        }
        if round % 16 == 0 {
            spoilt.truncate(random.next_bits() as usize % spoilt.len());
        }
        match gltf::load_slice(&spoilt, None, "spoilt.glb") {
            Ok(scene) => {
                check_consistency(&scene);
                loaded += 1;
            }
            Err(error) => assert!(error.to_string().starts_with("spoilt.glb: "), "{error}"),
        }
    }
    // Both outcomes are met often, or the test would show little.
    assert!((2000..18_000).contains(&loaded), "{loaded}");
}
