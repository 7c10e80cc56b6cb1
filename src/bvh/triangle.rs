//! Watertight ray/triangle test on eight lanes (Woop, Benthin, Wald, *Watertight Ray/Triangle
//! Intersection*, JCGT 2(1), 2013).

use glam::{DVec3, Vec2};

use super::lanes::{Bits, Lanes};
use super::wide::{Block, PerLane, WIDTH};
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
    direction: [f32; 3],
}

impl Shear {
    /// `ray.direction` is finite and not zero.
    #[inline(always)]
    pub(super) fn new(ray: &Ray) -> Self {
        let length = ray.direction.abs();
        let z = length.max_position();
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let d = axes.map(|axis| ray.direction[axis]);
        Self {
            axes,
            factors: [d[0] / d[2], d[1] / d[2], 1.0 / d[2]],
            origin: axes.map(|axis| ray.origin[axis]),
            direction: d,
        }
    }
}

/// Hits of one block.
pub(super) struct BlockHits {
    /// Bit `i` is set where triangle `i` is hit.
    pub(super) mask: u32,
    t: PerLane,
    barycentric: [PerLane; 2],
}

impl BlockHits {
    const NONE: Self = Self { mask: 0, t: [0.0; WIDTH], barycentric: [[0.0; WIDTH]; 2] };

    /// The hit in lane `lane`, which is set in the mask.
    #[inline(always)]
    pub(super) fn hit(&self, block: &Block, lane: usize) -> Hit {
        let barycentric = Vec2::new(self.barycentric[0][lane], self.barycentric[1][lane]);
        Hit { t: self.t[lane], triangle: block.triangles[lane], barycentric }
    }
}

/// Intersects all triangles of `block` with `t_min <= t <= t_max`.
///
/// Products are not fused with sums: only then is `ab < cd` never computed as `ab > cd`, so that two
/// triangles agree about their shared edge, and all machines agree about the hit.
#[inline(always)]
pub(super) fn intersect<L: Lanes>(block: &Block, ray: &Shear, t_min: f32, t_max: f32) -> BlockHits {
    let a = shear::<L>(&block.vertices[0], ray);
    let b = shear::<L>(&block.vertices[1], ray);
    let c = shear::<L>(&block.vertices[2], ray);
    let mut edges = [edge(&c, &b), edge(&a, &c), edge(&b, &a)];

    let zero = L::splat(0.0);
    let least = edges[0].min(edges[1]).min(edges[2]);
    let greatest = edges[0].max(edges[1]).max(edges[2]);
    let mut mask = zero.le(least) | greatest.le(zero);
    if mask == 0 {
        return BlockHits::NONE;
    }
    let on_edge = mask & (zero.eq(least) | zero.eq(greatest));
    if on_edge != 0 {
        let mut stored = [edges[0].store(), edges[1].store(), edges[2].store()];
        let px = [a[0].store(), b[0].store(), c[0].store()];
        let py = [a[1].store(), b[1].store(), c[1].store()];
        mask &= !exact_edges(&mut stored, &px, &py, on_edge);
        edges = [L::load(&stored[0]), L::load(&stored[1]), L::load(&stored[2])];
    }
    let determinant = edges[0].add(edges[1]).add(edges[2]);
    let scaled = edges[0].mul(a[2]).add(edges[1].mul(b[2])).add(edges[2].mul(c[2]));
    let mut t = scaled.mul(L::splat(ray.factors[2])).div(determinant);
    // The error of `t` is a few 2^-24 of how far the vertices lie along the ray: a lot next to a
    // triangle that is far larger than `t`. On a ground of 10 km every ray would meet its own start.
    let farthest = magnitude(a[2]).max(magnitude(b[2])).max(magnitude(c[2]));
    let reach = farthest.mul(L::splat(ray.factors[2].abs()));
    let slack = reach.mul(L::splat(DISTANCE_ERROR));
    mask &= L::splat(t_min).le(t.add(slack)) & t.le(L::splat(t_max).add(slack));
    let rough = mask & magnitude(t).le(reach.mul(L::splat(ROUGH_DISTANCE)));
    if rough != 0 {
        let mut stored = t.store();
        exact_distances(&mut stored, block, ray, rough);
        t = L::load(&stored);
    }
    mask &= L::splat(t_min).le(t) & t.le(L::splat(t_max));
    if mask == 0 {
        return BlockHits::NONE;
    }
    let barycentric = [edges[1].div(determinant).store(), edges[2].div(determinant).store()];
    BlockHits { mask, t: t.store(), barycentric }
}

/// Bound on the error of a distance, in units of how far the vertices lie along the ray: 16 * 2^-24.
const DISTANCE_ERROR: f32 = 1.0 / (1 << 20) as f32;

/// Distances below this, in the same units, have an error of per cents: they are computed anew.
const ROUGH_DISTANCE: f32 = 1.0 / (1 << 14) as f32;

#[inline(always)]
fn magnitude<L: Lanes>(x: L) -> L {
    x.max(L::splat(0.0).sub(x))
}

/// Puts the distances of the lanes in `lanes` to the triangles' planes, computed in f64.
#[cold]
#[inline(never)]
fn exact_distances(t: &mut PerLane, block: &Block, ray: &Shear, lanes: u32) {
    let of_axes = |values: &[f32; 3]| DVec3::from(values.map(f64::from));
    let (origin, direction) = (of_axes(&ray.origin), of_axes(&ray.direction));
    for lane in Bits(lanes) {
        let [a, b, c] = [0, 1, 2].map(|corner| {
            of_axes(&ray.axes.map(|axis| block.vertices[corner][axis][lane])) - origin
        });
        let normal = (b - a).cross(c - a);
        let approach = normal.dot(direction);
        if approach != 0.0 {
            t[lane] = (normal.dot(a) / approach) as f32;
        }
    }
}

/// Vertices relative to the ray's origin, sheared so that the ray runs along the third axis.
#[inline(always)]
fn shear<L: Lanes>(vertices: &[PerLane; 3], ray: &Shear) -> [L; 3] {
    let [x, y, z] = ray.axes;
    debug_assert!(x < 3 && y < 3 && z < 3, "axes are a permutation of 0, 1, 2");
    // SAFETY: `Shear::new` makes `axes` of remainders of 3.
    let (x, y, z) = unsafe {
        (vertices.get_unchecked(x), vertices.get_unchecked(y), vertices.get_unchecked(z))
    };
    let z = L::load(z).sub(L::splat(ray.origin[2]));
    let x = L::load(x).sub(L::splat(ray.origin[0]));
    let y = L::load(y).sub(L::splat(ray.origin[1]));
    [x.sub(L::splat(ray.factors[0]).mul(z)), y.sub(L::splat(ray.factors[1]).mul(z)), z]
}

/// On which side of the edge from `b` to `a` the ray passes: positive, negative or, within an
/// underflow or rounding, zero.
#[inline(always)]
fn edge<L: Lanes>(a: &[L; 3], b: &[L; 3]) -> L {
    a[0].mul(b[1]).sub(a[1].mul(b[0]))
}

/// Puts the edge functions of the lanes in `lanes` computed in f64, where products of f32 are exact,
/// and returns a mask of the lanes that prove to be outside. Zero in f32 does not tell the side.
#[cold]
#[inline(never)]
fn exact_edges(edges: &mut [PerLane; 3], px: &[PerLane; 3], py: &[PerLane; 3], lanes: u32) -> u32 {
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
    outside
}
