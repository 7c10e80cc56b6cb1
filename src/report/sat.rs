//! The talk's comparison of summed-area tables, with one more extreme map.

use std::path::Path;

use serde::Serialize;

use super::machine::Machine;
pub use super::pages::sat::{Measured, REMARK, markdown};
use super::pages::{sat, write_text};
use super::store::Store;
use crate::environment::{TALKS_MAPS, TIMED_SAMPLES, sat_report, sky};
use crate::error::Result;
use crate::image::Image;
use crate::math::direction_from_uv;
use crate::output::record::write_json;

/// A map with the talk's published errors.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Case {
    /// Its title.
    pub title: &'static str,
    /// Columns and rows.
    pub size: (u32, u32),
    /// Mean squared error in the talk's unit, u32 and f32; `None` for the extreme map.
    pub published: Option<[f64; 2]>,
}

/// The talk's maps, replaced by built-in skies, and the extreme one.
pub fn cases() -> Vec<Case> {
    let talks =
        TALKS_MAPS.map(|(title, size, mse)| Case { title, size, published: Some(mse) }).to_vec();
    [talks, vec![Case { title: "Extreme", size: (10_000, 5000), published: None }]].concat()
}

impl Case {
    /// Measures it with sides `scale` times as long.
    ///
    /// # Errors
    /// If the map cannot be made.
    pub fn measure(&self, scale: f64) -> Result<Measured> {
        let side = |length: u32| ((f64::from(length) * scale).round() as u32).max(2);
        let (width, height) = (side(self.size.0), side(self.size.1));
        let map = match self.published {
            Some(_) => sky::build(&self.title.to_lowercase(), width, height)?,
            None => extreme(width, height),
        };
        let report = sat_report(&map, TIMED_SAMPLES)?;
        Ok(Measured { title: self.title.to_owned(), published: self.published, report })
    }
}

/// A dim noisy sky with a sun of 0.27 degrees that is 10^8 times as bright: nearly all the energy is in a few
/// texels, and each other texel has less than 2^-32 of it.
fn extreme(width: u32, height: u32) -> Image {
    const SUN_RADIUS_RADIANS: f32 = 0.0047;
    let sun = direction_from_uv(glam::Vec2::new(0.3, 0.25));
    // A sun smaller than a texel is one texel large.
    let radius = SUN_RADIUS_RADIANS.max(0.75 * std::f32::consts::PI / height as f32);
    Image::from_fn(width, height, |x, y| {
        let uv = glam::Vec2::new((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
        let is_sun = direction_from_uv(uv).distance(sun) < radius;
        [if is_sun { 1e8 } else { 0.5 + crate::noise::unit(y * width + x) }; 3]
    })
}

/// Measures all cases and calls `tell` with each. Cases stored in `folder` are reused; `sat.json` and `sat.csv`
/// are written there after each case.
///
/// # Errors
/// If a map cannot be made or a file cannot be written.
pub fn measure_all(
    scale: f64,
    folder: Option<&Path>,
    mut is_cancelled: impl FnMut(&Case) -> bool,
    mut tell: impl FnMut(&Measured),
) -> Result<Vec<Measured>> {
    let store = folder.map(|folder| Store::open(folder, None)).transpose()?;
    let machine = Machine::here().digest();
    let mut all = Vec::new();
    for case in &cases() {
        if is_cancelled(case) {
            break;
        }
        let key = format!("sat-{}_{}", case.title, machine.debug(&(case, scale.to_bits())));
        let kept = store.as_ref().and_then(|store| store.read(&key));
        let measured = kept.map_or_else(|| case.measure(scale), Ok)?;
        tell(&measured);
        all.push(measured);
        if let (Some(store), Some(folder)) = (&store, folder) {
            store.write(&key, &all[all.len() - 1])?;
            write_json(&folder.join("sat.json"), &all)?;
            write_text(&folder.join("sat.csv"), &sat::Csv { maps: &all }.to_string())?;
        }
    }
    Ok(all)
}
