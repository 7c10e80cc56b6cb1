//! Materials and textures.

use glam::{Affine2, Vec3, Vec4};

use crate::image::Texels;

/// How a surface's coverage is used (glTF `alphaMode`).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum AlphaMode {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// Covered where alpha is at least the cutoff, absent elsewhere.
    Mask {
        /// Alpha threshold in `[0,1]`.
        cutoff: f32,
    },
    /// Alpha is opacity along rays.
    Blend,
}

/// A texture with the coordinates it is read at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TextureRef {
    /// Index into [`Scene::textures`](crate::scene::Scene::textures).
    pub texture: u32,
    /// Which of [`Scene::uvs`](crate::scene::Scene::uvs).
    pub uv_set: u8,
    /// `KHR_texture_transform`, texture coordinates from mesh coordinates.
    pub transform: Affine2,
}

/// What a texture of a material varies, in the order in which `shaders/surface.wgsl` numbers them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TextureSlot {
    /// RGB is base colour (sRGB), A is alpha.
    BaseColor,
    /// G is roughness, B is metalness.
    MetallicRoughness,
    /// Tangent-space normal map.
    Normal,
    /// RGB multiplies [`Material::emissive`] (sRGB).
    Emissive,
    /// A multiplies [`Material::specular`].
    Specular,
    /// RGB multiplies [`Material::specular_color`] (sRGB).
    SpecularColor,
    /// R multiplies [`Material::transmission`].
    Transmission,
    /// R multiplies [`Material::clearcoat`].
    Clearcoat,
    /// G multiplies [`Material::clearcoat_roughness`].
    ClearcoatRoughness,
    /// Normal map of the coat; without one the coat follows the geometric shading normal.
    ClearcoatNormal,
    /// RG is the direction before rotation in `[-1,1]`, along tangent and bitangent; B multiplies
    /// [`Material::anisotropy`].
    Anisotropy,
    /// RGB multiplies [`Material::sheen_color`] (sRGB).
    SheenColor,
    /// A multiplies [`Material::sheen_roughness`].
    SheenRoughness,
    /// A multiplies [`Material::diffuse_transmission`].
    DiffuseTransmission,
    /// RGB multiplies [`Material::diffuse_transmission_color`] (sRGB).
    DiffuseTransmissionColor,
    /// R multiplies [`Material::iridescence`].
    Iridescence,
    /// G says where between the two of [`Material::iridescence_thickness`] the thickness lies.
    IridescenceThickness,
}

/// Roughness up to which reflections are perfect, whatever evaluates them.
const MAX_SMOOTH_ROUGHNESS: f32 = 0.03;
/// Roughness from which none are.
const MIN_ROUGHNESS: f32 = 0.035;
/// Roughness from which no reflection is too narrow to be shared or cached.
pub(crate) const MAX_POLISH_ROUGHNESS: f32 = 0.2237;

with_defaults! {
    /// glTF metallic-roughness material with the extensions lightgrid renders. Factors are linear. Textures, of
    /// which most materials have few or none, are boxed: a file may have a million materials.
    ///
    /// The default is glTF's: white, metallic 1, roughness 1 are its factor defaults.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Material {
        /// Name in the file, for messages and overlays.
        pub name: String = String::new(),
        /// Base colour factor, linear RGB and alpha.
        pub base_color: Vec4 = Vec4::ONE,
        /// Metalness in `[0,1]`.
        pub metallic: f32 = 1.0,
        /// Perceptual roughness in `[0,1]`; GGX alpha is its square.
        pub roughness: f32 = 1.0,
        /// Scale of the normal map's x and y; finite, of any sign, 1 is the map as it is.
        pub normal_scale: f32 = 1.0,
        /// Emitted radiance, linear, `KHR_materials_emissive_strength` included.
        pub emissive: Vec3 = Vec3::ZERO,
        /// How alpha is used.
        pub alpha_mode: AlphaMode = AlphaMode::Opaque,
        /// Whether camera rays see the back too. All other rays meet both sides of every surface: a wall
        /// modelled single-sided does not leak light.
        pub double_sided: bool = false,
        /// Another single-sided surface lies in the same place and faces the other way: all rays pass this one
        /// from behind.
        pub backed: bool = false,
        /// `KHR_materials_unlit`: base colour is emitted as it is, nothing is reflected.
        pub unlit: bool = false,
        /// `KHR_materials_ior`; 0 means infinitely high (F0 = 1), otherwise at least 1.
        pub ior: f32 = 1.5,
        /// `KHR_materials_specular` strength in `[0,1]`.
        pub specular: f32 = 1.0,
        /// F0 tint, linear.
        pub specular_color: Vec3 = Vec3::ONE,
        /// `KHR_materials_transmission` in `[0,1]`.
        pub transmission: f32 = 0.0,
        /// `KHR_materials_diffuse_transmission`: share in `[0,1]` of the body's light that comes through
        /// instead of back.
        pub diffuse_transmission: f32 = 0.0,
        /// Colour of what comes through, linear, in `[0,1]`.
        pub diffuse_transmission_color: Vec3 = Vec3::ONE,
        /// `KHR_materials_volume` thickness in the mesh's units, not negative. Only whether it is 0 counts: 0 is a
        /// thin wall, more is a solid body with an inside.
        pub thickness: f32 = 0.0,
        /// Colour that white light becomes after `attenuation_distance` inside the body, linear, in `[0,1]`.
        pub attenuation_color: Vec3 = Vec3::ONE,
        /// Metres, above 0; infinite is no absorption.
        pub attenuation_distance: f32 = f32::INFINITY,
        /// Scattering coefficient per metre inside the body, linear RGB, not negative.
        pub scattering: Vec3 = Vec3::ZERO,
        /// Mean cosine of scattering inside the body, as [`Medium::anisotropy`](crate::scene::Medium::anisotropy).
        pub scatter_anisotropy: f32 = 0.0,
        /// `KHR_materials_anisotropy` strength in `[0,1]`: how much wider reflections are along the
        /// direction below than `roughness` says; 1 is as wide as roughness 1.
        pub anisotropy: f32 = 0.0,
        /// Direction of that width in radians from the tangent, counter-clockwise.
        pub anisotropy_rotation: f32 = 0.0,
        /// `KHR_materials_iridescence`: share in `[0,1]` of the surface that a thin film covers.
        pub iridescence: f32 = 0.0,
        /// Index of refraction of the film, at least 1.
        pub iridescence_ior: f32 = 1.3,
        /// Thickness of the film in nanometres where its texture is 0 and where it is 1; without a
        /// texture it is the second.
        pub iridescence_thickness: [f32; 2] = [100.0, 400.0],
        /// `KHR_materials_dispersion`: 20 over the Abbe number of a solid body, not negative; 0 bends all
        /// colours alike.
        pub dispersion: f32 = 0.0,
        /// `KHR_materials_sheen` colour, linear, in `[0,1]`; black is none.
        pub sheen_color: Vec3 = Vec3::ZERO,
        /// Perceptual roughness of the sheen in `[0,1]`.
        pub sheen_roughness: f32 = 0.0,
        /// `KHR_materials_clearcoat` strength in `[0,1]`.
        pub clearcoat: f32 = 0.0,
        /// Perceptual roughness of the coat in `[0,1]`; GGX alpha is its square.
        pub clearcoat_roughness: f32 = 0.0,
        /// Scale of the coat normal map's x and y, as [`Self::normal_scale`].
        pub clearcoat_normal_scale: f32 = 1.0,
        /// Textures by [`TextureSlot`].
        pub textures: [Option<Box<TextureRef>>; 17] = Default::default(),
    }
}

impl Material {
    /// Lambert's reflectance alone, grey, both sides alike.
    pub fn lambert(albedo: f32) -> Self {
        Self {
            base_color: Vec3::splat(albedo).extend(1.0),
            metallic: 0.0,
            specular: 0.0,
            double_sided: true,
            ..Self::default()
        }
    }

    /// Whether what is of it is a body with an inside that light gets into.
    pub(crate) fn has_inside(&self) -> bool {
        (self.transmission > 0.0 || self.diffuse_transmission > 0.0) && self.thickness > 0.0
    }

    /// Whether what lies behind it can be seen, in part or through and through.
    pub(super) fn lets_light_through(&self) -> bool {
        self.alpha_mode != AlphaMode::Opaque
            || self.transmission > 0.0
            || self.diffuse_transmission > 0.0
    }

    /// Whether it is a solid whose surface only reflects and refracts, and whose inside only absorbs, each in one
    /// way whatever the wavelength.
    pub fn is_clear_solid(&self) -> bool {
        let is_glass = self.transmission == 1.0
            && self.metallic == 0.0
            && self.diffuse_transmission == 0.0
            && self.texture(TextureSlot::Transmission).is_none();
        let is_smooth = self.roughness <= MAX_SMOOTH_ROUGHNESS && self.anisotropy == 0.0;
        let is_bare = self.clearcoat == 0.0
            && self.sheen_color == Vec3::ZERO
            && self.emissive == Vec3::ZERO
            && self.alpha_mode == AlphaMode::Opaque
            && !self.unlit;
        let is_solid =
            self.thickness > 0.0 && self.scattering == Vec3::ZERO && self.dispersion == 0.0;
        is_glass && is_smooth && is_bare && is_solid
    }

    /// Whether its reflections may be perfect somewhere.
    pub(crate) fn may_be_smooth(&self) -> bool {
        let varies = self.texture(TextureSlot::MetallicRoughness).is_some();
        !self.unlit && (varies || self.roughness < MIN_ROUGHNESS)
    }

    /// Whether it may have narrow reflections beside broad ones: a roughness below [`MAX_POLISH_ROUGHNESS`].
    pub(crate) fn may_be_polished(&self) -> bool {
        let may_be_narrow =
            |roughness: f32, slot| roughness < MAX_POLISH_ROUGHNESS || self.texture(slot).is_some();
        let is_coated = self.clearcoat > 0.0;
        let is_pure_metal = self.metallic == 1.0
            && self.texture(TextureSlot::MetallicRoughness).is_none()
            && self.sheen_color == Vec3::ZERO
            && !is_coated;
        let is_polished = !is_pure_metal
            && may_be_narrow(self.roughness, TextureSlot::MetallicRoughness)
            || is_coated
                && may_be_narrow(self.clearcoat_roughness, TextureSlot::ClearcoatRoughness);
        !self.unlit && is_polished && self.may_be_opaque()
    }

    /// Whether it lets no light through somewhere.
    pub(super) fn may_be_opaque(&self) -> bool {
        let factors = [
            (self.transmission, TextureSlot::Transmission),
            (self.diffuse_transmission, TextureSlot::DiffuseTransmission),
        ];
        factors.into_iter().all(|(factor, slot)| factor <= 0.0 || self.texture(slot).is_some())
    }

    /// Whether as much light goes straight through as through another one with the same textures, and as much
    /// is emitted: the colour of glass counts, that of a wall does not.
    pub(crate) fn lets_pass_like(&self, other: &Self) -> bool {
        let opacity =
            |m: &Self| (m.alpha_mode, m.base_color.w, m.double_sided, m.transmission, m.thickness);
        let glass = |m: &Self| {
            let inside = (m.attenuation_color, m.attenuation_distance, m.scattering);
            (m.base_color, m.metallic, m.roughness, m.ior, m.dispersion, inside)
        };
        opacity(self) == opacity(other)
            && (self.emissive, self.unlit) == (other.emissive, other.unlit)
            && self.diffuse_transmission == other.diffuse_transmission
            && (self.transmission == 0.0 || glass(self) == glass(other))
    }

    /// The texture in a slot.
    pub fn texture(&self, slot: TextureSlot) -> Option<&TextureRef> {
        self.textures[slot as usize].as_deref()
    }

    /// The material with a texture in a slot.
    pub fn with_texture(mut self, slot: TextureSlot, texture: TextureRef) -> Self {
        self.textures[slot as usize] = Some(texture.into());
        self
    }

    /// Whether a texture turns its normal or that of its coat.
    pub fn has_normal_map(&self) -> bool {
        let maps = [TextureSlot::Normal, TextureSlot::ClearcoatNormal];
        maps.into_iter().any(|slot| self.texture(slot).is_some())
    }
}

/// What happens to texture coordinates outside `[0,1]`. Shaders know each by its number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Wrap {
    /// Tiles.
    #[default]
    Repeat = 0,
    /// Tiles, every other one mirrored.
    MirroredRepeat = 1,
    /// Holds the edge.
    ClampToEdge = 2,
}

/// An image and how it is sampled (level 0 only: a path tracer filters by sampling).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Texture {
    /// Index into [`Scene::images`](crate::scene::Scene::images).
    pub image: u32,
    /// Along u.
    pub wrap_u: Wrap,
    /// Along v.
    pub wrap_v: Wrap,
    /// Nearest texel instead of bilinear.
    pub nearest: bool,
    /// RGB is sRGB-encoded (colours) rather than linear (data).
    pub srgb: bool,
}

/// An image of 8 or 16 bits a channel, row 0 at v = 0.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TextureImage {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height` of them, row after row, each of one to four channels.
    pub texels: Texels,
}
