//! The best picture of a film that has only begun: each pixel blends what it knows itself with what
//! coarser scales know of its surroundings, by how sure each is.
//!
//! From the coarsest scale on, what a scale adds to the one above it (a level of Burt and Adelson's
//! Laplacian pyramid, 1983) is taken by Wiener's share: the energy of the detail over that energy and
//! the noise's. Pixels without samples have no detail of their own, so that any set of pixels makes a
//! picture; with many samples all detail counts, and the film is what comes out. Light is blended
//! without albedo, and between neighbours on like surfaces (Kopf et al., *Joint Bilateral Upsampling*,
//! 2007). One look at every pixel and a third more, a twentieth of the à-trous filter's time.

use glam::Vec3;
use rayon::prelude::*;

use super::cell::{Cell, Guide};
use crate::color::luminance;
use crate::image::Image;
use crate::render::film::{Film, Pixel};

/// The coarsest scale's cells are 2^7 pixels wide.
const SCALES: usize = 8;
/// What neighbours on another surface count, so that somebody always does.
const MIN_LIKENESS: f32 = 1e-3;
/// Whether chance decides what a sample meets is seen in cells 2^3 pixels wide: in smaller ones an edge does.
const MIN_CHANCE_SCALE: usize = 3;
/// The spread around a cell counts as much as so many samples of its own, at least.
const SPREAD_SAMPLES: f32 = 2.0;
/// A pixel is no brighter than so many times what is usual, five stops, unless its samples agree: the sun in
/// a mirror is white anyway, and would count for all around.
const BRIGHTEST: f32 = 32.0;

/// What is known of a cell, all scales down to its own together.
#[derive(Clone, Copy, Default)]
struct Filtered {
    light: Vec3,
    albedo: Vec3,
    /// Share of the samples that met a surface, and the variance of whether one does: in fog that is
    /// chance.
    coverage: f32,
    chance: f32,
    /// Variance of one sample's luminance.
    spread: f32,
    /// How far the cell's own mean is from what coarser scales say, and the variance of that mean.
    detail: Vec3,
    variance: f32,
}

/// One scale: cells row after row.
struct Scale<T> {
    width: usize,
    height: usize,
    cells: Vec<T>,
}

/// The film's picture, whole from the first samples on; `under` is a film of the same view, of any
/// size, whose samples count as well, each as much as so many of the film's own.
pub fn blend(film: &Film, under: Option<(&Film, f32)>) -> Image {
    let mut scales = scales(film, under);
    let mut coarser: Option<(Scale<Guide>, Scale<Filtered>)> = None;
    // What was used goes: together they are larger than the film.
    while let Some(cells) = scales.pop() {
        let guides = cells.guides();
        let estimates = refined(&cells, &guides, coarser.as_ref(), scales.len());
        coarser = Some((guides, estimates));
    }
    let finest = coarser.map_or_else(Vec::new, |(_, finest)| finest.cells);
    let pixels = finest.par_iter().map(|e| (e.light * e.albedo).to_array()).collect();
    Image { width: film.width, height: film.height, pixels }
}

/// Sums of all scales, the finest first.
fn scales(film: &Film, under: Option<(&Film, f32)>) -> Vec<Scale<Cell>> {
    let mut scales = vec![Scale::of(film)];
    let worth = under.map_or(0.0, |(_, worth)| worth);
    let mut under = under.map(|(film, _)| Scale::of(film));
    for number in 0..SCALES {
        let finest = &mut scales[number];
        let is_smallest = number + 1 == SCALES || finest.width.max(finest.height) == 1;
        // Its samples count where cells are about as large as its pixels.
        if let Some(other) = under.take_if(|u| is_smallest || 3 * finest.height < 4 * u.height) {
            finest.add(&other, worth);
        }
        if is_smallest {
            break;
        }
        let coarser = finest.halved();
        scales.push(coarser);
    }
    scales
}

impl<T> Scale<T> {
    /// The cell in column `x` of row `y`, or the nearest one.
    fn at(&self, x: isize, y: isize) -> &T {
        let x = x.clamp(0, self.width as isize - 1) as usize;
        let y = y.clamp(0, self.height as isize - 1) as usize;
        &self.cells[y * self.width + x]
    }
}

impl Scale<Cell> {
    fn of(film: &Film) -> Self {
        let surfaces = film.surfaces();
        let most = BRIGHTEST * usual_luminance(film.pixels());
        let cell = |(i, pixel)| Cell::new(pixel, surfaces.get(i), most);
        let cells = film.pixels().par_iter().enumerate().map(cell).collect();
        Self { width: film.width as usize, height: film.height as usize, cells }
    }

    fn guides(&self) -> Scale<Guide> {
        let cells = self.cells.par_iter().map(Cell::guide).collect();
        Scale { width: self.width, height: self.height, cells }
    }

    /// Cells twice as wide and high.
    fn halved(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let cell = |i: usize| {
            let (x, y) = (2 * (i % width), 2 * (i / width));
            let at = |dx, dy| {
                (x + dx < self.width).then(|| self.cells.get((y + dy) * self.width + x + dx))?
            };
            Cell::together([at(0, 0), at(1, 0), at(0, 1), at(1, 1)])
        };
        let cells = (0..width * height).into_par_iter().map(cell).collect();
        Self { width, height, cells }
    }

    /// Luminance of the second brightest cell around one, so that no lone bright sample vouches for another;
    /// `None` where too few have samples.
    fn brightness_around(&self, (x, y): (usize, usize)) -> Option<f32> {
        let (mut first, mut second, mut count) = (0.0_f32, 0.0_f32, 0);
        for v in y.saturating_sub(1)..(y + 2).min(self.height) {
            for u in x.saturating_sub(1)..(x + 2).min(self.width) {
                let cell = &self.cells[v * self.width + u];
                if (u, v) != (x, y) && cell.samples > 0.0 {
                    let own = luminance(cell.light) / cell.samples;
                    (first, second) = (first.max(own), second.max(own.min(first)));
                    count += 1;
                }
            }
        }
        (count > 2).then_some(second)
    }

    /// Adds the samples of another picture. The field of view is vertical: pictures of different
    /// shapes share their middle.
    fn add(&mut self, other: &Self, worth: f32) {
        let step = other.height as f32 / self.height as f32;
        let (width, height) = (self.width, self.height);
        self.cells.par_iter_mut().enumerate().for_each(|(i, cell)| {
            let place = |at: usize, all: usize, other: usize| {
                (at as f32 + 0.5 - 0.5 * all as f32) * step + 0.5 * other as f32 - 0.5
            };
            let x = place(i % width, width, other.width);
            let y = place(i / width, height, other.height);
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let (tx, ty) = (x - x.floor(), y - y.floor());
                let share = |t: f32, d: isize| if d == 0 { 1.0 - t } else { t };
                let near = other.at(x.floor() as isize + dx, y.floor() as isize + dy);
                let times = share(tx, dx) * share(ty, dy) * step * step;
                cell.doubt(near, times * worth);
                cell.add_worth(near, times, worth);
            }
        });
    }
}

impl Scale<Filtered> {
    /// Gives cells of the coarsest scale that have no samples the mean of those that have, the nearer the more.
    fn fill_gaps(&mut self, cells: &Scale<Cell>) {
        let has_samples = |index: &usize| cells.cells[*index].samples > 0.0;
        let known: Vec<usize> = (0..cells.cells.len()).filter(has_samples).collect();
        for index in (0..cells.cells.len()).filter(|index| !has_samples(index)) {
            let place = |index: usize| [index % self.width, index / self.width];
            let ([x, y], mut sum, mut total) = (place(index), Filtered::default(), 0.0);
            for other in &known {
                let [u, v] = place(*other);
                let weight = 1.0 / (u.abs_diff(x).pow(2) + v.abs_diff(y).pow(2)) as f32;
                sum.add(&self.cells[*other], weight);
                total += weight;
            }
            if total > 0.0 {
                self.cells[index] = sum.over(total);
            }
        }
    }
}

impl Filtered {
    /// Adds what is told to finer scales.
    fn add(&mut self, other: &Self, weight: f32) {
        self.light += other.light * weight;
        self.albedo += other.albedo * weight;
        self.coverage += other.coverage * weight;
        self.chance += other.chance * weight;
        self.spread += other.spread * weight;
    }

    fn over(self, total: f32) -> Self {
        Self {
            light: self.light / total,
            albedo: self.albedo / total,
            coverage: self.coverage / total,
            chance: self.chance / total,
            spread: self.spread / total,
            ..self
        }
    }
}

/// Median luminance of the pixels that have met any light.
fn usual_luminance(pixels: &[Pixel]) -> f32 {
    let mean = |pixel: &Pixel| luminance(Vec3::from(pixel.mean().map(|channel| channel as f32)));
    let mut all: Vec<f32> = pixels.par_iter().map(mean).filter(|light| *light > 0.0).collect();
    if all.is_empty() {
        return 0.0;
    }
    let middle = all.len() / 2;
    *all.select_nth_unstable_by(middle, f32::total_cmp).1
}

/// Takes a scale's details to what coarser scales say.
fn refined(
    cells: &Scale<Cell>,
    guides: &Scale<Guide>,
    coarser: Option<&(Scale<Guide>, Scale<Filtered>)>,
    number: usize,
) -> Scale<Filtered> {
    let (width, height) = (cells.width, cells.height);
    let pixels = (1 << number) as f32;
    let expected = |i: usize| {
        let cell = &cells.cells[i];
        let mut estimate = coarser.map_or_else(Filtered::default, |(their_guides, estimates)| {
            from_parents(&guides.cells[i], (i % width, i / width), their_guides, estimates, pixels)
        });
        if cell.samples > 0.0 {
            let mean = cell.light / cell.samples;
            if number >= MIN_CHANCE_SCALE || coarser.is_none() {
                estimate.chance = cell.chance / cell.samples;
            }
            let chance = if coarser.is_some() { estimate.chance } else { 0.0 };
            (estimate.albedo, estimate.coverage) = cell.dress(estimate.coverage, chance);
            // Where light comes in few bright samples, a cell knows of their spread as much as it is to have
            // met of them: those that have met none agree.
            let expected = estimate.spread;
            let (bright, around) = match coarser {
                Some(_) => {
                    let energy = luminance(estimate.light).powi(2);
                    (energy / (energy + expected).max(f32::MIN_POSITIVE), SPREAD_SAMPLES)
                }
                None => (1.0, 0.0),
            };
            let total = cell.freedom * bright + around;
            estimate.spread = (cell.deviation * bright + around * expected) / total.max(1.0);
            // A pixel that has met little light is too dark and sure of it.
            estimate.variance = estimate.spread.max(expected) / cell.samples;
            if coarser.is_some() {
                let around = cells.brightness_around((i % width, i / width));
                let most = around.unwrap_or(luminance(estimate.light));
                estimate.detail = mean * cell.believed(most) - estimate.light;
            } else {
                estimate.light = mean;
            }
        }
        estimate
    };
    let estimates = (0..width * height).into_par_iter().map(expected).collect();
    let mut estimates = Scale { width, height, cells: estimates };
    if coarser.is_none() {
        estimates.fill_gaps(cells);
    } else {
        let share = |i| wieners_share(&estimates, (i % width, i / width));
        let shares: Vec<f32> = (0..width * height).into_par_iter().map(share).collect();
        let take =
            |(estimate, share): (&mut Filtered, f32)| estimate.light += estimate.detail * share;
        estimates.cells.par_iter_mut().zip(shares).for_each(take);
    }
    estimates
}

/// What the four nearest cells of the coarser scale say of a cell.
fn from_parents(
    guide: &Guide,
    (x, y): (usize, usize),
    guides: &Scale<Guide>,
    estimates: &Scale<Filtered>,
    pixels: f32,
) -> Filtered {
    let (x, y) = (x as isize, y as isize);
    // The parent and its neighbour on the cell's side.
    let (px, py) = (x / 2, y / 2);
    let (qx, qy) = (px + 2 * (x % 2) - 1, py + 2 * (y % 2) - 1);
    let mut sum = Filtered::default();
    let mut total = 0.0;
    for (x, y, share) in [(px, py, 9.0), (qx, py, 3.0), (px, qy, 3.0), (qx, qy, 1.0)] {
        let weight = share * (MIN_LIKENESS + guide.likeness(guides.at(x, y), 2.0 * pixels));
        sum.add(estimates.at(x, y), weight);
        total += weight;
    }
    sum.over(total)
}

/// The energy of the details around a cell over that and the noise's. The strongest one does not
/// count: a lone bright sample is no detail.
fn wieners_share(estimates: &Scale<Filtered>, (x, y): (usize, usize)) -> f32 {
    let own = estimates.at(x as isize, y as isize);
    if own.detail == Vec3::ZERO {
        return 0.0;
    }
    let (mut energy, mut noise, mut strongest) = (0.0, 0.0, 0.0_f32);
    for row in y.saturating_sub(1)..(y + 2).min(estimates.height) {
        let row = &estimates.cells[row * estimates.width..][..estimates.width];
        for near in &row[x.saturating_sub(1)..(x + 2).min(estimates.width)] {
            let detail = luminance(near.detail).powi(2);
            energy += detail;
            noise += near.variance;
            strongest = strongest.max(detail);
        }
    }
    let signal = (energy - strongest - noise).max(0.0) / 8.0;
    if signal > 0.0 { signal / (signal + own.variance) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::{FirstHit, PathResult};

    /// A film where every `every`-th pixel of every `every`-th row has samples of this light.
    fn film(
        size: [u32; 2],
        every: u32,
        samples: u32,
        light: impl Fn(u32, u32, u32) -> f32,
    ) -> Film {
        let mut film = Film::new(size[0], size[1], false);
        for y in (0..size[1]).step_by(every as usize) {
            for x in (0..size[0]).step_by(every as usize) {
                for sample in 0..samples {
                    let radiance = Vec3::splat(light(x, y, sample));
                    film.add(x, y, &PathResult { radiance, rays: 1, ..PathResult::default() });
                }
            }
        }
        film
    }

    /// Noise with mean 1 and variance 1/3 that is the same at every call.
    fn noise(x: u32, y: u32, sample: u32) -> f32 {
        let mut hash = x.wrapping_mul(0x9e37_79b9) ^ y.wrapping_mul(0x85eb_ca6b) ^ (sample << 7);
        for _ in 0..3 {
            hash = (hash ^ (hash >> 15)).wrapping_mul(0x2c1b_3c6d);
        }
        (hash >> 8) as f32 / (1 << 23) as f32
    }

    fn error(image: &Image, truth: impl Fn(u32, u32) -> f32) -> f32 {
        let squared = |i: u32| {
            (image.pixels[i as usize][1] - truth(i % image.width, i / image.width)).powi(2)
        };
        let count = image.width * image.height;
        ((0..count).map(squared).sum::<f32>() / count as f32).sqrt()
    }

    #[test]
    fn what_is_known_exactly_stays_as_it_is() {
        let edge = |x: u32, y: u32| if x + y < 40 { 0.2 } else { 3.0 };
        let image = blend(&film([61, 37], 1, 2, |x, y, _| edge(x, y)), None);
        assert!(error(&image, edge) < 1e-4);
    }

    #[test]
    fn a_few_pixels_make_a_whole_picture_and_more_a_better_one() {
        let edge = |x: u32, _: u32| if x < 32 { 0.5 } else { 4.0 };
        let mut last = f32::INFINITY;
        for (every, samples) in [(8, 1), (4, 1), (2, 1), (1, 1), (1, 4), (1, 64)] {
            let light = |x, y, sample| edge(x, y) * noise(x, y, sample);
            let film = film([64, 48], every, samples, light);
            let image = blend(&film, None);
            let found = error(&image, edge);
            assert!(found < last, "{found} after {last}, every {every}, {samples} samples");
            assert!(found < 0.8 * error(&film.image(), edge), "better than the film: {found}");
            last = found;
        }
    }

    #[test]
    fn lone_bright_samples_are_shared_out() {
        let light = |x, y, sample| {
            if (x, y, sample) == (20, 11, 0) { 500.0 } else { noise(x, y, sample) }
        };
        let image = blend(&film([40, 30], 1, 2, light), None);
        let brightest = image.pixels.iter().map(|p| p[0]).fold(0.0, f32::max);
        assert!(brightest < 3.0, "{brightest}");
    }

    #[test]
    fn a_small_lamp_that_all_samples_see_stays_small_and_bright() {
        let lamp = |x: u32, y: u32| if (x, y) == (20, 11) { 500.0 } else { 1.0 };
        let image = blend(&film([40, 30], 1, 4, |x, y, _| lamp(x, y)), None);
        assert!(error(&image, lamp) < 1e-3);
    }

    #[test]
    fn a_bright_sample_that_the_other_picture_has_not_met_is_shared_out() {
        let light = |x, y, _| if (x, y) == (20, 11) { 500.0 } else { 1.0 };
        let calm = film([40, 30], 1, 4, |_, _, _| 1.0);
        let image = blend(&film([40, 30], 1, 1, light), Some((&calm, 4.0)));
        let brightest = image.pixels.iter().map(|p| p[0]).fold(0.0, f32::max);
        assert!(brightest < 2.0, "{brightest}");
    }

    #[test]
    fn the_sun_in_a_mirror_makes_no_haze() {
        let light = |x, y, sample| if (x, y, sample) == (20, 11, 2) { 1e7 } else { 1.0 };
        let image = blend(&film([40, 30], 1, 4, light), None);
        let brightest = image.pixels.iter().map(|p| p[0]).fold(0.0, f32::max);
        assert!(brightest < 1.5, "{brightest}");
    }

    #[test]
    fn many_lone_bright_samples_leave_no_dots() {
        let light = |x, y, sample| if noise(x, y, sample) < 0.04 { 15.0 } else { 0.5 };
        for every in [2, 1] {
            let image = blend(&film([96, 96], every, 1, light), None);
            let brightest = image.pixels.iter().map(|p| p[0]).fold(0.0, f32::max);
            assert!(brightest < 4.0, "{brightest} where 0.8 is right, every {every}");
            let mean = image.pixels.iter().map(|p| p[0]).sum::<f32>() / (96.0 * 96.0);
            assert!((mean - 0.79).abs() < 0.1, "nothing is lost: {mean}, every {every}");
        }
    }

    /// A window's edge while a pass is under way, when part of the rows has one sample more.
    #[test]
    fn edges_of_the_sky_do_not_change_from_sample_to_sample() {
        let window = |more_rows: u32| {
            let mut film = Film::new(48, 48, true);
            for (x, y) in (0..48).flat_map(|y| (0..48).map(move |x| (x, y))) {
                let is_sky = (13..27).contains(&x) && (11..35).contains(&y);
                let surface = FirstHit { albedo: Vec3::splat(0.5), normal: Vec3::Z, depth: 4.0 };
                for sample in 0..8 + u32::from(y < more_rows) {
                    let light = if is_sky { 100.0 } else { 0.5 * noise(x, y, sample) };
                    let (radiance, first_hit) = (Vec3::splat(light), (!is_sky).then_some(surface));
                    film.add(
                        x,
                        y,
                        &PathResult { radiance, first_hit, rays: 1, ..PathResult::default() },
                    );
                }
            }
            blend(&film, None)
        };
        let before = window(0);
        for rows in [11, 12, 35, 36] {
            let now = window(rows);
            let off = now.pixels.iter().zip(&before.pixels).map(|(a, b)| (a[0] - b[0]).abs());
            let most = off.fold(0.0, f32::max);
            assert!(most < 0.15, "{most} with {rows} rows ahead");
        }
    }

    #[test]
    fn where_few_samples_are_bright_no_pixel_stays_dark() {
        let light = |x, y, sample| if noise(x, y, sample) < 0.02 { 100.0 } else { 0.0 };
        let image = blend(&film([64, 64], 1, 16, light), None);
        let darkest = image.pixels.iter().map(|p| p[0]).fold(f32::INFINITY, f32::min);
        assert!(darkest > 0.3, "{darkest} where 1 is right");
    }

    #[test]
    fn fog_in_front_of_a_dark_surface_is_smooth_and_the_sky_beside_it_as_it_is() {
        let mut film = Film::new(64, 48, true);
        for (x, y) in (0..48).flat_map(|y| (0..64).map(move |x| (x, y))) {
            for sample in 0..8 {
                let is_fog = x >= 32 || noise(x, y, sample) < 0.6;
                let surface = FirstHit { albedo: Vec3::splat(0.05), normal: Vec3::Z, depth: 9.0 };
                let radiance = Vec3::splat(if is_fog { 1.0 } else { 0.05 });
                let first_hit = (!is_fog).then_some(surface);
                let result = PathResult { radiance, first_hit, rays: 1, ..PathResult::default() };
                film.add(x, y, &result);
            }
        }
        let truth = |x: u32, _: u32| if x >= 32 { 1.0 } else { 0.3 + 0.7 * 0.05 };
        let image = blend(&film, None);
        let brightest = image.pixels.iter().map(|p| p[0]).fold(0.0, f32::max);
        assert!(brightest < 1.1, "no halo: {brightest}");
        let (found, noisy) = (error(&image, truth), error(&film.image(), truth));
        assert!(found < 0.45 * noisy, "{found} {noisy}");
    }

    #[test]
    fn what_has_no_samples_for_hundreds_of_pixels_is_not_black() {
        let mut begun = Film::new(40, 600, false);
        let radiance = Vec3::splat(2.0);
        for x in (0..40).step_by(8) {
            begun.add(x, 8, &PathResult { radiance, ..PathResult::default() });
        }
        assert!(error(&blend(&begun, None), |_, _| 2.0) < 1e-4);
    }

    #[test]
    fn a_small_film_of_the_same_view_helps_where_there_is_little() {
        let slope = |x: u32, y: u32| 1.0 + 0.02 * (x + y) as f32;
        let light = |x, y, sample| slope(x, y) * noise(x, y, sample);
        let little = film([64, 48], 8, 1, light);
        let small = film([16, 12], 1, 64, |x, y, sample| light(4 * x, 4 * y, sample));
        let (alone, helped) = (blend(&little, None), blend(&little, Some((&small, 1.0))));
        assert!(error(&helped, slope) < 0.5 * error(&alone, slope));
        let calm = film([64, 48], 1, 8, |x, y, sample| {
            slope(x, y) * (1.0 + 0.5 * (noise(x, y, sample) - 1.0))
        });
        let nobody = Film::new(64, 48, false);
        let [once, worth] = [1.0, 4.0].map(|worth| blend(&nobody, Some((&calm, worth))));
        let off = once.pixels.iter().zip(&worth.pixels).map(|(a, b)| (a[0] / b[0] - 1.0).abs());
        assert!(
            off.fold(0.0, f32::max) < 0.05,
            "alone, it is the same picture whatever it is worth"
        );
        // Of another shape they share their middle, and a film without samples says nothing.
        let wide = blend(&Film::new(64, 24, false), Some((&small, 1.0)));
        assert!(wide.pixels.iter().all(|p| p[0] > 0.5 && p[0] < 4.0));
        let nothing = blend(&Film::new(7, 5, true), None);
        assert!(nothing.pixels.iter().all(|p| *p == [0.0; 3]));
    }
}
