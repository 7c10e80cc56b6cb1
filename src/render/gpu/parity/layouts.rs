//! What the host writes lies where the shaders read it, as naga lays their structs out.

use std::mem::offset_of;

use naga::{Expression, Literal, Module, ScalarKind, Type, TypeInner};

use super::super::cast::CastRay;
use super::super::features::Features;
use super::super::kernel::Kernel;
use super::super::layout::{Globals, Material, TextureRef, Work};
use super::super::shader::{ArrayPlaces, Constants, Program};
use super::super::texels::VertexTexels;

/// A struct's fields in bytes: name, offset, size.
type Fields = Vec<(&'static str, usize, usize)>;

fn size_of_field<S, F>(_: fn(&S) -> &F) -> usize {
    size_of::<F>()
}

/// Size and fields of a struct of the host.
macro_rules! fields {
    ($type:ident: $($field:ident)*) => {(
        size_of::<$type>(),
        vec![$((
            stringify!($field),
            offset_of!($type, $field),
            size_of_field(|s: &$type| &s.$field),
        )),*],
    )};
}

fn module() -> Module {
    module_of(Kernel::Render)
}

fn module_of(kernel: Kernel) -> Module {
    let features = Features::most();
    let vertex = VertexTexels::of(features);
    let constants =
        Constants { stack_size: 20, shared_stack_size: 10, vertex, ..Constants::default() };
    let source = Program::new(kernel, features, &constants, &ArrayPlaces::default()).source;
    naga::front::wgsl::parse_str(&source)
        .unwrap_or_else(|e| panic!("{}", e.emit_to_string(&source)))
}

fn find<'a>(module: &'a Module, name: &str) -> &'a Type {
    let mut types = module.types.iter().map(|(_, ty)| ty);
    types.find(|ty| ty.name.as_deref() == Some(name)).expect("the shader has this struct")
}

/// All fields of both structs, padding apart, have the same names, places and sizes.
fn assert_same(module: &Module, name: &str, (size, fields): (usize, Fields)) {
    let TypeInner::Struct { members, span } = &find(module, name).inner else {
        panic!("{name} is a struct");
    };
    let is_padding = |name: &str| name.starts_with("padding");
    let members: Vec<_> = members
        .iter()
        .map(|member| (member.name.as_deref().unwrap_or_default(), member))
        .filter(|(name, _)| !is_padding(name))
        .map(|(name, member)| {
            let size = module.types[member.ty].inner.size(module.to_ctx());
            (name, member.offset as usize, size as usize)
        })
        .collect();
    // Nothing of the host's struct may be missing in the list of its fields.
    let mut end = 0;
    for (field, offset, size) in &fields {
        assert_eq!(*offset, end, "{name}: the list of fields has all of them up to {field}");
        end += size;
    }
    assert_eq!(end, size, "{name}: the list of fields has all of them");
    let named: Fields = fields.into_iter().filter(|(field, ..)| !is_padding(field)).collect();
    assert_eq!(members, named, "{name}");
    assert_eq!(*span as usize, size, "{name}");
}

#[test]
fn structs_are_laid_out_as_the_host_writes_them() {
    let module = module();
    let work = fields!(Work: first first_high count samples end_sample stride sample rounds);
    assert_same(&module, "Work", work);
    let globals = fields!(Globals:
        work camera_position lens_radius camera_right focus_distance camera_up half_width camera_forward
        half_height grid_center grid_columns distribution_starts_at distribution_masks_at
        distribution_ranks_at distribution_tiles_at distribution_last_at distribution_of_cell_at
        words_per_distribution grid_rows map_width map_height tile_columns tile_rows rotation_turns
        intensity tile_sums_at distant_light_count light_triangle_count width height seed bounces
        russian_roulette orthographic scene_extent mean_contribution zero grid_medium whole_map_share
        fog_low fog_mean_cosine fog_high tries_per_vertex fog_scattering importance_scale fog_extinction
        first_of_sequence background background_concentration film_scale opaque_triangles cache_is_known
        cache_scale cache_center cache_edge cache_mean cache_least_distance first_of_instances slot_log2
        targets_at target_count targets_root aim_probability padding_0 padding_1);
    assert_same(&module, "Globals", globals);
    let ray = fields!(CastRay: origin t_max direction padding);
    assert_same(&module_of(Kernel::ClosestHits), "CastRay", ray);
}

/// The value of a `u32` constant of the shaders.
fn constant(module: &Module, name: &str) -> usize {
    let mut constants = module.constants.iter().map(|(_, constant)| constant);
    let found = constants.find(|constant| constant.name.as_deref() == Some(name));
    let found = found.unwrap_or_else(|| panic!("the shaders have a constant {name}"));
    let is_word = module.types[found.ty].inner.scalar_kind() == Some(ScalarKind::Uint);
    match module.global_expressions[found.init] {
        Expression::Literal(Literal::U32(value)) if is_word => value as usize,
        ref other => panic!("{name} is a number, not {other:?}"),
    }
}

/// Materials and references to textures are read texel by texel, by numbers in the shaders.
#[test]
fn packed_arrays_are_laid_out_as_the_shaders_number_them() {
    const TEXEL: usize = 16;
    let module = module();
    let at = |name| constant(&module, name) * TEXEL;
    let (size, fields) = fields!(Material:
        base_color emissive alpha_cutoff specular_color specular absorption ior metallic roughness
        transmission clearcoat clearcoat_roughness normal_scale clearcoat_normal_scale flags textures
        padding scattering scatter_mean_cosine anisotropy anisotropy_rotation
        sheen_roughness sheen_color dispersion diffuse_transmission_color diffuse_transmission
        iridescence iridescence_ior iridescence_thickness
    );
    assert_eq!(at("MATERIAL_TEXELS"), size);
    assert_eq!(fields.iter().map(|(.., size)| size).sum::<usize>(), size);
    // Each texel's name says what is in it.
    for (texel, fields) in [
        ("BASE_COLOR_ALPHA", &[offset_of!(Material, base_color)][..]),
        ("EMISSIVE_CUTOFF", &[offset_of!(Material, emissive), offset_of!(Material, alpha_cutoff)]),
        (
            "SPECULAR_COLOR_STRENGTH",
            &[offset_of!(Material, specular_color), offset_of!(Material, specular)],
        ),
        ("ABSORPTION_IOR", &[offset_of!(Material, absorption), offset_of!(Material, ior)]),
        (
            "SHEEN_COLOR_DISPERSION",
            &[offset_of!(Material, sheen_color), offset_of!(Material, dispersion)],
        ),
        (
            "DIFFUSE_TRANSMISSION",
            &[
                offset_of!(Material, diffuse_transmission_color),
                offset_of!(Material, diffuse_transmission),
            ],
        ),
        (
            "SCATTERING",
            &[offset_of!(Material, scattering), offset_of!(Material, scatter_mean_cosine)],
        ),
    ] {
        let expected = [at(texel), at(texel) + 12];
        assert_eq!(fields, &expected[..fields.len()], "{texel}");
    }
    let four = |texel| [0, 4, 8, 12].map(|component| at(texel) + component);
    let factors = [
        offset_of!(Material, metallic),
        offset_of!(Material, roughness),
        offset_of!(Material, transmission),
        offset_of!(Material, clearcoat),
    ];
    assert_eq!(factors, four("FACTORS"));
    let rotation = offset_of!(Material, anisotropy_rotation);
    let sheen_roughness = offset_of!(Material, sheen_roughness);
    let anisotropy = [offset_of!(Material, anisotropy), rotation, rotation + 4, sheen_roughness];
    assert_eq!(anisotropy, four("ANISOTROPY_SHEEN_ROUGHNESS"));
    let thickness = offset_of!(Material, iridescence_thickness);
    let film = [
        offset_of!(Material, iridescence),
        offset_of!(Material, iridescence_ior),
        thickness,
        thickness + 4,
    ];
    assert_eq!(film, four("FILM"));
    let scales = [
        offset_of!(Material, clearcoat_roughness),
        offset_of!(Material, normal_scale),
        offset_of!(Material, clearcoat_normal_scale),
        offset_of!(Material, flags),
    ];
    assert_eq!(scales, four("SCALES_FLAGS"));
    assert_eq!(offset_of!(Material, textures), at("FIRST_TEXTURES"));
    assert_eq!(size_of_field(|m: &Material| &m.textures), 4 * constant(&module, "TEXTURES"));

    // `sample_texture` takes three texels apart.
    let reference = [
        offset_of!(TextureRef, first_texel),
        offset_of!(TextureRef, width),
        offset_of!(TextureRef, height),
        offset_of!(TextureRef, flags),
        offset_of!(TextureRef, matrix),
        offset_of!(TextureRef, translation),
    ];
    assert_eq!(reference, [0, 4, 8, 12, 16, 32]);
    assert_eq!(size_of::<TextureRef>(), 3 * TEXEL);
}
