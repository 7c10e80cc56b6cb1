//! Material extensions of which the `gltf` crate knows nothing, beside the clearcoat.

use glam::Vec3;

use super::limits::Fallible;
use super::materials::{Object, Reader, number, texture};
use crate::scene::TextureSlot as Slot;

impl Reader<'_> {
    /// `KHR_materials_anisotropy`.
    pub(super) fn anisotropy(&mut self, from: &Object) -> Fallible<()> {
        self.material.anisotropy = self.unit(number(from, "anisotropyStrength", 0.0));
        self.material.anisotropy_rotation = self.finite(number(from, "anisotropyRotation", 0.0));
        self.texture(Slot::Anisotropy, texture(from, "anisotropyTexture"))
    }

    /// `KHR_materials_sheen`.
    pub(super) fn sheen(&mut self, from: &Object) -> Fallible<()> {
        self.material.sheen_color = self.unit_color(from, "sheenColorFactor", Vec3::ZERO);
        self.texture(Slot::SheenColor, texture(from, "sheenColorTexture"))?;
        self.material.sheen_roughness = self.unit(number(from, "sheenRoughnessFactor", 0.0));
        self.texture(Slot::SheenRoughness, texture(from, "sheenRoughnessTexture"))
    }

    /// `KHR_materials_diffuse_transmission`.
    pub(super) fn diffuse_transmission(&mut self, from: &Object) -> Fallible<()> {
        self.material.diffuse_transmission =
            self.unit(number(from, "diffuseTransmissionFactor", 0.0));
        self.texture(Slot::DiffuseTransmission, texture(from, "diffuseTransmissionTexture"))?;
        self.material.diffuse_transmission_color =
            self.unit_color(from, "diffuseTransmissionColorFactor", Vec3::ONE);
        let color = texture(from, "diffuseTransmissionColorTexture");
        self.texture(Slot::DiffuseTransmissionColor, color)
    }

    /// `KHR_materials_iridescence`.
    pub(super) fn iridescence(&mut self, from: &Object) -> Fallible<()> {
        self.material.iridescence = self.unit(number(from, "iridescenceFactor", 0.0));
        self.texture(Slot::Iridescence, texture(from, "iridescenceTexture"))?;
        self.material.iridescence_ior = self.at_least(number(from, "iridescenceIor", 1.3), 1.0);
        let ends = [("iridescenceThicknessMinimum", 100.0), ("iridescenceThicknessMaximum", 400.0)];
        self.material.iridescence_thickness =
            ends.map(|(key, default)| self.within(number(from, key, default), 0.0, 1e6));
        self.texture(Slot::IridescenceThickness, texture(from, "iridescenceThicknessTexture"))
    }

    /// `KHR_materials_dispersion`.
    pub(super) fn dispersion(&mut self, from: &Object) -> Fallible<()> {
        self.material.dispersion = self.at_least(number(from, "dispersion", 0.0), 0.0);
        Ok(())
    }

    /// A colour of components clamped to `[0,1]`.
    fn unit_color(&mut self, from: &Object, key: &str, default: Vec3) -> Vec3 {
        let color: Option<[f32; 3]> =
            from.get(key).and_then(|it| serde_json::from_value(it.clone()).ok());
        color.map_or(default, |color| Vec3::from_array(self.units(color)))
    }
}
