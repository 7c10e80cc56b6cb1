//! From a point on the picture to a ray.

use glam::{Vec2, Vec3, Vec4};

use crate::bvh::Ray;
use crate::scene::{Camera, Projection};

/// A camera made ready for a picture of one size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraRays {
    /// Where the camera is.
    pub position: Vec3,
    pub(crate) right: Vec3,
    pub(crate) up: Vec3,
    /// To the middle of the picture at distance 1; not a unit vector where that is off the axis.
    pub(crate) forward: Vec3,
    /// Half extents of the picture at distance 1 (perspective) or in metres (orthographic).
    pub(crate) half_extent: Vec2,
    picture_size: Vec2,
    pub(crate) orthographic: bool,
    pub(crate) lens_radius: f32,
    pub(crate) focus_distance: f32,
}

impl CameraRays {
    /// Rays of `camera` through a picture of `width` x `height` pixels; the vertical extent is the
    /// camera's, the horizontal one follows from the picture's shape.
    pub fn new(camera: &Camera, width: u32, height: u32) -> Self {
        let axes = camera.world_from_camera.matrix3;
        let (half_height, orthographic) = match camera.projection {
            Projection::Perspective { fov_y_radians } => ((0.5 * fov_y_radians).tan(), false),
            Projection::Orthographic { half_height } => (half_height, true),
        };
        let picture_size = Vec2::new(width as f32, height as f32);
        Self {
            position: camera.world_from_camera.translation.into(),
            right: Vec3::from(axes.x_axis).normalize_or(Vec3::X),
            up: Vec3::from(axes.y_axis).normalize_or(Vec3::Y),
            forward: Vec3::from(-axes.z_axis).normalize_or(Vec3::NEG_Z),
            half_extent: Vec2::new(half_height * picture_size.x / picture_size.y, half_height),
            picture_size,
            orthographic,
            lens_radius: camera.lens_radius,
            focus_distance: camera.focus_distance,
        }
    }

    /// Rays through a part of the picture: `left` and `top` are its corner, `width` and `height` its
    /// size in pixels.
    pub fn cropped(mut self, [left, top]: [u32; 2], [width, height]: [u32; 2]) -> Self {
        let size = Vec2::new(width as f32, height as f32);
        let middle = (2.0 * Vec2::new(left as f32, top as f32) + size) / self.picture_size - 1.0;
        let shift = self.right * (middle.x * self.half_extent.x)
            - self.up * (middle.y * self.half_extent.y);
        if self.orthographic {
            self.position += shift;
        } else {
            self.forward += shift;
        }
        self.half_extent *= size / self.picture_size;
        self.picture_size = size;
        self
    }

    /// Whether [`Self::ray`] uses its second pair of random numbers.
    pub fn has_lens(&self) -> bool {
        self.lens_radius > 0.0
    }

    /// Ray through `pixel` (continuous pixel coordinates, origin at the top left corner); `lens` is
    /// a point of the unit square that is mapped to the thin lens.
    pub fn ray(&self, pixel: Vec2, lens: Vec2) -> Ray {
        let ndc = pixel / self.picture_size * 2.0 - 1.0;
        let offset =
            self.right * (ndc.x * self.half_extent.x) - self.up * (ndc.y * self.half_extent.y);
        let (mut origin, mut direction) = if self.orthographic {
            (self.position + offset, self.forward)
        } else {
            (self.position, self.forward + offset)
        };
        if self.lens_radius > 0.0 {
            let focus = origin + direction * self.focus_distance;
            let on_lens = disk_from_square(lens) * self.lens_radius;
            origin += self.right * on_lens.x + self.up * on_lens.y;
            direction = focus - origin;
        }
        Ray { origin, direction: direction.normalize(), t_min: 0.0, t_max: f32::INFINITY }
    }

    /// Rows that multiply a point, with 1 as its last component, or a direction, with 0: the quotients of the first two
    /// by the third are the pixel (continuous coordinates) at which it is seen through the middle of the lens. What is
    /// behind a perspective camera, and any direction for an orthographic one, has no positive third.
    pub(crate) fn projection(&self) -> [Vec4; 3] {
        let ahead = if self.orthographic { Vec4::W } else { self.row(self.up.cross(self.right)) };
        // The middle of the picture may lie off the axis.
        let middle = if self.orthographic { Vec3::ZERO } else { self.forward };
        let column = self.row(self.right) - ahead * middle.dot(self.right);
        let row = ahead * middle.dot(self.up) - self.row(self.up);
        let half = 0.5 * self.picture_size;
        [
            column * (half.x / self.half_extent.x) + ahead * half.x,
            row * (half.y / self.half_extent.y) + ahead * half.y,
            ahead,
        ]
    }

    /// Multiplies points, relative to the camera, and directions.
    fn row(&self, axis: Vec3) -> Vec4 {
        axis.extend(-axis.dot(self.position))
    }

    /// How far along its ray a point is that the camera sees.
    pub(crate) fn depth(&self, point: Vec4) -> f32 {
        let way = point.truncate() - self.position;
        if self.orthographic { way.dot(self.forward) } else { way.length() }
    }
}

/// Unit square to unit disk, keeping areas and neighbourhoods (Shirley and Chiu 1997).
pub(crate) fn disk_from_square(u: Vec2) -> Vec2 {
    let p = 2.0 * u - 1.0;
    if p == Vec2::ZERO {
        return Vec2::ZERO;
    }
    let (radius, angle) = if p.x.abs() > p.y.abs() {
        (p.x, std::f32::consts::FRAC_PI_4 * (p.y / p.x))
    } else {
        (p.y, std::f32::consts::FRAC_PI_2 - std::f32::consts::FRAC_PI_4 * (p.x / p.y))
    };
    radius * Vec2::from_angle(angle)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_and_centre_look_where_they_should() {
        let camera = Camera::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::new(1.0, 2.0, 0.0), 1.0);
        let rays = CameraRays::new(&camera, 200, 100);
        let centre = rays.ray(Vec2::new(100.0, 50.0), Vec2::ZERO);
        assert!((centre.direction - Vec3::NEG_Z).length() < 1e-6);
        let corner = rays.ray(Vec2::ZERO, Vec2::ZERO).direction;
        let expected = Vec3::new(-2.0 * 0.5_f32.tan(), 0.5_f32.tan(), -1.0).normalize();
        assert!((corner - expected).length() < 1e-6);
    }

    #[test]
    fn a_point_is_seen_where_its_ray_begins() {
        let camera = Camera::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::new(0.0, 0.5, 0.0), 1.0);
        let flat =
            Camera { projection: Projection::Orthographic { half_height: 2.0 }, ..camera.clone() };
        for camera in [camera, flat] {
            let rays = CameraRays::new(&camera, 200, 100).cropped([20, 30], [90, 60]);
            let pixel = Vec2::new(12.5, 40.0);
            let ray = rays.ray(pixel, Vec2::ZERO);
            let seen = |point: Vec4| {
                let [x, y, ahead] = rays.projection().map(|row| row.dot(point));
                (ahead > 0.0).then(|| Vec2::new(x, y) / ahead)
            };
            let point = (ray.origin + 3.0 * ray.direction).extend(1.0);
            assert!(seen(point).expect("it is ahead").distance(pixel) < 1e-3);
            assert!((rays.depth(point) - 3.0).abs() < 1e-5);
            let far = seen((7.0 * ray.direction).extend(0.0));
            assert_eq!(far.is_some_and(|far| far.distance(pixel) < 1e-3), !rays.orthographic);
            if !rays.orthographic {
                assert_eq!(seen((ray.origin - ray.direction).extend(1.0)), None);
            }
        }
    }

    #[test]
    fn lens_rays_meet_in_the_focal_plane() {
        let mut camera = Camera::look_at(Vec3::ZERO, Vec3::new(0.0, 0.0, -4.0), 0.8);
        camera.lens_radius = 0.1;
        let rays = CameraRays::new(&camera, 64, 64);
        let pixel = Vec2::new(10.0, 50.0);
        let at_focus = |lens: Vec2| {
            let ray = rays.ray(pixel, lens);
            ray.origin + ray.direction * (-4.0 - ray.origin.z) / ray.direction.z
        };
        let middle = at_focus(Vec2::splat(0.5));
        for lens in [Vec2::new(0.1, 0.9), Vec2::new(0.99, 0.5), Vec2::ZERO] {
            assert!((at_focus(lens) - middle).length() < 1e-5);
        }
    }

    #[test]
    fn a_cropped_picture_has_the_same_rays() {
        let perspective = Camera::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::ZERO, 0.8);
        let orthographic = Camera {
            projection: Projection::Orthographic { half_height: 2.0 },
            lens_radius: 0.1,
            ..perspective.clone()
        };
        for camera in [perspective, orthographic] {
            let whole = CameraRays::new(&camera, 120, 80);
            let part = whole.cropped([70, 10], [30, 40]);
            for pixel in [Vec2::ZERO, Vec2::new(30.0, 40.0), Vec2::new(7.5, 21.25)] {
                let lens = Vec2::new(0.3, 0.9);
                let a = whole.ray(pixel + Vec2::new(70.0, 10.0), lens);
                let b = part.ray(pixel, lens);
                assert!(a.origin.abs_diff_eq(b.origin, 1e-5), "{a:?} {b:?}");
                assert!(a.direction.abs_diff_eq(b.direction, 1e-6), "{a:?} {b:?}");
            }
        }
    }
}
