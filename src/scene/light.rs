//! Point, spot and directional lights.

use glam::Vec3;

/// Shape of a punctual light (`KHR_lights_punctual`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PunctualKind {
    /// Same radiant intensity in all directions.
    Point,
    /// A cone; full inside `inner`, nothing outside `outer` (half angles in radians).
    Spot {
        /// Half angle of full intensity.
        inner_radians: f32,
        /// Half angle of the cone.
        outer_radians: f32,
    },
    /// Parallel light; `intensity` is irradiance on a facing plane.
    Directional,
}

/// A light without size.
#[derive(Debug, Clone, PartialEq)]
pub struct PunctualLight {
    /// Name in the file.
    pub name: String,
    /// Shape.
    pub kind: PunctualKind,
    /// World position in metres (unused by directional lights).
    pub position: Vec3,
    /// Unit world direction the light travels in (unused by point lights).
    pub direction: Vec3,
    /// Linear colour times radiant intensity (point, spot) or irradiance (directional).
    pub intensity: Vec3,
    /// Metres beyond which nothing is lit; infinite if not limited.
    pub range: f32,
}
