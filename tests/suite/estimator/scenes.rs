//! Hand-built scenes whose answers can be worked out.

use std::f32::consts::PI;

use glam::{Affine2, Affine3A, Mat3, Vec3};
use lightgrid::path::{World, WorldBuilder};
use lightgrid::scene::{
    AlphaMode, Camera, Material, Projection, PunctualKind, PunctualLight, Scene, Texture,
    TextureImage, TextureRef, TextureSlot, Wrap,
};

/// [`Material::lambert`].
pub(crate) fn lambert(albedo: f32) -> Material {
    Material::lambert(albedo)
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
/// [`with_half_texture`].
pub(crate) fn half_masked(material: Material) -> Material {
    let texture = TextureRef { texture: 0, uv_set: 0, transform: Affine2::IDENTITY };
    Material { alpha_mode: AlphaMode::Mask { cutoff: 0.5 }, ..material }
        .with_texture(TextureSlot::BaseColor, texture)
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

/// A ball of radius 1 around the origin with the normals of a sphere. It has `rows` rows of faces, twice as many
/// columns, and its front outside.
pub(crate) fn smooth_ball(material: &Material, rows: u32) -> Scene {
    let at = |row: u32, column: u32| {
        let (sin, cos) = (PI * row as f32 / rows as f32).sin_cos();
        let (sin_around, cos_around) = (PI * column as f32 / rows as f32).sin_cos();
        Vec3::new(sin * cos_around, cos, sin * sin_around)
    };
    let columns = 2 * rows;
    let corner = |row: u32, column: u32| row * columns + column % columns;
    let positions: Vec<Vec3> =
        (0..=rows).flat_map(|row| (0..columns).map(move |column| at(row, column))).collect();
    let mut triangles = Vec::new();
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let [a, b] = [corner(row, column), corner(row, column + 1)];
        let [c, d] = [corner(row + 1, column + 1), corner(row + 1, column)];
        if row > 0 {
            triangles.push([a, b, c]);
        }
        if row + 1 < rows {
            triangles.push([a, c, d]);
        }
    }
    Scene {
        normals: positions.clone(),
        triangle_materials: vec![0; triangles.len()],
        triangles,
        positions,
        materials: vec![material.clone()],
        ..Scene::default()
    }
}

/// A world to be whose texture 0 is opaque white where `u < 1/2`, clear elsewhere.
pub(crate) fn with_half_texture() -> WorldBuilder {
    let mut builder = WorldBuilder::default();
    let texels = vec![[255; 4], [255, 255, 255, 0]].into();
    builder.scene.images.push(TextureImage { width: 2, height: 1, texels });
    let wrap = Wrap::ClampToEdge;
    let texture = Texture { image: 0, wrap_u: wrap, wrap_v: wrap, nearest: true, srgb: true };
    builder.scene.textures.push(texture);
    builder
}

/// Grey paint of this roughness under a clearcoat of that one, which is none from 1 on.
pub(crate) fn varnish(roughness: f32, clearcoat_roughness: f32) -> Material {
    let clearcoat = if clearcoat_roughness < 1.0 { 1.0 } else { 0.0 };
    Material { roughness, specular: 1.0, clearcoat, clearcoat_roughness, ..lambert(0.7) }
}

/// [`room`] with this material on all surfaces, but in their own colours.
pub(crate) fn painted(paint: &Material) -> (World, Camera) {
    let (world, camera) = room(0.7, None);
    let mut scene = world.scene.clone();
    for material in &mut scene.materials {
        *material = Material { base_color: material.base_color, ..paint.clone() };
    }
    (World::new(scene), camera)
}

/// A room of 4 x 2.5 x 3 metres with a large window in its +X wall and a block on the floor; the
/// camera looks at the block from beside the window.
pub(crate) fn room(albedo: f32, window: Option<&Material>) -> (World, Camera) {
    let (low, high) = (Vec3::new(-2.0, 0.0, -1.5), Vec3::new(2.0, 2.5, 1.5));
    let (sill, head) = (Vec3::new(2.0, 0.8, -1.0), Vec3::new(2.0, 2.2, 1.0));
    let walls = lambert(albedo);
    let frame = |builder: WorldBuilder, y: [f32; 2], z: [f32; 2]| {
        builder.quad(&walls, [2.0, y[0], z[0]], [0.0, y[1] - y[0], 0.0], [0.0, 0.0, z[1] - z[0]])
    };
    let mut builder = WorldBuilder::default().faces(&walls, low, high, 1..6);
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
