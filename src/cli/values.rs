//! Argument values: sizes, vectors, positive numbers, each refused with the reason.

use glam::Vec3;

pub(super) use crate::sources::size_pair as pair;

/// Largest picture in pixels: 40 bytes a pixel stay under 5.4 GB.
const MAX_PIXELS: u64 = 1 << 27;

/// `WIDTHxHEIGHT` in pixels.
pub(super) fn size(text: &str) -> Result<(u32, u32), String> {
    let (width, height) = pair(text)?;
    let pixels = u64::from(width) * u64::from(height);
    if pixels > MAX_PIXELS {
        return Err(format!("{pixels} pixels are more than the {MAX_PIXELS} a picture may have"));
    }
    Ok((width, height))
}

/// `X,Y,Z` in metres.
pub(super) fn vector(text: &str) -> Result<Vec3, String> {
    let numbers: Vec<f32> = text
        .split(',')
        .filter_map(|t| t.trim().parse().ok().filter(|x: &f32| x.is_finite()))
        .collect();
    match numbers[..] {
        [x, y, z] if text.split(',').count() == 3 => Ok(Vec3::new(x, y, z)),
        _ => Err("expected three numbers like 1.5,2,-3".to_owned()),
    }
}

/// A finite number above zero.
pub(super) fn positive(text: &str) -> Result<f64, String> {
    let x = finite(text)?;
    if x > 0.0 { Ok(x) } else { Err("must be above 0".to_owned()) }
}

/// A finite number of at least zero.
pub(super) fn not_negative(text: &str) -> Result<f32, String> {
    let x = finite(text)?;
    if x >= 0.0 { Ok(x as f32) } else { Err("must not be negative".to_owned()) }
}

/// A finite number.
pub(super) fn finite(text: &str) -> Result<f64, String> {
    text.trim()
        .parse::<f64>()
        .ok()
        .filter(|x| (*x as f32).is_finite())
        .ok_or_else(|| "expected a number".to_owned())
}
