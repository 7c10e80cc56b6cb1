//! The node hierarchy at rest: what is in the shown scene, and where.

use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};
use gltf::json;
use json::accessor::Type;
use serde_json::Value;

use super::Fallible;
use super::accessor::Elements;
use super::buffers::{File, find};
use crate::error::Notices;

/// The nodes of the shown scene and the world transforms of all nodes.
pub(super) struct Nodes {
    /// World from node for every node of the file, in f64: far-away parents cancel exactly enough.
    pub(super) world: Vec<DAffine3>,
    /// Nodes of the shown scene, parents before children, in file order.
    pub(super) shown: Vec<usize>,
    /// Each node's parent.
    pub(super) parents: Vec<Option<usize>>,
}

impl Nodes {
    /// Walks the hierarchy; loops, shared children and missing nodes are errors.
    pub(super) fn new(root: &json::Root, notices: &mut Notices) -> Fallible<Self> {
        let parents = parents(root)?;
        let count = root.nodes.len();
        let tops: Vec<usize> = (0..count).filter(|&node| parents[node].is_none()).collect();
        let mut world = vec![DAffine3::IDENTITY; count];
        let below_tops = descend(root, &tops);
        if below_tops.len() < count {
            let looping = count - below_tops.len();
            return Err(format!("its nodes form a loop: {looping} of them have no root above"));
        }
        for node in below_tops {
            let local = local_transform(&root.nodes[node]);
            world[node] = parents[node].map_or(local, |parent| world[parent] * local);
        }
        let shown = match scene_roots(root, notices)? {
            Some(roots) => descend(root, &roots),
            None => descend(root, &tops),
        };
        Ok(Self { world, shown, parents })
    }
}

/// Each node's parent. A node may have one only, so what hangs below a root is a tree.
fn parents(root: &json::Root) -> Fallible<Vec<Option<usize>>> {
    let mut parents = vec![None; root.nodes.len()];
    for (parent, node) in root.nodes.iter().enumerate() {
        for &child in node.children.iter().flatten() {
            find(&root.nodes, child, "node")?;
            if let Some(other) = parents[child.value()].replace(parent) {
                return Err(format!("node {child} has two parents, nodes {other} and {parent}"));
            }
        }
    }
    Ok(parents)
}

/// The nodes at and below some roots, depth first without recursion, each once.
fn descend(root: &json::Root, roots: &[usize]) -> Vec<usize> {
    let mut seen = vec![false; root.nodes.len()];
    let mut stack: Vec<usize> = roots.iter().rev().copied().collect();
    let mut order = Vec::new();
    while let Some(node) = stack.pop() {
        if !std::mem::replace(&mut seen[node], true) {
            order.push(node);
            let children = root.nodes[node].children.iter().flatten();
            stack.extend(children.rev().map(json::Index::value));
        }
    }
    order
}

/// Roots of the default scene, else of the first one; `None` if the file has no scenes.
fn scene_roots(root: &json::Root, notices: &mut Notices) -> Fallible<Option<Vec<usize>>> {
    let scene = match (root.scene, root.scenes.first()) {
        (Some(index), _) => find(&root.scenes, index, "scene")?,
        (None, Some(first)) => first,
        (None, None) => return Ok(None),
    };
    if root.scenes.len() > 1 {
        let shown = root.scene.map_or(0, |index| index.value());
        notices.add(format!("the file has {} scenes; scene {shown} is shown", root.scenes.len()));
    }
    for &node in &scene.nodes {
        find(&root.nodes, node, "node")?;
    }
    Ok(Some(scene.nodes.iter().map(json::Index::value).collect()))
}

/// Parent from node, at rest.
pub(super) fn local_transform(node: &json::Node) -> DAffine3 {
    if let Some(m) = node.matrix {
        return affine_from_columns(&m.map(f64::from));
    }
    let vector = |v: Option<[f32; 3]>, default| v.map_or(default, |v| Vec3::from(v).as_dvec3());
    let [x, y, z, w] = node.rotation.unwrap_or_default().0.map(f64::from);
    let rotation = DQuat::from_xyzw(x, y, z, w);
    let length = rotation.length();
    DAffine3::from_scale_rotation_translation(
        vector(node.scale, DVec3::ONE),
        if length > 0.0 { rotation / length } else { DQuat::IDENTITY },
        vector(node.translation, DVec3::ZERO),
    )
}

/// Affine part of a column-major 4x4 matrix; its last row is (0, 0, 0, 1) by the specification.
fn affine_from_columns(m: &[f64; 16]) -> DAffine3 {
    let column = |c: usize| DVec3::new(m[4 * c], m[4 * c + 1], m[4 * c + 2]);
    DAffine3 { matrix3: DMat3::from_cols(column(0), column(1), column(2)), translation: column(3) }
}

/// `EXT_mesh_gpu_instancing`: transforms of the instances in the node's space, if it has any.
pub(super) fn instances(file: &File<'_>, node: &json::Node) -> Fallible<Option<Vec<DAffine3>>> {
    let extension = node.extensions.as_ref();
    let extension = extension.and_then(|all| all.others.get("EXT_mesh_gpu_instancing"));
    let Some(extension) = extension else { return Ok(None) };
    let nonsense = || "its instances make no sense".to_owned();
    let attributes = extension.get("attributes").and_then(Value::as_object).ok_or_else(nonsense)?;
    let open = |name: &str, kind| match attributes.get(name) {
        None => Ok(None),
        Some(index) => {
            let index = index.as_u64().ok_or_else(nonsense)?;
            let index = json::Index::new(u32::try_from(index).unwrap_or(u32::MAX));
            Elements::open(file, index, &[kind]).map(Some)
        }
    };
    let translation = open("TRANSLATION", Type::Vec3)?;
    let rotation = open("ROTATION", Type::Vec4)?;
    let scale = open("SCALE", Type::Vec3)?;
    let mut counts = [&translation, &rotation, &scale].into_iter().flatten().map(|e| e.count);
    let Some(count) = counts.next() else { return Ok(None) };
    if counts.any(|other| other != count) {
        return Err("instance attributes differ in length".into());
    }
    // Files may forget to mark integer quaternions as normalized; the length does not matter here.
    let transform = |element| {
        local_transform(&json::Node {
            translation: translation.as_ref().map(|e| e.floats(element)),
            rotation: rotation.as_ref().map(|e| json::scene::UnitQuaternion(e.floats(element))),
            scale: scale.as_ref().map(|e| e.floats(element)),
            ..Default::default()
        })
    };
    Ok(Some((0..count).map(transform).collect()))
}

/// World from bind space of each joint of a skin: joint transform times inverse bind matrix.
pub(super) fn joint_transforms(
    file: &File<'_>,
    nodes: &Nodes,
    skin: json::Index<json::Skin>,
) -> Fallible<Vec<DAffine3>> {
    let joints = &find(&file.root.skins, skin, "skin")?.joints;
    let inverse_bind = match file.root.skins[skin.value()].inverse_bind_matrices {
        Some(accessor) => Some(Elements::open(file, accessor, &[Type::Mat4])?),
        None => None,
    };
    if let Some(matrices) = &inverse_bind
        && matrices.count < joints.len()
    {
        return Err(format!(
            "skin {skin} has {} joints but only {} inverse bind matrices",
            joints.len(),
            matrices.count
        ));
    }
    let transform = |(joint, &node): (usize, &json::Index<json::Node>)| {
        find(&file.root.nodes, node, "node")?;
        let bind = inverse_bind.as_ref().map_or(DAffine3::IDENTITY, |matrices| {
            affine_from_columns(&matrices.floats::<16>(joint).map(f64::from))
        });
        Ok(nodes.world[node.value()] * bind)
    };
    joints.iter().enumerate().map(transform).collect()
}
