//! Whether pixels can be a light, and what one pass over them tells.

use std::f64::consts::TAU;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::patches;
use crate::error::{Error, Result};
use crate::image::Image;

/// Complains of a map without pixels, with others than its size says, or with too many.
pub(super) fn check_size(map: &Image) -> Result<()> {
    let (width, height, count) = (map.width, map.height, map.pixels.len());
    if count == 0 || count != width as usize * height as usize || count > 1 << 31 {
        return Err(Error::new(format!(
            "an environment map of {width} x {height} with {count} pixels cannot be used"
        )));
    }
    Ok(())
}

/// What one pass over the pixels tells.
#[derive(Debug, Clone, Copy)]
pub(super) struct Statistics {
    /// Over solid angles.
    pub(super) mean: Vec3,
    /// Of all components.
    pub(super) largest: f32,
    pub(super) black: bool,
    pub(super) constant: bool,
}

/// The same of one row.
struct RowStatistics {
    sum: DVec3,
    largest: f32,
    constant: bool,
    valid: bool,
}

impl Statistics {
    /// # Errors
    /// If a radiance is negative or not finite.
    pub(super) fn of(map: &Image) -> Result<Self> {
        let first = map.pixels[0];
        let solid_angle = |row| patches::solid_angle(map.width, map.height, row);
        // Each row of patches lends half of itself to the row of texels above and below it.
        let share = |is_pole: bool, row| if is_pole { 1.0 } else { 0.5 } * solid_angle(row);
        let row_weight = |y: u32| share(y == 0, y) + share(y + 1 == map.height, y + 1);
        let of_row = |(row, y): (&[[f32; 3]], u32)| {
            let sum: DVec3 = row.iter().map(|p| Vec3::from(*p).as_dvec3()).sum();
            let values = row.as_flattened();
            RowStatistics {
                sum: sum * row_weight(y),
                largest: values.iter().copied().fold(0.0, f32::max),
                constant: row.iter().all(|pixel| *pixel == first),
                valid: values.iter().all(|value| (0.0..=f32::MAX).contains(value)),
            }
        };
        let rows = map.pixels.par_chunks_exact(map.width as usize).zip(0..map.height);
        let rows: Vec<RowStatistics> = rows.map(of_row).collect();
        if !rows.iter().all(|row| row.valid) {
            let cause = "the environment map has radiance that is negative or not finite";
            return Err(Error::new(cause));
        }
        let sum: DVec3 = rows.iter().map(|row| row.sum).sum();
        let constant = rows.iter().all(|row| row.constant);
        let mean = if constant { Vec3::from(first) } else { (sum / (2.0 * TAU)).as_vec3() };
        let largest = rows.iter().map(|row| row.largest).fold(0.0, f32::max);
        // Decided in f64: the mean of one dim texel may be nothing in f32.
        Ok(Self { mean, largest, black: sum.max_element() <= 0.0, constant })
    }
}
