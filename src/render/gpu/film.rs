//! The film on the device. It stays there: sums that lose nothing at 1e7 samples a pixel, which
//! whoever draws the picture reads in place, and which come to the host only when somebody asks.

use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use super::super::film::{Film, Pixel, Surface};
use super::buffers::Buffers;
use crate::error::Result;

/// Sums and what rounding left out of them (red, green, blue, squared luminance), then samples,
/// invalid ones and rays; 16 bytes a pixel each, so that 3840x2160 pixels fit into a binding of
/// 128 MiB.
const PIXELS: [&str; 3] = ["film_sum", "film_rest", "film_counts"];
/// Of the first hits: sums of albedo and depth, of normal and hits, and what rounding left out of them.
const SURFACES: [&str; 2] = ["surfaces", "surfaces_rest"];
/// Bytes of a pixel in each of [`PIXELS`].
const PIXEL_BYTES: u64 = 16;
/// Bytes of a pixel in each of [`SURFACES`].
const SURFACE_BYTES: u64 = 32;
/// Pixels that cross between device and host at once.
const PIECE_PIXELS: usize = 1 << 19;

/// Where the sums of a picture lie, for shaders that draw it on the same device. They are added to
/// between submissions; at any moment a pixel's radiance is `sum / samples`. Clones are the same film,
/// and only those are equal.
#[derive(Clone, PartialEq)]
pub(crate) struct DeviceFilm {
    /// Sums of red, green, blue and squared luminance, an f32 each; row after row.
    pub(crate) sum: wgpu::Buffer,
    /// Samples, invalid samples, rays and nothing, a u32 each.
    pub(crate) counts: wgpu::Buffer,
    /// Sums of albedo (3), depth, normal (3) and hits, an f32 each; `None` without layers.
    pub(crate) surfaces: Option<wgpu::Buffer>,
    /// Pixels per row.
    pub(crate) width: u32,
    /// Rows.
    pub(crate) height: u32,
    /// Factor that radiance was multiplied by, a power of two: 1 unless the scene's is extreme.
    pub(crate) scale: f32,
}

/// A power of two that brings radiance of this size to where neither sums nor squares leave the range
/// of f32; 1 for anything between 2^-40 and 2^40, and where nothing shines but unlit colours.
pub(super) fn scale_for(brightest: f32) -> f32 {
    const REACH: i32 = 40;
    if brightest <= 0.0 {
        return 1.0;
    }
    let exponent = (brightest.clamp(f32::MIN_POSITIVE, f32::MAX).to_bits() >> 23) as i32 - 127;
    2.0_f32.powi(exponent.clamp(-REACH, REACH) - exponent)
}

/// The film of a renderer, in its buffers.
pub(super) struct Sums {
    width: u32,
    height: u32,
    layers: bool,
    scale: f32,
    /// Rays of all pixels when they were read last.
    rays: AtomicU64,
}

impl Sums {
    /// Makes the buffers of a film of this size, which begins as `film` if there is one.
    pub(super) fn new(
        buffers: &mut Buffers,
        [width, height]: [u32; 2],
        layers: bool,
        scale: f32,
    ) -> Result<Self> {
        let pixels = u64::from(width) * u64::from(height);
        for name in PIXELS {
            buffers.make(name, pixels * PIXEL_BYTES, "the picture")?;
        }
        if layers {
            for name in SURFACES {
                buffers.make(name, pixels * SURFACE_BYTES, "the picture's layers")?;
            }
        }
        Ok(Self { width, height, layers, scale, rays: AtomicU64::new(0) })
    }

    /// Where it is.
    pub(super) fn on_device(&self, buffers: &Buffers) -> Option<DeviceFilm> {
        let [sum, _, counts] = PIXELS.map(|name| buffers.get(name).cloned());
        let Self { width, height, layers, scale, .. } = *self;
        let surfaces = buffers.get(SURFACES[0]).filter(|_| layers).cloned();
        Some(DeviceFilm { sum: sum?, counts: counts?, surfaces, width, height, scale })
    }

    /// Rays of all pixels when they were read last.
    pub(super) fn rays(&self) -> u64 {
        self.rays.load(Ordering::Relaxed)
    }

    /// Waits for the device and reads everything back into a film of this size.
    pub(super) fn read(&self, buffers: &Buffers, film: &mut Film) -> Result<()> {
        let (mut first, mut rays) = (0, 0);
        while first < film.pixels.len() {
            let count = PIECE_PIXELS.min(film.pixels.len() - first);
            let part = |name, bytes: u64| (name, first as u64 * bytes, count as u64 * bytes);
            let mut parts: Vec<_> = PIXELS.map(|name| part(name, PIXEL_BYTES)).into();
            if self.layers {
                parts.extend(SURFACES.map(|name| part(name, SURFACE_BYTES)));
            }
            let pixels = &mut film.pixels[first..first + count];
            let mut surfaces = film.surfaces.get_mut(first..first + count);
            rays += buffers.read(&parts, |read| {
                let rays = take_pixels(pixels, &read[..3], self.factors().map(f64::recip));
                if let (Some(surfaces), [_, _, _, high, low]) = (&mut surfaces, read) {
                    let [high, low] =
                        [high, low].map(|bytes| bytemuck::cast_slice::<_, [f32; 8]>(bytes));
                    for ((surface, high), low) in surfaces.iter_mut().zip(high).zip(low) {
                        *surface = Surface::of_sums(joined(*high, *low));
                    }
                }
                rays
            })?;
            first += count;
        }
        self.rays.store(rays, Ordering::Relaxed);
        Ok(())
    }

    /// What each of a pixel's sums is multiplied by on the device.
    fn factors(&self) -> [f64; 4] {
        let scale = f64::from(self.scale);
        [scale, scale, scale, scale * scale]
    }

    /// Puts a film in the place of what is there.
    pub(super) fn write(&self, buffers: &Buffers, film: &Film) -> Result<()> {
        self.rays.store(0, Ordering::Relaxed);
        for (piece, pixels) in film.pixels.chunks(PIECE_PIXELS).enumerate() {
            let at = (piece * PIECE_PIXELS) as u64 * PIXEL_BYTES;
            let (high, low) = split(pixels.iter().map(|p| times(p.sums, self.factors())));
            let counts: Vec<[u32; 4]> =
                pixels.iter().map(|pixel| [pixel.samples(), pixel.invalid, 0, 0]).collect();
            buffers.write(PIXELS[0], at, bytemuck::cast_slice(&high));
            buffers.write(PIXELS[1], at, bytemuck::cast_slice(&low));
            buffers.write(PIXELS[2], at, bytemuck::cast_slice(&counts));
            buffers.gpu.finish_copies()?;
        }
        for (piece, surfaces) in film.surfaces.chunks(PIECE_PIXELS).enumerate() {
            let at = (piece * PIECE_PIXELS) as u64 * SURFACE_BYTES;
            let (high, low) = split(surfaces.iter().map(Surface::sums));
            buffers.write(SURFACES[0], at, bytemuck::cast_slice(&high));
            buffers.write(SURFACES[1], at, bytemuck::cast_slice(&low));
            buffers.gpu.finish_copies()?;
        }
        Ok(())
    }
}

/// Sums as the device keeps them: rounded to f32, and what that leaves out.
fn split<const N: usize>(sums: impl Iterator<Item = [f64; N]>) -> (Vec<[f32; N]>, Vec<[f32; N]>) {
    let rest = |sum: f64| (sum - f64::from(sum as f32)) as f32;
    sums.map(|sums| (sums.map(|sum| sum as f32), sums.map(rest))).unzip()
}

/// The two parts of a sum together; both f32 fit into an f64 with room to spare.
fn joined<const N: usize>(high: [f32; N], low: [f32; N]) -> [f64; N] {
    std::array::from_fn(|i| f64::from(high[i]) + f64::from(low[i]))
}

fn times(sums: [f64; 4], factors: [f64; 4]) -> [f64; 4] {
    std::array::from_fn(|i| sums[i] * factors[i])
}

/// Takes pixels from the bytes of [`PIXELS`]; returns the number of rays.
fn take_pixels(pixels: &mut [Pixel], read: &[&[u8]], factors: [f64; 4]) -> u64 {
    let (high, low) = (bytemuck::cast_slice(read[0]), bytemuck::cast_slice(read[1]));
    let counts: &[[u32; 4]] = bytemuck::cast_slice(read[2]);
    let read = pixels.par_iter_mut().zip(high).zip(low).zip(counts).with_min_len(4096);
    let rays = read.map(|(((pixel, high), low), &[samples, invalid, rays, _])| {
        *pixel = Pixel { sums: times(joined(*high, *low), factors), samples, invalid };
        u64::from(rays)
    });
    rays.sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sum_survives_being_split_to_2_to_the_minus_48() {
        for sum in [0.0, 1.0, 1e-30, 1e30, 0.1, 12_345.678_901_234, -3.3e7] {
            let (high, low) = split(std::iter::once([sum]));
            let [back] = joined(high[0], low[0]);
            assert!((back - sum).abs() <= sum.abs() * 2.0_f64.powi(-48), "{sum}: {back}");
        }
    }

    #[test]
    fn radiance_of_any_size_is_scaled_into_range() {
        for brightest in
            [0.0, f32::MIN_POSITIVE, 1e-30, 1e-12, 1e-3, 1.0, 1e6, 1e12, 1e13, 1e30, f32::MAX]
        {
            let scale = scale_for(brightest);
            assert_eq!(scale.to_bits() & 0x7f_ffff, 0, "a power of two");
            let scaled = f64::from(brightest) * f64::from(scale);
            assert!(scaled < 2.3e12 && (scaled > 9e-13 || brightest == 0.0), "{brightest}");
            let is_usual = brightest == 0.0 || (1e-12..=1e12).contains(&brightest);
            assert!(!is_usual || scale == 1.0, "{brightest}");
        }
    }

    #[test]
    fn surfaces_keep_their_order() {
        let sums = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0];
        let surface = Surface::of_sums(sums);
        assert_eq!(surface.sums(), sums);
    }
}
