//! The environment map as a light: radiance, equal-size tiles, importance sampling in a tile.
//!
//! An [`Environment`] owns the map's pixels and an importance table over them. The map is cut into
//! equal-size tiles that are fixed to the map; which tile to sample is somebody else's choice (the
//! light grid learns it, [`Environment::tile_energies`] is the choice without knowledge), so every
//! density here is conditional on the tile.
//!
//! Rotation turns the map about +Y as [`crate::math::rotate_y`] turns directions: what the map
//! shows at `u` is seen at lat-long `u + rotation / 2pi`. Tiles turn with the map.

pub mod landmarks;
mod options;
mod sat_report;
pub mod sky;
mod summed_area;
mod table;
mod tile_local;
mod tiles;
mod weights;

use std::borrow::Cow;
use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DVec2, Vec2, Vec3};
use rayon::prelude::*;

pub use self::options::{EnvironmentOptions, Lookup, TableKind};
pub use self::sat_report::{SatReport, SatReportRow, sat_report};
use self::table::Table;
use self::tiles::TileGrid;
use self::weights::Weights;
use crate::error::{Error, Result};
use crate::image::Image;
use crate::math::{direction_from_uv, sin_cos_turns, texel_solid_angle, uv_from_direction};
use crate::sampler::hash;

/// A lat-long map of radiance that can be looked up and sampled. Clones share pixels and table.
#[derive(Debug, Clone)]
pub struct Environment {
    map: Arc<Image>,
    lookup: Lookup,
    grid: TileGrid,
    table: Arc<Table>,
    tile_energies: Vec<f64>,
    /// Cosine of the polar angle at the edges of the rows, `height + 1` of them.
    row_edge_cosines: Vec<f64>,
    /// 1 / steradian of a texel, per row.
    inverse_texel_solid_angles: Vec<f32>,
    /// Solid-angle mean of the map, without intensity.
    map_mean: Vec3,
    map_is_black: bool,
    map_is_constant: bool,
    /// Rotation in turns, in `[0,1)`.
    rotation_turns: f32,
    intensity: f32,
}

/// A direction drawn from one tile of the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnvironmentSample {
    /// Unit world direction towards the map.
    pub direction: Vec3,
    /// Radiance from there.
    pub radiance: Vec3,
    /// Density in 1/steradian, given the tile.
    pub pdf_solid_angle: f32,
}

/// Bytes an [`Environment`] keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EnvironmentMemory {
    /// The map's pixels.
    pub pixels: usize,
    /// The importance table, with the tiles' and rows' look-up arrays.
    pub table: usize,
}

/// A place on the map in texels, and the texel it lies in.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MapPoint {
    pub(crate) x: f32,
    pub(crate) y: f32,
    pub(crate) column: u32,
    pub(crate) row: u32,
}

impl Environment {
    /// Takes a map (finite, not negative) and builds its importance table.
    ///
    /// # Errors
    /// If the map has no pixels, or a radiance that is negative or not finite, or if an option is
    /// out of range.
    pub fn new(map: Image, options: &EnvironmentOptions) -> Result<Self> {
        options.check()?;
        check_size(&map)?;
        let statistics = Statistics::of(&map, options.lookup)?;
        let grid = TileGrid::new(map.width, map.height, options.tile_columns, options.tile_rows);
        let weights = Weights::new(&map, options.lookup);
        let (table, tile_energies) = Table::build(options.table, &weights, &grid);
        let rows = f64::from(map.height);
        let row_edge_cosines = (0..=map.height)
            .map(|edge| (std::f64::consts::PI * f64::from(edge) / rows).cos())
            .collect();
        let inverse_texel_solid_angles = (0..map.height)
            .map(|row| (1.0 / texel_solid_angle(map.width, map.height, row)) as f32)
            .collect();
        let mut environment = Self {
            map: Arc::new(map),
            lookup: options.lookup,
            grid,
            table: Arc::new(table),
            tile_energies,
            row_edge_cosines,
            inverse_texel_solid_angles,
            map_mean: statistics.mean,
            map_is_black: statistics.black,
            map_is_constant: statistics.constant,
            rotation_turns: 0.0,
            intensity: options.intensity,
        };
        environment.set_rotation(options.rotation_radians);
        Ok(environment)
    }

    /// Turns the map to this angle (finite, radians); nothing is rebuilt.
    pub fn set_rotation(&mut self, rotation_radians: f32) {
        let turns = (f64::from(rotation_radians) / TAU).rem_euclid(1.0) as f32;
        self.rotation_turns = if turns < 1.0 { turns } else { 0.0 };
    }

    /// Sets the factor (finite, not negative) on all radiance; nothing is rebuilt.
    pub fn set_intensity(&mut self, intensity: f32) {
        self.intensity = intensity;
    }

    /// Radiance from a unit world direction.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        self.radiance_at(self.map_point(direction))
    }

    /// Number of tiles.
    pub fn tile_count(&self) -> u32 {
        self.grid.count()
    }

    /// Columns and rows of tiles; tile `t` is in row `t / columns`, column `t % columns`.
    pub fn tile_grid(&self) -> (u32, u32) {
        self.grid.size()
    }

    /// Unit world direction of a place in a tile, `within` in `[0,1]`^2 of its extent in u and v.
    pub fn direction_in_tile(&self, tile: u32, within: Vec2) -> Vec3 {
        let texels = self.grid.texels(tile);
        let size = Vec2::new(self.map.width as f32, self.map.height as f32);
        let first = Vec2::new(texels.x.start as f32, texels.y.start as f32);
        let extent = Vec2::new(texels.width() as f32, texels.height() as f32);
        let uv = (first + within * extent) / size;
        direction_from_uv(Vec2::new(uv.x + self.rotation_turns, uv.y))
    }

    /// The tile seen in a unit world direction.
    pub fn tile_of(&self, direction: Vec3) -> u32 {
        let point = self.map_point(direction);
        self.grid.tile_of_texel(point.column, point.row)
    }

    /// Per tile the integral of importance over its solid angle, at intensity 1, as the table has
    /// it. Tiles of energy 0 cannot be sampled.
    pub fn tile_energies(&self) -> &[f64] {
        &self.tile_energies
    }

    /// Draws a direction from a tile: a texel by importance, then a place in it, uniform in solid
    /// angle. `u` is uniform in `[0,1)`^2. `None` if the tile is black.
    ///
    /// Places keep [`EDGE_MARGIN_TURNS`] away from texel edges, so that the direction, rounded to
    /// f32, is always found in the very texel it was drawn from: the density is then exactly that
    /// of [`Self::tile_pdf_solid_angle`] for this direction.
    pub fn sample_in_tile(&self, tile: u32, u: Vec2) -> Option<EnvironmentSample> {
        let texel = self.table.sample(&self.grid, tile, refine(u))?;
        let (width, height) = (f64::from(self.map.width), f64::from(self.map.height));
        let margin = (EDGE_MARGIN_TURNS * DVec2::new(width, 4.0 * height)).min(DVec2::splat(0.25));
        let within = margin + texel.within * (1.0 - 2.0 * margin);

        let x = f64::from(texel.x) + within.x;
        let world_turns = x / width + f64::from(self.rotation_turns) - 0.5;
        let (sin_phi, cos_phi) = sin_cos_turns((world_turns - world_turns.round()) as f32);
        let row = texel.y as usize;
        let (top, bottom) = (self.row_edge_cosines[row], self.row_edge_cosines[row + 1]);
        let cos_theta = top + within.y * (bottom - top);
        let sin_theta = ((1.0 - cos_theta) * (1.0 + cos_theta)).max(0.0).sqrt() as f32;
        let direction = Vec3::new(sin_theta * cos_phi, cos_theta as f32, sin_theta * sin_phi);

        let y = uv_from_direction(direction).y * height as f32;
        let point = MapPoint { x: x as f32, y, column: texel.x, row: texel.y };
        Some(EnvironmentSample {
            direction,
            radiance: self.radiance_at(point),
            pdf_solid_angle: self.texel_pdf_solid_angle(texel.probability, texel.y),
        })
    }

    /// The tile in a unit world direction, and the density of [`Self::sample_in_tile`] there,
    /// given that tile.
    pub fn tile_pdf_solid_angle(&self, direction: Vec3) -> (u32, f32) {
        self.tile_pdf_at(self.map_point(direction))
    }

    /// [`Self::radiance`] and [`Self::tile_pdf_solid_angle`] for the price of one mapping.
    pub fn radiance_and_tile_pdf(&self, direction: Vec3) -> (Vec3, u32, f32) {
        let point = self.map_point(direction);
        let (tile, pdf_solid_angle) = self.tile_pdf_at(point);
        (self.radiance_at(point), tile, pdf_solid_angle)
    }

    /// Whether no light comes from anywhere.
    pub fn is_black(&self) -> bool {
        self.intensity <= 0.0 || self.map_is_black
    }

    /// Whether all pixels are the same.
    pub fn is_constant(&self) -> bool {
        self.map_is_constant
    }

    /// Mean radiance over the sphere.
    pub fn mean_radiance(&self) -> Vec3 {
        (self.map_mean * self.intensity).min(Vec3::MAX)
    }

    /// The map as it was given: not turned, at intensity 1.
    pub fn map(&self) -> &Image {
        &self.map
    }

    /// The table's words, part after part, for a GPU; summed-area tables have one part.
    pub(crate) fn table_words(&self) -> Vec<Cow<'_, [u32]>> {
        self.table.words()
    }

    /// Which table, and how radiance is read.
    pub(crate) fn kind(&self) -> (TableKind, Lookup) {
        (self.table.kind(), self.lookup)
    }

    /// Rotation in turns, in `[0,1)`, and the factor on all radiance.
    pub(crate) fn rotation_and_intensity(&self) -> (f32, f32) {
        (self.rotation_turns, self.intensity)
    }

    /// 1 / steradian of a texel, per row.
    pub(crate) fn inverse_texel_solid_angles(&self) -> &[f32] {
        &self.inverse_texel_solid_angles
    }

    /// What the pixels and the table take.
    pub fn memory_bytes(&self) -> EnvironmentMemory {
        let rows = size_of_val(&self.row_edge_cosines[..])
            + size_of_val(&self.inverse_texel_solid_angles[..])
            + size_of_val(&self.tile_energies[..]);
        EnvironmentMemory {
            pixels: size_of_val(&self.map.pixels[..]),
            table: self.table.memory_bytes() + self.grid.memory_bytes() + rows,
        }
    }

    fn tile_pdf_at(&self, point: MapPoint) -> (u32, f32) {
        let tile = self.grid.tile_of_texel(point.column, point.row);
        let probability = self.table.sample_probability(&self.grid, tile, point.column, point.row);
        (tile, self.texel_pdf_solid_angle(probability, point.row))
    }

    fn texel_pdf_solid_angle(&self, probability: f64, row: u32) -> f32 {
        probability as f32 * self.inverse_texel_solid_angles[row as usize]
    }

    /// Whether both are one map with one table, turned or scaled differently.
    pub fn shares_map_with(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.map, &other.map) && Arc::ptr_eq(&self.table, &other.table)
    }

    /// Where the map shows a unit world direction.
    pub(crate) fn map_point(&self, direction: Vec3) -> MapPoint {
        let uv = uv_from_direction(direction);
        let turned = uv.x - self.rotation_turns;
        let u = if turned < 0.0 { turned + 1.0 } else { turned };
        let (x, y) = (u * self.map.width as f32, uv.y * self.map.height as f32);
        MapPoint {
            x,
            y,
            column: (x as u32).min(self.map.width - 1),
            row: (y as u32).min(self.map.height - 1),
        }
    }

    fn radiance_at(&self, point: MapPoint) -> Vec3 {
        let radiance = match self.lookup {
            Lookup::Nearest => Vec3::from(self.map.at(point.column, point.row)),
            Lookup::Bilinear => self.interpolated(point),
        };
        (radiance * self.intensity).min(Vec3::MAX)
    }

    /// Bilinear between texel centres, wrapped in u, clamped in v.
    fn interpolated(&self, point: MapPoint) -> Vec3 {
        let (width, height) = (self.map.width, self.map.height);
        let (x, y) = (point.x - 0.5, (point.y - 0.5).clamp(0.0, (height - 1) as f32));
        let left = x.floor();
        let (across, down) = (x - left, y - y.floor());
        let left = if left < 0.0 { width - 1 } else { (left as u32).min(width - 1) };
        let right = if left + 1 < width { left + 1 } else { 0 };
        let top = y as u32;
        let bottom = (top + 1).min(height - 1);
        let at = |x, y| Vec3::from(self.map.at(x, y));
        let upper = at(left, top).lerp(at(right, top), across);
        let lower = at(left, bottom).lerp(at(right, bottom), across);
        upper.lerp(lower, down)
    }
}

/// How far samples keep from texel edges, in turns about the map's axis: 1.5e-6 radian, several
/// times the rounding of an f32 direction and its way back to the map, and under a hundredth of a
/// texel at a width of 16384.
pub const EDGE_MARGIN_TURNS: f64 = 1.0 / (1 << 22) as f64;

/// Gives f32 random numbers the bits that choosing among 2^32 takes.
///
/// A uniform f32 has 24 good bits: entries of less than 2^-24 of a table would be met by chance of
/// rounding only. So each number gets 24 more, hashed from both, below its last bit: order, hence
/// stratification, stays.
pub(crate) fn refine(u: Vec2) -> DVec2 {
    const STEPS: f32 = (1 << 24) as f32;
    let (x, y) = (lattice(u.x * STEPS), lattice(u.y * STEPS));
    let fine_x = hash(hash(x) ^ y);
    let fine_y = hash(fine_x ^ x);
    let refined = |coarse: u32, fine: u32| {
        ((u64::from(coarse) << 24) | u64::from(fine >> 8)) as f64 / (1_u64 << 48) as f64
    };
    DVec2::new(refined(x, fine_x), refined(y, fine_y))
}

fn lattice(steps: f32) -> u32 {
    (steps as u32).min((1 << 24) - 1)
}

fn check_size(map: &Image) -> Result<()> {
    let pixels = map.width as usize * map.height as usize;
    if pixels == 0 || pixels != map.pixels.len() || pixels > 1 << 31 {
        return Err(Error::new(format!(
            "an environment map of {} x {} with {} pixels cannot be used",
            map.width,
            map.height,
            map.pixels.len()
        )));
    }
    Ok(())
}

/// What one pass over the pixels tells.
struct Statistics {
    mean: Vec3,
    black: bool,
    constant: bool,
}

impl Statistics {
    fn of(map: &Image, lookup: Lookup) -> Result<Self> {
        let first = map.pixels[0];
        let solid_angle = |row: u32| texel_solid_angle(map.width, map.height, row);
        let row_weight = |y: u32| match lookup {
            Lookup::Nearest => solid_angle(y),
            // The rows that interpolate this one, see `Weights::row`.
            Lookup::Bilinear => {
                let (above, below) = (y.saturating_sub(1), (y + 1).min(map.height - 1));
                (solid_angle(above) + 6.0 * solid_angle(y) + solid_angle(below)) / 8.0
            }
        };
        let (sum, constant, valid) = map
            .pixels
            .par_chunks_exact(map.width as usize)
            .zip(0..map.height)
            .map(|(row, y)| {
                let mut sum = glam::DVec3::ZERO;
                let (mut constant, mut valid) = (true, true);
                for pixel in row {
                    sum += Vec3::from(*pixel).as_dvec3();
                    constant &= *pixel == first;
                    valid &= pixel.iter().all(|value| (0.0..=f32::MAX).contains(value));
                }
                (sum * row_weight(y), constant, valid)
            })
            .collect::<Vec<_>>()
            .into_iter()
            .fold((glam::DVec3::ZERO, true, true), |a, b| (a.0 + b.0, a.1 && b.1, a.2 && b.2));
        if !valid {
            return Err(Error::new(
                "the environment map has radiance that is negative or not finite",
            ));
        }
        let mean = if constant { Vec3::from(first) } else { (sum / (2.0 * TAU)).as_vec3() };
        // Decided in f64: the mean of one dim texel may be nothing in f32.
        Ok(Self { mean, black: sum.max_element() <= 0.0, constant })
    }
}
