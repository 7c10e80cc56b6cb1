//! `KHR_draco_mesh_compression`: primitives whose triangles and vertices are packed together.

use std::collections::BTreeMap;

use draco_core::{
    DataType, DecodeLimits, DecoderBuffer, Mesh, MeshDecoder, PointAttribute, PointIndex,
};
use gltf::json;
use json::accessor::{ComponentType, Type};
use json::mesh::{Mode, Primitive};
use json::validation::Checked;
use serde::Deserialize;

use super::accessor::Elements;
use super::buffers::File;
use super::limits::{Fallible, MAX_TRIANGLES, check_count};
use crate::image::catch_panic;
use crate::memory;

/// Bytes that a corner takes while triangles are unpacked.
const CORNER_BYTES: u64 = 40;
/// Bytes of a vertex that attributes may take of which glTF knows nothing.
const OTHER_BYTES: u64 = 64;
/// Bytes of one component of an attribute: quantised first, then as it is.
const COMPONENT_BYTES: u64 = 8;

/// What the extension says of a primitive.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Packed {
    buffer_view: u32,
    /// Numbers of the packed attributes, by their names in glTF.
    attributes: BTreeMap<String, u32>,
}

/// An unpacked primitive.
pub(super) struct Unpacked {
    mesh: Mesh,
    points: usize,
    attributes: BTreeMap<String, u32>,
}

impl Unpacked {
    /// Unpacks a primitive; `None` if it is a plain one.
    pub(super) fn open(file: &File<'_>, primitive: &Primitive) -> Fallible<Option<Self>> {
        let extension = primitive.extensions.as_ref();
        let extension = extension.and_then(|all| all.others.get("KHR_draco_mesh_compression"));
        let Some(extension) = extension else { return Ok(None) };
        let Packed { buffer_view, attributes } = Packed::deserialize(extension)
            .map_err(|cause| format!("its Draco compression makes no sense ({cause})"))?;
        let limits = limits(file, primitive)?;
        let (bytes, _) = file.view(json::Index::new(buffer_view))?;
        let mut mesh = Mesh::new();
        catch_panic(|| {
            let mut buffer = DecoderBuffer::new(bytes).with_limits(limits);
            MeshDecoder::new().decode(&mut buffer, &mut mesh)
        })
        .ok_or("its Draco data are damaged: their decoder failed")?
        .map_err(|cause| format!("its Draco data cannot be read: {cause}"))?;
        let corners = mesh.faces().as_flattened().iter();
        let points = corners.map(|point| point.0 as usize + 1).max().unwrap_or(0);
        Ok(Some(Self { mesh, points, attributes }))
    }

    /// Point numbers of the triangles.
    pub(super) fn triangles(&self) -> impl ExactSizeIterator<Item = [u32; 3]> {
        self.mesh.faces().iter().map(|face| face.map(|point| point.0))
    }

    /// The values of an attribute, one a point; `None` if it is not packed.
    pub(super) fn attribute(
        &self,
        name: &str,
        accessor: &json::Accessor,
        types: &[Type],
    ) -> Fallible<Option<Elements<'static>>> {
        let Some(&number) = self.attributes.get(name) else { return Ok(None) };
        let attribute = self
            .mesh
            .attribute_by_unique_id(number)
            .ok_or_else(|| format!("{name} is not among its Draco data"))?;
        let Checked::Valid(kind) = accessor.type_ else {
            return Err(format!("the type of {name} is unknown to glTF 2.0"));
        };
        if !types.contains(&kind) || kind.multiplicity() != usize::from(attribute.num_components())
        {
            return Err(format!("{name} is of the type {kind:?}, which does not fit"));
        }
        let component = match attribute.data_type() {
            DataType::Int8 => ComponentType::I8,
            DataType::Uint8 => ComponentType::U8,
            DataType::Int16 => ComponentType::I16,
            DataType::Uint16 => ComponentType::U16,
            DataType::Uint32 => ComponentType::U32,
            DataType::Float32 => ComponentType::F32,
            other => return Err(format!("{name} has components of type {other:?}")),
        };
        let bytes = self.per_point(attribute, component.size() * kind.multiplicity())?;
        Ok(Some(Elements::unpacked(bytes, component, kind, accessor.normalized)))
    }

    fn per_point(&self, attribute: &PointAttribute, size: usize) -> Fallible<Vec<u8>> {
        let (values, stride) = (attribute.buffer().data(), attribute.byte_stride() as usize);
        let mut bytes = memory::reserved((self.points * size) as u64)?;
        for point in 0..self.points {
            let start = attribute.mapped_index(PointIndex(point as u32)).0 as usize * stride;
            let value = values.get(start..start + size);
            bytes.extend(value.ok_or("its Draco data have too few values")?);
        }
        Ok(bytes)
    }
}

/// No more is unpacked than the accessors promise, and memory has room for.
fn limits(file: &File<'_>, primitive: &Primitive) -> Fallible<DecodeLimits> {
    let accessor = |index| file.document.accessors.get(index);
    let positions = Checked::Valid(json::mesh::Semantic::Positions);
    let positions = primitive.attributes.get(&positions).copied().map(accessor).transpose()?;
    let vertices = positions.map_or(0, |positions| positions.count.0);
    let triangles = match primitive.indices.map(accessor).transpose()? {
        Some(indices) if primitive.mode == Checked::Valid(Mode::Triangles) => indices.count.0 / 3,
        // A strip's.
        Some(indices) => indices.count.0,
        // A closed mesh has two of them for each vertex.
        None => vertices.saturating_mul(2),
    };
    check_count(triangles.max(vertices / 3), MAX_TRIANGLES, "it has", "triangles")?;
    let mut vertex_bytes = OTHER_BYTES;
    for index in primitive.attributes.values() {
        if let Checked::Valid(kind) = accessor(*index)?.type_ {
            vertex_bytes += COMPONENT_BYTES * kind.multiplicity() as u64;
        }
    }
    // Where normals differ, one place may have a few values.
    let values = vertices.max((3 * triangles).min(vertices.saturating_mul(4)));
    let bytes = values.saturating_mul(vertex_bytes);
    memory::check(bytes.saturating_add(3 * triangles * CORNER_BYTES))?;
    Ok(DecodeLimits::default().with_max_faces(triangles).with_max_decoded_bytes(bytes))
}
