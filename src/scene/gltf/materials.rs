//! Materials: metallic-roughness and the extensions that are rendered.

use std::collections::{BTreeMap, BTreeSet};

use glam::{Affine2, Vec3};
use gltf::json;
use json::extensions::texture::TextureTransform;
use json::validation::Checked;
use serde_json::{Map, Value};

use super::buffers::File;
use super::document::Document;
use super::lenient::make_whole;
use super::limits::Fallible;
use super::medium;
use super::textures::{Decoded, Wanted};
use crate::error::Notices;
use crate::scene::lists::appended;
use crate::scene::surface::absorption;
use crate::scene::{AlphaMode, Material, Texture, TextureImage, TextureRef, TextureSlot as Slot};

/// Largest radiance a surface may emit: its square is far from overflow.
pub(super) const BRIGHTEST: f32 = 1e12;

/// The materials that primitives use, with their textures.
pub(super) struct Materials {
    pub(super) materials: Vec<Material>,
    pub(super) textures: Vec<Texture>,
    pub(super) images: Vec<TextureImage>,
    /// Place in `materials` by number in the file (`None`: the default material).
    pub(super) places: BTreeMap<Option<u32>, u32>,
    /// Places of what is made for sheets, by those of the bodies' materials and the bits of the thickness.
    sheets: BTreeMap<(u32, u32), u32>,
}

impl Materials {
    /// Reads the used materials and decodes the images they need.
    pub(super) fn load(
        file: &File<'_>,
        used: &BTreeSet<Option<u32>>,
        notices: &mut Notices,
    ) -> Fallible<Self> {
        let mut wanted = Wanted::default();
        let mut materials: Vec<Material> = Vec::with_capacity(used.len());
        let mut places = BTreeMap::new();
        let mut glossy = Vec::new();
        for &number in used {
            places.insert(number, materials.len() as u32);
            materials.push(match number {
                None => Material { name: "default".to_owned(), ..Material::default() },
                Some(number) => {
                    let source = file.document.materials.get(json::Index::new(number))?;
                    let name = source.name.clone().unwrap_or_else(|| format!("material {number}"));
                    let mut reader = Reader {
                        document: &file.document,
                        material: Material { name, ..Material::default() },
                        glossiness: None,
                        wanted: &mut wanted,
                        notices,
                    };
                    reader.read(&source).map_err(|cause| {
                        format!("material {number} ({}): {cause}", reader.material.name)
                    })?;
                    glossy.extend(reader.glossiness.map(|factor| (materials.len(), factor)));
                    reader.material
                }
            });
        }
        let mut decoded = wanted.decode(file, notices);
        for slot in materials.iter_mut().flat_map(|material| &mut material.textures) {
            *slot = slot.take().and_then(|reference| {
                let texture = decoded.texture_map[reference.texture as usize]?;
                Some(Box::new(TextureRef { texture, ..*reference }))
            });
        }
        for (place, factor) in glossy {
            decoded.make_rough(&mut materials[place], factor);
        }
        let Decoded { textures, images, .. } = decoded;
        Ok(Self { materials, textures, images, places, sheets: BTreeMap::new() })
    }

    /// Makes insides of bodies as dense as they are at another scale.
    pub(super) fn scale(&mut self, scale: f64) {
        for material in &mut self.materials {
            material.attenuation_distance =
                (f64::from(material.attenuation_distance) * scale) as f32;
            material.scattering = (material.scattering.as_dvec3() / scale).as_vec3();
        }
    }

    /// Place of the material of a sheet, so thick in metres, given that of a body: a thin wall of the colour that
    /// the body's inside has at that thickness.
    pub(super) fn sheet(&mut self, body: u32, thickness: f32) -> u32 {
        *self.sheets.entry((body, thickness.to_bits())).or_insert_with(|| {
            let mut sheet = self.materials[body as usize].clone();
            let tint = (-absorption(&sheet) * thickness).exp();
            if sheet.transmission > 0.0 {
                sheet.base_color *= tint.extend(1.0);
            }
            sheet.diffuse_transmission_color *= tint;
            sheet.thickness = 0.0;
            appended(&mut self.materials, sheet)
        })
    }

    /// Names the materials of bodies that are on sheets.
    pub(super) fn tell_of_sheets(&self, notices: &mut Notices) {
        let bodies: BTreeSet<u32> = self.sheets.keys().map(|&(body, _)| body).collect();
        for body in bodies {
            notices.add(format!(
                "material {} has a volume on surfaces that are not closed; there it is a sheet of its thickness",
                self.materials[body as usize].name
            ));
        }
    }
}

/// A JSON object, such as an extension.
pub(super) type Object = Map<String, Value>;

/// Where a texture of the file is read.
pub(super) struct Info {
    index: json::Index<json::Texture>,
    tex_coord: u32,
    transform: Option<TextureTransform>,
}

impl From<&json::texture::Info> for Info {
    fn from(info: &json::texture::Info) -> Self {
        let transform = info.extensions.as_ref().and_then(|all| all.texture_transform.clone());
        Self { index: info.index, tex_coord: info.tex_coord, transform }
    }
}

impl From<&json::material::NormalTexture> for Info {
    fn from(info: &json::material::NormalTexture) -> Self {
        let extensions = info.extensions.as_ref();
        let transform = extensions.and_then(|all| parsed(all.others.get("KHR_texture_transform")?));
        Self { index: info.index, tex_coord: info.tex_coord, transform }
    }
}

/// A JSON value as one of glTF's types, if it fits.
fn parsed<T: for<'de> serde::Deserialize<'de>>(value: &Value) -> Option<T> {
    let mut value = value.clone();
    make_whole(&mut value);
    json::deserialize::from_value(value).ok()
}

/// Reads one material.
pub(super) struct Reader<'a> {
    document: &'a Document<'a>,
    /// What is read so far.
    pub(super) material: Material,
    /// Factor on the alpha of a texture that is read for roughness, and says how smooth the surface is.
    glossiness: Option<f32>,
    wanted: &'a mut Wanted,
    notices: &'a mut Notices,
}

/// Reads what an extension says of a material.
type ReadExtension<'a> = fn(&mut Reader<'a>, &Object) -> Fallible<()>;

impl<'a> Reader<'a> {
    fn read(&mut self, source: &json::Material) -> Fallible<()> {
        let pbr = &source.pbr_metallic_roughness;
        self.material = Material {
            name: self.material.name.clone(),
            base_color: self.units(pbr.base_color_factor.0).into(),
            metallic: self.unit(pbr.metallic_factor.0),
            roughness: self.unit(pbr.roughness_factor.0),
            normal_scale: self.finite(source.normal_texture.as_ref().map_or(1.0, |map| map.scale)),
            // Older files put lamps' strengths here.
            emissive: source.emissive_factor.0.map(|x| self.within(x, 0.0, BRIGHTEST)).into(),
            alpha_mode: match source.alpha_mode {
                Checked::Valid(json::material::AlphaMode::Mask) => {
                    // Above 1 all is cut out, as what a person hides is by a cutoff of its own.
                    AlphaMode::Mask { cutoff: source.alpha_cutoff.map_or(0.5, |it| it.0.min(1.5)) }
                }
                Checked::Valid(json::material::AlphaMode::Blend) => AlphaMode::Blend,
                Checked::Valid(json::material::AlphaMode::Opaque) => AlphaMode::Opaque,
                Checked::Invalid => {
                    self.note("an alpha mode that glTF does not know: it is opaque");
                    AlphaMode::Opaque
                }
            },
            double_sided: source.double_sided,
            ..Material::default()
        };
        self.texture(Slot::BaseColor, pbr.base_color_texture.as_ref())?;
        self.texture(Slot::MetallicRoughness, pbr.metallic_roughness_texture.as_ref())?;
        self.texture(Slot::Normal, source.normal_texture.as_ref())?;
        self.texture(Slot::Emissive, source.emissive_texture.as_ref())?;
        (self.material.scattering, self.material.scatter_anisotropy) =
            medium::inside(&source.extras, &self.material.name, self.notices);
        source.extensions.as_ref().map_or(Ok(()), |extensions| self.extensions(extensions))
    }

    fn extensions(&mut self, source: &json::extensions::material::Material) -> Fallible<()> {
        self.material.unlit = source.unlit.is_some();
        if let Some(strength) = &source.emissive_strength {
            let strength = self.within(strength.emissive_strength.0, 0.0, BRIGHTEST);
            self.material.emissive =
                (self.material.emissive * strength).min(Vec3::splat(BRIGHTEST));
        }
        if let Some(ior) = &source.ior {
            let ior = ior.ior.0;
            self.material.ior = if ior == 0.0 { 0.0 } else { self.at_least(ior, 1.0) };
        }
        if let Some(specular) = &source.specular {
            self.material.specular = self.unit(specular.specular_factor.0);
            self.texture(Slot::Specular, specular.specular_texture.as_ref())?;
            let tint = specular.specular_color_factor.0;
            self.material.specular_color = tint.map(|x| self.at_least(x, 0.0)).into();
            self.texture(Slot::SpecularColor, specular.specular_color_texture.as_ref())?;
        }
        if let Some(transmission) = &source.transmission {
            self.material.transmission = self.unit(transmission.transmission_factor.0);
            self.texture(Slot::Transmission, transmission.transmission_texture.as_ref())?;
        }
        if let Some(volume) = &source.volume {
            self.material.thickness = self.at_least(volume.thickness_factor.0, 0.0);
            self.material.attenuation_color = self.units(volume.attenuation_color.0).into();
            let distance = volume.attenuation_distance.0;
            // Zero is forbidden and means, in files that have it, that nobody set it.
            self.material.attenuation_distance =
                if distance > 0.0 { distance } else { f32::INFINITY };
        }
        let readers: [(&str, ReadExtension<'a>); 7] = [
            ("KHR_materials_clearcoat", Self::clearcoat),
            ("KHR_materials_anisotropy", Self::anisotropy),
            ("KHR_materials_sheen", Self::sheen),
            ("KHR_materials_diffuse_transmission", Self::diffuse_transmission),
            ("KHR_materials_iridescence", Self::iridescence),
            ("KHR_materials_dispersion", Self::dispersion),
            ("KHR_materials_pbrSpecularGlossiness", Self::specular_glossiness),
        ];
        for (name, read) in readers {
            if let Some(object) = source.others.get(name).and_then(Value::as_object) {
                read(self, object)?;
            }
        }
        Ok(())
    }

    fn clearcoat(&mut self, coat: &Object) -> Fallible<()> {
        self.material.clearcoat = self.unit(number(coat, "clearcoatFactor", 0.0));
        self.material.clearcoat_roughness =
            self.unit(number(coat, "clearcoatRoughnessFactor", 0.0));
        self.texture(Slot::Clearcoat, texture(coat, "clearcoatTexture"))?;
        self.texture(Slot::ClearcoatRoughness, texture(coat, "clearcoatRoughnessTexture"))?;
        let normal: Option<json::material::NormalTexture> =
            coat.get("clearcoatNormalTexture").and_then(parsed);
        self.material.clearcoat_normal_scale =
            self.finite(normal.as_ref().map_or(1.0, |map| map.scale));
        self.texture(Slot::ClearcoatNormal, normal.as_ref())
    }

    /// The archived specular-glossiness model: a dielectric whose F0 is the specular colour, which
    /// an infinite index of refraction (`ior` 0) expresses exactly.
    fn specular_glossiness(&mut self, old: &Object) -> Fallible<()> {
        let diffuse: Option<[f32; 4]> = old.get("diffuseFactor").and_then(parsed);
        self.material.base_color = self.units(diffuse.unwrap_or([1.0; 4])).into();
        self.texture(Slot::BaseColor, texture(old, "diffuseTexture"))?;
        let specular: Option<[f32; 3]> = old.get("specularFactor").and_then(parsed);
        self.material.specular_color = self.units(specular.unwrap_or([1.0; 3])).into();
        let glossiness = self.unit(number(old, "glossinessFactor", 1.0));
        for slot in [Slot::SpecularColor, Slot::MetallicRoughness] {
            self.texture(slot, texture(old, "specularGlossinessTexture"))?;
        }
        (self.material.metallic, self.material.ior, self.material.roughness) =
            (0.0, 0.0, 1.0 - glossiness);
        self.glossiness = Some(glossiness);
        Ok(())
    }

    /// Reads the texture of a slot, if the file has one.
    pub(super) fn texture(&mut self, slot: Slot, info: Option<impl Into<Info>>) -> Fallible<()> {
        use Slot::{BaseColor, DiffuseTransmissionColor, Emissive, SheenColor, SpecularColor};
        self.material.textures[slot as usize] = None;
        let Some(info) = info.map(Into::<Info>::into) else { return Ok(()) };
        let transform = info.transform.as_ref();
        let uv_set = transform.and_then(|it| it.tex_coord).unwrap_or(info.tex_coord);
        if uv_set > 1 {
            let left_out = "which is left out: sets 0 and 1 are read";
            self.note(&format!("a texture on UV set {uv_set}, {left_out}"));
            return Ok(());
        }
        let colors = [BaseColor, DiffuseTransmissionColor, Emissive, SheenColor, SpecularColor];
        self.material.textures[slot as usize] = Some(Box::new(TextureRef {
            texture: self.wanted.add(self.document, info.index, colors.contains(&slot))?,
            uv_set: uv_set as u8,
            transform: transform.map_or(Affine2::IDENTITY, uv_transform),
        }));
        Ok(())
    }

    /// Adds a notice of what the material has.
    fn note(&mut self, what: &str) {
        self.notices.add(format!("material {} has {what}", self.material.name));
    }

    /// A factor clamped to `[0,1]`.
    pub(super) fn unit(&mut self, value: f32) -> f32 {
        self.within(value, 0.0, 1.0)
    }

    pub(super) fn units<const N: usize>(&mut self, values: [f32; N]) -> [f32; N] {
        values.map(|value| self.unit(value))
    }

    pub(super) fn at_least(&mut self, value: f32, least: f32) -> f32 {
        self.within(value, least, f32::MAX)
    }

    pub(super) fn finite(&mut self, value: f32) -> f32 {
        self.within(value, f32::MIN, f32::MAX)
    }

    pub(super) fn within(&mut self, value: f32, least: f32, most: f32) -> f32 {
        if !(least..=most).contains(&value) {
            self.note("factors outside their range, which are clamped");
        }
        value.clamp(least, most)
    }
}

/// `KHR_texture_transform`: scale, then rotation, then offset. The rotation is counter-clockwise
/// as the UV map is seen, v pointing down (KhronosGroup/glTF issue 1563).
fn uv_transform(transform: &TextureTransform) -> Affine2 {
    let affine = Affine2::from_scale_angle_translation(
        transform.scale.0.into(),
        -transform.rotation.0,
        transform.offset.0.into(),
    );
    if affine.is_finite() { affine } else { Affine2::IDENTITY }
}

pub(super) fn number(object: &Object, key: &str, default: f32) -> f32 {
    object.get(key).and_then(Value::as_f64).map_or(default, |value| value as f32)
}

pub(super) fn texture(object: &Object, key: &str) -> Option<Info> {
    object.get(key).and_then(parsed).map(|info: json::texture::Info| Info::from(&info))
}
