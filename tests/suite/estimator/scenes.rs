//! Hand-built scenes whose answers can be worked out.

use glam::{Affine2, Affine3A, Mat3, Vec2, Vec3};
use lightgrid::path::World;
use lightgrid::scene::{
    AlphaMode, Camera, Material, Projection, PunctualKind, PunctualLight, Scene, Texture,
    TextureImage, TextureRef, Wrap,
};

/// Lambert's reflectance alone, both sides alike.
pub(crate) fn lambert(albedo: f32) -> Material {
    Material {
        base_color: Vec3::splat(albedo).extend(1.0),
        metallic: 0.0,
        specular: 0.0,
        double_sided: true,
        ..Material::default()
    }
}

pub(crate) fn black() -> Material {
    lambert(0.0)
}

/// Emits and reflects nothing; both sides.
pub(crate) fn lamp(radiance: f32) -> Material {
    Material { emissive: Vec3::splat(radiance), ..black() }
}

/// Emits without being a light source that is sampled; both sides.
pub(crate) fn unlit(radiance: f32) -> Material {
    Material { unlit: true, ..lambert(radiance) }
}

/// A smooth thin pane of index 1.5.
pub(crate) fn pane() -> Material {
    Material { transmission: 1.0, roughness: 0.0, specular: 1.0, ..lambert(1.0) }
}

/// A smooth solid of index 1.5 that lets half of the light through one metre.
pub(crate) fn smoked_glass() -> Material {
    Material {
        thickness: 1.0,
        attenuation_color: Vec3::splat(0.5),
        attenuation_distance: 1.0,
        ..pane()
    }
}

/// Covers the half of its texture coordinates where `u < 1/2`; made for scenes of
/// [`SceneBuilder::with_half_texture`].
pub(crate) fn half_masked(material: Material) -> Material {
    let texture = TextureRef { texture: 0, uv_set: 0, transform: Affine2::IDENTITY };
    Material {
        base_color_texture: Some(texture),
        alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
        ..material
    }
}

pub(crate) fn blended(material: Material, alpha: f32) -> Material {
    let base_color = material.base_color.truncate().extend(alpha);
    Material { base_color, alpha_mode: AlphaMode::Blend, ..material }
}

pub(crate) fn sunlight(direction: Vec3, irradiance: f32) -> PunctualLight {
    PunctualLight {
        name: String::new(),
        kind: PunctualKind::Directional,
        position: Vec3::ZERO,
        direction: direction.normalize(),
        intensity: Vec3::splat(irradiance),
        range: f32::INFINITY,
    }
}

/// Parallel rays from `eye` along -Z, a picture two metres high.
pub(crate) fn orthographic(eye: Vec3) -> Camera {
    Camera {
        world_from_camera: Affine3A::from_mat3_translation(Mat3::IDENTITY, eye),
        projection: Projection::Orthographic { half_height: 1.0 },
        ..Camera::look_at(eye, eye - Vec3::Z, 1.0)
    }
}

/// A scene being put together; every method returns it.
#[derive(Default)]
pub(crate) struct SceneBuilder {
    scene: Scene,
}

impl SceneBuilder {
    pub(crate) fn new() -> Self {
        Self::default()
    }

    /// Texture 0: opaque white where `u < 1/2`, clear elsewhere.
    pub(crate) fn with_half_texture() -> Self {
        let mut builder = Self::new();
        let texels = vec![[255; 4], [255, 255, 255, 0]];
        builder.scene.images.push(TextureImage { width: 2, height: 1, texels });
        let wrap = Wrap::ClampToEdge;
        builder.scene.textures.push(Texture {
            image: 0,
            wrap_u: wrap,
            wrap_v: wrap,
            nearest: true,
            srgb: true,
        });
        builder
    }

    pub(crate) fn build(self) -> World {
        World::new(self.scene)
    }

    pub(crate) fn light(mut self, light: PunctualLight) -> Self {
        self.scene.lights.push(light);
        self
    }

    /// A parallelogram; its front is where `a cross b` points, `u` grows along `a`.
    pub(crate) fn quad(
        mut self,
        material: &Material,
        corner: impl Into<Vec3>,
        a: impl Into<Vec3>,
        b: impl Into<Vec3>,
    ) -> Self {
        let (corner, a, b) = (corner.into(), a.into(), b.into());
        let scene = &mut self.scene;
        let known = scene.materials.iter().position(|m| m == material);
        let index = known.unwrap_or_else(|| {
            scene.materials.push(material.clone());
            scene.materials.len() - 1
        });
        let first = scene.positions.len() as u32;
        scene.positions.extend([corner, corner + a, corner + a + b, corner + b]);
        scene.uvs[0].extend([Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]);
        scene.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|i: u32| first + i)));
        scene.triangle_materials.extend([index as u32; 2]);
        self
    }

    /// A horizontal square of side 10 around the origin, front up.
    pub(crate) fn floor(self, material: &Material) -> Self {
        self.quad(material, [-5.0, 0.0, 5.0], [10.0, 0.0, 0.0], [0.0, 0.0, -10.0])
    }

    /// A face of a box, front outwards: 0 and 1 are +X and -X, then Y, then Z.
    pub(crate) fn face(self, material: &Material, low: Vec3, high: Vec3, face: usize) -> Self {
        let axis = face / 2;
        let size = high - low;
        let edge = |axis: usize| Vec3::AXES[axis % 3] * size[axis % 3];
        let (a, b) = (edge(axis + 1), edge(axis + 2));
        if face.is_multiple_of(2) {
            self.quad(material, low + edge(axis), a, b)
        } else {
            self.quad(material, low, b, a)
        }
    }

    pub(crate) fn faces(
        self,
        material: &Material,
        low: Vec3,
        high: Vec3,
        faces: impl IntoIterator<Item = usize>,
    ) -> Self {
        faces.into_iter().fold(self, |builder, face| builder.face(material, low, high, face))
    }

    /// A sphere of flat faces.
    pub(crate) fn sphere(self, material: &Material, center: Vec3, radius: f32) -> Self {
        let rings = 12;
        let at = |i: u32, j: u32| {
            let uv = Vec2::new(i as f32 / (2 * rings) as f32, j as f32 / rings as f32);
            center + radius * lightgrid::math::direction_from_uv(uv)
        };
        let cells = (0..2 * rings).flat_map(|i| (0..rings).map(move |j| (i, j)));
        cells.fold(self, |builder, (i, j)| {
            // A ring's quads are trapezoids: two halves of parallelograms would stick out.
            let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            builder.trapezoid(material, corners)
        })
    }

    fn trapezoid(self, material: &Material, corners: [Vec3; 4]) -> Self {
        let mut builder = self.quad(material, corners[0], Vec3::ZERO, Vec3::ZERO);
        let first = builder.scene.positions.len() - 4;
        builder.scene.positions[first..].copy_from_slice(&corners);
        builder
    }
}

/// A room of 4 x 2.5 x 3 metres with a large window in its +X wall and a block on the floor; the
/// camera looks at the block from beside the window.
pub(crate) fn room(albedo: f32, window: Option<&Material>) -> (World, Camera) {
    let (low, high) = (Vec3::new(-2.0, 0.0, -1.5), Vec3::new(2.0, 2.5, 1.5));
    let (sill, head) = (Vec3::new(2.0, 0.8, -1.0), Vec3::new(2.0, 2.2, 1.0));
    let walls = lambert(albedo);
    let frame = |builder: SceneBuilder, y: [f32; 2], z: [f32; 2]| {
        builder.quad(&walls, [2.0, y[0], z[0]], [0.0, y[1] - y[0], 0.0], [0.0, 0.0, z[1] - z[0]])
    };
    let mut builder = SceneBuilder::new().faces(&walls, low, high, 1..6);
    builder = frame(builder, [low.y, sill.y], [low.z, high.z]);
    builder = frame(builder, [head.y, high.y], [low.z, high.z]);
    builder = frame(builder, [sill.y, head.y], [low.z, sill.z]);
    builder = frame(builder, [sill.y, head.y], [head.z, high.z]);
    let (block_low, block_high) = (Vec3::new(-1.2, 0.0, -0.8), Vec3::new(-0.4, 1.0, 0.2));
    builder = builder.faces(&lambert(0.5 * albedo), block_low, block_high, [0, 1, 2, 4, 5]);
    if let Some(window) = window {
        builder = builder.face(window, sill, head, 0);
    }
    (builder.build(), Camera::look_at(Vec3::new(1.7, 1.6, 1.2), Vec3::new(-1.0, 0.7, -0.4), 1.0))
}
