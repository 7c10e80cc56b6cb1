//! How many texels a vertex and a slot take on the device, and what lies in which.

use super::features::{Features, KernelFeatures, ViewFeatures};
use crate::scene::needs::SceneFeatures;

/// Texels of a vertex: two, and one for each of these that the scene needs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct VertexTexels {
    pub(crate) count: u32,
    pub(crate) second_uv: u32,
    pub(crate) tangent: u32,
    pub(crate) color: u32,
}

impl VertexTexels {
    pub(crate) fn of(features: Features) -> Self {
        let mut count = 2;
        let mut next = |is_needed| {
            let at = count;
            count += u32::from(is_needed);
            at
        };
        let second_uv = next(features.scene.contains(SceneFeatures::SECOND_UV_SET));
        let tangent = next(features.tangents());
        let color = next(features.scene.contains(SceneFeatures::VERTEX_COLORS));
        Self { count, second_uv, tangent, color }
    }
}

/// Texels of a slot: what every path has, and what only some pictures need.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct SlotTexels {
    pub(crate) count: u32,
    pub(super) receiver: u32,
    pub(super) body: u32,
    pub(super) first_hit: u32,
    pub(super) map_shadow: u32,
    pub(super) lamp_shadow: u32,
    pub(super) departure: u32,
}

impl SlotTexels {
    pub(crate) fn of(Features { scene, view, kernel }: Features) -> Self {
        let mut count = 7;
        let mut next = |is_needed, texels| {
            let at = count;
            count += if is_needed { texels } else { 0 };
            at
        };
        let body_texels = if view.contains(ViewFeatures::MEDIUM) { 2 } else { 1 };
        let receiver = next(scene.contains(SceneFeatures::EMITTERS), 2);
        let body = next(scene.contains(SceneFeatures::SOLID_TRANSMISSION), body_texels);
        let looks = if scene.contains(SceneFeatures::PERFECT_INTERFACES) { 4 } else { 2 };
        let first_hit = next(view.contains(ViewFeatures::LAYERS), looks);
        // What is asked for where a ray meets glass.
        let is_clear = scene.contains(SceneFeatures::CLEAR_SOLIDS);
        let [of_map, of_lamp] = if is_clear { [6, 8] } else { [4, 4] };
        // Paths behind second vertices follow their shadows at once.
        let waits = |light| view.contains(light) && !kernel.contains(KernelFeatures::SHARING);
        let map_shadow = next(waits(ViewFeatures::MAP_SAMPLING), of_map);
        let lamp_shadow = next(waits(ViewFeatures::LOCAL_LIGHTS), of_lamp);
        let departure = next(is_clear, 2);
        Self { count, receiver, body, first_hit, map_shadow, lamp_shadow, departure }
    }
}
