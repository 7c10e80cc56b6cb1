//! Sound files to spoil, all made here.

use std::io::Write as _;

use lightgrid::image::{ExrPicture, Image, Layer, Rgb8, write_exr, write_png};
use lightgrid::sampler::SplitMix;

/// Command lines that are accepted.
pub(crate) const LINES: [&str; 14] = [
    "view",
    "view office --env sky:night",
    "screenshot living-room --overlay visits --panel inspect -o a.png",
    "render office -o a.exr -o a.png",
    "render crack --env sky:day@64x32 --env-rotation 30 --env-intensity 0.5 -o a.exr",
    "render open --eye 1,2,3 --target 0,0,0 --fov 50 --lens-radius 0.1 --focus 2 -o a.png",
    "render open --size 320x200 --filter gauss --exposure auto --tonemap aces -o a.png",
    "render open --exposure -1.5 --layers albedo,normal,all -o a.exr",
    "render fog --spp 16 --seconds 5 --noise 0.05 --sampling talk --table u32 -o a.exr",
    "render fog --bounces 3 --no-russian-roulette --tiles 16x8 --grid 32 -o a.exr",
    "render fog --learning-paths 1000 --seed 7 --device cpu --threads 2 --json a.json -o a.exr",
    "compare a.exr b.exr --json",
    "info office --json",
    "sat sky:day sky:night --json",
];

/// Maps of every kind that we write, and hand-made `.hdr` ones.
pub(crate) fn maps() -> Vec<Vec<u8>> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let mut random = SplitMix(11);
    let image = Image::from_fn(24, 12, |_, _| [0; 3].map(|_| random.next_f32() * 8.0));
    let count = image.pixels.len();
    let depth = Layer { name: "depth".into(), channels: vec![("Z".into(), vec![1.0; count])] };
    let metadata = [("lightgrid.scene".to_owned(), "office".to_owned())];
    let picture =
        ExrPicture { image: &image, layers: vec![depth], metadata: &metadata, preview: None };
    write_exr(&path("a.exr"), picture).expect("written");
    let plain = ExrPicture { image: &image, layers: Vec::new(), metadata: &[], preview: None };
    write_exr(&path("b.exr"), plain).expect("written");
    let rgb = Rgb8 {
        width: 16,
        height: 8,
        pixels: (0..128).map(|_| [random.next_bits() as u8; 3]).collect(),
    };
    write_png(&path("a.png"), &rgb, None, &metadata).expect("written");
    let mut files = vec![hdr(24, 12, false), hdr(24, 12, true), old_runs()];
    for name in ["a.exr", "b.exr", "a.png"] {
        files.push(std::fs::read(path(name)).expect("readable"));
    }
    files
}

/// KTX 2 files of Basis Universal and of plain pixels, and a PNG.
pub(crate) fn textures() -> Vec<Vec<u8>> {
    let mut files: Vec<_> = KTX2.iter().map(|file| file.to_vec()).collect();
    // The level's 192 bytes as Vulkan's RGBA.
    let mut plain = KTX2[0].to_vec();
    (plain[12], plain[20], plain[24]) = (37, 4, 12);
    files.push(plain);
    files.extend(maps().pop());
    files
}

fn hdr(width: u8, height: u8, runs: bool) -> Vec<u8> {
    let mut bytes = b"#?RADIANCE\nEXPOSURE=2\nFORMAT=32-bit_rle_rgbe\n\n".to_vec();
    let _ = writeln!(bytes, "-Y {height} +X {width}");
    for row in 0..height {
        if runs {
            bytes.extend([2, 2, 0, width]);
            for channel in 0..4 {
                // Half of the row in one run, the rest literally.
                bytes.extend([128 + width / 2, row * 8 + channel, width - width / 2]);
                bytes.extend((0..width - width / 2).map(|x| 120 + x % 16));
            }
        } else {
            (0..width).for_each(|x| bytes.extend([x, row, 99, 128]));
        }
    }
    bytes
}

fn old_runs() -> Vec<u8> {
    let mut bytes = b"#?RADIANCE\nCOLORCORR=1 2 1\nFORMAT=32-bit_rle_xyze\n\n+X 6 -Y 7\n".to_vec();
    (0..6).for_each(|x| bytes.extend([x, 50, 60, 130, 1, 1, 1, 6]));
    bytes
}

/// JSON and data of a GLB with most of what is read, and of a glTF with its data in itself.
pub(crate) fn gltf() -> Vec<(String, Vec<u8>)> {
    vec![featured(), (embedded(), Vec::new())]
}

/// The bytes of a glTF file: a GLB if there is data beside the JSON.
pub(crate) fn gltf_file((json, data): (String, Vec<u8>)) -> Vec<u8> {
    if data.is_empty() { json.into_bytes() } else { container(json, data) }
}

/// The last is of ETC1S with opacity.
const KTX2: [&[u8]; 5] = [
    include_bytes!("../ktx2/uastc-rgba-14x9.ktx2"),
    include_bytes!("../ktx2/uastc-rgba-14x9-zstd.ktx2"),
    include_bytes!("../ktx2/uastc-rgb-13x10-mips-zstd.ktx2"),
    include_bytes!("../ktx2/etc1s-rgb-13x10-mips.ktx2"),
    include_bytes!("../ktx2/etc1s-rgba-14x9.ktx2"),
];

/// A PNG of one red pixel.
const PNG: &str =
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAIAAACQd1PeAAAADElEQVR4nGP4z8AAAAMBAQDJ/pLvAAAAAElFTkSuQmCC";

fn embedded() -> String {
    // Three corners of 36 bytes: (0,0,0), (1,0,0), (0,1,0).
    let corners = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0,1]}}],"nodes":[{{"mesh":0}},
        {{"camera":0,"translation":[0,0,3]}}],"cameras":[{{"type":"perspective","perspective":
        {{"yfov":0.8,"znear":0.1}}}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},
        "material":0}}]}}],"accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],"buffers":[{{"byteLength":36,
        "uri":"data:application/octet-stream;base64,{corners}"}}],"materials":[{{"alphaMode":"MASK",
        "alphaCutoff":0.5,"emissiveFactor":[1,0.5,0],"extensions":{{"KHR_materials_transmission":
        {{"transmissionFactor":0.5}},"KHR_materials_volume":{{"thicknessFactor":1,"attenuationDistance":
        2,"attenuationColor":[0.5,0.5,1]}},"KHR_materials_ior":{{"ior":1.3}},
        "KHR_materials_dispersion":{{"dispersion":2}},"KHR_materials_diffuse_transmission":
        {{"diffuseTransmissionFactor":0.5,"diffuseTransmissionColorFactor":[1,0.5,0.5]}}}},"pbrMetallicRoughness":
        {{"metallicFactor":0.5,"roughnessFactor":0.1}}}}]}}"#
    )
}

fn featured() -> (String, Vec<u8>) {
    let mut data: Vec<u8> = Vec::new();
    let mut views = Vec::new();
    let mut add = |values: &[f32]| {
        views.push(format!(
            r#"{{"buffer":0,"byteOffset":{},"byteLength":{}}}"#,
            data.len(),
            4 * values.len()
        ));
        data.extend(bytemuck::cast_slice::<f32, u8>(values));
    };
    add(&[0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.]);
    add(&[0., 0., 1., 0., 0., 1., 0., 0., 1., 0., 0., 1.]);
    add(&[0., 1., 1., 1., 1., 0., 0., 0.]);
    add(&[1., 0., 0., 1., 1., 0., 0., 1., 1., 0., 0., 1., 1., 0., 0., 1.]);
    views.push(format!(r#"{{"buffer":0,"byteOffset":{},"byteLength":12}}"#, data.len()));
    data.extend([0, 0, 1, 0, 2, 0, 0, 0, 2, 0, 3, 0]);
    let picture = KTX2[4];
    views.push(format!(
        r#"{{"buffer":0,"byteOffset":{},"byteLength":{}}}"#,
        data.len(),
        picture.len()
    ));
    data.extend(picture);
    let float = |view: u32, kind: &str, count: u32| {
        format!(r#"{{"bufferView":{view},"componentType":5126,"type":"{kind}","count":{count}}}"#)
    };
    let accessors = [
        float(0, "VEC3", 4),
        float(1, "VEC3", 4),
        float(2, "VEC2", 4),
        float(3, "VEC4", 4),
        r#"{"bufferView":4,"componentType":5123,"type":"SCALAR","count":6}"#.to_owned(),
        r#"{"componentType":5126,"type":"VEC3","count":4,"sparse":{"count":2,"indices":{"bufferView":4,"componentType":5123},"values":{"bufferView":0}}}"#.to_owned(),
    ];
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[
        {{"children":[1,2,3],"scale":[1,2,1]}},{{"mesh":0,"skin":0,"rotation":[0,0,0,1]}},
        {{"mesh":0,"weights":[0.5],"extensions":{{"EXT_mesh_gpu_instancing":{{"attributes":{{"TRANSLATION":1}}}}}}}},
        {{"extensions":{{"KHR_lights_punctual":{{"light":0}}}}}}],
        "extensions":{{"KHR_lights_punctual":{{"lights":[{{"type":"spot","intensity":40,"range":9,"spot":{{"outerConeAngle":0.6}}}}]}}}},
        "skins":[{{"joints":[0,1]}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1,
        "TEXCOORD_0":2,"TANGENT":3,"WEIGHTS_0":3}},"indices":4,"material":0,"mode":4,"targets":[{{"POSITION":5}}]}}]}}],
        "materials":[{{"normalTexture":{{"index":0,"scale":0.5}},"pbrMetallicRoughness":{{"baseColorTexture":
        {{"index":0,"extensions":{{"KHR_texture_transform":{{"offset":[0.5,0],"scale":[2,2]}}}}}}}},
        "extensions":{{"KHR_materials_clearcoat":{{"clearcoatFactor":1}},
        "KHR_materials_anisotropy":{{"anisotropyStrength":0.5,"anisotropyRotation":1,"anisotropyTexture":{{"index":0}}}},
        "KHR_materials_sheen":{{"sheenColorFactor":[1,0.5,0],"sheenRoughnessFactor":0.5}},
        "KHR_materials_iridescence":{{"iridescenceFactor":1,"iridescenceThicknessMaximum":300}}}}}}],
        "textures":[{{"source":0,"sampler":0,"extensions":{{"KHR_texture_basisu":{{"source":1}}}}}}],
        "samplers":[{{"wrapS":33071}}],
        "images":[{{"uri":"data:image/png;base64,{PNG}"}},{{"bufferView":5,"mimeType":"image/ktx2"}}],"buffers":[{{"byteLength":{}}}],
        "bufferViews":[{}],"accessors":[{}]}}"#,
        data.len(),
        views.join(","),
        accessors.join(",")
    );
    (json, data)
}

/// JSON and data in one GLB file.
pub(crate) fn container(json: String, mut data: Vec<u8>) -> Vec<u8> {
    let mut json = json.into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    data.resize(data.len().next_multiple_of(4), 0);
    let word = |value: usize| (value as u32).to_le_bytes();
    let length = 12 + 8 + json.len() + 8 + data.len();
    let mut bytes = [b"glTF", &word(2)[..], &word(length), &word(json.len()), b"JSON"].concat();
    bytes.extend(&json);
    bytes.extend([&word(data.len())[..], b"BIN\0"].concat());
    bytes.extend(&data);
    bytes
}
