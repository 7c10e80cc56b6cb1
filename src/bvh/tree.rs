//! The tree and how it is walked.

use glam::Vec3;

#[cfg(target_arch = "x86_64")]
use super::avx2;
use super::build::{Tree, build};
use super::instance::{InstanceWords, Shared};
use super::lanes::Portable;
use super::ray::{Hit, Ray};
use super::traverse;

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

/// Calls the walk for the instructions of this processor, with or without instances.
macro_rules! walk {
    ($walk:ident, $bvh:ident, $($argument:ident),+) => {{
        let Bvh { tree, simd } = $bvh;
        match (simd, tree.placed.is_empty()) {
            (Simd::Portable, true) => traverse::$walk::<Portable, 1>(tree, $($argument),+),
            (Simd::Portable, false) => traverse::$walk::<Portable, 2>(tree, $($argument),+),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `Simd::Avx2` is set only where `avx2::is_available`.
            (Simd::Avx2, true) => unsafe { avx2::$walk::<1>(tree, $($argument),+) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: as above.
            (Simd::Avx2, false) => unsafe { avx2::$walk::<2>(tree, $($argument),+) },
        }
    }};
}

/// Bounding volume hierarchy over the triangles of a scene.
#[derive(Debug, Clone)]
pub struct Bvh {
    pub(super) tree: Tree,
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
        Self { tree: build(positions, triangles, shared), simd: Simd::detect() }
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
        walk!(closest_hit, self, ray, accept)
    }

    /// Whether some hit blocks the ray.
    ///
    /// Every hit is offered to `blocks` exactly once, in no particular order, until it returns true.
    #[inline]
    pub fn any_hit(&self, ray: &Ray, blocks: impl FnMut(&Hit) -> bool) -> bool {
        walk!(any_hit, self, ray, blocks)
    }

    /// Lower and upper corner of the box around all triangles (for instances, around boxes of parts
    /// of them); both zero if there are none.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        self.tree.bounds
    }

    /// Bytes of the tree and its copy of the triangles.
    pub fn memory_bytes(&self) -> usize {
        let Tree { nodes, blocks, placed, .. } = &self.tree;
        size_of_val(&nodes[..]) + size_of_val(&blocks[..]) + size_of_val(&placed[..])
    }

    /// Its instances as a GPU reads them; `root_of` tells where the root of a mesh's tree is there.
    pub(crate) fn instance_words(&self, root_of: impl Fn(u32) -> u32) -> Vec<InstanceWords> {
        self.tree.placed.iter().map(|placed| placed.words(root_of(placed.mesh))).collect()
    }

    /// Name of the instructions in use, for logs.
    pub fn simd_name(&self) -> &'static str {
        match self.simd {
            Simd::Portable => "portable",
            #[cfg(target_arch = "x86_64")]
            Simd::Avx2 => "AVX2+FMA",
        }
    }
}
