//! The sun of a map: its brightest place and its scaling.

use glam::{DVec3, Vec3};

use crate::color::luminance;
use crate::image::Image;
use crate::math::texel_solid_angle;

/// Radius in degrees of the sun's disc around the brightest texel.
const SUN_RADIUS_DEGREES: f64 = 2.5;

/// The brightest place of a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sun {
    /// Column and row of the brightest texel.
    pub texel: [u32; 2],
    /// Angle from +X towards +Z, `[-180,180)`, map not turned.
    pub azimuth_degrees: f64,
    /// Angle above the horizon, `[-90,90]`.
    pub elevation_degrees: f64,
    /// Share of the map's energy (luminance times solid angle) within 2.5 degrees of it.
    pub energy_share: f64,
    /// Luminance of the brightest texel.
    pub max_luminance: f32,
    /// Luminance averaged over the sphere.
    pub mean_luminance: f64,
}

impl Sun {
    /// Unit direction towards it from the world of which the map is turned by `rotation_degrees`.
    pub(crate) fn direction(&self, rotation_degrees: f64) -> Vec3 {
        let (sine, cosine) = self.elevation_degrees.to_radians().sin_cos();
        let (z, x) = (self.azimuth_degrees + rotation_degrees).to_radians().sin_cos();
        DVec3::new(cosine * x, sine, cosine * z).as_vec3()
    }

    /// Finds it; `None` on a black map.
    pub fn of(map: &Image) -> Option<Self> {
        let (width, height) = (map.width, map.height);
        let rows = || map.pixels.chunks_exact(width as usize).zip(0_u32..);
        let mut brightest = (0.0, [0, 0]);
        let mut total = 0.0;
        for (row, y) in rows() {
            let mut sum = 0.0;
            for (rgb, x) in row.iter().zip(0_u32..) {
                let light = luminance((*rgb).into());
                sum += f64::from(light);
                if light > brightest.0 {
                    brightest = (light, [x, y]);
                }
            }
            total += sum * texel_solid_angle(width, height, y);
        }
        if total <= 0.0 {
            return None;
        }
        let [x, y] = brightest.1;
        let cone = Cone::new(map, [x, y]);
        let of_row = |y: u32| {
            let near = cone.row(y, SUN_RADIUS_DEGREES);
            let light = near.map(|x| f64::from(luminance(map.at(x, y).into())));
            light.sum::<f64>() * texel_solid_angle(width, height, y)
        };
        let inside: f64 = (0..height).map(of_row).sum();
        let [azimuth_degrees, elevation_degrees] = cone.axis_degrees;
        Some(Self {
            texel: [x, y],
            azimuth_degrees,
            elevation_degrees,
            energy_share: inside / total,
            max_luminance: brightest.0,
            mean_luminance: total / (4.0 * std::f64::consts::PI),
        })
    }
}

/// The map with `factor` times the light of its sun: the radiance within 2.5 degrees of the brightest texel
/// above the mean of the surrounding ring of 2.5 to 5 degrees. Black maps are unchanged.
pub(crate) fn with_sun(mut map: Image, factor: f32) -> Image {
    let Some(sun) = Sun::of(&map) else { return map };
    let cone = Cone::new(&map, sun.texel);
    let (mut around, mut weight) = (DVec3::ZERO, 0.0);
    for y in 0..map.height {
        let each = texel_solid_angle(map.width, map.height, y);
        let sum = |degrees| {
            cone.row(y, degrees).fold((DVec3::ZERO, 0.0), |(sum, count), x| {
                (sum + Vec3::from(map.at(x, y)).as_dvec3(), count + 1.0)
            })
        };
        let ((wide, all), (narrow, inner)) =
            (sum(2.0 * SUN_RADIUS_DEGREES), sum(SUN_RADIUS_DEGREES));
        around += (wide - narrow) * each;
        weight += (all - inner) * each;
    }
    let sky = if weight > 0.0 { (around / weight).as_vec3().max(Vec3::ZERO) } else { Vec3::ZERO };
    for y in 0..map.height {
        for x in cone.row(y, SUN_RADIUS_DEGREES) {
            let pixel = &mut map.pixels[(y * map.width + x) as usize];
            let light = Vec3::from(*pixel);
            let own = (light - sky).max(Vec3::ZERO);
            *pixel = (light - own + own * factor).min(Vec3::MAX).to_array();
        }
    }
    map
}

/// What [`with_sun`] may change of a map, as it was before: by it a factor is exchanged for another without
/// the map's file.
#[derive(Debug, Clone, Default)]
pub(crate) struct SunTexels {
    /// Places in the list of pixels, and radiances.
    texels: Vec<(usize, [f32; 3])>,
}

impl SunTexels {
    /// Of a map to which no factor was applied; none on a black map.
    pub(crate) fn of(map: &Image) -> Self {
        let Some(sun) = Sun::of(map) else { return Self::default() };
        let cone = Cone::new(map, sun.texel);
        let place = |x, y| (y * map.width + x) as usize;
        let row = |y| cone.row(y, SUN_RADIUS_DEGREES).map(move |x| place(x, y));
        Self { texels: (0..map.height).flat_map(row).map(|i| (i, map.pixels[i])).collect() }
    }

    /// Makes the map what it was before any factor.
    pub(crate) fn put_back(&self, map: &mut Image) {
        for (place, radiance) in &self.texels {
            map.pixels[*place] = *radiance;
        }
    }
}

/// Texels around one of a map.
struct Cone {
    width: u32,
    height: u32,
    /// Azimuth and elevation.
    axis_degrees: [f64; 2],
}

impl Cone {
    fn new(map: &Image, [x, y]: [u32; 2]) -> Self {
        let mut cone = Self { width: map.width, height: map.height, axis_degrees: [0.0; 2] };
        cone.axis_degrees = [cone.azimuth(x), cone.elevation(y)];
        cone
    }

    fn azimuth(&self, x: u32) -> f64 {
        ((f64::from(x) + 0.5) / f64::from(self.width) - 0.5) * 360.0
    }

    fn elevation(&self, y: u32) -> f64 {
        90.0 - (f64::from(y) + 0.5) / f64::from(self.height) * 180.0
    }

    /// Columns of a row within `degrees` of the axis.
    fn row(&self, y: u32, degrees: f64) -> impl Iterator<Item = u32> {
        let [azimuth, elevation] = self.axis_degrees;
        let (sin, cos) = elevation.to_radians().sin_cos();
        let (row_sin, row_cos) = self.elevation(y).to_radians().sin_cos();
        let least_cosine = degrees.to_radians().cos();
        let is_near_row = sin * row_sin + cos * row_cos >= least_cosine;
        let columns = if is_near_row { self.width } else { 0 };
        (0..columns).filter(move |x| {
            let turn = (self.azimuth(*x) - azimuth).to_radians().cos();
            sin * row_sin + cos * row_cos * turn >= least_cosine
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(light: impl Fn(u32, u32) -> f32) -> Image {
        let pixels = (0..64 * 32).map(|i| [light(i % 64, i / 64); 3]).collect();
        Image { width: 64, height: 32, pixels }
    }

    #[test]
    fn the_sun_is_where_it_was_put() {
        let sun = Sun::of(&map(|x, y| if (x, y) == (48, 8) { 1e4 } else { 1.0 })).expect("lit");
        assert_eq!(sun.texel, [48, 8]);
        assert!((sun.azimuth_degrees - 92.8).abs() < 0.1, "{sun:?}");
        assert!((sun.elevation_degrees - 42.2).abs() < 0.1, "{sun:?}");
        // One texel of 1e4 against 4 pi of 1.
        let solid_angle = texel_solid_angle(64, 32, 8);
        let expected = 1e4 * solid_angle / (1e4 * solid_angle + 4.0 * std::f64::consts::PI);
        assert!((sun.energy_share - expected).abs() < 1e-3, "{sun:?}");
        assert_eq!(Sun::of(&map(|_, _| 0.0)), None);
    }

    #[test]
    fn a_sun_is_made_weaker_and_the_sky_stays() {
        let disc = |x: u32, y: u32| x.abs_diff(200) < 3 && y.abs_diff(40) < 2;
        let sky = |y: u32| 1.0 + 0.01 * y as f32;
        let light = |i: u32| {
            let (x, y) = (i % 512, i / 512);
            if disc(x, y) { 4e3 } else { sky(y) }
        };
        let map = Image {
            width: 512,
            height: 256,
            pixels: (0..512 * 256).map(|i| [light(i); 3]).collect(),
        };
        let half = with_sun(map.clone(), 0.5);
        for (i, (pixel, before)) in (0..).zip(half.pixels.iter().zip(&map.pixels)) {
            let (x, y) = (i % 512, i / 512);
            let expected = if disc(x, y) { 2e3 } else { before[0] };
            assert!((pixel[0] / expected - 1.0).abs() < 0.01, "{x} {y}: {pixel:?}");
        }
        let none = with_sun(map.clone(), 0.0);
        assert!(none.pixels.iter().all(|pixel| pixel[0] < 4.0), "only the sky is left");
        assert_eq!(with_sun(map.clone(), 1.0).pixels, map.pixels);
        let texels = SunTexels::of(&map);
        for mut changed in [half, none, with_sun(map.clone(), 7.0)] {
            texels.put_back(&mut changed);
            assert_eq!(changed, map);
        }
        assert_eq!(with_sun(Image::filled(8, 4, [0.0; 3]), 3.0), Image::filled(8, 4, [0.0; 3]));
    }
}
