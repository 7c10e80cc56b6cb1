//! Cameras.

use glam::{Affine3A, DVec3, Vec3};

use super::Frame;

/// What a camera does with distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// Pinhole or thin lens.
    Perspective {
        /// Full vertical field of view in radians.
        fov_y_radians: f32,
    },
    /// Parallel rays.
    Orthographic {
        /// Half the picture's height in metres.
        half_height: f32,
    },
}

/// A camera looking down its local -Z, +Y up.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Name in the file.
    pub name: String,
    /// World from camera; its scale is ignored.
    pub world_from_camera: Affine3A,
    /// Projection.
    pub projection: Projection,
    /// Radius of the thin lens in metres; 0 is a pinhole.
    pub lens_radius: f32,
    /// Distance in metres along the view axis at which the picture is sharp.
    pub focus_distance: f32,
}

/// Where a picture is taken from, in a file's coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraPlace {
    /// Metres.
    pub eye: DVec3,
    /// Metres; not the same point.
    pub target: DVec3,
    /// Full vertical field of view in radians.
    pub fov_y_radians: f32,
}

/// Where the first picture is taken from.
#[derive(Debug, Clone, PartialEq)]
pub enum StartView {
    /// From a place.
    Place(CameraPlace),
    /// Through the file's camera of this name or, if none has it, of this number, counted from 0.
    Camera(String),
}

impl CameraPlace {
    /// The camera there, in a scene that lies so in its file.
    pub fn camera(&self, frame: Frame) -> Camera {
        Camera::look_at(frame.point(self.eye), frame.point(self.target), self.fov_y_radians)
    }
}

impl Camera {
    /// Whether the same is seen through both.
    pub(crate) fn sees_like(&self, other: &Self) -> bool {
        let seen = |camera: &Self| {
            let focus = if camera.lens_radius > 0.0 { camera.focus_distance } else { 0.0 };
            (camera.world_from_camera, camera.projection, camera.lens_radius, focus)
        };
        seen(self) == seen(other)
    }

    /// The point straight ahead at which the picture is sharp.
    pub fn target(&self) -> Vec3 {
        let back = self.world_from_camera.matrix3.z_axis.normalize_or_zero();
        Vec3::from(self.world_from_camera.translation - back * self.focus_distance)
    }

    /// A pinhole camera at `eye` that looks at `target`.
    pub fn look_at(eye: Vec3, target: Vec3, fov_y_radians: f32) -> Self {
        let z = (eye - target).normalize_or(Vec3::Z);
        let up = if z.y.abs() > 0.999 { Vec3::Z } else { Vec3::Y };
        let x = up.cross(z).normalize();
        let rotation = glam::Mat3::from_cols(x, z.cross(x), z);
        Self {
            name: String::new(),
            world_from_camera: Affine3A::from_mat3_translation(rotation, eye),
            projection: Projection::Perspective { fov_y_radians },
            lens_radius: 0.0,
            focus_distance: (eye - target).length(),
        }
    }
}
