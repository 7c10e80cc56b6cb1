//! What a scene needs of the renderer, asked once.

use std::collections::BTreeMap;

use glam::Vec3;

use super::{AlphaMode, Material, Scene, surface};

use SceneFeatures as S;

bitflags::bitflags! {
    /// What a scene uses: what it does without is neither evaluated nor, on a GPU, compiled.
    #[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
    pub struct SceneFeatures: u64 {
        /// Any texture at all.
        const TEXTURES = 1 << 0;
        /// A second set of texture coordinates.
        const SECOND_UV_SET = 1 << 1;
        /// Normal maps, hence tangents.
        const NORMAL_MAPS = 1 << 2;
        /// Vertex colours.
        const VERTEX_COLORS = 1 << 3;
        /// Surfaces cut out by an alpha threshold.
        const ALPHA_MASK = 1 << 4;
        /// Surfaces with partial opacity.
        const ALPHA_BLEND = 1 << 5;
        /// Single-sided surfaces, which camera rays pass from behind.
        const SINGLE_SIDED = 1 << 6;
        /// Metals.
        const METALS = 1 << 7;
        /// Thin-walled transmission.
        const THIN_TRANSMISSION = 1 << 8;
        /// Light that enters solid bodies.
        const SOLID_TRANSMISSION = 1 << 9;
        /// Light that comes through diffusely.
        const DIFFUSE_TRANSMISSION = 1 << 10;
        /// Absorption inside solid bodies.
        const ABSORPTION = 1 << 11;
        /// A medium of the scene's own between surfaces.
        const FOG = 1 << 12;
        /// Scattering inside solid bodies.
        const SCATTERING_SOLIDS = 1 << 13;
        /// Reflections that are wider in one direction.
        const ANISOTROPY = 1 << 14;
        /// Sheen.
        const SHEEN = 1 << 15;
        /// Thin films on surfaces.
        const IRIDESCENCE = 1 << 16;
        /// Solids that bend colours differently.
        const DISPERSION = 1 << 17;
        /// Clearcoat.
        const CLEARCOAT = 1 << 18;
        /// Unlit surfaces.
        const UNLIT = 1 << 19;
        /// Emissive triangles.
        const EMITTERS = 1 << 20;
        /// Point, spot or directional lights.
        const PUNCTUAL_LIGHTS = 1 << 21;
        /// Emissive triangles under a clearcoat.
        const COATED_EMITTERS = 1 << 22;
        /// Meshes that instances share.
        const INSTANCES = 1 << 23;
        /// Metals that are no mirrors: their microfacets scatter light more than once.
        const ROUGH_METALS = 1 << 24;
        /// Glass that spreads what it lets through, likewise.
        const ROUGH_GLASS = 1 << 25;
        /// Solids of smooth glass, whose refraction shadow rays follow.
        const CLEAR_SOLIDS = 1 << 26;
        /// Surfaces that may reflect or refract perfectly.
        const PERFECT_INTERFACES = 1 << 27;
        /// Single-sided surfaces that all rays pass from behind.
        const BACKED = 1 << 28;
        /// Opaque triangles that stand for a smooth surface ([`super::surface::SurfacePoint::lift`]).
        const LIFTED = 1 << 29;
        /// Surfaces that may have narrow reflections beside broad ones: polish and varnish.
        const POLISH = 1 << 30;
        /// Emissive triangles that light may pass straight on.
        const SHEER_EMITTERS = 1 << 31;
    }
}

impl SceneFeatures {
    /// Whether a ray may pass a surface without being scattered.
    pub fn pass_through(self) -> bool {
        let may_pass =
            Self::ALPHA_MASK | Self::ALPHA_BLEND | Self::BACKED | Self::THIN_TRANSMISSION;
        self.intersects(may_pass)
    }
}

/// The name of each flag there is, and whether it is set.
pub(crate) fn flags_by_name<F: bitflags::Flags + Copy>(
    flags: F,
) -> impl Iterator<Item = (&'static str, bool)> {
    F::FLAGS.iter().map(move |flag| (flag.name(), flags.contains(*flag.value())))
}

/// What a scene uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SceneNeeds {
    /// Features of scenes alone.
    pub features: SceneFeatures,
    /// Bit `i`: some material has the `i`-th of [`Material::textures`].
    pub texture_slots: u32,
}

/// A feature of scenes, what it is called, and what is left out without it, with the reason.
const WORDS: [(S, &str, Option<&str>); 28] = [
    (S::TEXTURES, "Textures", Some("texture reads: no material has a texture")),
    (S::NORMAL_MAPS, "Normal maps", Some("tangent frames: no material has a normal map")),
    (
        S::SECOND_UV_SET,
        "A second set of texture coordinates",
        Some("the second set of texture coordinates: no texture uses it"),
    ),
    (S::VERTEX_COLORS, "Vertex colours", Some("vertex colours: no mesh has them")),
    (S::ALPHA_MASK, "Alpha tests", Some("alpha tests: no material is masked")),
    (S::ALPHA_BLEND, "Opacity along rays", Some("opacity along rays: no material is blended")),
    (S::SINGLE_SIDED, "Single-sided surfaces", None),
    (S::BACKED, "Faces in pairs, front and back", None),
    (S::METALS, "Metals", None),
    (S::THIN_TRANSMISSION, "Thin glass", Some("thin glass: no material transmits without volume")),
    (S::SOLID_TRANSMISSION, "Refraction", Some("refraction: no material is a transmitting solid")),
    (
        S::DIFFUSE_TRANSMISSION,
        "Diffuse transmission",
        Some("diffuse transmission: no material has it"),
    ),
    (S::ABSORPTION, "Absorption", Some("absorption: no solid absorbs")),
    (S::FOG, "Fog", Some("fog: the scene has none")),
    (
        S::SCATTERING_SOLIDS,
        "Scattering inside of solids",
        Some("scattering inside of solids: none is filled"),
    ),
    (S::ANISOTROPY, "Anisotropy", Some("anisotropy: no material has a direction")),
    (S::SHEEN, "Sheen", Some("sheen: no material has it")),
    (S::IRIDESCENCE, "Iridescence", Some("iridescence: no material has a film")),
    (S::DISPERSION, "Dispersion", Some("dispersion: no solid bends colours differently")),
    (S::CLEARCOAT, "Clearcoat", Some("clearcoat: no material is coated")),
    (S::UNLIT, "Unlit surfaces", None),
    (S::EMITTERS, "Emissive triangles", Some("sampling of emissive triangles: nothing emits")),
    (
        S::PUNCTUAL_LIGHTS,
        "Point, spot or directional lights",
        Some("punctual lights: the scene has none"),
    ),
    (S::COATED_EMITTERS, "Emissive triangles under a clearcoat", None),
    (S::INSTANCES, "Meshes shared by instances", None),
    (
        S::ROUGH_METALS,
        "Multiple scattering of rough metal",
        Some("multiple scattering of metal: no metal is rough"),
    ),
    (
        S::ROUGH_GLASS,
        "Multiple scattering of rough glass",
        Some("multiple scattering of glass: no glass is rough"),
    ),
    (
        S::LIFTED,
        "Smooth surfaces above their triangles",
        Some("smooth surfaces above triangles: every opaque triangle is as flat as its normals"),
    ),
];

impl SceneNeeds {
    /// Looks at every material that a triangle uses.
    pub fn of(scene: &Scene) -> Self {
        let mut used = vec![false; scene.materials.len()];
        for &material in &scene.triangle_materials {
            used[material as usize] = true;
        }
        let mut needs = Self::default();
        needs.features.set(S::VERTEX_COLORS, !scene.colors.is_empty());
        needs.features.set(S::PUNCTUAL_LIGHTS, !scene.lights.is_empty());
        needs.features.set(S::FOG, scene.medium.is_some());
        needs.features.set(S::INSTANCES, !scene.instances.is_empty());
        needs.features.set(S::LIFTED, surface::lifts(scene));
        for (material, _) in scene.materials.iter().zip(used).filter(|(_, used)| *used) {
            needs.add(material);
        }
        needs
    }

    fn add(&mut self, m: &Material) {
        let Self { features, texture_slots } = self;
        for (slot, _) in m.textures.iter().enumerate().filter(|(_, texture)| texture.is_some()) {
            *texture_slots |= 1 << slot;
        }
        let has_inside = m.has_inside();
        let is_rough = m.roughness > 0.0 || m.anisotropy > 0.0;
        let is_opaque = m.alpha_mode == AlphaMode::Opaque;
        for (feature, is_needed) in [
            (S::TEXTURES, m.textures.iter().any(Option::is_some)),
            (S::SECOND_UV_SET, m.textures.iter().flatten().any(|texture| texture.uv_set == 1)),
            (S::NORMAL_MAPS, m.has_normal_map()),
            (S::ALPHA_MASK, matches!(m.alpha_mode, AlphaMode::Mask { .. })),
            (S::ALPHA_BLEND, m.alpha_mode == AlphaMode::Blend),
            (S::SINGLE_SIDED, !m.double_sided),
            (S::BACKED, m.backed),
            (S::METALS, m.metallic > 0.0),
            (S::THIN_TRANSMISSION, m.transmission > 0.0 && m.thickness == 0.0),
            (S::DIFFUSE_TRANSMISSION, m.diffuse_transmission > 0.0),
            (S::SOLID_TRANSMISSION, has_inside),
            (S::ABSORPTION, has_inside && m.attenuation_distance.is_finite()),
            (S::SCATTERING_SOLIDS, has_inside && m.scattering != Vec3::ZERO),
            (S::ANISOTROPY, m.anisotropy > 0.0),
            (S::SHEEN, m.sheen_color != Vec3::ZERO),
            (S::IRIDESCENCE, m.iridescence > 0.0),
            (S::DISPERSION, m.dispersion > 0.0 && m.transmission > 0.0 && m.thickness > 0.0),
            (S::CLEARCOAT, m.clearcoat > 0.0),
            (S::UNLIT, m.unlit),
            (S::EMITTERS, is_emitter(m)),
            (S::COATED_EMITTERS, is_emitter(m) && m.clearcoat > 0.0),
            (S::SHEER_EMITTERS, is_emitter(m) && (m.transmission > 0.0 || !is_opaque)),
            (S::ROUGH_METALS, is_rough && (m.metallic > 0.0 || m.ior == 0.0)),
            (S::ROUGH_GLASS, is_rough && m.transmission > 0.0),
            (S::CLEAR_SOLIDS, m.is_clear_solid()),
            (S::PERFECT_INTERFACES, m.may_be_smooth()),
            (S::POLISH, m.may_be_polished()),
        ] {
            features.set(feature, is_needed || features.contains(feature));
        }
    }

    /// Whether all of these are needed.
    pub fn has(&self, features: SceneFeatures) -> bool {
        self.features.contains(features)
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
        flags_by_name(self.features).map(|(name, needed)| (name.to_lowercase(), needed)).collect()
    }
}

/// Whether triangles of this material are light sources.
pub fn is_emitter(material: &Material) -> bool {
    !material.unlit && material.emissive.max_element() > 0.0
}
