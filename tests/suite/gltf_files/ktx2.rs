//! KTX 2 pictures and the textures that are made of them.
//!
//! The files of `tests/ktx2` hold [`pattern`], encoded by Basis Universal 2.50 (ETC1S at quality 255, UASTC at
//! level 3, sRGB, not perceptual), and one of them a single colour; the others are made here.

use std::fs;
use std::path::Path;

use lightgrid::image::ldr::{LdrHeader, LdrImage, decode_ldr};
use lightgrid::scene::{Scene, TextureSlot, Wrap, gltf};

use super::builder::{Builder, ONE_MESH, square};

/// Stem, size, whether it has opacity; what the reference decoder (Basis Universal 2.50) makes of it, as FNV-1a;
/// largest and mean difference from [`pattern`] in 255ths: ETC1S has one colour for 16 pixels, and its shades.
const ENCODED: [(&str, u32, u32, bool, u64, u8, f64); 5] = [
    ("etc1s-rgb-13x10-mips", 13, 10, false, 0xc89d_1ac1_787c_b399, 45, 10.0),
    ("etc1s-rgba-14x9", 14, 9, true, 0x3648_3916_3b23_8d73, 45, 10.0),
    ("uastc-rgb-13x10-mips-zstd", 13, 10, false, 0x67d0_7f73_a164_e36c, 16, 4.0),
    ("uastc-rgba-14x9-zstd", 14, 9, true, 0x84d3_f0a1_60a5_ff35, 16, 4.0),
    ("uastc-rgba-14x9", 14, 9, true, 0x84d3_f0a1_60a5_ff35, 16, 4.0),
];

/// What was encoded: red grows to the right, green upwards, blue to the lower right.
fn pattern(x: u32, y: u32, has_opacity: bool) -> [u8; 4] {
    let opacity = if has_opacity { 250 - 12 * x - 4 * y } else { 255 };
    [30 + 15 * x, 220 - 20 * y, 8 * (x + y), opacity].map(|value| value as u8)
}

fn encoded(stem: &str) -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/ktx2");
    fs::read(folder.join(format!("{stem}.ktx2"))).expect("a file of the project")
}

/// The largest and the mean difference of two pictures' values.
fn differences(a: &[[u8; 4]], b: &[[u8; 4]]) -> (u8, f64) {
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    let each: Vec<u8> = pairs.map(|(a, b)| a.abs_diff(*b)).collect();
    let sum: f64 = each.iter().copied().map(f64::from).sum();
    (each.iter().copied().max().unwrap_or(0), sum / each.len() as f64)
}

fn fnv(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x100_0000_01b3)
    })
}

#[test]
fn basis_pictures_have_their_pixels() {
    for (stem, width, height, has_opacity, hash, most, mean) in ENCODED {
        let bytes = encoded(stem);
        let header = LdrHeader { width, height, bytes_per_pixel: 4 };
        assert_eq!(LdrHeader::of(&bytes, stem), Ok(header), "{stem}");
        let decoded = decode_ldr(&bytes, stem).expect(stem);
        let found = (decoded.width, decoded.height, decoded.is_premultiplied);
        assert_eq!(found, (width, height, false), "{stem}");
        let expected: Vec<[u8; 4]> =
            (0..width * height).map(|i| pattern(i % width, i / width, has_opacity)).collect();
        let found = differences(&decoded.pixels.rgba(), &expected);
        assert!(found.0 <= most && found.1 <= mean, "{stem}: {found:?}");
        assert_eq!(fnv(decoded.pixels.rgba().as_flattened()), hash, "{stem}");
        // The largest level is the last in the file.
        for length in 12..bytes.len() {
            let error = decode_ldr(&bytes[..length], stem).expect_err(stem).to_string();
            assert!(error.starts_with(stem) && !error.contains('\n'), "{error}");
        }
    }
}

/// A file of one level.
#[derive(Clone)]
struct Made {
    format: u32,
    size: [u32; 2],
    /// Depth, layers, faces, levels, scheme.
    header: [u32; 5],
    model: u8,
    flags: u8,
    metadata: Vec<(&'static str, &'static str)>,
    level: Vec<u8>,
}

impl Made {
    /// Two columns and three rows of RGBA: red is the column, green the row, blue 7, opacity 9.
    fn rgba() -> Self {
        let level = (0..6).flat_map(|i| [i % 2, i / 2, 7, 9]).collect();
        Self {
            format: 37,
            size: [2, 3],
            header: [0, 0, 1, 1, 0],
            model: 1,
            flags: 0,
            metadata: Vec::new(),
            level,
        }
    }

    fn bytes(&self) -> Vec<u8> {
        const HEADERS: usize = 104;
        let mut metadata = Vec::new();
        for (key, value) in &self.metadata {
            let entry = format!("{key}\0{value}\0");
            metadata.extend((entry.len() as u32).to_le_bytes());
            metadata.extend(entry.as_bytes());
            metadata.resize(metadata.len().next_multiple_of(4), 0);
        }
        let mut descriptor = vec![0; 28];
        (descriptor[12], descriptor[15]) = (self.model, self.flags);
        let level_at = HEADERS + descriptor.len() + metadata.len();
        let words = [
            &[self.format, 1, self.size[0], self.size[1]],
            &self.header[..],
            &[HEADERS as u32, descriptor.len() as u32],
            &[(HEADERS + descriptor.len()) as u32, metadata.len() as u32, 0, 0, 0, 0],
            &[level_at as u32, 0, self.level.len() as u32, 0, self.level.len() as u32, 0],
        ];
        let mut bytes = b"\xabKTX 20\xbb\r\n\x1a\n".to_vec();
        words.concat().iter().for_each(|word| bytes.extend(word.to_le_bytes()));
        [&bytes[..], &descriptor, &metadata, &self.level].concat()
    }

    fn decoded(&self) -> LdrImage {
        decode_ldr(&self.bytes(), "made.ktx2").expect("a sound file")
    }

    fn cause(&self) -> String {
        let error = decode_ldr(&self.bytes(), "made.ktx2").expect_err("a faulty file").to_string();
        error.strip_prefix("made.ktx2: ").expect("the file's name").to_owned()
    }
}

/// A frame of Zstandard: one block, of the bytes or (`run`) of the first so many times.
fn zstandard(bytes: &[u8], run: Option<u32>) -> Vec<u8> {
    let (kind, size, data) = match run {
        Some(count) => (1, count, &bytes[..1]),
        None => (0, bytes.len() as u32, bytes),
    };
    let header = ((size << 3) | (kind << 1) | 1).to_le_bytes();
    [&[0x28, 0xb5, 0x2f, 0xfd, 0x20, size.min(255) as u8], &header[..3], data].concat()
}

#[test]
fn plain_pictures_have_their_bytes() {
    let sound = Made::rgba();
    let upright: Vec<[u8; 4]> = (0..6).map(|i| [i % 2, i / 2, 7, 9]).collect();
    assert_eq!(sound.decoded().pixels.rgba()[..], upright);
    for format in [43, 44, 50] {
        let swapped = format != 43;
        let expected =
            upright.iter().map(|&[r, g, b, a]| if swapped { [b, g, r, a] } else { [r, g, b, a] });
        let made = Made { format, ..sound.clone() };
        assert_eq!(made.decoded().pixels.rgba()[..], expected.collect::<Vec<_>>(), "{format}");
    }
    // What there is not, is black and opaque, as Vulkan has it.
    for (format, pixels) in [
        (9, [[1, 0, 0, 255], [2, 0, 0, 255]]),
        (22, [[1, 2, 0, 255], [3, 4, 0, 255]]),
        (29, [[1, 2, 3, 255], [4, 5, 6, 255]]),
        (30, [[3, 2, 1, 255], [6, 5, 4, 255]]),
    ] {
        let made = Made { format, size: [2, 1], level: (1..7).collect(), ..sound.clone() };
        assert_eq!(made.decoded().pixels.rgba()[..], pixels, "{format}");
    }
    let packed = |level| Made { header: [0, 0, 1, 1, 2], level, ..sound.clone() };
    assert_eq!(packed(zstandard(&sound.level, None)).decoded().pixels.rgba()[..], upright);
    assert_eq!(packed(zstandard(&[5], Some(24))).decoded().pixels.rgba()[..], [[5; 4]; 6]);
}

/// A file may be so short that whether it has pixels at all is tried first.
#[test]
fn one_colour_may_fill_a_large_picture() {
    let bytes = encoded("etc1s-one-colour-4096x2048");
    let decoded = decode_ldr(&bytes, "one").expect("a sound file");
    assert_eq!((decoded.width, decoded.height), (4096, 2048));
    // ETC1S has five bits a channel.
    let expected = vec![[200, 100, 50, 255]; 4096 * 2048];
    assert!(
        differences(&decoded.pixels.rgba(), &expected).0 <= 8,
        "{:?}",
        decoded.pixels.rgba()[0]
    );

    // 160 runs of 128 kB.
    let run = |i| [u8::from(i == 159) | (1 << 1), 0, 16, 7];
    let frame = [0x28, 0xb5, 0x2f, 0xfd, 0, 7 << 3].into_iter().chain((0..160).flat_map(run));
    let large = Made {
        size: [2048, 2560],
        header: [0, 0, 1, 1, 2],
        level: frame.collect(),
        ..Made::rgba()
    };
    assert_eq!(large.decoded().pixels.rgba()[..], vec![[7; 4]; 2048 * 2560]);
    let found = Made { size: [2048, 2561], ..large }.cause();
    assert!(found.contains("holds too few pixels for 2561 rows"), "{found}");
}

#[test]
fn metadata_say_where_rows_and_channels_are() {
    let with =
        |key, value| Made { metadata: vec![("KTXwriter", "me"), (key, value)], ..Made::rgba() };
    let corner = |key, value| with(key, value).decoded().pixels.rgba()[0];
    assert_eq!(corner("KTXorientation", "rd"), [0, 0, 7, 9]);
    assert_eq!(corner("KTXorientation", "ru"), [0, 2, 7, 9]);
    assert_eq!(corner("KTXorientation", "ld"), [1, 0, 7, 9]);
    assert_eq!(corner("KTXorientation", "lu"), [1, 2, 7, 9]);
    assert_eq!(
        with("KTXorientation", "ru").decoded().pixels.rgba()[2],
        [0, 1, 7, 9],
        "the middle row"
    );
    assert_eq!(corner("KTXswizzle", "rgba"), [0, 0, 7, 9]);
    assert_eq!(corner("KTXswizzle", "bar1"), [7, 9, 0, 255]);
    assert_eq!(corner("KTXswizzle", "b00g"), [7, 0, 0, 0]);
    let premultiplied = Made { flags: 1, ..Made::rgba() };
    assert!(premultiplied.decoded().is_premultiplied);
    assert_eq!(premultiplied.decoded().pixels.rgba()[0], [0, 0, 7, 9]);
}

#[test]
fn what_cannot_be_read_is_said() {
    let sound = Made::rgba();
    for (header, cause) in [
        ([2, 0, 1, 1, 0], "not one flat picture"),
        ([0, 2, 1, 1, 0], "not one flat picture"),
        ([0, 0, 6, 1, 0], "not one flat picture"),
        ([0, 0, 1, 1, 3], "packed by scheme 3"),
        ([0, 0, 1, 1, 2], "no Zstandard data"),
    ] {
        let found = Made { header, ..sound.clone() }.cause();
        assert!(found.contains(cause), "{found}");
    }
    let found = Made { format: 97, ..sound.clone() }.cause();
    assert!(found.contains("Vulkan's format 97"), "{found}");
    let found = Made { format: 0, model: 167, ..sound.clone() }.cause();
    assert!(found.contains("colour model 167 in scheme 0"), "{found}");
    let found = Made { size: [2, 4], ..sound.clone() }.cause();
    assert!(found.contains("too few pixels for 4 rows"), "{found}");
    let found = Made { size: [0, 4], ..sound.clone() }.cause();
    assert!(found.contains("no pixels"), "{found}");
    let found = Made { size: [16_000, 16_000], ..sound.clone() }.cause();
    assert!(found.contains("more pixels than its"), "{found}");
    // A window of 1 GiB to look back at.
    let level = vec![0x28, 0xb5, 0x2f, 0xfd, 0, 20 << 3, 1, 0, 0];
    let found = Made { header: [0, 0, 1, 1, 2], level, ..sound }.cause();
    assert!(found.contains("no Zstandard data"), "{found}");
}

/// A square with materials, textures and images.
fn textured(builder: &Builder, material: &str, textures: &str, images: &str) -> Scene {
    let mesh = ONE_MESH.replace(r#""indices":1"#, r#""indices":1,"material":0"#);
    builder.load(&format!(
        r#"{mesh},"extensionsUsed":["KHR_texture_basisu"],"materials":[{{{material}}}],
        "textures":[{textures}],"images":[{images}],"samplers":[{{"wrapS":33071,"magFilter":9728}}]"#
    ))
}

const BASE: &str = r#""pbrMetallicRoughness":{"baseColorTexture":{"index":0}}"#;
const PNG: &str = "data:image/png;base64,\
    iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4z8AAAAMBAQDJ/pLvAAAAAElFTkSuQmCC";

#[test]
fn textures_are_of_basis_pictures() {
    let mut builder = square();
    let view = builder.view(&encoded("uastc-rgba-14x9-zstd"));
    let mesh = ONE_MESH.replace(r#""indices":1"#, r#""indices":1,"material":0"#);
    let scene = builder.load(&format!(
        r#"{mesh},"extensionsUsed":["KHR_texture_basisu","KHR_texture_transform"],
        "extensionsRequired":["KHR_texture_basisu"],"materials":[{{"pbrMetallicRoughness":{{
        "baseColorTexture":{{"index":0,"extensions":{{"KHR_texture_transform":{{"scale":[2,3]}}}}}},
        "metallicRoughnessTexture":{{"index":0}}}}}}],
        "textures":[{{"sampler":0,"extensions":{{"KHR_texture_basisu":{{"source":0}}}}}}],
        "images":[{{"bufferView":{view},"mimeType":"image/ktx2"}}],
        "samplers":[{{"wrapS":33071,"magFilter":9728}}]"#
    ));
    assert!(scene.notices.is_empty(), "{:?}", scene.notices);
    // Colour and data: one image, the same bytes, decoded as each is used.
    assert_eq!((scene.images.len(), scene.textures.len()), (1, 2));
    assert_eq!([scene.textures[0].srgb, scene.textures[1].srgb], [true, false]);
    assert!(scene.textures[0].nearest && scene.textures[0].wrap_u == Wrap::ClampToEdge);
    let expected = decode_ldr(&encoded("uastc-rgba-14x9"), "it").expect("a sound file");
    assert_eq!((scene.images[0].width, scene.images[0].height), (14, 9));
    assert_eq!(scene.images[0].texels, expected.pixels);
    let placed = scene.materials[0].texture(TextureSlot::BaseColor).expect("a texture").transform;
    assert_eq!(placed.transform_point2(glam::Vec2::ONE), glam::Vec2::new(2.0, 3.0));
}

#[test]
fn a_file_beside_the_scene_needs_no_extension() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("a.ktx2"), encoded("etc1s-rgb-13x10-mips")).expect("written");
    let mesh = ONE_MESH.replace(r#""indices":1"#, r#""indices":1,"material":0"#);
    let glb = square().glb(&format!(
        r#"{mesh},"materials":[{{{BASE}}}],"textures":[{{"source":0}}],"images":[{{"uri":"a.ktx2"}}]"#
    ));
    let scene = gltf::load_slice(&glb, Some(folder.path()), "made.glb").expect("a sound file");
    assert!(scene.notices.is_empty(), "{:?}", scene.notices);
    assert_eq!((scene.images[0].width, scene.images[0].height), (13, 10));
}

#[test]
fn what_cannot_be_read_is_replaced() {
    let both = r#"{"source":0,"extensions":{"KHR_texture_basisu":{"source":1}}}"#;
    let mut builder = square();
    let sound = builder.view(&encoded("etc1s-rgba-14x9"));
    let spoilt = builder.view(&encoded("etc1s-rgba-14x9")[..200]);
    let ktx2 = |view| format!(r#"{{"bufferView":{view},"mimeType":"image/ktx2"}}"#);
    let notices = |scene: &Scene| scene.notices.iter().map(str::to_owned).collect::<Vec<_>>();

    // The better picture is taken, and the other not even looked at.
    let scene = textured(&builder, BASE, both, &format!(r#"{{"uri":"gone.png"}},{}"#, ktx2(sound)));
    assert!(scene.notices.is_empty(), "{:?}", scene.notices);
    assert_eq!((scene.images.len(), scene.images[0].width), (1, 14));

    let scene = textured(&builder, BASE, both, &format!(r#"{{"uri":"{PNG}"}},{}"#, ktx2(spoilt)));
    let said = "Image 1 cannot be used: its data: is cut off: it refers to more than its 200 bytes; \
                Image 0 (data URI) is used instead";
    assert_eq!(notices(&scene), [said]);
    assert_eq!((scene.images.len(), scene.images[0].width), (1, 1));
    assert!(scene.materials[0].texture(TextureSlot::BaseColor).is_some());

    let scene =
        textured(&builder, BASE, both, &format!(r#"{{"uri":"gone.png"}},{}"#, ktx2(spoilt)));
    assert!(notices(&scene)[0].ends_with("200 bytes; materials do without it"));
    assert!(
        scene.materials[0].texture(TextureSlot::BaseColor).is_none() && scene.images.is_empty()
    );

    let view = builder.view(&Made { flags: 1, ..Made::rgba() }.bytes());
    let scene = textured(&builder, BASE, r#"{"source":0}"#, &ktx2(view));
    let said = "Image 0 has colours multiplied by their opacity, which glTF does not know; \
                they are used as they are";
    assert_eq!(notices(&scene), [said]);
}
