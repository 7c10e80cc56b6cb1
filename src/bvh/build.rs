//! Builds a binary tree with obvhs and collapses it into the eight-wide tree of least cost.

use std::time::Duration;

use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, builder::build_bvh2};
use rayon::prelude::*;

use crate::sampler::{hash, unit_from_bits};

use super::wide::{Block, LEAF, MAX_DEPTH, Node, Reference, WIDTH};

/// Cost of testing one block of triangles, relative to one node.
const BLOCK_COST: f32 = 1.5;

/// Depth from which subtrees are halved by count instead of by cost. `u32` counts fall to one block
/// within `ceil(32 / 3)` further levels, so [`MAX_DEPTH`] holds for every input.
const BALANCED_FROM_DEPTH: usize = MAX_DEPTH - 12;

/// The finished parts of a tree.
pub(super) struct Tree {
    pub(super) nodes: Vec<Node>,
    pub(super) blocks: Vec<Block>,
    pub(super) bounds: (Vec3, Vec3),
}

/// Builds over all triangles that have an area; `nodes[0]` is the root, even of an empty scene.
pub(super) fn build(positions: &[Vec3], triangles: &[[u32; 3]]) -> Tree {
    let Some((kept, binary)) = binary(positions, triangles) else {
        return Tree {
            nodes: vec![Node::EMPTY],
            blocks: Vec::new(),
            bounds: (Vec3::ZERO, Vec3::ZERO),
        };
    };
    let costs = subtree_costs(&binary);
    let mut collapse = Collapse {
        sources: Sources { positions, triangles },
        kept: &kept,
        binary: &binary,
        costs: &costs,
        nodes: Vec::with_capacity(kept.len() / 24),
        blocks: Vec::with_capacity(kept.len() / 4),
    };
    collapse.root();
    let bounds = bounds(&binary, 0);
    Tree { nodes: collapse.nodes, blocks: collapse.blocks, bounds }
}

/// The triangles that have an area and the binary tree over them; `None` if there are none.
pub(super) fn binary(positions: &[Vec3], triangles: &[[u32; 3]]) -> Option<(Vec<u32>, Bvh2)> {
    let sources = Sources { positions, triangles };
    let kept: Vec<u32> = (0..u32::try_from(triangles.len()).unwrap_or(u32::MAX))
        .into_par_iter()
        .filter(|&triangle| sources.has_area(triangle))
        .collect();
    if kept.is_empty() {
        return None;
    }
    let boxes: Vec<Aabb> = kept
        .par_iter()
        .map(|&triangle| Aabb::from_points(&sources.vertices(triangle).map(Vec3A::from)))
        .collect();
    // One triangle a leaf: the collapse below forms the leaves. Without pre-splits (which
    // `build_bvh2` never does) each triangle is referenced once, as `any_hit` promises.
    let parameters = BvhBuildParams {
        max_prims_per_leaf: 1,
        post_collapse_reinsertion_batch_ratio_multiplier: 0.0,
        ..BvhBuildParams::medium_build()
    };
    let loosened: Vec<Aabb> =
        boxes.par_iter().zip(0..kept.len() as u32).map(|(tight, i)| loosened(tight, i)).collect();
    let mut binary = build_bvh2(&loosened, parameters, &mut Duration::default());
    let (nodes, primitives) = (&mut binary.nodes, &binary.primitive_indices);
    for node in nodes.iter_mut().filter(|node| node.is_leaf()) {
        node.set_aabb(boxes[primitives[node.first_index as usize] as usize]);
    }
    binary.refit_all();
    Some((kept, binary))
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
struct Sources<'a> {
    positions: &'a [Vec3],
    triangles: &'a [[u32; 3]],
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

    fn vertices(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|index| self.positions[index as usize])
    }
}

/// Least costs of one subtree (Ylitie, Karras, Laine, *Efficient Incoherent Ray Traversal on GPUs
/// Through Compressed Wide BVHs*, HPG 2017, section 3.1), each an area times a number of tests.
#[derive(Clone, Copy)]
struct SubtreeCosts {
    /// `forest[i]`: the subtree as at most `i + 1` children of a wide node.
    forest: [f32; WIDTH - 1],
    /// Triangles in the subtree.
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

/// Costs of all nodes of the binary tree, children before parents.
fn subtree_costs(binary: &Bvh2) -> Vec<SubtreeCosts> {
    let mut order = vec![0_u32];
    let mut next = 0;
    while let Some(&index) = order.get(next) {
        let node = &binary.nodes[index as usize];
        if !node.is_leaf() {
            order.extend([node.first_index, node.first_index + 1]);
        }
        next += 1;
    }
    let unset = SubtreeCosts { forest: [0.0; WIDTH - 1], count: 0 };
    let mut costs = vec![unset; binary.nodes.len()];
    for &index in order.iter().rev() {
        let node = &binary.nodes[index as usize];
        let area = node.aabb().half_area();
        costs[index as usize] = if node.is_leaf() {
            SubtreeCosts { forest: [area * BLOCK_COST; WIDTH - 1], count: node.prim_count }
        } else {
            let children = node.first_index as usize;
            inner_costs(area, &costs[children], &costs[children + 1])
        };
    }
    costs
}

fn inner_costs(area: f32, left: &SubtreeCosts, right: &SubtreeCosts) -> SubtreeCosts {
    let count = left.count + right.count;
    let as_node = area + SubtreeCosts::split(left, right, WIDTH).0;
    let as_block = if count as usize <= WIDTH { area * BLOCK_COST } else { f32::INFINITY };
    let mut forest = [as_node.min(as_block); WIDTH - 1];
    for slots in 2..WIDTH {
        forest[slots - 1] = SubtreeCosts::split(left, right, slots).0.min(forest[slots - 2]);
    }
    SubtreeCosts { forest, count }
}

fn bounds(binary: &Bvh2, index: u32) -> (Vec3, Vec3) {
    let bounds = binary.nodes[index as usize].aabb();
    (bounds.min.into(), bounds.max.into())
}

/// Writes the wide tree.
struct Collapse<'a> {
    sources: Sources<'a>,
    /// Triangle index of each primitive of the binary tree.
    kept: &'a [u32],
    binary: &'a Bvh2,
    costs: &'a [SubtreeCosts],
    nodes: Vec<Node>,
    blocks: Vec<Block>,
}

impl Collapse<'_> {
    fn root(&mut self) {
        let root = self.costs[0];
        if root.count as usize <= WIDTH {
            let mut node = Node::EMPTY;
            self.nodes.push(Node::EMPTY);
            let block = self.block_of(0);
            node.set_child(0, bounds(self.binary, 0), block);
            self.nodes[0] = node;
        } else {
            self.node(0, 0);
        }
    }

    /// Emits the node that stands for the binary inner node `index`.
    fn node(&mut self, index: u32, depth: usize) -> Reference {
        if depth >= BALANCED_FROM_DEPTH {
            let primitives = self.primitives(index);
            return self.balanced(&primitives, depth).1;
        }
        let reference = self.reserve();
        let mut children = Vec::with_capacity(WIDTH);
        self.open(index, WIDTH, &mut children);
        self.sort_by_blocking(&mut children);
        let mut node = Node::EMPTY;
        for (lane, &child) in children.iter().enumerate() {
            let target = if self.is_block(child) {
                self.block_of(child)
            } else {
                self.node(child, depth + 1)
            };
            node.set_child(lane, bounds(self.binary, child), target);
        }
        self.nodes[reference as usize] = node;
        reference
    }

    /// Puts what most likely blocks a ray last, where walks that ask for any hit begin: triangles
    /// rather than nodes, and large ones rather than small (after Nah and Manocha, *SATO: Surface Area
    /// Traversal Order for Shadow Ray Tracing*, CGF 33(6), 2014).
    fn sort_by_blocking(&self, children: &mut [u32]) {
        let half_area = |child: u32| self.binary.nodes[child as usize].aabb().half_area();
        children.sort_by(|&a, &b| {
            let triangles_last = self.is_block(a).cmp(&self.is_block(b));
            triangles_last.then(half_area(a).total_cmp(&half_area(b)))
        });
    }

    /// Collects the binary nodes that become the children of a wide node, by least cost.
    fn open(&self, index: u32, slots: usize, children: &mut Vec<u32>) {
        let left = self.binary.nodes[index as usize].first_index;
        let pair = [left, left + 1];
        let [a, b] = pair.map(|child| &self.costs[child as usize]);
        let taken = SubtreeCosts::split(a, b, slots).1;
        for (child, mut slots) in pair.into_iter().zip([taken, slots - taken]) {
            let costs = &self.costs[child as usize];
            // Slots that do not lower the cost stay unused.
            while slots > 1 && costs.forest[slots - 1] >= costs.forest[slots - 2] {
                slots -= 1;
            }
            if slots == 1 {
                children.push(child);
            } else {
                self.open(child, slots, children);
            }
        }
    }

    /// Whether a subtree that takes one slot is cheaper as a block than as a node.
    fn is_block(&self, index: u32) -> bool {
        let node = &self.binary.nodes[index as usize];
        let costs = &self.costs[index as usize];
        costs.count as usize <= WIDTH && costs.forest[0] >= node.aabb().half_area() * BLOCK_COST
    }

    fn block_of(&mut self, index: u32) -> Reference {
        let primitives = self.primitives(index);
        self.block(&primitives)
    }

    /// Emits a tree of least depth over `primitives`, in their order along the binary tree.
    fn balanced(&mut self, primitives: &[u32], depth: usize) -> ((Vec3, Vec3), Reference) {
        assert!(depth < MAX_DEPTH, "eight-way splits of a u32 count end within 12 levels");
        if primitives.len() <= WIDTH {
            return (self.primitive_bounds(primitives), self.block(primitives));
        }
        let reference = self.reserve();
        let mut node = Node::EMPTY;
        for (lane, chunk) in primitives.chunks(primitives.len().div_ceil(WIDTH)).enumerate() {
            let (bounds, child) = self.balanced(chunk, depth + 1);
            node.set_child(lane, bounds, child);
        }
        self.nodes[reference as usize] = node;
        (self.primitive_bounds(primitives), reference)
    }

    fn reserve(&mut self) -> Reference {
        self.nodes.push(Node::EMPTY);
        Reference::try_from(self.nodes.len() - 1).expect("fewer nodes than triangles")
    }

    fn block(&mut self, primitives: &[u32]) -> Reference {
        let mut block = Block::EMPTY;
        for (lane, &primitive) in primitives.iter().enumerate() {
            let triangle = self.kept[primitive as usize];
            block.set_triangle(lane, self.sources.vertices(triangle), triangle);
        }
        self.blocks.push(block);
        Reference::try_from(self.blocks.len() - 1).expect("fewer blocks than triangles") | LEAF
    }

    /// The primitives below a node of the binary tree, left to right.
    fn primitives(&self, index: u32) -> Vec<u32> {
        let mut primitives = Vec::new();
        let mut stack = vec![index];
        while let Some(index) = stack.pop() {
            let node = &self.binary.nodes[index as usize];
            let first = node.first_index as usize;
            if node.is_leaf() {
                let range = first..first + node.prim_count as usize;
                primitives.extend_from_slice(&self.binary.primitive_indices[range]);
            } else {
                stack.extend([node.first_index + 1, node.first_index]);
            }
        }
        primitives
    }

    fn primitive_bounds(&self, primitives: &[u32]) -> (Vec3, Vec3) {
        let vertices = primitives
            .iter()
            .flat_map(|&primitive| self.sources.vertices(self.kept[primitive as usize]));
        vertices.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(lower, upper), vertex| {
            (lower.min(vertex), upper.max(vertex))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Depth of the tree below `reference`; checks that boxes hold what they stand for and counts
    /// how often each triangle is referenced.
    fn depth(tree: &Tree, reference: Reference, uses: &mut [u32], points: &mut Vec<Vec3>) -> usize {
        if reference & LEAF != 0 {
            let block = &tree.blocks[(reference & !LEAF) as usize];
            for lane in (0..WIDTH).filter(|&lane| block.triangles[lane] != u32::MAX) {
                uses[block.triangles[lane] as usize] += 1;
                let vertex =
                    |v: &[[f32; WIDTH]; 3]| Vec3::from_array([0, 1, 2].map(|axis| v[axis][lane]));
                points.extend(block.vertices.iter().map(vertex));
            }
            return 0;
        }
        let node = &tree.nodes[reference as usize];
        let mut deepest = 0;
        for lane in 0..WIDTH {
            let corner = |side: usize| {
                Vec3::from_array([0, 1, 2_usize].map(|axis| node.planes[2 * axis + side][lane]))
            };
            let (lower, upper) = (corner(0), corner(1));
            if lower.x.is_finite() {
                let first = points.len();
                deepest = deepest.max(depth(tree, node.children[lane], uses, points));
                assert!(
                    points[first..].iter().all(|p| p.cmpge(lower).all() && p.cmple(upper).all())
                );
            }
        }
        deepest + 1
    }

    fn check(positions: &[Vec3], triangles: &[[u32; 3]]) -> usize {
        let tree = build(positions, triangles);
        let mut uses = vec![0; triangles.len()];
        let depth = depth(&tree, 0, &mut uses, &mut Vec::new());
        assert!(uses.iter().all(|&count| count == 1));
        assert!(depth <= MAX_DEPTH, "{depth}");
        depth
    }

    #[test]
    fn each_triangle_is_referenced_once_from_boxes_that_hold_it() {
        let scatter = |i: u16| (f32::from(i) * 12.9898).sin();
        let positions: Vec<_> = (0..3000_u16)
            .map(|i| Vec3::new(scatter(3 * i), scatter(3 * i + 1), scatter(3 * i + 2)))
            .collect();
        for count in [1, 8, 9, 1000] {
            let triangles: Vec<_> = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            check(&positions, &triangles);
        }
    }

    /// What everyday files have: a doubled import, instances at one place, sheets of paper.
    #[test]
    fn coincident_and_stacked_triangles_take_linear_time() {
        let count = 100_000;
        for step in [0.0, 1e-3] {
            let positions: Vec<_> = (0..count)
                .flat_map(|i| [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p + Vec3::Z * step * i as f32))
                .collect();
            let triangles: Vec<_> = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            let start = std::time::Instant::now();
            check(&positions, &triangles);
            let seconds = start.elapsed().as_secs_f64();
            println!("{count} triangles {step} apart: {seconds:.2} s");
            assert!(seconds < 10.0, "{step}: {seconds}");
        }
    }

    /// Triangles around the origin that grow by a constant factor nest like an onion: the cheapest
    /// tree is a chain, which must end in balanced subtrees before the stack does.
    #[test]
    fn onions_do_not_exceed_the_depth() {
        let sizes = (0..1000).map(|i| 1e-15 * 1.06_f32.powi(i));
        let positions: Vec<_> = sizes
            .flat_map(|size| {
                [Vec3::X, Vec3::NEG_X + Vec3::Y, Vec3::NEG_Y + Vec3::Z].map(|p| p * size)
            })
            .collect();
        let triangles: Vec<_> = (0..1000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let depth = check(&positions, &triangles);
        assert!(depth > BALANCED_FROM_DEPTH, "the case is not hard enough: {depth}");
    }
}
