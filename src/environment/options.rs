//! Options of a map as a light: importance table, tiles, rotation, intensity, sun.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// The importance table a map is sampled by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TableKind {
    /// Exact integer sums tile by tile, 4 bytes per texel.
    #[default]
    TileLocal,
    /// The talk's table: a summed-area table in f64, rounded to u32.
    U32,
    /// A summed-area table computed in f32.
    F32,
    /// A summed-area table in f64, 8 bytes per texel.
    F64,
}

impl TableKind {
    /// All kinds, in the order they are reported.
    pub const ALL: [Self; 4] = [Self::TileLocal, Self::U32, Self::F32, Self::F64];
}

impl fmt::Display for TableKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

with_defaults! {
    /// Options of an [`super::Environment`].
    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    pub struct EnvironmentOptions {
        /// Importance table.
        pub table: TableKind = TableKind::default(),
        /// Tiles along u, at least 1; no more are made than the map has columns.
        pub tile_columns: u32 = 16,
        /// Tiles along v, at least 1; no more are made than the map has rows.
        pub tile_rows: u32 = 8,
        /// Rotation about +Y in radians; it increases the lat-long `u` at which each texel is seen.
        pub rotation_radians: f32 = 0.0,
        /// Factor on all radiance, at least 0.
        pub intensity: f32 = 1.0,
        /// Factor on the light of the sun alone, at least 0; the map is changed accordingly.
        pub sun: f32 = 1.0,
    }
}

impl EnvironmentOptions {
    /// Says which option is out of range, if any.
    pub(crate) fn check(&self) -> Result<()> {
        let complaint = if self.tile_columns == 0 || self.tile_rows == 0 {
            "the environment map needs at least one tile in each axis"
        } else if !self.rotation_radians.is_finite() {
            "the rotation of the environment map is not a finite number"
        } else if !(0.0..=f32::MAX).contains(&self.intensity) {
            "the intensity of the environment map is negative or not a finite number"
        } else if !(0.0..=f32::MAX).contains(&self.sun) {
            "the factor on the sun is negative or not a finite number"
        } else {
            return Ok(());
        };
        Err(Error::new(complaint))
    }
}
