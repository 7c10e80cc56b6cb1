//! Weighs how a binary tree is best collapsed into an eight-wide one.

use std::sync::atomic::{AtomicU64, Ordering};

use obvhs::bvh2::Bvh2;
use rayon::prelude::*;

use super::items::{Item, Items};
use super::wide::{INSTANCE, Reference, WIDTH};

/// Cost of testing one block of triangles, relative to one node.
const BLOCK_COST: f32 = 1.5;

/// Cost of entering an instance, relative to one node: a ray is brought there, and meets a few nodes.
const INSTANCE_COST: f32 = 4.0;

/// Levels of a binary tree below which one thread weighs each subtree.
const SHARED_LEVELS: usize = 16;

/// Least costs of one subtree (Ylitie, Karras, Laine, *Efficient Incoherent Ray Traversal on GPUs
/// Through Compressed Wide BVHs*, HPG 2017, section 3.1), each an area times a number of tests.
#[derive(Clone, Copy, Default)]
struct SubtreeCosts {
    /// `forest[i]`: the subtree as at most `i + 1` children of a wide node.
    forest: [f32; WIDTH - 1],
    /// Triangles in the subtree; more than a block has where there are instances.
    count: u32,
}

impl SubtreeCosts {
    /// Cost of two siblings sharing `slots` children, and how many the left one gets.
    fn split(left: &Self, right: &Self, slots: usize) -> (f32, usize) {
        (1..slots)
            .map(|taken| (left.forest[taken - 1] + right.forest[slots - taken - 1], taken))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .expect("a node of two children has at least two slots")
    }
}

/// Choices at one node of the binary tree. Bit 0: the subtree is a block. Bits 8 to 35: for each of 2 to 8 slots how
/// many the left child gets, four bits each. Bits 36 to 63: for each of 1 to 7 slots how many are used.
#[derive(Clone, Copy)]
pub(super) struct Choices(u64);

impl Choices {
    /// Everything is one child.
    const OF_LEAF: Self = Self(0x1111_1110_0000_0001);
    /// The same, and it is no block.
    const OF_INSTANCE: Self = Self(Self::OF_LEAF.0 & !1);

    /// Whether the subtree is cheaper as a block than as a node where it is one child.
    pub(super) fn is_block(self) -> bool {
        self.0 & 1 == 1
    }

    /// How many of 2 to 8 slots the left child gets.
    pub(super) fn of_left(self, slots: usize) -> usize {
        (self.0 >> (4 * slots)) as usize & 0xf
    }

    /// How many of 1 to 7 slots are worth using.
    pub(super) fn used(self, slots: usize) -> usize {
        (self.0 >> (32 + 4 * slots)) as usize & 0xf
    }
}

/// Chooses how a binary tree is collapsed.
pub(super) struct Weighing<'a> {
    pub(super) items: &'a Items<'a>,
    pub(super) binary: &'a Bvh2,
    /// [`Choices`] by node.
    choices: Vec<AtomicU64>,
}

impl<'a> Weighing<'a> {
    pub(super) fn new(items: &'a Items<'a>, binary: &'a Bvh2) -> Self {
        let leaf = |_| AtomicU64::new(Choices::OF_LEAF.0);
        let choices = (0..binary.nodes.len()).into_par_iter().map(leaf).collect();
        let weighing = Self { items, binary, choices };
        weighing.costs(0, 0);
        weighing
    }

    pub(super) fn choices(&self, index: u32) -> Choices {
        Choices(self.choices[index as usize].load(Ordering::Relaxed))
    }

    /// Reference to the instance that a node is, if it is one.
    pub(super) fn instance_of(&self, node: u32) -> Option<Reference> {
        let node = &self.binary.nodes[node as usize];
        if !node.is_leaf() {
            return None;
        }
        match self.items.get(self.binary.primitive_indices[node.first_index as usize]) {
            Item::Instance(number) => Some(INSTANCE | number),
            Item::Triangle(_) => None,
        }
    }

    /// Costs of the subtree of a node at a level.
    fn costs(&self, index: u32, level: usize) -> SubtreeCosts {
        let Some([left, right]) = self.children(index) else { return self.of_leaf(index) };
        if level < SHARED_LEVELS {
            let (left, right) =
                rayon::join(|| self.costs(left, level + 1), || self.costs(right, level + 1));
            return self.choose(index, &left, &right);
        }
        // A chain may be longer than the stack: breadth first, then back, with the place of the first child.
        let mut order = vec![(index, 0)];
        let mut next = 0;
        while let Some(&(index, _)) = order.get(next) {
            if let Some(children) = self.children(index) {
                order[next].1 = order.len();
                order.extend(children.map(|child| (child, 0)));
            }
            next += 1;
        }
        let mut costs = vec![SubtreeCosts::default(); order.len()];
        for (place, &(index, first)) in order.iter().enumerate().rev() {
            costs[place] = match first {
                0 => self.of_leaf(index),
                first => self.choose(index, &costs[first], &costs[first + 1]),
            };
        }
        costs[0]
    }

    fn children(&self, index: u32) -> Option<[u32; 2]> {
        let node = &self.binary.nodes[index as usize];
        (!node.is_leaf()).then_some([node.first_index, node.first_index + 1])
    }

    fn of_leaf(&self, index: u32) -> SubtreeCosts {
        let node = &self.binary.nodes[index as usize];
        let area = node.aabb().half_area();
        if self.instance_of(index).is_some() {
            self.choices[index as usize].store(Choices::OF_INSTANCE.0, Ordering::Relaxed);
            // Too many for a block.
            SubtreeCosts { forest: [area * INSTANCE_COST; WIDTH - 1], count: WIDTH as u32 + 1 }
        } else {
            SubtreeCosts { forest: [area * BLOCK_COST; WIDTH - 1], count: node.prim_count }
        }
    }

    /// Costs of an inner node; keeps its choices.
    fn choose(&self, index: u32, left: &SubtreeCosts, right: &SubtreeCosts) -> SubtreeCosts {
        let area = self.binary.nodes[index as usize].aabb().half_area();
        let count = left.count + right.count;
        let (cost, of_left) = SubtreeCosts::split(left, right, WIDTH);
        let as_node = area + cost;
        let as_block = if count as usize <= WIDTH { area * BLOCK_COST } else { f32::INFINITY };
        let mut forest = [as_node.min(as_block); WIDTH - 1];
        let mut used = 1;
        // Costs may be infinite where coordinates are huge.
        let is_block = count as usize <= WIDTH && as_block <= as_node;
        let mut choices = u64::from(is_block) | (of_left as u64) << (4 * WIDTH) | 1 << 36;
        for slots in 2..WIDTH {
            let (cost, of_left) = SubtreeCosts::split(left, right, slots);
            // Slots that do not lower the cost stay unused.
            if cost < forest[slots - 2] {
                used = slots;
            }
            forest[slots - 1] = cost.min(forest[slots - 2]);
            choices |= (of_left as u64) << (4 * slots) | (used as u64) << (32 + 4 * slots);
        }
        self.choices[index as usize].store(choices, Ordering::Relaxed);
        SubtreeCosts { forest, count }
    }
}
