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
    /// Direction that points to the top of the picture, instead of the Y axis, for a camera at --eye.
    #[arg(long, value_parser = values::vector, requires = "eye", allow_hyphen_values = true, value_name = "X,Y,Z", help_heading = "Camera")]
    up: Option<DVec3>,
    /// Vertical field of view in degrees.
    #[arg(long, value_parser = values::positive, value_name = "DEG", help_heading = "Camera")]
    fov: Option<f64>,
    /// Parallel projection for a camera at --eye: metres from the bottom to the top of the picture.
    #[arg(long, value_parser = values::positive, requires = "eye", conflicts_with = "fov", value_name = "M", help_heading = "Camera")]
    parallel: Option<f64>,
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
        let is_up = |up: &DVec3| up.cross(target - eye).length_squared() > 0.0;
        if !self.up.as_ref().is_none_or(is_up) {
            return Err(Error::new("--up is the direction that the camera looks in"));
        }
        let fov_y_radians = self.fov_y_radians()?.unwrap_or(0.9);
        let projection = match self.parallel {
            Some(height) => Projection::Orthographic { half_height: 0.5 * height as f32 },
            None => Projection::Perspective { fov_y_radians },
        };
        Ok(Some(CameraPlace { eye, target, up: self.up, projection }))
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

#[cfg(test)]
mod tests {
    use clap::Parser as _;
    use glam::Vec3A;

    use super::*;
    use crate::scene::Frame;

    #[derive(Debug, clap::Parser)]
    struct Line {
        #[command(flatten)]
        place: CameraArguments,
    }

    fn place(words: &str) -> Result<CameraPlace> {
        let line = format!("view --eye 0,0,5 --target 0,0,0 {words}");
        let line = Line::try_parse_from(line.split_whitespace()).expect("options there are");
        line.place.placed().map(|place| place.expect("it is named"))
    }

    #[test]
    fn a_camera_is_rolled_and_sees_in_parallel() {
        let axis = |words: &str| {
            place(words).map(|it| it.camera(Frame::default()).world_from_camera.matrix3.y_axis)
        };
        assert_eq!(axis("").expect("sound"), Vec3A::Y);
        assert_eq!(axis("--up=2,0,1").expect("sound"), Vec3A::X);
        let refused = axis("--up 0,0,1").expect_err("no direction of the picture");
        assert!(refused.to_string().contains("--up is the direction"), "{refused}");
        let scaled = Frame { scale: 4.0, ..Frame::default() };
        let seen = place("--parallel 3").expect("sound").camera(scaled).projection;
        assert_eq!(seen, Projection::Orthographic { half_height: 6.0 });
    }
}
