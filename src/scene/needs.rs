//! What a scene needs of the renderer, asked once.

use std::collections::BTreeMap;

use glam::Vec3;

use super::{AlphaMode, Material, Scene};
use crate::features::Features;

/// What a scene uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SceneNeeds {
    /// Features of scenes alone.
    pub features: Features,
    /// Bit `i`: some material has the `i`-th of [`Material::textures`].
    pub texture_slots: u32,
}

/// A feature of scenes, what it is called, and what is left out without it, with the reason.
const WORDS: [(Features, &str, Option<&str>); 24] = [
    (Features::TEXTURES, "Textures", Some("texture reads: no material has a texture")),
    (Features::NORMAL_MAPS, "Normal maps", Some("tangent frames: no material has a normal map")),
    (
        Features::SECOND_UV_SET,
        "A second set of texture coordinates",
        Some("the second set of texture coordinates: no texture uses it"),
    ),
    (Features::VERTEX_COLORS, "Vertex colours", Some("vertex colours: no mesh has them")),
    (Features::ALPHA_MASK, "Alpha tests", Some("alpha tests: no material is masked")),
    (
        Features::ALPHA_BLEND,
        "Opacity along rays",
        Some("opacity along rays: no material is blended"),
    ),
    (Features::SINGLE_SIDED, "Single-sided surfaces", None),
    (Features::METALS, "Metals", None),
    (
        Features::THIN_TRANSMISSION,
        "Thin glass",
        Some("thin glass: no material transmits without volume"),
    ),
    (
        Features::SOLID_TRANSMISSION,
        "Refraction",
        Some("refraction: no material is a transmitting solid"),
    ),
    (
        Features::DIFFUSE_TRANSMISSION,
        "Diffuse transmission",
        Some("diffuse transmission: no material has it"),
    ),
    (Features::ABSORPTION, "Absorption", Some("absorption: no solid absorbs")),
    (Features::FOG, "Fog", Some("fog: the scene has none")),
    (
        Features::SCATTERING_SOLIDS,
        "Scattering inside of solids",
        Some("scattering inside of solids: none is filled"),
    ),
    (Features::ANISOTROPY, "Anisotropy", Some("anisotropy: no material has a direction")),
    (Features::SHEEN, "Sheen", Some("sheen: no material has it")),
    (Features::IRIDESCENCE, "Iridescence", Some("iridescence: no material has a film")),
    (Features::DISPERSION, "Dispersion", Some("dispersion: no solid bends colours differently")),
    (Features::CLEARCOAT, "Clearcoat", Some("clearcoat: no material is coated")),
    (Features::UNLIT, "Unlit surfaces", None),
    (
        Features::EMITTERS,
        "Emissive triangles",
        Some("sampling of emissive triangles: nothing emits"),
    ),
    (
        Features::PUNCTUAL_LIGHTS,
        "Point, spot or directional lights",
        Some("punctual lights: the scene has none"),
    ),
    (Features::COATED_EMITTERS, "Emissive triangles under a clearcoat", None),
    (Features::INSTANCES, "Meshes shared by instances", None),
];

impl SceneNeeds {
    /// Looks at every material that a triangle uses.
    pub fn of(scene: &Scene) -> Self {
        let mut used = vec![false; scene.materials.len()];
        for &material in &scene.triangle_materials {
            used[material as usize] = true;
        }
        let mut needs = Self::default();
        needs.features.set(Features::VERTEX_COLORS, !scene.colors.is_empty());
        needs.features.set(Features::PUNCTUAL_LIGHTS, !scene.lights.is_empty());
        needs.features.set(Features::FOG, scene.medium.is_some());
        needs.features.set(Features::INSTANCES, !scene.instances.is_empty());
        for (material, _) in scene.materials.iter().zip(used).filter(|(_, used)| *used) {
            needs.add(material);
        }
        needs
    }

    fn add(&mut self, m: &Material) {
        let Self { features, texture_slots } = self;
        for (slot, texture) in m.textures.iter().enumerate() {
            if let Some(texture) = texture {
                *features |= Features::TEXTURES;
                *features |= Features::SECOND_UV_SET.only_if(texture.uv_set == 1);
                *texture_slots |= 1 << slot;
            }
        }
        let has_inside =
            (m.transmission > 0.0 || m.diffuse_transmission > 0.0) && m.thickness > 0.0;
        for (feature, is_needed) in [
            (Features::NORMAL_MAPS, m.has_normal_map()),
            (Features::ALPHA_MASK, matches!(m.alpha_mode, AlphaMode::Mask { .. })),
            (Features::ALPHA_BLEND, m.alpha_mode == AlphaMode::Blend),
            (Features::SINGLE_SIDED, !m.double_sided),
            (Features::METALS, m.metallic > 0.0),
            (Features::THIN_TRANSMISSION, m.transmission > 0.0 && m.thickness == 0.0),
            (Features::DIFFUSE_TRANSMISSION, m.diffuse_transmission > 0.0),
            (Features::SOLID_TRANSMISSION, has_inside),
            (Features::ABSORPTION, has_inside && m.attenuation_distance.is_finite()),
            (Features::SCATTERING_SOLIDS, has_inside && m.scattering != Vec3::ZERO),
            (Features::ANISOTROPY, m.anisotropy > 0.0),
            (Features::SHEEN, m.sheen_color != Vec3::ZERO),
            (Features::IRIDESCENCE, m.iridescence > 0.0),
            (Features::DISPERSION, m.dispersion > 0.0 && m.transmission > 0.0 && m.thickness > 0.0),
            (Features::CLEARCOAT, m.clearcoat > 0.0),
            (Features::UNLIT, m.unlit),
            (Features::EMITTERS, is_emitter(m)),
            (Features::COATED_EMITTERS, is_emitter(m) && m.clearcoat > 0.0),
        ] {
            *features |= feature.only_if(is_needed);
        }
    }

    /// Whether all of these are needed.
    pub fn has(&self, features: Features) -> bool {
        self.features.contains(features)
    }

    /// Whether a ray may pass a surface without being scattered.
    pub fn pass_through(&self) -> bool {
        let passed = Features::ALPHA_MASK | Features::ALPHA_BLEND | Features::THIN_TRANSMISSION;
        self.features.intersects(passed)
    }

    /// What the scene uses, in words.
    pub fn used(&self) -> impl Iterator<Item = &'static str> {
        WORDS.iter().filter(|(feature, ..)| self.has(*feature)).map(|(_, name, _)| *name)
    }

    /// What the renderer leaves out, each with the reason.
    pub fn left_out(&self) -> impl Iterator<Item = &'static str> {
        WORDS.iter().filter(|(feature, ..)| !self.has(*feature)).filter_map(|(.., words)| *words)
    }

    /// Whether each feature of scenes is needed, by name.
    pub fn by_name(&self) -> BTreeMap<String, bool> {
        let all = WORDS.iter().fold(Features::empty(), |all, (feature, ..)| all | *feature);
        all.iter_names().map(|(name, feature)| (name.to_lowercase(), self.has(feature))).collect()
    }
}

/// Whether triangles of this material are light sources.
pub fn is_emitter(material: &Material) -> bool {
    !material.unlit && material.emissive.max_element() > 0.0
}
