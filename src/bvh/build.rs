//! Collapses binary trees into eight-wide trees of least cost, on all threads of the current rayon pool.

use glam::Vec3;
use obvhs::bvh2::Bvh2;
use rayon::prelude::*;

use super::instance::{Instance, Placed, Shared};
use super::items::{Item, Items, Sources};
use super::weighing::Weighing;
use super::wide::{Block, INSTANCE, LEAF, MAX_DEPTH, Node, Reference, WIDTH};
use crate::huge_pages::joined_on_huge_pages;

/// Depth from which subtrees are halved by count instead of by cost. `u32` counts fall to one block
/// within `ceil(32 / 3)` further levels, so [`MAX_DEPTH`] holds for every input.
const BALANCED_FROM_DEPTH: usize = MAX_DEPTH - 12;

/// Levels of a wide tree below which one thread writes each subtree.
const TOP_LEVELS: usize = 4;

/// A finished tree.
#[derive(Debug, Clone)]
pub(super) struct Tree {
    pub(super) nodes: Vec<Node>,
    pub(super) blocks: Vec<Block>,
    /// Its instances.
    pub(super) placed: Vec<Placed>,
    pub(super) root: Reference,
    pub(super) bounds: (Vec3, Vec3),
    /// Largest absolute coordinate of the scene.
    pub(super) extent: f32,
}

/// Builds over all triangles that have an area, a tree for each mesh and one above them. There is a
/// root even of an empty scene.
pub(super) fn build(positions: &[Vec3], triangles: &[[u32; 3]], shared: Shared<'_>) -> Tree {
    let sources = Sources { positions, triangles };
    let mut parts = Parts::default();
    let meshes = shared.meshes.iter();
    let roots: Vec<Root> =
        meshes.map(|mesh| parts.collapse(&Items::new(sources, mesh.clone(), &[]))).collect();
    let place = |instance: &Instance| {
        let mesh = instance.mesh as usize;
        let root = &roots[mesh];
        Placed::new(instance, shared.meshes[mesh].start, root.reference, &root.node)
    };
    let placed: Vec<Placed> = shared.instances.par_iter().map(place).collect();
    let own = shared.own(triangles.len()) as u32;
    let Root { reference: root, bounds, .. } =
        parts.collapse(&Items::new(sources, 0..own, &placed));
    let extent = bounds.0.abs().max(bounds.1.abs()).max_element();
    let (nodes, blocks) =
        rayon::join(|| joined_on_huge_pages(parts.nodes), || joined_on_huge_pages(parts.blocks));
    Tree { nodes, blocks, placed, root, bounds, extent }
}

fn bounds(binary: &Bvh2, index: u32) -> (Vec3, Vec3) {
    let bounds = binary.nodes[index as usize].aabb();
    (bounds.min.into(), bounds.max.into())
}

/// The root of a wide tree.
struct Root {
    reference: Reference,
    node: Node,
    bounds: (Vec3, Vec3),
}

/// Wide trees, to be put one after the other.
#[derive(Default)]
struct Parts {
    nodes: Vec<Vec<Node>>,
    blocks: Vec<Vec<Block>>,
    /// How many nodes and blocks they have together.
    counts: [u32; 2],
}

impl Parts {
    /// Appends the tree over some items.
    fn collapse(&mut self, items: &Items<'_>) -> Root {
        let Some(binary) = items.binary() else {
            let node = Node::EMPTY;
            let reference = self.push(vec![node.clone()], Vec::new());
            return Root { reference, node, bounds: (Vec3::ZERO, Vec3::ZERO) };
        };
        let weighing = Weighing::new(items, &binary);
        let mut top = Collapse::new(&weighing, TOP_LEVELS);
        top.root();
        let write = |subtree: &Subtree| {
            let mut below = Collapse::new(&weighing, usize::MAX);
            below.node(subtree.index, TOP_LEVELS);
            (below.nodes, below.blocks)
        };
        let below: Vec<_> = top.subtrees.par_iter().map(write).collect();
        let first = self.nodes.len();
        let reference = self.push(top.nodes, top.blocks);
        for (subtree, (nodes, blocks)) in top.subtrees.iter().zip(below) {
            let root = self.push(nodes, blocks);
            self.nodes[first][subtree.parent as usize].children[subtree.lane] = root;
        }
        let node = self.nodes[first][0].clone();
        Root { reference, node, bounds: bounds(&binary, 0) }
    }

    /// Appends a tree whose references count from its own first node and block; the root's.
    fn push(&mut self, mut nodes: Vec<Node>, blocks: Vec<Block>) -> Reference {
        let [first_node, first_block] = self.counts;
        for child in nodes.iter_mut().flat_map(|node| &mut node.children) {
            *child += match *child {
                INSTANCE.. => 0,
                LEAF.. => first_block,
                _ => first_node,
            };
        }
        self.counts = [first_node + nodes.len() as u32, first_block + blocks.len() as u32];
        self.nodes.push(nodes);
        self.blocks.push(blocks);
        first_node
    }
}

/// A subtree that is written by itself.
struct Subtree {
    /// Of its root in the binary tree.
    index: u32,
    /// Whose child it is, and which.
    parent: Reference,
    lane: usize,
}

/// Writes a wide tree.
struct Collapse<'a> {
    weighing: &'a Weighing<'a>,
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    /// Depth at which subtrees are not written here but listed in `subtrees`.
    levels: usize,
    subtrees: Vec<Subtree>,
}

impl<'a> Collapse<'a> {
    fn new(weighing: &'a Weighing<'a>, levels: usize) -> Self {
        let (nodes, blocks, subtrees) = Default::default();
        Self { weighing, nodes, blocks, levels, subtrees }
    }

    fn root(&mut self) {
        let instance = self.weighing.instance_of(0);
        if instance.is_none() && !self.weighing.choices(0).is_block() {
            self.node(0, 0);
            return;
        }
        let reference = self.reserve();
        let child = instance.unwrap_or_else(|| self.block_of(0));
        self.nodes[reference as usize].set_child(0, bounds(self.weighing.binary, 0), child);
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
            let target = if let Some(instance) = self.weighing.instance_of(child) {
                instance
            } else if self.weighing.choices(child).is_block() {
                self.block_of(child)
            } else if depth + 1 == self.levels {
                self.subtrees.push(Subtree { index: child, parent: reference, lane });
                0
            } else {
                self.node(child, depth + 1)
            };
            node.set_child(lane, bounds(self.weighing.binary, child), target);
        }
        self.nodes[reference as usize] = node;
        reference
    }

    /// Puts what most likely blocks a ray last, where walks that ask for any hit begin: triangles
    /// rather than nodes, and large ones rather than small (after Nah and Manocha, *SATO: Surface Area
    /// Traversal Order for Shadow Ray Tracing*, CGF 33(6), 2014).
    fn sort_by_blocking(&self, children: &mut [u32]) {
        let half_area = |child: u32| self.weighing.binary.nodes[child as usize].aabb().half_area();
        let is_block = |child: u32| self.weighing.choices(child).is_block();
        children.sort_by(|&a, &b| {
            let triangles_last = is_block(a).cmp(&is_block(b));
            triangles_last.then(half_area(a).total_cmp(&half_area(b)))
        });
    }

    /// Collects the binary nodes that become the children of a wide node, by least cost.
    fn open(&self, index: u32, slots: usize, children: &mut Vec<u32>) {
        let left = self.weighing.binary.nodes[index as usize].first_index;
        let of_left = self.weighing.choices(index).of_left(slots);
        for (child, slots) in [(left, of_left), (left + 1, slots - of_left)] {
            match self.weighing.choices(child).used(slots) {
                1 => children.push(child),
                used => self.open(child, used, children),
            }
        }
    }

    fn block_of(&mut self, index: u32) -> Reference {
        let primitives = self.primitives(index);
        self.block(&primitives)
    }

    /// Emits a tree of least depth over `primitives`, in their order along the binary tree.
    fn balanced(&mut self, primitives: &[u32], depth: usize) -> ((Vec3, Vec3), Reference) {
        assert!(depth < MAX_DEPTH, "eight-way splits of a u32 count end within 12 levels");
        let boxes = primitives.iter().map(|&primitive| self.weighing.items.aabb(primitive));
        let all = boxes.reduce(|a, b| a.union(&b)).expect("some primitives");
        let bounds = (all.min.into(), all.max.into());
        if let [one] = primitives
            && let Item::Instance(number) = self.weighing.items.get(*one)
        {
            return (bounds, INSTANCE | number);
        }
        let is_triangle = |one: &u32| matches!(self.weighing.items.get(*one), Item::Triangle(_));
        if primitives.len() <= WIDTH && primitives.iter().all(is_triangle) {
            return (bounds, self.block(primitives));
        }
        let reference = self.reserve();
        let mut node = Node::EMPTY;
        for (lane, chunk) in primitives.chunks(primitives.len().div_ceil(WIDTH)).enumerate() {
            let (bounds, child) = self.balanced(chunk, depth + 1);
            node.set_child(lane, bounds, child);
        }
        self.nodes[reference as usize] = node;
        (bounds, reference)
    }

    fn reserve(&mut self) -> Reference {
        self.nodes.push(Node::EMPTY);
        Reference::try_from(self.nodes.len() - 1).expect("fewer nodes than triangles")
    }

    fn block(&mut self, primitives: &[u32]) -> Reference {
        let mut block = Block::EMPTY;
        for (lane, &primitive) in primitives.iter().enumerate() {
            let triangle = self.weighing.items.triangles[primitive as usize];
            block.set_triangle(lane, self.weighing.items.sources.vertices(triangle), triangle);
        }
        self.blocks.push(block);
        Reference::try_from(self.blocks.len() - 1).expect("fewer blocks than triangles") | LEAF
    }

    /// The primitives below a node of the binary tree, left to right.
    fn primitives(&self, index: u32) -> Vec<u32> {
        let mut primitives = Vec::new();
        let mut stack = vec![index];
        while let Some(index) = stack.pop() {
            let node = &self.weighing.binary.nodes[index as usize];
            let first = node.first_index as usize;
            if node.is_leaf() {
                let range = first..first + node.prim_count as usize;
                primitives.extend_from_slice(&self.weighing.binary.primitive_indices[range]);
            } else {
                stack.extend([node.first_index + 1, node.first_index]);
            }
        }
        primitives
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

    /// Boxes of triangles whose areas are more than f32 can hold are no reason to make one block of many.
    #[test]
    fn huge_slivers_are_spread_over_blocks() {
        let corner = |i: u16| 1e25 * Vec3::new(1.0, 1.0, 0.0) + 1e20 * f32::from(i) * Vec3::X;
        let positions: Vec<_> =
            (0..100).flat_map(|i| [-corner(i), corner(i), 1e12 * Vec3::Z - corner(i)]).collect();
        let triangles: Vec<_> = (0..100).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        check(&positions, &triangles);
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
