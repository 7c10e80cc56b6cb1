//! Constants that shaders share with their Rust twins, which alone say what they are.

use glam::Vec3;

use super::layout::{DIRECTIONAL_LIGHT, NO_TEXTURE, PUNCTUAL_WORDS, SPOT_LIGHT};
use super::layout::{WRAP_U_SHIFT, WRAP_V_SHIFT};
use crate::bsdf::{albedo, coat, interface, lobes, microfacet, rescatter, sheen};
use crate::light_grid::{WHOLE_MAP, cells, counters};
use crate::path::{self, light_tree, limits, shadows, sharing, splitting, train};
use crate::radiance_cache as cache;
use crate::render::{cpu, filter};
use crate::sampler;
use crate::scene::surface;

/// What a shader's constant can be.
pub(crate) trait Constant: Copy {
    /// As it is written in WGSL.
    fn wgsl(self) -> String;
}

impl Constant for u32 {
    fn wgsl(self) -> String {
        format!("{self}u")
    }
}

impl Constant for usize {
    fn wgsl(self) -> String {
        format!("{self}u")
    }
}

/// The shortest figures that give the same number back.
impl Constant for f32 {
    fn wgsl(self) -> String {
        format!("{self:?}f")
    }
}

impl Constant for Vec3 {
    fn wgsl(self) -> String {
        let [x, y, z] = self.to_array().map(Constant::wgsl);
        format!("vec3f({x}, {y}, {z})")
    }
}

/// Makes `shared`, all of them in WGSL, out of names and values.
macro_rules! constants {
    ($($name:ident: $value:expr,)+) => {
        pub(super) fn shared() -> String {
            use $crate::render::gpu::constants::Constant as _;
            [$(format!("const {} = {};\n", stringify!($name), $value.wgsl())),+].concat()
        }
    };
}
pub(crate) use constants;

constants! {
    ALBEDO_NODES: albedo::COSINES,
    ALBEDO_ONE: cache::ALBEDO_ONE,
    CACHE_CHECK_SEED: cache::CHECK_SEED,
    CACHE_PARENT: cache::PARENT,
    CACHE_PROBES: cache::MAX_PROBES,
    CACHE_SLOTS: cache::SLOTS,
    CACHE_WORDS: cache::WORDS,
    COAT_F0: coat::F0,
    DIRECTIONAL_LIGHT: DIRECTIONAL_LIGHT,
    FILTER_RADIUS: filter::FILTER_RADIUS,
    FILTER_STEPS: filter::STEPS,
    LEARNING_SEED: cpu::LEARNING_SEED,
    MIN_CACHED_ALPHA: splitting::MIN_CACHED_ALPHA,
    MIN_SHARED_ALPHA: splitting::MIN_SHARED_ALPHA,
    MIN_WHOLE_ALPHA: splitting::MIN_WHOLE_ALPHA,
    MIN_COMPONENT: crate::medium::MIN_COMPONENT,
    MIN_NARROW: splitting::MIN_NARROW,
    MIN_SHARED_NARROW: splitting::MIN_SHARED_NARROW,
    MIN_COSINE: light_tree::MIN_COSINE,
    MIN_SHARE: train::MIN_SHARE,
    MIN_SURVIVAL: limits::MIN_SURVIVAL,
    LIGHT_LEAF: light_tree::LEAF,
    MAX_INTERFACES: limits::MAX_INTERFACES,
    MAX_NARROW_SHARE: lobes::MAX_NARROW_SHARE,
    MAX_PASSES: limits::MAX_PASSES,
    MAX_WEIGHT: counters::MAX_WEIGHT,
    MEDIUM_FACE: cells::MEDIUM_FACE,
    MIN_COSINE_SHARE: surface::MIN_COSINE_SHARE,
    MIN_MIRROR_COSINE: surface::MIN_MIRROR_COSINE,
    MIN_TILT: surface::MIN_TILT,
    MAX_TILT: surface::MAX_TILT,
    MIN_SHEEN_ROUGHNESS: sheen::MIN_ROUGHNESS,
    MAX_COUNTED: path::MAX_COUNTED,
    MAX_TIMES: train::MAX_TIMES,
    NEAREST_SQUARED: light_tree::NEAREST_SQUARED,
    NO_TEXTURE: NO_TEXTURE,
    PAIRS_OF_ESTIMATES: sampler::PAIRS_OF_ESTIMATES,
    PUNCTUAL_WORDS: PUNCTUAL_WORDS,
    RESCATTER_INDEX: rescatter::MAX_INDEX,
    RESCATTER_INDICES: rescatter::INDICES,
    RESCATTER_MIN_LOSS: rescatter::MIN_LOSS,
    RESCATTER_NODES: rescatter::NODES,
    ROULETTE_AFTER: limits::ROULETTE_AFTER,
    ROULETTE_MILDNESS: limits::ROULETTE_MILDNESS,
    SHADOW_RAY_SHARE: shadows::SHADOW_RAY_SHARE,
    SHEEN_NODES: sheen::COSINES,
    SHEEN_TYPICAL: sheen::Sheen::TYPICAL,
    SMOOTH_ALPHA: microfacet::SMOOTH_ALPHA,
    SPOT_LIGHT: SPOT_LIGHT,
    STRAIGHT_ETA: interface::STRAIGHT_ETA,
    TILE_SEED: sharing::TILE_SEED,
    TRAINING_SEED: cpu::TRAINING_SEED,
    TRAINING_VERTICES: path::TRAINING_VERTICES,
    TRUE_COSINE_SHARE: sharing::TRUE_COSINE_SHARE,
    TRUE_MIRROR_COSINE: sharing::TRUE_MIRROR_COSINE,
    TRUE_MIRROR_SHARE: sharing::TRUE_MIRROR_SHARE,
    WEIGHT_ONE: counters::WEIGHT_ONE,
    WHOLE_MAP: WHOLE_MAP,
    WRAP_U_SHIFT: WRAP_U_SHIFT,
    WRAP_V_SHIFT: WRAP_V_SHIFT,
}
