//! Small files that claim to be large. Each must be refused, and before anything of that size is
//! allocated.

use crate::corpus::container;
use crate::shared::exr_header;

/// File name (whose extension says what it is) and content.
pub(crate) fn all() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        // The issue's own: some hundred bytes, 1e9 pixels.
        ("pixels-1e9.hdr", hdr("-Y 31623 +X 31623", 40)),
        ("side-4e9.hdr", hdr("-Y 4294967295 +X 4294967295", 40)),
        ("row-of-65536.hdr", hdr("-Y 65536 +X 65536", 40)),
        // Enough bytes for a few in each row: only reading on shows that the pixels are not there.
        ("64-kb-for-16384x16384.hdr", hdr("-Y 16384 +X 16384", 65_536)),
        ("64-kb-on-its-side.hdr", hdr("+X 16384 -Y 16384", 65_536)),
        ("pixels-1e9.png", png(31_623, 31_623, 40)),
        ("16000x16000.png", png(16_000, 16_000, 64)),
        ("16000x16000-in-64-kb.png", png(16_000, 16_000, 65_536)),
        ("a-bit-a-pixel.png", png_of([1, 0], 32_767, 32_767, 65_536)),
        ("pixels-1e9.exr", exr([31_622; 2], [31_622; 2], 0)),
        ("16000x16000.exr", exr([15_999; 2], [15_999; 2], 0)),
        // What is seen may be larger than what there is data for, and then is black.
        ("16000x16000-around-24x12-in-64-kb.exr", exr([23, 11], [15_999; 2], 65_536)),
        ("pixels-1e9.bmp", bmp(31_623)),
        ("16000x16000.bmp", bmp(16_000)),
        ("60000x60000.tga", tga(60_000)),
        ("16000x16000.tga", tga(16_000)),
        ("16000x16000.ktx2", ktx2(16_000, 0, &[])),
        ("16000x16000-in-64-kb.ktx2", ktx2(16_000, 2, &runs(16_000))),
        ("too-few-runs.ktx2", ktx2(4096, 2, &runs(100))),
        ("values-3e6.tif", tiff(3_000_000)),
        ("values-4e9.tif", tiff(u32::MAX)),
        ("vertices-1e9.gltf", gltf(1_000_000_000, "", "")),
        ("vertices-1e9-of-zeros.gltf", gltf_zeros()),
        ("buffer-1e18.gltf", gltf(3, "", r#","byteLength":1000000000000000000"#)),
        ("instances-1e9.gltf", instances()),
        ("packed-triangles-1e8-of-1.glb", draco(100_000_000, 3, 3)),
        ("packed-triangles-1e9-as-promised.glb", draco(1_000_000_000, 3_000_000_000, 3)),
        ("packed-points-4e9.glb", draco(1, 3, 4_000_000_000)),
        ("chunk-4e9.glb", chunk()),
    ]
}

fn hdr(size: &str, bytes: usize) -> Vec<u8> {
    let mut file = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{size}\n").into_bytes();
    // Runs of the new kind where a row has that width, else plain pixels.
    file.extend([2, 2, 0x40, 0x00].iter().chain([255_u8, 7].iter().cycle()).take(bytes));
    file
}

fn png(width: u32, height: u32, bytes: usize) -> Vec<u8> {
    png_of([8, 2], width, height, bytes)
}

/// `kind`: bits of a channel, and PNG's number for what the channels are.
fn png_of(kind: [u8; 2], width: u32, height: u32, bytes: usize) -> Vec<u8> {
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut header = width.to_be_bytes().to_vec();
    header.extend(height.to_be_bytes());
    header.extend(kind);
    header.extend([0; 3]);
    chunk_of(&mut file, *b"IHDR", &header);
    // A zlib stream of one stored block, cut short.
    let mut data = vec![0x78, 0x01, 0x01];
    data.extend(((bytes.min(65_535)) as u16).to_le_bytes());
    data.extend((!(bytes.min(65_535)) as u16).to_le_bytes());
    data.resize(data.len() + bytes, 0);
    chunk_of(&mut file, *b"IDAT", &data);
    chunk_of(&mut file, *b"IEND", &[]);
    file
}

fn chunk_of(file: &mut Vec<u8>, name: [u8; 4], data: &[u8]) {
    file.extend((data.len() as u32).to_be_bytes());
    let start = file.len();
    file.extend(name);
    file.extend(data);
    let sum = crc32(&file[start..]);
    file.extend(sum.to_be_bytes());
}

/// PNG's checksum (ISO 3309), bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |sum, byte| {
        (0..8).fold(sum ^ u32::from(*byte), |sum, _| {
            if sum & 1 == 1 { (sum >> 1) ^ 0xedb8_8320 } else { sum >> 1 }
        })
    })
}

/// Scan lines of half floats, uncompressed, with zeros after the header. The windows of data and of what is
/// seen end at these pixels.
fn exr(data: [u32; 2], display: [u32; 2], zeros: usize) -> Vec<u8> {
    let mut file = exr_header(&[("B", 1), ("G", 1), ("R", 1)], data, display);
    file.resize(file.len() + zeros, 0);
    file
}

/// UASTC, whose pixels are so packed (0: as they are, 2: by Zstandard).
fn ktx2(side: u32, scheme: u32, level: &[u8]) -> Vec<u8> {
    let words = [
        0,
        1,
        side,
        side,
        0,
        0,
        1,
        1,
        scheme,
        104,
        44,
        0,
        0,
        0,
        0,
        0,
        0,
        148,
        0,
        level.len() as u32,
        0,
    ];
    let mut file = b"\xabKTX 20\xbb\r\n\x1a\n".to_vec();
    words.iter().for_each(|word: &u32| file.extend(word.to_le_bytes()));
    file.resize(104, 0);
    let mut descriptor = [0; 44];
    descriptor[12] = 166;
    file.extend(descriptor);
    file.extend(level);
    file
}

/// A frame of Zstandard with runs of zeros, 128 kB for four bytes.
fn runs(count: usize) -> Vec<u8> {
    let mut frame = vec![0x28, 0xb5, 0x2f, 0xfd, 0, 13 << 3];
    for i in 1..=count {
        let header = (131_072 << 3) | (1 << 1) | u32::from(i == count);
        frame.extend(&header.to_le_bytes()[..3]);
        frame.push(0);
    }
    frame
}

fn bmp(side: u32) -> Vec<u8> {
    let mut file = b"BM\x3e\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0".to_vec();
    file.extend(side.to_le_bytes());
    file.extend(side.to_le_bytes());
    file.extend([1, 0, 24, 0]);
    file.extend([0; 32]);
    file
}

fn tga(side: u16) -> Vec<u8> {
    let mut file = vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    file.extend(side.to_le_bytes());
    file.extend(side.to_le_bytes());
    file.extend([24, 0x20, 1, 2, 3, 4, 5, 6]);
    file
}

/// So many bits per sample, of which there are three.
fn tiff(count: u32) -> Vec<u8> {
    let mut file = b"II*\0\x08\0\0\0\x08\0".to_vec();
    let one = |tag: u16, value: u32| (tag, 1, value);
    let entries = [
        one(256, 2),
        one(257, 2),
        (258, count, 106),
        one(259, 1),
        one(262, 2),
        one(273, 112),
        one(277, 3),
        one(279, 12),
    ];
    for (tag, count, value) in entries {
        file.extend([tag, 3].map(u16::to_le_bytes).as_flattened());
        file.extend([count, value].map(u32::to_le_bytes).as_flattened());
    }
    file.resize(124, 8);
    file
}

/// A Draco stream that claims so many triangles, for accessors of so many corners and vertices.
fn draco(triangles: u64, corners: u64, vertices: u64) -> Vec<u8> {
    let mut stream = b"DRACO\x02\x02\x01\x01\0\0\0\x03".to_vec();
    let mut rest = triangles;
    while rest > 0x7f {
        stream.push(rest as u8 | 0x80);
        rest >>= 7;
    }
    stream.extend([rest as u8, 0, 1, 0, 0, 0, 0, 0, 0]);
    let length = stream.len();
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":
        {{"POSITION":0}},"indices":1,"extensions":{{"KHR_draco_mesh_compression":{{"bufferView":0,
        "attributes":{{"POSITION":0}}}}}}}}]}}],"extensionsUsed":["KHR_draco_mesh_compression"],
        "accessors":[{{"componentType":5126,"type":"VEC3","count":{vertices}}},
        {{"componentType":5125,"type":"SCALAR","count":{corners}}}],
        "bufferViews":[{{"buffer":0,"byteLength":{length}}}],"buffers":[{{"byteLength":{length}}}]}}"#
    );
    container(json, stream)
}

fn gltf(count: u64, accessor: &str, buffer: &str) -> Vec<u8> {
    let buffer = if buffer.is_empty() { r#","byteLength":36"# } else { buffer };
    let corners = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":
        [{{"attributes":{{"POSITION":0}}}}]}}],"accessors":[{{"bufferView":0,"componentType":5126,
        "count":{count},"type":"VEC3"{accessor}}}],"bufferViews":[{{"buffer":0,"byteLength":36}}],
        "buffers":[{{"uri":"data:application/octet-stream;base64,{corners}"{buffer}}}]}}"#
    )
    .into_bytes()
}

/// Vertices without a buffer view are zeros, which cost no bytes.
fn gltf_zeros() -> Vec<u8> {
    br#"{"asset":{"version":"2.0"},"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":
    {"POSITION":0}}]}],"accessors":[{"componentType":5126,"count":1000000000,"type":"VEC3"}]}"#
        .to_vec()
}

/// One triangle, a billion times.
fn instances() -> Vec<u8> {
    let corners: [f32; 9] = [0., 0., 0., 1., 0., 0., 0., 1., 0.];
    let json = r#"{"asset":{"version":"2.0"},"nodes":[{"mesh":0,"extensions":{"EXT_mesh_gpu_instancing":
        {"attributes":{"TRANSLATION":1}}}}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
        "extensionsUsed":["EXT_mesh_gpu_instancing"],"accessors":[{"bufferView":0,"componentType":5126,
        "count":3,"type":"VEC3"},{"componentType":5126,"count":1000000000,"type":"VEC3"}],
        "bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36}]}"#;
    container(json.to_owned(), bytemuck::cast_slice(&corners).to_vec())
}

fn chunk() -> Vec<u8> {
    let mut file = container("{}".to_owned(), vec![0; 8]);
    file[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
    file
}
