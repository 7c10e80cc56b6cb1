//! Instances: places at which a mesh's triangles are met again, though they are held once.
//!
//! Boxes of a mesh are tested in its own space, by a ray brought there. Triangles are brought into the
//! world before they are tested, by the arithmetic that would have baked them: hits are the same bits
//! as those of copies, and what holds of triangles (watertight, no surface that a ray leaves is hit
//! again) holds of instances.

use std::ops::Range;

use glam::{Affine3A, DAffine3, DVec3, Mat3A, Vec3, Vec3A};

use super::Ray;
use super::lanes::Lanes;
use super::wide::{Block, Node, Reference};
use crate::math::box_corners;

/// Meshes that are shown several times but held once, and where they are shown.
#[derive(Debug, Clone, Copy, Default)]
pub struct Shared<'a> {
    /// Triangles of each mesh, in its own space: the last ones of the list the tree is built from.
    pub meshes: &'a [Range<u32>],
    /// Where meshes are shown.
    pub instances: &'a [Instance],
}

impl Shared<'_> {
    /// How many of `triangles` are not of meshes, but lie in the world.
    pub(super) fn own(&self, triangles: usize) -> usize {
        self.meshes.first().map_or(triangles, |mesh| mesh.start as usize)
    }
}

/// A mesh in a place.
#[derive(Debug, Clone, Copy)]
pub struct Instance {
    /// Which of the meshes.
    pub mesh: u32,
    /// World from the mesh's space; see [`Self::can_be_walked`].
    pub world_from_mesh: Affine3A,
    /// Number of its first triangle in hits; the others follow.
    pub first: u32,
}

/// Most that `|M| |M^-1|` may be (the norm of largest row sums). Rounding makes boxes larger by this
/// times `2^-19` of the way to them, less than a per cent.
const MAX_CONDITION: f64 = 4096.0;

/// Largest coordinates of a map's matrix, and the inverse of the least: their squares stay within f32.
const MAX_SCALE: f64 = 1e9;

impl Instance {
    /// Whether a ray can be brought into the space of a mesh that is placed by this map: it has an
    /// inverse, and does not stretch one direction thousands of times more than another.
    pub fn can_be_walked(world_from_mesh: DAffine3) -> bool {
        let inverse = world_from_mesh.inverse();
        let [size, inverse_size] =
            [world_from_mesh, inverse].map(|map| row_sums(map).max_element());
        world_from_mesh.is_finite()
            && inverse.is_finite()
            && size <= MAX_SCALE
            && inverse_size <= MAX_SCALE
            && size * inverse_size <= MAX_CONDITION
    }
}

/// Sums of the absolute values in each row of a map's matrix: how far each coordinate moves at most as
/// all of what is mapped move by one.
fn row_sums(map: DAffine3) -> DVec3 {
    map.matrix3.abs() * DVec3::ONE
}

/// An instance on a GPU: rows of both maps, and what walks want of it.
pub(crate) type InstanceWords = [[u32; 4]; 8];

/// An instance as walks want it.
#[derive(Debug, Clone)]
pub(super) struct Placed {
    /// Images of the axes and of the origin.
    pub(super) columns: [Vec3; 4],
    pub(super) mesh_from_world: Affine3A,
    /// How far each coordinate in the mesh's space moves at most as those in the world move by one.
    pub(super) stretch: Vec3,
    /// Largest coordinate on the way from the mesh's space to the world, and in the mesh's space.
    pub(super) reach: f32,
    pub(super) extent: f32,
    /// Whether it turns triangles around; then the second and the third corner change places.
    pub(super) mirrors: bool,
    pub(super) mesh: u32,
    /// What is added to the index of a mesh's triangle.
    shift: u32,
    /// Of the mesh's tree.
    pub(super) root: Reference,
    /// Box in the world; not finite if the mesh has no triangles.
    pub(super) bounds: (Vec3, Vec3),
}

impl Placed {
    /// `root` and `node` are those of the mesh's tree, `start` is the mesh's first triangle.
    pub(super) fn new(instance: &Instance, start: u32, root: Reference, node: &Node) -> Self {
        let map = instance.world_from_mesh;
        let exact = map.as_daffine3();
        let inverse = exact.inverse();
        let mut extent = DVec3::ZERO;
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        // The boxes of the root's children together are tighter than that around them.
        for (lower, upper) in node.boxes() {
            let (lower, upper) = (lower.as_dvec3(), upper.as_dvec3());
            extent = extent.max(lower.abs()).max(upper.abs());
            for corner in box_corners([lower, upper]) {
                let corner = exact.transform_point3(corner);
                (low, high) = (low.min(corner), high.max(corner));
            }
        }
        let reach = exact.matrix3.abs() * extent + exact.translation.abs();
        // Triangles are placed in f32: products and sums are off by less than 4 * 2^-24 of the reach.
        let rounding = reach * (8.0 * 0.5_f64.powi(24));
        Self {
            columns: [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis, map.translation]
                .map(Vec3::from),
            mesh_from_world: inverse.as_affine3a(),
            stretch: row_sums(inverse).as_vec3(),
            reach: reach.max_element() as f32,
            extent: extent.max_element() as f32,
            mirrors: exact.matrix3.determinant() < 0.0,
            mesh: instance.mesh,
            shift: instance.first.wrapping_sub(start),
            root,
            bounds: ((low - rounding).as_vec3(), (high + rounding).as_vec3()),
        }
    }

    /// A ray in the mesh's space, where distances stay the same, and how much larger boxes are to be
    /// made for it there. `extent` is the world's.
    ///
    /// With `u = 2^-24`, the triangle test in the world is off by 13 u (|origin| + extent), as
    /// [`super::traverse`] says, triangles' places by 4 u reach. Bringing the origin here is off by
    /// 5 u (|origin| + reach), the direction by 4 u of the way along it, which is below |origin| +
    /// extent, all times `stretch`: together less than 32 u (|origin| + extent + reach). What rounding
    /// there is of boxes in this space comes on top.
    #[inline(always)]
    pub(super) fn brought(&self, ray: &Ray, extent: f32) -> (Ray, Vec3) {
        let origin = self.mesh_from_world.transform_point3(ray.origin);
        let direction = self.mesh_from_world.transform_vector3(ray.direction);
        let way = ray.origin.abs().max_element() + extent + self.reach;
        let there = Ray { origin, direction, ..*ray };
        (there, self.stretch * (way * (32.0 * 0.5_f32.powi(24))))
    }

    /// A block of the mesh in the world, by the arithmetic of `Affine3A::transform_point3`.
    #[inline(always)]
    pub(super) fn block<L: Lanes>(&self, block: &Block) -> Block {
        let mut placed = Block::EMPTY;
        for (corner, vertices) in block.vertices.iter().enumerate() {
            let turned = if self.mirrors && corner > 0 { 3 - corner } else { corner };
            let (x, y, z) = (L::load(&vertices[0]), L::load(&vertices[1]), L::load(&vertices[2]));
            for axis in 0..3 {
                let [mx, my, mz, origin] = &self.columns;
                let sum = L::splat(mx[axis]).mul(x).add(L::splat(my[axis]).mul(y));
                let sum = sum.add(L::splat(mz[axis]).mul(z)).add(L::splat(origin[axis]));
                placed.vertices[turned][axis] = sum.store();
            }
        }
        placed.triangles = block.triangles.map(|triangle| triangle.wrapping_add(self.shift));
        placed
    }

    /// As `shaders/instances.wgsl` reads it; `root` is that of the mesh's tree there.
    pub(super) fn words(&self, root: u32) -> InstanceWords {
        let row = |map: &Affine3A, axis: usize| {
            let row = map.matrix3.row(axis).extend(map.translation[axis]);
            row.to_array().map(f32::to_bits)
        };
        let [x, y, z, origin] = self.columns.map(Vec3A::from);
        let there = Affine3A { matrix3: Mat3A::from_cols(x, y, z), translation: origin };
        let back = &self.mesh_from_world;
        [
            row(&there, 0),
            row(&there, 1),
            row(&there, 2),
            row(back, 0),
            row(back, 1),
            row(back, 2),
            self.stretch.extend(self.reach).to_array().map(f32::to_bits),
            [root, self.mirrors.into(), self.shift, self.extent.to_bits()],
        ]
    }
}
