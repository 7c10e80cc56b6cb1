//! glTF files: real ones, malformed ones, and small ones made here for one feature each.

use std::path::Path;

use glam::{Vec2, Vec3, Vec4};
use lightgrid::scene::{AlphaMode, Projection, PunctualKind, Scene, Wrap, gltf};

use crate::shared::shared;

/// File, triangles (instances counted), of which without area, materials used, images used.
/// The triangles are those the files' index tells; the others were counted from the JSON.
const FILES: &[(&str, usize, usize, usize, usize)] = &[
    ("data/interiors/country-kitchen.glb", 1_021_815, 219, 83, 11),
    ("data/interiors/home-theater/home-theater.gltf", 7915, 10, 20, 0),
    ("data/interiors/room-anex.glb", 47_402, 0, 16, 15),
    ("data/interiors/white-room-mjp.glb", 132, 4, 1, 0),
    ("data/interiors/zdm2-arena.glb", 58_772, 1134, 1, 0),
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
    ("gltf/buffer/not_found.gltf", "`not_found.bin` cannot be read"),
    ("gltf/buffer_view/invalid_length.gltf", "no triangles"),
    ("gltf/glb/chunk_too_big.glb", "13 bytes, too few"),
    ("gltf/glb/empty_file.glb", "the file is empty"),
    ("gltf/glb/invalid_json_chunk.glb", "valid glTF JSON"),
    ("gltf/glb/length_mismatch.glb", "promises 49 bytes and there are 48"),
    ("gltf/glb/truncated_chunk_data.glb", "promises 48 bytes and there are 47"),
    ("gltf/glb/zero_length.glb", "0 bytes, too few"),
    ("gltf/image/invalid_image_data.gltf", "no triangles"),
    ("gltf/mesh_data/index_buffer_oob.gltf", "`index_buffer_oob.bin` cannot be read"),
    ("gltf/node/node_loop.gltf", "form a loop"),
    ("gltf-assimp/IndexOutOfRange/IndexOutOfRange.gltf", "index 255 is beyond its 24 vertices"),
    ("gltf-assimp/MissingBin/BoxTextured.gltf", "`BoxTextured0.bin` cannot be read"),
    ("gltf-assimp/RecursiveNodes/RecursiveNodes.gltf", "form a loop"),
];

#[test]
fn real_files_have_all_their_triangles() {
    for &(file, triangles, flat, materials, images) in FILES {
        let Some(path) = shared(file) else { continue };
        let scene = gltf::load(&path).unwrap();
        check_consistency(&scene);
        assert_eq!(scene.triangles.len(), triangles - flat, "{file}");
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
    assert!(error.contains("absent.glb: the file cannot be read"), "{error}");
}

/// What every loaded scene promises to the rest of the program.
fn check_consistency(scene: &Scene) {
    let vertices = scene.positions.len();
    assert!(scene.positions.iter().all(|p| p.is_finite()));
    for length in [
        scene.normals.len(),
        scene.tangents.len(),
        scene.uvs[0].len(),
        scene.uvs[1].len(),
        scene.colors.len(),
    ] {
        assert!(length == 0 || length == vertices);
    }
    assert!(scene.triangles.as_flattened().iter().all(|&v| (v as usize) < vertices));
    assert_eq!(scene.triangles.len(), scene.triangle_materials.len());
    assert!(scene.triangle_materials.iter().all(|&m| (m as usize) < scene.materials.len()));
    assert!(scene.textures.iter().all(|t| (t.image as usize) < scene.images.len()));
    for normal in &scene.normals {
        assert!(*normal == Vec3::ZERO || (normal.length() - 1.0).abs() < 1e-4, "{normal}");
    }
    for tangent in &scene.tangents {
        assert!((tangent.truncate().length() - 1.0).abs() < 1e-4 && tangent.w.abs() == 1.0);
    }
    for material in &scene.materials {
        for reference in [material.base_color_texture, material.normal_texture] {
            assert!(reference.is_none_or(|it| (it.texture as usize) < scene.textures.len()));
        }
    }
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
        if material.normal_texture.or(material.clearcoat_normal_texture).is_some() {
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
    assert!(scene.materials.iter().any(|material| material.base_color_texture.is_some()));
}

/// Little-endian binary data under construction, with accessors into it.
#[derive(Default)]
struct Builder {
    data: Vec<u8>,
    views: Vec<String>,
    accessors: Vec<String>,
}

impl Builder {
    /// Adds an accessor of its own buffer view and returns its number.
    fn add(&mut self, bytes: &[u8], component: u32, kind: &str, count: usize, more: &str) -> usize {
        let view = self.view(bytes);
        self.accessors.push(format!(
            r#"{{"bufferView":{view},"componentType":{component},"type":"{kind}","count":{count}{more}}}"#
        ));
        self.accessors.len() - 1
    }

    fn view(&mut self, bytes: &[u8]) -> usize {
        self.data.resize(self.data.len().next_multiple_of(4), 0);
        let offset = self.data.len();
        self.views
            .push(format!(r#"{{"buffer":0,"byteOffset":{offset},"byteLength":{}}}"#, bytes.len()));
        self.data.extend(bytes);
        self.views.len() - 1
    }

    fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let width = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        self.add(bytemuck::cast_slice(values), 5126, kind, values.len() / width, "")
    }

    fn indices(&mut self, values: &[u16]) -> usize {
        self.add(bytemuck::cast_slice(values), 5123, "SCALAR", values.len(), "")
    }

    /// The JSON of the whole file; `rest` is what comes beside accessors and buffers.
    fn json(&self, rest: &str, buffer_uri: &str) -> String {
        format!(
            r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":{}{buffer_uri}}}],"bufferViews":[{}],"accessors":[{}],{rest}}}"#,
            self.data.len(),
            self.views.join(","),
            self.accessors.join(",")
        )
    }

    fn glb(&self, rest: &str) -> Vec<u8> {
        let mut json = self.json(rest, "").into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut data = self.data.clone();
        data.resize(data.len().next_multiple_of(4), 0);
        let word = |value: usize| (value as u32).to_le_bytes();
        [
            b"glTF",
            &word(2)[..],
            &word(12 + 8 + json.len() + 8 + data.len()),
            &word(json.len()),
            b"JSON",
            &json,
            &word(data.len()),
            b"BIN\0",
            &data,
        ]
        .concat()
    }

    fn load(&self, rest: &str) -> Scene {
        let scene = gltf::load_slice(&self.glb(rest), None, "made.glb").expect("a sound file");
        check_consistency(&scene);
        scene
    }

    fn error(&self, rest: &str) -> String {
        let loaded = gltf::load_slice(&self.glb(rest), None, "made.glb");
        loaded.expect_err("a faulty file").to_string()
    }
}

/// Corners of the unit square in the xy plane, counter-clockwise seen from +Z.
const SQUARE: [f32; 12] = [0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.];

/// A builder whose accessor 0 is the square and accessor 1 its two triangles.
fn square() -> Builder {
    let mut builder = Builder::default();
    builder.floats("VEC3", &SQUARE);
    builder.indices(&[0, 1, 2, 0, 2, 3]);
    builder
}

const ONE_MESH: &str =
    r#""meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"nodes":[{"mesh":0}]"#;

fn geometric_normal(scene: &Scene, triangle: usize) -> Vec3 {
    let [a, b, c] = scene.triangles[triangle].map(|v| scene.positions[v as usize]);
    (b - a).cross(c - a).normalize()
}

#[test]
fn strips_fans_and_lists_give_the_same_square() {
    let mut builder = square();
    let strip = builder.indices(&[0, 1, 3, 2]);
    let fan = builder.indices(&[0, 1, 2, 3]);
    for (mode, indices) in [(4, 1), (5, strip), (6, fan)] {
        let scene = builder.load(&format!(
            r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":{indices},"mode":{mode}}}]}}],"nodes":[{{"mesh":0}}]"#
        ));
        assert_eq!(scene.triangles.len(), 2, "mode {mode}");
        assert!(scene.normals.is_empty());
        for triangle in 0..2 {
            assert_eq!(geometric_normal(&scene, triangle), Vec3::Z, "mode {mode}");
        }
    }
    // Without indices a list takes its vertices three by three: one triangle of four vertices.
    let scene = builder
        .load(r#""meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}]"#);
    assert_eq!((scene.triangles.len(), scene.positions.len()), (1, 3));
}

#[test]
fn points_and_lines_are_skipped_with_one_notice() {
    let scene = square().load(
        r#""meshes":[{"primitives":[{"attributes":{"POSITION":0},"mode":0},
        {"attributes":{"POSITION":0},"mode":1},{"attributes":{"POSITION":0},"mode":2},
        {"attributes":{"POSITION":0},"indices":1}]}],"nodes":[{"mesh":0}]"#,
    );
    let notices: Vec<_> = scene.notices.iter().collect();
    assert_eq!(
        notices,
        ["1 point and 2 line primitives were skipped: only triangles are rendered."]
    );
    let error = square()
        .error(r#""meshes":[{"primitives":[{"attributes":{"POSITION":0},"mode":0}]}],"nodes":[{"mesh":0}]"#);
    assert!(error.contains("no triangles") && error.contains("1 point"), "{error}");
}

#[test]
fn sparse_accessors_replace_elements() {
    let mut builder = square();
    let indices = builder.view(&[2_u8, 3]);
    let values = builder.view(bytemuck::cast_slice(&[5.0_f32, 5., 0., 0., 5., 0.]));
    builder.accessors[0] = format!(
        r#"{{"bufferView":0,"componentType":5126,"type":"VEC3","count":4,"sparse":{{"count":2,
        "indices":{{"bufferView":{indices},"componentType":5121}},"values":{{"bufferView":{values}}}}}}}"#
    );
    let scene = builder.load(ONE_MESH);
    assert_eq!(scene.positions[2], Vec3::new(5.0, 5.0, 0.0));
    assert_eq!(scene.positions[1], Vec3::X);
    // The same without a base: all other elements are zero.
    builder.accessors[0] = builder.accessors[0].replacen(r#""bufferView":0,"#, "", 1);
    let scene = builder.load(ONE_MESH);
    assert_eq!(scene.positions[1], Vec3::ZERO);
    assert_eq!(scene.triangles.len(), 1);
}

#[test]
fn a_mirroring_node_turns_the_winding_and_keeps_normals_outside() {
    let mut builder = square();
    builder.floats("VEC3", &[0., 0., 1., 0., 0., 1., 0., 0., 1., 0., 0., 1.]);
    let scene = builder.load(
        r#""meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":2},"indices":1}]}],
        "nodes":[{"children":[1],"translation":[10,0,0]},{"mesh":0,"scale":[-2,1,1]}]"#,
    );
    assert_eq!(scene.positions[1], Vec3::new(8.0, 0.0, 0.0));
    assert_eq!(geometric_normal(&scene, 0), Vec3::Z);
    assert!(scene.normals.iter().all(|&normal| normal == Vec3::Z));
    // Sheared by non-uniform scale under rotation, a normal stays perpendicular.
    let scene = builder.load(
        r#""meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":2},"indices":1}]}],
        "nodes":[{"children":[1],"scale":[1,1,5]},{"mesh":0,"rotation":[0,0.3826834,0,0.9238795]}]"#,
    );
    assert!(scene.normals[0].dot(geometric_normal(&scene, 0)) > 0.99999);
}

#[test]
fn instances_are_baked() {
    let mut builder = square();
    let translation = builder.floats("VEC3", &[0., 0., 0., 0., 0., 7.]);
    // Quarter turn about Y as normalized bytes: 90/127 is near the half-angle's sine.
    let rotation =
        builder.add(&[0, 0, 0, 127, 0, 90, 0, 90], 5120, "VEC4", 2, r#","normalized":true"#);
    let scale = builder.floats("VEC3", &[1., 1., 1., 2., 2., 2.]);
    let scene = builder.load(&format!(
        r#""extensionsUsed":["EXT_mesh_gpu_instancing"],"extensionsRequired":["EXT_mesh_gpu_instancing"],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
        "nodes":[{{"mesh":0,"translation":[0,1,0],"extensions":{{"EXT_mesh_gpu_instancing":{{"attributes":
        {{"TRANSLATION":{translation},"ROTATION":{rotation},"SCALE":{scale}}}}}}}}}]"#
    ));
    assert_eq!(scene.triangles.len(), 4);
    assert_eq!(scene.positions[1], Vec3::new(1.0, 1.0, 0.0));
    assert!(scene.positions[5].abs_diff_eq(Vec3::new(0.0, 1.0, 5.0), 1e-5));
    assert!(geometric_normal(&scene, 2).abs_diff_eq(Vec3::X, 1e-5));
    assert!(scene.notices.is_empty());
}

#[test]
fn quantized_positions_and_texture_coordinates() {
    let mut builder = Builder::default();
    // Stride is a multiple of four: VEC3 of bytes with one byte of padding.
    let positions = builder.view(&[0, 0, 0, 0, 10, 0, 0, 0, 10, 246, 0, 0]);
    builder.views[positions] = r#"{"buffer":0,"byteLength":12,"byteStride":4}"#.into();
    builder
        .accessors
        .push(r#"{"bufferView":0,"componentType":5120,"type":"VEC3","count":3}"#.into());
    let uvs: [u16; 6] = [0, 0, 65535, 0, 65535, 32768];
    builder.add(bytemuck::cast_slice(&uvs), 5123, "VEC2", 3, r#","normalized":true"#);
    let scene = builder.load(&format!(
        r#""extensionsRequired":["KHR_mesh_quantization"],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1}},"material":0}}]}}],
        "nodes":[{{"mesh":0,"scale":[0.1,0.1,0.1]}}],{}"#,
        textured_material(r#""pbrMetallicRoughness":{"baseColorTexture":{"index":0}}"#, "{}")
    ));
    assert!(scene.positions[2].abs_diff_eq(Vec3::new(1.0, -1.0, 0.0), 1e-6));
    assert!(scene.uvs[0][2].abs_diff_eq(Vec2::new(1.0, 0.5), 1e-4));
}

/// Materials, textures and an image: a PNG of one red pixel as a data URI.
fn textured_material(material: &str, sampler: &str) -> String {
    let png = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4z8AAAAMBAQDJ/pLvAAAAAElFTkSuQmCC";
    format!(
        r#""materials":[{{{material}}}],"textures":[{{"source":0,"sampler":0}}],"samplers":[{sampler}],
        "images":[{{"uri":"data:image/png;base64,{png}"}}]"#
    )
}

#[test]
fn texture_transform_sampler_and_double_use_of_an_image() {
    let mut builder = square();
    builder.floats("VEC2", &[0., 0., 1., 0., 1., 1., 0., 1.]);
    let scene = builder.load(&format!(
        r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_1":2}},"indices":1,"material":0}}]}}],
        "nodes":[{{"mesh":0}}],{}"#,
        textured_material(
            r#""alphaMode":"MASK","alphaCutoff":0.25,"doubleSided":true,
            "pbrMetallicRoughness":{"baseColorFactor":[0.5,1,1,1],"metallicRoughnessTexture":{"index":0,"texCoord":1},
            "baseColorTexture":{"index":0,"extensions":{"KHR_texture_transform":
            {"offset":[0.5,0.25],"rotation":1.57079632679,"scale":[2,4],"texCoord":1}}}}"#,
            r#"{"magFilter":9728,"wrapS":33071,"wrapT":33648}"#
        )
    ));
    let material = &scene.materials[0];
    assert_eq!(material.alpha_mode, AlphaMode::Mask { cutoff: 0.25 });
    assert!(material.double_sided && material.base_color.x == 0.5);
    let reference = material.base_color_texture.unwrap();
    assert_eq!(reference.uv_set, 1);
    // Scaled to (2, 4), turned counter-clockwise with v downwards to (4, -2), then moved.
    let uv = reference.transform.transform_point2(Vec2::ONE);
    assert!(uv.abs_diff_eq(Vec2::new(4.5, -1.75), 1e-5), "{uv}");
    assert_eq!((scene.textures.len(), scene.images.len()), (2, 1));
    let texture = scene.textures[reference.texture as usize];
    assert!(texture.srgb && texture.nearest);
    assert_eq!((texture.wrap_u, texture.wrap_v), (Wrap::ClampToEdge, Wrap::MirroredRepeat));
    let data = material.metallic_roughness_texture.unwrap();
    assert!(!scene.textures[data.texture as usize].srgb);
    assert_eq!(scene.images[0].texels, [[255, 0, 0, 255]]);
    assert_eq!((scene.uvs[0].len(), scene.uvs[1].len()), (0, 4));
}

/// A plane whose picture is upright: u to the right, v downwards, so the bitangent is +Y.
#[test]
fn mikktspace_tangents_follow_gltf_and_split_mirrored_vertices() {
    let mut builder = square();
    builder.floats("VEC3", &[0., 0., 1., 0., 0., 1., 0., 0., 1., 0., 0., 1.]);
    builder.floats("VEC2", &[0., 1., 1., 1., 1., 0., 0., 0.]);
    let rest = format!(
        r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":2,"TEXCOORD_0":3}},"indices":1,"material":0}}]}}],
        "nodes":[{{"mesh":0}}],{}"#,
        textured_material(r#""normalTexture":{"index":0,"scale":0.5}"#, "{}")
    );
    let scene = builder.load(&rest);
    assert_eq!(scene.materials[0].normal_scale, 0.5);
    assert_eq!(scene.tangents, vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 4]);
    // Mirrored along the diagonal the two triangles cannot share tangents.
    let mut mirrored = square();
    mirrored.floats("VEC3", &[0., 0., 1., 0., 0., 1., 0., 0., 1., 0., 0., 1.]);
    mirrored.floats("VEC2", &[0., 0., 1., 0., 1., 1., 1., 0.]);
    let scene = mirrored.load(&rest);
    assert_eq!(scene.positions.len(), 6);
    let handedness = |triangle: [u32; 3]| triangle.map(|v| scene.tangents[v as usize].w);
    assert_eq!(handedness(scene.triangles[0]), [-1.0; 3]);
    assert_eq!(handedness(scene.triangles[1]), [1.0; 3]);
}

#[test]
fn a_skin_at_rest_follows_its_joints() {
    let mut builder = square();
    let joints =
        builder.add(&[0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0], 5121, "VEC4", 4, "");
    let one = [1.0, 0.0, 0.0, 0.0];
    let weights = builder.floats("VEC4", &[one, one, one, [0.5, 0.0, 0.0, 0.0]].concat());
    let mut matrices = [0.0; 32];
    for diagonal in 0..8 {
        matrices[diagonal / 4 * 16 + diagonal % 4 * 5] = 1.0;
    }
    // The second joint was bound one metre up.
    matrices[16 + 13] = -1.0;
    let bind = builder.floats("MAT4", &matrices);
    let scene = builder.load(&format!(
        r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"JOINTS_0":{joints},"WEIGHTS_0":{weights}}},"indices":1}}]}}],
        "skins":[{{"joints":[1,2],"inverseBindMatrices":{bind}}}],
        "nodes":[{{"mesh":0,"skin":0,"translation":[100,0,0]}},{{"children":[2]}},{{"translation":[0,3,0]}}],
        "scenes":[{{"nodes":[0,1]}}]"#
    ));
    // The node's own transform has no effect; joint 1 lifts its vertices by 3 - 1.
    assert_eq!(
        scene.positions,
        [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 3.0, 0.0), Vec3::new(0.0, 3.0, 0.0)]
    );
    let error = builder.error(&format!(
        r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"JOINTS_0":{joints},"WEIGHTS_0":{weights}}},"indices":1}}]}}],
        "skins":[{{"joints":[1]}}],"nodes":[{{"mesh":0,"skin":0}},{{}}]"#
    ));
    assert!(error.contains("joint 1 is used, but its skin has 1"), "{error}");
}

#[test]
fn morph_weights_of_the_node_go_before_those_of_the_mesh() {
    let mut builder = square();
    let shift = builder.floats("VEC3", &[0., 0., 1., 0., 0., 1., 0., 0., 1., 0., 0., 1.]);
    let rest = |weights: &str| {
        format!(
            r#""meshes":[{{"weights":[0.5],"primitives":[{{"attributes":{{"POSITION":0}},"indices":1,
            "targets":[{{"POSITION":{shift}}}]}}]}}],"nodes":[{{"mesh":0{weights}}}]"#
        )
    };
    assert_eq!(builder.load(&rest("")).positions[0].z, 0.5);
    assert_eq!(builder.load(&rest(r#","weights":[2]"#)).positions[0].z, 2.0);
}

#[test]
fn extensions_required_used_and_honoured() {
    let error = square().error(&format!(
        r#""extensionsRequired":["KHR_draco_mesh_compression","KHR_texture_transform"],{ONE_MESH}"#
    ));
    assert_eq!(
        error,
        "made.glb: it requires the extension KHR_draco_mesh_compression, not supported here"
    );
    let scene = square().load(&format!(
        r#""extensionsUsed":["KHR_materials_sheen","KHR_materials_ior"],{ONE_MESH}"#
    ));
    let notices: Vec<_> = scene.notices.iter().collect();
    assert_eq!(
        notices,
        ["The extension KHR_materials_sheen is not supported; what it adds is left out."]
    );
}

#[test]
fn material_extensions() {
    let scene = square().load(
        r#""meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":1}]}],"nodes":[{"mesh":0}],
        "materials":[{"name":"unused"},{"name":"all","emissiveFactor":[1,0.5,0],"extensions":{
        "KHR_materials_emissive_strength":{"emissiveStrength":10},"KHR_materials_ior":{"ior":1.33},
        "KHR_materials_specular":{"specularFactor":0.5,"specularColorFactor":[1,2,3]},
        "KHR_materials_transmission":{"transmissionFactor":0.75},
        "KHR_materials_volume":{"thicknessFactor":0.1,"attenuationDistance":2,"attenuationColor":[0.1,0.2,0.3]},
        "KHR_materials_clearcoat":{"clearcoatFactor":1,"clearcoatRoughnessFactor":7},"KHR_materials_unlit":{}}}]"#,
    );
    assert_eq!(scene.materials.len(), 1);
    let material = &scene.materials[0];
    assert_eq!(material.name, "all");
    assert_eq!(material.emissive, Vec3::new(10.0, 5.0, 0.0));
    assert_eq!((material.ior, material.specular), (1.33, 0.5));
    assert_eq!(material.specular_color, Vec3::new(1.0, 2.0, 3.0));
    assert_eq!((material.transmission, material.thickness), (0.75, 0.1));
    assert_eq!(material.attenuation_distance, 2.0);
    assert_eq!(material.attenuation_color, Vec3::new(0.1, 0.2, 0.3));
    assert_eq!((material.clearcoat, material.clearcoat_roughness), (1.0, 1.0));
    assert!(material.unlit);
    assert_eq!(
        scene.notices.iter().collect::<Vec<_>>(),
        ["Material all has factors outside their range, which are clamped."]
    );
}

#[test]
fn specular_glossiness_is_converted() {
    let scene = square().load(
        r#""meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],"nodes":[{"mesh":0}],
        "materials":[{"extensions":{"KHR_materials_pbrSpecularGlossiness":
        {"diffuseFactor":[0.1,0.2,0.3,1],"specularFactor":[0.4,0.5,0.6],"glossinessFactor":0.75}}}]"#,
    );
    let material = &scene.materials[0];
    assert_eq!(material.base_color, Vec4::new(0.1, 0.2, 0.3, 1.0));
    assert_eq!((material.metallic, material.roughness, material.ior), (0.0, 0.25, 0.0));
    assert_eq!(material.specular_color, Vec3::new(0.4, 0.5, 0.6));
}

#[test]
fn cameras_and_lights() {
    let scene = square().load(
        r#""extensionsUsed":["KHR_lights_punctual"],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
        "cameras":[{"type":"orthographic","orthographic":{"xmag":2,"ymag":1,"znear":0,"zfar":9}},
        {"type":"perspective","name":"Main","perspective":{"yfov":0.5,"znear":0.1}}],
        "extensions":{"KHR_lights_punctual":{"lights":[{"type":"directional","color":[1,0.5,0],"intensity":4},
        {"type":"spot","name":"Lamp","range":3,"spot":{"outerConeAngle":0.5}}]}},
        "nodes":[{"mesh":0},{"camera":1,"translation":[0,0,5]},{"camera":0,"name":"Plan"},
        {"extensions":{"KHR_lights_punctual":{"light":0}},"rotation":[-0.70710678,0,0,0.70710678]},
        {"extensions":{"KHR_lights_punctual":{"light":1}},"translation":[1,2,3]}]"#,
    );
    let [plan, main] = &scene.cameras[..] else { panic!("two cameras") };
    assert_eq!((plan.name.as_str(), plan.aspect), ("Plan", Some(2.0)));
    assert_eq!(plan.projection, Projection::Orthographic { half_height: 1.0 });
    assert_eq!((main.name.as_str(), main.aspect), ("Main", None));
    assert_eq!(main.projection, Projection::Perspective { fov_y_radians: 0.5 });
    assert_eq!(Vec3::from(main.world_from_camera.translation), Vec3::new(0.0, 0.0, 5.0));
    let [sun, lamp] = &scene.lights[..] else { panic!("two lights") };
    assert_eq!((sun.kind, sun.intensity), (PunctualKind::Directional, Vec3::new(4.0, 2.0, 0.0)));
    assert!(sun.direction.abs_diff_eq(Vec3::NEG_Y, 1e-6));
    assert_eq!((lamp.name.as_str(), lamp.range), ("Lamp", 3.0));
    assert_eq!(lamp.kind, PunctualKind::Spot { inner_radians: 0.0, outer_radians: 0.5 });
    assert_eq!(lamp.position, Vec3::new(1.0, 2.0, 3.0));
}

#[test]
fn external_files_data_uris_and_missing_images() {
    let builder = square();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("the data.bin"), &builder.data).unwrap();
    let path = folder.path().join("scene.gltf");
    let rest = format!(
        r#"{ONE_MESH},"materials":[{{"name":"M","pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],
        "textures":[{{"source":0}}],"images":[{{"uri":"gone.png"}}]"#
    )
    .replace(r#""indices":1"#, r#""indices":1,"material":0"#);
    std::fs::write(&path, builder.json(&rest, r#","uri":"the%20data.bin""#)).unwrap();
    let scene = gltf::load(&path).unwrap();
    assert_eq!((scene.triangles.len(), scene.name.as_str()), (2, "scene.gltf"));
    // The missing picture is named, and its material falls back to its factors.
    assert!(scene.materials[0].base_color_texture.is_none());
    let notice = scene.notices.iter().next().unwrap();
    assert!(notice.contains("`gone.png` cannot be read"), "{notice}");
    // Damaged pictures and WebP ones.
    let pictures = |source: &str, uri: &str| {
        let rest = rest.replace(r#""source":0"#, source).replace("gone.png", uri);
        builder.load(&rest)
    };
    let scene = pictures(r#""source":0"#, "data:image/png;base64,AAAA");
    let notice = scene.notices.iter().next().unwrap();
    assert!(
        notice.starts_with("Image 0 (data URI)") && notice.contains("not a picture"),
        "{notice}"
    );
    let scene = pictures(
        r#""extensions":{"EXT_texture_webp":{"source":0}}"#,
        "data:image/webp;base64,UklGRhoAAABXRUJQVlA4TA0AAAAvAAAAEAcQERGIiP4HAA==",
    );
    assert!(scene.notices.is_empty());
    assert_eq!((scene.images.len(), scene.images[0].width), (1, 1));
    let escaped: String = builder.data.iter().map(|byte| format!("%{byte:02X}")).collect();
    let uri = format!(r#","uri":"data:application/octet-stream,{escaped}""#);
    let text = builder.json(ONE_MESH, &uri);
    let scene = gltf::load_slice(text.as_bytes(), None, "text.gltf").unwrap();
    assert_eq!(scene.triangles.len(), 2);
}

#[test]
fn huge_claims_are_refused_before_memory_is_taken() {
    let mut builder = square();
    builder.accessors[0] = builder.accessors[0].replace(r#""count":4"#, r#""count":4000000000000"#);
    assert!(builder.error(ONE_MESH).contains("more than buffer view 0 holds"));
    builder.accessors[0] = r#"{"componentType":5126,"type":"VEC3","count":4000000000}"#.into();
    assert!(builder.error(ONE_MESH).contains("without any data"));
    // A chain of nodes as deep as it is long must not be walked by recursion.
    let chain: Vec<String> =
        (1..100_000).map(|child| format!(r#"{{"children":[{child}]}}"#)).collect();
    let rest = ONE_MESH.replace(r#""nodes":[{"mesh":0}]"#, "");
    let scene = square().load(&format!(r#"{rest}"nodes":[{},{{"mesh":0}}]"#, chain.join(",")));
    assert_eq!(scene.triangles.len(), 2);
    // Ten thousand nodes show one instanced mesh ten thousand times each... of too many triangles.
    let mut builder = square();
    let translation = builder.floats("VEC3", &[0.0; 30_000]);
    let node = format!(
        r#"{{"mesh":0,"extensions":{{"EXT_mesh_gpu_instancing":{{"attributes":{{"TRANSLATION":{translation}}}}}}}}}"#
    );
    let large = builder.indices(&[0, 1, 2].repeat(30_000));
    let mesh = ONE_MESH.replace(r#""indices":1"#, &format!(r#""indices":{large}"#));
    let error = builder.error(&mesh.replace(r#"{"mesh":0}"#, &node));
    assert!(error.contains("more than 200 million triangles"), "{error}");
}

/// SplitMix64 (Steele et al. 2014): enough to choose bytes to spoil.
fn next_random(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (*state ^ (*state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
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
    assert_eq!(gltf::load_slice(&sound, None, "sound").unwrap().triangles.len(), 10);
    let binary = sound.windows(4).position(|it| it == b"BIN\0").unwrap();
    // Numbers and binary data: spoiling them keeps the JSON whole and reaches further.
    let values: Vec<usize> =
        (20..sound.len()).filter(|&at| at > binary || sound[at].is_ascii_digit()).collect();
    let mut random = 1;
    let mut loaded = 0;
    for round in 0..20_000 {
        let mut spoilt = sound.clone();
        for _ in 0..=round % 4 {
            let choice = next_random(&mut random) as usize;
            let anywhere = round % 4 == 0;
            let at = if anywhere { choice % spoilt.len() } else { values[choice % values.len()] };
            spoilt[at] = match next_random(&mut random) {
                bits if at > binary || anywhere => bits as u8,
                bits => b'0' + (bits % 10) as u8,
            };
        }
        if round % 16 == 0 {
            spoilt.truncate(next_random(&mut random) as usize % spoilt.len());
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
