//! Points on triangles: position, facing, normals, material.

use glam::{Affine2, Vec2, Vec3, Vec4};
use lightgrid::sampler::SplitMix;
use lightgrid::scene::surface::{SurfacePoint, alpha_at};
use lightgrid::scene::{
    AlphaMode, Material, Scene, Texture, TextureImage, TextureRef, TextureSlot, Wrap,
};

use super::Random;

const CENTRE: Vec2 = Vec2::splat(1.0 / 3.0);
const DOWN: Vec3 = Vec3::NEG_Z;
const UP: Vec3 = Vec3::Z;

/// A triangle in the plane z = 0 whose front looks along +Z.
fn triangle(material: Material) -> Scene {
    Scene {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        triangles: vec![[0, 1, 2]],
        triangle_materials: vec![0],
        materials: vec![material],
        uvs: [vec![Vec2::ZERO, Vec2::X, Vec2::Y], Vec::new()],
        ..Scene::default()
    }
}

/// Adds a texture of one texel.
fn add_texel(scene: &mut Scene, texel: [u8; 4], srgb: bool) -> TextureRef {
    scene.images.push(TextureImage { width: 1, height: 1, texels: vec![texel].into() });
    let image = scene.images.len() as u32 - 1;
    let (wrap_u, wrap_v) = (Wrap::Repeat, Wrap::Repeat);
    scene.textures.push(Texture { image, wrap_u, wrap_v, nearest: false, srgb });
    TextureRef { texture: image, uv_set: 0, transform: Affine2::IDENTITY }
}

fn two_sided() -> Material {
    Material { double_sided: true, ..Material::default() }
}

#[test]
fn flat_triangles_face_the_viewer() {
    let scene = triangle(two_sided());
    let front = SurfacePoint::at(&scene, 0, Vec2::new(0.25, 0.5), DOWN);
    assert_eq!(front.position, Vec3::new(0.25, 0.5, 0.0));
    assert!(front.front_face);
    assert_eq!((front.geometric_normal, front.shading_frame.z), (Vec3::Z, Vec3::Z));
    let back = SurfacePoint::at(&scene, 0, CENTRE, UP);
    assert!(!back.front_face);
    assert_eq!((back.geometric_normal, back.shading_frame.z), (-Vec3::Z, -Vec3::Z));
    assert_eq!(back.parameters.base_color, Vec3::ONE);
}

#[test]
fn zero_normals_are_flat_and_others_are_interpolated() {
    let mut scene = triangle(two_sided());
    scene.normals = vec![Vec3::ZERO; 3];
    assert_eq!(SurfacePoint::at(&scene, 0, CENTRE, DOWN).shading_frame.z, Vec3::Z);
    let tilted = Vec3::new(0.6, 0.0, 0.8);
    scene.normals = vec![Vec3::Z, tilted, Vec3::Z];
    let z = SurfacePoint::at(&scene, 0, Vec2::new(0.5, 0.0), DOWN).shading_frame.z;
    assert!((z - (Vec3::Z + tilted).normalize()).length() < 1e-6);
    // The same normals seen from behind, and normals that contradict the winding.
    let back = SurfacePoint::at(&scene, 0, Vec2::new(0.5, 0.0), UP).shading_frame.z;
    assert!((back + z).length() < 1e-6);
    scene.normals.iter_mut().for_each(|n| *n = -*n);
    let contrary = SurfacePoint::at(&scene, 0, Vec2::new(0.5, 0.0), DOWN).shading_frame.z;
    assert!((contrary - z).length() < 1e-6);
}

#[test]
fn normal_maps_use_tangent_handedness_and_scale() {
    let mut scene = triangle(Material { metallic: 0.0, ..two_sided() });
    let map = add_texel(&mut scene, [255, 204, 255, 255], false); // (1, 0.6, 1)
    scene.normals = vec![Vec3::Z; 3];
    scene.materials[0].textures[TextureSlot::Normal as usize] = Some(map.into());
    let normal =
        |scene: &Scene, direction| SurfacePoint::at(scene, 0, CENTRE, direction).shading_frame.z;
    assert_eq!(normal(&scene, DOWN), Vec3::Z, "without tangents there is no map");
    for handedness in [1.0, -1.0] {
        scene.tangents = vec![Vec3::X.extend(handedness); 3];
        let expected = Vec3::new(1.0, 0.6 * handedness, 1.0).normalize();
        assert!((normal(&scene, DOWN) - expected).length() < 1e-6);
        assert!((normal(&scene, UP) + expected).length() < 1e-6);
    }
    scene.materials[0].normal_scale = 0.5;
    let expected = Vec3::new(0.5, -0.3, 1.0).normalize();
    assert!((normal(&scene, DOWN) - expected).length() < 1e-6);
}

#[test]
fn the_coat_has_its_own_normal() {
    let mut scene = triangle(Material { clearcoat: 1.0, ..two_sided() });
    let map = add_texel(&mut scene, [255, 128, 255, 255], false);
    scene.normals = vec![Vec3::Z; 3];
    scene.tangents = vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 3];
    scene.materials[0].textures[TextureSlot::Normal as usize] = Some(map.into());
    let point = SurfacePoint::at(&scene, 0, CENTRE, DOWN);
    let coat = point.shading_frame.world_from_local(point.parameters.clearcoat_normal);
    assert!((coat - Vec3::Z).length() < 1e-6, "{coat}");
    assert!(point.shading_frame.z.x > 0.7);
    scene.materials[0].textures[TextureSlot::Normal as usize] = None;
    scene.materials[0].textures[TextureSlot::ClearcoatNormal as usize] = Some(map.into());
    let point = SurfacePoint::at(&scene, 0, CENTRE, DOWN);
    let coat = point.shading_frame.world_from_local(point.parameters.clearcoat_normal);
    assert!(coat.x > 0.7 && point.shading_frame.z == Vec3::Z, "{coat}");
}

#[test]
fn shading_never_turns_away() {
    let mut random = Random(SplitMix(11));
    let mut scene = triangle(Material { clearcoat: 1.0, ..two_sided() });
    let map = add_texel(&mut scene, [0, 0, 0, 255], false);
    scene.materials[0].textures[TextureSlot::Normal as usize] = Some(map.into());
    let mut bent = 0;
    for _ in 0..20_000 {
        scene.normals = (0..3).map(|_| random.direction()).collect();
        scene.tangents = (0..3).map(|_| random.direction().extend(1.0)).collect();
        let texel = random.next_vec3() * 255.0;
        scene.images[0].texels = vec![[texel.x, texel.y, texel.z].map(|x| x as u8)].into();
        scene.positions = (0..3).map(|_| random.direction()).collect();
        let direction = random.direction();
        let barycentric = random.next_vec2() * 0.5;
        let mirror = SurfacePoint::at(&scene, 0, barycentric, direction);
        let shown =
            2.0 * mirror.shading_frame.z.dot(-direction) * mirror.shading_frame.z + direction;
        assert!(shown.dot(mirror.geometric_normal) > 0.0, "{shown}");
        scene.materials[0].metallic = 0.0;
        let point = SurfacePoint::at(&scene, 0, barycentric, direction);
        scene.materials[0].metallic = 1.0;
        let (wo, frame) = (-direction, point.shading_frame);
        assert!((point.geometric_normal.length() - 1.0).abs() < 1e-5);
        assert!((frame.z.length() - 1.0).abs() < 1e-5, "{}", frame.z);
        assert!(frame.z.dot(wo) > 0.0 && frame.z.dot(point.geometric_normal) > 0.0);
        let coat = frame.world_from_local(point.parameters.clearcoat_normal);
        assert!(coat.dot(wo) > 0.0, "{coat}");
        bent += usize::from(frame.z.dot(wo) < 0.1 * point.geometric_normal.dot(wo));
    }
    assert!(bent > 100, "only {bent} normals needed bending");
}

#[test]
fn degenerate_triangles_have_finite_normals() {
    let mut scene = triangle(two_sided());
    scene.positions = vec![Vec3::ONE; 3];
    scene.normals = vec![Vec3::X, Vec3::NEG_X, Vec3::Y * 1e-30];
    let point = SurfacePoint::at(&scene, 0, Vec2::new(0.5, 0.0), DOWN);
    assert_eq!(point.geometric_normal, Vec3::Z);
    assert!((point.shading_frame.z - Vec3::Z).length() < 1e-6);
}

#[test]
fn the_back_of_a_single_sided_wall_is_shaded_like_its_front() {
    let scene =
        triangle(Material { base_color: Vec4::new(0.2, 0.4, 0.6, 1.0), ..Material::default() });
    let (front, back) =
        (SurfacePoint::at(&scene, 0, CENTRE, DOWN), SurfacePoint::at(&scene, 0, CENTRE, UP));
    assert!(front.front_face && !back.front_face);
    assert_eq!(front.parameters, back.parameters);
    assert_eq!(front.geometric_normal, -back.geometric_normal);
}

#[test]
fn factors_textures_and_vertex_colours_multiply() {
    let mut scene = triangle(Material {
        base_color: Vec4::new(0.5, 1.0, 1.0, 0.8),
        alpha_mode: AlphaMode::Blend,
        metallic: 0.5,
        roughness: 0.5,
        emissive: Vec3::splat(4.0),
        ..two_sided()
    });
    let base = add_texel(&mut scene, [255, 188, 255, 128], true);
    let packed = add_texel(&mut scene, [9, 51, 102, 9], false);
    scene.colors = vec![Vec4::new(1.0, 1.0, 0.25, 0.5); 3];
    scene.materials[0].textures[TextureSlot::BaseColor as usize] = Some(base.into());
    scene.materials[0].textures[TextureSlot::MetallicRoughness as usize] = Some(packed.into());
    scene.materials[0].textures[TextureSlot::Emissive as usize] = Some(base.into());
    let p = SurfacePoint::at(&scene, 0, CENTRE, DOWN).parameters;
    assert!((p.base_color - Vec3::new(0.5, 0.503, 0.25)).abs().max_element() < 1e-3);
    assert!((p.alpha - 0.8 * 128.0 / 255.0 * 0.5).abs() < 1e-6);
    assert!((p.roughness - 0.1).abs() < 1e-6 && (p.metallic - 0.2).abs() < 1e-6);
    assert!((p.emissive - Vec3::new(4.0, 2.0115, 4.0)).abs().max_element() < 1e-3);
    assert_eq!(p.alpha, alpha_at(&scene, 0, CENTRE));
}

#[test]
fn alpha_follows_its_mode() {
    let with = |alpha, alpha_mode| {
        let base_color = Vec4::new(1.0, 1.0, 1.0, alpha);
        alpha_at(&triangle(Material { base_color, alpha_mode, ..two_sided() }), 0, CENTRE)
    };
    assert_eq!(with(0.3, AlphaMode::Opaque), 1.0);
    assert_eq!(with(0.3, AlphaMode::Blend), 0.3);
    assert_eq!(with(0.3, AlphaMode::Mask { cutoff: 0.5 }), 0.0);
    assert_eq!(with(0.5, AlphaMode::Mask { cutoff: 0.5 }), 1.0);
}

#[test]
fn volumes_absorb_to_their_colour_over_their_distance() {
    let color = Vec3::new(0.25, 1.0, 0.0);
    let mut scene = triangle(Material {
        transmission: 1.0,
        thickness: 1.0,
        attenuation_color: color,
        attenuation_distance: 0.2,
        ..two_sided()
    });
    let p = SurfacePoint::at(&scene, 0, CENTRE, DOWN).parameters;
    assert!(!p.thin);
    let left = (-p.absorption * 0.2).exp();
    assert!((left - color).abs().max_element() < 1e-5, "{left}");
    scene.materials[0].thickness = 0.0;
    let p = SurfacePoint::at(&scene, 0, CENTRE, DOWN).parameters;
    assert!(p.thin && p.absorption == Vec3::ZERO);
}

#[test]
fn unlit_surfaces_emit_their_base_colour() {
    let base_color = Vec4::new(0.1, 0.2, 0.3, 1.0);
    let scene = triangle(Material { unlit: true, base_color, ..two_sided() });
    let p = SurfacePoint::at(&scene, 0, CENTRE, DOWN).parameters;
    assert!(p.unlit);
    assert_eq!(p.emissive, Vec3::new(0.1, 0.2, 0.3));
}
