//! Which meshes their instances share, instead of being copied into the world.
//!
//! A second level of the tree costs time, so it must spare much. What is never shared: lamps, whose
//! triangles the tree of lights places in the world; meshes with skins, or with morph weights that
//! differ from node to node, since those have shapes of their own; and instances whose place has no
//! sound inverse ([`bvh::Instance::can_be_walked`]). All of that is baked.

use std::collections::BTreeSet;

use glam::{DAffine3, Vec3};
use gltf::json;
use json::mesh::Mode;
use json::validation::Checked;

use super::bake;
use super::document::Document;
use super::limits::{Fallible, check_count};
use super::part::Part;
use super::placement::{Placement, Placements};
use super::primitive::Mesh;
use crate::bvh;
use crate::math::box_corners;
use crate::memory;
use crate::scene::{Instance, Instances, MAX_SHOWN, Placing, Scene};

/// Meshes are shared if that spares so many triangles, 0.3 GB of them, and half of all.
const MIN_SPARED: u64 = 1 << 20;

/// Triangles of a mesh that is shared: an instance takes the memory of a few, and entering it the time
/// of many.
const MIN_TRIANGLES: u64 = 64;

/// Bytes of an instance, in the scene and in the tree while that is built.
const INSTANCE_BYTES: u64 = 800;

/// The meshes that are shared, as far as they have been read.
#[derive(Default)]
pub(super) struct Sharing {
    pub(super) wanted: BTreeSet<u32>,
    /// Triangles and materials of each mesh.
    meshes: Vec<(Vec<[u32; 3]>, Vec<u32>)>,
    instances: Vec<Instance>,
}

impl Sharing {
    /// Chooses them by what the file says it has; `is_lamp` tells of a primitive whether it shines.
    pub(super) fn choose(
        document: &Document<'_>,
        placements: &Placements,
        is_lamp: impl Fn(&json::mesh::Primitive) -> bool,
    ) -> Fallible<Self> {
        let (mut wanted, mut spared, mut all) = (BTreeSet::new(), 0_u64, 0_u64);
        for (&number, placements) in placements {
            let mut triangles = 0;
            let mesh: Mesh = document.meshes.get_as(json::Index::new(number))?;
            for primitive in mesh.primitives() {
                let primitive = primitive?;
                triangles += if is_lamp(&primitive) { 0 } else { count(document, &primitive) };
            }
            let instances = placements.iter().map(|placement| placement.instances.len() as u64);
            let instances: u64 = instances.sum();
            all = all.saturating_add(triangles.saturating_mul(instances));
            let weights = &placements[0].weights;
            let is_alike = |one: &Placement| one.skin.is_none() && one.weights == *weights;
            if instances > 1 && triangles >= MIN_TRIANGLES && placements.iter().all(is_alike) {
                spared = spared.saturating_add(triangles.saturating_mul(instances - 1));
                wanted.insert(number);
            }
        }
        let pays = spared >= MIN_SPARED && spared >= all / 2;
        Ok(Self { wanted: if pays { wanted } else { BTreeSet::new() }, ..Self::default() })
    }

    /// Takes in the parts of a mesh that are no lamps, and those of its places at which it can be shared.
    pub(super) fn add(
        &mut self,
        scene: &mut Scene,
        parts: &[&Part],
        placements: &[Placement],
    ) -> Fallible<usize> {
        let extent = extent(parts);
        let places = placements.iter().flat_map(|placement| &placement.instances);
        memory::check(INSTANCE_BYTES * places.clone().count() as u64)?;
        let places = places.filter(|place| can_share(**place, extent));
        let mesh = self.meshes.len() as u32;
        let instance = |&place: &DAffine3| Instance { mesh, placing: Placing::new(place) };
        self.instances.extend(places.map(instance));
        let (first, mut dropped) = (scene.triangles.len(), 0);
        for part in parts {
            dropped += bake::shared(scene, part)?;
        }
        let triangles = scene.triangles.split_off(first);
        self.meshes.push((triangles, scene.triangle_materials.split_off(first)));
        Ok(dropped)
    }

    /// Puts the meshes behind all other triangles.
    pub(super) fn finish(self, scene: &mut Scene) -> Fallible<()> {
        let mut meshes = Vec::new();
        for (triangles, materials) in self.meshes {
            let start = scene.triangles.len() as u32;
            scene.triangles.extend(triangles);
            scene.triangle_materials.extend(materials);
            meshes.push(start..scene.triangles.len() as u32);
        }
        let of_mesh = |one: &Instance| meshes[one.mesh as usize].len() as u64;
        let shown: u64 = self.instances.iter().map(of_mesh).sum();
        let all = shown + scene.triangles.len() as u64;
        check_count(all, MAX_SHOWN, bake::WITH_INSTANCES, "triangles")?;
        scene.instances = Instances::new(meshes, self.instances);
        Ok(())
    }
}

/// Largest coordinate of what is shared.
pub(super) fn extent(parts: &[&Part]) -> f32 {
    let positions = parts.iter().flat_map(|part| &part.positions);
    positions.fold(0.0, |most, position| most.max(position.abs().max_element()))
}

/// Whether what has this extent can be shared where it is placed so.
pub(super) fn can_share(place: DAffine3, extent: f32) -> bool {
    let placing = Placing::new(place);
    let corners = box_corners([-extent, extent].map(Vec3::splat));
    let is_near = |corner: Vec3| bake::is_near(placing.position(corner));
    bvh::Instance::can_be_walked(place) && corners.into_iter().all(is_near)
}

/// Triangles that a primitive says it has; 0 of what is not drawn as triangles.
fn count(document: &Document<'_>, primitive: &json::mesh::Primitive) -> u64 {
    let positions = Checked::Valid(json::mesh::Semantic::Positions);
    let accessor = primitive.indices.or(primitive.attributes.get(&positions).copied());
    let accessor = accessor.and_then(|accessor| document.accessors.get(accessor).ok());
    let corners = accessor.map_or(0, |accessor| accessor.count.0);
    match primitive.mode {
        Checked::Valid(Mode::Triangles) => corners / 3,
        Checked::Valid(Mode::TriangleStrip | Mode::TriangleFan) => corners.saturating_sub(2),
        _ => 0,
    }
}
