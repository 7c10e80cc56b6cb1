//! Triangles from a few parametric shapes, in metres: the tools all built-in scenes are made with.

use glam::{Affine3A, EulerRot, Mat3, Quat, Vec2, Vec3, Vec4};

use crate::scene::lists::appended;
use crate::scene::{Camera, Material, Scene, Texture, TextureImage, TextureRef, Wrap};

/// Height at which things stand above what carries them, so that no two faces are coplanar.
pub(super) const LIFT: f32 = 0.0007;

/// Index of a material of the scene being built.
pub(super) type Mat = u32;

/// Collects the parts of a scene; shapes are placed by the current part's frame.
pub(super) struct Builder {
    pub(super) scene: Scene,
    pub(super) world_from_part: Affine3A,
    normal_from_part: Mat3,
    tint: Vec4,
}

/// A corner of a polygon: position, shading normal (zero is flat), texture coordinates in metres.
pub(super) type Corner = (Vec3, Vec3, Vec2);

impl Builder {
    /// An empty scene.
    pub(super) fn new(name: &str) -> Self {
        Self {
            scene: Scene { name: name.to_owned(), ..Scene::default() },
            world_from_part: Affine3A::IDENTITY,
            normal_from_part: Mat3::IDENTITY,
            tint: Vec4::ONE,
        }
    }

    /// The scene as built, with tangents if it has normal maps.
    pub(super) fn finish(&mut self) -> Scene {
        if self.scene.materials.iter().any(Material::has_normal_map) {
            self.add_tangents();
        }
        std::mem::take(&mut self.scene)
    }

    /// Adds a material.
    pub(super) fn material(&mut self, material: Material) -> Mat {
        appended(&mut self.scene.materials, material)
    }

    /// Adds a colour image that covers `size_metres` and repeats.
    pub(super) fn texture(&mut self, image: TextureImage, size_metres: Vec2) -> TextureRef {
        self.image(image, size_metres, true)
    }

    /// Adds an image of data, like a normal map, that covers `size_metres` and repeats.
    pub(super) fn data(&mut self, image: TextureImage, size_metres: Vec2) -> TextureRef {
        self.image(image, size_metres, false)
    }

    fn image(&mut self, image: TextureImage, size_metres: Vec2, srgb: bool) -> TextureRef {
        let (image, wrap) = (appended(&mut self.scene.images, image), Wrap::Repeat);
        let texture = Texture { image, wrap_u: wrap, wrap_v: wrap, nearest: false, srgb };
        let texture = appended(&mut self.scene.textures, texture);
        let transform = glam::Affine2::from_scale(size_metres.recip());
        TextureRef { texture, uv_set: 0, transform }
    }

    /// Adds a pinhole camera for a 16:9 picture.
    pub(super) fn camera(&mut self, name: &str, eye: [f32; 3], target: [f32; 3], fov_degrees: f32) {
        let mut camera = Camera::look_at(eye.into(), target.into(), fov_degrees.to_radians());
        name.clone_into(&mut camera.name);
        self.scene.cameras.push(camera);
    }

    /// Builds a part in a frame of its own, given in the frame of the part it belongs to.
    pub(super) fn part(&mut self, placement: Affine3A, build: impl FnOnce(&mut Self)) {
        let outer = (self.world_from_part, self.normal_from_part);
        self.world_from_part = outer.0 * placement;
        self.normal_from_part = Mat3::from(self.world_from_part.matrix3).inverse().transpose();
        build(self);
        (self.world_from_part, self.normal_from_part) = outer;
    }

    /// Builds a part in a frame whose origin is at `at`.
    pub(super) fn moved(&mut self, at: impl Into<Vec3>, build: impl FnOnce(&mut Self)) {
        self.part(Affine3A::from_translation(at.into()), build);
    }

    /// Builds a part that stands at `at`, turned by `yaw_degrees` about +Y.
    pub(super) fn standing(
        &mut self,
        at: impl Into<Vec3>,
        yaw_degrees: f32,
        build: impl FnOnce(&mut Self),
    ) {
        let turn = Quat::from_rotation_y(yaw_degrees.to_radians());
        self.part(Affine3A::from_rotation_translation(turn, at.into() + Vec3::Y * LIFT), build);
    }

    /// Builds a part that stands at `at`, turned by `yaw_degrees` about +Y and `scale` times as large.
    pub(super) fn scaled(
        &mut self,
        at: [f32; 3],
        yaw_degrees: f32,
        scale: f32,
        build: impl FnOnce(&mut Self),
    ) {
        self.standing(at, yaw_degrees, |b| b.part(Affine3A::from_scale(Vec3::splat(scale)), build));
    }

    /// Builds a part whose vertex colour is multiplied by linear `rgb`.
    pub(super) fn tinted(&mut self, rgb: [f32; 3], build: impl FnOnce(&mut Self)) {
        let outer = self.tint;
        self.tint *= Vec3::from(rgb).extend(1.0);
        build(self);
        self.tint = outer;
    }

    /// Adds a vertex given in the part's frame.
    pub(super) fn vertex(&mut self, (position, normal, uv): Corner) -> u32 {
        self.scene.positions.push(self.world_from_part.transform_point3(position));
        self.scene.normals.push((self.normal_from_part * normal).normalize_or_zero());
        self.scene.uvs[0].push(uv);
        self.scene.colors.push(self.tint);
        self.scene.positions.len() as u32 - 1
    }

    /// Adds a triangle of vertices, counter-clockwise in the part's frame; one without area is left out.
    pub(super) fn triangle(&mut self, mat: Mat, [a, b, c]: [u32; 3]) {
        let p = |i: u32| self.scene.positions[i as usize];
        if (p(b) - p(a)).cross(p(c) - p(a)).length() < 1e-10 {
            return;
        }
        let mirrored = self.world_from_part.matrix3.determinant() < 0.0;
        self.scene.triangles.push(if mirrored { [a, c, b] } else { [a, b, c] });
        self.scene.triangle_materials.push(mat);
    }

    /// A convex polygon, wound so that its front looks along `outward`.
    pub(super) fn polygon(&mut self, mat: Mat, corners: &[Corner], outward: Vec3) {
        let [a, b, c] = [corners[0].0, corners[1].0, corners[2].0];
        let front = (b - a).cross(c - a).dot(outward) >= 0.0;
        let indices: Vec<u32> = corners.iter().map(|&corner| self.vertex(corner)).collect();
        for pair in indices[1..].windows(2) {
            let (p, q) = if front { (pair[0], pair[1]) } else { (pair[1], pair[0]) };
            self.triangle(mat, [indices[0], p, q]);
        }
    }

    /// The flat parallelogram `p`, `p + a`, `p + a + b`, `p + b`; its front looks along `a x b`.
    pub(super) fn quad(&mut self, mat: Mat, p: Vec3, a: Vec3, b: Vec3) {
        let (u, v) = (a.length(), b.length());
        let corner = |s: f32, t: f32| (p + a * s + b * t, Vec3::ZERO, Vec2::new(u * s, v * t));
        let corners = [corner(0., 0.), corner(1., 0.), corner(1., 1.), corner(0., 1.)];
        self.polygon(mat, &corners, a.cross(b));
    }

    /// A box between two opposite corners with rounded-off edges `bevel` wide; texture u runs along its faces' longer
    /// sides.
    pub(super) fn slab(&mut self, mat: Mat, lo: [f32; 3], hi: [f32; 3], bevel: f32) {
        let [lo, hi] = [Vec3::min, Vec3::max].map(|end| end(lo.into(), hi.into()));
        let bevel = bevel.min(0.49 * (hi - lo).min_element());
        let offset = Vec2::new(lo.x * 1.7 + lo.z * 0.6, lo.y + lo.z * 2.3);
        // A corner of the box as a vertex of its face across `axis`.
        let at = |corner: usize, axis: usize| {
            let mut p = Vec3::ZERO;
            for k in 0..3 {
                let inset = if k == axis { 0.0 } else { bevel };
                p[k] = if corner >> k & 1 == 1 { hi[k] - inset } else { lo[k] + inset };
            }
            let sign = if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
            (p, Vec3::AXES[axis] * sign)
        };
        let uv = |p: Vec3, axis: usize| {
            let (mut b, mut c) = ((axis + 1) % 3, (axis + 2) % 3);
            if (hi - lo)[c] > (hi - lo)[b] {
                (b, c) = (c, b);
            }
            Vec2::new(p[b], p[c]) + offset
        };
        for axis in 0..3 {
            let (b, c) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
            for side in [0, 1 << axis] {
                let face = [side, side | b, side | b | c, side | c].map(|k| at(k, axis));
                self.polygon(mat, &face.map(|(p, n)| (p, n, uv(p, axis))), face[0].1);
            }
            if bevel <= 0.0 {
                continue;
            }
            // The four edges along `axis`.
            for (sb, sc) in [(0, 0), (b, 0), (b, c), (0, c)] {
                let (near, far) = (sb | sc, sb | sc | 1 << axis);
                let (ib, ic) = ((axis + 1) % 3, (axis + 2) % 3);
                let edge = [at(near, ib), at(far, ib), at(far, ic), at(near, ic)];
                self.polygon(mat, &edge.map(|(p, n)| (p, n, uv(p, ib))), edge[0].1 + edge[2].1);
            }
        }
        if bevel > 0.0 {
            for corner in 0..8 {
                let tip = [0, 1, 2].map(|axis| at(corner, axis));
                let outward = tip[0].1 + tip[1].1 + tip[2].1;
                self.polygon(mat, &tip.map(|(p, n)| (p, n, uv(p, 0))), outward);
            }
        }
    }
}

/// A rotation by degrees about X, then Y, then Z, and a translation.
pub(super) fn placed(at: [f32; 3], degrees: [f32; 3]) -> Affine3A {
    let [x, y, z] = degrees.map(f32::to_radians);
    Affine3A::from_rotation_translation(Quat::from_euler(EulerRot::YXZ, y, x, z), Vec3::from(at))
}
