//! Where a picture is taken from.

use glam::DVec3;

use super::values;
use crate::error::{Error, Result};
#[cfg(feature = "window")]
use crate::scene::StartView;
use crate::scene::{Camera, CameraPlace, Projection};

/// A place, in place of a camera of the file.
#[derive(Debug, Clone, Default, PartialEq, clap::Args)]
pub(super) struct CameraArguments {
    /// One of the file's cameras: its name, or its number counted from 0.
    #[arg(
        long,
        conflicts_with = "eye",
        allow_hyphen_values = true,
        value_name = "NAME|N",
        help_heading = "Camera"
    )]
    pub(super) camera: Option<String>,
    /// Camera position in metres, instead of a camera of the file.
    #[arg(long, value_parser = values::vector, requires = "target", allow_hyphen_values = true, value_name = "X,Y,Z", help_heading = "Camera")]
    pub(super) eye: Option<DVec3>,
    /// What the camera at --eye looks at.
    #[arg(long, value_parser = values::vector, requires = "eye", allow_hyphen_values = true, value_name = "X,Y,Z", help_heading = "Camera")]
    pub(super) target: Option<DVec3>,
    /// Vertical field of view in degrees.
    #[arg(long, value_parser = values::positive, value_name = "DEG", help_heading = "Camera")]
    fov: Option<f64>,
}

impl CameraArguments {
    /// The place, if one is named.
    ///
    /// # Errors
    /// If it looks at where it is, or on more than half of all.
    pub(super) fn placed(&self) -> Result<Option<CameraPlace>> {
        let Some((eye, target)) = self.eye.zip(self.target) else { return Ok(None) };
        if eye == target {
            return Err(Error::new("--eye and --target are the same point"));
        }
        Ok(Some(CameraPlace { eye, target, fov_y_radians: self.fov_y_radians()?.unwrap_or(0.9) }))
    }

    /// A camera with the field of view, if one is named.
    ///
    /// # Errors
    /// If it is more than half of all.
    pub(super) fn with_fov(&self, camera: Camera) -> Result<Camera> {
        let Some(fov_y_radians) = self.fov_y_radians()? else { return Ok(camera) };
        Ok(Camera { projection: Projection::Perspective { fov_y_radians }, ..camera })
    }

    fn fov_y_radians(&self) -> Result<Option<f32>> {
        match self.fov {
            Some(degrees) if degrees >= 179.0 => {
                Err(Error::new(format!("--fov {degrees}: must be below 179 degrees")))
            }
            fov => Ok(fov.map(|degrees| degrees.to_radians() as f32)),
        }
    }

    /// The same for the window, which knows no camera of the file when it starts.
    ///
    /// # Errors
    /// As [`Self::placed`], and if there is but a field of view.
    #[cfg(feature = "window")]
    pub(super) fn start_view(&self) -> Result<Option<StartView>> {
        if self.fov.is_some() && self.eye.is_none() {
            return Err(Error::new("--fov is that of a camera at --eye, which is not given"));
        }
        let named = || self.camera.clone().map(StartView::Camera);
        Ok(self.placed()?.map(StartView::Place).or_else(named))
    }
}
