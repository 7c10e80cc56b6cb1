//! What a ray hits: an eight-wide bounding volume hierarchy over triangles and instances.
//!
//! Watertight: a ray that starts inside a closed mesh of shared vertices hits it. Hits are the same
//! bits on all machines: neither the vector instructions in use nor the shape of the tree matters.

mod build;
pub(crate) mod compressed;
mod instance;
mod items;
mod lanes;
mod traverse;
mod triangle;
mod wide;

#[cfg(target_arch = "x86_64")]
mod avx2;

use std::mem::size_of_val;

use crate::huge_pages::on_huge_pages;
use glam::{IVec3, Vec2, Vec3};

pub(crate) use instance::InstanceWords;
use instance::Placed;
pub use instance::{Instance, Shared};
use lanes::Portable;
use traverse::TreeRef;
use wide::{Block, Node, Reference};

/// Points `origin + t * direction` with `t_min <= t <= t_max`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Start; a ray whose origin is not finite hits nothing.
    pub origin: Vec3,
    /// Direction, not necessarily of unit length; a zero or infinite one hits nothing.
    pub direction: Vec3,
    /// Least distance in lengths of `direction`, 0 or more.
    pub t_min: f32,
    /// Greatest distance in lengths of `direction`; may be infinite.
    pub t_max: f32,
}

/// Where a ray meets a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Hit {
    /// Distance in lengths of the ray's direction.
    pub t: f32,
    /// Index in the triangle list the tree was built from; of an instance's triangles their number.
    pub triangle: u32,
    /// Weights of vertices 1 and 2; vertex 0 has the rest. Each in `[0,1]` up to rounding.
    pub barycentric: Vec2,
}

/// Which instructions the walk uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Simd {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
}

impl Simd {
    fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        if avx2::is_available() {
            return Self::Avx2;
        }
        Self::Portable
    }
}

/// Bounding volume hierarchy over the triangles of a scene.
#[derive(Debug, Clone)]
pub struct Bvh {
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    placed: Vec<Placed>,
    root: Reference,
    bounds: (Vec3, Vec3),
    extent: f32,
    simd: Simd,
}

impl Bvh {
    /// Builds on all threads of the current rayon pool.
    ///
    /// Triangles with indices out of range, coordinates that are not finite or no area (their edges'
    /// cross product is zero in f32) are left out: no ray hits them.
    pub fn build(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        Self::with_instances(positions, triangles, Shared::default())
    }

    /// The same with meshes among the triangles that are met where their instances are, and a tree for
    /// each of them. Two levels are walked more slowly than one over copies of the triangles.
    pub fn with_instances(positions: &[Vec3], triangles: &[[u32; 3]], shared: Shared<'_>) -> Self {
        let build::Tree { nodes, blocks, placed, root, bounds } =
            build::build(positions, triangles, shared);
        let extent = bounds.0.abs().max(bounds.1.abs()).max_element();
        Self {
            nodes: on_huge_pages(nodes),
            blocks: on_huge_pages(blocks),
            placed,
            root,
            bounds,
            extent,
            simd: Simd::detect(),
        }
    }

    /// This tree, walked without special instructions; for comparison.
    pub fn into_portable(mut self) -> Self {
        self.simd = Simd::Portable;
        self
    }

    /// The nearest hit that `accept` takes; of equally near ones that with the lowest triangle index.
    ///
    /// `accept` is asked about any hit nearer than the nearest so far, in no particular order.
    /// Triangles have no back side: culling, like alpha masks, is up to `accept`.
    #[inline]
    pub fn closest_hit(&self, ray: &Ray, accept: impl Fn(&Hit) -> bool) -> Option<Hit> {
        if self.placed.is_empty() {
            self.closest_of::<1>(ray, accept)
        } else {
            self.closest_of::<2>(ray, accept)
        }
    }

    /// Whether some hit blocks the ray.
    ///
    /// Every hit is offered to `blocks` exactly once, in no particular order, until it returns true.
    #[inline]
    pub fn any_hit(&self, ray: &Ray, blocks: impl FnMut(&Hit) -> bool) -> bool {
        if self.placed.is_empty() {
            self.any_of::<1>(ray, blocks)
        } else {
            self.any_of::<2>(ray, blocks)
        }
    }

    #[inline(always)]
    fn closest_of<const LEVELS: usize>(
        &self,
        ray: &Ray,
        accept: impl Fn(&Hit) -> bool,
    ) -> Option<Hit> {
        match self.simd {
            Simd::Portable => traverse::closest_hit::<Portable, LEVELS>(self.tree(), ray, accept),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `Simd::Avx2` is set only where `avx2::is_available`.
            Simd::Avx2 => unsafe { avx2::closest_hit::<LEVELS>(self.tree(), ray, accept) },
        }
    }

    #[inline(always)]
    fn any_of<const LEVELS: usize>(&self, ray: &Ray, blocks: impl FnMut(&Hit) -> bool) -> bool {
        match self.simd {
            Simd::Portable => traverse::any_hit::<Portable, LEVELS>(self.tree(), ray, blocks),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `Simd::Avx2` is set only where `avx2::is_available`.
            Simd::Avx2 => unsafe { avx2::any_hit::<LEVELS>(self.tree(), ray, blocks) },
        }
    }

    /// Lower and upper corner of the box around all triangles (for instances, around boxes of parts
    /// of them); both zero if there are none.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        self.bounds
    }

    /// Bytes of the tree and its copy of the triangles.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice())
            + size_of_val(self.blocks.as_slice())
            + size_of_val(self.placed.as_slice())
    }

    /// Its instances as a GPU reads them; `root_of` tells where the root of a mesh's tree is there.
    pub(crate) fn instance_words(&self, root_of: impl Fn(u32) -> u32) -> Vec<InstanceWords> {
        self.placed.iter().map(|placed| placed.words(root_of(placed.mesh))).collect()
    }

    /// Name of the instructions in use, for logs.
    pub fn simd_name(&self) -> &'static str {
        match self.simd {
            Simd::Portable => "portable",
            #[cfg(target_arch = "x86_64")]
            Simd::Avx2 => "AVX2+FMA",
        }
    }

    #[inline(always)]
    fn tree(&self) -> TreeRef<'_> {
        TreeRef {
            nodes: &self.nodes,
            blocks: &self.blocks,
            placed: &self.placed,
            root: self.root,
            extent: self.extent,
        }
    }
}

/// Origin for a ray leaving a surface: `position` nudged along the unit `geometric_normal`, away
/// from rounding errors of the hit (Waechter and Binder, *A Fast and Robust Method for Avoiding
/// Self-Intersection*, Ray Tracing Gems 2019, chapter 6). Flip the normal to leave on the other side.
///
/// The nudge is about 2^-16 of each coordinate, and 2^-16 units within 1/32 unit of an axis' zero.
pub fn offset_origin(position: Vec3, geometric_normal: Vec3) -> Vec3 {
    const NEAR_ZERO: f32 = 1.0 / 32.0;
    const FLOAT_SCALE: f32 = 1.0 / 65536.0;
    const INT_SCALE: f32 = 256.0;
    let steps: IVec3 = (geometric_normal * INT_SCALE).as_ivec3();
    Vec3::from_array(std::array::from_fn(|axis| {
        let p = position[axis];
        if p.abs() < NEAR_ZERO {
            return p + FLOAT_SCALE * geometric_normal[axis];
        }
        let away_from_zero = if p < 0.0 { -steps[axis] } else { steps[axis] };
        f32::from_bits(p.to_bits().wrapping_add_signed(away_from_zero))
    }))
}
