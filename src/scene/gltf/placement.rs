//! Where meshes are shown.

use std::collections::BTreeMap;

use glam::{DAffine3, DVec3, Vec3};
use gltf::json;
use json::accessor::{ComponentType, GenericComponentType, Type};
use json::validation::Checked;
use serde_json::Value;

use super::accessor::Elements;
use super::bake::FARTHEST;
use super::buffers::File;
use super::limits::{Fallible, MAX_TRIANGLES, check_count};
use super::pose::{self, MESH, Nodes};
use super::primitive::Mesh;
use crate::math::box_corners;
use crate::scene::copies::{copies, hash_of};

/// A node that shows a mesh.
pub(super) struct Placement {
    pub(super) skin: Option<json::Index<json::Skin>>,
    /// Of morph targets, if the mesh's own do not hold.
    pub(super) weights: Option<Vec<f32>>,
    /// World from mesh, one for each instance.
    pub(super) instances: Vec<DAffine3>,
}

/// By the number of the mesh.
pub(super) type Placements = BTreeMap<u32, Vec<Placement>>;

/// The shown nodes with meshes, by mesh, so that each mesh is read once.
pub(super) fn placements(file: &File<'_>, nodes: &Nodes) -> Fallible<Placements> {
    let mut placements = Placements::new();
    let mut shown = 0;
    for number in nodes.showing(MESH) {
        let node = file.document.nodes.get(number)?;
        let Some(mesh) = node.mesh else { continue };
        file.document.meshes.text(mesh)?;
        let world = nodes.world(number);
        let instances = pose::instances(file, &node)
            .map_err(|cause| format!("node {number}: {cause}"))?
            .map_or_else(|| vec![world], |all| all.iter().map(|&one| world * one).collect());
        shown += instances.len() as u64;
        check_count(shown, MAX_TRIANGLES, "there are", "instances")?;
        let placement = Placement { skin: node.skin, weights: node.weights, instances };
        placements.entry(mesh.value() as u32).or_default().push(placement);
    }
    Ok(placements)
}

/// [`box_around`] all that is shown, by what the file says of its positions.
pub(super) fn bounds(file: &File<'_>, nodes: &Nodes, all: &Placements) -> Fallible<[DVec3; 2]> {
    let mut corners = Vec::new();
    for (&number, placements) in all {
        let mesh: Mesh = file.document.meshes.get_as(json::Index::new(number))?;
        let boxes: Vec<[DVec3; 2]> =
            mesh.primitives().filter_map(|primitive| own_box(file, &primitive.ok()?)).collect();
        let around = box_around(boxes.into_iter().flatten());
        for placement in placements {
            // What is wrong with a skin is said where its mesh is read.
            let skin = placement.skin;
            let joints = skin.and_then(|skin| pose::joint_transforms(file, nodes, skin).ok());
            let transforms = joints.as_ref().unwrap_or(&placement.instances).iter();
            corners.extend(transforms.flat_map(|transform| {
                box_corners(around).map(|corner| transform.transform_point3(corner))
            }));
        }
    }
    Ok(box_around(corners.into_iter()))
}

/// Bounds of a primitive's positions in its own space: as the file has them or, where it has none that can be, as they
/// are.
fn own_box(file: &File<'_>, primitive: &json::mesh::Primitive) -> Option<[DVec3; 2]> {
    let position = Checked::Valid(json::mesh::Semantic::Positions);
    let number = *primitive.attributes.get(&position)?;
    let accessor = file.document.accessors.get(number).ok()?;
    let Checked::Valid(GenericComponentType(component)) = accessor.component_type else {
        return None;
    };
    let unit = match component {
        _ if !accessor.normalized => 1.0,
        ComponentType::I8 => 127.0,
        ComponentType::U8 => 255.0,
        ComponentType::I16 => 32_767.0,
        ComponentType::U16 => 65_535.0,
        ComponentType::U32 | ComponentType::F32 => 1.0,
    };
    let corner = |value: &Option<Value>| -> Option<DVec3> {
        let numbers: Vec<f64> =
            value.as_ref()?.as_array()?.iter().filter_map(Value::as_f64).collect();
        let corner = DVec3::from(<[f64; 3]>::try_from(numbers).ok()?) / unit;
        is_near(corner).then_some(corner)
    };
    if let Some(bounds) = corner(&accessor.min).zip(corner(&accessor.max)) {
        return Some(bounds.into());
    }
    let positions = Elements::open(file, number, &[Type::Vec3]).ok()?;
    let points = (0..positions.count).map(|i| Vec3::from(positions.floats::<3>(i)).as_dvec3());
    Some(box_around(points))
}

/// Whether a point is a number, and not so far away that what is there is left out.
fn is_near(point: DVec3) -> bool {
    point.abs().cmple(DVec3::splat(FARTHEST.into())).all()
}

/// Low and high corner of a box around points, but for those that are no number or too far away; infinite the wrong
/// way round without any.
pub(super) fn box_around(points: impl Iterator<Item = DVec3>) -> [DVec3; 2] {
    let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    let points = points.filter(|point| is_near(*point));
    points.fold(none, |[low, high], point| [low.min(point), high.max(point)])
}

/// Leaves out instances of a mesh in the place of another one, as after a doubled import; how many there were.
pub(super) fn drop_copies(placements: &mut Placements) -> usize {
    let mut dropped = 0;
    for placements in placements.values_mut() {
        let numbers = |(number, placement): (usize, &Placement)| {
            (0..placement.instances.len()).map(move |instance| (number, instance))
        };
        let all: Vec<_> = placements.iter().enumerate().flat_map(numbers).collect();
        let place = |at: usize| {
            let (placement, instance) = all[at];
            let cells = placements[placement].instances[instance].to_cols_array();
            cells.map(|cell| (cell + 0.0).to_bits())
        };
        // What has a skin has a shape of its own.
        let is_copy = |first: usize, second: usize| {
            let [first_of, second_of] = [first, second].map(|at| &placements[all[at].0]);
            place(first) == place(second)
                && first_of.skin.is_none()
                && second_of.skin.is_none()
                && first_of.weights == second_of.weights
        };
        let copies = copies(all.len(), |at| hash_of(place(at)), is_copy);
        if copies.is_empty() {
            continue;
        }
        dropped += copies.len();
        let mut keep = vec![true; all.len()];
        copies.into_iter().for_each(|(_, copy)| keep[copy] = false);
        let mut keep = keep.into_iter();
        for placement in placements.iter_mut() {
            placement.instances.retain(|_| keep.next().unwrap_or(true));
        }
        placements.retain(|placement| !placement.instances.is_empty());
    }
    dropped
}
