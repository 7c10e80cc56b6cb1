//! A mesh packed by Draco in each of its ways.

use draco_core::{
    DataType, EncoderBuffer, EncoderOptions, FaceIndex, GeometryAttributeType, Mesh, MeshEncoder,
    PointAttribute,
};

/// Vertices along a side of the mesh.
pub(crate) const SIDE: usize = 12;

/// A vertex of the mesh: a hilly square whose left and right half have texture coordinates of their own,
/// so that vertices in the middle are there twice.
pub(crate) struct Vertex {
    pub(crate) position: [f32; 3],
    pub(crate) normal: [f32; 3],
    pub(crate) uv: [f32; 2],
}

/// Vertices and triangles.
pub(crate) fn hills() -> (Vec<Vertex>, Vec<[u32; 3]>) {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    let half = SIDE / 2;
    for (first, last) in [(0, half), (half, SIDE - 1)] {
        let (start, width) = (vertices.len() as u32, (last - first + 1) as u32);
        for (row, column) in (0..SIDE).flat_map(|row| (first..=last).map(move |x| (row, x))) {
            let [x, y] = [column, row].map(|i| i as f32 / (SIDE - 1) as f32);
            let (along, across) = (-1.5 * (6.0 * x).cos(), 1.5 * (6.0 * y).sin());
            let length = (along * along + across * across + 1.0).sqrt();
            vertices.push(Vertex {
                position: [x, y, 0.25 * ((6.0 * x).sin() + (6.0 * y).cos())],
                normal: [along, across, 1.0].map(|x| x / length),
                uv: [if first == 0 { x } else { 1.0 - x }, y],
            });
        }
        let rows = SIDE as u32 - 1;
        for corner in (0..rows).flat_map(|row| (0..width - 1).map(move |x| row * width + x)) {
            let [a, b, c, d] = [0, 1, width, width + 1].map(|step| start + corner + step);
            triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    (vertices, triangles)
}

/// The mesh, packed to this level: 0 keeps the order, higher ones walk over it (4 plainly, 7 with valences).
/// Its positions, normals and texture coordinates are the attributes 0, 1 and 2.
pub(crate) fn draco(level: i32) -> Vec<u8> {
    let (vertices, triangles) = hills();
    let mut mesh = Mesh::new();
    let mut add = |kind, size, values: Vec<f32>| {
        let mut attribute = PointAttribute::new();
        attribute.init(kind, size, DataType::Float32, false, vertices.len());
        attribute.buffer_mut().update_f32s_le(0, &values);
        mesh.add_attribute(attribute);
    };
    let all = |of: fn(&Vertex) -> &[f32]| vertices.iter().flat_map(of).copied().collect();
    add(GeometryAttributeType::Position, 3, all(|vertex| &vertex.position));
    add(GeometryAttributeType::Normal, 3, all(|vertex| &vertex.normal));
    add(GeometryAttributeType::TexCoord, 2, all(|vertex| &vertex.uv));
    mesh.set_num_faces(triangles.len());
    for (number, triangle) in (0..).zip(&triangles) {
        mesh.set_face(FaceIndex(number), triangle.map(Into::into));
    }
    let mut options = EncoderOptions::new();
    options.set_compression_level(level);
    [14, 10, 12]
        .iter()
        .zip(0..)
        .for_each(|(&bits, id)| options.set_attribute_quantization(id, bits));
    let mut encoder = MeshEncoder::new();
    encoder.set_mesh(mesh);
    let mut packed = EncoderBuffer::new();
    encoder.encode(&options, &mut packed).expect("a sound mesh");
    packed.data().to_vec()
}
