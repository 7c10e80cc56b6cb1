//! Where meshes are shown.

use std::collections::BTreeMap;

use glam::DAffine3;
use gltf::json;

use super::buffers::File;
use super::limits::{Fallible, MAX_TRIANGLES, check_count};
use super::pose::{self, MESH, Nodes};
use crate::scene::copies::{copies, hash_of};

/// A node that shows a mesh.
pub(super) struct Placement {
    pub(super) skin: Option<json::Index<json::Skin>>,
    /// Of morph targets, if the mesh's own do not hold.
    pub(super) weights: Option<Vec<f32>>,
    /// World from mesh, one for each instance.
    pub(super) instances: Vec<DAffine3>,
}

/// The shown nodes with meshes, by mesh, so that each mesh is read once.
pub(super) fn placements(
    file: &File<'_>,
    nodes: &Nodes,
) -> Fallible<BTreeMap<u32, Vec<Placement>>> {
    let mut placements: BTreeMap<u32, Vec<Placement>> = BTreeMap::new();
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

/// Leaves out instances of a mesh in the place of another one, as after a doubled import; how many there were.
pub(super) fn drop_copies(placements: &mut BTreeMap<u32, Vec<Placement>>) -> usize {
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
