//! Files as real programs write them, which a strict reader would refuse or misread.

use std::fs;

use lightgrid::image::{ExrPicture, Image, read_map, read_picture, write_exr};
use lightgrid::scene::gltf;
use lightgrid::scene::{Scene, SceneOptions};

use crate::cli::{Bench, text};
use crate::packed;
use crate::shared::{exr_header, shared};

/// One triangle with what comes `before` and `after` in the file, its corners as given.
fn triangle(corners: [f32; 9], before: &str, material: &str, after: &str) -> String {
    let bytes: String =
        corners.iter().flat_map(|x| x.to_le_bytes()).map(|byte| format!("%{byte:02x}")).collect();
    format!(
        r#"{{"asset":{{"version":"2.0"}},{before}"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{
        "attributes":{{"POSITION":0}}{material}}}]}}],"accessors":[{{"bufferView":0,
        "componentType":5126,"count":3,"type":"VEC3"}}],"bufferViews":[{{"buffer":0,"byteLength":36}}],
        "buffers":[{{"uri":"data:,{bytes}","byteLength":36}}]{after}}}"#
    )
}

const CORNERS: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];

fn load(text: &str, options: &SceneOptions) -> Result<Scene, String> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.gltf");
    fs::write(&path, text).expect("written");
    gltf::load_with(&path, options).map_err(|e| e.to_string())
}

#[test]
fn empty_scenes_and_whole_numbers_with_a_point_are_read() {
    let plain = SceneOptions::default();
    let scenes = r#""scene":0,"scenes":[{"nodes":[0]},{"name":"empty"}],"#;
    let text = triangle(CORNERS, scenes, "", "");
    assert_eq!(load(&text, &plain).unwrap().triangles.len(), 1);
    let text = text.replace("\"count\":3", "\"count\":3.0").replace("\"mesh\":0", "\"mesh\":0.0");
    let text = text.replace("5126", "5.126e3").replace("\"byteLength\":36", "\"byteLength\":36.0");
    assert_eq!(load(&text, &plain).unwrap().triangles.len(), 1);
    let says = load(&text.replace("\"count\":3.0", "\"count\":3.5"), &plain).unwrap_err();
    assert!(says.contains("does not describe glTF"), "{says}");
    // Not node 0, though its 32 bits are.
    let says = load(&text.replace("[0]", "[4294967296]"), &plain).unwrap_err();
    assert!(says.contains("the index 4294967296 has more than 32 bits"), "{says}");
}

#[test]
fn a_models_looks_are_chosen_by_name_and_materials_hidden() {
    let variants = r#","extensionsUsed":["KHR_materials_variants"],
        "extensionsRequired":["KHR_materials_variants"],
        "extensions":{"KHR_materials_variants":{"variants":[{"name":"day"},{"name":"night"}]}},
        "materials":[{"name":"a"},{"name":"b"}]"#;
    let material = r#","material":0,"extensions":{"KHR_materials_variants":{"mappings":[
        {"material":1,"variants":[1]}]}}"#;
    let text = triangle(CORNERS, "", material, variants);
    let look = |variant: Option<&str>| {
        let options =
            SceneOptions { variant: variant.map(str::to_owned), ..SceneOptions::default() };
        load(&text, &options).map(|scene| {
            let used = scene.triangle_materials[0] as usize;
            (scene.materials[used].name.clone(), scene.notices.iter().count())
        })
    };
    assert_eq!(look(None), Ok(("a".to_owned(), 1)));
    assert_eq!(look(Some("day")), Ok(("a".to_owned(), 0)));
    assert_eq!(look(Some("night")), Ok(("b".to_owned(), 0)));
    let says = look(Some("dusk")).unwrap_err();
    assert!(says.contains("no variant dusk but day, night"), "{says}");

    let hidden = |name: &str| {
        let options = SceneOptions { hide: vec![name.to_owned()], ..SceneOptions::default() };
        load(&text, &options).map(|_| ()).unwrap_err()
    };
    assert!(hidden("a").contains("all of it is hidden"));
    assert!(hidden("glass").contains("no material is called \"glass\""));
}

#[test]
fn what_lies_beyond_all_numbers_is_dropped_and_the_view_is_sound() {
    let bench = Bench::new();
    let far = CORNERS.map(|x| x * 1e19);
    fs::write(bench.path("far.gltf"), triangle(far, "", "", "")).unwrap();
    let says = bench.refusal("render far.gltf -o a.png", 1);
    assert!(says.contains("beyond 1e18 m"), "{says}");
    // Another vertex of the same mesh out there.
    let mut corners = CORNERS.to_vec();
    corners.extend([3e38, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    let bytes: Vec<u8> = corners.iter().flat_map(|x| x.to_le_bytes()).collect();
    fs::write(bench.path("far.bin"), bytes).unwrap();
    let text = triangle(CORNERS, "", "", "").replace("\"count\":3", "\"count\":6");
    let text = text.replace("\"byteLength\":36", "\"byteLength\":72");
    let (start, rest) = text.split_once("data:,").unwrap();
    let rest = rest.split_once('"').unwrap().1;
    fs::write(bench.path("far.gltf"), format!("{start}far.bin\"{rest}")).unwrap();
    let line = "render far.gltf --env map.exr --size 16x9 --spp 2 --learning-paths 500 -o a.png";
    let output = bench.run(&format!("{line} --json a.json"));
    let says = self::text(&output.stderr);
    assert!(output.status.success() && !says.contains("NaN") && !says.contains("inf"), "{says}");
    assert_eq!(bench.json("a.json")["triangles"], 1);
    assert_eq!(bench.json("a.json")["invalid_samples"], 0);
}

#[test]
fn no_light_is_so_bright_that_samples_are_lost() {
    let bench = Bench::new();
    let materials = r#","materials":[{"doubleSided":true,"emissiveFactor":[1e39,1e38,1],
        "extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":1e38}}}]"#;
    let text = triangle(CORNERS, "", r#","material":0"#, materials);
    fs::write(bench.path("lamp.gltf"), text).unwrap();
    let line = "render lamp.gltf --env map.exr --size 16x9 --spp 4 --learning-paths 500 -o a.exr";
    let output = bench.run(&format!("{line} --json a.json"));
    assert!(output.status.success(), "{}", self::text(&output.stderr));
    assert_eq!(bench.json("a.json")["invalid_samples"], 0);
    let picture = read_picture(&bench.path("a.exr")).unwrap();
    assert!(picture.pixels.as_flattened().iter().all(|x| x.is_finite()));
}

#[test]
fn equal_pictures_are_equal_files_if_asked_to() {
    let bench = Bench::new();
    let line =
        "render scene.gltf --env map.exr --size 16x9 --spp 2 --learning-paths 500 --reproducible";
    for name in ["a", "b"] {
        assert!(bench.run(&format!("{line} -o {name}.png -o {name}.exr")).status.success());
    }
    for kind in ["png", "exr"] {
        let [a, b] =
            ["a", "b"].map(|name| fs::read(bench.path(&format!("{name}.{kind}"))).unwrap());
        assert!(a == b, "{kind}");
    }
}

#[test]
fn negative_values_are_refused_in_our_own_words() {
    let bench = Bench::new();
    for (line, reason) in [
        ("render -o a.png --region -1,0,2,2", "expected four numbers"),
        ("render -o a.png --size -1x9", "two positive whole numbers"),
        ("render -o a.png --tiles -1x9", "two positive whole numbers"),
        ("view --samples -1", "-1 is not in 1.."),
        ("screenshot -o a.png --inspect -0.5,0", "two numbers from 0 to 1"),
        ("screenshot -o a.png --patience -1", "must be above 0"),
        ("screenshot -o a.png --scale -1", "must be from 0.5 to 4"),
        ("screenshot -o a.png --scale 4.1", "must be from 0.5 to 4"),
        ("screenshot -o a.png --scale nan", "expected a number"),
        ("report -o out --seconds -1", "must be above 0"),
        ("bench --seconds -1", "must be above 0"),
    ] {
        let says = bench.refusal(line, 2);
        assert!(says.contains(reason), "{line}: {says}");
    }
}

#[test]
fn a_developed_picture_is_not_compared_with_a_linear_one() {
    let bench = Bench::new();
    let line = "render open --env sky:overcast@64x32 --size 32x18 --spp 1 -o a.png -o a.exr";
    assert!(bench.run(line).status.success());
    for line in ["compare a.png a.exr", "compare a.exr a.png"] {
        let says = bench.refusal(line, 1);
        assert!(says.contains("a.png: is developed for a display and a.exr is linear"), "{says}");
    }
    assert!(bench.run("compare a.png a.png").status.success());
}

#[test]
fn exr_channels_need_not_be_sorted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.exr");
    let image = Image::from_fn(32, 16, |x, y| [x as f32, y as f32, 0.5]);
    write_exr(&path, ExrPicture { image: &image, layers: vec![], metadata: &[], preview: None })
        .unwrap();
    let mut bytes = fs::read(&path).unwrap();
    let list = bytes.windows(7).position(|w| w == b"chlist\0").unwrap() + 7 + 4;
    assert_eq!([bytes[list], bytes[list + 18], bytes[list + 36]], *b"BGR");
    for (at, name) in [(0, b'R'), (18, b'B'), (36, b'G')] {
        bytes[list + at] = name;
    }
    fs::write(&path, bytes).unwrap();
    assert_eq!(read_picture(&path).unwrap(), image);
    if let Some(path) = shared("abuse/example_rle.exr") {
        read_picture(&path).expect("a picture");
    }
}

/// Luminance at every pixel, colour at every fourth.
#[test]
fn exr_colour_may_have_half_the_resolution() {
    use exr::prelude::f16;
    let (width, height) = (8_u32, 4_u32);
    let last = [width - 1, height - 1];
    let mut file = exr_header(&[("BY", 2), ("RY", 2), ("Y", 1)], last, last);
    // A colour for each two by two pixels: (R-Y)/Y and (B-Y)/Y; luminance for each pixel.
    let chroma = |x: u32, y: u32| [0.25 * x as f32, 0.125 * y as f32];
    let luminance = |x: u32, y: u32| 1.0 + (x + y) as f32;
    let half = |x: f32| f16::from_f32(x).to_le_bytes();
    let mut lines: Vec<Vec<u8>> = Vec::new();
    for y in 0..height {
        let mut samples: Vec<u8> = Vec::new();
        if y % 2 == 0 {
            for which in [1, 0] {
                samples.extend((0..width / 2).flat_map(|x| half(chroma(x, y / 2)[which])));
            }
        }
        samples.extend((0..width).flat_map(|x| half(luminance(x, y))));
        let mut line = (y as i32).to_le_bytes().to_vec();
        line.extend((samples.len() as u32).to_le_bytes());
        line.extend(samples);
        lines.push(line);
    }
    let mut offset = file.len() + 8 * lines.len();
    for line in &lines {
        file.extend((offset as u64).to_le_bytes());
        offset += line.len();
    }
    file.extend(lines.concat());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.exr");
    fs::write(&path, file).unwrap();
    let picture = read_picture(&path).expect("a picture");
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let ([ry, by], l) = (chroma(x / 2, y / 2), luminance(x, y));
        let [r, g, b] = picture.at(x, y);
        assert!((r - (1.0 + ry) * l).abs() < 1e-3 && (b - (1.0 + by) * l).abs() < 1e-3, "{x} {y}");
        assert!((0.2126 * r + 0.7152 * g + 0.0722 * b - l).abs() < 1e-3, "{x} {y}");
    }
    // B44, in blocks of 32 lines.
    if let Some(path) = shared("data/odd/CrissyField.exr") {
        let picture = read_map(&path).expect("a picture").image;
        let mean = picture.pixels.iter().map(|[r, g, b]| 0.2126 * r + 0.7152 * g + 0.0722 * b);
        let mean = mean.sum::<f32>() / picture.pixels.len() as f32;
        assert!((0.3..0.6).contains(&mean), "{mean}");
    }
}

#[test]
fn dark_pixels_of_a_flat_hdr_are_no_runs() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("map.hdr");
    let mut file = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n".to_vec();
    let pixels = [[128, 64, 32, 128], [1, 1, 1, 130], [1, 1, 1, 2], [200, 100, 50, 129]];
    file.extend(pixels.iter().chain(&pixels).flatten());
    fs::write(&path, &file).unwrap();
    let picture = read_picture(&path).unwrap();
    assert_eq!(picture.at(1, 1), [2.0_f32.powi(130 - 136); 3]);
    assert_eq!(picture.at(3, 0)[0], 200.0 * 2.0_f32.powi(129 - 136));
}

/// Two triangles of four points, packed plainly: the sequential method, indices and values uncompressed.
#[test]
fn meshes_packed_by_draco_are_unpacked() {
    let corners: [[f32; 3]; 4] = [[0.0; 3], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [0.0, 1.0, 0.5]];
    let mut bytes = b"DRACO\x02\x02\x01\x00\x00\x00".to_vec();
    // Faces, points, that indices are plain, and they.
    bytes.extend([2, 4, 1, 0, 1, 2, 0, 2, 3]);
    // One decoder of one attribute: positions of three floats, its number, and that values are plain.
    bytes.extend([1, 1, 0, 9, 3, 0, 7, 0]);
    bytes.extend(corners.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
    let file = |bytes: &[u8], number: u32| {
        let data: String = bytes.iter().map(|byte| format!("%{byte:02x}")).collect();
        let length = bytes.len();
        format!(
            r#"{{"asset":{{"version":"2.0"}},"extensionsRequired":["KHR_draco_mesh_compression"],
            "nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1,
            "extensions":{{"KHR_draco_mesh_compression":{{"bufferView":0,
            "attributes":{{"POSITION":{number}}}}}}}}}]}}],"accessors":[{{"componentType":5126,"count":4,
            "type":"VEC3"}},{{"componentType":5121,"count":6,"type":"SCALAR"}}],
            "bufferViews":[{{"buffer":0,"byteLength":{length}}}],
            "buffers":[{{"uri":"data:,{data}","byteLength":{length}}}]}}"#
        )
    };
    let plain = SceneOptions::default();
    let scene = load(&file(&bytes, 7), &plain).expect("a scene");
    let found: Vec<[[f32; 3]; 3]> =
        scene.triangles.iter().map(|t| t.map(|v| scene.positions[v as usize].to_array())).collect();
    let expected = [[0, 1, 2], [0, 2, 3]].map(|t: [usize; 3]| t.map(|v| corners[v]));
    assert_eq!(found, expected);
    let says = load(&file(&bytes, 8), &plain).unwrap_err();
    assert!(says.contains("POSITION is not among its Draco data"), "{says}");
    // Damage is a sentence or another mesh, never a crash.
    for at in 0..bytes.len() {
        assert!(load(&file(&bytes[..at], 7), &plain).is_err(), "cut at {at}");
        let mut spoilt = bytes.clone();
        spoilt[at] ^= 0x3c;
        let _ = load(&file(&spoilt, 7), &plain);
    }
}

/// Packed in each of Draco's ways, a mesh is what it was, to what its numbers were rounded to.
#[test]
fn every_way_of_draco_gives_the_same_mesh() {
    let (vertices, triangles) = packed::hills();
    let middle =
        |corners: [[f32; 3]; 3]| [0, 1, 2].map(|k| corners.iter().map(|p| p[k] / 3.0).sum());
    let middles: Vec<[f32; 3]> =
        triangles.iter().map(|t| middle(t.map(|v| vertices[v as usize].position))).collect();
    let far =
        |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    // Texture coordinates are read where there is a texture.
    let pixel = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAQAAAC1HAwCAAAAC0lEQVR42mNkYAAAAAYAAjCB0C8AAAAASUVORK5CYII=";
    for level in [0, 4, 7, 10] {
        let bytes = packed::draco(level);
        let data: String = bytes.iter().map(|byte| format!("%{byte:02x}")).collect();
        let (length, points, corners) = (bytes.len(), vertices.len(), 3 * triangles.len());
        let names = r#""POSITION":0,"NORMAL":1,"TEXCOORD_0":2"#;
        let json = format!(
            r#"{{"asset":{{"version":"2.0"}},"extensionsRequired":["KHR_draco_mesh_compression"],
            "nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":{{{names}}},"indices":3,"material":0,
            "extensions":{{"KHR_draco_mesh_compression":{{"bufferView":0,"attributes":{{{names}}}}}}}}}]}}],
            "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],
            "textures":[{{"source":0}}],"images":[{{"uri":"data:image/png;base64,{pixel}"}}],
            "accessors":[{{"componentType":5126,"count":{points},"type":"VEC3"}},
            {{"componentType":5126,"count":{points},"type":"VEC3"}},
            {{"componentType":5126,"count":{points},"type":"VEC2"}},
            {{"componentType":5125,"count":{corners},"type":"SCALAR"}}],
            "bufferViews":[{{"buffer":0,"byteLength":{length}}}],
            "buffers":[{{"uri":"data:,{data}","byteLength":{length}}}]}}"#
        );
        let scene = load(&json, &SceneOptions::default()).expect("a scene");
        assert_eq!(scene.triangles.len(), triangles.len(), "level {level}");
        let mut seen = vec![false; triangles.len()];
        for found in &scene.triangles {
            let at = middle(found.map(|v| scene.positions[v as usize].to_array()));
            let (nearest, _) = middles
                .iter()
                .enumerate()
                .min_by(|(_, a), (_, b)| far(*a, &at).total_cmp(&far(*b, &at)))
                .expect("triangles");
            assert!(
                !std::mem::replace(&mut seen[nearest], true),
                "level {level}: {at:?} is there twice"
            );
            for &corner in found {
                let corner = corner as usize;
                let position = scene.positions[corner].to_array();
                let expected = triangles[nearest].map(|v| &vertices[v as usize]);
                let expected = expected
                    .iter()
                    .min_by(|a, b| {
                        far(&a.position, &position).total_cmp(&far(&b.position, &position))
                    })
                    .expect("corners");
                assert!(far(&expected.position, &position) < 1e-4, "level {level}: {position:?}");
                let normal = scene.normals[corner].to_array();
                assert!(far(&expected.normal, &normal) < 0.01, "level {level}: {normal:?}");
                let uv = scene.uvs[0][corner].to_array();
                assert!(far(&expected.uv, &uv) < 1e-3, "level {level}: {uv:?}");
            }
        }
    }
}
