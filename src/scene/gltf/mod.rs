//! glTF 2.0 files (`.gltf`, `.glb`) as a [`Scene`]: the only place that knows the format.
//!
//! Files come from anywhere, so nothing in them is believed: every index, offset and count is
//! checked where it is followed, and nothing large is allocated before its size is known to be
//! backed by data. What cannot be rendered is left out with a notice; what makes the geometry
//! meaningless is an error.
//!
//! `document`, `objects` and `lenient` parse, `limits` says what is too much, `buffers`, `uri` and `accessor` give access to the data, `meshopt` and `draco`
//! unpack them, `pose` and `placement` place nodes,
//! joints and meshes, `animation` moves cameras, `materials`, `variants`, `textures` and `medium` read the look, `primitive`, `geometry` and `tangents` read
//! triangles,
//! `sheets` finds surfaces of bodies that enclose nothing,
//! `lamps` chooses the units of lights, `share` says which are held once for all their instances, `bake` puts the others into the world.

mod accessor;
mod animation;
mod bake;
mod buffers;
mod document;
mod draco;
mod extensions;
mod geometry;
mod lamps;
mod lenient;
mod limits;
mod materials;
mod medium;
mod meshopt;
mod newer;
mod objects;
mod part;
mod placement;
mod pose;
mod primitive;
mod share;
mod sheets;
mod tangents;
mod textures;
mod uri;
mod variants;
mod viewpoints;

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::PoisonError;

use glam::DAffine3;
use gltf::json;

use crate::error::{At as _, Error, Notices, Result};
use crate::image::{IS_A_FILM, looks_like_film, looks_like_picture, read_file};
use crate::scene::needs::is_emitter;
use crate::scene::{Frame, Outlines, Scene, SceneOptions};

use buffers::File;
use document::Document;
use geometry::Needs;
use limits::{Fallible, MAX_TRIANGLES, check_count, check_growth};
use materials::Materials;
use part::{Part, Tally};
use placement::{Placement, bounds, box_around, drop_copies, placements};
use pose::Nodes;
use primitive::Mesh;
use share::Sharing;
use uri::Folder;
use variants::Look;

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
    let bytes = read_file(path).at(path)?;
    if looks_like_picture(&bytes) {
        return Err(Error::at(path, "is a picture, where a scene is expected; --env takes a map"));
    }
    if looks_like_film(&bytes) {
        return Err(Error::at(path, IS_A_FILM));
    }
    let base_dir = path.parent().unwrap_or(Path::new(""));
    let mut scene = read(&bytes, Some(base_dir), options).at(path)?;
    scene.name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok(scene)
}

/// Loads a glTF file from memory. Without `base_dir` only embedded data can be read.
///
/// # Errors
/// As [`load`], with `name` in place of the path.
pub fn load_slice(bytes: &[u8], base_dir: Option<&Path>, name: &str) -> Result<Scene> {
    let mut scene = read(bytes, base_dir, &SceneOptions::default()).at(name)?;
    name.clone_into(&mut scene.name);
    Ok(scene)
}

/// Reads a file in the frame that suits the bounds it states and, where they are not those of what it shows, again.
fn read(bytes: &[u8], base_dir: Option<&Path>, options: &SceneOptions) -> Fallible<Scene> {
    let scene = read_in(bytes, base_dir, options, None)?;
    let frame = scene.frame;
    if frame.is_identity() {
        return Ok(scene);
    }
    let points = scene.hull_points(|_| true).map(|point| frame.point_in_file(point));
    let suiting = Frame::suiting(box_around(points));
    if suiting.is_like(frame) {
        return Ok(scene);
    }
    drop(scene);
    read_in(bytes, base_dir, options, Some(suiting))
}

/// Reads a file in a frame; `None` is the one that suits the bounds it states.
fn read_in(
    bytes: &[u8],
    base_dir: Option<&Path>,
    options: &SceneOptions,
    frame: Option<Frame>,
) -> Fallible<Scene> {
    let mut notices = Notices::default();
    let (text, binary) = document::split(bytes)?;
    // Names in other encodings are no reason to refuse a file.
    let text = String::from_utf8_lossy(text);
    let document = Document::new(&text, &mut notices)?;
    let folder =
        Folder { path: base_dir, allow_outside: options.allow_outside, ..Folder::default() };
    let file = File::new(document, binary, folder);
    file.check_outputs(&options.outputs)?;
    let document = &file.document;
    let mut nodes = Nodes::new(document, DAffine3::IDENTITY)?;
    if document.scenes.len() > 1 {
        let (count, shown) = (document.scenes.len(), document.shown_scene());
        notices.add(format!("the file has {count} scenes; scene {shown} is shown"));
    }
    let mut placements = placements(&file, &nodes)?;
    let is_known = frame.is_some();
    let frame = frame.map_or_else(|| bounds(&file, &nodes, &placements).map(Frame::suiting), Ok)?;
    if !frame.is_identity() {
        // Again, from where f32 is exact enough; what there was to be said has been said.
        nodes = Nodes::new(document, frame.transform())?;
        placements = placement::placements(&file, &nodes)?;
    }
    let (cameras, camera_paths) = viewpoints::cameras(&file, &nodes, frame, &mut notices)?;
    let mut lights = viewpoints::lights(document, &nodes, &mut notices)?;
    lamps::scale(&mut lights, options.lamps, document.generator.as_deref(), &mut notices);
    let scene = Scene {
        cameras,
        camera_paths,
        lights: lights.into_iter().map(|light| viewpoints::placed(light, frame)).collect(),
        medium: medium::medium(document, &nodes, frame, &mut notices)?,
        frame,
        ..Scene::default()
    };
    let tally = Tally { copied_instances: drop_copies(&mut placements), ..Tally::default() };
    let look = Look::choose(document, options.variant.as_deref(), &mut notices)?;
    // Numbers of the materials that are shown; `None` is the default one.
    let mut used = BTreeSet::new();
    for &mesh in placements.keys() {
        let mesh: Mesh = document.meshes.get_as(json::Index::new(mesh))?;
        for primitive in mesh.primitives() {
            used.insert(look.material(&primitive?));
        }
    }
    let mut materials = Materials::load(&file, &used, &mut notices)?;
    materials.scale(frame.scale);
    let is_lamp = |primitive: &json::mesh::Primitive| {
        let material = materials.places[&look.material(primitive)];
        is_emitter(&materials.materials[material as usize])
    };
    let sharing = Sharing::choose(document, &placements, is_lamp)?;
    let (file, nodes, look) = (&file, &nodes, &look);
    let mut reading = Reading { file, nodes, look, materials, sharing, scene, tally };
    for (&number, placements) in &placements {
        let mesh: Mesh = document.meshes.get_as(json::Index::new(number))?;
        reading.append_mesh(number, &mesh, placements).map_err(|cause| match &mesh.name {
            Some(name) => format!("mesh {number} ({name}): {cause}"),
            None => format!("mesh {number}: {cause}"),
        })?;
    }
    let Reading { materials, sharing, mut scene, mut tally, .. } = reading;
    sharing.finish(&mut scene)?;
    materials.tell_of_sheets(&mut notices);
    if scene.triangles.is_empty() && !is_known && !frame.is_identity() {
        return read_in(bytes, base_dir, options, Some(Frame::default()));
    }
    if scene.triangles.is_empty() {
        let reasons = repairs(&tally).join(", ");
        let reasons = if reasons.is_empty() { reasons } else { format!(" ({reasons})") };
        return Err(format!("it shows no triangles, so there is nothing to render{reasons}"));
    }
    bake::finish(&mut scene);
    scene.materials = materials.materials;
    scene.textures = materials.textures;
    scene.images = materials.images;
    leave_out(&mut scene, options, &mut notices)?;
    tally.copied_triangles = scene.remove_copies();
    for repair in repairs(&tally) {
        notices.add(repair);
    }
    scene.pair_backs();
    scene.part_flush_faces();
    scene.notices = notices;
    let found = file.folder.found.lock().unwrap_or_else(PoisonError::into_inner).clone();
    scene.files = found.into_iter().collect();
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

/// What meshes are read with.
struct Reading<'a> {
    file: &'a File<'a>,
    nodes: &'a Nodes,
    look: &'a Look,
    materials: Materials,
    sharing: Sharing,
    scene: Scene,
    tally: Tally,
}

impl Reading<'_> {
    /// Appends all placements of one mesh, reading it again only where morph weights differ.
    fn append_mesh(&mut self, number: u32, mesh: &Mesh, placements: &[Placement]) -> Fallible<()> {
        let mut read: Option<(&[f32], Vec<Part>)> = None;
        let mut posed: Option<(json::Index<json::Skin>, Vec<DAffine3>)> = None;
        for (place, placement) in placements.iter().enumerate() {
            let weights = placement.weights.as_deref().or(mesh.weights.as_deref());
            let weights = weights.unwrap_or_default();
            let parts = match read.take() {
                Some((known, parts)) if known == weights => parts,
                _ => self.read_parts(mesh, weights, placement.instances.first())?,
            };
            let joints = match placement.skin {
                Some(skin) => {
                    // Many nodes may show one mesh with one skin.
                    let transforms = match posed.take() {
                        Some((known, transforms)) if known == skin => transforms,
                        _ => pose::joint_transforms(self.file, self.nodes, skin)?,
                    };
                    Some(&posed.insert((skin, transforms)).1)
                }
                None => None,
            };
            let is_shared = |part: &&Part| {
                let material = &self.materials.materials[part.material as usize];
                self.sharing.wanted.contains(&number) && !is_emitter(material)
            };
            let shared: Vec<&Part> = parts.iter().filter(is_shared).collect();
            let extent = share::extent(&shared);
            for part in &parts {
                self.tally.dropped_triangles += match joints {
                    Some(joints) if part.influences_per_vertex > 0 => {
                        bake::skinned(&mut self.scene, part, joints)?
                    }
                    _ if is_shared(&part) => {
                        let cannot = |at: &DAffine3| !share::can_share(*at, extent);
                        let rest = placement.instances.iter().copied().filter(cannot);
                        bake::instances(&mut self.scene, part, &rest.collect::<Vec<_>>())?
                    }
                    _ => bake::instances(&mut self.scene, part, &placement.instances)?,
                };
            }
            if place == 0 && self.sharing.wanted.contains(&number) {
                let dropped = self.sharing.add(&mut self.scene, &shared, placements)?;
                self.tally.dropped_triangles += dropped;
            }
            read = Some((weights, parts));
        }
        Ok(())
    }

    fn read_parts(
        &mut self,
        mesh: &Mesh,
        weights: &[f32],
        place: Option<&DAffine3>,
    ) -> Fallible<Vec<Part>> {
        let mut parts = Vec::new();
        let (mut triangles, mut bytes) = (0, 0);
        for (number, primitive) in mesh.primitives().enumerate() {
            let primitive = primitive?;
            let material = self.materials.places[&self.look.material(&primitive)];
            let needs = Needs::of(&self.materials.materials[material as usize]);
            let targets = if weights.is_empty() { Vec::new() } else { mesh.targets(number)? };
            let (morph, tally) = ((&targets[..], weights), &mut self.tally);
            let part = geometry::read_part(self.file, &primitive, morph, material, &needs, tally)
                .map_err(|cause| format!("primitive {number}: {cause}"))?;
            let Some(part) = part else { continue };
            // Many may share the same long list of corners.
            triangles += part.triangles.len() as u64;
            check_count(triangles, MAX_TRIANGLES, "it has", "triangles")?;
            check_growth(bytes, part.bytes())?;
            bytes += part.bytes();
            parts.push(part);
        }
        // Bodies that are not closed get the materials of sheets, as thick as the first instance is placed.
        let material = |part: &Part| &self.materials.materials[part.material as usize];
        if parts.iter().any(|part| material(part).has_inside()) {
            let scale = place.map_or(1.0, |place| place.matrix3.determinant().abs().cbrt()) as f32;
            let are_sheets = sheets::sheets(&parts)?;
            for (part, is_sheet) in parts.iter_mut().zip(are_sheets) {
                let material = &self.materials.materials[part.material as usize];
                if is_sheet && material.has_inside() {
                    part.material = self.materials.sheet(part.material, scale * material.thickness);
                }
            }
        }
        Ok(parts)
    }
}

/// A clause for each kind of repair that was needed.
fn repairs(tally: &Tally) -> Vec<String> {
    let mut repairs = Vec::new();
    if tally.points + tally.lines > 0 {
        repairs.push(format!(
            "{} point and {} line primitives were skipped: only triangles are rendered",
            tally.points, tally.lines
        ));
    }
    for (count, what) in [
        (tally.without_positions, "primitives without positions were skipped"),
        (
            tally.dropped_triangles,
            "triangles without area or with corners that are not finite or beyond 1e18 m were dropped",
        ),
        (tally.bad_normals, "unusable vertex normals were ignored: shading is flat there"),
        (tally.bad_values, "texture coordinates or colours that are not finite were replaced"),
        (
            tally.short_attributes,
            "normals, tangents, texture coordinates or colours with too few elements were left out",
        ),
        (
            tally.copied_instances,
            "instances were left out: each is a copy of another in the same place",
        ),
        (
            tally.copied_triangles,
            "triangles were left out: each is a copy of another in the same place",
        ),
    ] {
        if count > 0 {
            repairs.push(format!("{count} {what}"));
        }
    }
    repairs
}
