//! What a cell of a film that has only begun knows: sums over its samples, whether they agree, and on which
//! surface they lie.

use glam::Vec3;

use crate::color::luminance;
use crate::render::film::{Pixel, Surface};

/// Albedo below which surfaces count as this bright: what they mirror, divided by theirs, would shine on
/// what is beside them.
const MIN_ALBEDO: f32 = 0.1;
/// Relative difference of depths at which two neighbouring pixels are half alike.
const DEPTH_TOLERANCE: f32 = 0.02;
/// Squared means over their variance from which, and up to which, a cell is more and more believed that it is
/// brighter than all around. One bright sample among any number of dark ones has 1.
const BELIEVED: [f32; 2] = [3.0, 20.0];
/// Neighbours that are no more alike than this say nothing of each other's spread.
const ALIKE: f32 = 0.3;

/// Sums over the samples of a cell.
#[derive(Clone, Copy, Default)]
pub(super) struct Cell {
    /// Radiance over albedo.
    pub(super) light: Vec3,
    pub(super) samples: f32,
    /// Squared deviations of its luminance among like samples, and how many say so.
    pub(super) deviation: f32,
    pub(super) freedom: f32,
    pub(super) albedo: Vec3,
    pub(super) normal: Vec3,
    pub(super) depth: f32,
    pub(super) hits: f32,
    /// Variance within pixels of whether a sample meets a surface, times the samples.
    pub(super) chance: f32,
}

/// What tells surfaces apart.
#[derive(Clone, Copy, Default)]
pub(super) struct Guide {
    pub(super) normal: Vec3,
    pub(super) depth: f32,
    /// Share of the samples that met a surface; negative without samples.
    pub(super) coverage: f32,
}

impl Cell {
    /// What a pixel knows; of light above the luminance `most` what its samples do not agree on is left out.
    pub(super) fn new(pixel: &Pixel, surface: Option<&Surface>, most: f32) -> Self {
        let samples = pixel.samples() as f32;
        if samples == 0.0 {
            return Self::default();
        }
        let [r, g, b, squared] = pixel.sums();
        let sums = surface.map_or([0.0; 8], Surface::sums).map(|sum| sum as f32);
        let [ar, ag, ab, depth, nx, ny, nz, hits] = sums;
        // What does not come from a surface, from the sky or from fog, is as it is.
        let as_it_is = Vec3::splat(samples - hits);
        let albedo = ((Vec3::new(ar, ag, ab) + as_it_is) / samples).max(Vec3::splat(MIN_ALBEDO));
        let mean = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        let deviation = (squared - mean * mean / f64::from(samples)).max(0.0) as f32;
        let whole = Self {
            light: Vec3::new(r as f32, g as f32, b as f32),
            samples,
            deviation,
            freedom: samples - 1.0,
            ..Self::default()
        };
        // Of the sky, and of an edge before it, one sample is as good as many.
        let sees_sky = surface.is_some() && hits < samples;
        let believed = if sees_sky { 1.0 } else { whole.believed(most) };
        Self {
            light: whole.light * believed / albedo,
            deviation: deviation * (believed / luminance(albedo)).powi(2),
            albedo: albedo * samples,
            normal: Vec3::new(nx, ny, nz),
            depth,
            hits,
            chance: hits * (samples - hits) / (samples - 1.0).max(1.0),
            ..whole
        }
    }

    fn add(&mut self, other: &Self, times: f32) {
        self.add_worth(other, times, 1.0);
    }

    /// Adds `times` the samples of another cell, each as `worth` samples that deviate accordingly: they
    /// say no more of how much.
    pub(super) fn add_worth(&mut self, other: &Self, times: f32, worth: f32) {
        self.freedom += other.freedom * times;
        let times = times * worth;
        self.deviation += other.deviation * times;
        self.light += other.light * times;
        self.samples += other.samples * times;
        self.albedo += other.albedo * times;
        self.normal += other.normal * times;
        self.depth += other.depth * times;
        self.hits += other.hits * times;
        self.chance += other.chance * times;
    }

    /// Takes note how far apart the means of two pictures are, of which so many samples are to be added: one
    /// may have met what the other has not. Where neither knows of its spread, their neighbours know better.
    pub(super) fn doubt(&mut self, other: &Self, times: f32) {
        let theirs = other.samples * times;
        let knows = self.freedom + other.freedom >= 1.0;
        if knows && self.samples > 0.0 && theirs > 0.0 {
            let means = [self, other].map(|cell| luminance(cell.light) / cell.samples);
            let weight = self.samples * theirs / (self.samples + theirs);
            self.deviation += (means[0] - means[1]).powi(2) * weight;
            self.freedom += 1.0;
        }
    }

    /// By what light is multiplied again, and the share of the samples that met a surface. Where fog
    /// decides that by chance, it is drawn to what is around.
    pub(super) fn dress(&self, around: f32, chance: f32) -> (Vec3, f32) {
        let own = self.hits / self.samples;
        // Up to two standard errors are chance.
        let (detail, noise) = ((own - around).powi(2), 4.0 * chance / self.samples);
        let share = if detail > noise { 1.0 - noise / detail } else { 0.0 };
        let coverage = around + (own - around) * share;
        // Of what was met: the rest has an albedo of 1.
        let mixed = self.albedo / self.samples;
        let of_surface = (mixed - (1.0 - own)) / own.max(f32::MIN_POSITIVE);
        let albedo = if own > 0.0 { of_surface * coverage + (1.0 - coverage) } else { Vec3::ONE };
        (albedo.max(Vec3::splat(MIN_ALBEDO)), coverage)
    }

    fn is_sky(&self) -> bool {
        self.hits < 0.99 * self.samples
    }

    /// Four cells as one. What is behind all surfaces may be a thousand times as bright: the larger
    /// part speaks for both, surfaces where they are as many. Cells count, not samples: of those some
    /// have one more for as long as a pass lasts, and edges would flicker.
    pub(super) fn together(four: [Option<&Self>; 4]) -> Self {
        let four = four.map(|cell| cell.filter(|cell| cell.samples > 0.0));
        let sky = four.iter().flatten().filter(|cell| cell.is_sky()).count();
        let is_sky = 2 * sky > four.iter().flatten().count();
        let mut sum = Self::default();
        let mut alike: Option<(Guide, Self, f32, f32)> = None;
        for cell in four.into_iter().flatten().filter(|cell| cell.is_sky() == is_sky) {
            sum.add(cell, 1.0);
            let (first, like, squares, count) =
                alike.get_or_insert((cell.guide(), Self::default(), 0.0, 0.0));
            if first.likeness(&cell.guide(), 2.0) > ALIKE {
                like.add(cell, 1.0);
                *squares += luminance(cell.light).powi(2) / cell.samples;
                *count += 1.0;
            }
        }
        // Single samples say something of each other only.
        if let Some((_, like, squares, count)) = alike.filter(|_| sum.freedom < 1.0) {
            sum.deviation += (squares - luminance(like.light).powi(2) / like.samples).max(0.0);
            sum.freedom += count - 1.0;
        }
        sum
    }

    /// What share of its light a cell has for itself where it should have `most`; of more only what its
    /// samples agree on.
    pub(super) fn believed(&self, most: f32) -> f32 {
        let mean = luminance(self.light) / self.samples;
        if mean <= most {
            return 1.0;
        }
        let squares = self.deviation / (self.freedom * self.samples);
        let certainty = if self.freedom >= 1.0 { mean * mean / squares.max(1e-30) } else { 0.0 };
        let [from, to] = BELIEVED;
        let share = ((certainty - from) / (to - from)).clamp(0.0, 1.0);
        (most + (mean - most) * share) / mean
    }

    pub(super) fn guide(&self) -> Guide {
        Guide {
            normal: self.normal.normalize_or_zero(),
            depth: if self.hits > 0.0 { self.depth / self.hits } else { 0.0 },
            coverage: if self.samples > 0.0 { self.hits / self.samples } else { -1.0 },
        }
    }
}

impl Guide {
    /// How much two cells of so many pixels belong to one surface, 1 for the same.
    pub(super) fn likeness(&self, other: &Self, pixels: f32) -> f32 {
        if self.coverage < 0.0 || other.coverage < 0.0 {
            return 1.0;
        }
        let coverage = 1.0 - (self.coverage - other.coverage).abs();
        if self.normal == Vec3::ZERO || other.normal == Vec3::ZERO {
            return coverage;
        }
        let normal = self.normal.dot(other.normal).max(0.0).powi(16);
        let tolerance = DEPTH_TOLERANCE * pixels.min(8.0) * self.depth.min(other.depth);
        let depth = (self.depth - other.depth) / tolerance.max(f32::MIN_POSITIVE);
        coverage * coverage * normal / (1.0 + depth * depth)
    }
}
