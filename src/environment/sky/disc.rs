//! Discs of light whose energy on the map does not depend on its resolution.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};

use crate::image::Image;
use crate::math::{texel_solid_angle, uv_from_direction};

/// A disc of even radiance, far away.
pub(super) struct Disc {
    /// Unit direction of its centre.
    pub(super) direction: Vec3,
    /// Angular radius.
    pub(super) radius_radians: f64,
    /// Linear radiance.
    pub(super) radiance: Vec3,
}

/// Adds a disc so that the sum of radiance times solid angle over the texels is exactly the disc's,
/// however small it is: coverage by supersampling, scaled to the true solid angle.
pub(super) fn add_disc(image: &mut Image, disc: &Disc) {
    let (w, h) = (f64::from(image.width), f64::from(image.height));
    let centre = uv_from_direction(disc.direction);
    let (u0, v0) = (f64::from(centre.x), f64::from(centre.y));
    let r = disc.radius_radians / PI;
    let sin_least = (PI * v0).sin().min((PI * (v0 + r)).sin()).max(0.02);
    let rows = ((v0 - r) * h).floor().max(0.0) as u32..=((v0 + r) * h).floor().min(h - 1.0) as u32;
    let half_width = (0.5 * r / sin_least * w).ceil() as i64 + 1;
    let middle = (u0 * w) as i64;
    let columns = if 2 * half_width + 1 >= i64::from(image.width) {
        0..=i64::from(image.width) - 1
    } else {
        middle - half_width..=middle + half_width
    };
    let (ss_x, ss_y) = (samples_across(r * w), samples_across(2.0 * r * h));
    let cos_radius = disc.radius_radians.cos();
    let axis = disc.direction.as_dvec3();
    let mut covered = Vec::new();
    let mut total = 0.0;
    for y in rows {
        for x in columns.clone() {
            let mut inside = 0.0;
            for j in 0..ss_y {
                let theta = PI * (f64::from(y) + (f64::from(j) + 0.5) / f64::from(ss_y)) / h;
                for i in 0..ss_x {
                    let phi = TAU * ((x as f64 + (f64::from(i) + 0.5) / f64::from(ss_x)) / w - 0.5);
                    let d =
                        DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
                    if d.dot(axis) > cos_radius {
                        inside += 1.0;
                    }
                }
            }
            if inside > 0.0 {
                let fraction = inside / f64::from(ss_x * ss_y);
                let column = x.rem_euclid(i64::from(image.width)) as u32;
                covered.push((column, y, fraction));
                total += fraction * texel_solid_angle(image.width, image.height, y);
            }
        }
    }
    let solid_angle = TAU * (1.0 - cos_radius);
    if covered.is_empty() {
        let y = ((v0 * h) as u32).min(image.height - 1);
        covered.push((middle.rem_euclid(i64::from(image.width)) as u32, y, 1.0));
        total = texel_solid_angle(image.width, image.height, y);
    }
    let scale = solid_angle / total;
    for (x, y, fraction) in covered {
        let pixel = &mut image.pixels[y as usize * image.width as usize + x as usize];
        *pixel = (Vec3::from(*pixel) + disc.radiance * (fraction * scale) as f32).to_array();
    }
}

/// Supersamples per texel for a disc `texels` wide: enough that a small one is hit, few for a large one.
fn samples_across(texels: f64) -> u32 {
    (48.0 / texels.max(0.1)).ceil().clamp(2.0, 64.0) as u32
}
