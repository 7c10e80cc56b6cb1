//! glTF 2.0 files (`.gltf`, `.glb`) as a [`Scene`]: the only place that knows the format.
//!
//! Files come from anywhere, so nothing in them is believed: every index, offset and count is
//! checked where it is followed, and nothing large is allocated before its size is known to be
//! backed by data. What cannot be rendered is left out with a notice; what makes the geometry
//! meaningless is an error.
//!
//! `document` parses, `buffers`, `uri` and `accessor` give access to the data, `pose` places nodes
//! and joints, `materials`, `textures` and `medium` read the look, `primitive`, `geometry` and `tangents` read
//! triangles,
//! `bake` puts them into the world.

mod accessor;
mod bake;
mod buffers;
mod document;
mod extensions;
mod geometry;
mod materials;
mod medium;
mod newer;
mod pose;
mod primitive;
mod tangents;
mod textures;
mod uri;
mod viewpoints;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use glam::DAffine3;
use gltf::json;

use crate::error::{Error, Notices, Result};
use crate::image::read_cause;
use crate::scene::Scene;

use buffers::{File, find};
use geometry::{Needs, Part, Tally};
use materials::Materials;
use pose::Nodes;

/// Most triangles a scene may have, instances counted one by one.
const MAX_TRIANGLES: u64 = 200_000_000;

/// A result whose error is the cause alone; the file's name is put before it in one place.
type Fallible<T> = std::result::Result<T, String>;

/// Loads a `.gltf` or `.glb` file; relative URIs in it are files beside it.
///
/// # Errors
/// One sentence with the path and the cause: a file that cannot be read, is cut off, refers to
/// what is not there, requires an unsupported extension, or has no triangles.
pub fn load(path: &Path) -> Result<Scene> {
    let bytes = std::fs::read(path).map_err(|e| Error::at(path, read_cause(&e)))?;
    let base_dir = path.parent().unwrap_or(Path::new(""));
    let mut scene = read(&bytes, Some(base_dir)).map_err(|cause| Error::at(path, cause))?;
    scene.name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok(scene)
}

/// Loads a glTF file from memory. Without `base_dir` only embedded data can be read.
///
/// # Errors
/// As [`load`], with `name` in place of the path.
pub fn load_slice(bytes: &[u8], base_dir: Option<&Path>, name: &str) -> Result<Scene> {
    let mut scene = read(bytes, base_dir).map_err(|cause| Error::at(name, cause))?;
    name.clone_into(&mut scene.name);
    Ok(scene)
}

fn read(bytes: &[u8], base_dir: Option<&Path>) -> Fallible<Scene> {
    let mut notices = Notices::default();
    let (root, binary) = document::parse(bytes, &mut notices)?;
    let file = File::open(root, binary, base_dir)?;
    let nodes = Nodes::new(&file.root, &mut notices)?;
    let mut scene = Scene {
        cameras: viewpoints::cameras(&file.root, &nodes, &mut notices)?,
        lights: viewpoints::lights(&file.root, &nodes, &mut notices)?,
        medium: medium::medium(&file.root, &nodes, &mut notices),
        ..Scene::default()
    };
    let placements = placements(&file, &nodes)?;
    let used = used_materials(&file.root, &placements)?;
    let materials = Materials::load(&file, &used, &mut notices)?;
    let mut tally = Tally::default();
    for (&mesh, placements) in &placements {
        append_mesh(&file, &nodes, mesh, placements, &materials, &mut scene, &mut tally).map_err(
            |cause| match &file.root.meshes[mesh].name {
                Some(name) => format!("mesh {mesh} ({name}): {cause}"),
                None => format!("mesh {mesh}: {cause}"),
            },
        )?;
    }
    if scene.triangles.is_empty() {
        let reasons = repairs(&tally).join(", ");
        let reasons = if reasons.is_empty() { reasons } else { format!(" ({reasons})") };
        return Err(format!("it shows no triangles, so there is nothing to render{reasons}"));
    }
    for repair in repairs(&tally) {
        notices.add(repair);
    }
    bake::finish(&mut scene);
    scene.materials = materials.materials;
    scene.textures = materials.textures;
    scene.images = materials.images;
    scene.notices = notices;
    Ok(scene)
}

/// A node that shows a mesh.
struct Placement<'a> {
    node: &'a json::Node,
    /// World from mesh, one for each instance.
    instances: Vec<DAffine3>,
}

/// The shown nodes with meshes, by mesh, so that each mesh is read once.
fn placements<'a>(
    file: &'a File<'_>,
    nodes: &Nodes,
) -> Fallible<BTreeMap<usize, Vec<Placement<'a>>>> {
    let mut placements: BTreeMap<usize, Vec<Placement<'a>>> = BTreeMap::new();
    for &number in &nodes.shown {
        let node = &file.root.nodes[number];
        let Some(mesh) = node.mesh else { continue };
        find(&file.root.meshes, mesh, "mesh")?;
        let world = nodes.world[number];
        let instances = pose::instances(file, node)
            .map_err(|cause| format!("node {number}: {cause}"))?
            .map_or_else(|| vec![world], |all| all.iter().map(|&one| world * one).collect());
        placements.entry(mesh.value()).or_default().push(Placement { node, instances });
    }
    Ok(placements)
}

fn used_materials(
    root: &json::Root,
    placements: &BTreeMap<usize, Vec<Placement<'_>>>,
) -> Fallible<BTreeSet<Option<usize>>> {
    let mut used = BTreeSet::new();
    for primitive in placements.keys().flat_map(|&mesh| &root.meshes[mesh].primitives) {
        if let Some(material) = primitive.material {
            find(&root.materials, material, "material")?;
        }
        used.insert(primitive.material.map(|material| material.value()));
    }
    Ok(used)
}

/// Appends all placements of one mesh, reading it again only where morph weights differ.
fn append_mesh(
    file: &File<'_>,
    nodes: &Nodes,
    mesh: usize,
    placements: &[Placement<'_>],
    materials: &Materials,
    scene: &mut Scene,
    tally: &mut Tally,
) -> Fallible<()> {
    let mesh = &file.root.meshes[mesh];
    let mut read: Option<(&[f32], Vec<Part>)> = None;
    for placement in placements {
        let weights = placement.node.weights.as_deref().or(mesh.weights.as_deref());
        let weights = weights.unwrap_or_default();
        let parts = match read.take() {
            Some((known, parts)) if known == weights => parts,
            _ => read_parts(file, mesh, weights, materials, tally)?,
        };
        let joints = match placement.node.skin {
            Some(skin) => Some(pose::joint_transforms(file, nodes, skin)?),
            None => None,
        };
        for part in &parts {
            match &joints {
                Some(joints) if part.influences_per_vertex > 0 => {
                    bake::append_skinned(scene, part, joints, tally)?;
                }
                _ => bake::append_instances(scene, part, &placement.instances, tally)?,
            }
        }
        read = Some((weights, parts));
    }
    Ok(())
}

fn read_parts(
    file: &File<'_>,
    mesh: &json::Mesh,
    weights: &[f32],
    materials: &Materials,
    tally: &mut Tally,
) -> Fallible<Vec<Part>> {
    let mut parts = Vec::new();
    for (number, primitive) in mesh.primitives.iter().enumerate() {
        let material = materials.places[&primitive.material.map(|material| material.value())];
        let needs = Needs::of(&materials.materials[material as usize]);
        let part = geometry::read_part(file, primitive, weights, material, &needs, tally)
            .map_err(|cause| format!("primitive {number}: {cause}"))?;
        parts.extend(part);
    }
    Ok(parts)
}

/// A clause for each kind of repair that was needed.
fn repairs(tally: &Tally) -> Vec<String> {
    let Tally { points, lines, without_positions, dropped_triangles, bad_normals, bad_values } =
        tally;
    let mut repairs = Vec::new();
    if points + lines > 0 {
        repairs.push(format!(
            "{points} point and {lines} line primitives were skipped: only triangles are rendered"
        ));
    }
    for (count, what) in [
        (without_positions, "primitives without positions were skipped"),
        (dropped_triangles, "triangles without area or with non-finite corners were dropped"),
        (bad_normals, "unusable vertex normals were ignored: shading is flat there"),
        (bad_values, "texture coordinates or colours that are not finite were replaced"),
    ] {
        if *count > 0 {
            repairs.push(format!("{count} {what}"));
        }
    }
    repairs
}
