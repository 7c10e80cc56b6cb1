//! Meshes that a scene shows several times but holds once.
//!
//! Triangles have numbers. Those in the world have their place in [`super::Scene::triangles`]; those of
//! instances have the numbers after them, in the order of instances, with gaps: numbers are given away
//! in slots of equal size, so that a number tells the instance without a search.

use std::ops::Range;

use super::placing::Placing;
use crate::bvh;

/// Most triangles a scene may show, instances counted one by one: their numbers fit into 32 bits.
pub const MAX_SHOWN: u64 = 1 << 31;

/// Slots there are for each instance at most, on average.
const SLOTS: u64 = 4;

/// A mesh in a place.
#[derive(Debug, Clone, Copy)]
pub struct Instance {
    /// Which of [`Instances::meshes`].
    pub mesh: u32,
    /// Where it is.
    pub placing: Placing,
}

/// A triangle's place in [`super::Scene::triangles`], and that of the instance it is of, if it is.
pub(super) type Surface<'a> = (usize, Option<&'a Placing>);

/// All shared meshes of a scene and where they are shown.
#[derive(Debug, Clone)]
pub struct Instances {
    meshes: Vec<Range<u32>>,
    all: Vec<Instance>,
    /// Number of the first triangle of instances; beyond all without meshes.
    pub(super) first: u32,
    /// A slot has two to the power of so many numbers.
    slot_log2: u32,
    /// Which instance each slot is of.
    slots: Vec<u32>,
    /// What is taken from the number of an instance's triangle to get its place.
    shifts: Vec<u32>,
}

impl Default for Instances {
    fn default() -> Self {
        Self::new(Vec::new(), Vec::new())
    }
}

impl Instances {
    /// Numbers the triangles of instances. `meshes` are ranges of [`super::Scene::triangles`], in its space
    /// each: its last triangles, in order.
    ///
    /// At most [`MAX_SHOWN`] triangles are shown.
    pub fn new(meshes: Vec<Range<u32>>, mut all: Vec<Instance>) -> Self {
        all.retain(|instance| !meshes[instance.mesh as usize].is_empty());
        let first = meshes.first().map_or(u32::MAX, |mesh| mesh.start);
        let slots_of = |instance: &Instance, log2: u32| {
            (meshes[instance.mesh as usize].len() as u64).div_ceil(1 << log2)
        };
        let enough = SLOTS * all.len() as u64;
        let are_few = |log2: &u32| all.iter().map(|i| slots_of(i, *log2)).sum::<u64>() <= enough;
        // With 2^31 in a slot, each has one.
        let slot_log2 = (0..31).find(are_few).unwrap_or(31);
        let (mut slots, mut shifts) = (Vec::new(), Vec::with_capacity(all.len()));
        for (number, instance) in (0..).zip(&all) {
            let start = first + ((slots.len() as u32) << slot_log2);
            shifts.push(start.wrapping_sub(meshes[instance.mesh as usize].start));
            slots.extend((0..slots_of(instance, slot_log2)).map(|_| number));
        }
        Self { meshes, all, first, slot_log2, slots, shifts }
    }

    /// Whether nothing is shared.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Number of instances.
    pub fn len(&self) -> usize {
        self.all.len()
    }

    /// Triangles of each mesh: ranges of [`super::Scene::triangles`].
    pub fn meshes(&self) -> &[Range<u32>] {
        &self.meshes
    }

    /// The instances.
    pub fn iter(&self) -> std::slice::Iter<'_, Instance> {
        self.all.iter()
    }

    /// Number of the first triangle of instances, how many numbers a slot has (as a power of two), and
    /// which instance each slot is of.
    pub(crate) fn slots(&self) -> (u32, u32, &[u32]) {
        (self.first, self.slot_log2, &self.slots)
    }

    /// Bytes that they take, without the meshes.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(&self.all[..]) + size_of_val(&self.slots[..]) + size_of_val(&self.shifts[..])
    }

    /// The triangle of a number.
    #[inline]
    pub(super) fn find(&self, triangle: u32) -> Surface<'_> {
        if triangle < self.first {
            return (triangle as usize, None);
        }
        let instance = self.slots[((triangle - self.first) >> self.slot_log2) as usize] as usize;
        let place = triangle.wrapping_sub(self.shifts[instance]);
        (place as usize, Some(&self.all[instance].placing))
    }

    /// As the tree wants them.
    pub(crate) fn for_tree(&self) -> Vec<bvh::Instance> {
        let all = self.all.iter().zip(&self.shifts);
        all.map(|(&Instance { mesh, placing }, shift)| bvh::Instance {
            mesh,
            world_from_mesh: placing.affine(),
            first: self.meshes[mesh as usize].start.wrapping_add(*shift),
        })
        .collect()
    }

    /// With only those triangles left of which `keeps` is true.
    pub(super) fn retained(self, keeps: impl Fn(u32) -> bool) -> Self {
        let Some(first) = self.meshes.first().map(|mesh| mesh.start) else { return self };
        let mut next = (0..first).filter(|&triangle| keeps(triangle)).count() as u32;
        let meshes = self.meshes.into_iter().map(|mesh| {
            let start = next;
            next += mesh.filter(|&triangle| keeps(triangle)).count() as u32;
            start..next
        });
        Self::new(meshes.collect(), self.all)
    }
}
