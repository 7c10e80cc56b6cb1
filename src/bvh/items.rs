//! What trees are built over, and the binary tree that obvhs builds.

use std::ops::Range;
use std::time::Duration;

use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};
use rayon::prelude::*;

use super::instance::Placed;
use crate::sampler::{hash, unit_from_bits};

/// What a tree is built over: triangles that have an area, then instances. These are the primitives of
/// the binary tree.
pub(super) struct Items<'a> {
    pub(super) sources: Sources<'a>,
    pub(super) triangles: Vec<u32>,
    instances: Vec<u32>,
    placed: &'a [Placed],
}

/// One of them.
pub(super) enum Item {
    /// Its index.
    Triangle(u32),
    /// Its number.
    Instance(u32),
}

impl<'a> Items<'a> {
    /// Some of the triangles, and all instances that show any.
    pub(super) fn new(sources: Sources<'a>, triangles: Range<u32>, placed: &'a [Placed]) -> Self {
        let has_area = |triangle: &u32| sources.has_area(*triangle);
        let is_there = |number: &u32| placed[*number as usize].bounds.0.is_finite();
        let triangles = triangles.into_par_iter().filter(has_area).collect();
        let instances = (0..placed.len() as u32).filter(is_there).collect();
        Self { sources, triangles, instances, placed }
    }

    pub(super) fn get(&self, primitive: u32) -> Item {
        match self.triangles.get(primitive as usize) {
            Some(&triangle) => Item::Triangle(triangle),
            None => Item::Instance(self.instances[primitive as usize - self.triangles.len()]),
        }
    }

    pub(super) fn aabb(&self, primitive: u32) -> Aabb {
        match self.get(primitive) {
            Item::Triangle(triangle) => {
                Aabb::from_points(&self.sources.vertices(triangle).map(Vec3A::from))
            }
            Item::Instance(number) => {
                let (low, high) = self.placed[number as usize].bounds;
                Aabb { min: low.into(), max: high.into() }
            }
        }
    }

    /// The binary tree over them; `None` if there are none.
    pub(super) fn binary(&self) -> Option<Bvh2> {
        let count = (self.triangles.len() + self.instances.len()) as u32;
        if count == 0 {
            return None;
        }
        // One item a leaf: the collapse below forms the leaves. Without pre-splits (which
        // `build_bvh2` never does) each is referenced once, as `any_hit` promises.
        let parameters = BvhBuildParams {
            max_prims_per_leaf: 1,
            post_collapse_reinsertion_batch_ratio_multiplier: 0.0,
            ..BvhBuildParams::medium_build()
        };
        let boxes = (0..count).into_par_iter().map(|i| loosened(&self.aabb(i), i));
        let boxes: Vec<Aabb> = boxes.collect();
        let mut binary = build_bvh2(&boxes, parameters, &mut Duration::default());
        let (nodes, primitives) = (&mut binary.nodes, &binary.primitive_indices);
        nodes.par_iter_mut().filter(|node| node.is_leaf()).for_each(|node| {
            node.set_aabb(self.aabb(primitives[node.first_index as usize]));
        });
        binary.refit_all();
        Some(binary)
    }
}

/// A box made larger by a hair that is another one for every triangle. obvhs merges boxes that are each
/// other's best partner, and takes the last of equally good ones: among coincident or evenly stacked
/// triangles only one pair is merged a pass, which makes the passes quadratic. The hairs are exponentially
/// distributed, so that boxes of many merged ones differ by as much as those of two.
fn loosened(tight: &Aabb, number: u32) -> Aabb {
    const HAIR: f32 = 64.0 * f32::EPSILON;
    let hair = |side: u32| {
        let uniform = unit_from_bits(hash(number.wrapping_mul(6).wrapping_add(side)));
        -(1.0 - uniform).ln() * HAIR
    };
    let hairs = |first: u32| Vec3A::from_array([0, 1, 2].map(|axis| hair(first + axis)));
    let size = tight.min.abs().max(tight.max.abs());
    Aabb { min: tight.min - size * hairs(0), max: tight.max + size * hairs(3) }
}

/// The scene as the caller gave it.
#[derive(Clone, Copy)]
pub(super) struct Sources<'a> {
    pub(super) positions: &'a [Vec3],
    pub(super) triangles: &'a [[u32; 3]],
}

impl Sources<'_> {
    /// False for triangles that name no vertex, are not finite or have no area.
    fn has_area(&self, triangle: u32) -> bool {
        let indices = self.triangles[triangle as usize];
        if indices.iter().any(|&index| index as usize >= self.positions.len()) {
            return false;
        }
        let [a, b, c] = self.vertices(triangle);
        let normal = (b - a).cross(c - a);
        normal.is_finite() && normal != Vec3::ZERO
    }

    pub(super) fn vertices(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|index| self.positions[index as usize])
    }
}
