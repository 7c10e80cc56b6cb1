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
    /// Direction towards the top of the picture, of any length; `None` is that of [`Camera::look_at`].
    pub up: Option<DVec3>,
    /// Its lengths are those of the file.
    pub projection: Projection,
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
        let (eye, target) = (frame.point(self.eye), frame.point(self.target));
        let up = self.up.map_or_else(|| Camera::usual_up(eye - target), |up| up.as_vec3());
        let mut projection = self.projection;
        if let Projection::Orthographic { half_height } = &mut projection {
            *half_height = frame.length(*half_height);
        }
        Camera { projection, ..Camera::facing(eye, target, up, 1.0) }
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

    /// A pinhole camera at `eye` that looks at `target`, its picture upright: +Y is up, +Z where it looks along Y.
    pub fn look_at(eye: Vec3, target: Vec3, fov_y_radians: f32) -> Self {
        Self::facing(eye, target, Self::usual_up(eye - target), fov_y_radians)
    }

    /// Up, for a camera with this vector behind it.
    fn usual_up(back: Vec3) -> Vec3 {
        if back.normalize_or(Vec3::Z).y.abs() > 0.999 { Vec3::Z } else { Vec3::Y }
    }

    fn facing(eye: Vec3, target: Vec3, up: Vec3, fov_y_radians: f32) -> Self {
        let z = (eye - target).normalize_or(Vec3::Z);
        let x = up.cross(z).normalize_or(z.any_orthonormal_vector());
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
