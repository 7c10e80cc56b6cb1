//! Curved shapes: sheets, lathes, tubes, rounded bodies; all with smooth normals.

use std::f32::consts::{FRAC_PI_4, TAU};

use glam::{Vec2, Vec3};

use super::mesh::{Builder, Corner, Mat};

impl Builder {
    /// A smooth grid of `nu` x `nv` quads over `surface(u, v)`, u and v in `[0,1]`; its front looks
    /// along the derivative by u cross that by v. Texture coordinates cover `uv_size` metres.
    pub(super) fn sheet(
        &mut self,
        mat: Mat,
        [nu, nv]: [u32; 2],
        uv_size: Vec2,
        surface: impl Fn(f32, f32) -> Vec3,
    ) {
        const STEP: f32 = 2e-3;
        self.grid(mat, [nu, nv], |i, j| {
            let (u, v) = (i as f32 / nu as f32, j as f32 / nv as f32);
            let du = surface(u + STEP, v) - surface(u - STEP, v);
            let dv = surface(u, v + STEP) - surface(u, v - STEP);
            (surface(u, v), du.cross(dv).normalize_or_zero(), Vec2::new(u, v) * uv_size)
        });
    }

    /// A grid of `nu` x `nv` quads with a corner for each column and row. Returns its first vertex.
    fn grid(&mut self, mat: Mat, [nu, nv]: [u32; 2], corner: impl Fn(u32, u32) -> Corner) -> u32 {
        let first = self.scene.positions.len() as u32;
        for (j, i) in (0..=nv).flat_map(|j| (0..=nu).map(move |i| (j, i))) {
            self.vertex(corner(i, j));
        }
        for j in 0..nv {
            for i in 0..nu {
                let a = first + j * (nu + 1) + i;
                let (b, c, d) = (a + 1, a + nu + 2, a + nu + 1);
                self.triangle(mat, [a, b, c]);
                self.triangle(mat, [a, c, d]);
            }
        }
        first
    }

    /// Surface of revolution about +Y of a `profile` of (radius, height), whose front is on the
    /// right of the way along it (upwards: outside). Corners sharper than 40 degrees stay creases.
    pub(super) fn lathe(
        &mut self,
        mat: Mat,
        segments: u32,
        profile: impl IntoIterator<Item = (f32, f32)>,
    ) {
        let points: Vec<Vec2> = profile.into_iter().map(Vec2::from).collect();
        let normal = |i: usize| {
            let d = points[i + 1] - points[i];
            Vec2::new(d.y, -d.x).normalize_or_zero()
        };
        let smooth = |here: Vec2, other: Vec2| {
            if here.dot(other) > 0.766 { (here + other).normalize() } else { here }
        };
        let girth = TAU * points.iter().map(|p| p.x).fold(0.0, f32::max);
        let mut length = 0.0;
        for i in 0..points.len() - 1 {
            let here = normal(i);
            let start = if i > 0 { smooth(here, normal(i - 1)) } else { here };
            let end = if i + 2 < points.len() { smooth(here, normal(i + 1)) } else { here };
            let next = length + points[i].distance(points[i + 1]);
            let ends = [(points[i], start, length), (points[i + 1], end, next)];
            self.grid(mat, [1, segments], |column, k| {
                let turn = k as f32 / segments as f32;
                let (sin, cos) = (turn * TAU).sin_cos();
                let turned = |v: Vec2| Vec3::new(v.x * cos, v.y, v.x * sin);
                let (p, n, along) = ends[column as usize];
                (turned(p), turned(n), Vec2::new(turn * girth, along))
            });
            length = next;
        }
    }

    /// An upright cylinder or cone frustum with rounded-off rims, centred on the part's +Y axis.
    pub(super) fn drum(&mut self, mat: Mat, [y0, y1]: [f32; 2], [r0, r1]: [f32; 2], bevel: f32) {
        let segments = if r0.max(r1) > 0.06 { 48 } else { 20 };
        let profile = [
            (0.0, y0),
            (r0 - bevel, y0),
            (r0 - 0.3 * bevel, y0 + 0.3 * bevel),
            (r0, y0 + bevel),
            (r1, y1 - bevel),
            (r1 - 0.3 * bevel, y1 - 0.3 * bevel),
            (r1 - bevel, y1),
            (0.0, y1),
        ];
        self.lathe(mat, segments, profile);
    }

    /// A round tube along `path` of (centre, radius), closed by flat ends.
    pub(super) fn tube(
        &mut self,
        mat: Mat,
        segments: u32,
        path: impl IntoIterator<Item = (Vec3, f32)>,
    ) {
        let path: Vec<_> = path.into_iter().collect();
        let tangent = |i: usize| {
            let (before, after) =
                (path[i.saturating_sub(1)].0, path[(i + 1).min(path.len() - 1)].0);
            (after - before).normalize_or(Vec3::Y)
        };
        let mut side = tangent(0).any_orthonormal_vector();
        let mut length = 0.0;
        let ring = |(i, &(centre, _)): (usize, &(Vec3, f32))| {
            let forward = tangent(i);
            side =
                (side - forward * side.dot(forward)).normalize_or(forward.any_orthonormal_vector());
            length += if i > 0 { centre.distance(path[i - 1].0) } else { 0.0 };
            (side, forward.cross(side), length)
        };
        let rings: Vec<_> = path.iter().enumerate().map(ring).collect();
        let pieces = path.len() as u32 - 1;
        let first = self.grid(mat, [segments, pieces], |k, i| {
            let ((centre, radius), (side, other, length)) = (path[i as usize], rings[i as usize]);
            let turn = k as f32 / segments as f32;
            let (sin, cos) = (turn * TAU).sin_cos();
            let normal = side * cos + other * sin;
            (centre + normal * radius, normal, Vec2::new(length, turn * TAU * radius))
        });
        let last = first + pieces * (segments + 1);
        for (start, outward) in [(first, -tangent(0)), (last, tangent(path.len() - 1))] {
            let local = self.world_from_part.inverse();
            let corner = |i: u32| {
                let p = local.transform_point3(self.scene.positions[i as usize]);
                (p, Vec3::ZERO, Vec2::new(p.x, p.z))
            };
            let cap: Vec<Corner> = (start..start + segments).map(corner).collect();
            self.polygon(mat, &cap, outward);
        }
    }

    /// A straight rod.
    pub(super) fn rod(&mut self, mat: Mat, from: Vec3, to: Vec3, radius: f32) {
        let segments = if radius > 0.012 { 20 } else { 10 };
        self.tube(mat, segments, [(from, radius), (to, radius)]);
    }

    /// The body `(|x|^k + |z|^k)^(j/k) + |y|^j = 1`, scaled to `half` extents about `centre`, of
    /// `6 n^2` quads: an ellipsoid for `[k, j] = [2, 2]`, a cushion for `[6, 2.4]`.
    pub(super) fn blob(&mut self, mat: Mat, centre: Vec3, half: Vec3, [k, j]: [f32; 2], n: u32) {
        let axes = Vec3::AXES;
        for face in 0..6 {
            let (axis, sign) = (face % 3, if face < 3 { 1.0 } else { -1.0 });
            let (b, c) = (axes[(axis + 1) % 3] * sign, axes[(axis + 2) % 3]);
            self.grid(mat, [n, n], |column, row| {
                let [s, t] =
                    [column, row].map(|i| (FRAC_PI_4 * (2.0 * i as f32 / n as f32 - 1.0)).tan());
                let cube = axes[axis] * sign + b * s + c * t;
                let flat = (cube.x.abs().powf(k) + cube.z.abs().powf(k)).powf(1.0 / k).max(1e-4);
                let p = cube / (flat.powf(j) + cube.y.abs().powf(j)).powf(1.0 / j);
                let flat = flat * p.length() / cube.length();
                let slope = |x: f32, power: f32| x.abs().powf(power - 1.0).copysign(x);
                let wide = flat.powf(j - k);
                let gradient = Vec3::new(wide * slope(p.x, k), slope(p.y, j), wide * slope(p.z, k));
                let place = p * half;
                let uv = Vec2::new(place.dot(b.abs()), place.dot(c));
                (centre + place, (gradient / half).normalize_or(axes[axis] * sign), uv)
            });
        }
    }

    /// A sphere.
    pub(super) fn ball(&mut self, mat: Mat, centre: Vec3, radius: f32) {
        let n = match radius {
            _ if radius > 0.3 => 24,
            _ if radius > 0.05 => 12,
            _ => 6,
        };
        self.blob(mat, centre, Vec3::splat(radius), [2.0, 2.0], n);
    }
}
