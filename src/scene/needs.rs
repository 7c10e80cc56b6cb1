//! What a scene needs of the renderer, asked once.

use glam::Vec3;
use serde::Serialize;

use super::{AlphaMode, Material, Scene};

/// Features a scene uses; what is `false` here is neither evaluated nor, on a GPU, compiled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct SceneNeeds {
    /// Any texture at all.
    pub textures: bool,
    /// Bit `i`: some material has the `i`-th of [`Material::textures`].
    pub texture_slots: u32,
    /// A second set of texture coordinates.
    pub second_uv_set: bool,
    /// Normal maps, hence tangents.
    pub normal_maps: bool,
    /// Vertex colours.
    pub vertex_colors: bool,
    /// Surfaces cut out by an alpha threshold.
    pub alpha_mask: bool,
    /// Surfaces with partial opacity.
    pub alpha_blend: bool,
    /// Single-sided surfaces, which camera rays pass from behind.
    pub single_sided: bool,
    /// Metals.
    pub metals: bool,
    /// Thin-walled transmission.
    pub thin_transmission: bool,
    /// Light that enters solid bodies.
    pub solid_transmission: bool,
    /// Light that comes through diffusely.
    pub diffuse_transmission: bool,
    /// Absorption inside solid bodies.
    pub absorption: bool,
    /// A medium between surfaces.
    pub medium: bool,
    /// Scattering inside solid bodies.
    pub scattering_solids: bool,
    /// Reflections that are wider in one direction.
    pub anisotropy: bool,
    /// Sheen.
    pub sheen: bool,
    /// Thin films on surfaces.
    pub iridescence: bool,
    /// Solids that bend colours differently.
    pub dispersion: bool,
    /// Clearcoat.
    pub clearcoat: bool,
    /// Unlit surfaces.
    pub unlit: bool,
    /// Emissive triangles.
    pub emitters: bool,
    /// Point, spot or directional lights.
    pub punctual_lights: bool,
}

impl SceneNeeds {
    /// Looks at every material that a triangle uses.
    pub fn of(scene: &Scene) -> Self {
        let mut used = vec![false; scene.materials.len()];
        for &material in &scene.triangle_materials {
            used[material as usize] = true;
        }
        let mut needs = Self {
            vertex_colors: !scene.colors.is_empty(),
            punctual_lights: !scene.lights.is_empty(),
            medium: scene.medium.is_some(),
            ..Self::default()
        };
        for (material, _) in scene.materials.iter().zip(used).filter(|(_, used)| *used) {
            needs.add(material);
        }
        needs
    }

    fn add(&mut self, m: &Material) {
        for (slot, texture) in m.textures().into_iter().enumerate() {
            if let Some(texture) = texture {
                self.textures = true;
                self.texture_slots |= 1 << slot;
                self.second_uv_set |= texture.uv_set == 1;
            }
        }
        self.normal_maps |= m.normal_texture.is_some() || m.clearcoat_normal_texture.is_some();
        self.alpha_mask |= matches!(m.alpha_mode, AlphaMode::Mask { .. });
        self.alpha_blend |= m.alpha_mode == AlphaMode::Blend;
        self.single_sided |= !m.double_sided;
        self.metals |= m.metallic > 0.0;
        self.thin_transmission |= m.transmission > 0.0 && m.thickness == 0.0;
        self.diffuse_transmission |= m.diffuse_transmission > 0.0;
        let has_inside =
            (m.transmission > 0.0 || m.diffuse_transmission > 0.0) && m.thickness > 0.0;
        self.solid_transmission |= has_inside;
        self.absorption |= has_inside && m.attenuation_distance.is_finite();
        self.scattering_solids |= has_inside && m.scattering != Vec3::ZERO;
        self.anisotropy |= m.anisotropy > 0.0;
        self.sheen |= m.sheen_color != Vec3::ZERO;
        self.iridescence |= m.iridescence > 0.0;
        self.dispersion |= m.dispersion > 0.0 && m.transmission > 0.0 && m.thickness > 0.0;
        self.clearcoat |= m.clearcoat > 0.0;
        self.unlit |= m.unlit;
        self.emitters |= is_emitter(m);
    }

    /// Whether a ray may pass a surface without being scattered.
    pub fn pass_through(&self) -> bool {
        self.alpha_mask || self.alpha_blend || self.thin_transmission
    }

    /// What the renderer leaves out, each with the reason.
    pub fn left_out(&self) -> Vec<String> {
        [
            (self.textures, "texture reads: no material has a texture"),
            (self.normal_maps, "tangent frames: no material has a normal map"),
            (self.second_uv_set, "the second set of texture coordinates: no texture uses it"),
            (self.vertex_colors, "vertex colours: no mesh has them"),
            (self.alpha_mask, "alpha tests: no material is masked"),
            (self.alpha_blend, "opacity along rays: no material is blended"),
            (self.thin_transmission, "thin glass: no material transmits without volume"),
            (self.solid_transmission, "refraction: no material is a transmitting solid"),
            (self.diffuse_transmission, "diffuse transmission: no material has it"),
            (self.absorption, "absorption: no solid absorbs"),
            (self.medium, "fog: the scene has none"),
            (self.scattering_solids, "scattering inside of solids: none is filled"),
            (self.anisotropy, "anisotropy: no material has a direction"),
            (self.sheen, "sheen: no material has it"),
            (self.iridescence, "iridescence: no material has a film"),
            (self.dispersion, "dispersion: no solid bends colours differently"),
            (self.clearcoat, "clearcoat: no material is coated"),
            (self.emitters, "sampling of emissive triangles: nothing emits"),
            (self.punctual_lights, "punctual lights: the scene has none"),
        ]
        .into_iter()
        .filter(|(needed, _)| !needed)
        .map(|(_, sentence)| sentence.to_owned())
        .collect()
    }
}

/// Whether triangles of this material are light sources.
pub fn is_emitter(material: &Material) -> bool {
    !material.unlit && material.emissive.max_element() > 0.0
}
