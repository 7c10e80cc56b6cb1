//! The walk through the tree, written once over eight lanes of f32.

use std::mem::MaybeUninit;

use glam::Vec3;

use super::build::Tree;
use super::instance::Placed;
use super::lanes::{Bits, Lanes};
use super::triangle::{self, BlockHits, Shear};
use super::wide::{Block, INSTANCE, LEAF, Node, PerLane, Reference, STACK_CAPACITY, WIDTH};
use super::{Hit, Ray};

/// A ray as the box test wants it.
///
/// Distance to a plane at `b` along an axis is `b * inverse + offset`. All rounding, here and in
/// the sheared vertices of the triangle test, amounts to less than `13 u (|origin| + extent)` in
/// space with `u = 2^-24`; boxes are made larger by 16 u, so that they never lose a triangle
/// (after Ize, *Robust BVH Ray Traversal*, JCGT 2(2), 2013, which pads each distance instead).
#[derive(Default)]
struct BoxRay {
    inverse: [f32; 3],
    near_offset: [f32; 3],
    far_offset: [f32; 3],
    /// Which of `Node::planes` is met first along each axis; the other one differs in the last bit.
    near_plane: [usize; 3],
}

impl BoxRay {
    /// `extent` is the largest coordinate of the boxes, `slack` what they are to be larger by on top.
    #[inline(always)]
    fn new(ray: &Ray, extent: f32, slack: Vec3) -> Self {
        let longest = ray.direction.abs().max_element();
        // A direction of 2^-60 is as good as zero and keeps `0 * inf` out.
        let least = longest * (0.5_f32).powi(60);
        let reach = ray.origin.abs().max_element() + extent;
        let pad = reach * (16.0 * 0.5_f32.powi(24)) + f32::MIN_POSITIVE;
        let mut result = Self::default();
        for axis in 0..3 {
            let direction = ray.direction[axis];
            let inverse = 1.0 / direction.abs().max(least).copysign(direction);
            let toward = (pad + slack[axis]).copysign(direction);
            result.inverse[axis] = inverse;
            result.near_offset[axis] = -(ray.origin[axis] + toward) * inverse;
            result.far_offset[axis] = -(ray.origin[axis] - toward) * inverse;
            result.near_plane[axis] = 2 * axis + usize::from(direction.is_sign_negative());
        }
        result
    }

    /// Mask of the boxes that the ray crosses in `[t_min, t_max]` and where it enters each.
    #[inline(always)]
    fn enter<L: Lanes>(&self, node: &Node, t_min: f32, t_max: f32) -> (u32, PerLane) {
        let mut near = L::splat(t_min);
        let mut far = L::splat(t_max);
        for axis in 0..3 {
            let inverse = L::splat(self.inverse[axis]);
            let plane = self.near_plane[axis];
            debug_assert!(plane < 6, "planes are 2 * axis or 2 * axis + 1");
            // SAFETY: `near_plane` holds `2 * axis` or `2 * axis + 1` with `axis < 3`.
            let (first, second) =
                unsafe { (node.planes.get_unchecked(plane), node.planes.get_unchecked(plane ^ 1)) };
            near = near.max(L::load(first).mul_add(inverse, L::splat(self.near_offset[axis])));
            far = far.min(L::load(second).mul_add(inverse, L::splat(self.far_offset[axis])));
        }
        (near.le(far), near.store())
    }
}

/// Nodes still to be visited, each with its distance: distance bits above, reference below. The
/// bits of floats that are not negative sort as the floats do.
struct Stack<const LEVELS: usize> {
    entries: [[MaybeUninit<u64>; STACK_CAPACITY]; LEVELS],
    length: usize,
}

impl<const LEVELS: usize> Stack<LEVELS> {
    #[inline(always)]
    fn new() -> Self {
        let entries = [const { [const { MaybeUninit::uninit() }; STACK_CAPACITY] }; LEVELS];
        Self { entries, length: 0 }
    }

    #[inline(always)]
    fn entry(&mut self, at: usize) -> &mut MaybeUninit<u64> {
        &mut self.entries.as_flattened_mut()[at]
    }

    #[inline(always)]
    fn push(&mut self, entry: u64) {
        self.entry(self.length).write(entry);
        self.length += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<u64> {
        self.length = self.length.checked_sub(1)?;
        // SAFETY: all entries below the previous length were written by `push`.
        Some(unsafe { self.entry(self.length).assume_init() })
    }

    /// Pushes the children of `node` in the lanes of `mask`, which is not zero, far ones first, save
    /// for the nearest, which is returned.
    #[inline(always)]
    fn descend(&mut self, node: &Node, mask: u32, near: &PerLane) -> Reference {
        let base = self.length;
        let mut entries = Bits(mask).map(|lane| entry(near[lane], node.children[lane]));
        let mut nearest = entries.next().expect("the mask is not zero");
        if let Some(second) = entries.next() {
            self.push(nearest.max(second));
            nearest = nearest.min(second);
        }
        for child in entries {
            self.insert(base, nearest.max(child));
            nearest = nearest.min(child);
        }
        nearest as Reference
    }

    /// Pushes the children of `node` in the lanes of `mask`, which is not zero, as they are, save for
    /// the last, which is returned.
    #[inline(always)]
    fn descend_in_order(&mut self, node: &Node, mask: u32) -> Reference {
        let last = mask.ilog2();
        for lane in Bits(mask & !(1 << last)) {
            self.push(entry(0.0, node.children[lane]));
        }
        node.children[last as usize % WIDTH]
    }

    /// Inserts so that entries from `base` on fall towards the top.
    #[inline(always)]
    fn insert(&mut self, base: usize, entry: u64) {
        self.push(entry);
        let mut at = self.length - 1;
        while at > base {
            // SAFETY: `at` and `at - 1` lie below the length, so both were written.
            let before = unsafe { self.entry(at - 1).assume_init() };
            if before >= entry {
                break;
            }
            self.entry(at).write(before);
            at -= 1;
        }
        self.entry(at).write(entry);
    }
}

#[inline(always)]
fn entry(near: f32, child: Reference) -> u64 {
    u64::from(near.to_bits()) << 32 | u64::from(child)
}

#[inline(always)]
fn distance(entry: u64) -> f32 {
    f32::from_bits((entry >> 32) as u32)
}

/// Intersects all blocks whose boxes the ray crosses before `t_max`: near ones first, or those first
/// that block most rays.
///
/// `visit` gets the hits of a block and returns how far to go on, or `None` to end the walk. No
/// lanes may be handled in closures: those are not always inlined, and are not compiled for the
/// vector instructions of the function around.
///
/// A tree of one of `LEVELS` has no instances.
#[inline(always)]
fn walk<L: Lanes, const LEVELS: usize, const NEAREST_FIRST: bool>(
    tree: &Tree,
    ray: &Ray,
    mut visit: impl FnMut(&Block, &BlockHits) -> Option<f32>,
) {
    let usable = ray.direction.is_finite() && ray.direction != Vec3::ZERO;
    if !usable || !ray.origin.is_finite() {
        return;
    }
    let (nodes, blocks, placed) = (&tree.nodes[..], &tree.blocks[..], &tree.placed[..]);
    let world = BoxRay::new(ray, tree.extent, Vec3::ZERO);
    let shear = Shear::new(ray);
    let t_min = ray.t_min.max(0.0);
    let mut t_max = ray.t_max;
    let mut stack = Stack::<LEVELS>::new();
    let mut current = tree.root;
    // The instance that is walked, the ray in its space, and what waits below.
    let mut inside: Option<(&Placed, BoxRay, usize)> = None;
    loop {
        if LEVELS > 1 && current & INSTANCE == INSTANCE {
            let placed = &placed[(current & !INSTANCE) as usize];
            let (there, slack) = placed.brought(ray, tree.extent);
            inside = Some((placed, BoxRay::new(&there, placed.extent, slack), stack.length));
            current = placed.root;
        }
        if current & LEAF != 0 {
            let mut block = &blocks[(current & !LEAF) as usize];
            let in_world;
            if LEVELS > 1
                && let Some((placed, ..)) = &inside
            {
                in_world = placed.block::<L>(block);
                block = &in_world;
            }
            let hits = triangle::intersect::<L>(block, &shear, t_min, t_max);
            if hits.mask != 0 {
                let Some(limit) = visit(block, &hits) else { return };
                t_max = limit;
            }
        } else {
            let node = &nodes[current as usize];
            let mut boxes = &world;
            if LEVELS > 1
                && let Some((_, there, _)) = &inside
            {
                boxes = there;
            }
            let (mask, near) = boxes.enter::<L>(node, t_min, t_max);
            if mask != 0 {
                current = if NEAREST_FIRST {
                    stack.descend(node, mask, &near)
                } else {
                    stack.descend_in_order(node, mask)
                };
                continue;
            }
        }
        loop {
            if LEVELS > 1 && inside.as_ref().is_some_and(|(.., below)| stack.length == *below) {
                inside = None;
            }
            let Some(entry) = stack.pop() else { return };
            if distance(entry) <= t_max {
                current = entry as Reference;
                break;
            }
        }
    }
}

/// See [`super::Bvh::closest_hit`].
#[inline(always)]
pub(super) fn closest_hit<L: Lanes, const LEVELS: usize>(
    tree: &Tree,
    ray: &Ray,
    accept: impl Fn(&Hit) -> bool,
) -> Option<Hit> {
    let mut closest = Hit { t: ray.t_max, triangle: u32::MAX, ..Hit::default() };
    walk::<L, LEVELS, true>(tree, ray, |block, hits| {
        for lane in Bits(hits.mask) {
            let hit = hits.hit(block, lane);
            // The lower index wins ties, so that hits do not depend on the shape of the tree.
            let closer =
                hit.t < closest.t || (hit.t == closest.t && hit.triangle < closest.triangle);
            if closer && accept(&hit) {
                closest = hit;
            }
        }
        Some(closest.t)
    });
    (closest.triangle != u32::MAX).then_some(closest)
}

/// See [`super::Bvh::any_hit`].
#[inline(always)]
pub(super) fn any_hit<L: Lanes, const LEVELS: usize>(
    tree: &Tree,
    ray: &Ray,
    mut blocks: impl FnMut(&Hit) -> bool,
) -> bool {
    let mut blocked = false;
    walk::<L, LEVELS, false>(tree, ray, |block, hits| {
        for lane in Bits(hits.mask) {
            let hit = hits.hit(block, lane);
            if blocks(&hit) {
                blocked = true;
                return None;
            }
        }
        Some(ray.t_max)
    });
    blocked
}
