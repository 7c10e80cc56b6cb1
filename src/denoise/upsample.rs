//! A small picture in the surfaces of a large one, whatever light fell on those: joint bilateral upsampling (Kopf et al.,
//! 2007) of light without albedo.

use glam::{U16Vec3, Vec3, Vec4};
use rayon::prelude::*;

use super::guides::{ALBEDO_TOLERANCE, Guide, around};
use super::samples::Samples;
use crate::image::Image;
use crate::render::film::Film;

/// Squared difference of normals at which pixels of both sizes have nothing in common. A small picture has one normal
/// for what is curved over several pixels.
const NORMAL_TOLERANCE: f32 = 0.5;
/// The same of coverages.
const COVERAGE_TOLERANCE: f32 = 0.5;
/// Relative difference of depths at which they have nothing in common.
const DEPTH_TOLERANCE: f32 = 0.2;
/// How far from a place at most pixels of the small picture are looked for until some are alike.
const MAX_REACH: isize = 3;
/// Weight of those that are alike that is enough.
const MIN_LIKENESS: f32 = 0.1;
/// Difference of albedos that does not tell an edited material.
const ALBEDO_ERROR: f32 = 0.02;
/// No light.
const TINY: f32 = 1e-30;

/// Albedo, coverage, normal and nearness of every pixel of a picture.
pub(crate) struct FineGuides {
    pub(super) width: u32,
    height: u32,
    /// Pixels from edge to edge of the view: the last ones may lie beyond it in part.
    extent: [f32; 2],
    pixels: Vec<Packed>,
}

/// A pixel's guide.
#[derive(Clone, Copy)]
struct Packed {
    albedo: [u16; 3],
    coverage: u16,
    normal: [i8; 3],
    nearness: f32,
}

impl Packed {
    fn new(guide: &Guide) -> Self {
        let share = |value: f32| (value * f32::from(u16::MAX)).round() as u16;
        Self {
            albedo: guide.albedo.to_array().map(share),
            coverage: share(guide.coverage),
            normal: guide.normal.to_array().map(|value| (value * f32::from(i8::MAX)) as i8),
            nearness: guide.nearness,
        }
    }
}

/// Four neighbours in a small picture: a pixel, that in the next column, and both in the next row.
struct Quad {
    albedo: [Vec4; 3],
    coverage: Vec4,
    normal: [Vec4; 3],
    nearness: Vec4,
    /// Without albedo.
    light: [Vec4; 3],
    /// 1 where the large picture has no such albedo near by: the material is another one since.
    edited: Vec4,
}

impl Quad {
    fn new(guides: [&Guide; 4], colors: [[f32; 3]; 4], edited: [bool; 4]) -> Self {
        let each = |of: &dyn Fn(usize) -> f32| Vec4::from(std::array::from_fn(of));
        Self {
            albedo: [0, 1, 2].map(|i| each(&|at| guides[at].albedo[i])),
            coverage: each(&|at| guides[at].coverage),
            normal: [0, 1, 2].map(|i| each(&|at| guides[at].normal[i])),
            nearness: each(&|at| guides[at].nearness),
            light: [0, 1, 2].map(|i| each(&|at| colors[at][i] / guides[at].albedo[i])),
            edited: each(&|at| f32::from(u8::from(edited[at]))),
        }
    }

    /// How much its pixels belong to the surface of one of the large picture, from 1 to 0.
    #[inline(always)]
    fn likeness(&self, albedo: [f32; 3], pixel: &Packed) -> Vec4 {
        let falling = |squared: Vec4| {
            let rest = (Vec4::ONE - squared).max(Vec4::ZERO);
            rest * rest
        };
        let distance = |own: [f32; 3], others: &[Vec4; 3]| {
            let [x, y, z] = [0, 1, 2].map(|i| Vec4::splat(own[i]) - others[i]);
            x * x + y * y + z * z
        };
        let normal = pixel.normal.map(|value| f32::from(value) / f32::from(i8::MAX));
        let covered = Vec4::splat(f32::from(pixel.coverage) / f32::from(u16::MAX)) - self.coverage;
        let own = Vec4::splat(pixel.nearness);
        let nearest = own.max(self.nearness).max(Vec4::splat(TINY));
        let depth = (own - self.nearness) / (nearest * DEPTH_TOLERANCE);
        let compared = (Vec4::ONE - self.edited) * (1.0 / ALBEDO_TOLERANCE);
        falling(distance(albedo, &self.albedo) * compared)
            * falling(distance(normal, &self.normal) * (1.0 / NORMAL_TOLERANCE))
            * falling(covered * covered * (1.0 / COVERAGE_TOLERANCE))
            * falling(depth * depth)
    }

    /// What a pixel of this albedo shows in the light of each, weighted, and the weights.
    #[inline(always)]
    fn shown(&self, albedo: [f32; 3], weights: Vec4) -> Vec4 {
        let [r, g, b] = [0, 1, 2].map(|i| {
            let fine = Vec4::splat(albedo[i]);
            (self.light[i] * (fine + self.edited * (self.albedo[i] - fine))).dot(weights)
        });
        Vec4::new(r, g, b, weights.dot(Vec4::ONE))
    }
}

impl FineGuides {
    /// Of a film and, if there is one, another of the same view and size; `None` without layers, or where pixels have no
    /// samples. Of a film of more than `max_pixels` they are smaller.
    pub(crate) fn of(film: &Film, other: Option<&Film>, max_pixels: u32) -> Option<Self> {
        if !film.has_layers() || film.min_samples() == 0 {
            return None;
        }
        let pixels = film.pixels().len();
        let shrink = (pixels as f64 / f64::from(max_pixels)).sqrt().ceil() as u32;
        let extent = [film.width, film.height].map(|side| side as f32 / shrink as f32);
        let smaller = |film: &Film| film.in_larger_pixels(shrink);
        if shrink > 1 {
            let small = Self::of(&smaller(film), other.map(smaller).as_ref(), u32::MAX);
            return small.map(|small| Self { extent, ..small });
        }
        let samples = Samples::of(film, other.map(|film| (film, 1.0)));
        let packed = |index| Packed::new(&Guide::of(&samples, index));
        let pixels = (0..pixels).into_par_iter().map(packed).collect();
        Some(Self { width: film.width, height: film.height, extent, pixels })
    }

    /// A picture of the same view with fewer pixels, `extent` from edge to edge, in the size of these surfaces, with their
    /// outlines and patterns. `samples` are those that it is made of.
    pub(super) fn upsampled(
        &self,
        samples: &Samples<'_>,
        small: &Image,
        extent: [f32; 2],
    ) -> Image {
        let size = [small.width, small.height].map(|side| side as usize);
        let guide = |index| Guide::of(samples, index);
        let guides: Vec<Guide> = (0..small.pixels.len()).into_par_iter().map(guide).collect();
        let edited = self.edited(&guides, size, extent);
        let quad = |index: usize| {
            let [x, y] = [index % size[0], index / size[0]];
            let [right, below] = [(x + 1).min(size[0] - 1), (y + 1).min(size[1] - 1)];
            let at = |column: usize, row: usize| row * size[0] + column;
            let four = [at(x, y), at(right, y), at(x, below), at(right, below)];
            let colors = four.map(|at| small.pixels[at]);
            Quad::new(four.map(|at| &guides[at]), colors, four.map(|at| edited[at]))
        };
        let quads: Vec<Quad> = (0..guides.len()).into_par_iter().map(quad).collect();
        // The quad around a place along an axis, and how far beyond its first pixel that is.
        let place = |axis: usize, at: usize| {
            let scale = extent[axis] / self.extent[axis];
            let place = ((at as f32 + 0.5) * scale - 0.5).clamp(0.0, (size[axis] - 1) as f32);
            (place as usize, place.fract())
        };
        let columns: Vec<(usize, f32)> = (0..self.width as usize).map(|x| place(0, x)).collect();
        let color = |pixel: &Packed, (row, down): (usize, f32), (column, across): (usize, f32)| {
            let albedo = pixel.albedo.map(|value| f32::from(value) / f32::from(u16::MAX));
            let mut shown = Vec4::ZERO;
            for reach in 1..=MAX_REACH {
                // Weights fall to 0 at the distance `reach`, within which there are as many quads along each axis.
                let weights = |part: f32, offset: isize| {
                    let distance = [part - offset as f32, part - offset as f32 - 1.0];
                    distance.map(|distance| (1.0 - distance.abs() / reach as f32).max(0.0))
                };
                for dy in (1 - reach..reach).step_by(2) {
                    let Some(row) = row.checked_add_signed(dy).filter(|row| *row < size[1]) else {
                        continue;
                    };
                    let [upper, lower] = weights(down, dy);
                    for dx in (1 - reach..reach).step_by(2) {
                        let column = column.checked_add_signed(dx).filter(|it| *it < size[0]);
                        let Some(column) = column else { continue };
                        let [left, right] = weights(across, dx);
                        let weights = Vec4::new(left, right, left, right)
                            * Vec4::new(upper, upper, lower, lower);
                        let quad = &quads[row * size[0] + column];
                        shown += quad.shown(albedo, weights * quad.likeness(albedo, pixel));
                    }
                }
                if shown.w >= MIN_LIKENESS {
                    break;
                }
            }
            let is_alike = shown.w >= MIN_LIKENESS;
            if !is_alike {
                // The harmonic mean: what is a thousand times as bright does not shine through.
                let quad = &quads[row * size[0] + column];
                let [r, g, b] = quad.light;
                let weights = Vec4::new(1.0 - across, across, 1.0 - across, across)
                    * Vec4::new(1.0 - down, 1.0 - down, down, down);
                shown = quad.shown(albedo, weights / (r + g + b).max(Vec4::splat(TINY)));
            }
            (shown.truncate() / shown.w.max(TINY), is_alike)
        };
        let width = self.width as usize;
        let rows: Vec<(usize, f32)> = (0..self.height as usize).map(|y| place(1, y)).collect();
        let colors: Vec<(Vec3, bool)> = (self.pixels.par_iter().enumerate())
            .map(|(index, pixel)| color(pixel, rows[index / width], columns[index % width]))
            .collect();
        // A pixel on an edge is like neither side: it shows something of both.
        let smooth = |index: usize| {
            let (own, is_alike) = colors[index];
            if is_alike {
                return own.to_array();
            }
            let near = around(index, [width, rows.len()], 1).map(|(other, _)| colors[other]);
            let (sum, count) = near
                .filter(|(_, is_alike)| *is_alike)
                .fold((Vec3::ZERO, 0), |(sum, count), (color, _)| (sum + color, count + 1));
            (if count > 0 { sum / count as f32 } else { own }).to_array()
        };
        let pixels = (0..colors.len()).into_par_iter().map(smooth).collect();
        Image { width: self.width, height: self.height, pixels }
    }

    /// Which pixels of a small picture have an albedo that none of these surfaces has near by.
    fn edited(&self, guides: &[Guide], [width, height]: [usize; 2], extent: [f32; 2]) -> Vec<bool> {
        let columns = self.width as usize;
        let fine = |axis: usize, at: usize, all: u32| {
            let place = (at as f32 * self.extent[axis] / extent[axis]) as usize;
            place.min(all as usize)
        };
        let range = |index: usize| {
            let [x, y] = [index % width, index / width];
            let (mut least, mut most) = (U16Vec3::MAX, U16Vec3::ZERO);
            for row in fine(1, y, self.height)..fine(1, y + 1, self.height) {
                let row = &self.pixels[row * columns..][..columns];
                for pixel in &row[fine(0, x, self.width)..fine(0, x + 1, self.width)] {
                    let albedo = U16Vec3::from(pixel.albedo);
                    (least, most) = (least.min(albedo), most.max(albedo));
                }
            }
            (least, most)
        };
        let ranges: Vec<_> = (0..guides.len()).into_par_iter().map(range).collect();
        // Samples of a pixel lie in those beside it, too.
        let is_edited = |index: usize| {
            let albedo = guides[index].albedo * f32::from(u16::MAX);
            let near = around(index, [width, height], 1).map(|(other, _)| ranges[other]);
            let join = |(a, b): (U16Vec3, U16Vec3), (c, d)| (a.min(c), b.max(d));
            let (least, most) = near.fold((U16Vec3::MAX, U16Vec3::ZERO), join);
            let tolerance = ALBEDO_ERROR * f32::from(u16::MAX);
            let is_above = albedo.cmpge(least.as_vec3() - tolerance);
            !(is_above & albedo.cmple(most.as_vec3() + tolerance)).all()
        };
        (0..guides.len()).into_par_iter().map(is_edited).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::{FirstHit, PathResult};

    const SIZE: [u32; 2] = [64, 48];

    /// A striped wall, which light falls on that changes slowly, beside one that faces elsewhere and is eight times as
    /// bright, and a map a thousand times as bright above both; in pixels `every` times as wide.
    fn film(every: u32, stripes: [f32; 2]) -> Film {
        let mut film = Film::new(SIZE[0] / every, SIZE[1] / every, true);
        for y in 0..SIZE[1] {
            for x in 0..SIZE[0] {
                let albedo = Vec3::splat(stripes[x as usize / 2 % 2]);
                let is_left = x < 29;
                let normal = if is_left { Vec3::Z } else { Vec3::X };
                let light = (1.0 + x as f32 / 64.0) * if is_left { 1.0 } else { 8.0 };
                let hit = Some(FirstHit { albedo, normal, depth: 2.0 });
                let (first_hit, radiance) = match y < 11 {
                    true => (None, Vec3::splat(1000.0)),
                    false => (hit, albedo * light),
                };
                let path = PathResult { radiance, first_hit, ..PathResult::default() };
                film.add(x / every, y / every, &path);
            }
        }
        film
    }

    #[test]
    fn a_small_picture_has_the_outlines_and_patterns_of_a_large_one() {
        let fine = FineGuides::of(&film(1, [0.2, 0.8]), None, 1 << 20).expect("it has layers");
        // The same wall, and another one in its place.
        for (stripes, limits) in [([0.2, 0.8], [0.02, 0.02]), ([0.9; 2], [0.04, 0.1])] {
            let (truth, small) = (film(1, stripes).image(), film(4, stripes));
            let extent = [small.width, small.height].map(|side| side as f32);
            let image = small.image();
            let upsampled = fine.upsampled(&Samples::of(&small, None), &image, extent);
            assert_eq!([upsampled.width, upsampled.height], SIZE);
            let error = |image: &Image| {
                let apart = |(a, b): (&[f32; 3], &[f32; 3])| ((a[0] - b[0]) / b[0]).abs();
                let apart = image.pixels.iter().zip(&truth.pixels).map(apart);
                let mut apart: Vec<f32> = apart.collect();
                apart.sort_by(f32::total_cmp);
                [apart.iter().sum::<f32>() / apart.len() as f32, apart[apart.len() * 9 / 10]]
            };
            let [plain, found] = [error(&image.enlarged(4, SIZE)), error(&upsampled)];
            eprintln!("{stripes:?}: {found:?}, enlarged {plain:?}");
            assert!(plain[0] > 1.0, "as it is: {plain:?}");
            assert!(found[0] < limits[0] && found[1] < limits[1], "{stripes:?}: {found:?}");
        }
    }

    #[test]
    fn surfaces_of_large_films_are_smaller_and_in_the_same_places() {
        let mut film = Film::new(1500, 1001, true);
        for (y, x) in (0..1001).flat_map(|y| (0..1500).map(move |x| (y, x))) {
            let albedo = Vec3::splat(if x < 900 { 0.25 } else { 0.5 });
            let first_hit = Some(FirstHit { albedo, normal: Vec3::Z, depth: 1.0 });
            film.add(x, y, &PathResult { radiance: albedo, first_hit, ..PathResult::default() });
        }
        let fine = FineGuides::of(&film, None, 1 << 20).expect("it has layers");
        assert_eq!(([fine.width, fine.height], fine.extent), ([750, 501], [750.0, 500.5]));
        let larger = film.in_larger_pixels(8);
        let extent = [1500.0 / 8.0, 1001.0 / 8.0];
        let image = fine.upsampled(&Samples::of(&larger, None), &larger.image(), extent);
        let is_right =
            |x: u32| (image.at(x, 250)[0] - if x < 450 { 0.25 } else { 0.5 }).abs() < 0.01;
        assert!([0, 448, 449, 450, 451, 749].into_iter().all(is_right));
        assert!(FineGuides::of(&Film::new(4, 4, true), None, 16).is_none(), "without samples");
    }
}
