//! Reading a part: what of a primitive its material needs.

use glam::Affine2;
use gltf::json;

use super::buffers::File;
use super::limits::Fallible;
use super::part::{Part, Tally};
use super::primitive::{Morph, Source};
use super::tangents;
use crate::scene::{Material, TextureRef, TextureSlot};

/// What a material reads of its vertices.
pub(super) struct Needs {
    uv_sets: [bool; 2],
    /// Whether tangents are read.
    tangents: bool,
    /// The reference whose texture coordinates make them where the file has none: that of the normal
    /// map, of the anisotropy, else the first set.
    tangent_map: Option<TextureRef>,
}

impl Needs {
    /// Looks through the texture slots.
    pub(super) fn of(material: &Material) -> Self {
        let mut uv_sets = [false; 2];
        for reference in material.textures.iter().flatten() {
            uv_sets[usize::from(reference.uv_set)] = true;
        }
        let normal_map = material
            .texture(TextureSlot::Normal)
            .or(material.texture(TextureSlot::ClearcoatNormal));
        let tangent_map = normal_map.or(material.texture(TextureSlot::Anisotropy)).copied();
        let tangents = normal_map.is_some() || material.anisotropy > 0.0;
        uv_sets[0] |= tangents && tangent_map.is_none();
        Self { uv_sets, tangents, tangent_map }
    }
}

/// Reads a primitive with morph targets applied; `None` if it has no triangles.
pub(super) fn read_part(
    file: &File<'_>,
    primitive: &json::mesh::Primitive,
    morph: Morph<'_>,
    material: u32,
    needs: &Needs,
    tally: &mut Tally,
) -> Fallible<Option<Part>> {
    let Some(mut source) = Source::open(file, primitive, tally)? else { return Ok(None) };
    let (vertices, triangles) = compact(source.triangles()?);
    source.vertices = vertices;
    if triangles.is_empty() {
        return Ok(None);
    }
    let mut part = Part { triangles, material, ..Part::default() };
    part.positions = source.positions();
    source.normals(&mut part)?;
    for set in 0..2 {
        if needs.uv_sets[set] {
            part.uvs[set] = source.uvs(set as u32)?;
        }
    }
    part.colors = source.colors()?;
    source.influences(&mut part)?;
    source.tangents(&mut part)?;
    source.morph(morph, &mut part)?;
    // Non-finite corners would spread through the tangents of a whole part.
    let before = part.triangles.len();
    let positions = &part.positions;
    part.triangles.retain(|corners| corners.iter().all(|&v| positions[v as usize].is_finite()));
    tally.dropped_triangles += before - part.triangles.len();
    if part.triangles.is_empty() {
        return Ok(None);
    }
    if !needs.tangents {
        part.tangents = Vec::new();
    } else if part.tangents.is_empty() {
        let map = needs.tangent_map;
        let (set, transform) = map.map_or((0, Affine2::IDENTITY), |m| (m.uv_set, m.transform));
        tangents::generate(&mut part, usize::from(set), transform);
    }
    Ok(Some(part))
}

/// Renumbers vertices so that only used ones are left: the old numbers of the new vertices, and
/// the triangles in new numbers. Primitives often share one large vertex buffer.
fn compact(mut triangles: Vec<[u32; 3]>) -> (Vec<u32>, Vec<[u32; 3]>) {
    const UNUSED: u32 = u32::MAX;
    let first = triangles.as_flattened().iter().copied().min().unwrap_or(0);
    let last = triangles.as_flattened().iter().copied().max().unwrap_or(0);
    let mut numbers = vec![UNUSED; (last - first) as usize + 1];
    for &vertex in triangles.as_flattened() {
        numbers[(vertex - first) as usize] = 0;
    }
    let mut vertices = Vec::new();
    for (number, old) in numbers.iter_mut().zip(first..) {
        if *number != UNUSED {
            *number = vertices.len() as u32;
            vertices.push(old);
        }
    }
    for vertex in triangles.as_flattened_mut() {
        *vertex = numbers[(*vertex - first) as usize];
    }
    (vertices, triangles)
}
