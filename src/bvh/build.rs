//! Collapses binary trees into eight-wide trees of least cost.

use glam::Vec3;
use obvhs::bvh2::Bvh2;
use rayon::prelude::*;

use super::instance::{Instance, Placed, Shared};
use super::items::{Item, Items, Sources};
use super::wide::{Block, INSTANCE, LEAF, MAX_DEPTH, Node, Reference, WIDTH};

/// Cost of testing one block of triangles, relative to one node.
const BLOCK_COST: f32 = 1.5;

/// Cost of entering an instance, relative to one node: a ray is brought there, and meets a few nodes.
const INSTANCE_COST: f32 = 4.0;

/// Depth from which subtrees are halved by count instead of by cost. `u32` counts fall to one block
/// within `ceil(32 / 3)` further levels, so [`MAX_DEPTH`] holds for every input.
const BALANCED_FROM_DEPTH: usize = MAX_DEPTH - 12;

/// The finished parts of a tree.
pub(super) struct Tree {
    pub(super) nodes: Vec<Node>,
    pub(super) blocks: Vec<Block>,
    pub(super) placed: Vec<Placed>,
    pub(super) root: Reference,
    pub(super) bounds: (Vec3, Vec3),
}

/// Builds over all triangles that have an area, a tree for each mesh and one above them. There is a
/// root even of an empty scene.
pub(super) fn build(positions: &[Vec3], triangles: &[[u32; 3]], shared: Shared<'_>) -> Tree {
    let sources = Sources { positions, triangles };
    let mut written = Written::default();
    let meshes = shared.meshes.iter();
    let roots: Vec<Reference> =
        meshes.map(|mesh| written.collapse(&Items::new(sources, mesh.clone(), &[])).0).collect();
    let place = |instance: &Instance| {
        let mesh = instance.mesh as usize;
        let root = roots[mesh];
        Placed::new(instance, &shared.meshes[mesh], root, &written.nodes[root as usize])
    };
    let placed: Vec<Placed> = shared.instances.par_iter().map(place).collect();
    let own = shared.own(triangles.len()) as u32;
    let (root, bounds) = written.collapse(&Items::new(sources, 0..own, &placed));
    Tree { nodes: written.nodes, blocks: written.blocks, placed, root, bounds }
}

/// Least costs of one subtree (Ylitie, Karras, Laine, *Efficient Incoherent Ray Traversal on GPUs
/// Through Compressed Wide BVHs*, HPG 2017, section 3.1), each an area times a number of tests.
#[derive(Clone, Copy)]
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

/// Costs of all nodes of the binary tree, children before parents.
fn subtree_costs(items: &Items<'_>, binary: &Bvh2) -> Vec<SubtreeCosts> {
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
        costs[index as usize] = if items.instance_of(binary, index).is_some() {
            // Too many for a block.
            SubtreeCosts { forest: [area * INSTANCE_COST; WIDTH - 1], count: WIDTH as u32 + 1 }
        } else if node.is_leaf() {
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

/// Wide trees, one after the other.
#[derive(Default)]
struct Written {
    nodes: Vec<Node>,
    blocks: Vec<Block>,
}

impl Written {
    /// Appends the tree over some items; its root and the box around it.
    fn collapse(&mut self, items: &Items<'_>) -> (Reference, (Vec3, Vec3)) {
        let Some(binary) = items.binary() else {
            self.nodes.push(Node::EMPTY);
            return (self.nodes.len() as Reference - 1, (Vec3::ZERO, Vec3::ZERO));
        };
        let costs = subtree_costs(items, &binary);
        self.nodes.reserve(items.triangles.len() / 24);
        self.blocks.reserve(items.triangles.len() / 4);
        let mut collapse = Collapse { items, binary: &binary, costs: &costs, written: self };
        (collapse.root(), bounds(&binary, 0))
    }
}

/// Writes a wide tree.
struct Collapse<'a> {
    items: &'a Items<'a>,
    binary: &'a Bvh2,
    costs: &'a [SubtreeCosts],
    written: &'a mut Written,
}

impl Collapse<'_> {
    fn root(&mut self) -> Reference {
        let instance = self.items.instance_of(self.binary, 0);
        if instance.is_none() && self.costs[0].count as usize > WIDTH {
            return self.node(0, 0);
        }
        let reference = self.reserve();
        let child = instance.unwrap_or_else(|| self.block_of(0));
        self.written.nodes[reference as usize].set_child(0, bounds(self.binary, 0), child);
        reference
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
            let target = if let Some(instance) = self.items.instance_of(self.binary, child) {
                instance
            } else if self.is_block(child) {
                self.block_of(child)
            } else {
                self.node(child, depth + 1)
            };
            node.set_child(lane, bounds(self.binary, child), target);
        }
        self.written.nodes[reference as usize] = node;
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
        let bounds = self.primitive_bounds(primitives);
        if let [one] = primitives
            && let Item::Instance(number) = self.items.get(*one)
        {
            return (bounds, INSTANCE | number);
        }
        let is_triangle = |one: &u32| matches!(self.items.get(*one), Item::Triangle(_));
        if primitives.len() <= WIDTH && primitives.iter().all(is_triangle) {
            return (bounds, self.block(primitives));
        }
        let reference = self.reserve();
        let mut node = Node::EMPTY;
        for (lane, chunk) in primitives.chunks(primitives.len().div_ceil(WIDTH)).enumerate() {
            let (bounds, child) = self.balanced(chunk, depth + 1);
            node.set_child(lane, bounds, child);
        }
        self.written.nodes[reference as usize] = node;
        (bounds, reference)
    }

    fn reserve(&mut self) -> Reference {
        let nodes = &mut self.written.nodes;
        nodes.push(Node::EMPTY);
        Reference::try_from(nodes.len() - 1).expect("fewer nodes than triangles")
    }

    fn block(&mut self, primitives: &[u32]) -> Reference {
        let mut block = Block::EMPTY;
        for (lane, &primitive) in primitives.iter().enumerate() {
            let triangle = self.items.triangles[primitive as usize];
            block.set_triangle(lane, self.items.sources.vertices(triangle), triangle);
        }
        let blocks = &mut self.written.blocks;
        blocks.push(block);
        Reference::try_from(blocks.len() - 1).expect("fewer blocks than triangles") | LEAF
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
        let boxes = primitives.iter().map(|&primitive| self.items.aabb(primitive));
        let all = boxes.reduce(|a, b| a.union(&b)).expect("some primitives");
        (all.min.into(), all.max.into())
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
        let tree = build(positions, triangles, Shared::default());
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
        let count = 300_000;
        for step in [0.0, 1e-3] {
            let positions: Vec<_> = (0..count)
                .flat_map(|i| [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p + Vec3::Z * step * i as f32))
                .collect();
            let triangles: Vec<_> = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            let start = std::time::Instant::now();
            check(&positions, &triangles);
            let seconds = start.elapsed().as_secs_f64();
            println!("{count} triangles {step} apart: {seconds:.2} s");
            assert!(seconds < 40.0, "{step}: {seconds}");
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
