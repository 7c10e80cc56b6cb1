//! The scene: flat arrays and `u32` indices, everything in world space (metres, +Y up), but for meshes
//! that instances share.

pub mod builtin;
pub mod camera_path;
mod copies;
pub mod gltf;
mod instances;
mod material_edit;
pub mod needs;
mod outlines;
mod placing;
pub mod surface;
pub mod texture;

use std::path::PathBuf;

use glam::{Affine2, Affine3A, Vec2, Vec3, Vec4};
use serde::{Deserialize, Serialize};

use crate::error::Notices;
use crate::image::Texels;
use camera_path::CameraPath;
pub use instances::{Instance, Instances, MAX_SHOWN};
pub use material_edit::MaterialEdit;
pub use placing::Placing;

/// What is asked of a scene's file.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SceneOptions {
    /// Reads files that the scene names outside of its folder, too.
    pub allow_outside: bool,
    /// The look of a model that has several, by its name.
    pub variant: Option<String>,
    /// What happens to outlines: enlarged copies of a model that face inwards and, here, would shut out
    /// all light.
    pub outlines: Outlines,
    /// Leaves out all that is of the material of this name; may be given several times.
    pub hide: Vec<String>,
    /// Changes to all materials of a name, in order.
    pub edits: Vec<(String, MaterialEdit)>,
    /// Files that will be written: a scene that names one of them as its own data is refused.
    #[serde(skip)]
    pub outputs: Vec<PathBuf>,
}

/// What happens to inverted hulls.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outlines {
    /// They are left out, and it is said.
    #[default]
    Remove,
    /// They are rendered like everything else.
    Keep,
}

/// All that can be rendered, ready for a BVH: in world space, but for meshes that instances share.
///
/// Per-vertex arrays are either empty (nothing in the scene has it) or as long as `positions`.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    /// What to call it: the file name or the built-in's name.
    pub name: String,
    /// World-space vertex positions in metres; of shared meshes in their own space, as are normals and
    /// tangents.
    pub positions: Vec<Vec3>,
    /// World-space unit normals; zero where the triangle is to be shaded flat.
    pub normals: Vec<Vec3>,
    /// World-space unit tangents, w = +1 or -1 for the bitangent `w * (normal cross tangent)`.
    pub tangents: Vec<Vec4>,
    /// Texture coordinates, two sets.
    pub uvs: [Vec<Vec2>; 2],
    /// Linear vertex colours with alpha.
    pub colors: Vec<Vec4>,
    /// Vertex indices, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Index into `materials` for each triangle.
    pub triangle_materials: Vec<u32>,
    /// Meshes, the last of the triangles, that are held once and shown in several places.
    pub instances: Instances,
    /// Materials; never empty once loaded.
    pub materials: Vec<Material>,
    /// Textures: an image and how it is sampled.
    pub textures: Vec<Texture>,
    /// Decoded images.
    pub images: Vec<TextureImage>,
    /// Cameras in file order.
    pub cameras: Vec<Camera>,
    /// How each of them moves, if it does; empty for built-in scenes.
    pub camera_paths: Vec<Option<CameraPath>>,
    /// Point, spot and directional lights.
    pub lights: Vec<PunctualLight>,
    /// What fills the space between surfaces; `None` is clear air.
    pub medium: Option<Medium>,
    /// What was repaired, skipped or assumed while loading.
    pub notices: Notices,
}

/// A homogeneous medium, like fog: the same everywhere in its box, and outside of solid bodies.
/// All zero is clear air.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Medium {
    /// Scattering coefficient per metre, linear RGB, not negative: one over the mean way of light
    /// between two scatterings.
    pub scattering: Vec3,
    /// Absorption coefficient per metre, linear RGB, not negative.
    pub absorption: Vec3,
    /// Mean cosine of Henyey and Greenstein's phase function: 0 scatters to all sides alike, towards
    /// 1 ever more forward, towards -1 back. Beyond +-0.99 it is clamped.
    pub anisotropy: f32,
    /// Lower and upper corner in metres; `None` is the box around the scene. There is no medium
    /// without end: it would hide the map, which is infinitely far away.
    pub bounds: Option<[Vec3; 2]>,
}

impl Medium {
    /// Whether all numbers are in range and the box, if any, has a volume.
    pub fn is_sound(&self) -> bool {
        let coefficients = [self.scattering, self.absorption];
        coefficients.iter().all(|c| c.is_finite() && c.min_element() >= 0.0)
            && self.anisotropy.abs() <= 1.0
            && self.bounds.is_none_or(|[low, high]| {
                low.is_finite() && high.is_finite() && low.cmplt(high).all()
            })
    }
}

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
    /// Index into [`Scene::textures`].
    pub texture: u32,
    /// Which of [`Scene::uvs`].
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

/// glTF metallic-roughness material with the extensions lightgrid renders. Factors are linear. Textures, of
/// which most materials have few or none, are boxed: a file may have a million materials.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Name in the file, for messages and overlays.
    pub name: String,
    /// Base colour factor, linear RGB and alpha.
    pub base_color: Vec4,
    /// Metalness in `[0,1]`.
    pub metallic: f32,
    /// Perceptual roughness in `[0,1]`; GGX alpha is its square.
    pub roughness: f32,
    /// Scale of the normal map's x and y; finite, of any sign, 1 is the map as it is.
    pub normal_scale: f32,
    /// Emitted radiance, linear, `KHR_materials_emissive_strength` included.
    pub emissive: Vec3,
    /// How alpha is used.
    pub alpha_mode: AlphaMode,
    /// Whether camera rays see the back too. All other rays meet both sides of every surface: a wall
    /// modelled single-sided does not leak light.
    pub double_sided: bool,
    /// `KHR_materials_unlit`: base colour is emitted as it is, nothing is reflected.
    pub unlit: bool,
    /// `KHR_materials_ior`; 0 means infinitely high (F0 = 1), otherwise at least 1.
    pub ior: f32,
    /// `KHR_materials_specular` strength in `[0,1]`.
    pub specular: f32,
    /// F0 tint, linear.
    pub specular_color: Vec3,
    /// `KHR_materials_transmission` in `[0,1]`.
    pub transmission: f32,
    /// `KHR_materials_diffuse_transmission`: share in `[0,1]` of the body's light that comes through
    /// instead of back.
    pub diffuse_transmission: f32,
    /// Colour of what comes through, linear, in `[0,1]`.
    pub diffuse_transmission_color: Vec3,
    /// `KHR_materials_volume` thickness in the mesh's units, not negative. Only whether it is 0 counts: 0 is a
    /// thin wall, more is a solid body with an inside.
    pub thickness: f32,
    /// Colour that white light becomes after `attenuation_distance` inside the body, linear, in `[0,1]`.
    pub attenuation_color: Vec3,
    /// Metres, above 0; infinite is no absorption.
    pub attenuation_distance: f32,
    /// Scattering coefficient per metre inside the body, linear RGB, not negative.
    pub scattering: Vec3,
    /// Mean cosine of scattering inside the body, as [`Medium::anisotropy`].
    pub scatter_anisotropy: f32,
    /// `KHR_materials_anisotropy` strength in `[0,1]`: how much wider reflections are along the
    /// direction below than `roughness` says; 1 is as wide as roughness 1.
    pub anisotropy: f32,
    /// Direction of that width in radians from the tangent, counter-clockwise.
    pub anisotropy_rotation: f32,
    /// `KHR_materials_iridescence`: share in `[0,1]` of the surface that a thin film covers.
    pub iridescence: f32,
    /// Index of refraction of the film, at least 1.
    pub iridescence_ior: f32,
    /// Thickness of the film in nanometres where its texture is 0 and where it is 1; without a
    /// texture it is the second.
    pub iridescence_thickness: [f32; 2],
    /// `KHR_materials_dispersion`: 20 over the Abbe number of a solid body, not negative; 0 bends all
    /// colours alike.
    pub dispersion: f32,
    /// `KHR_materials_sheen` colour, linear, in `[0,1]`; black is none.
    pub sheen_color: Vec3,
    /// Perceptual roughness of the sheen in `[0,1]`.
    pub sheen_roughness: f32,
    /// `KHR_materials_clearcoat` strength in `[0,1]`.
    pub clearcoat: f32,
    /// Perceptual roughness of the coat in `[0,1]`; GGX alpha is its square.
    pub clearcoat_roughness: f32,
    /// Scale of the coat normal map's x and y, as [`Self::normal_scale`].
    pub clearcoat_normal_scale: f32,
    /// Textures by [`TextureSlot`].
    pub textures: [Option<Box<TextureRef>>; 17],
}

impl Default for Material {
    /// glTF's default material: white, metallic 1, roughness 1 are its factor defaults.
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: Vec4::ONE,
            metallic: 1.0,
            roughness: 1.0,
            normal_scale: 1.0,
            emissive: Vec3::ZERO,
            alpha_mode: AlphaMode::Opaque,
            double_sided: false,
            unlit: false,
            ior: 1.5,
            specular: 1.0,
            specular_color: Vec3::ONE,
            transmission: 0.0,
            diffuse_transmission: 0.0,
            diffuse_transmission_color: Vec3::ONE,
            thickness: 0.0,
            attenuation_color: Vec3::ONE,
            attenuation_distance: f32::INFINITY,
            scattering: Vec3::ZERO,
            scatter_anisotropy: 0.0,
            anisotropy: 0.0,
            anisotropy_rotation: 0.0,
            iridescence: 0.0,
            iridescence_ior: 1.3,
            iridescence_thickness: [100.0, 400.0],
            dispersion: 0.0,
            sheen_color: Vec3::ZERO,
            sheen_roughness: 0.0,
            clearcoat: 0.0,
            clearcoat_roughness: 0.0,
            clearcoat_normal_scale: 1.0,
            textures: Default::default(),
        }
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

    /// Whether as much light goes straight through as through another one with the same textures, and as much
    /// is emitted: the colour of glass counts, that of a wall does not.
    pub(crate) fn lets_pass_like(&self, other: &Self) -> bool {
        let opacity =
            |m: &Self| (m.alpha_mode, m.base_color.w, m.double_sided, m.transmission, m.thickness);
        let glass = |m: &Self| (m.base_color, m.metallic, m.roughness);
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

/// What happens to texture coordinates outside `[0,1]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Wrap {
    /// Tiles.
    #[default]
    Repeat,
    /// Tiles, every other one mirrored.
    MirroredRepeat,
    /// Holds the edge.
    ClampToEdge,
}

/// An image and how it is sampled (level 0 only: a path tracer filters by sampling).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Texture {
    /// Index into [`Scene::images`].
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

/// What a camera does with distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// Pinhole or thin lens.
    Perspective {
        /// Full vertical field of view in radians.
        fov_y_radians: f32,
    },
    /// Parallel rays.
    Orthographic {
        /// Half the picture's height in metres.
        half_height: f32,
    },
}

/// A camera looking down its local -Z, +Y up.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Name in the file.
    pub name: String,
    /// World from camera; its scale is ignored.
    pub world_from_camera: Affine3A,
    /// Projection.
    pub projection: Projection,
    /// Radius of the thin lens in metres; 0 is a pinhole.
    pub lens_radius: f32,
    /// Distance in metres along the view axis at which the picture is sharp.
    pub focus_distance: f32,
}

impl Camera {
    /// Whether the same is seen through both.
    pub(crate) fn sees_like(&self, other: &Self) -> bool {
        let seen = |camera: &Self| {
            let focus = if camera.lens_radius > 0.0 { camera.focus_distance } else { 0.0 };
            (camera.world_from_camera, camera.projection, camera.lens_radius, focus)
        };
        seen(self) == seen(other)
    }

    /// The point straight ahead at which the picture is sharp.
    pub fn target(&self) -> Vec3 {
        let back = self.world_from_camera.matrix3.z_axis.normalize_or_zero();
        Vec3::from(self.world_from_camera.translation - back * self.focus_distance)
    }

    /// A pinhole camera at `eye` that looks at `target`.
    pub fn look_at(eye: Vec3, target: Vec3, fov_y_radians: f32) -> Self {
        let z = (eye - target).normalize_or(Vec3::Z);
        let up = if z.y.abs() > 0.999 { Vec3::Z } else { Vec3::Y };
        let x = up.cross(z).normalize();
        let rotation = glam::Mat3::from_cols(x, z.cross(x), z);
        Self {
            name: String::new(),
            world_from_camera: Affine3A::from_mat3_translation(rotation, eye),
            projection: Projection::Perspective { fov_y_radians },
            lens_radius: 0.0,
            focus_distance: (eye - target).length(),
        }
    }
}

/// Shape of a punctual light (`KHR_lights_punctual`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PunctualKind {
    /// Same radiant intensity in all directions.
    Point,
    /// A cone; full inside `inner`, nothing outside `outer` (half angles in radians).
    Spot {
        /// Half angle of full intensity.
        inner_radians: f32,
        /// Half angle of the cone.
        outer_radians: f32,
    },
    /// Parallel light; `intensity` is irradiance on a facing plane.
    Directional,
}

/// A light without size.
#[derive(Debug, Clone, PartialEq)]
pub struct PunctualLight {
    /// Name in the file.
    pub name: String,
    /// Shape.
    pub kind: PunctualKind,
    /// World position in metres (unused by directional lights).
    pub position: Vec3,
    /// Unit world direction the light travels in (unused by point lights).
    pub direction: Vec3,
    /// Linear colour times radiant intensity (point, spot) or irradiance (directional).
    pub intensity: Vec3,
    /// Metres beyond which nothing is lit; infinite if not limited.
    pub range: f32,
}
