//! The tree a GPU walks: obvhs' compressed wide BVH (Ylitie, Karras, Laine, *Efficient Incoherent Ray
//! Traversal on GPUs Through Compressed Wide BVHs*, HPG 2017).

use glam::Vec3;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;

use super::build;

/// Nodes and triangles as `shaders/bvh.wgsl` reads them.
#[derive(Debug, Clone)]
pub(crate) struct CompressedTree {
    /// 80 bytes a node; never empty.
    pub(crate) nodes: Vec<[u32; 20]>,
    /// Three vertices a triangle, each with a word more: that of the first is the triangle's index
    /// in the scene's list, that of the second its tag. Never empty.
    pub(crate) triangles: Vec<[[u32; 4]; 3]>,
    /// Most node groups a traversal leaves waiting.
    pub(crate) depth: u32,
}

impl CompressedTree {
    /// Builds over the triangles that [`super::Bvh::build`] keeps; `tag` is asked for each of them
    /// by its index.
    pub(crate) fn build(
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        tag: impl Fn(u32) -> u32,
    ) -> Self {
        let Some((kept, binary)) = build::binary(positions, triangles) else {
            return Self {
                nodes: vec![[0; 20]],
                triangles: vec![[[f32::NAN.to_bits(); 4]; 3]],
                depth: 1,
            };
        };
        let tree = bvh2_to_cwbvh(&binary, 3, true, false);
        let corner = |index: u32, word: u32| {
            let [x, y, z] = positions[index as usize].to_array().map(f32::to_bits);
            [x, y, z, word]
        };
        let packed = tree
            .primitive_indices
            .iter()
            .map(|&primitive| kept[primitive as usize])
            .map(|triangle| {
                let [a, b, c] = triangles[triangle as usize];
                [corner(a, triangle), corner(b, tag(triangle)), corner(c, 0)]
            })
            .collect();
        Self {
            depth: depth(&tree),
            nodes: tree.nodes.iter().map(|node| bytemuck::cast(*node)).collect(),
            triangles: packed,
        }
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
