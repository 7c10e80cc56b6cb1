//! Surfaces with narrow and broad lobes: a path meets one kind of them where only broad ones are shared or cached.

use crate::scene::MAX_POLISH_ROUGHNESS;

/// Minimum GGX alpha of lobes that pixels share where a BSDF is split: narrower ones gain more alone.
pub(crate) const MIN_SHARED_ALPHA: f32 = 0.02;
/// The same where it stays whole: narrower reflections are not seen alike from two pixels.
pub(crate) const MIN_WHOLE_ALPHA: f32 = 0.01;
/// Minimum GGX alpha of a surface that sends back much the same to all sides, so that it can be cached.
pub(crate) const MIN_CACHED_ALPHA: f32 = 0.05;
const _: () = assert!(
    MAX_POLISH_ROUGHNESS * MAX_POLISH_ROUGHNESS >= MIN_CACHED_ALPHA
        && MIN_CACHED_ALPHA >= MIN_SHARED_ALPHA,
    "kernels split lobes only where materials are polished"
);

/// Minimum probability of the narrow part of a BSDF. Both minima were chosen by the error of rooms with polished and
/// varnished surfaces: docs/notebook/tried.md.
pub(crate) const MIN_NARROW: f32 = 0.1;
/// The same at second vertices, whose broad part is shared.
pub(crate) const MIN_SHARED_NARROW: f32 = 0.4;

/// What a path's vertices are used for, apart from the path itself.
#[derive(Clone, Copy)]
pub(super) enum UseOfVertices {
    None,
    /// Pixels of a tile share the second.
    Shared,
    /// So many first ones train the radiance cache.
    Training(u32),
    /// Those after the first end the path in that cache.
    Cached,
}

impl UseOfVertices {
    /// Of a path that shares nothing and trains nothing.
    pub(super) fn alone(has_cache: bool) -> Self {
        if has_cache { Self::Cached } else { Self::None }
    }

    /// Minimum GGX alpha of broad lobes at the vertex that follows `bounces` others; `None` where BSDFs stay whole.
    pub(super) fn min_alpha(self, bounces: u32) -> Option<f32> {
        match self {
            Self::Shared if bounces < 2 => Some(MIN_SHARED_ALPHA),
            Self::Training(vertices) if bounces < vertices => Some(MIN_CACHED_ALPHA),
            Self::Cached if bounces > 0 => Some(MIN_CACHED_ALPHA),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::bsdf::Bsdf;
    use crate::path::materials::ReadyMaterial;
    use crate::scene::Material;

    /// Kernels have code for parts of BSDFs only where materials may be polished.
    #[test]
    fn only_polished_materials_are_split() {
        let mut random = crate::sampler::SplitMix(3);
        let mut counts = [0; 2];
        for _ in 0..20_000 {
            let mut pick = |values: &[f32]| values[random.below(values.len())];
            let material = Material {
                base_color: Vec3::splat(pick(&[0.02, 0.8])).extend(1.0),
                metallic: pick(&[0.0, 0.5, 1.0, 1.0]),
                roughness: pick(&[0.0, 0.1, 0.2, 0.23, 0.6]),
                specular: pick(&[0.0, 1.0]),
                clearcoat: pick(&[0.0, 0.0, 0.1, 1.0]),
                clearcoat_roughness: pick(&[0.0, 0.1, 0.22, 0.23, 0.6]),
                sheen_color: Vec3::splat(pick(&[0.0, 0.0, 0.5])),
                sheen_roughness: 0.5,
                anisotropy: pick(&[0.0, 0.0, 0.3]),
                iridescence: pick(&[0.0, 0.0, 1.0]),
                ..Material::lambert(0.5)
            };
            let ready = ReadyMaterial::new(&material);
            let bsdf = Bsdf::new(&ready.shared.parameters, true);
            let wo = Vec3::new(0.0, 1.0, pick(&[0.05, 0.5, 3.0])).normalize();
            let part = bsdf.split(MIN_CACHED_ALPHA, (wo, MIN_NARROW), || 0.5);
            assert!(part.is_none() || material.may_be_polished(), "{material:?}");
            counts[usize::from(part.is_some())] += 1;
        }
        assert!(counts.iter().all(|count| *count > 1500), "{counts:?}");
    }
}
