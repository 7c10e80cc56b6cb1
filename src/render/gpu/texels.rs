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
    /// Shaders' names of the parts that not all have, and the texel at which each begins.
    pub(super) parts: [(&'static str, u32); 6],
}

impl SlotTexels {
    pub(crate) fn of(features: Features) -> Self {
        let Features { scene, view, kernel } = features;
        let mut count = 7;
        let mut next = |is_needed, texels| {
            let at = count;
            count += if is_needed { texels } else { 0 };
            at
        };
        let body_texels = if view.contains(ViewFeatures::MEDIUM) { 2 } else { 1 };
        let looks = if scene.contains(SceneFeatures::PERFECT_INTERFACES) { 4 } else { 2 };
        // What is asked for where a ray meets glass.
        let is_clear = scene.contains(SceneFeatures::CLEAR_SOLIDS);
        let [of_map, of_lamp] = if is_clear { [6, 8] } else { [4, 4] };
        // Paths behind second vertices follow their shadows at once.
        let waits = |light| view.contains(light) && !kernel.contains(KernelFeatures::SHARING);
        let is_solid = scene.contains(SceneFeatures::SOLID_TRANSMISSION);
        let parts = [
            ("RECEIVER_TEXEL", next(features.area_sources(), 2)),
            ("BODY_TEXEL", next(is_solid, body_texels)),
            ("FIRST_HIT_TEXEL", next(view.contains(ViewFeatures::LAYERS), looks)),
            ("MAP_SHADOW_TEXEL", next(waits(ViewFeatures::MAP_SAMPLING), of_map)),
            ("LAMP_SHADOW_TEXEL", next(waits(ViewFeatures::LOCAL_LIGHTS), of_lamp)),
            ("DEPARTURE_TEXEL", next(is_clear, 2)),
        ];
        Self { count, parts }
    }
}
