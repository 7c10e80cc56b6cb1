//! Where what is rendered lies in its file: f32 is exact enough for scenes near the origin that are neither tiny nor
//! huge, so others are moved there, and scaled, before their coordinates are rounded.

use glam::{DAffine3, DVec3, Vec3};

use super::Medium;

/// Extents in metres that are rendered as they are.
const MIN_EXTENT: f64 = 0.5;
const MAX_EXTENT: f64 = 1e6;
/// How far from the origin, in extents of the scene, its centre may lie.
const MAX_DISTANCE: f64 = 16.0;
/// Extent that others are scaled to, within a factor of 2.
const EXTENT: f64 = 10.0;

with_defaults! {
    /// Scene coordinates are those of the file less `center`, times `scale`.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Frame {
        /// Of the scene in its file, metres.
        pub center: DVec3 = DVec3::ZERO,
        /// Above 0; a power of 2, so that it rounds nothing.
        pub scale: f64 = 1.0,
    }
}

impl Frame {
    /// The one that a scene is best rendered in, given the box around it in its file.
    pub(in crate::scene) fn suiting([low, high]: [DVec3; 2]) -> Self {
        let (center, extent) = (0.5 * (low + high), (high - low).max_element());
        let mut frame = Self::default();
        if extent > 0.0 && !(MIN_EXTENT..=MAX_EXTENT).contains(&extent) {
            frame.scale = (EXTENT / extent).log2().round().exp2();
        }
        let is_far = center.abs().max_element() > MAX_DISTANCE * extent;
        if is_far || frame.scale != 1.0 {
            frame.center = center;
        }
        if frame.scale.is_finite() && frame.center.is_finite() { frame } else { Self::default() }
    }

    /// Whether f32 is as exact in both.
    pub(in crate::scene) fn is_like(self, other: Self) -> bool {
        let distance = (self.center - other.center).abs().max_element() * self.scale;
        let ratio = (self.scale / other.scale).log2().abs();
        distance <= MAX_DISTANCE * EXTENT && ratio <= 3.0
    }

    /// Whether scene and file have the same coordinates.
    pub fn is_identity(self) -> bool {
        self == Self::default()
    }

    /// Scene from file.
    pub(in crate::scene) fn transform(self) -> DAffine3 {
        if self.is_identity() {
            return DAffine3::IDENTITY;
        }
        DAffine3::from_scale(DVec3::splat(self.scale)) * DAffine3::from_translation(-self.center)
    }

    /// A point of the scene, given it in the file's coordinates.
    pub fn point(self, in_file: DVec3) -> Vec3 {
        self.transform().transform_point3(in_file).as_vec3()
    }

    /// A length in the scene, given it in metres of the file.
    pub fn length(self, in_file: f32) -> f32 {
        (f64::from(in_file) * self.scale) as f32
    }

    /// A point in the file's coordinates, with the digits that an f32 has where they are those of the scene.
    pub fn point_in_file(self, point: Vec3) -> DVec3 {
        if self.is_identity() {
            return DVec3::from_array(point.to_array().map(in_digits));
        }
        point.as_dvec3() / self.scale + self.center
    }

    /// A length in metres of the file.
    pub fn length_in_file(self, length: f32) -> f32 {
        (f64::from(length) / self.scale) as f32
    }

    /// A medium of the scene, given its coefficients and box in the file's metres.
    pub fn medium(self, in_file: Medium) -> Medium {
        if self.is_identity() {
            return in_file;
        }
        Medium {
            bounds: in_file.bounds.map(|corners| corners.map(|it| self.point(it.as_dvec3()))),
            ..self.thinned(in_file)
        }
    }

    /// The same for a medium whose box is in scene coordinates.
    pub(in crate::scene) fn thinned(self, in_file: Medium) -> Medium {
        let per_metre = |coefficient: Vec3| (coefficient.as_dvec3() / self.scale).as_vec3();
        Medium {
            scattering: per_metre(in_file.scattering),
            absorption: per_metre(in_file.absorption),
            ..in_file
        }
    }
}

/// The shortest decimal number that rounds to this one.
pub(crate) fn in_digits(x: f32) -> f64 {
    x.to_string().parse().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn suiting(center: DVec3, extent: f64) -> Frame {
        Frame::suiting([-0.5, 0.5].map(|side| center + side * extent))
    }

    #[test]
    fn only_far_tiny_and_huge_scenes_are_moved() {
        for (center, extent, is_moved) in [
            (DVec3::ZERO, 10.0, false),
            (DVec3::new(150.0, 0.0, -150.0), 10.0, false),
            (DVec3::ZERO, 3e5, false),
            (DVec3::new(0.0, 0.0, 170.0), 10.0, true),
            (DVec3::new(512_000.0, 0.0, -5_173_000.0), 10.0, true),
            (DVec3::ZERO, 0.02, true),
            (DVec3::ZERO, 1e7, true),
        ] {
            let frame = suiting(center, extent);
            assert_eq!(!frame.is_identity(), is_moved, "{center} {extent}: {frame:?}");
            if is_moved {
                let size = extent * frame.scale;
                assert!((5.0..=20.0).contains(&size), "{extent}: {frame:?}");
                assert!(frame.point(center).length() < 5.0, "{center}: {frame:?}");
            }
        }
        let nothing = Frame::suiting([DVec3::INFINITY, DVec3::NEG_INFINITY]);
        assert!(suiting(DVec3::ZERO, 0.0).is_identity() && nothing.is_identity());
    }

    #[test]
    fn points_and_lengths_go_there_and_back() {
        let frame = Frame { center: DVec3::new(5e5, 3.0, -5e6), scale: 1024.0 };
        let point = frame.center + DVec3::new(0.25, -0.5, 0.125);
        assert_eq!(frame.point_in_file(frame.point(point)), point);
        assert_eq!(frame.length_in_file(frame.length(0.3)), 0.3);
        let fog = Medium { scattering: Vec3::splat(2048.0), ..Medium::default() };
        assert_eq!(frame.medium(fog).scattering, Vec3::splat(2.0));
    }
}
