//! Material extensions of which the `gltf` crate knows nothing, beside the clearcoat.

use glam::Vec3;
use serde_json::{Map, Value};

use super::limits::Fallible;
use super::materials::{Reader, number, texture};
use crate::scene::{Material, TextureSlot as Slot};

type Object = Map<String, Value>;

impl Reader<'_> {
    /// `KHR_materials_anisotropy`.
    pub(super) fn anisotropy(&mut self, from: &Object, to: &mut Material) -> Fallible<()> {
        to.anisotropy = self.unit(number(from, "anisotropyStrength", 0.0));
        to.anisotropy_rotation = self.finite(number(from, "anisotropyRotation", 0.0));
        self.texture(to, Slot::Anisotropy, texture(from, "anisotropyTexture"))
    }

    /// `KHR_materials_sheen`.
    pub(super) fn sheen(&mut self, from: &Object, to: &mut Material) -> Fallible<()> {
        to.sheen_color = self.unit_color(from, "sheenColorFactor", Vec3::ZERO);
        self.texture(to, Slot::SheenColor, texture(from, "sheenColorTexture"))?;
        to.sheen_roughness = self.unit(number(from, "sheenRoughnessFactor", 0.0));
        self.texture(to, Slot::SheenRoughness, texture(from, "sheenRoughnessTexture"))
    }

    /// `KHR_materials_diffuse_transmission`.
    pub(super) fn diffuse_transmission(
        &mut self,
        from: &Object,
        to: &mut Material,
    ) -> Fallible<()> {
        to.diffuse_transmission = self.unit(number(from, "diffuseTransmissionFactor", 0.0));
        self.texture(to, Slot::DiffuseTransmission, texture(from, "diffuseTransmissionTexture"))?;
        to.diffuse_transmission_color =
            self.unit_color(from, "diffuseTransmissionColorFactor", Vec3::ONE);
        self.texture(
            to,
            Slot::DiffuseTransmissionColor,
            texture(from, "diffuseTransmissionColorTexture"),
        )
    }

    /// `KHR_materials_iridescence`.
    pub(super) fn iridescence(&mut self, from: &Object, to: &mut Material) -> Fallible<()> {
        to.iridescence = self.unit(number(from, "iridescenceFactor", 0.0));
        self.texture(to, Slot::Iridescence, texture(from, "iridescenceTexture"))?;
        to.iridescence_ior = self.at_least(number(from, "iridescenceIor", 1.3), 1.0);
        let ends = [("iridescenceThicknessMinimum", 100.0), ("iridescenceThicknessMaximum", 400.0)];
        to.iridescence_thickness =
            ends.map(|(key, default)| self.within(number(from, key, default), 0.0, 1e6));
        self.texture(to, Slot::IridescenceThickness, texture(from, "iridescenceThicknessTexture"))
    }

    /// A colour of components clamped to `[0,1]`.
    fn unit_color(&mut self, from: &Object, key: &str, default: Vec3) -> Vec3 {
        let color: Option<[f32; 3]> =
            from.get(key).and_then(|it| serde_json::from_value(it.clone()).ok());
        color.map_or(default, |color| Vec3::from_array(self.units(color)))
    }
}
