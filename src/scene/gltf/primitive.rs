//! Primitives: what their accessors say, vertex by vertex.

use std::ops::{AddAssign, Mul};

use glam::{Vec2, Vec3, Vec4};
use gltf::json;
use json::accessor::Type;
use json::mesh::{Mode, Semantic};
use json::validation::Checked;
use serde::Deserialize;
use serde_json::value::RawValue;

use super::accessor::{AccessorIndex, Elements};
use super::buffers::File;
use super::draco::Unpacked;
use super::limits::{Fallible, MAX_TRIANGLES, check_count};
use super::objects::{not_gltf, read};
use super::part::{Part, Tally};
use crate::memory;
use crate::scene::placing::unit;

/// What a mesh has. Its primitives are read one by one.
#[derive(Deserialize)]
pub(super) struct Mesh {
    pub(super) name: Option<String>,
    pub(super) weights: Option<Vec<f32>>,
    primitives: Vec<Box<RawValue>>,
}

impl Mesh {
    pub(super) fn primitives(&self) -> impl Iterator<Item = Fallible<json::mesh::Primitive>> {
        self.primitives.iter().enumerate().map(|(number, text)| {
            read(text.get()).map_err(|cause| not_gltf(&format!("primitive {number}: {cause}")))
        })
    }

    /// Morph targets of a primitive.
    pub(super) fn targets(&self, primitive: usize) -> Fallible<Vec<Target>> {
        let targets: Targets = read(self.primitives[primitive].get())
            .map_err(|cause| not_gltf(&format!("primitive {primitive}: {cause}")))?;
        Ok(targets.targets.unwrap_or_default())
    }
}

#[derive(Deserialize)]
struct Targets {
    targets: Option<Vec<Target>>,
}

/// A morph target: accessors of what is added to each vertex. (The types of the crate `gltf` lack colours and
/// texture coordinates.)
#[derive(Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub(super) struct Target {
    position: Option<AccessorIndex>,
    normal: Option<AccessorIndex>,
    tangent: Option<AccessorIndex>,
    texcoord_0: Option<AccessorIndex>,
    texcoord_1: Option<AccessorIndex>,
    color_0: Option<AccessorIndex>,
}

type Found<'a> = (AccessorIndex, Elements<'a>);

/// A triangle primitive whose accessors are checked as they are read.
pub(super) struct Source<'a> {
    file: &'a File<'a>,
    primitive: &'a json::mesh::Primitive,
    positions: Elements<'a>,
    mode: Mode,
    /// What was packed of it.
    draco: Option<Unpacked>,
    /// Those that triangles have as corners.
    pub(super) vertices: Vec<u32>,
    tally: &'a mut Tally,
}

/// Morph targets with their weights.
pub(super) type Morph<'a> = (&'a [Target], &'a [f32]);

impl<'a> Source<'a> {
    /// `None` (and counted) for points, lines and primitives without positions.
    pub(super) fn open(
        file: &'a File<'_>,
        primitive: &'a json::mesh::Primitive,
        tally: &'a mut Tally,
    ) -> Fallible<Option<Self>> {
        let Checked::Valid(mode) = primitive.mode else {
            return Err("its mode is unknown to glTF 2.0".into());
        };
        match mode {
            Mode::Points => tally.points += 1,
            Mode::Lines | Mode::LineLoop | Mode::LineStrip => tally.lines += 1,
            Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan => {
                let semantic = Semantic::Positions;
                if let Some(&accessor) = primitive.attributes.get(&Checked::Valid(semantic.clone()))
                {
                    let draco = Unpacked::open(file, primitive)?;
                    let positions = open(file, draco.as_ref(), &semantic, accessor, &[Type::Vec3])?;
                    let vertices = Vec::new();
                    let source = Self { file, primitive, positions, mode, draco, vertices, tally };
                    return Ok(Some(source));
                }
                tally.without_positions += 1;
            }
        }
        Ok(None)
    }

    /// An attribute, which must be as long as the positions.
    fn attribute(&self, semantic: &Semantic, types: &[Type]) -> Fallible<Option<Elements<'a>>> {
        let found = self.find(semantic, types)?;
        found.map(|found| self.per_vertex(found)).transpose()
    }

    /// An attribute that shading can do without: one that is too short is counted and left out.
    fn optional(&mut self, semantic: &Semantic, types: &[Type]) -> Fallible<Option<Elements<'a>>> {
        let Some((_, elements)) = self.find(semantic, types)? else { return Ok(None) };
        let is_short = elements.count < self.positions.count;
        self.tally.short_attributes += usize::from(is_short);
        Ok((!is_short).then_some(elements))
    }

    /// An attribute of any length, and its accessor.
    fn find(&self, semantic: &Semantic, types: &[Type]) -> Fallible<Option<Found<'a>>> {
        let accessor = self.primitive.attributes.get(&Checked::Valid(semantic.clone()));
        let open = |&accessor| {
            Ok((accessor, open(self.file, self.draco.as_ref(), semantic, accessor, types)?))
        };
        accessor.map(open).transpose()
    }

    fn per_vertex(&self, (accessor, elements): Found<'a>) -> Fallible<Elements<'a>> {
        if elements.count < self.positions.count {
            let (count, vertices) = (elements.count, self.positions.count);
            return Err(format!(
                "accessor {accessor}: {count} elements are too few for {vertices} vertices"
            ));
        }
        Ok(elements)
    }

    /// Vertex numbers of the triangles, all below the number of vertices.
    pub(super) fn triangles(&self) -> Fallible<Vec<[u32; 3]>> {
        let vertices = self.positions.count;
        if let Some(draco) = &self.draco {
            // All points are below the number of them, and there are as many positions.
            return Ok(draco.triangles().collect());
        }
        let open = |accessor| Elements::open(self.file, accessor, &[Type::Scalar]);
        let indices = self.primitive.indices.map(open).transpose()?;
        let indices = indices.as_ref();
        if indices.is_some_and(|indices| !indices.is_unsigned()) {
            return Err("its indices are not unsigned integers".into());
        }
        let corners = indices.map_or(vertices, |indices| indices.count);
        check_count(corners.div_ceil(3) as u64, MAX_TRIANGLES, "it has", "triangles")?;
        let vertex =
            |corner| indices.map_or(corner as u32, |indices| indices.integers::<1>(corner)[0]);
        if let Some(corner) = (0..corners).find(|&corner| vertex(corner) as usize >= vertices) {
            return Err(format!("index {} is beyond its {vertices} vertices", vertex(corner)));
        }
        let corner_numbers = |triangle: usize| match self.mode {
            // Odd triangles of a strip turn, so that all face the same way (section 3.7.2.1).
            Mode::TriangleStrip if triangle % 2 == 1 => [triangle, triangle + 2, triangle + 1],
            Mode::TriangleStrip => [triangle, triangle + 1, triangle + 2],
            Mode::TriangleFan => [triangle + 1, triangle + 2, 0],
            _ => [3 * triangle, 3 * triangle + 1, 3 * triangle + 2],
        };
        let triangles = match self.mode {
            Mode::TriangleStrip | Mode::TriangleFan => corners.saturating_sub(2),
            _ => corners / 3,
        };
        Ok((0..triangles).map(|triangle| corner_numbers(triangle).map(vertex)).collect())
    }

    /// Positions of some vertices.
    pub(super) fn positions(&self) -> Vec<Vec3> {
        self.vertices.iter().map(|&v| Vec3::from_array(self.positions.floats(v as usize))).collect()
    }

    /// Unit normals, zero (and counted) where they cannot be used.
    pub(super) fn normals(&mut self, part: &mut Part) -> Fallible<()> {
        let Some(elements) = self.optional(&Semantic::Normals, &[Type::Vec3])? else {
            return Ok(());
        };
        for &vertex in &self.vertices {
            let normal = unit(Vec3::from_array(elements.floats(vertex as usize)));
            self.tally.bad_normals += usize::from(normal == Vec3::ZERO);
            part.normals.push(normal);
        }
        Ok(())
    }

    /// A set of texture coordinates; empty if there is none.
    pub(super) fn uvs(&mut self, set: u32) -> Fallible<Vec<Vec2>> {
        // Some exporters write the third coordinate of volume textures.
        let types = [Type::Vec2, Type::Vec3];
        let Some(elements) = self.optional(&Semantic::TexCoords(set), &types)? else {
            return Ok(Vec::new());
        };
        let read = |&v: &u32| usable_uv(Vec2::from(elements.floats(v as usize)), self.tally);
        Ok(self.vertices.iter().map(read).collect())
    }

    /// Linear colours with alpha; empty if there are none.
    pub(super) fn colors(&mut self) -> Fallible<Vec<Vec4>> {
        let Some(elements) = self.optional(&Semantic::Colors(0), &[Type::Vec3, Type::Vec4])? else {
            return Ok(Vec::new());
        };
        let elements = elements.with_fractions();
        let read = |&vertex: &u32| {
            let mut color = Vec4::from_array(elements.floats(vertex as usize));
            if elements.components == 3 {
                color.w = 1.0;
            }
            usable_color(color, self.tally)
        };
        Ok(self.vertices.iter().map(read).collect())
    }

    /// Tangents of the file; without normals they mean nothing (section 3.7.2.1).
    pub(super) fn tangents(&mut self, part: &mut Part) -> Fallible<()> {
        let elements = self.optional(&Semantic::Tangents, &[Type::Vec4])?;
        if let Some(elements) = elements.filter(|_| !part.normals.is_empty()) {
            let tangents = self.vertices.iter().map(|&vertex| {
                let tangent = Vec4::from_array(elements.floats(vertex as usize));
                let sign = if tangent.w < 0.0 { -1.0 } else { 1.0 };
                let direction = unit(tangent.truncate());
                (direction != Vec3::ZERO).then(|| direction.extend(sign))
            });
            // One bad tangent, and MikkTSpace makes them all.
            part.tangents = tangents.collect::<Option<_>>().unwrap_or_default();
        }
        Ok(())
    }

    /// Joints and weights of all sets, weights summing to one.
    pub(super) fn influences(&self, part: &mut Part) -> Fallible<()> {
        let mut sets = Vec::new();
        for set in 0.. {
            let joints = self.attribute(&Semantic::Joints(set), &[Type::Vec4])?;
            let weights = self.attribute(&Semantic::Weights(set), &[Type::Vec4])?;
            let (Some(joints), Some(weights)) = (joints, weights) else { break };
            if !joints.is_unsigned() {
                return Err("its joints are not unsigned integers".into());
            }
            sets.push((joints, weights.with_fractions()));
        }
        part.influences_per_vertex = 4 * sets.len();
        let influences = self.vertices.len() * part.influences_per_vertex;
        memory::check((influences * size_of::<(u32, f32)>()) as u64)?;
        for &vertex in &self.vertices {
            let first = part.influences.len();
            for (joints, weights) in &sets {
                let joints = joints.integers::<4>(vertex as usize);
                let weights = weights.floats::<4>(vertex as usize);
                part.influences.extend(joints.into_iter().zip(weights));
            }
            normalize(&mut part.influences[first..]);
        }
        Ok(())
    }

    /// Adds morph targets to what there is of each vertex (section 3.7.2.2).
    pub(super) fn morph(&mut self, morph: Morph<'_>, part: &mut Part) -> Fallible<()> {
        const VEC2: &[Type] = &[Type::Vec2];
        const VEC3: &[Type] = &[Type::Vec3];
        const COLOR: &[Type] = &[Type::Vec3, Type::Vec4];
        let mut is_morphed = false;
        for (target, &weight) in morph.0.iter().zip(morph.1).filter(|(_, weight)| **weight != 0.0) {
            is_morphed = true;
            self.add(weight, target.position, VEC3, &mut part.positions)?;
            self.add(weight, target.normal, VEC3, &mut part.normals)?;
            let [first, second] = &mut part.uvs;
            self.add(weight, target.texcoord_0, VEC2, first)?;
            self.add(weight, target.texcoord_1, VEC2, second)?;
            self.add(weight, target.color_0, COLOR, &mut part.colors)?;
            let mut directions: Vec<Vec3> = part.tangents.iter().map(|t| t.truncate()).collect();
            self.add(weight, target.tangent, VEC3, &mut directions)?;
            for (tangent, direction) in part.tangents.iter_mut().zip(directions) {
                *tangent = direction.extend(tangent.w);
            }
        }
        for normal in &mut part.normals {
            *normal = unit(*normal);
        }
        if is_morphed {
            part.uvs.iter_mut().flatten().for_each(|uv| *uv = usable_uv(*uv, self.tally));
            let colors = part.colors.iter_mut();
            colors.for_each(|color| *color = usable_color(*color, self.tally).min(Vec4::ONE));
        }
        Ok(())
    }

    /// Adds what a morph target of some weight has for its vertices.
    fn add<const N: usize, V>(
        &self,
        weight: f32,
        accessor: Option<AccessorIndex>,
        types: &[Type],
        values: &mut [V],
    ) -> Fallible<()>
    where
        V: From<[f32; N]> + AddAssign + Mul<f32, Output = V>,
    {
        let Some(accessor) = accessor else { return Ok(()) };
        let elements = Elements::open(self.file, accessor, types)?;
        let elements = self.per_vertex((accessor, elements))?;
        for (value, &vertex) in values.iter_mut().zip(&self.vertices) {
            *value += V::from(elements.floats(vertex as usize)) * weight;
        }
        Ok(())
    }
}

/// Texture coordinates, the origin (counted) where they are not finite.
fn usable_uv(uv: Vec2, tally: &mut Tally) -> Vec2 {
    tally.bad_values += usize::from(!uv.is_finite());
    if uv.is_finite() { uv } else { Vec2::ZERO }
}

/// A colour without negative channels, white (counted) where it is not finite.
fn usable_color(color: Vec4, tally: &mut Tally) -> Vec4 {
    tally.bad_values += usize::from(!color.is_finite());
    if color.is_finite() { color.max(Vec4::ZERO) } else { Vec4::ONE }
}

/// The values of an attribute, packed or plain.
fn open<'a>(
    file: &'a File<'_>,
    draco: Option<&Unpacked>,
    semantic: &Semantic,
    accessor: AccessorIndex,
    types: &[Type],
) -> Fallible<Elements<'a>> {
    if let Some(draco) = draco {
        let promised = file.document.accessors.get(accessor)?;
        if let Some(elements) = draco.attribute(&semantic.to_string(), &promised, types)? {
            return Ok(elements);
        }
    }
    Elements::open(file, accessor, types)
}

/// Makes weights sum to one; a vertex that nothing holds follows its first joint.
fn normalize(influences: &mut [(u32, f32)]) {
    let sum: f32 = influences.iter().map(|(_, weight)| weight).sum();
    let usable = sum.is_finite() && sum > 0.0;
    for (number, (_, weight)) in influences.iter_mut().enumerate() {
        *weight = if usable { *weight / sum } else { f32::from(u8::from(number == 0)) };
    }
}
