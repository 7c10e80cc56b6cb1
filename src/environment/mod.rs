//! The environment map as a light: radiance, equal-size tiles, importance sampling in a tile.
//!
//! An [`Environment`] owns the map's pixels and an importance table over its patches, the areas
//! between texel centres (`patches`). The density of a direction is the importance of the interpolated
//! radiance over the tile's energy. The map is cut into equal-size tiles that are fixed to the map. The
//! caller chooses the tile (the light grid learns which; without learning, tiles are chosen by
//! [`Environment::tile_energies`]), so every density here is conditional on the tile.
//!
//! Rotation turns the map about +Y as [`crate::math::rotate_y`] turns directions: what the map
//! shows at `u` is seen at lat-long `u + rotation / 2pi`. Tiles turn with the map.

mod options;
mod patches;
mod sat_report;
pub mod sky;
mod statistics;
mod summed_area;
pub mod sun;
mod table;
mod tile_local;
mod tiles;
mod weights;

use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::Arc;

use glam::{DVec2, Vec2, Vec3};
use rayon::prelude::*;

pub use self::options::{EnvironmentOptions, TableKind};
use self::patches::{PatchRows, sample_linear};
pub use self::sat_report::{SatReport, SatReportRow, TALKS_MAPS, TIMED_SAMPLES, sat_report};
use self::statistics::{Statistics, check_size};
use self::table::{Search, Table};
use self::tiles::TileGrid;
use self::weights::Weights;
use crate::color::importance;
use crate::error::{Error, Result};
use crate::huge_pages::zeros_on_huge_pages;
use crate::image::Image;
use crate::math::{direction_from_uv, sin_cos_turns, uv_from_direction};
use crate::memory;
use crate::prefetch::prefetch;
use crate::sampler::hash;

/// A lat-long map of radiance that can be looked up and sampled. Clones share pixels and table.
#[derive(Debug, Clone)]
pub struct Environment {
    map: Arc<Image>,
    grid: TileGrid,
    table: Arc<Table>,
    pub(crate) table_kind: TableKind,
    tile_energies: Vec<f64>,
    pub(crate) patches: PatchRows,
    /// Factor on importance that brings the brightest pixel near 1: a power of two.
    pub(crate) importance_scale: f32,
    /// The pixels' importance, scaled by `importance_scale`. Placing a sample needs only these, a third of the
    /// pixels' size; most samples are occluded and need no radiance.
    importances: Arc<Vec<f32>>,
    /// One over each tile's energy in the same scale; 0 where f32 overflows.
    pub(crate) inverse_energies: Vec<f32>,
    /// Of the pixels, without intensity.
    statistics: Statistics,
    /// Rotation in turns, in `[0,1)`.
    rotation_turns: f32,
    intensity: f32,
}

/// A direction drawn from one tile of the map; [`Environment::sampled_radiance`] gives its radiance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnvironmentSample {
    /// Unit world direction towards the map.
    pub direction: Vec3,
    /// Density in 1/steradian, given the tile: the importance of the radiance over the tile's energy.
    pub pdf_solid_angle: f32,
    /// That density over the actual one of the table's integers, a factor of the estimate that keeps it exact.
    /// It differs from 1 by the rounding of patches to 2^-32 of a tile.
    pub weight: f32,
    point: MapPoint,
}

/// Bytes an [`Environment`] keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EnvironmentMemory {
    /// The map's pixels.
    pub pixels: usize,
    /// The importance table, with the tiles' and rows' look-up arrays.
    pub table: usize,
}

/// A place on the map: a patch and the position in it, in `[0,1]` of its extent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct MapPoint {
    pub(crate) column: u32,
    pub(crate) row: u32,
    pub(crate) across: f32,
    pub(crate) down: f32,
}

/// Values at the corners of a patch: left to right, then down.
type Corners<T> = [T; 4];

/// A direction whose patch is not yet chosen completely.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TileSearch {
    tile: u32,
    search: Search,
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
        let map = if options.sun == 1.0 { map } else { sun::with_sun(map, options.sun) };
        let statistics = Statistics::of(&map)?;
        let weights = Weights::new(&map);
        let (columns, rows) = weights.size();
        let grid = TileGrid::new(columns, rows, options.tile_columns, options.tile_rows);
        let (table, tile_energies) = Table::build(options.table, &weights, &grid);
        let importance_scale = importance_scale(statistics.largest);
        let mut importances = zeros_on_huge_pages(map.pixels.len());
        importances.par_iter_mut().zip(&map.pixels).for_each(|(scaled, rgb)| {
            *scaled = importance(Vec3::from(*rgb) * importance_scale);
        });
        let inverse = |energy: &f64| {
            let inverse = (1.0 / (energy * f64::from(importance_scale))) as f32;
            if inverse.is_finite() { inverse } else { 0.0 }
        };
        let inverse_energies = tile_energies.iter().map(inverse).collect();
        let mut environment = Self {
            patches: PatchRows::new(map.width, map.height),
            map: Arc::new(map),
            grid,
            table: Arc::new(table),
            table_kind: options.table,
            tile_energies,
            importance_scale,
            importances: Arc::new(importances),
            inverse_energies,
            statistics,
            rotation_turns: 0.0,
            intensity: options.intensity,
        };
        environment.set_rotation(options.rotation_radians);
        Ok(environment)
    }

    /// The map without the light of its sun and with nothing else, as [`EnvironmentOptions::sun`] parts them.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(crate) fn parted(&self) -> Result<[Self; 2]> {
        let sky = self.with_sun(0.0)?;
        let mut sun = self.map().clone();
        for (pixel, sky) in sun.pixels.iter_mut().zip(&sky.map().pixels) {
            *pixel = [0, 1, 2].map(|channel| (pixel[channel] - sky[channel]).max(0.0));
        }
        Ok([sky, self.with_map(sun)?])
    }

    /// The same with a factor on its sun, as [`EnvironmentOptions::sun`] is.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(crate) fn with_sun(&self, factor: f32) -> Result<Self> {
        self.with_map(sun::with_sun(self.map().clone(), factor))
    }

    fn with_map(&self, map: Image) -> Result<Self> {
        // The table takes as much again.
        memory::check(2 * size_of_val(&*map.pixels) as u64)
            .map_err(|cause| Error::new(format!("a map with another sun {cause}")))?;
        let (tile_columns, tile_rows) = self.tile_grid();
        let (table, intensity) = (self.table_kind, self.intensity);
        let options =
            EnvironmentOptions { table, tile_columns, tile_rows, intensity, ..Default::default() };
        Ok(Self { rotation_turns: self.rotation_turns, ..Self::new(map, &options)? })
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
        self.radiance_at(&self.map_point(direction))
    }

    /// Radiance of a sample.
    pub fn sampled_radiance(&self, sample: &EnvironmentSample) -> Vec3 {
        self.radiance_at(&sample.point)
    }

    /// Prefetches the pixels that [`Self::sampled_radiance`] reads.
    pub(crate) fn prefetch_radiance(&self, sample: &EnvironmentSample) {
        let [_, above, _, below] = self.corner_pixels(sample.point.column, sample.point.row);
        [above, below].iter().for_each(|pixel| prefetch(&self.map.pixels[*pixel]));
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
        let [u, v] = self.extent_of_tile(tile);
        let at = |range: Range<f64>, t| range.start + f64::from(t) * (range.end - range.start);
        direction_from_uv(DVec2::new(at(u, within.x), at(v, within.y)).as_vec2())
    }

    /// The ranges of lat-long u, which may pass 1, and v of world directions in a tile.
    pub(crate) fn extent_of_tile(&self, tile: u32) -> [Range<f64>; 2] {
        let patches = self.grid.patches(tile);
        let shift = f64::from(patches::SHIFT);
        let u = |x| (f64::from(x) - shift) / f64::from(self.map.width);
        let turned = |x| u(x) + f64::from(self.rotation_turns);
        // The rows at the poles are half as high.
        let v = |y| ((f64::from(y) - shift) / f64::from(self.map.height)).clamp(0.0, 1.0);
        [turned(patches.x.start)..turned(patches.x.end), v(patches.y.start)..v(patches.y.end)]
    }

    /// The tile seen in a unit world direction.
    pub fn tile_of(&self, direction: Vec3) -> u32 {
        let (column, row) = self.patch_of(direction);
        self.grid.tile_of_patch(column, row)
    }

    /// Per tile, the table's integral of importance over the tile's solid angle, at intensity 1. Tiles of energy
    /// 0 cannot be sampled.
    pub fn tile_energies(&self) -> &[f64] {
        &self.tile_energies
    }

    /// Draws a direction from a tile by two uniform 32-bit fractions of one: a patch by importance,
    /// then a place in it by the importance interpolated there. `None` if the tile is black, or
    /// darker than f32 can tell from black beside the brightest pixel.
    pub fn sample_in_tile(&self, tile: u32, u: [u32; 2]) -> Option<EnvironmentSample> {
        self.finish_sample(&self.search_tile(tile, u)?)
    }

    /// Begins [`Self::sample_in_tile`] and prefetches the data that [`Self::finish_sample`] reads, so that the caller
    /// can work while memory is read.
    pub(crate) fn search_tile(&self, tile: u32, u: [u32; 2]) -> Option<TileSearch> {
        let search = self.table.search(tile, refine(u))?;
        if let Search::TileLocal(search) = &search {
            let (row, columns) = search.among();
            self.prefetch_importances(row, columns);
        }
        Some(TileSearch { tile, search })
    }

    /// Completes the direction that [`Self::search_tile`] began.
    pub(crate) fn finish_sample(&self, search: &TileSearch) -> Option<EnvironmentSample> {
        let tile = search.tile;
        let patch = self.table.finish(&self.grid, tile, &search.search)?;
        let corners @ [a, b, c, d] = self.importances(patch.x, patch.y);
        let down = sample_linear(a + b, c + d, patch.within.y);
        let (left, right) = (a + down * (c - a), b + down * (d - b));
        let across = sample_linear(left, right, patch.within.x);
        let point = MapPoint { column: patch.x, row: patch.y, across, down };
        let here = left + across * (right - left);
        let pdf_solid_angle = self.density(tile, &point, here);
        if pdf_solid_angle <= 0.0 {
            return None;
        }
        let weight = match &*self.table {
            Table::TileLocal(_) => {
                let energy = self.patch_energy(corners, patch.y);
                energy * self.inverse_energies[tile as usize] / patch.probability
            }
            Table::SummedArea(_) => 1.0,
        };
        let direction = self.direction_in_patch((patch.x, patch.y), Vec2::new(across, down));
        Some(EnvironmentSample { direction, pdf_solid_angle, weight, point })
    }

    /// Columns and rows of patches.
    pub fn patch_grid(&self) -> (u32, u32) {
        (self.map.width, self.patches.rows.len() as u32)
    }

    /// Steradians of a patch of a row.
    pub fn patch_solid_angle(&self, row: u32) -> f32 {
        self.patches.rows[row as usize].solid_angle
    }

    /// Unit world direction of a place in the patch of this column and row, `within` in `[0,1]`^2 of
    /// its longitudes and of its solid angle.
    pub fn direction_in_patch(&self, (column, row): (u32, u32), within: Vec2) -> Vec3 {
        let x = column as f32 + within.x - patches::SHIFT;
        let world_turns = x / self.map.width as f32 + self.rotation_turns - 0.5;
        let (sin_phi, cos_phi) = sin_cos_turns(world_turns);
        let (sin_theta, cos_theta) = self.patches.polar_angle(row, within.y);
        Vec3::new(sin_theta * cos_phi, cos_theta, sin_theta * sin_phi)
    }

    /// Column and row of the patch seen in a unit world direction.
    pub fn patch_of(&self, direction: Vec3) -> (u32, u32) {
        let point = self.map_point(direction);
        (point.column, point.row)
    }

    /// Radiance from a unit world direction, the tile seen there, and the density of
    /// [`Self::sample_in_tile`] there, given that tile. A direction within the rounding of a tile's
    /// edge (1e-7 radian) may be found in the tile beside the one it was drawn from.
    pub fn radiance_and_tile_pdf(&self, direction: Vec3) -> (Vec3, u32, f32) {
        let point = self.map_point(direction);
        let tile = self.grid.tile_of_patch(point.column, point.row);
        let corners = self.corners(point.column, point.row);
        let radiance = interpolated(corners, point.across, point.down);
        let here = importance(radiance * self.importance_scale);
        let pdf = self.density(tile, &point, here);
        (self.scaled(radiance), tile, pdf)
    }

    /// Whether the map is black.
    pub fn is_black(&self) -> bool {
        self.intensity <= 0.0 || self.statistics.black
    }

    /// Whether all pixels are the same.
    pub fn is_constant(&self) -> bool {
        self.statistics.constant
    }

    /// Mean radiance over the sphere.
    pub fn mean_radiance(&self) -> Vec3 {
        (self.statistics.mean * self.intensity).min(Vec3::MAX)
    }

    /// The map with its sun factor applied, not rotated, at intensity 1.
    pub fn map(&self) -> &Image {
        &self.map
    }

    /// The table's sums along the rows of tiles, and down the tiles; `None` of a summed-area table.
    pub(crate) fn tile_sums(&self) -> Option<[&[u32]; 2]> {
        match &*self.table {
            Table::TileLocal(table) => Some(table.sums()),
            Table::SummedArea(_) => None,
        }
    }

    /// Rotation in turns, in `[0,1)`, and the factor on all radiance.
    pub(crate) fn rotation_and_intensity(&self) -> (f32, f32) {
        (self.rotation_turns, self.intensity)
    }

    /// Memory of the pixels and of the table.
    pub fn memory_bytes(&self) -> EnvironmentMemory {
        let rows = size_of_val(&self.patches.rows[..])
            + size_of_val(&self.importances[..])
            + size_of_val(&self.inverse_energies[..])
            + size_of_val(&self.tile_energies[..]);
        EnvironmentMemory {
            pixels: size_of_val(&self.map.pixels[..]),
            table: self.table.memory_bytes() + self.grid.memory_bytes() + rows,
        }
    }

    /// Density of [`Self::sample_in_tile`], given the tile, at a point of this scaled importance. Only
    /// summed-area tables need the importances at the patch's corners.
    fn density(&self, tile: u32, point: &MapPoint, here: f32) -> f32 {
        match &*self.table {
            Table::TileLocal(_) => here * self.inverse_energies[tile as usize],
            table @ Table::SummedArea(_) => {
                let (x, y) = (point.column, point.row);
                let energy = self.patch_energy(self.importances(x, y), y);
                let probability = table.sample_probability(&self.grid, tile, x, y) as f32;
                if energy > 0.0 { probability * (here / energy) } else { 0.0 }
            }
        }
    }

    /// Scaled energy of a patch of row `y` with corners of these importances.
    fn patch_energy(&self, corners: Corners<f32>, y: u32) -> f32 {
        0.25 * corners.iter().sum::<f32>() * self.patches.rows[y as usize].solid_angle
    }

    /// Whether both are one map with one table, turned or scaled differently.
    pub fn shares_map_with(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.map, &other.map) && Arc::ptr_eq(&self.table, &other.table)
    }

    /// The place on the map of a unit world direction.
    pub(crate) fn map_point(&self, direction: Vec3) -> MapPoint {
        let uv = uv_from_direction(direction);
        let turned = uv.x - self.rotation_turns;
        let u = if turned < 0.0 { turned + 1.0 } else { turned };
        let width = self.map.width;
        let x = u * width as f32 + patches::SHIFT;
        // Never negative; `floor` is a call where a machine need not have the instruction.
        let left = x as u32;
        let rows = self.patches.rows.len() as u32;
        let row = ((uv.y * self.map.height as f32 + patches::SHIFT) as u32).min(rows - 1);
        let squared_sine = direction.x * direction.x + direction.z * direction.z;
        MapPoint {
            // The last half texel before the seam belongs to the patch across it.
            column: if left >= width { 0 } else { left },
            row,
            across: x - left as f32,
            down: self.patches.down(row, squared_sine, direction.y),
        }
    }

    fn radiance_at(&self, point: &MapPoint) -> Vec3 {
        self.scaled(interpolated(self.corners(point.column, point.row), point.across, point.down))
    }

    /// Radiance at the corners of a patch, at intensity 1.
    fn corners(&self, column: u32, row: u32) -> Corners<Vec3> {
        self.corner_pixels(column, row).map(|pixel| Vec3::from(self.map.pixels[pixel]))
    }

    /// Scaled importance at the corners of a patch.
    #[inline]
    fn importances(&self, column: u32, row: u32) -> Corners<f32> {
        self.corner_pixels(column, row).map(|pixel| self.importances[pixel])
    }

    /// Has the importance at the corners of a few patches of a row fetched.
    fn prefetch_importances(&self, row: u32, columns: Range<u32>) {
        let [left_above, _, left_below, _] = self.corner_pixels(columns.start, row);
        let [_, right_above, _, right_below] = self.corner_pixels(columns.end - 1, row);
        for corner in [left_above, right_above, left_below, right_below] {
            prefetch(&self.importances[corner]);
        }
    }

    /// Indices of the pixels at the corners of a patch: wrapped in u, clamped in v.
    fn corner_pixels(&self, column: u32, row: u32) -> Corners<usize> {
        let (width, height) = (self.map.width, self.map.height);
        let left = if column == 0 { width - 1 } else { column - 1 };
        let (above, below) = (row.saturating_sub(1), row.min(height - 1));
        let at = |x: u32, y: u32| y as usize * width as usize + x as usize;
        [at(left, above), at(column, above), at(left, below), at(column, below)]
    }

    fn scaled(&self, radiance: Vec3) -> Vec3 {
        (radiance * self.intensity).min(Vec3::MAX)
    }
}

fn interpolated([a, b, c, d]: Corners<Vec3>, across: f32, down: f32) -> Vec3 {
    let upper = a + across * (b - a);
    let lower = c + across * (d - c);
    upper + down * (lower - upper)
}

/// A power of two that brings the largest component of a map's pixels to about 1, as far as neither it
/// nor its products with the weights of colours leave the normal range.
fn importance_scale(largest: f32) -> f32 {
    let exponent = (largest.max(f32::MIN_POSITIVE).to_bits() >> 23) as i32 - 127;
    2.0_f32.powi(-exponent.clamp(-100, 100))
}

/// Gives 32-bit fractions the bits that choosing among 2^32, and a place in what was chosen, take:
/// 32 more, hashed from both, below the last one. Order, hence stratification, stays.
pub(crate) fn refine([x, y]: [u32; 2]) -> [u64; 2] {
    let fine_x = hash(hash(x) ^ y);
    let fine_y = hash(fine_x ^ x);
    [(x, fine_x), (y, fine_y)].map(|(coarse, fine)| u64::from(coarse) << 32 | u64::from(fine))
}
