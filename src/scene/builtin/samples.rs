//! A tray of spheres: two rows, one material feature each.

use glam::{Vec2, Vec3};

use super::materials::{glass, matte, metal, textured, two_sided, varnished};
use super::mesh::Builder;
use super::textures as paint;
use crate::scene::{AlphaMode, Material, Scene};

const RADIUS: f32 = 0.42;
const SPACING: f32 = 1.02;

/// Builds the scene.
pub(super) fn build() -> Scene {
    let b = &mut Builder::new("materials");
    let paving = b.texture(paint::stones([0.55, 0.53, 0.50], 4, 4, 0.012), Vec2::splat(2.4));
    let ground = b.material(textured("paving", paving, 0.8));
    let step = b.material(matte("step", [0.42, 0.40, 0.38], 0.7));
    b.quad(ground, Vec3::new(-20.0, 0.0, 20.0), Vec3::X * 40.0, Vec3::NEG_Z * 40.0);
    b.slab(step, [-3.2, -0.1, -2.2], [3.2, 0.45, -0.95], 0.02);
    for (materials, height, z) in [(front(), 0.0, 0.0), (back(), 0.45, -1.55)] {
        let middle = 0.5 * (materials.len() - 1) as f32;
        for (i, material) in materials.into_iter().enumerate() {
            let mat = b.material(material);
            let centre = Vec3::new((i as f32 - middle) * SPACING, height + RADIUS + 2e-3, z);
            b.blob(mat, centre, Vec3::splat(RADIUS), [2.0, 2.0], 32);
        }
    }
    b.camera("tray", [0.0, 2.3, 5.6], [0.0, 0.55, -0.7], 33.0);
    let mut scene = std::mem::replace(b, Builder::new("")).finish();
    // Brushed around the vertical.
    let around = |n: &Vec3| Vec3::Y.cross(*n).normalize_or(Vec3::X).extend(1.0);
    scene.tangents = scene.normals.iter().map(around).collect();
    scene
}

/// What is on the surface.
fn front() -> [Material; 6] {
    let red = matte("lacquer", [0.45, 0.03, 0.03], 0.6);
    [
        matte("plastic", [0.08, 0.22, 0.45], 0.3),
        varnished(red, 1.0, 0.03),
        Material { anisotropy: 0.85, ..metal("brushed copper", [0.90, 0.56, 0.42], 0.25) },
        Material {
            sheen_color: Vec3::new(0.75, 0.45, 0.55),
            sheen_roughness: 0.35,
            ..matte("velvet", [0.16, 0.01, 0.04], 0.9)
        },
        Material {
            iridescence: 1.0,
            iridescence_ior: 1.8,
            iridescence_thickness: [0.0, 380.0],
            ..metal("anodised titanium", [0.54, 0.50, 0.45], 0.15)
        },
        Material {
            alpha_mode: AlphaMode::Blend,
            base_color: Vec3::new(0.2, 0.5, 0.2).extend(0.45),
            ..two_sided(matte("veil", [0.0; 3], 0.8))
        },
    ]
}

/// What lets light through.
fn back() -> [Material; 6] {
    let solid = |name: &str, roughness: f32| Material {
        transmission: 1.0,
        thickness: 2.0 * RADIUS,
        ..matte(name, [1.0; 3], roughness)
    };
    [
        Material {
            iridescence: 1.0,
            iridescence_ior: 1.33,
            iridescence_thickness: [0.0, 480.0],
            ..glass("soap bubble", [1.0; 3])
        },
        Material { roughness: 0.25, ..glass("frosted pane", [0.85, 0.95, 1.0]) },
        Material {
            attenuation_color: Vec3::new(0.35, 0.75, 0.55),
            attenuation_distance: 0.6,
            ..solid("rough green glass", 0.25)
        },
        Material { ior: 1.7, dispersion: 4.0, ..solid("flint glass", 0.0) },
        Material {
            diffuse_transmission: 0.7,
            diffuse_transmission_color: Vec3::new(0.95, 0.75, 0.45),
            ..two_sided(matte("paper lantern", [0.85, 0.8, 0.7], 0.9))
        },
        Material {
            diffuse_transmission: 1.0,
            thickness: 2.0 * RADIUS,
            attenuation_color: Vec3::new(0.9, 0.45, 0.15),
            attenuation_distance: 0.5,
            scattering: Vec3::splat(12.0),
            ..matte("wax", [0.9, 0.85, 0.75], 0.5)
        },
    ]
}
