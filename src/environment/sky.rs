//! Procedural skies: `sky:day`, `sky:sunset`, `sky:night`, `sky:overcast` and `sky:hallway`.
//!
//! A sky is a smooth part, computed on a grid of at most 2048 x 1024 and interpolated, plus discs
//! (sun, lamps) whose energy is exact at any resolution. Radiance is linear Rec.709 in units in which
//! the mean sky of a clear day is about 1/2, so that `day` is well exposed outdoors at EV 0.

mod disc;

use std::f32::consts::PI;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::image::Image;
use crate::math::direction_from_uv;
use crate::noise::{Stream, smoothstep, solid_fbm};
use disc::{Disc, add_disc};

/// Widest grid that the smooth part is computed on; clouds have no finer detail.
const SMOOTH_WIDTH: u32 = 2048;
/// Smaller maps average at least this many directions across.
const MIN_SAMPLES: u32 = 512;
/// Sine of an elevation that hills stay below.
const MAX_HILL_ALTITUDE: f32 = 0.062;
/// Largest side of a map.
const MAX_SIDE: u32 = 16_384;

/// Names of the built-in skies.
pub fn names() -> &'static [&'static str] {
    &["day", "sunset", "night", "overcast", "hallway"]
}

/// Says that there is no such sky, and which there are.
pub(crate) fn unknown(name: &str) -> Error {
    let names = names().join(", ");
    Error::new(format!("there is no built-in sky called \"{name}\"; there are {names}"))
}

/// Builds the sky called `name` as a lat-long map. An error lists the names there are, or the
/// sizes there can be (1 to 16384).
pub fn build(name: &str, width: u32, height: u32) -> Result<Image> {
    if !(1..=MAX_SIDE).contains(&width) || !(1..=MAX_SIDE).contains(&height) {
        return Err(Error::new(format!(
            "a built-in sky can be from 1x1 to {MAX_SIDE}x{MAX_SIDE} pixels, not {width}x{height}"
        )));
    }
    let (smooth, discs): (fn(Vec3) -> Vec3, Vec<Disc>) = match name {
        // The sun is about 1.3e5 times as bright as the sky; normal irradiance 3.1.
        "day" => (day, vec![sun([22.0, 38.0], 0.267, Vec3::new(4.6e4, 4.4e4, 4.0e4))]),
        "sunset" => (sunset, vec![sun([12.0, 6.0], 0.8, Vec3::new(1500.0, 700.0, 220.0))]),
        "night" => (night, lamps()),
        "overcast" => (overcast, Vec::new()),
        "hallway" => (hallway, Vec::new()),
        _ => return Err(unknown(name)),
    };
    // The smooth part is averaged over texels, or interpolated from a grid.
    let grid = averaged(smooth, width.min(SMOOTH_WIDTH), height.min(SMOOTH_WIDTH / 2));
    let is_whole = (grid.width, grid.height) == (width, height);
    let mut image = if is_whole { grid } else { enlarged(&grid, width, height) };
    for disc in &discs {
        add_disc(&mut image, disc);
    }
    Ok(image)
}

/// Unit direction at an azimuth from +X towards +Z and an elevation, in degrees.
fn direction(azimuth_degrees: f32, elevation_degrees: f32) -> Vec3 {
    let (a, e) = (azimuth_degrees.to_radians(), elevation_degrees.to_radians());
    Vec3::new(e.cos() * a.cos(), e.sin(), e.cos() * a.sin())
}

/// A sun at an azimuth and an elevation, with a radius, all in degrees.
fn sun([azimuth, elevation]: [f32; 2], radius: f64, radiance: Vec3) -> Disc {
    Disc { direction: direction(azimuth, elevation), radius_radians: radius.to_radians(), radiance }
}

/// Forty lamps low over the horizon.
fn lamps() -> Vec<Disc> {
    const COLOURS: [Vec3; 4] = [
        Vec3::new(1.0, 0.75, 0.4),
        Vec3::new(1.0, 0.9, 0.75),
        Vec3::new(0.7, 0.85, 1.0),
        Vec3::new(1.0, 0.45, 0.3),
    ];
    let mut stream = Stream::new(20_180_812);
    let lamp = |_| Disc {
        direction: direction(stream.between(0.0, 360.0), stream.between(-4.0, 28.0)),
        radius_radians: f64::from(stream.between(0.25, 1.2)).to_radians(),
        radiance: 10_f32.powf(stream.between(1.3, 2.9)) * COLOURS[stream.index(COLOURS.len())],
    };
    (0..40).map(lamp).collect()
}

/// Coverage in `[0,1]` of clouds on a flat layer seen along `d`, `amount` of the sky; and how thick
/// they are there.
fn clouds(d: Vec3, amount: f32, scale: f32, seed: u32) -> (f32, f32) {
    if d.y < 0.005 {
        return (0.0, 0.0);
    }
    let on_layer = Vec3::new(d.x, 0.0, d.z) * (scale / (d.y + 0.10));
    let warp = solid_fbm(on_layer * 0.6 + Vec3::splat(5.0), 3, seed ^ 77) - 0.5;
    let density = solid_fbm(on_layer + Vec3::new(1.2 * warp, 0.3, 1.2 * warp), 6, seed);
    let edge = 0.62 - 0.24 * amount;
    let cover = smoothstep(edge, edge + 0.16, density) * smoothstep(0.005, 0.09, d.y);
    (cover, smoothstep(edge, edge + 0.34, density))
}

/// What lies below the horizon: `near` at the nadir, fading into `haze` at the horizon.
fn ground(d: Vec3, near: Vec3, haze: Vec3) -> Vec3 {
    if d.y > MAX_HILL_ALTITUDE {
        return haze;
    }
    let fields = 0.75 + 0.5 * solid_fbm(Vec3::new(d.x, 0.0, d.z) * (1.5 / (0.06 - d.y)), 4, 13);
    (near * fields).lerp(haze, (d.y * 30.0).exp())
}

/// Joins sky and ground by two ranges of hills, `far` and `near`, up to 3 degrees above the horizon.
fn horizon(d: Vec3, above: Vec3, far: Vec3, near: Vec3, below: Vec3) -> Vec3 {
    if d.y.abs() > MAX_HILL_ALTITUDE {
        return if d.y > 0.0 { above } else { below };
    }
    let around = Vec3::new(d.x, 0.0, d.z).normalize_or(Vec3::X);
    let ridge = |scale: f32, seed: u32| solid_fbm(around * scale, 6, seed);
    let over = |height: f32| smoothstep(-0.0012, 0.0012, d.y - height);
    let backdrop = far.lerp(above, over(0.075 * (ridge(3.0, 91) - 0.22).max(0.0)));
    let hills = near.lerp(backdrop, over(0.055 * (ridge(5.0, 92) - 0.36).max(0.0)));
    below.lerp(hills, smoothstep(-0.003, 0.003, d.y))
}

fn day(d: Vec3) -> Vec3 {
    let up = d.y.clamp(0.0, 1.0);
    let toward = d.dot(direction(22.0, 38.0));
    let depth = (1.0 - up).powi(3);
    let mut sky = Vec3::new(0.10, 0.22, 0.55).lerp(Vec3::new(0.44, 0.56, 0.68), depth);
    sky += Vec3::new(0.25, 0.23, 0.18) * (-up * 14.0).exp();
    sky += Vec3::new(0.80, 0.70, 0.55) * ((toward - 1.0) * 90.0).exp();
    sky += Vec3::new(0.16, 0.15, 0.12) * ((toward - 1.0) * 6.0).exp();
    let (cover, thick) = clouds(d, 0.40, 0.85, 3);
    let lit = Vec3::new(1.12, 1.08, 1.02).lerp(Vec3::new(0.50, 0.54, 0.61), 0.8 * thick);
    let silver = Vec3::new(0.9, 0.85, 0.75) * ((toward - 1.0) * 12.0).exp() * (1.0 - thick);
    sky = sky.lerp(lit + silver, 0.88 * cover);
    let (far, near) = (Vec3::new(0.36, 0.44, 0.53), Vec3::new(0.17, 0.21, 0.17));
    horizon(d, sky, far, near, ground(d, Vec3::new(0.15, 0.14, 0.10), Vec3::new(0.24, 0.26, 0.22)))
}

fn sunset(d: Vec3) -> Vec3 {
    let up = d.y.clamp(0.0, 1.0);
    let toward = d.dot(direction(12.0, 6.0));
    let side = (0.5 + 0.5 * toward).powi(3);
    let mut sky = Vec3::new(0.10, 0.13, 0.28) * (0.35 + 0.65 * up);
    sky += Vec3::new(0.9, 0.38, 0.12) * (-up * 7.0).exp() * (0.25 + 0.75 * side);
    sky += Vec3::new(0.30, 0.12, 0.20) * (-(up - 0.22).powi(2) * 22.0).exp() * (0.3 + 0.4 * side);
    let glow = ((toward - 1.0) * 60.0).exp();
    let (cover, thick) = clouds(Vec3::new(d.x, d.y, d.z * 2.2), 0.55, 0.7, 8);
    let lit = Vec3::new(1.5, 0.50, 0.20) * (0.12 + 0.88 * side);
    let cloud = lit.lerp(Vec3::new(0.10, 0.085, 0.13), 0.75 * thick);
    sky = sky.lerp(cloud, 0.85 * cover) + Vec3::new(8.0, 3.2, 1.0) * glow;
    let (far, near) = (Vec3::new(0.30, 0.14, 0.11) * (0.3 + side), Vec3::new(0.06, 0.045, 0.05));
    let haze = Vec3::new(0.14, 0.075, 0.05) * (0.3 + side);
    horizon(d, sky, far, near, ground(d, Vec3::new(0.045, 0.038, 0.035), haze))
}

fn night(d: Vec3) -> Vec3 {
    let up = d.y.clamp(0.0, 1.0);
    let mut sky = Vec3::new(0.0015, 0.0020, 0.0040) * (1.5 - up);
    sky += Vec3::new(0.010, 0.0065, 0.0035) * (-up * 9.0).exp();
    let (cover, _) = clouds(d, 0.5, 0.8, 5);
    sky = sky.lerp(Vec3::new(0.006, 0.0048, 0.0042), 0.6 * cover);
    // Lit windows: blocks of a skyline against the sky.
    let azimuth = d.z.atan2(d.x);
    let block = solid_fbm(Vec3::new((azimuth * 14.0).floor(), 0.5, 0.5), 1, 21);
    let skyline = 0.01 + 0.07 * block * block;
    if d.y < skyline && d.y > 0.0 {
        sky = Vec3::new(0.0012, 0.0012, 0.0015);
        let window = Vec3::new((azimuth * 260.0).floor(), (d.y * 420.0).floor(), 0.5);
        if solid_fbm(window, 1, 22) > 0.72 {
            sky = Vec3::new(0.10, 0.065, 0.030) * (0.3 + solid_fbm(window, 1, 23));
        }
    }
    let dark = Vec3::splat(0.0012);
    horizon(d, sky, sky, dark, ground(d, Vec3::splat(0.001), Vec3::new(0.006, 0.004, 0.0025)))
}

fn overcast(d: Vec3) -> Vec3 {
    // Moon and Spencer's overcast sky: three times as bright at the zenith as at the horizon.
    let up = d.y.clamp(0.0, 1.0);
    let base = Vec3::new(0.80, 0.84, 0.90) * ((1.0 + 2.0 * up) / 3.0);
    let on_layer = Vec3::new(d.x, 0.0, d.z) * (0.8 / (up + 0.16));
    let billow = solid_fbm(on_layer, 5, 31) - 0.5;
    let sky = base * (1.0 + 0.55 * billow * smoothstep(0.0, 0.15, up))
        + Vec3::splat(0.12) * (-up * 10.0).exp();
    let (far, near) = (Vec3::new(0.32, 0.35, 0.38), Vec3::new(0.14, 0.16, 0.14));
    horizon(d, sky, far, near, ground(d, Vec3::new(0.10, 0.11, 0.08), Vec3::new(0.20, 0.21, 0.19)))
}

/// A corridor along X, seen from its middle: ceiling panels, a row of windows, doors at the ends.
fn hallway(d: Vec3) -> Vec3 {
    let (low, high) = (Vec3::new(-14.0, -1.5, -1.4), Vec3::new(9.0, 1.3, 1.4));
    let reach = |k: usize| {
        let wall = if d[k] > 0.0 { high[k] } else { low[k] };
        if d[k].abs() < 1e-6 { f32::INFINITY } else { wall / d[k] }
    };
    let axis = (0..3).min_by(|&a, &b| reach(a).total_cmp(&reach(b))).unwrap_or(0);
    let p = d * reach(axis);
    // Light from the panels falls off between them; corners are darker.
    let along = (p.x / 3.2).rem_euclid(1.0) - 0.5;
    let pool = 0.55 + 0.45 * (-(along * along) * 9.0).exp();
    let inside = |x: f32, centre: f32, half: f32| (x - centre).abs() < half;
    match axis {
        1 if d.y > 0.0 => {
            let panel = inside(along, 0.0, 0.19) && inside(p.z, 0.0, 0.32);
            if panel { Vec3::new(26.0, 24.5, 21.5) } else { Vec3::new(0.46, 0.44, 0.40) }
        }
        1 => {
            let tile =
                ((p.x * 1.6).floor() as i32 + (p.z * 1.6).floor() as i32).rem_euclid(2) as f32;
            Vec3::new(0.36, 0.30, 0.24) * pool * (0.75 + 0.3 * tile)
                + Vec3::splat(0.5) * pool * (-(p.z * p.z) * 14.0).exp()
        }
        2 if d.z < 0.0 => {
            let bay = (p.x / 4.6).rem_euclid(1.0) - 0.5;
            let window = inside(bay, 0.0, 0.26) && inside(p.y, 0.05, 0.75);
            let bar = inside(bay, 0.0, 0.008) || inside(p.y, 0.30, 0.025);
            if window && !bar {
                Vec3::new(3.4, 4.2, 5.4) * (0.65 + 0.5 * (p.y + 0.7).max(0.0))
            } else {
                Vec3::new(0.62, 0.58, 0.50) * pool * (0.75 + 0.16 * p.y)
            }
        }
        2 => {
            let bay = ((p.x + 1.3) / 5.2).rem_euclid(1.0) - 0.5;
            let door = inside(bay, 0.0, 0.095) && p.y < 0.62;
            let wall = Vec3::new(0.66, 0.60, 0.50) * (0.75 + 0.16 * p.y);
            pool * if door { Vec3::new(0.22, 0.11, 0.055) } else { wall }
        }
        _ => {
            let door = inside(p.z, 0.0, 0.75) && p.y < 0.8;
            let glass =
                if d.x > 0.0 { Vec3::new(9.0, 8.6, 8.0) } else { Vec3::new(0.30, 0.27, 0.22) };
            if door { glass } else { Vec3::new(0.52, 0.48, 0.41) }
        }
    }
}

/// Means of `radiance` over the solid angle of each texel.
fn averaged(radiance: fn(Vec3) -> Vec3, width: u32, height: u32) -> Image {
    let (nx, ny) = (MIN_SAMPLES.div_ceil(width), (MIN_SAMPLES / 2).div_ceil(height));
    rows(width, height, |x, y| {
        let (mut sum, mut weight) = (Vec3::ZERO, 0.0);
        for j in 0..ny {
            let v = (y as f32 + (j as f32 + 0.5) / ny as f32) / height as f32;
            let sin_theta = (PI * v).sin();
            for i in 0..nx {
                let u = (x as f32 + (i as f32 + 0.5) / nx as f32) / width as f32;
                sum += radiance(direction_from_uv(Vec2::new(u, v))) * sin_theta;
                weight += sin_theta;
            }
        }
        sum / weight
    })
}

/// Bilinear enlargement that wraps in u and holds the poles.
fn enlarged(grid: &Image, width: u32, height: u32) -> Image {
    let (columns, last) = (grid.width, grid.height - 1);
    rows(width, height, |x, y| {
        let u = (x as f32 + 0.5) * columns as f32 / width as f32 - 0.5 + columns as f32;
        let v =
            ((y as f32 + 0.5) * grid.height as f32 / height as f32 - 0.5).clamp(0.0, last as f32);
        let (i, j) = (u as u32, v as u32);
        let row = |j: u32| {
            let [a, b] = [i, i + 1].map(|i| Vec3::from(grid.at(i % columns, j.min(last))));
            a.lerp(b, u.fract())
        };
        row(j).lerp(row(j + 1), v.fract())
    })
}

/// A picture computed row by row on all threads.
fn rows(width: u32, height: u32, f: impl Fn(u32, u32) -> Vec3 + Sync) -> Image {
    let mut image = Image::filled(width, height, [0.0; 3]);
    image.pixels.par_chunks_mut(width as usize).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            *pixel = f(x as u32, y as u32).to_array();
        }
    });
    image
}
