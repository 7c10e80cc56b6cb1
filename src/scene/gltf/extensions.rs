//! Which extensions are honoured, and what is said about the others.

use super::limits::Fallible;
use super::objects::Objects;
use crate::error::Notices;

/// Extensions that are rendered.
pub(super) const SUPPORTED: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
];

/// So many that are not supported are named.
const MAX_NAMED: usize = 10;

/// Refuses a file that requires what is not supported; a notice where it is only used.
pub(super) fn check(
    used: &Objects<'_, String>,
    required: &Objects<'_, String>,
    notices: &mut Notices,
) -> Fallible<()> {
    let missing = unsupported(required)?;
    if !missing.is_empty() {
        let plural = if missing.len() > 1 { "s" } else { "" };
        let names = missing.join(", ");
        return Err(format!("it requires the extension{plural} {names}, not supported here"));
    }
    for name in unsupported(used)? {
        notices.add(format!("the extension {name} is not supported; what it adds is left out"));
    }
    Ok(())
}

/// The first of them.
fn unsupported(names: &Objects<'_, String>) -> Fallible<Vec<String>> {
    let names = names.indices().map(|index| names.get(index));
    let is_unknown =
        |name: &Fallible<String>| name.as_ref().map_or(true, |it| !SUPPORTED.contains(&&**it));
    names.filter(is_unknown).take(MAX_NAMED).collect()
}
