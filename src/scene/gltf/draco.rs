//! `KHR_draco_mesh_compression`: primitives whose triangles and vertices are packed together.

use std::collections::BTreeMap;

use draco_oxide_core::attribute::{Attribute, ComponentDataType};
use draco_oxide_core::mesh::Mesh;
use gltf::json;
use json::accessor::{ComponentType, Type};
use json::validation::Checked;
use serde::Deserialize;

use super::accessor::Elements;
use super::buffers::{File, find};
use super::{Fallible, MAX_TRIANGLES};
use crate::image::catch_panic;
use crate::memory;

/// What the extension says of a primitive.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Packed {
    buffer_view: u32,
    /// Numbers of the packed attributes, by their names in glTF.
    attributes: BTreeMap<String, usize>,
}

/// An unpacked primitive.
pub(super) struct Unpacked {
    mesh: Mesh,
    points: usize,
    attributes: BTreeMap<String, usize>,
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
        // What the accessors promise is what will be allocated, and more.
        if let Some(indices) = primitive.indices {
            let count = find(&file.root.accessors, indices, "accessor")?.count.0;
            if count > 3 * MAX_TRIANGLES {
                return Err("it has too many triangles".into());
            }
            memory::check(count.saturating_mul(40))?;
        }
        let (bytes, _) = file.view(json::Index::new(buffer_view))?;
        let mesh = catch_panic(|| draco_oxide_decoder::decode_mesh(bytes))
            .ok_or("its Draco data are damaged: their decoder failed")?
            .map_err(|cause| format!("its Draco data cannot be read: {cause}"))?;
        let corners = mesh.get_faces().as_flattened().iter();
        let points = corners.map(|&point| usize::from(point) + 1).max().unwrap_or(0);
        Ok(Some(Self { mesh, points, attributes }))
    }

    /// Point numbers of the triangles.
    pub(super) fn triangles(&self) -> impl ExactSizeIterator<Item = [u32; 3]> {
        self.mesh.get_faces().iter().map(|face| face.map(|point| usize::from(point) as u32))
    }

    /// The values of an attribute, one a point; `None` if it is not packed.
    pub(super) fn attribute(
        &self,
        name: &str,
        accessor: &json::Accessor,
        types: &[Type],
    ) -> Fallible<Option<Elements<'static>>> {
        let Some(&number) = self.attributes.get(name) else { return Ok(None) };
        let mut all = self.mesh.get_attributes().iter();
        let attribute = all
            .find(|attribute| attribute.get_id().as_usize() == number)
            .ok_or_else(|| format!("{name} is not among its Draco data"))?;
        let Checked::Valid(kind) = accessor.type_ else {
            return Err(format!("the type of {name} is unknown to glTF 2.0"));
        };
        if !types.contains(&kind) || kind.multiplicity() != attribute.get_num_components() {
            return Err(format!("{name} is of the type {kind:?}, which does not fit"));
        }
        let component = match attribute.get_component_type() {
            ComponentDataType::I8 => ComponentType::I8,
            ComponentDataType::U8 => ComponentType::U8,
            ComponentDataType::I16 => ComponentType::I16,
            ComponentDataType::U16 => ComponentType::U16,
            ComponentDataType::U32 => ComponentType::U32,
            ComponentDataType::F32 => ComponentType::F32,
            other => return Err(format!("{name} has components of type {other:?}")),
        };
        let bytes = self.per_point(attribute, component.size() * kind.multiplicity())?;
        Ok(Some(Elements::unpacked(bytes, component, kind, accessor.normalized)))
    }

    fn per_point(&self, attribute: &Attribute, size: usize) -> Fallible<Vec<u8>> {
        let values = attribute.get_data_as_bytes();
        let map = attribute.point_map_as_slice();
        let mut bytes = memory::reserved((self.points * size) as u64)?;
        for point in 0..self.points {
            let value = match map {
                None => Some(point),
                Some(map) => map.get(point).map(|&value| usize::from(value)),
            };
            let value = value.and_then(|value| values.get(value * size..(value + 1) * size));
            bytes.extend(value.ok_or("its Draco data have too few values")?);
        }
        Ok(bytes)
    }
}
