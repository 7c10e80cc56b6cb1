//! Where a picture is taken from.

use glam::Vec3;

use super::values;
#[cfg(feature = "window")]
use crate::app::document::Viewpoint;
use crate::error::{Error, Result};
use crate::scene::{Camera, Projection};

/// A place, in place of a camera of the file.
#[derive(Debug, Clone, Default, PartialEq, clap::Args)]
pub(super) struct CameraArguments {
    /// Camera position in metres, instead of a camera of the file.
    #[arg(long, value_parser = values::vector, requires = "target", allow_hyphen_values = true, value_name = "X,Y,Z", help_heading = "Camera")]
    pub(super) eye: Option<Vec3>,
    /// What the camera at --eye looks at.
    #[arg(long, value_parser = values::vector, requires = "eye", allow_hyphen_values = true, value_name = "X,Y,Z", help_heading = "Camera")]
    pub(super) target: Option<Vec3>,
    /// Vertical field of view in degrees.
    #[arg(long, value_parser = values::positive, value_name = "DEG", help_heading = "Camera")]
    fov: Option<f64>,
}

impl CameraArguments {
    /// The camera at the place, if one is named.
    ///
    /// # Errors
    /// If it looks at where it is, or on more than half of all.
    pub(super) fn placed(&self) -> Result<Option<Camera>> {
        let Some((eye, target)) = self.eye.zip(self.target) else { return Ok(None) };
        if eye == target {
            return Err(Error::new("--eye and --target are the same point"));
        }
        self.with_fov(Camera::look_at(eye, target, 0.9)).map(Some)
    }

    /// A camera with the field of view, if one is named.
    ///
    /// # Errors
    /// If it is more than half of all.
    pub(super) fn with_fov(&self, camera: Camera) -> Result<Camera> {
        let Some(degrees) = self.fov else { return Ok(camera) };
        if degrees >= 179.0 {
            return Err(Error::new(format!("--fov {degrees}: must be below 179 degrees")));
        }
        let projection = Projection::Perspective { fov_y_radians: degrees.to_radians() as f32 };
        Ok(Camera { projection, ..camera })
    }

    /// The same for the window, which knows no camera of the file when it starts.
    ///
    /// # Errors
    /// As [`Self::placed`], and if there is but a field of view.
    #[cfg(feature = "window")]
    pub(super) fn viewpoint(&self) -> Result<Option<Viewpoint>> {
        if self.fov.is_some() && self.eye.is_none() {
            return Err(Error::new("--fov is that of a camera at --eye, which is not given"));
        }
        Ok(self.placed()?.map(|camera| Viewpoint::of(&camera, camera.focus_distance)))
    }
}
