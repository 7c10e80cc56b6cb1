//! The node hierarchy at rest: what is in the shown scene, and where.

use std::collections::BTreeSet;

use glam::{DAffine3, DMat4, DQuat, DVec3, Vec3};
use gltf::json;
use json::Index;
use json::accessor::Type;
use serde::Deserialize;
use serde_json::Value;

use super::accessor::Elements;
use super::buffers::File;
use super::document::Document;
use super::lenient::whole;
use super::limits::Fallible;
use super::objects::Objects;
use crate::memory;

/// In place of a node that is not there.
const NONE: u32 = u32::MAX;

/// What a node shows, and what else is asked of one.
pub(super) const MESH: u8 = 1;
pub(super) const CAMERA: u8 = 2;
pub(super) const LIGHT: u8 = 4;
pub(super) const EXTRAS: u8 = 8;
const ANYTHING: u8 = MESH | CAMERA | LIGHT | EXTRAS;
const IS_SHOWN: u8 = 16;
const IS_JOINT: u8 = 32;

/// The nodes of the shown scene and where they are. Little is kept of those that show nothing.
pub(super) struct Nodes {
    hierarchy: Hierarchy,
    /// World from node of the nodes that show something and of joints, by their numbers; in f64: far-away
    /// parents cancel exactly enough.
    places: Vec<(u32, DAffine3)>,
    /// Nodes of the shown scene that show something, and what; parents before children, in file order.
    shown: Vec<(u32, u8)>,
}

/// Who is below whom.
struct Hierarchy {
    parents: Vec<u32>,
    /// Where each node's children begin, and at last where those of the last one end.
    first_child: Vec<u32>,
    children: Vec<u32>,
}

/// What the hierarchy is made of.
#[derive(Deserialize)]
struct Below {
    children: Option<Vec<Index<json::Node>>>,
    skin: Option<Index<json::Skin>>,
}

/// The nodes at the top of a scene, and what others keep there.
#[derive(Deserialize)]
pub(super) struct Tops {
    #[serde(default)]
    nodes: Vec<Index<json::Node>>,
    pub(super) extras: json::Extras,
}

/// Members of a skin.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Skin {
    joints: Vec<Index<json::Node>>,
    inverse_bind_matrices: Option<Index<json::Accessor>>,
}

impl Nodes {
    /// Walks the hierarchy; loops, shared children and missing nodes are errors. `world` is world from file.
    pub(super) fn new(document: &Document<'_>, world: DAffine3) -> Fallible<Self> {
        let (hierarchy, skins) = Hierarchy::new(&document.nodes)?;
        let mut marks = vec![0; document.nodes.len()];
        for skin in skins {
            for node in document.skins.get_as::<Skin>(skin)?.joints {
                document.nodes.text(node)?;
                marks[node.value()] = IS_JOINT;
            }
        }
        let scenes = &document.scenes;
        let roots = if document.scene.is_none() && scenes.len() == 0 {
            hierarchy.tops().map(Index::new).collect()
        } else {
            // The default scene, else the first one.
            let scene: Tops = scenes.get_as(document.shown_scene())?;
            for &node in &scene.nodes {
                document.nodes.text(node)?;
            }
            scene.nodes
        };
        for root in &roots {
            hierarchy.walk(root.value() as u32, |node, _| {
                let is_new = marks[node] & IS_SHOWN == 0;
                marks[node] |= IS_SHOWN;
                is_new
            });
        }
        let places = places(document, &hierarchy, world, &mut marks)?;
        let mut shown = Vec::new();
        for root in &roots {
            hierarchy.walk(root.value() as u32, |node, _| {
                let is_new = marks[node] & IS_SHOWN != 0;
                marks[node] &= !IS_SHOWN;
                if is_new && marks[node] & ANYTHING != 0 {
                    shown.push((node as u32, marks[node]));
                }
                is_new
            });
        }
        Ok(Self { hierarchy, places, shown })
    }

    /// The nodes of the shown scene that show one of these.
    pub(super) fn showing(&self, what: u8) -> impl Iterator<Item = Index<json::Node>> {
        let nodes = self.shown.iter().filter(move |(_, shows)| shows & what != 0);
        nodes.map(|&(node, _)| Index::new(node))
    }

    /// World from node, if it shows something or is a joint of a skin in use.
    pub(super) fn world(&self, node: Index<json::Node>) -> DAffine3 {
        let found = self.places.binary_search_by_key(&(node.value() as u32), |place| place.0);
        found.map_or(DAffine3::IDENTITY, |found| self.places[found].1)
    }

    /// The node above.
    pub(super) fn parent(&self, node: Index<json::Node>) -> Option<Index<json::Node>> {
        let parent = self.hierarchy.parents[node.value()];
        (parent != NONE).then(|| Index::new(parent))
    }
}

impl Hierarchy {
    /// Reads it; and which skins are in use. A node may have one parent only, so what hangs below a root is a tree.
    fn new(nodes: &Objects<'_, json::Node>) -> Fallible<(Self, BTreeSet<Index<json::Skin>>)> {
        let mut parents = vec![NONE; nodes.len()];
        let mut first_child = Vec::with_capacity(nodes.len() + 1);
        let (mut children, mut skins) = (Vec::new(), BTreeSet::new());
        for parent in nodes.indices() {
            first_child.push(children.len() as u32);
            let below: Below = nodes.get_as(parent)?;
            skins.extend(below.skin);
            for child in below.children.into_iter().flatten() {
                nodes.text(child)?;
                let other = std::mem::replace(&mut parents[child.value()], parent.value() as u32);
                if other != NONE {
                    return Err(format!(
                        "node {child} has two parents, nodes {other} and {parent}"
                    ));
                }
                children.push(child.value() as u32);
            }
        }
        first_child.push(children.len() as u32);
        Ok((Self { parents, first_child, children }, skins))
    }

    /// Nodes without parents.
    fn tops(&self) -> impl Iterator<Item = u32> {
        (0..self.parents.len() as u32).filter(|node| self.parents[*node as usize] == NONE)
    }

    /// Visits the nodes at and below one with their depths below it, depth first without recursion; `visit` says
    /// whether to go on below a node.
    fn walk(&self, root: u32, mut visit: impl FnMut(usize, usize) -> bool) {
        let mut stack = vec![(root, 0_u32)];
        while let Some((node, depth)) = stack.pop() {
            let node = node as usize;
            if visit(node, depth as usize) {
                let range = self.first_child[node] as usize..self.first_child[node + 1] as usize;
                stack.extend(self.children[range].iter().rev().map(|&child| (child, depth + 1)));
            }
        }
    }
}

/// Where the shown nodes that show something are, and joints; notes what nodes show.
fn places(
    document: &Document<'_>,
    hierarchy: &Hierarchy,
    world: DAffine3,
    marks: &mut [u8],
) -> Fallible<Vec<(u32, DAffine3)>> {
    let (mut places, mut visited) = (Vec::new(), 0);
    // World from node of those above, from the top down, and whether they are hidden.
    let mut above: Vec<(DAffine3, bool)> = Vec::new();
    let mut failure = None;
    for top in hierarchy.tops() {
        hierarchy.walk(top, |number, depth| {
            visited += 1;
            let node = document.nodes.get(Index::new(number as u32));
            let Ok(node) = node.map_err(|cause| _ = failure.get_or_insert(cause)) else {
                return false;
            };
            above.truncate(depth);
            let local = local_transform(&node);
            let (parent, is_below_hidden) = above.last().copied().unwrap_or((world, false));
            let (world, is_hidden) = (parent * local, is_below_hidden || is_hidden(&node));
            above.push((world, is_hidden));
            let mark = &mut marks[number];
            *mark |= shows(&node) & if is_hidden { !(MESH | LIGHT) } else { u8::MAX };
            if *mark & IS_JOINT != 0 || (*mark & IS_SHOWN != 0 && *mark & ANYTHING != 0) {
                places.push((number as u32, world));
            }
            true
        });
    }
    failure.map_or(Ok(()), Err)?;
    let looping = document.nodes.len() - visited;
    if looping > 0 {
        return Err(format!("its nodes form a loop: {looping} of them have no root above"));
    }
    places.sort_unstable_by_key(|place| place.0);
    Ok(places)
}

/// What there is at a node.
fn shows(node: &json::Node) -> u8 {
    let lights = node.extensions.as_ref().and_then(|all| all.khr_lights_punctual.as_ref());
    let bit = |kind: u8, is_there: bool| kind * u8::from(is_there);
    bit(MESH, node.mesh.is_some())
        | bit(CAMERA, node.camera.is_some())
        | bit(LIGHT, lights.is_some())
        | bit(EXTRAS, node.extras.is_some())
}

/// `KHR_node_visibility`: whether what is at a node and below it is not to be seen.
fn is_hidden(node: &json::Node) -> bool {
    let extension = node.extensions.as_ref();
    let extension = extension.and_then(|all| all.others.get("KHR_node_visibility"));
    extension.and_then(|it| it.get("visible")?.as_bool()) == Some(false)
}

/// Parent from node, at rest.
pub(super) fn local_transform(node: &json::Node) -> DAffine3 {
    if let Some(m) = node.matrix {
        return DAffine3::from_mat4(DMat4::from_cols_array(&m.map(f64::from)));
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

/// The mirroring by a node's own scale.
pub(super) fn own_mirror(node: &json::Node) -> DAffine3 {
    let scale = node.scale.filter(|_| node.matrix.is_none()).unwrap_or([1.0; 3]);
    DAffine3::from_scale(Vec3::from(scale).signum().as_dvec3())
}

/// `EXT_mesh_gpu_instancing`: transforms of the instances in the node's space, if it has any.
pub(super) fn instances(file: &File<'_>, node: &json::Node) -> Fallible<Option<Vec<DAffine3>>> {
    let extension = node.extensions.as_ref();
    let extension = extension.and_then(|all| all.others.get("EXT_mesh_gpu_instancing"));
    let Some(extension) = extension else { return Ok(None) };
    let nonsense = || "its instances make no sense".to_owned();
    let attributes = extension.get("attributes").and_then(Value::as_object).ok_or_else(nonsense)?;
    let open = |name: &str, kind| {
        let index = attributes.get(name).map(|index| whole(index).ok_or_else(nonsense));
        let index = index.transpose()?.map(|index| u32::try_from(index).unwrap_or(u32::MAX));
        index.map(|index| Elements::open(file, Index::new(index), &[kind])).transpose()
    };
    let translation = open("TRANSLATION", Type::Vec3)?;
    let rotation = open("ROTATION", Type::Vec4)?;
    let scale = open("SCALE", Type::Vec3)?;
    let mut counts = [&translation, &rotation, &scale].into_iter().flatten().map(|e| e.count);
    let Some(count) = counts.next() else { return Ok(None) };
    if counts.any(|other| other != count) {
        return Err("instance attributes differ in length".into());
    }
    memory::check((count * size_of::<DAffine3>()) as u64)?;
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
    index: Index<json::Skin>,
) -> Fallible<Vec<DAffine3>> {
    let skin: Skin = file.document.skins.get_as(index)?;
    let joints = &skin.joints;
    let open = |accessor| Elements::open(file, accessor, &[Type::Mat4]);
    let inverse_bind = skin.inverse_bind_matrices.map(open).transpose()?;
    let (needed, count) = (joints.len(), inverse_bind.as_ref().map_or(joints.len(), |it| it.count));
    if count < needed {
        return Err(format!(
            "skin {index} has {needed} joints but only {count} inverse bind matrices"
        ));
    }
    let transform = |(joint, &node): (usize, &Index<json::Node>)| {
        let bind = inverse_bind.as_ref().map_or(DAffine3::IDENTITY, |matrices| {
            DAffine3::from_mat4(DMat4::from_cols_array(&matrices.floats(joint).map(f64::from)))
        });
        nodes.world(node) * bind
    };
    Ok(joints.iter().enumerate().map(transform).collect())
}
