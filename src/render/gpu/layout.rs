//! What the shaders read, as bytes: twins of the structs in `shaders/`, checked through naga in the
//! tests.

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3, Vec4};

use super::super::View;
use super::texels::VertexTexels;
use crate::color::importance;
use crate::environment::Environment;
use crate::light_grid::LightGrid;
use crate::light_grid::cells::SphericalGrid;
use crate::medium::{Fog, Phase};
use crate::path::aim_targets::Aiming;
use crate::path::background::{Background, concentration};
use crate::path::camera::CameraRays;
use crate::path::light_tree::Node;
use crate::path::{LocalLights, World};
use crate::radiance_cache::CacheCells;
use crate::scene::surface::absorption;
use crate::scene::{self, AlphaMode, PunctualKind, Scene};

/// No distribution of cells.
pub(crate) const NO_ARRAY: u32 = u32::MAX;
/// A material without this texture.
pub(crate) const NO_TEXTURE: u32 = u32::MAX;

/// Twin of `Work` in `globals.wgsl`.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Work {
    pub(crate) first: u32,
    pub(crate) first_high: u32,
    pub(crate) count: u32,
    pub(crate) samples: u32,
    pub(crate) end_sample: u32,
    pub(crate) stride: u32,
    pub(crate) sample: u32,
    pub(crate) rounds: u32,
}

/// Twin of `Globals` in `globals.wgsl`.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Globals {
    pub(crate) work: Work,
    pub(crate) camera_position: Vec3,
    pub(crate) lens_radius: f32,
    pub(crate) camera_right: Vec3,
    pub(crate) focus_distance: f32,
    pub(crate) camera_up: Vec3,
    pub(crate) half_width: f32,
    pub(crate) camera_forward: Vec3,
    pub(crate) half_height: f32,
    pub(crate) grid_center: Vec3,
    pub(crate) grid_columns: u32,
    pub(crate) distribution_starts_at: u32,
    pub(crate) distribution_masks_at: u32,
    pub(crate) distribution_ranks_at: u32,
    pub(crate) distribution_tiles_at: u32,
    pub(crate) distribution_last_at: u32,
    pub(crate) distribution_of_cell_at: u32,
    pub(crate) words_per_distribution: u32,
    pub(crate) grid_rows: u32,
    pub(crate) map_width: u32,
    pub(crate) map_height: u32,
    pub(crate) tile_columns: u32,
    pub(crate) tile_rows: u32,
    pub(crate) rotation_turns: f32,
    pub(crate) intensity: f32,
    pub(crate) tile_sums_at: u32,
    pub(crate) distant_light_count: u32,
    pub(crate) light_triangle_count: u32,
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) seed: u32,
    pub(crate) bounces: u32,
    pub(crate) russian_roulette: u32,
    pub(crate) orthographic: u32,
    pub(crate) scene_extent: f32,
    pub(crate) mean_contribution: f32,
    pub(crate) zero: u32,
    pub(crate) grid_medium: u32,
    pub(crate) whole_map_share: u32,
    pub(crate) fog_low: Vec3,
    pub(crate) fog_mean_cosine: f32,
    pub(crate) fog_high: Vec3,
    pub(crate) tries_per_vertex: u32,
    pub(crate) fog_scattering: Vec3,
    pub(crate) importance_scale: f32,
    pub(crate) fog_extinction: Vec3,
    pub(crate) first_of_sequence: u32,
    pub(crate) background: Vec3,
    pub(crate) background_concentration: f32,
    pub(crate) film_scale: f32,
    pub(crate) opaque_triangles: u32,
    pub(crate) cache_is_known: u32,
    pub(crate) cache_scale: f32,
    pub(crate) cache_center: Vec3,
    pub(crate) cache_edge: f32,
    pub(crate) cache_mean: Vec3,
    pub(crate) cache_least_distance: f32,
    pub(crate) first_of_instances: u32,
    pub(crate) slot_log2: u32,
    pub(crate) targets_at: u32,
    pub(crate) target_count: u32,
    pub(crate) targets_root: u32,
    pub(crate) aim_probability: f32,
    pub(crate) padding_0: u32,
    pub(crate) padding_1: u32,
}

/// A material, in texels that `surface.wgsl` numbers.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Material {
    pub(crate) base_color: Vec4,
    pub(crate) emissive: Vec3,
    pub(crate) alpha_cutoff: f32,
    pub(crate) specular_color: Vec3,
    pub(crate) specular: f32,
    pub(crate) absorption: Vec3,
    pub(crate) ior: f32,
    pub(crate) metallic: f32,
    pub(crate) roughness: f32,
    pub(crate) transmission: f32,
    pub(crate) clearcoat: f32,
    pub(crate) clearcoat_roughness: f32,
    pub(crate) normal_scale: f32,
    pub(crate) clearcoat_normal_scale: f32,
    pub(crate) flags: u32,
    pub(crate) textures: [u32; 17],
    pub(crate) padding: [u32; 3],
    pub(crate) scattering: Vec3,
    pub(crate) scatter_mean_cosine: f32,
    pub(crate) anisotropy: f32,
    pub(crate) anisotropy_rotation: Vec2,
    pub(crate) sheen_roughness: f32,
    pub(crate) sheen_color: Vec3,
    pub(crate) dispersion: f32,
    pub(crate) diffuse_transmission_color: Vec3,
    pub(crate) diffuse_transmission: f32,
    pub(crate) iridescence: f32,
    pub(crate) iridescence_ior: f32,
    pub(crate) iridescence_thickness: [f32; 2],
}

/// Where a texture lies and how it is read, in three texels that `texture.wgsl` takes apart.
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct TextureRef {
    pub(crate) first_texel: u32,
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) flags: u32,
    pub(crate) matrix: Vec4,
    pub(crate) translation: Vec2,
    pub(crate) padding: Vec2,
}

bitflags::bitflags! {
    /// Flags of `Material`; `shader.rs` writes them into the shaders.
    pub(super) struct MaterialFlags: u32 {
        const ALPHA_MASK = 1;
        const ALPHA_BLEND = 2;
        const DOUBLE_SIDED = 4;
        const UNLIT = 8;
        const THIN = 16;
        const PARTIAL = 32;
        const NORMAL_MAPPED = 64;
        const CLEAR_SOLID = 128;
        const BACKED = 256;
    }

    /// Flags of `TextureRef`; `shader.rs` writes them into the shaders.
    pub(super) struct TextureFlags: u32 {
        const SECOND_UV_SET = 1;
        const NEAREST = 2;
        const SRGB = 4;
        const DEEP = 8;
    }
}

/// Where the flags of `TextureRef` hold how it goes on outside of the picture, in 2 bits each.
pub(super) const WRAP_U_SHIFT: u32 = 4;
pub(super) const WRAP_V_SHIFT: u32 = 6;

impl Globals {
    /// Where the radiance cache's cells lie, and what a radiance of 1 counts.
    pub(crate) fn set_cells_of_cache(&mut self, cells: &CacheCells, scale: f32) {
        self.cache_center = cells.center;
        self.cache_edge = cells.edge;
        self.cache_least_distance = cells.least_distance;
        self.cache_scale = scale;
    }

    /// Sets what the view asks for.
    pub(crate) fn set_view(&mut self, view: &View, rays: &CameraRays) {
        self.camera_position = rays.position;
        self.camera_right = rays.right;
        self.camera_up = rays.up;
        self.camera_forward = rays.forward;
        self.half_width = rays.half_extent.x;
        self.half_height = rays.half_extent.y;
        self.lens_radius = rays.lens_radius;
        self.focus_distance = rays.focus_distance;
        self.orthographic = rays.orthographic.into();
        (self.width, self.height) = (view.width, view.height);
        self.seed = view.seed;
        match view.background {
            Background::Map | Background::None => {}
            Background::Blurred(radians) => {
                self.background_concentration = concentration(radians);
            }
            Background::Color(rgb) => self.background = rgb.into(),
        }
        self.bounces = view.limits.bounces;
        self.russian_roulette = view.limits.russian_roulette.into();
    }

    /// Sets what is known of the map.
    pub(crate) fn set_environment(&mut self, environment: &Environment) {
        (self.map_width, self.map_height) = (environment.map().width, environment.map().height);
        (self.tile_columns, self.tile_rows) = environment.tile_grid();
        (self.rotation_turns, self.intensity) = environment.rotation_and_intensity();
        self.importance_scale = environment.importance_scale;
        self.mean_contribution = std::f32::consts::PI * importance(environment.mean_radiance());
    }

    /// Sets what lies between surfaces.
    pub(crate) fn set_fog(&mut self, fog: Option<&Fog>) {
        let Some(fog) = fog else {
            (self.fog_low, self.fog_high) = (Vec3::ONE, Vec3::ZERO);
            return;
        };
        [self.fog_low, self.fog_high] = fog.bounds;
        self.fog_scattering = fog.interior.scattering;
        self.fog_extinction = fog.interior.extinction;
        self.fog_mean_cosine = fog.interior.phase.mean_cosine();
    }

    /// Sets where the cells lie.
    pub(crate) fn set_cells(&mut self, grid: &SphericalGrid) {
        self.grid_center = grid.center;
        self.grid_columns = grid.columns;
        self.grid_rows = grid.rows;
        self.grid_medium = grid.medium.into();
    }
}

/// Corners and material of each triangle.
pub(crate) fn triangles(scene: &Scene) -> Vec<[u32; 4]> {
    let corners = scene.triangles.iter().zip(&scene.triangle_materials);
    corners.map(|(&[a, b, c], &material)| [a, b, c, material]).collect()
}

/// Texels of each vertex: position and normal.x, normal.yz and first texture coordinates, then
/// those of `texels`.
pub(crate) fn vertices(scene: &Scene, texels: &VertexTexels) -> Vec<[f32; 4]> {
    let zero = [0.0; 4];
    let mut result = vec![zero; scene.positions.len() * texels.count as usize];
    let at = |values: &[Vec2], i: usize| values.get(i).copied().unwrap_or_default();
    for (i, vertex) in result.chunks_exact_mut(texels.count as usize).enumerate() {
        let normal = scene.normals.get(i).copied().unwrap_or_default();
        let uv = at(&scene.uvs[0], i);
        vertex[0] = scene.positions[i].extend(normal.x).to_array();
        vertex[1] = [normal.y, normal.z, uv.x, uv.y];
        let optional = [
            (texels.second_uv, at(&scene.uvs[1], i).extend(0.0).extend(0.0).to_array()),
            (texels.tangent, scene.tangents.get(i).map_or(zero, Vec4::to_array)),
            (texels.color, scene.colors.get(i).map_or(zero, Vec4::to_array)),
        ];
        // Where the scene does not need one, the next one has its place.
        for (index, value) in optional {
            if let Some(texel) = vertex.get_mut(index as usize) {
                *texel = value;
            }
        }
    }
    result
}

/// The distributions of a grid; sets where each array begins.
pub(crate) fn distributions(grid: &LightGrid, globals: &mut Globals) -> Vec<u32> {
    let distributions = grid.distributions();
    let mut words = Vec::new();
    let mut push = |part: &mut dyn Iterator<Item = u32>| {
        let at = words.len() as u32;
        words.extend(part);
        at
    };
    globals.distribution_starts_at = push(&mut distributions.starts.iter().copied());
    globals.distribution_masks_at =
        push(&mut distributions.masks.iter().flat_map(|mask| [*mask as u32, (mask >> 32) as u32]));
    globals.distribution_ranks_at = push(&mut pairs(&distributions.ranks));
    globals.distribution_tiles_at = push(&mut pairs(&distributions.tiles));
    globals.distribution_last_at = push(&mut distributions.last.iter().copied());
    globals.distribution_of_cell_at = NO_ARRAY;
    if let Some(cells) = &grid.cells {
        globals.distribution_of_cell_at = push(&mut pairs(&cells.distribution_of_cell));
        globals.set_cells(&cells.grid);
    }
    globals.whole_map_share = grid.whole_map_share;
    globals.words_per_distribution = distributions.words_per_distribution;
    words
}

/// Two 16-bit numbers a word.
fn pairs(values: &[u16]) -> impl Iterator<Item = u32> {
    let second = |pair: &[u16]| u32::from(pair.get(1).copied().unwrap_or(0));
    values.chunks(2).map(move |pair| u32::from(pair[0]) | second(pair) << 16)
}

/// Materials and the textures they refer to.
pub(crate) fn materials(world: &World) -> (Vec<Material>, Vec<TextureRef>) {
    let scene = &world.scene;
    let mut first_texels = Vec::with_capacity(scene.images.len());
    let mut texels = 0_u64;
    for image in &scene.images {
        first_texels.push(u32::try_from(texels).unwrap_or(u32::MAX));
        texels += image.texels.stored_len() as u64;
    }
    let mut refs = Vec::new();
    let mut reference = |texture: Option<&scene::TextureRef>| match texture {
        None => NO_TEXTURE,
        Some(texture) => {
            refs.push(texture_ref(scene, &first_texels, texture));
            refs.len() as u32 - 1
        }
    };
    let materials = scene
        .materials
        .iter()
        .enumerate()
        .map(|(index, m)| Material {
            base_color: m.base_color,
            // Of an unlit one it is a factor on what is seen.
            emissive: if m.unlit { Vec3::ONE } else { m.emissive },
            alpha_cutoff: if let AlphaMode::Mask { cutoff } = m.alpha_mode { cutoff } else { 0.0 },
            specular_color: m.specular_color,
            specular: m.specular,
            absorption: if m.thickness > 0.0 { absorption(m) } else { Vec3::ZERO },
            ior: m.ior,
            metallic: m.metallic,
            roughness: m.roughness,
            transmission: m.transmission,
            clearcoat: m.clearcoat,
            clearcoat_roughness: m.clearcoat_roughness,
            normal_scale: m.normal_scale,
            clearcoat_normal_scale: m.clearcoat_normal_scale,
            flags: flags(m, world.may_pass_light(index)),
            textures: m.textures.each_ref().map(|texture| reference(texture.as_deref())),
            scattering: m.scattering,
            scatter_mean_cosine: Phase::new(m.scatter_anisotropy).mean_cosine(),
            anisotropy: m.anisotropy,
            anisotropy_rotation: Vec2::from_angle(m.anisotropy_rotation),
            sheen_roughness: m.sheen_roughness,
            sheen_color: m.sheen_color,
            diffuse_transmission_color: m.diffuse_transmission_color,
            diffuse_transmission: m.diffuse_transmission,
            dispersion: m.dispersion,
            iridescence: m.iridescence,
            iridescence_ior: m.iridescence_ior,
            iridescence_thickness: m.iridescence_thickness,
            padding: [0; 3],
        })
        .collect();
    (materials, refs)
}

fn flags(m: &scene::Material, partial: bool) -> u32 {
    let mut flags = MaterialFlags::empty();
    flags.set(MaterialFlags::ALPHA_MASK, matches!(m.alpha_mode, AlphaMode::Mask { .. }));
    flags.set(MaterialFlags::ALPHA_BLEND, m.alpha_mode == AlphaMode::Blend);
    flags.set(MaterialFlags::DOUBLE_SIDED, m.double_sided);
    flags.set(MaterialFlags::UNLIT, m.unlit);
    flags.set(MaterialFlags::THIN, m.thickness <= 0.0);
    flags.set(MaterialFlags::PARTIAL, partial);
    flags.set(MaterialFlags::NORMAL_MAPPED, m.has_normal_map());
    flags.set(MaterialFlags::CLEAR_SOLID, m.is_clear_solid());
    flags.set(MaterialFlags::BACKED, m.backed);
    flags.bits()
}

fn texture_ref(scene: &Scene, first_texels: &[u32], reference: &scene::TextureRef) -> TextureRef {
    let texture = &scene.textures[reference.texture as usize];
    let image = &scene.images[texture.image as usize];
    let is_empty = image.texels.is_empty();
    let transform = reference.transform;
    let mut flags = TextureFlags::empty();
    flags.set(TextureFlags::SECOND_UV_SET, reference.uv_set == 1);
    flags.set(TextureFlags::NEAREST, texture.nearest);
    flags.set(TextureFlags::SRGB, texture.srgb);
    flags.set(TextureFlags::DEEP, image.texels.is_deep());
    let wrap = (texture.wrap_u as u32) << WRAP_U_SHIFT | (texture.wrap_v as u32) << WRAP_V_SHIFT;
    TextureRef {
        first_texel: first_texels[texture.image as usize],
        width: if is_empty { 0 } else { image.width },
        height: image.height,
        flags: flags.bits() | wrap,
        matrix: transform.matrix2.to_cols_array().into(),
        translation: transform.translation,
        padding: Vec2::ZERO,
    }
}

/// Kinds of lights as shaders know them; 0 is a point.
pub(super) const SPOT_LIGHT: u32 = 1;
pub(super) const DIRECTIONAL_LIGHT: u32 = 2;

/// Words of a light that is no triangle.
pub(super) const PUNCTUAL_WORDS: usize = 16;

/// Local lights as `light_tree.wgsl` and `lights.wgsl` read them; sets their numbers.
pub(crate) fn light_words(lights: &LocalLights, globals: &mut Globals) -> Vec<u32> {
    let LocalLights { triangles, punctual, tree, aiming, emission: _ } = lights;
    globals.light_triangle_count = triangles.len() as u32;
    globals.distant_light_count = tree.distant.len() as u32;
    let mut words = [triangles.as_slice(), &tree.leaves].concat();
    words.extend(tree.distant.iter().flat_map(|distant| [distant.share, distant.light]));
    for light in punctual {
        let (kind, cosines) = match light.kind {
            PunctualKind::Point => (0, [0.0; 2]),
            PunctualKind::Spot { inner_radians, outer_radians } => {
                (SPOT_LIGHT, [inner_radians.cos(), outer_radians.cos()])
            }
            PunctualKind::Directional => (DIRECTIONAL_LIGHT, [0.0; 2]),
        };
        let end = words.len() + PUNCTUAL_WORDS;
        words.push(kind);
        let vectors = [light.position, light.direction, light.intensity];
        let floats = vectors.iter().flat_map(Vec3::to_array).chain([light.range.min(f32::MAX)]);
        words.extend(floats.chain(cosines).map(f32::to_bits));
        words.resize(end, 0);
    }
    globals.targets_at = words.len() as u32;
    if let Some(Aiming { targets, probability }) = aiming {
        globals.target_count = targets.triangles.len() as u32;
        globals.targets_root = tree.nodes.len() as u32;
        globals.aim_probability = *probability;
        words.extend(&targets.triangles);
        words.extend(targets.tree.leaves.iter().map(|leaf| leaf + globals.targets_root));
    }
    words
}

/// Nodes of the lights' tree, and of that of aim targets behind it.
pub(crate) fn light_nodes(lights: &LocalLights) -> Vec<Node> {
    let mut nodes = lights.tree.nodes.clone();
    let root = nodes.len() as u32;
    if let Some(Aiming { targets, .. }) = &lights.aiming {
        nodes.extend(targets.tree.nodes.iter().map(|node| node.moved(root)));
    }
    nodes
}

/// Three 18-bit mantissas and a common exponent, twin of `unpack_radiance` in `environment.wgsl`.
/// A component is kept to 2^-18 of the largest one; below 1e-38 all is black.
pub(crate) fn pack_radiance(rgb: [f32; 3]) -> [u32; 2] {
    const BITS: i32 = 18;
    let largest = rgb[0].max(rgb[1]).max(rgb[2]);
    // Biased exponent, stored so that the mantissas count units of 2^(stored - 127 - 17).
    let stored = (largest.to_bits() >> 23) as i32;
    if stored == 0 {
        return [0; 2];
    }
    let pack = |stored: i32| {
        let units = 2.0_f64.powi(BITS - 1 + 127 - stored);
        rgb.map(|value| (f64::from(value) * units).round() as u32)
    };
    let is_rounded_up = |mantissas: &[u32; 3]| mantissas.iter().any(|m| *m >= 1 << BITS);
    let (exponent, [r, g, b]) = match pack(stored) {
        mantissas if !is_rounded_up(&mantissas) => (stored, mantissas),
        mantissas if stored == 254 => (stored, mantissas.map(|m| m.min((1 << BITS) - 1))),
        _ => (stored + 1, pack(stored + 1)),
    };
    [r | g << 18, g >> 14 | b << 4 | (exponent as u32) << 24]
}

/// `pack_radiance` undone, as the shader does it.
#[cfg(test)]
pub(super) fn unpack_radiance(words: [u32; 2]) -> [f32; 3] {
    let mantissas = [
        words[0] & 0x3_ffff,
        (words[0] >> 18 | words[1] << 14) & 0x3_ffff,
        words[1] >> 4 & 0x3_ffff,
    ];
    let scale = f32::from_bits(words[1] >> 24 << 23);
    mantissas.map(|m| m as f32 * (1.0 / 131_072.0) * scale)
}

/// Rows of the map's patches, then one over each tile's energy.
pub(crate) fn map_rows(environment: &Environment) -> impl Iterator<Item = [f32; 4]> {
    let rows = environment.patches.rows.iter();
    let energies = environment.inverse_energies.iter();
    rows.map(|row| [row.top, row.extent, row.solid_angle, 0.0])
        .chain(energies.map(|inverse| [*inverse, 0.0, 0.0, 0.0]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radiance_survives_packing_to_a_part_in_2_to_the_17() {
        for rgb in [
            [1.0, 0.5, 0.25],
            [1e-37, 1e-38, 0.0],
            [f32::MAX, 1.0, 0.0],
            [0.999_999_94, 0.3, 0.1],
            [65_504.0, 12.0, 3e4],
            [2e-30, 1e-30, 1.9e-30],
        ] {
            let largest = rgb.iter().copied().fold(0.0, f32::max);
            for (value, packed) in rgb.iter().zip(unpack_radiance(pack_radiance(rgb))) {
                assert!(packed.is_finite());
                let error = f64::from(packed - value).abs();
                assert!(error <= f64::from(largest) / 131_072.0, "{rgb:?}: {packed}");
            }
        }
        assert_eq!(unpack_radiance(pack_radiance([0.0; 3])), [0.0; 3]);
        assert_eq!(unpack_radiance(pack_radiance([f32::from_bits(1); 3])), [0.0; 3]);
    }
}
