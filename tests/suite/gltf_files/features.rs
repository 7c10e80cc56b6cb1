//! One small file made here for each feature of the format.

use glam::{Vec2, Vec3, Vec4};
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder as _};
use lightgrid::scene::needs::{SceneFeatures, SceneNeeds};
use lightgrid::scene::texture::sample_texture;
use lightgrid::scene::{
    AlphaMode, Medium, Projection, PunctualKind, Scene, TextureSlot, Wrap, gltf,
};

use super::builder::{Builder, ONE_MESH, SQUARE, solid, square, textured_material};

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
        ["1 point and 2 line primitives were skipped: only triangles are rendered"]
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

/// assimp writes the third coordinate of volume textures, and others attributes without elements.
#[test]
fn third_coordinates_and_short_attributes_are_left_out() {
    let with = |kind: &str, values: &[f32], name: &str| {
        let mut builder = square();
        let accessor = builder.floats(kind, values);
        let attribute = format!(r#""POSITION":0,"{name}":{accessor}"#);
        let mesh = ONE_MESH.replace(r#""POSITION":0"#, &attribute);
        let mesh = mesh.replace(r#""indices":1"#, r#""indices":1,"material":0"#);
        let painted = r#""pbrMetallicRoughness":{"baseColorTexture":{"index":0}}"#;
        builder.load(&format!("{},{mesh}", textured_material(painted, "{}")))
    };
    let volume = with("VEC3", &[0., 0., 9., 1., 0., 9., 1., 1., 9., 0., 1., 9.], "TEXCOORD_0");
    let plain = with("VEC2", &[0., 0., 1., 0., 1., 1., 0., 1.], "TEXCOORD_0");
    assert_eq!(volume.uvs, plain.uvs);
    assert_eq!(volume.uvs[0].len(), 4);

    for (kind, values, name) in [
        ("VEC3", &[0.0_f32, 0., 1.][..], "NORMAL"),
        ("VEC4", &[1., 0., 0., 1.], "TANGENT"),
        ("VEC2", &[0.5, 0.5], "TEXCOORD_0"),
        ("VEC4", &[1., 0., 0., 1.], "COLOR_0"),
    ] {
        let scene = with(kind, values, name);
        assert_eq!(scene.triangles.len(), 2);
        let said = scene.notices.iter().any(|notice| notice.contains("too few elements"));
        assert!(said, "{name}: {:?}", scene.notices);
        assert!(scene.normals.is_empty() || scene.normals.iter().all(|n| *n == Vec3::ZERO));
    }
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
    let reference = material.texture(TextureSlot::BaseColor).unwrap();
    assert_eq!(reference.uv_set, 1);
    // Scaled to (2, 4), turned counter-clockwise with v downwards to (4, -2), then moved.
    let uv = reference.transform.transform_point2(Vec2::ONE);
    assert!(uv.abs_diff_eq(Vec2::new(4.5, -1.75), 1e-5), "{uv}");
    assert_eq!((scene.textures.len(), scene.images.len()), (2, 1));
    let texture = scene.textures[reference.texture as usize];
    assert!(texture.srgb && texture.nearest);
    assert_eq!((texture.wrap_u, texture.wrap_v), (Wrap::ClampToEdge, Wrap::MirroredRepeat));
    let data = material.texture(TextureSlot::MetallicRoughness).unwrap();
    assert!(!scene.textures[data.texture as usize].srgb);
    assert_eq!(scene.images[0].texels.rgba()[..], [[255, 0, 0, 255]]);
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

/// Thirty thousand triangles on the same corners would keep MikkTSpace busy for a minute.
#[test]
fn crowded_triangles_get_tangents_of_their_own() {
    let mut builder = Builder::default();
    builder.floats("VEC3", &SQUARE);
    builder.indices(&[0, 1, 2, 0, 2, 3].repeat(15_000));
    builder.floats("VEC3", &[0., 0., 1., 0., 0., 1., 0., 0., 1., 0., 0., 1.]);
    builder.floats("VEC2", &[0., 1., 1., 1., 1., 0., 0., 0.]);
    let scene = builder.load(&format!(
        r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":2,"TEXCOORD_0":3}},"indices":1,"material":0}}]}}],
        "nodes":[{{"mesh":0}}],{}"#,
        textured_material(r#""normalTexture":{"index":0}"#, "{}")
    ));
    assert_eq!(scene.triangles.len(), 2);
    assert_eq!(scene.tangents, vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 4]);
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

/// Texture coordinates and colours are morphed like positions; colours stay within 0 to 1.
#[test]
fn morph_targets_move_texture_coordinates_and_colours() {
    let mut builder = square();
    let uvs = builder.floats("VEC2", &[0., 0., 1., 0., 1., 1., 0., 1.]);
    let uv_shift = builder.floats("VEC2", &[0.5; 8]);
    let colors = builder.floats("VEC4", &[0.5, 0.5, 0.5, 1.0].repeat(4));
    let color_shift = builder.floats("VEC3", &[0.25, 1.0, -0.5].repeat(4));
    let infinite = builder.floats("VEC2", &[f32::INFINITY; 8]);
    let scene = |shift: usize, weights: &str| {
        let material = textured_material(
            r#""pbrMetallicRoughness":{"baseColorTexture":{"index":0,"texCoord":1}}"#,
            "{}",
        );
        builder.load(&format!(
            r#""meshes":[{{"weights":{weights},"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_1":{uvs},
            "COLOR_0":{colors}}},"indices":1,"material":0,"targets":[{{"TEXCOORD_1":{shift}}},
            {{"COLOR_0":{color_shift},"POSITION":0}}]}}]}}],"nodes":[{{"mesh":0}}],{material}"#
        ))
    };
    let still = scene(uv_shift, "[0,0]");
    assert_eq!((still.uvs[1][1], still.colors[0]), (Vec2::X, Vec4::new(0.5, 0.5, 0.5, 1.0)));
    let moved = scene(uv_shift, "[0.5,1]");
    assert_eq!(moved.uvs[1][1], Vec2::new(1.25, 0.25));
    assert_eq!(moved.colors[0], Vec4::new(0.75, 1.0, 0.0, 1.0));
    assert_eq!(moved.positions[1], 2.0 * Vec3::X);
    let bad = scene(infinite, "[1,0]");
    assert_eq!(bad.uvs[1], [Vec2::ZERO; 4]);
    assert!(bad.notices.iter().any(|it| it.starts_with("4 texture coordinates or colours")));
}

/// A body's inside absorbs over the way through it, a sheet's over its thickness as it is placed.
#[test]
fn a_volume_on_a_sheet_is_a_thin_tinted_wall() {
    let mut builder = square();
    let corners = builder.floats("VEC3", &[0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.]);
    let faces = builder.indices(&[0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]);
    let scene = |nodes: &str, transmission: &str| {
        builder.load(&format!(
            r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1,"material":0}}]}},
            {{"primitives":[{{"attributes":{{"POSITION":{corners}}},"indices":{faces},"material":0}}]}}],
            "nodes":[{nodes}],"materials":[{{"name":"Syrup","pbrMetallicRoughness":{{"metallicFactor":0}},
            "extensions":{{{transmission},"KHR_materials_volume":{{"thicknessFactor":0.1,
            "attenuationDistance":0.4,"attenuationColor":[0.25,1,0.0625]}}}}}}]"#
        ))
    };
    let glass = r#""KHR_materials_transmission":{"transmissionFactor":1}"#;
    let both = scene(r#"{"mesh":0,"scale":[2,2,2]},{"mesh":1}"#, glass);
    let of = |triangle: usize| &both.materials[both.triangle_materials[triangle] as usize];
    let (sheet, body) = (of(0), of(5));
    assert_eq!((sheet.thickness, body.thickness), (0.0, 0.1));
    assert!(sheet.base_color.abs_diff_eq(Vec4::new(0.5, 1.0, 0.25, 1.0), 1e-6));
    assert_eq!((body.base_color, body.name.as_str()), (Vec4::ONE, "Syrup"));
    let said = "material Syrup has a volume on surfaces that are not closed";
    assert!(both.notices.iter().any(|it| it.starts_with(said)));
    let body = scene(r#"{"mesh":1}"#, glass);
    assert_eq!((body.materials.len(), body.notices.is_empty()), (1, true));
    let leaf = r#""KHR_materials_diffuse_transmission":{"diffuseTransmissionFactor":1}"#;
    let leaf = scene(r#"{"mesh":0}"#, leaf);
    let leaf = &leaf.materials[leaf.triangle_materials[0] as usize];
    let color = Vec3::new(0.5_f32.sqrt(), 1.0, 0.5);
    assert!(leaf.diffuse_transmission_color.abs_diff_eq(color, 1e-6));
    assert_eq!(leaf.base_color, Vec4::ONE);
}

/// Some writers know one kind of number.
#[test]
fn whole_numbers_of_extensions_may_have_a_point() {
    let material = |index: &str| {
        let mut builder = square();
        let uvs = builder.floats("VEC2", &[0., 0., 1., 0., 1., 1., 0., 1.]);
        let mesh =
            ONE_MESH.replace(r#""POSITION":0"#, &format!(r#""POSITION":0,"TEXCOORD_0":{uvs}"#));
        let mesh = mesh.replace(r#""indices":1"#, r#""indices":1,"material":0"#);
        let sheen = format!(
            r#""extensions":{{"KHR_materials_sheen":{{"sheenColorFactor":[1,1,1],"sheenColorTexture":{{"index":{index}}}}}}}"#
        );
        let rest = format!(
            r#""extensionsUsed":["KHR_materials_sheen"],{},{mesh}"#,
            textured_material(&sheen, "{}")
        );
        builder.load(&rest).materials[0].texture(TextureSlot::SheenColor).copied()
    };
    assert!(material("0").is_some());
    assert_eq!(material("0.0"), material("0"));
}

#[test]
fn extensions_required_used_and_honoured() {
    let error = square().error(&format!(
        r#""extensionsRequired":["KHR_texture_video","KHR_texture_transform"],{ONE_MESH}"#
    ));
    assert_eq!(error, "made.glb: it requires the extension KHR_texture_video, not supported here");
    let scene = square()
        .load(&format!(r#""extensionsUsed":["KHR_xmp_json_ld","KHR_materials_ior"],{ONE_MESH}"#));
    let notices: Vec<_> = scene.notices.iter().collect();
    assert_eq!(
        notices,
        ["the extension KHR_xmp_json_ld is not supported; what it adds is left out"]
    );
}

#[test]
fn material_extensions() {
    let scene = solid().load(
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
        ["material all has factors outside their range, which are clamped"]
    );
}

#[test]
fn newer_material_extensions() {
    let load_of = |mut builder: Builder, extensions: &str| {
        builder.floats("VEC2", &[0., 1., 1., 1., 1., 0., 0., 0.]);
        let names = extensions.split('"').filter(|name| name.starts_with("KHR_materials"));
        let used: Vec<String> = names.map(|name| format!("\"{name}\"")).collect();
        let used = used.join(",");
        builder.load(&format!(
            r#""extensionsUsed":[{used}],"extensionsRequired":[{used}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":2}},"indices":1,"material":0}}]}}],
            "nodes":[{{"mesh":0}}],{}"#,
            textured_material(&format!(r#""extensions":{{{extensions}}}"#), "{}")
        ))
    };
    let load = |extensions: &str| load_of(square(), extensions);
    let map = |name: &str| format!(r#""{name}":{{"index":0}}"#);

    let scene = load(&format!(
        r#""KHR_materials_anisotropy":{{"anisotropyStrength":0.5,"anisotropyRotation":2,{}}},
        "KHR_materials_sheen":{{"sheenColorFactor":[1,0.5,0],{},"sheenRoughnessFactor":0.3,{}}}"#,
        map("anisotropyTexture"),
        map("sheenColorTexture"),
        map("sheenRoughnessTexture")
    ));
    let material = &scene.materials[0];
    assert_eq!((material.anisotropy, material.anisotropy_rotation), (0.5, 2.0));
    assert_eq!(material.sheen_color, Vec3::new(1.0, 0.5, 0.0));
    assert_eq!(material.sheen_roughness, 0.3);
    let srgb =
        |slot| scene.textures[material.texture(slot).expect("it is read").texture as usize].srgb;
    assert!(srgb(TextureSlot::SheenColor));
    assert!(!srgb(TextureSlot::SheenRoughness) && !srgb(TextureSlot::Anisotropy));
    // The file has no tangents, and the direction needs them: u grows along +X.
    assert!(scene.tangents.iter().all(|t| t.truncate().abs_diff_eq(Vec3::X, 1e-5)));
    let needs = SceneNeeds::of(&scene);
    assert!(needs.has(SceneFeatures::ANISOTROPY | SceneFeatures::SHEEN));
    assert!(!needs.features.intersects(SceneFeatures::IRIDESCENCE | SceneFeatures::DISPERSION));
    assert!(scene.notices.is_empty());

    let scene = load(&format!(
        r#""KHR_materials_iridescence":{{"iridescenceFactor":0.7,{},"iridescenceIor":1.5,
        "iridescenceThicknessMinimum":50,"iridescenceThicknessMaximum":600,{}}},
        "KHR_materials_diffuse_transmission":{{"diffuseTransmissionFactor":0.4,{},
        "diffuseTransmissionColorFactor":[0.1,0.2,0.3],{}}}"#,
        map("iridescenceTexture"),
        map("iridescenceThicknessTexture"),
        map("diffuseTransmissionTexture"),
        map("diffuseTransmissionColorTexture")
    ));
    let material = &scene.materials[0];
    assert_eq!((material.iridescence, material.iridescence_ior), (0.7, 1.5));
    assert_eq!(material.iridescence_thickness, [50.0, 600.0]);
    assert_eq!(material.diffuse_transmission, 0.4);
    assert_eq!(material.diffuse_transmission_color, Vec3::new(0.1, 0.2, 0.3));
    assert!(material.texture(TextureSlot::Iridescence).is_some());
    assert!(material.texture(TextureSlot::IridescenceThickness).is_some());
    assert!(material.texture(TextureSlot::DiffuseTransmission).is_some());
    assert!(material.texture(TextureSlot::DiffuseTransmissionColor).is_some());
    assert!(scene.tangents.is_empty());

    let glass = r#""KHR_materials_transmission":{"transmissionFactor":1},
        "KHR_materials_volume":{"thicknessFactor":1},"KHR_materials_dispersion":{"dispersion":0.3}"#;
    let scene = load_of(solid(), glass);
    assert_eq!(scene.materials[0].dispersion, 0.3);
    assert!(SceneNeeds::of(&scene).has(SceneFeatures::DISPERSION));
    let thin = load(&glass.replace(r#""thicknessFactor":1"#, ""));
    assert!(!SceneNeeds::of(&thin).has(SceneFeatures::DISPERSION), "a thin wall bends nothing");

    let odd = load(
        r#""KHR_materials_sheen":{"sheenColorFactor":[2,0,0]},"KHR_materials_iridescence":
        {"iridescenceIor":0.5,"iridescenceThicknessMaximum":-3},"KHR_materials_dispersion":{"dispersion":-1}"#,
    );
    let material = &odd.materials[0];
    assert_eq!((material.sheen_color, material.iridescence_ior), (Vec3::X, 1.0));
    assert_eq!((material.iridescence_thickness[1], material.dispersion), (0.0, 0.0));
    assert_eq!(odd.notices.iter().count(), 1);
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

/// A texture's alpha is how smooth the surface is there.
#[test]
fn a_glossiness_texture_becomes_one_of_roughness() {
    let mut png = Vec::new();
    let pixels = [[255, 0, 0, 255_u8], [0, 0, 255, 51]];
    let encoder = PngEncoder::new(&mut png);
    encoder.write_image(pixels.as_flattened(), 2, 1, ExtendedColorType::Rgba8).expect("encoded");
    let bytes: String = png.iter().map(|byte| format!("%{byte:02X}")).collect();
    let uri = format!("data:image/png,{bytes}");
    let scene = square().load(&format!(
        r#""meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1,"material":0}}]}}],
        "nodes":[{{"mesh":0}}],"images":[{{"uri":"{uri}"}}],"textures":[{{"source":0}}],
        "materials":[{{"extensions":{{"KHR_materials_pbrSpecularGlossiness":
        {{"glossinessFactor":0.5,"specularGlossinessTexture":{{"index":0}}}}}}}}]"#
    ));
    assert!(scene.notices.is_empty(), "{:?}", scene.notices);
    let material = &scene.materials[0];
    let texture = material.texture(TextureSlot::MetallicRoughness).expect("of roughness");
    for (u, roughness) in [(0.25, 0.5), (0.75, 0.9)] {
        let value = sample_texture(&scene, texture, Vec2::new(u, 0.5));
        assert!((material.roughness * value.y - roughness).abs() < 0.003, "{u}: {value}");
    }
    let color = material.texture(TextureSlot::SpecularColor).expect("of its colour");
    assert_ne!(
        scene.textures[color.texture as usize].image,
        scene.textures[texture.texture as usize].image
    );
}

#[test]
fn hidden_nodes_and_what_is_below_them_are_not_seen() {
    let scene = square().load(
        r#""extensionsUsed":["KHR_node_visibility"],"cameras":[{"type":"perspective",
        "perspective":{"yfov":0.5,"znear":0.1}}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
        "nodes":[{"mesh":0,"extensions":{"KHR_node_visibility":{"visible":true}}},
        {"extensions":{"KHR_node_visibility":{"visible":false}},"children":[2,3]},
        {"mesh":0,"translation":[5,0,0],"extensions":{"KHR_node_visibility":{"visible":true}}},{"camera":0}]"#,
    );
    assert!(scene.notices.is_empty(), "{:?}", scene.notices);
    assert_eq!((scene.triangles.len(), scene.cameras.len()), (2, 1));
}

#[test]
fn cameras_and_lights() {
    let scene = square().load(
        r#""extensionsUsed":["KHR_lights_punctual"],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
        "cameras":[{"type":"orthographic","orthographic":{"xmag":2,"ymag":1,"znear":0,"zfar":9}},
        {"type":"perspective","name":"Main","perspective":{"yfov":0.5,"znear":0.1},
        "extras":{"lens":{"radius":0.01,"focus":2.5}}}],
        "extensions":{"KHR_lights_punctual":{"lights":[{"type":"directional","color":[1,0.5,0],"intensity":4},
        {"type":"spot","name":"Lamp","range":3,"spot":{"outerConeAngle":0.5}}]}},
        "nodes":[{"mesh":0},{"camera":1,"translation":[0,0,5]},{"camera":0,"name":"Plan"},
        {"extensions":{"KHR_lights_punctual":{"light":0}},"rotation":[-0.70710678,0,0,0.70710678]},
        {"extensions":{"KHR_lights_punctual":{"light":1}},"translation":[1,2,3]}]"#,
    );
    let [plan, main] = &scene.cameras[..] else { panic!("two cameras") };
    assert_eq!((plan.name.as_str(), plan.lens_radius), ("Plan", 0.0));
    assert_eq!(plan.projection, Projection::Orthographic { half_height: 1.0 });
    assert_eq!((main.name.as_str(), main.lens_radius, main.focus_distance), ("Main", 0.01, 2.5));
    assert_eq!(main.projection, Projection::Perspective { fov_y_radians: 0.5 });
    assert_eq!(Vec3::from(main.world_from_camera.translation), Vec3::new(0.0, 0.0, 5.0));
    let [sun, lamp] = &scene.lights[..] else { panic!("two lights") };
    assert_eq!((sun.kind, sun.intensity), (PunctualKind::Directional, Vec3::new(4.0, 2.0, 0.0)));
    assert!(sun.direction.abs_diff_eq(Vec3::NEG_Y, 1e-6));
    assert_eq!((lamp.name.as_str(), lamp.range), ("Lamp", 3.0));
    assert_eq!(lamp.kind, PunctualKind::Spot { inner_radians: 0.0, outer_radians: 0.5 });
    assert_eq!(lamp.position, Vec3::new(1.0, 2.0, 3.0));
}

/// The scale of a camera's own node is ignored; below a mirroring node it sees what it would see there, not mirrored.
#[test]
fn cameras_are_not_mirrored() {
    let axes = |camera: &str, parent: &str| {
        let scene = square().load(&format!(
            r#"{},{{"camera":0,"translation":[0.5,0,4]{camera}}},{{"children":[1]{parent}}}],"scenes":[{{"nodes":[0,2]}}],
            "cameras":[{{"type":"perspective","perspective":{{"yfov":0.5,"znear":0.1}}}}]"#,
            ONE_MESH.trim_end_matches(']')
        ));
        let placed = scene.cameras[0].world_from_camera;
        let [x, y, z] = [placed.matrix3.x_axis, placed.matrix3.y_axis, placed.matrix3.z_axis]
            .map(|axis| Vec3::from(axis.normalize()));
        (Vec3::from(placed.translation), [x, y, z])
    };
    let plain = axes("", "");
    assert_eq!(plain, (Vec3::new(0.5, 0.0, 4.0), [Vec3::X, Vec3::Y, Vec3::Z]));
    for scale in ["-1,1,1", "1,-1,1", "1,1,-1", "-2,-3,-4", "9,9,9"] {
        assert_eq!(axes(&format!(r#","scale":[{scale}]"#), ""), plain, "{scale}");
    }
    let [x, y, z] = plain.1;
    let below = axes("", r#","scale":[1,1,-1]"#);
    assert_eq!(below, (Vec3::new(0.5, 0.0, -4.0), [-x, y, -z]));
    let matrix = r#","matrix":[-1,0,0,0,0,1,0,0,0,0,1,0,0.5,0,4,1]"#;
    let by_matrix = axes(matrix, "");
    assert_eq!(by_matrix, plain);
}

#[test]
fn lights_outside_their_range_are_brought_into_it_and_it_is_said() {
    let scene = square().load(
        r#""extensionsUsed":["KHR_lights_punctual"],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
        "extensions":{"KHR_lights_punctual":{"lights":[
        {"type":"spot","name":"wide","spot":{"innerConeAngle":1,"outerConeAngle":2}},
        {"type":"spot","name":"inside out","spot":{"innerConeAngle":1,"outerConeAngle":0.5}},
        {"type":"point","name":"negative","intensity":-3},
        {"type":"point","name":"blue","color":[-1,0,1]},
        {"type":"point","name":"near","range":-2},
        {"type":"point","name":"bright","intensity":1e38},
        {"type":"spot","name":"sound","range":3,"spot":{"innerConeAngle":0.25,"outerConeAngle":0.5}}]}},
        "nodes":[{"mesh":0},
        {"extensions":{"KHR_lights_punctual":{"light":0}}},{"extensions":{"KHR_lights_punctual":{"light":1}}},
        {"extensions":{"KHR_lights_punctual":{"light":2}}},{"extensions":{"KHR_lights_punctual":{"light":3}}},
        {"extensions":{"KHR_lights_punctual":{"light":4}}},{"extensions":{"KHR_lights_punctual":{"light":5}}},
        {"extensions":{"KHR_lights_punctual":{"light":6}}}]"#,
    );
    let notices: Vec<&str> = scene.notices.iter().collect();
    let expected = ["wide", "inside out", "negative", "blue", "near", "bright"]
        .map(|name| format!("light {name} has values outside their range, which are replaced"));
    assert_eq!(notices, expected);
    let [wide, inside_out, negative, blue, near, bright, sound] = &scene.lights[..] else {
        panic!("seven lights")
    };
    let outer_radians = std::f32::consts::FRAC_PI_2;
    assert_eq!(wide.kind, PunctualKind::Spot { inner_radians: 1.0, outer_radians });
    let narrow = PunctualKind::Spot { inner_radians: 0.5, outer_radians: 0.5 };
    assert_eq!(inside_out.kind, narrow);
    assert_eq!((negative.intensity, blue.intensity), (Vec3::ZERO, Vec3::Z));
    assert_eq!((near.range, sound.range), (f32::INFINITY, 3.0));
    assert_eq!(bright.intensity, Vec3::splat(1e12));
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
    assert!(scene.materials[0].texture(TextureSlot::BaseColor).is_none());
    let notice = scene.notices.iter().next().unwrap();
    assert!(notice.contains("`gone.png`: there is no such file"), "{notice}");
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
    for uri in [uri.clone(), uri.replace("data:", "DATA:")] {
        let text = builder.json(ONE_MESH, &uri);
        let scene = gltf::load_slice(text.as_bytes(), None, "text.gltf").unwrap();
        assert_eq!(scene.triangles.len(), 2);
    }
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
    // Ten thousand lamps of thirty thousand triangles, and a hundred thousand of what can be shared.
    for (count, material, most) in [
        (10_000, r#""emissiveFactor":[1,1,1]"#, "more than 200 million triangles"),
        (100_000, "", "more than 2147 million triangles"),
    ] {
        let mut builder = square();
        let places: Vec<f32> = (0..count).flat_map(|i| [i as f32, 0.0, 0.0]).collect();
        let translation = builder.floats("VEC3", &places);
        let node = format!(
            r#"{{"mesh":0,"extensions":{{"EXT_mesh_gpu_instancing":{{"attributes":{{"TRANSLATION":{translation}}}}}}}}}"#
        );
        let large = builder.indices(&[0, 1, 2].repeat(30_000));
        let mesh =
            ONE_MESH.replace(r#""indices":1"#, &format!(r#""indices":{large},"material":0"#));
        let mesh = mesh.replace(r#"{"mesh":0}"#, &node);
        let error = builder.error(&format!(r#""materials":[{{{material}}}],{mesh}"#));
        assert!(error.contains(most), "{error}");
    }
}

/// What is not used is not read, and names may be in any encoding.
#[test]
fn odd_objects_that_are_not_used_are_no_fault() {
    let mut bytes = square().glb(&format!(
        r#"{ONE_MESH},"materials":[{{"name":1}},7],"skins":[{{}}],"cameras":[[]],"images":[{{"uri":8}}],
        "textures":[{{"name":"Gr@n","source":-1}}]"#
    ));
    let at = bytes.iter().position(|byte| *byte == b'@').expect("it is there");
    bytes[at] = 0xfc;
    let scene = gltf::load_slice(&bytes, None, "latin-1.glb").expect("it is shown");
    assert_eq!(scene.triangles.len(), 2);
    // A buffer that promises nothing has what it has.
    let text = square().json(
        &ONE_MESH.replace(r#","indices":1"#, ""),
        r#","uri":"data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA""#,
    );
    let text = text.replacen(r#""byteLength":60,"#, "", 1);
    let text = text.replace(r#""byteLength":48"#, r#""byteLength":36"#);
    let text = text.replace(r#""count":4"#, r#""count":3"#);
    let scene = gltf::load_slice(text.as_bytes(), None, "unpromised.gltf").expect("it is shown");
    assert_eq!(scene.triangles, [[0, 1, 2]]);
    let error = square().error(&ONE_MESH.replace(r#""mesh":0"#, r#""mesh":true"#));
    assert!(error.contains("its JSON does not describe glTF 2.0 (node 0: "), "{error}");
}

#[test]
fn fog_is_read_from_the_scene_a_node_and_a_material() {
    let shape =
        r#""meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}]"#;
    let load = |scene: &str, node: &str, material: &str| {
        solid().load(&format!(
            r#"{shape},"nodes":[{{"mesh":0}},{{"translation":[1,2,3],"scale":[1,2,4]{node}}}],
            "scenes":[{{"nodes":[0,1]{scene}}}],"materials":[{{{material}}}]"#
        ))
    };
    let fog = |keys: &str| format!(r#","extras":{{"other":1,"fog":{{{keys}}}}}"#);
    let clear = load("", "", "");
    assert!(clear.medium.is_none() && !SceneNeeds::of(&clear).has(SceneFeatures::FOG));

    let scene =
        load(&fog(r#""scattering":0.5,"absorption":[0,0.1,0.2],"anisotropy":-0.3"#), "", "");
    let expected = Medium {
        scattering: Vec3::splat(0.5),
        absorption: Vec3::new(0.0, 0.1, 0.2),
        anisotropy: -0.3,
        bounds: None,
    };
    assert_eq!(scene.medium, Some(expected));
    assert!(SceneNeeds::of(&scene).has(SceneFeatures::FOG));

    let placed = load("", &fog(r#""scattering":2"#), "").medium.expect("a medium");
    let (low, high) = (Vec3::new(0.0, 0.0, -1.0), Vec3::new(2.0, 4.0, 7.0));
    assert_eq!(placed.bounds, Some([low, high]));

    let boxed = load(&fog(r#""scattering":1,"box":[[0,0,0],[1,2,3]]"#), &fog(""), "");
    assert_eq!(boxed.medium.expect("a medium").bounds, Some([Vec3::ZERO, Vec3::new(1., 2., 3.)]));
    assert!(boxed.notices.iter().any(|n| n.contains("2 media")));

    let glass = r#""extensions":{"KHR_materials_transmission":{"transmissionFactor":1},
        "KHR_materials_volume":{"thicknessFactor":1}}"#;
    let milk = load("", "", &format!("{glass}{}", fog(r#""scattering":[1,2,3],"anisotropy":0.5"#)));
    assert_eq!(milk.materials[0].scattering, Vec3::new(1.0, 2.0, 3.0));
    assert_eq!(milk.materials[0].scatter_anisotropy, 0.5);
    assert!(
        SceneNeeds::of(&milk).has(SceneFeatures::SCATTERING_SOLIDS)
            && !SceneNeeds::of(&milk).has(SceneFeatures::FOG)
    );

    for bad in
        [r#""scattering":-1"#, r#""anisotropy":2"#, r#""box":[[0,0,0],[0,1,1]]"#, r#""box":3"#]
    {
        let scene = load(&fog(bad), "", "");
        assert!(scene.medium.is_none(), "{bad}");
        assert!(scene.notices.iter().any(|n| n.contains("fog of the scene")), "{bad}");
    }
}

/// As if nothing were written there a mesh would stand alone where many were meant.
#[test]
fn instances_that_make_no_sense_are_refused() {
    let builder = square();
    let error = |extension: &str| {
        let node = ONE_MESH.replace(
            r#""nodes":[{"mesh":0"#,
            &format!(
                r#""nodes":[{{"mesh":0,"extensions":{{"EXT_mesh_gpu_instancing":{extension}}}"#
            ),
        );
        builder.error(&node)
    };
    for nonsense in ["[]", "{}", r#"{"attributes":[0]}"#, r#"{"attributes":{"TRANSLATION":-1}}"#] {
        assert_eq!(error(nonsense), "made.glb: node 0: its instances make no sense", "{nonsense}");
    }
    assert!(error(r#"{"attributes":{"SCALE":9}}"#).contains("accessor 9 is referred to"));
}
