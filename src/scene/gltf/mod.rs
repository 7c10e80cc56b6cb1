//! glTF 2.0 files (`.gltf`, `.glb`) as a [`Scene`]: the only place that knows the format.
//!
//! Files come from anywhere, so nothing in them is believed: every index, offset and count is
//! checked where it is followed, and nothing large is allocated before its size is known to be
//! backed by data. What cannot be rendered is left out with a notice; what makes the geometry
//! meaningless is an error.
//!
//! `document` and `lenient` parse, `buffers`, `uri` and `accessor` give access to the data, `meshopt` and `draco`
//! unpack them, `pose` places nodes
//! and joints, `animation` moves cameras, `materials`, `variants`, `textures` and `medium` read the look, `primitive`, `geometry` and `tangents` read
//! triangles,
//! `share` says which are held once for all their instances, `bake` puts the others into the world.

mod accessor;
mod animation;
mod bake;
mod buffers;
mod document;
mod draco;
mod extensions;
mod geometry;
mod lenient;
mod materials;
mod medium;
mod meshopt;
mod newer;
mod part;
mod pose;
mod primitive;
mod share;
mod tangents;
mod textures;
mod uri;
mod variants;
mod viewpoints;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use glam::DAffine3;
use gltf::json;

use crate::error::{Error, Notices, Result};
use crate::image::{looks_like_picture, read_file};
use crate::scene::needs::is_emitter;
use crate::scene::{Outlines, Scene, SceneOptions};

use buffers::{File, find};
use geometry::Needs;
use materials::Materials;
use part::{Part, Tally};
use pose::Nodes;
use share::Sharing;
use uri::Folder;
use variants::Look;

/// Most triangles a scene may hold, baked instances counted one by one.
const MAX_TRIANGLES: u64 = 200_000_000;

/// A result whose error is the cause alone; the file's name is put before it in one place.
type Fallible<T> = std::result::Result<T, String>;

/// Loads a `.gltf` or `.glb` file; relative URIs in it are files beside it.
///
/// # Errors
/// One sentence with the path and the cause: a file that cannot be read, is cut off, refers to
/// what is not there, requires an unsupported extension, or has no triangles.
pub fn load(path: &Path) -> Result<Scene> {
    load_with(path, &SceneOptions::default())
}

/// Loads a file as [`load`] does, and as is asked.
///
/// # Errors
/// As [`load`].
pub fn load_with(path: &Path, options: &SceneOptions) -> Result<Scene> {
    let bytes = read_file(path).map_err(|cause| Error::at(path, cause))?;
    if looks_like_picture(&bytes) {
        return Err(Error::at(path, "is a picture, where a scene is expected; --env takes a map"));
    }
    let base_dir = path.parent().unwrap_or(Path::new(""));
    let mut scene =
        read(&bytes, Some(base_dir), options).map_err(|cause| Error::at(path, cause))?;
    scene.name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok(scene)
}

/// Loads a glTF file from memory. Without `base_dir` only embedded data can be read.
///
/// # Errors
/// As [`load`], with `name` in place of the path.
pub fn load_slice(bytes: &[u8], base_dir: Option<&Path>, name: &str) -> Result<Scene> {
    let options = SceneOptions::default();
    let mut scene = read(bytes, base_dir, &options).map_err(|cause| Error::at(name, cause))?;
    name.clone_into(&mut scene.name);
    Ok(scene)
}

fn read(bytes: &[u8], base_dir: Option<&Path>, options: &SceneOptions) -> Fallible<Scene> {
    let mut notices = Notices::default();
    let (root, binary) = document::parse(bytes, &mut notices)?;
    let folder = Folder { path: base_dir, allow_outside: options.allow_outside };
    let file = File::new(root, binary, folder);
    let nodes = Nodes::new(&file.root, &mut notices)?;
    let (cameras, camera_paths) = viewpoints::cameras(&file, &nodes, &mut notices)?;
    let mut scene = Scene {
        cameras,
        camera_paths,
        lights: viewpoints::lights(&file.root, &nodes, &mut notices)?,
        medium: medium::medium(&file.root, &nodes, &mut notices),
        ..Scene::default()
    };
    let placements = placements(&file, &nodes)?;
    let look = Look::choose(&file.root, options.variant.as_deref(), &mut notices)?;
    let used = used_materials(&file.root, &placements, &look)?;
    let materials = Materials::load(&file, &used, &mut notices)?;
    let mut tally = Tally::default();
    let is_lamp = |primitive: &json::mesh::Primitive| {
        let material = materials.places[&look.material(&file.root, primitive)?];
        Ok(is_emitter(&materials.materials[material as usize]))
    };
    let mut sharing = Sharing::choose(&file.root, &placements, is_lamp)?;
    let reading = Reading { file: &file, nodes: &nodes, look: &look, materials: &materials };
    for (&mesh, placements) in &placements {
        reading.append_mesh(mesh, placements, &mut scene, &mut sharing, &mut tally).map_err(
            |cause| match &file.root.meshes[mesh].name {
                Some(name) => format!("mesh {mesh} ({name}): {cause}"),
                None => format!("mesh {mesh}: {cause}"),
            },
        )?;
    }
    sharing.finish(&mut scene)?;
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
    leave_out(&mut scene, options, &mut notices)?;
    scene.notices = notices;
    Ok(scene)
}

/// Removes what is not to be shown: hidden materials, and hulls that would shut out the light.
fn leave_out(scene: &mut Scene, options: &SceneOptions, notices: &mut Notices) -> Fallible<()> {
    scene.hide(&options.hide)?;
    if options.outlines == Outlines::Keep {
        return Ok(());
    }
    let hulls = scene.hulls();
    for &hull in &hulls {
        notices.add(format!(
            "{} is an outline, a copy around the model that faces inwards and would shut out all \
             light; it is left out (--outlines keep shows it)",
            scene.materials[hull as usize].name
        ));
    }
    scene.remove_triangles_of(&hulls);
    scene.check_shown()
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
    look: &Look,
) -> Fallible<BTreeSet<Option<usize>>> {
    let primitives = placements.keys().flat_map(|&mesh| &root.meshes[mesh].primitives);
    primitives.map(|primitive| look.material(root, primitive)).collect()
}

/// What meshes are read with.
struct Reading<'a> {
    file: &'a File<'a>,
    nodes: &'a Nodes,
    look: &'a Look,
    materials: &'a Materials,
}

impl Reading<'_> {
    /// Appends all placements of one mesh, reading it again only where morph weights differ.
    fn append_mesh(
        &self,
        number: usize,
        placements: &[Placement<'_>],
        scene: &mut Scene,
        sharing: &mut Sharing,
        tally: &mut Tally,
    ) -> Fallible<()> {
        let mesh = &self.file.root.meshes[number];
        let mut read: Option<(&[f32], Vec<Part>)> = None;
        for (place, placement) in placements.iter().enumerate() {
            let weights = placement.node.weights.as_deref().or(mesh.weights.as_deref());
            let weights = weights.unwrap_or_default();
            let parts = match read.take() {
                Some((known, parts)) if known == weights => parts,
                _ => self.read_parts(mesh, weights, tally)?,
            };
            let joints = match placement.node.skin {
                Some(skin) => Some(pose::joint_transforms(self.file, self.nodes, skin)?),
                None => None,
            };
            let is_shared = |part: &&Part| {
                let material = &self.materials.materials[part.material as usize];
                sharing.wants(number) && !is_emitter(material)
            };
            let shared: Vec<&Part> = parts.iter().filter(is_shared).collect();
            let extent = share::extent(&shared);
            for part in &parts {
                match &joints {
                    Some(joints) if part.influences_per_vertex > 0 => {
                        bake::append_skinned(scene, part, joints, tally)?;
                    }
                    _ if is_shared(&part) => {
                        let cannot = |at: &DAffine3| !share::can_share(*at, extent);
                        let rest = placement.instances.iter().copied().filter(cannot);
                        bake::append_instances(scene, part, &rest.collect::<Vec<_>>(), tally)?;
                    }
                    _ => bake::append_instances(scene, part, &placement.instances, tally)?,
                }
            }
            if place == 0 && sharing.wants(number) {
                sharing.add(scene, &shared, placements, tally)?;
            }
            read = Some((weights, parts));
        }
        Ok(())
    }

    fn read_parts(
        &self,
        mesh: &json::Mesh,
        weights: &[f32],
        tally: &mut Tally,
    ) -> Fallible<Vec<Part>> {
        let mut parts = Vec::new();
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            let material =
                self.materials.places[&self.look.material(&self.file.root, primitive)?];
            let needs = Needs::of(&self.materials.materials[material as usize]);
            let part = geometry::read_part(self.file, primitive, weights, material, &needs, tally)
                .map_err(|cause| format!("primitive {number}: {cause}"))?;
            parts.extend(part);
        }
        Ok(parts)
    }
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
        (
            dropped_triangles,
            "triangles without area or with corners that are not finite or beyond 1e18 m were dropped",
        ),
        (bad_normals, "unusable vertex normals were ignored: shading is flat there"),
        (bad_values, "texture coordinates or colours that are not finite were replaced"),
    ] {
        if *count > 0 {
            repairs.push(format!("{count} {what}"));
        }
    }
    repairs
}
