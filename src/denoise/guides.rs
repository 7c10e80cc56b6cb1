//! What tells surfaces apart in a picture, and how much two of its pixels belong together.

use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;

use super::samples::Samples;

/// Albedo that counts as none: black surfaces are smoothed as they are.
pub(crate) const MIN_ALBEDO: f32 = 0.02;
/// Squared difference of albedos at which pixels have nothing in common. Light is compared without albedo, so this
/// is loose: patterns do not stop the filter, black beside white does.
pub(crate) const ALBEDO_TOLERANCE: f32 = 0.5;
/// Squared difference of normals at which pixels have nothing in common, without noise.
pub(crate) const NORMAL_TOLERANCE: f32 = 0.06;
/// Variances of both normals that are tolerated as well.
pub(crate) const NORMAL_VARIANCES: f32 = 2.0;
/// Squared difference of coverages at which pixels have nothing in common, without chance: what is behind all surfaces
/// may be a thousand times as bright.
pub(crate) const COVERAGE_TOLERANCE: f32 = 1e-6;
/// Variances of both coverages that are tolerated as well.
pub(crate) const CHANCES: f32 = 4.0;
/// Relative difference of depths at which pixels have nothing in common, on what faces the camera.
pub(crate) const DEPTH_TOLERANCE: f32 = 0.007;
/// Share by which that grows with every pixel of distance.
pub(crate) const DEPTH_GROWTH: f32 = 0.25;
/// Nearness that counts as none: a sky's.
pub(crate) const MIN_NEARNESS: f32 = 1e-9;
/// How much of the difference that the slope explains is tolerated.
pub(crate) const SLOPE_TOLERANCE: f32 = 0.8;

/// What a pixel's samples met first, as means over them. Those that met nothing count as black normals and albedos of
/// 1, so that in a pixel that shows some of each of two surfaces all is between theirs, in proportion.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Guide {
    pub(super) albedo: Vec3,
    pub(super) normal: Vec3,
    /// Variance of that normal by what is met.
    doubt: f32,
    /// Share of the samples that met a surface, and its variance.
    pub(super) coverage: f32,
    chance: f32,
    /// One over the depth: on a plane it is nearly linear over the picture.
    pub(super) nearness: f32,
}

/// A picture's guides, each quantity by itself, so that whole rows are compared at once.
pub(super) struct Guides {
    pub(super) width: usize,
    pub(super) height: usize,
    albedo: [Vec<f32>; 3],
    normal: [Vec<f32>; 3],
    doubt: Vec<f32>,
    coverage: Vec<f32>,
    /// Variance of the coverage where it is chance, as in fog: that is in all pixels around, an edge in some.
    chance: Vec<f32>,
    nearness: Vec<f32>,
    /// How much the nearness changes from pixel to pixel on the surface itself.
    slope: Vec<f32>,
}

impl Guide {
    pub(super) fn of(samples: &Samples<'_>, index: usize) -> Self {
        let [r, g, b, depth, x, y, z, hits] = samples.first_hits(index);
        let samples = samples.count(index).max(1) as f32;
        let coverage = hits / samples;
        let albedo = Vec3::new(r, g, b) / samples + (1.0 - coverage);
        let normal = Vec3::new(x, y, z) / samples;
        let spread =
            (coverage - normal.length_squared() / coverage.max(f32::MIN_POSITIVE)).max(0.0);
        let others = (samples - 1.0).max(1.0);
        Self {
            albedo: albedo.max(Vec3::splat(MIN_ALBEDO)),
            normal,
            doubt: spread / others,
            coverage,
            chance: coverage * (1.0 - coverage) / others,
            nearness: if depth > 0.0 { coverage * hits / depth } else { 0.0 },
        }
    }
}

impl Guides {
    /// Those of films that have layers.
    pub(super) fn of(samples: &Samples<'_>) -> Self {
        let [width, height] = [samples.film.width, samples.film.height].map(|side| side as usize);
        let of = |index| Guide::of(samples, index);
        let guides: Vec<Guide> = (0..width * height).into_par_iter().map(of).collect();
        let doubt = |index: usize| {
            let is_single = samples.count(index) < 2;
            if is_single { spread_around(&guides, index, width) } else { guides[index].doubt }
        };
        let chance = |index: usize| {
            let around = around(index, [width, height], 1).map(|(other, _)| guides[other].chance);
            around.fold(f32::INFINITY, f32::min)
        };
        let values = |index: usize| {
            let Guide { albedo, normal, coverage, nearness, .. } = guides[index];
            let ([r, g, b], [x, y, z]) = (albedo.to_array(), normal.to_array());
            let (doubt, chance, slope) =
                (doubt(index), chance(index), slope(&guides, index, width));
            [r, g, b, x, y, z, doubt, coverage, chance, nearness, slope]
        };
        let mut planes: [Vec<f32>; 11] = std::array::from_fn(|_| vec![0.0; width * height]);
        // Row by row, so that what is read once fills all of them.
        rows(planes.each_mut(), width).into_par_iter().enumerate().for_each(|(y, mut row)| {
            for x in 0..width {
                for (plane, value) in row.iter_mut().zip(values(y * width + x)) {
                    plane[x] = value;
                }
            }
        });
        let [r, g, b, x, y, z, doubt, coverage, chance, nearness, slope] = planes;
        let (albedo, normal) = ([r, g, b], [x, y, z]);
        Self { width, height, albedo, normal, doubt, coverage, chance, nearness, slope }
    }

    /// That of a pixel.
    pub(super) fn at(&self, index: usize) -> Guide {
        Guide {
            albedo: Vec3::from(self.albedo.each_ref().map(|plane| plane[index])),
            normal: Vec3::from(self.normal.each_ref().map(|plane| plane[index])),
            doubt: self.doubt[index],
            coverage: self.coverage[index],
            chance: self.chance[index],
            nearness: self.nearness[index],
        }
    }

    /// The columns of a row that have a pixel `offset` columns and rows away, and the index of the first such
    /// pixel; `None` if there are none.
    pub(super) fn columns(&self, y: usize, offset: [isize; 2]) -> Option<(Range<usize>, usize)> {
        let [dx, dy] = offset;
        let row = y.checked_add_signed(dy).filter(|row| *row < self.height)?;
        let columns = (-dx).max(0) as usize..self.width.checked_sub(dx.max(0) as usize)?;
        let first = row * self.width + columns.start.wrapping_add_signed(dx);
        (!columns.is_empty()).then_some((columns, first))
    }

    /// How much pixels of a row belong to the surfaces of those `offset` columns and rows away, from 1 to 0: as many as
    /// `likeness` holds, from index `here` and, of the others, `there` on.
    #[inline(always)]
    pub(super) fn compare(
        &self,
        [here, there]: [usize; 2],
        offset: [isize; 2],
        likeness: &mut [f32],
    ) {
        let count = likeness.len();
        let [dx, dy] = offset.map(|d| d.unsigned_abs() as f32);
        let growth = DEPTH_TOLERANCE * (1.0 + DEPTH_GROWTH * (dx + dy));
        let slopes = SLOPE_TOLERANCE * (1.0 + dx.max(dy));
        let at = ([here, there], count);
        let albedo = self.albedo.each_ref().map(|plane| pairs(plane, at));
        let normal = self.normal.each_ref().map(|plane| pairs(plane, at));
        let rest = [&self.doubt, &self.coverage, &self.chance, &self.nearness, &self.slope];
        let [doubt, coverage, chance, nearness, slope] = rest.map(|plane| pairs(plane, at));
        for (i, likeness) in likeness.iter_mut().enumerate() {
            let doubts = NORMAL_VARIANCES * (doubt.0[i] + doubt.1[i]);
            let covered = coverage.0[i] - coverage.1[i];
            let chances = CHANCES * (chance.0[i] + chance.1[i]);
            let depth = (nearness.0[i] - nearness.1[i])
                / (growth * nearness.0[i].max(nearness.1[i])
                    + slopes * slope.0[i].max(slope.1[i])
                    + MIN_NEARNESS);
            *likeness = falling(squared(&albedo, i) * (1.0 / ALBEDO_TOLERANCE))
                * falling(squared(&normal, i) / (NORMAL_TOLERANCE + doubts))
                * falling(covered * covered / (COVERAGE_TOLERANCE + chances))
                * falling(depth * depth);
        }
    }
}

/// Squared distance of two pixels' vectors. Written out: a map over three is at times not in-lined, and the row then four
/// times as slow.
#[inline(always)]
fn squared([x, y, z]: &[(&[f32], &[f32]); 3], at: usize) -> f32 {
    let [x, y, z] = [x.0[at] - x.1[at], y.0[at] - y.1[at], z.0[at] - z.1[at]];
    x * x + y * y + z * z
}

/// Tukey's biweight, 1 at 0 and 0 from 1 on: what is too far off does not count at all, and no exponential is taken.
#[inline(always)]
pub(super) fn falling(squared: f32) -> f32 {
    let rest = (1.0 - squared).max(0.0);
    rest * rest
}

/// The rows of planes, all planes' together.
pub(super) fn rows<const N: usize>(
    planes: [&mut Vec<f32>; N],
    width: usize,
) -> Vec<[&mut [f32]; N]> {
    let height = planes[0].len() / width;
    let mut rows = planes.map(|plane| plane.chunks_exact_mut(width));
    let next = |_| rows.each_mut().map(|rows| rows.next().expect("planes are alike"));
    (0..height).map(next).collect()
}

/// So many values of a plane from both places on.
#[inline(always)]
pub(super) fn pairs(
    plane: &[f32],
    ([here, there], count): ([usize; 2], usize),
) -> (&[f32], &[f32]) {
    (&plane[here..here + count], &plane[there..there + count])
}

/// How far normals around a pixel differ: what is known of one sample's.
fn spread_around(guides: &[Guide], index: usize, width: usize) -> f32 {
    let (mut sum, mut count) = (Vec3::ZERO, 0.0);
    for (other, _) in around(index, [width, guides.len() / width], 1) {
        let normal = guides[other].normal;
        if normal != Vec3::ZERO {
            (sum, count) = (sum + normal, count + 1.0);
        }
    }
    if count > 0.0 { (1.0 - (sum / count).length_squared()).max(0.0) } else { 0.0 }
}

/// Change of the nearness to the next column and row, the smaller one of both sides; none where it is nearest or
/// farthest.
fn slope(guides: &[Guide], index: usize, width: usize) -> f32 {
    let (x, y, height) = (index % width, index / width, guides.len() / width);
    let along = |at: usize, count: usize, stride: usize| {
        let own = guides[index].nearness;
        let before = if at > 0 { own - guides[index - stride].nearness } else { 0.0 };
        let after = if at + 1 < count { guides[index + stride].nearness - own } else { 0.0 };
        if before * after > 0.0 { before.abs().min(after.abs()) } else { 0.0 }
    };
    along(x, width, 1) + along(y, height, width)
}

/// The pixels up to `reach` columns and rows from one, itself among them, and how far they are.
pub(super) fn around(
    index: usize,
    [width, height]: [usize; 2],
    reach: usize,
) -> impl Iterator<Item = (usize, [usize; 2])> {
    let (x, y) = (index % width, index / width);
    let columns = x.saturating_sub(reach)..(x + reach + 1).min(width);
    let rows = y.saturating_sub(reach)..(y + reach + 1).min(height);
    rows.flat_map(move |row| {
        let at = move |column: usize| (row * width + column, [column.abs_diff(x), row.abs_diff(y)]);
        columns.clone().map(at)
    })
}
