//! Watertight ray/triangle test on eight lanes (Woop, Benthin, Wald, *Watertight Ray/Triangle
//! Intersection*, JCGT 2(1), 2013).

use glam::Vec2;

use super::traverse::{Bits, Lanes};
use super::wide::{Block, WIDTH};
use super::{Hit, Ray};

/// A ray as the triangle test wants it: the frame in which it runs along the third axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shear {
    /// Axes of the sheared frame, a cyclic permutation of 0, 1, 2. The direction is largest along
    /// the third.
    axes: [usize; 3],
    /// Slopes of the ray along the first two axes and inverse of its length along the third.
    factors: [f32; 3],
    origin: [f32; 3],
}

impl Shear {
    /// `ray.direction` is finite and not zero.
    pub(super) fn new(ray: &Ray) -> Self {
        let length = ray.direction.abs();
        let z = length.max_position();
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let d = axes.map(|axis| ray.direction[axis]);
        Self {
            axes,
            factors: [d[0] / d[2], d[1] / d[2], 1.0 / d[2]],
            origin: axes.map(|axis| ray.origin[axis]),
        }
    }
}

/// Hits of one block.
pub(super) struct BlockHits {
    /// Bit `i` is set where triangle `i` is hit.
    pub(super) mask: u32,
    t: [f32; WIDTH],
    barycentric: [[f32; WIDTH]; 2],
}

impl BlockHits {
    const NONE: Self = Self { mask: 0, t: [0.0; WIDTH], barycentric: [[0.0; WIDTH]; 2] };

    /// The hit in lane `lane`, which is set in the mask.
    #[inline(always)]
    pub(super) fn hit(&self, block: &Block, lane: usize) -> Hit {
        Hit {
            t: self.t[lane],
            triangle: block.triangles[lane],
            barycentric: Vec2::new(self.barycentric[0][lane], self.barycentric[1][lane]),
        }
    }
}

/// Intersects all triangles of `block` with `t_min <= t <= t_max`.
///
/// Products are not fused with sums: only then is `ab < cd` never computed as `ab > cd`, so that two
/// triangles agree about their shared edge, and all machines agree about the hit.
#[inline(always)]
pub(super) fn intersect<L: Lanes>(block: &Block, ray: &Shear, t_min: f32, t_max: f32) -> BlockHits {
    let [x, y, z] = ray.axes;
    let origin = ray.origin.map(L::splat);
    let slope = [L::splat(ray.factors[0]), L::splat(ray.factors[1])];
    let depth = [0, 1, 2].map(|vertex| L::load(axis(block, vertex, z)).sub(origin[2]));
    let across = |vertex: usize, axis_index: usize, i: usize| {
        let offset = L::load(axis(block, vertex, axis_index)).sub(origin[i]);
        offset.sub(slope[i].mul(depth[vertex]))
    };
    let px = [0, 1, 2].map(|vertex| across(vertex, x, 0));
    let py = [0, 1, 2].map(|vertex| across(vertex, y, 1));
    let edge = |a: usize, b: usize| px[a].mul(py[b]).sub(py[a].mul(px[b]));
    let mut edges = [edge(2, 1), edge(0, 2), edge(1, 0)];

    let zero = L::splat(0.0);
    let least = edges[0].min(edges[1]).min(edges[2]);
    let greatest = edges[0].max(edges[1]).max(edges[2]);
    let mut mask = zero.le(least) | greatest.le(zero);
    if mask == 0 {
        return BlockHits::NONE;
    }
    let on_edge = mask & (zero.eq(least) | zero.eq(greatest));
    if on_edge != 0 {
        let (exact, outside) =
            exact_edges(edges.map(L::store), px.map(L::store), py.map(L::store), on_edge);
        edges = exact.map(|edge| L::load(&edge));
        mask &= !outside;
    }
    let determinant = edges[0].add(edges[1]).add(edges[2]);
    let scaled = edges[0].mul(depth[0]).add(edges[1].mul(depth[1])).add(edges[2].mul(depth[2]));
    let t = scaled.mul(L::splat(ray.factors[2])).div(determinant);
    mask &= L::splat(t_min).le(t) & t.le(L::splat(t_max));
    if mask == 0 {
        return BlockHits::NONE;
    }
    BlockHits {
        mask,
        t: t.store(),
        barycentric: [edges[1].div(determinant).store(), edges[2].div(determinant).store()],
    }
}

#[inline(always)]
fn axis(block: &Block, vertex: usize, axis: usize) -> &[f32; WIDTH] {
    debug_assert!(axis < 3, "axes are a permutation of 0, 1, 2");
    // SAFETY: `axis` comes from `Shear::axes`, whose entries are remainders of 3.
    unsafe { block.vertices[vertex].get_unchecked(axis) }
}

/// Edge functions of the lanes in `lanes` in f64, where products of f32 are exact, and a mask of the
/// lanes that prove to be outside. An f32 edge function of zero says nothing about the side.
#[cold]
fn exact_edges(
    mut edges: [[f32; WIDTH]; 3],
    px: [[f32; WIDTH]; 3],
    py: [[f32; WIDTH]; 3],
    lanes: u32,
) -> ([[f32; WIDTH]; 3], u32) {
    let mut outside = 0;
    for lane in Bits(lanes) {
        let edge = |a: usize, b: usize| {
            f64::from(px[a][lane]) * f64::from(py[b][lane])
                - f64::from(py[a][lane]) * f64::from(px[b][lane])
        };
        let exact = [edge(2, 1), edge(0, 2), edge(1, 0)];
        if exact.iter().any(|&e| e < 0.0) && exact.iter().any(|&e| e > 0.0) {
            outside |= 1 << lane;
        }
        for (edge, exact) in edges.iter_mut().zip(exact) {
            edge[lane] = exact as f32;
        }
    }
    (edges, outside)
}
