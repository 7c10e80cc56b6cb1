//! The materials that built-in scenes share.

use glam::Vec4;

use crate::scene::{Material, TextureRef, TextureSlot};

/// Declares what a scene is made of: materials in the order in which `Palette::new` makes them, after what it
/// prepares for them with a builder. An entry without a type is a material; one with a type is an expression of it.
macro_rules! palette {
    (
        new($builder:ident $(, $argument:ident: $argument_type:ty)*) { $($preparation:tt)* }
        $($name:ident $(: $type:ty)? = $value:expr,)+
    ) => {
        struct Palette {
            $($name: palette!(@type $($type)?)),+
        }

        impl Palette {
            fn new($builder: &mut Builder $(, $argument: $argument_type)*) -> Self {
                $($preparation)*
                Self {
                    $($name: palette!(@value $builder, $value $(, $type)?)),+
                }
            }
        }
    };
    (@type) => { Mat };
    (@type $type:ty) => { $type };
    (@value $builder:ident, $material:expr) => { $builder.material($material) };
    (@value $builder:ident, $value:expr, $type:ty) => { $value };
}
pub(super) use palette;

/// A dielectric of linear albedo `rgb`.
pub(super) fn matte(name: &str, rgb: [f32; 3], roughness: f32) -> Material {
    Material {
        name: name.to_owned(),
        base_color: Vec4::new(rgb[0], rgb[1], rgb[2], 1.0),
        metallic: 0.0,
        roughness,
        ..Material::default()
    }
}

/// A dielectric whose albedo comes from a texture.
pub(super) fn textured(name: &str, texture: TextureRef, roughness: f32) -> Material {
    matte(name, [1.0; 3], roughness).with_texture(TextureSlot::BaseColor, texture)
}

/// A material with a normal map.
pub(super) fn embossed(material: Material, normals: TextureRef) -> Material {
    material.with_texture(TextureSlot::Normal, normals)
}

/// A thin cloth or leaf, seen from both sides.
pub(super) fn two_sided(material: Material) -> Material {
    Material { double_sided: true, ..material }
}

/// A material under a coat of varnish.
pub(super) fn varnished(material: Material, coat: f32, coat_roughness: f32) -> Material {
    Material { clearcoat: coat, clearcoat_roughness: coat_roughness, ..material }
}

/// A bare metal of normal reflectance `rgb`.
pub(super) fn metal(name: &str, rgb: [f32; 3], roughness: f32) -> Material {
    Material { metallic: 1.0, ..matte(name, rgb, roughness) }
}

/// Brushed brass.
pub(super) fn brass() -> Material {
    metal("brass", [0.88, 0.66, 0.33], 0.28)
}

/// Polished copper.
pub(super) fn copper() -> Material {
    metal("copper", [0.90, 0.56, 0.42], 0.20)
}

/// Brushed steel.
pub(super) fn steel() -> Material {
    metal("steel", [0.62, 0.62, 0.63], 0.35)
}

/// Glazed white ceramic.
pub(super) fn ceramic() -> Material {
    matte("ceramic", [0.78, 0.76, 0.72], 0.12)
}

/// Thin clear glass.
pub(super) fn glass(name: &str, rgb: [f32; 3]) -> Material {
    Material { transmission: 1.0, double_sided: true, ..matte(name, rgb, 0.0) }
}
