//! The tree a GPU walks: obvhs' compressed wide BVH (Ylitie, Karras, Laine, *Efficient Incoherent Ray
//! Traversal on GPUs Through Compressed Wide BVHs*, HPG 2017).

use std::ops::Range;

use glam::Vec3;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;

use super::Bvh;
use super::instance::{InstanceWords, Shared};
use super::items::{Item, Items, Sources};

/// Nodes and triangles as `shaders/bvh.wgsl` reads them.
#[derive(Debug, Clone, Default)]
pub(crate) struct CompressedTree {
    /// 80 bytes a node; never empty.
    pub(crate) nodes: Vec<[u32; 20]>,
    /// Three vertices a triangle, each with a word more: that of the first is the triangle's index
    /// in the scene's list, that of the second its tag. For an instance its number and
    /// [`INSTANCE_TAG`]. Never empty.
    pub(crate) triangles: Vec<[[u32; 4]; 3]>,
    /// Instances, with the roots of their meshes' trees.
    pub(crate) instances: Vec<InstanceWords>,
    /// One more than groups of nodes, or of instances, that a traversal leaves waiting.
    pub(crate) depth: u32,
}

/// Tag of an instance; triangles' tags do not have this bit.
pub(crate) const INSTANCE_TAG: u32 = 1 << 30;

impl CompressedTree {
    /// Builds over what `bvh` was built over; `tag` is asked for each triangle by its index.
    pub(crate) fn build(
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        meshes: &[Range<u32>],
        bvh: &Bvh,
        tag: impl Fn(u32) -> u32,
    ) -> Self {
        let sources = Sources { positions, triangles };
        let mut tree = Self::default();
        let own = Shared { meshes, instances: &[] }.own(triangles.len()) as u32;
        let top = tree.append(&Items::new(sources, 0..own, &bvh.tree.placed), &tag).1;
        let append = |mesh: &Range<u32>| tree.append(&Items::new(sources, mesh.clone(), &[]), &tag);
        let (roots, depths): (Vec<u32>, Vec<u32>) = meshes.iter().map(append).unzip();
        // In the upper level, each may leave a group of instances waiting, too.
        let below = depths.into_iter().max();
        tree.depth = below.map_or(top, |below| 2 * top + below);
        tree.instances = bvh.instance_words(|mesh| roots[mesh as usize]);
        tree
    }

    /// Appends a tree over some items: where its root is, and how many levels of nodes it has.
    fn append(&mut self, items: &Items<'_>, tag: impl Fn(u32) -> u32) -> (u32, u32) {
        let (root, first) = (self.nodes.len() as u32, self.triangles.len() as u32);
        let Some(binary) = items.binary() else {
            self.nodes.push([0; 20]);
            self.triangles.push([[f32::NAN.to_bits(); 4]; 3]);
            return (root, 1);
        };
        let tree = bvh2_to_cwbvh(&binary, 3, true, false);
        self.nodes.extend(tree.nodes.iter().map(|node| {
            let mut words: [u32; 20] = bytemuck::cast(*node);
            words[4] += root;
            words[5] += first;
            words
        }));
        let Sources { positions, triangles } = items.sources;
        let corner = |index: u32, word: u32| {
            let [x, y, z] = positions[index as usize].to_array().map(f32::to_bits);
            [x, y, z, word]
        };
        self.triangles.extend(tree.primitive_indices.iter().map(|&primitive| {
            match items.get(primitive) {
                Item::Triangle(triangle) => {
                    let [a, b, c] = triangles[triangle as usize];
                    [corner(a, triangle), corner(b, tag(triangle)), corner(c, 0)]
                }
                Item::Instance(number) => [[0, 0, 0, number], [0, 0, 0, INSTANCE_TAG], [0; 4]],
            }
        }));
        (root, depth(&tree))
    }
}

/// Levels of nodes.
fn depth(tree: &CwBvh) -> u32 {
    let mut deepest = 0;
    let mut stack = vec![(0_usize, 1)];
    while let Some((index, level)) = stack.pop() {
        deepest = deepest.max(level);
        let node = &tree.nodes[index];
        let children = node.imask.count_ones() as usize;
        stack.extend((0..children).map(|i| (node.child_base_idx as usize + i, level + 1)));
    }
    deepest
}
