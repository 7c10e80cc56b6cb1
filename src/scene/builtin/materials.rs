//! The materials that built-in scenes share.

use glam::{Vec2, Vec4};

use super::mesh::{Builder, Mat};
use super::{reliefs, textures};
use crate::scene::{Material, TextureRef, TextureSlot};

/// Colour textures, and the normal map that belongs to them all.
type Embossed<const N: usize> = ([TextureRef; N], TextureRef);

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

/// Timber of each tone for furniture, grain along u.
pub(super) fn timber<const N: usize>(b: &mut Builder, tones: [[f32; 3]; N]) -> Embossed<N> {
    let size = Vec2::new(1.4, 0.7);
    (tones.map(|tone| b.texture(textures::timber(tone), size)), b.data(reliefs::timber(size), size))
}

/// Plaster that repeats every `metres`; each tone has the strength of its clouds.
pub(super) fn plaster<const N: usize>(
    b: &mut Builder,
    metres: f32,
    tones: [([f32; 3], f32); N],
) -> Embossed<N> {
    let size = Vec2::splat(metres);
    let colors = tones.map(|(tone, clouds)| b.texture(textures::plaster(tone, clouds), size));
    (colors, b.data(reliefs::plaster(size), size))
}

/// Cloth of each tone. Its pattern has `threads` threads and repeats every `metres`.
pub(super) fn weave<const N: usize>(
    b: &mut Builder,
    metres: f32,
    threads: i32,
    tones: [[f32; 3]; N],
) -> Embossed<N> {
    let size = Vec2::splat(metres);
    let colors = tones.map(|tone| b.texture(textures::weave(tone, threads), size));
    (colors, b.data(reliefs::weave(size, threads), size))
}

/// One of three paintings.
pub(super) fn painting(b: &mut Builder, seed: u32) -> Mat {
    let art = b.texture(textures::painting(seed), Vec2::ONE);
    b.material(textured("painting", art, 0.55))
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

/// Clear glass that fills a closed surface.
pub(super) fn solid_glass(name: &str, roughness: f32) -> Material {
    Material { transmission: 1.0, thickness: 0.1, ..matte(name, [1.0; 3], roughness) }
}
