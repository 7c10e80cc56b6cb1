//! Memory layout of the eight-wide tree: nodes, leaf blocks and references to them.

use glam::Vec3;

/// Children of a node and triangles of a leaf block.
pub(super) const WIDTH: usize = 8;

/// A number for each lane.
pub(super) type PerLane = [f32; WIDTH];

/// Deepest chain of nodes from the root, checked while the tree is built.
pub(super) const MAX_DEPTH: usize = 36;

/// A node leaves at most `WIDTH - 1` children waiting while the walk descends into the other one.
pub(super) const STACK_CAPACITY: usize = MAX_DEPTH * (WIDTH - 1);

/// Reference to a node, or to a leaf block when [`LEAF`] is set, or to an instance with [`INSTANCE`].
pub(super) type Reference = u32;

/// Marks a [`Reference`] to a leaf block.
pub(super) const LEAF: Reference = 1 << 31;

/// Marks, both bits set, a [`Reference`] to an instance.
pub(super) const INSTANCE: Reference = LEAF | 1 << 30;

/// Boxes of up to eight children, one lane each, those last that likely block a ray. A lane without
/// child holds an empty box.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// Planes `2 * axis` hold the lower, `2 * axis + 1` the upper bounds.
    pub(super) planes: [PerLane; 6],
    /// What each box holds.
    pub(super) children: [Reference; WIDTH],
}

impl Node {
    /// A node without children, which no ray enters.
    pub(super) const EMPTY: Self = {
        let (lower, upper) = ([f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]);
        Self { planes: [lower, upper, lower, upper, lower, upper], children: [0; WIDTH] }
    };

    /// Boxes of its children.
    pub(super) fn boxes(&self) -> impl Iterator<Item = (Vec3, Vec3)> {
        let corner = |lane: usize, side: usize| {
            Vec3::from_array([0, 1, 2].map(|axis| self.planes[2 * axis + side][lane]))
        };
        let boxes = (0..WIDTH).map(move |lane| (corner(lane, 0), corner(lane, 1)));
        boxes.filter(|(lower, _)| lower.x.is_finite())
    }

    /// Puts a child into lane `lane`.
    pub(super) fn set_child(&mut self, lane: usize, bounds: (Vec3, Vec3), child: Reference) {
        for axis in 0..3 {
            self.planes[2 * axis][lane] = bounds.0[axis];
            self.planes[2 * axis + 1][lane] = bounds.1[axis];
        }
        self.children[lane] = child;
    }
}

/// Up to eight triangles, one lane each. A lane without triangle holds NaN, which no ray hits.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(super) struct Block {
    /// Coordinates by vertex, axis and lane.
    pub(super) vertices: [[PerLane; 3]; 3],
    /// Index of each triangle in the list the tree was built from.
    pub(super) triangles: [u32; WIDTH],
}

impl Block {
    /// A block without triangles.
    pub(super) const EMPTY: Self =
        Self { vertices: [[[f32::NAN; WIDTH]; 3]; 3], triangles: [u32::MAX; WIDTH] };

    /// Puts a triangle into lane `lane`.
    pub(super) fn set_triangle(&mut self, lane: usize, vertices: [Vec3; 3], triangle: u32) {
        for (block, vertex) in self.vertices.iter_mut().zip(vertices) {
            for axis in 0..3 {
                block[axis][lane] = vertex[axis];
            }
        }
        self.triangles[lane] = triangle;
    }
}
