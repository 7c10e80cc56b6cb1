//! Sound files to begin with, all made here.

use std::io::Cursor;

use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, Layer,
    LayerAttributes, LineOrder, SmallVec, Vec2, WritableImage, f16,
};
use image::{DynamicImage, ImageFormat, Rgba, RgbaImage};

use crate::shared::exr_header;
use crate::{corpus, packed, targets};

/// The seeds of a target.
pub(crate) fn of(target: &str) -> Vec<Vec<u8>> {
    match target {
        "gltf" => {
            let mut files: Vec<_> = corpus::gltf().into_iter().map(corpus::gltf_file).collect();
            files.push(animated());
            files.extend(meshopt().iter().filter_map(|input| targets::meshopt_file(input)));
            files.extend(draco().iter().filter_map(|input| targets::draco_file(input)));
            files
        }
        "meshopt" => meshopt(),
        "draco" => draco(),
        "textures" => [corpus::textures(), pictures()].concat(),
        "exr" => [starting_with(b"\x76\x2f\x31\x01"), exrs(), vec![subsampled()]].concat(),
        "hdr" => starting_with(b"#?"),
        "maps" => [starting_with(b"\x89PNG"), pictures()].concat(),
        #[cfg(feature = "window")]
        "settings" => crate::settings::corpus(),
        _ => Vec::new(),
    }
}

fn starting_with(magic: &[u8]) -> Vec<Vec<u8>> {
    corpus::maps().into_iter().filter(|file| file.starts_with(magic)).collect()
}

/// A small picture in each of the formats.
fn pictures() -> Vec<Vec<u8>> {
    let picture = RgbaImage::from_fn(11, 7, |x, y| {
        Rgba([x * 20, y * 30, x * y % 7 * 40, 255 - x * 3].map(|v| v as u8))
    });
    let picture = DynamicImage::from(picture);
    let [deep, grey, opaque] =
        [picture.to_rgb16().into(), picture.to_luma8().into(), picture.to_rgb8().into()];
    let kinds: [(&DynamicImage, ImageFormat); 11] = [
        (&picture, ImageFormat::Png),
        (&deep, ImageFormat::Png),
        (&grey, ImageFormat::Png),
        (&grey, ImageFormat::Jpeg),
        (&opaque, ImageFormat::Jpeg),
        (&picture, ImageFormat::WebP),
        (&opaque, ImageFormat::WebP),
        (&picture, ImageFormat::Tiff),
        (&deep, ImageFormat::Tiff),
        (&opaque, ImageFormat::Bmp),
        (&picture, ImageFormat::Tga),
    ];
    let written = kinds.map(|(picture, format)| {
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format).expect("written");
        bytes.into_inner()
    });
    written.into()
}

/// An OpenEXR file of each compression, in lines and in tiles, of half and of full precision.
fn exrs() -> Vec<Vec<u8>> {
    let all = [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::ZIP16,
        Compression::PIZ,
        Compression::PXR24,
        Compression::B44,
        Compression::B44A,
    ];
    let size = Vec2(13, 9);
    let values = (0..size.area()).map(|i| (i * i % 101) as f32 * 0.3);
    let halves: Vec<f16> = values.clone().map(f16::from_f32).collect();
    let floats: Vec<f32> = values.collect();
    let mut files = Vec::new();
    for (number, compression) in all.into_iter().enumerate() {
        let samples = if number % 2 == 0 {
            FlatSamples::F16(halves.clone())
        } else {
            FlatSamples::F32(floats.clone())
        };
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(8, 4))] {
            let line_order = LineOrder::Increasing;
            let encoding = Encoding { compression, blocks, line_order };
            let channels: SmallVec<_> = ["B", "G", "R"]
                .map(|name| AnyChannel::new(name, samples.clone()))
                .into_iter()
                .collect();
            let attributes = LayerAttributes::named("a");
            let layer = Layer::new(size, attributes, encoding, AnyChannels::sort(channels));
            let mut bytes = Cursor::new(Vec::new());
            let written = Image::from_layer(layer).write().non_parallel().to_buffered(&mut bytes);
            written.expect("written");
            files.push(bytes.into_inner());
        }
    }
    files
}

/// Luminance of every pixel, and the colour of every fourth: four lines, not compressed.
fn subsampled() -> Vec<u8> {
    let mut file = exr_header(&[("BY", 2), ("RY", 2), ("Y", 1)], [3; 2], [3; 2]);
    let bytes = |line: usize| if line % 2 == 0 { 16 } else { 8 };
    let mut offset = file.len() + 4 * 8;
    for line in 0..4 {
        file.extend((offset as u64).to_le_bytes());
        offset += 8 + bytes(line);
    }
    for line in 0..4 {
        file.extend((line as u32).to_le_bytes());
        file.extend((bytes(line) as u32).to_le_bytes());
        file.extend((0..bytes(line)).map(|at| if at % 2 == 0 { 7 } else { 0x38 + line as u8 }));
    }
    file
}

/// Packed bytes of each mode and filter, after the bytes that say so.
fn meshopt() -> Vec<Vec<u8>> {
    let corners: Vec<[f32; 3]> =
        (0..60).map(|i| [i as f32, (i as f32).sin(), 1.0 / (1 + i) as f32]).collect();
    let normals: Vec<[f32; 4]> = (0..60)
        .map(|i| {
            let (sin, cos) = (i as f32 * 0.1).sin_cos();
            [0.8 * sin, 0.6, 0.8 * cos, 0.0]
        })
        .collect();
    let indices: Vec<u32> = (0..58).flat_map(|i| [i, i + 1, i + 2]).collect();
    let vertices = |values: &[[i16; 4]]| meshopt::encode_vertex_buffer(values).expect("packed");
    let small = meshopt::encode_filter_oct::<i8>(&normals, 8);
    let colors = meshopt::encode_filter_color::<u16>(&normals, 16);
    let powers = meshopt::encode_filter_exp(&corners, 15, meshopt::EncodeExpMode::Separate);
    let triangles = meshopt::encode_index_buffer(&indices, 60).expect("packed");
    let sequence = meshopt::encode_index_sequence(&indices, 60).expect("packed");
    let packed = |bytes: Result<Vec<u8>, _>| -> Vec<u8> { bytes.map_err(drop).expect("packed") };
    [
        (0, 12, 60_u16, packed(meshopt::encode_vertex_buffer(&corners))),
        (3, 8, 60, vertices(&meshopt::encode_filter_oct(&normals, 16))),
        (3, 4, 60, packed(meshopt::encode_vertex_buffer(&small))),
        (6, 8, 60, vertices(&meshopt::encode_filter_quat(&normals, 12))),
        (9, 12, 60, packed(meshopt::encode_vertex_buffer(&powers))),
        (12, 8, 60, packed(meshopt::encode_vertex_buffer(&colors))),
        (1, 2, 174, triangles.clone()),
        (1, 4, 174, triangles),
        (2, 2, 174, sequence.clone()),
        (2, 4, 174, sequence),
    ]
    .map(|(kind, stride, count, bytes)| {
        let [low, high] = count.to_le_bytes();
        [&[kind, stride - 1, low, high], bytes.as_slice()].concat()
    })
    .into()
}

/// Two triangles packed plainly (the sequential method, indices and values uncompressed), and a mesh packed
/// in the other ways, with all its attributes promised.
fn draco() -> Vec<Vec<u8>> {
    let corners: [[f32; 3]; 4] = [[0.0; 3], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [0.0, 1.0, 0.5]];
    let mut bytes = b"\0DRACO\x02\x02\x01\x00\x00\x00".to_vec();
    bytes.extend([2, 4, 1, 0, 1, 2, 0, 2, 3]);
    bytes.extend([1, 1, 0, 9, 3, 0, 0, 0]);
    bytes.extend(corners.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
    let hills = [0, 4, 7, 10].map(|level| [vec![0b110], packed::draco(level)].concat());
    [vec![bytes], hills.into()].concat()
}

/// Cameras that move, a skin, variants, fog and the rest of what materials can be.
fn animated() -> Vec<u8> {
    let corners: [f32; 9] = [0., 0., 0., 1., 0., 0., 0., 1., 0.];
    let times: [f32; 3] = [0.0, 1.0, 3.0];
    let mut data: Vec<u8> = bytemuck::cast_slice(&corners).to_vec();
    data.extend(bytemuck::cast_slice::<f32, u8>(&times));
    data.extend([0, 1, 0, 1, 1, 0, 1, 0, 0, 0, 0, 1]);
    data.extend([200, 55, 0, 0, 255, 0, 0, 0, 0, 0, 0, 0]);
    let unit = [1.0_f32, 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];
    data.extend(bytemuck::cast_slice::<f32, u8>(&[unit, unit].concat()));
    let json = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1,2,3],"extras":{"fog":
        {"scattering":0.05,"absorption":[0.0,0.001,0.002],"anisotropy":0.6,"box":[[-5,0,-5],[5,3,5]]}}}],
        "nodes":[{"mesh":0,"skin":0},{"camera":0,"children":[4]},{"camera":1,"matrix":[1,0,0,0,0,1,0,0,0,0,1,
        0,1,2,3,1]},{"mesh":1,"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":0,"SCALE":0}}}},
        {"extensions":{"KHR_lights_punctual":{"light":1}}}],
        "cameras":[{"type":"perspective","perspective":{"yfov":0.8,"znear":0.1,"aspectRatio":1.5}},
        {"type":"orthographic","orthographic":{"xmag":2,"ymag":1,"znear":0.1,"zfar":9}}],
        "animations":[{"channels":[{"sampler":0,"target":{"node":1,"path":"translation"}},{"sampler":1,"target":
        {"node":1,"path":"scale"}}],"samplers":[{"input":1,"output":0},{"input":1,"output":0,"interpolation":"STEP"}]}],
        "skins":[{"joints":[0,3],"inverseBindMatrices":4,"skeleton":0}],
        "extensionsUsed":["KHR_materials_variants","KHR_lights_punctual"],
        "extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","intensity":40},{"type":"directional",
        "color":[1,0.5,0.2]}]},"KHR_materials_variants":{"variants":[{"name":"a"}]}},
        "meshes":[{"name":"m","primitives":[{"attributes":{"POSITION":0,"JOINTS_0":2,"WEIGHTS_0":3},"material":0,
        "extensions":{"KHR_materials_variants":{"mappings":[{"material":1,"variants":[0]}]}}}]},
        {"primitives":[{"attributes":{"POSITION":0},"material":1,"mode":5},{"attributes":{"POSITION":0},"material":2,"mode":6}]}],
        "materials":[{"doubleSided":true,"alphaMode":"BLEND","pbrMetallicRoughness":{"baseColorFactor":[1,0.5,0.2,0.5]},
        "emissiveFactor":[1,1,1],"extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":3},
        "KHR_materials_specular":{"specularFactor":0.5,"specularColorFactor":[1,0.9,0.5]}}},
        {"extensions":{"KHR_materials_unlit":{}}},
        {"name":"old","extensions":{"KHR_materials_pbrSpecularGlossiness":{"diffuseFactor":[1,0,0,1],"specularFactor":
        [0.5,0.5,0.5],"glossinessFactor":0.7}}}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
        {"bufferView":1,"componentType":5126,"count":3,"type":"SCALAR"},
        {"bufferView":2,"componentType":5121,"count":3,"type":"VEC4"},
        {"bufferView":3,"componentType":5121,"normalized":true,"count":3,"type":"VEC4"},
        {"bufferView":4,"componentType":5126,"count":2,"type":"MAT4"}],
        "bufferViews":[{"buffer":0,"byteLength":36,"byteStride":12},{"buffer":0,"byteOffset":36,"byteLength":12},
        {"buffer":0,"byteOffset":48,"byteLength":12},{"buffer":0,"byteOffset":60,"byteLength":12},
        {"buffer":0,"byteOffset":72,"byteLength":128}],"buffers":[{"byteLength":200}]}"#;
    corpus::container(json.to_owned(), data)
}
