//! `KHR_draco_mesh_compression`: primitives whose triangles and vertices are packed together.

use std::collections::BTreeMap;

use draco_core::{
    DataType, DecodeLimits, DecoderBuffer, Mesh, MeshDecoder, PointAttribute, PointIndex,
};
use gltf::json;
use json::accessor::{ComponentType, Type};
use json::validation::Checked;
use serde::Deserialize;

use super::accessor::Elements;
use super::buffers::{File, find};
use super::{Fallible, MAX_TRIANGLES};
use crate::image::catch_panic;
use crate::memory;

/// Most bytes that all attributes of a vertex take: sixteen of four floats.
const MAX_VERTEX_BYTES: u64 = 256;

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
    pub(super) fn open(
        file: &File<'_>,
        primitive: &json::mesh::Primitive,
    ) -> Fallible<Option<Self>> {
        let extensions = primitive.extensions.as_ref();
        let Some(extension) =
            extensions.and_then(|all| all.others.get("KHR_draco_mesh_compression"))
        else {
            return Ok(None);
        };
        let Packed { buffer_view, attributes } = Packed::deserialize(extension)
            .map_err(|cause| format!("its Draco compression makes no sense ({cause})"))?;
        // No more is unpacked than the accessors promise.
        let promised = |accessor: Option<json::Index<json::Accessor>>| {
            let found = accessor.map(|index| find(&file.root.accessors, index, "accessor"));
            found.transpose().map(|accessor| accessor.map(|accessor| accessor.count.0))
        };
        let corners = promised(primitive.indices)?;
        memory::check(corners.unwrap_or(0).saturating_mul(40))?;
        let corners = corners.unwrap_or(3 * MAX_TRIANGLES);
        if corners > 3 * MAX_TRIANGLES {
            return Err("it has too many triangles".into());
        }
        let positions = Checked::Valid(json::mesh::Semantic::Positions);
        let vertices = promised(primitive.attributes.get(&positions).copied())?.unwrap_or(0);
        let most = vertices.max(corners);
        let limits = DecodeLimits::default()
            .with_max_faces(corners / 3)
            .with_max_points(most)
            .with_max_decoded_bytes(most.saturating_mul(MAX_VERTEX_BYTES));
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
