//! A picture that is seen again from elsewhere: each of its pixels is a point in space, by the depth of the film.
//!
//! Points are projected into the other view, the nearest one of a pixel counts, and colours are interpolated between
//! the picture's pixels. Only light that leaves a surface alike in all directions is right; that is enough for as
//! long as a camera moves. What mirrors show keeps the place of the mirror image.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::{Vec2, Vec4};
use rayon::prelude::*;

use super::film::Film;
use super::view::View;
use crate::image::Image;
use crate::path::World;
use crate::scene::Frame;

/// A pixel this much deeper than one beside it lies on an edge.
const EDGE: f32 = 1.05;
/// How far from an edge colours have something of the other side, in pixels.
const OUTLINE: usize = 2;
/// What is seen between points that are this much nearer shines through a gap between them.
const GAP: f32 = 1.1;
/// How far from a pixel points are looked for, in pixels.
const REACH: usize = 2;
/// Of the 24 points so near to it, this many make it a gap between them.
const MIN_AROUND: usize = 13;
/// No point is near a pixel.
const NOTHING: u64 = u64::MAX;

/// A picture, and where in the scene its pixels are.
pub(crate) struct Keyframe {
    image: Arc<Image>,
    /// A point with a last component of 1, or a direction with 0 where nothing was met. NaN where that is unclear.
    points: Vec<Vec4>,
    frame: Frame,
}

impl Keyframe {
    /// Of a picture and the film that it was made from; `None` if that has no layers or another size.
    pub(crate) fn new(world: &World, view: &View, film: &Film, image: Arc<Image>) -> Option<Self> {
        let size = (film.width, film.height);
        if !film.has_layers() || (image.width, image.height) != size {
            return None;
        }
        let frame = world.scene.frame;
        let width = film.width as usize;
        let depths = without_outlines(&depths_of(frame, film), width);
        let mut rays = view.of_size(size.0, size.1).rays();
        rays.lens_radius = 0.0;
        let point = |(at, depth): (usize, &f32)| {
            let ray = rays.ray(middle_of(at, width), Vec2::ZERO);
            match *depth {
                f32::INFINITY => ray.direction.extend(0.0),
                depth => (ray.origin + ray.direction * depth).extend(1.0),
            }
        };
        Some(Self { image, points: depths.par_iter().enumerate().map(point).collect(), frame })
    }

    /// What it shows of each pixel of another view, row after row; `None` where it shows nothing, or only what lies
    /// behind the surfaces that `met` has found there. That film may have another size.
    pub(crate) fn seen_in(&self, view: &View, met: Option<&Film>) -> Vec<Option<[f32; 3]>> {
        let rays = view.rays();
        let projection = rays.projection();
        let (width, height) = (view.width as usize, view.height as usize);
        let nearest: Vec<AtomicU64> =
            (0..width * height).map(|_| AtomicU64::new(NOTHING)).collect();
        let places: Vec<Vec2> = (self.points.par_iter().enumerate())
            .map(|(index, point)| {
                let [x, y, ahead] = projection.map(|row| row.dot(*point));
                let place = Vec2::new(x, y) / ahead;
                // Neither behind the camera nor NaN.
                if ahead > 0.0 && place.cmpge(Vec2::ZERO).all() {
                    let (x, y) = (place.x as usize, place.y as usize);
                    if x < width && y < height {
                        let depth = if point.w == 0.0 { f32::INFINITY } else { rays.depth(*point) };
                        // Depths are not negative: their bits are in order.
                        let key = u64::from(depth.to_bits()) << 32 | index as u64;
                        nearest[y * width + x].fetch_min(key, Ordering::Relaxed);
                    }
                }
                place
            })
            .collect();
        let nearest: Vec<u64> = nearest.into_iter().map(AtomicU64::into_inner).collect();
        let far = met.map(|film| (farthest(self.frame, film), film));
        let seen = |at: usize| {
            let key = source_of(&nearest, width, at)?;
            let middle = middle_of(at, width);
            if let Some((far, film)) = &far {
                let size = Vec2::new(film.width as f32, film.height as f32);
                let pixel = (middle * size / Vec2::new(width as f32, height as f32)).as_uvec2();
                if depth_of(key) > GAP * far[(pixel.y * film.width + pixel.x) as usize] {
                    return None;
                }
            }
            let index = index_of(key);
            let own = middle_of(index, self.image.width as usize) - 0.5;
            Some(self.image.between((own + middle - places[index]).to_array()))
        };
        (0..width * height).into_par_iter().map(seen).collect()
    }
}

/// The middle of a pixel, given the picture's width.
fn middle_of(index: usize, width: usize) -> Vec2 {
    Vec2::new((index % width) as f32, (index / width) as f32) + 0.5
}

/// The values of a pixel and of those up to `reach` columns and rows away, given the picture's width.
fn around<T: Copy>(
    values: &[T],
    width: usize,
    at: usize,
    reach: usize,
) -> impl Iterator<Item = T> + '_ {
    let (x, y) = (at % width, at / width);
    let rows = y.saturating_sub(reach)..(y + reach + 1).min(values.len() / width);
    let columns = x.saturating_sub(reach)..(x + reach + 1).min(width);
    rows.flat_map(move |row| values[row * width..][columns.clone()].iter().copied())
}

/// How far away the surfaces of each pixel of a film are, or of those beside it; infinite where nothing was met.
fn farthest(frame: Frame, film: &Film) -> Vec<f32> {
    let (depths, width) = (depths_of(frame, film), film.width as usize);
    let of_pixel = |at| around(&depths, width, at, 1).fold(0.0, f32::max);
    (0..depths.len()).into_par_iter().map(of_pixel).collect()
}

/// How far away, in units of the scene, each pixel's surfaces are; infinite where none was met.
fn depths_of(frame: Frame, film: &Film) -> Vec<f32> {
    let depth = |index| film.surface_of(index).map_or(f32::INFINITY, |(.., z)| frame.length(z));
    (0..film.pixels().len()).into_par_iter().map(depth).collect()
}

/// A key is the depth of a point and its index.
fn depth_of(key: u64) -> f32 {
    f32::from_bits((key >> 32) as u32)
}

fn index_of(key: u64) -> usize {
    key as u32 as usize
}

/// Which point a pixel shows: its own, unless that lies in a gap between nearer ones, or one near by.
fn source_of(nearest: &[u64], width: usize, at: usize) -> Option<u64> {
    let around = |reach| around(nearest, width, at, reach);
    let own = nearest[at];
    if own == NOTHING {
        // Those beside it first.
        let least = |reach| around(reach).min().filter(|key| *key != NOTHING);
        return [1, REACH].into_iter().find_map(least);
    }
    let is_nearer = |key: &u64| depth_of(*key) * GAP < depth_of(own);
    if !around(1).any(|key| is_nearer(&key)) {
        return Some(own);
    }
    let nearer = around(REACH).filter(is_nearer);
    let (count, least) = nearer.fold((0, own), |(count, least), key| (count + 1, key.min(least)));
    Some(if count >= MIN_AROUND { least } else { own })
}

/// Depths without those just behind an edge, which are NaN: the colours there have something of what is in front, and
/// would stay behind as its outline. A mean of both sides becomes the depth of what is in front.
fn without_outlines(depths: &[f32], width: usize) -> Vec<f32> {
    let depth = |at: usize| {
        let (least, most) = around(depths, width, at, OUTLINE)
            .fold((f32::INFINITY, 0.0), |(least, most), depth| (depth.min(least), depth.max(most)));
        let own = depths[at];
        match own > EDGE * least {
            true if most > EDGE * own => least,
            true => f32::NAN,
            false => own,
        }
    };
    (0..depths.len()).into_par_iter().map(depth).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::{Environment, EnvironmentOptions, sky};
    use crate::render::Session;
    use crate::scene::{Camera, builtin};

    fn rendered(world: &World, map: &Environment, view: &View, samples: u32) -> Film {
        let mut session = Session::new(world, map, view.clone());
        session.finish_learning();
        session.advance(samples, &std::sync::atomic::AtomicBool::new(false)).expect("rendered");
        session.film().clone()
    }

    /// Mean absolute difference of pixels that are seen, over the mean light of the picture; and their share.
    fn difference(seen: &[Option<[f32; 3]>], truth: &Image) -> (f64, f64) {
        let pairs = seen
            .iter()
            .zip(&truth.pixels)
            .filter_map(|(seen, true_)| Some((seen.as_ref()?, true_)));
        let sum = |color: &[f32; 3]| f64::from(color[0] + color[1] + color[2]);
        let apart = |(a, b): (&[f32; 3], &[f32; 3])| {
            a.iter().zip(b).map(|(a, b)| f64::from((a - b).abs())).sum::<f64>()
        };
        let all: f64 = truth.pixels.iter().map(sum).sum::<f64>() / truth.pixels.len() as f64;
        let count = pairs.clone().count();
        (pairs.map(apart).sum::<f64>() / count as f64 / all, count as f64 / seen.len() as f64)
    }

    #[test]
    fn a_picture_is_seen_again_from_elsewhere() {
        let world = World::new(builtin::build("living-room").expect("built in"));
        let map = sky::build("overcast", 64, 32).expect("a sky");
        let map = Environment::new(map, &EnvironmentOptions::default()).expect("sound");
        let mut view =
            View { layers: true, ..View::new(world.scene.cameras[0].clone(), [160, 120]) };
        view.limits.bounces = 2;
        let before = rendered(&world, &map, &view, 32);
        let image = Arc::new(before.image());
        let keyframe = Keyframe::new(&world, &view, &before, Arc::clone(&image)).expect("layers");
        let (same, all) = difference(&keyframe.seen_in(&view, Some(&before)), &image);
        assert!(same < 1e-3 && all > 0.999, "in its own view: {same}, {all}");
        let turned = |degrees: f32| {
            let camera = &view.camera;
            let turn = glam::Affine3A::from_rotation_y(degrees.to_radians());
            Camera { world_from_camera: turn * camera.world_from_camera, ..camera.clone() }
        };
        for degrees in [1.0, 4.0] {
            let other = View { camera: turned(degrees), ..view.clone() };
            let film = rendered(&world, &map, &other, 32);
            let truth = film.image();
            let (apart, share) = difference(&keyframe.seen_in(&other, Some(&film)), &truth);
            let still: Vec<_> = image.pixels.iter().copied().map(Some).collect();
            let (unmoved, _) = difference(&still, &truth);
            let again = rendered(&world, &map, &View { seed: 1, ..other }, 32).image();
            let again: Vec<_> = again.pixels.into_iter().map(Some).collect();
            let (noise, _) = difference(&again, &truth);
            eprintln!(
                "{degrees} degrees: {apart:.3} of {unmoved:.3}, noise {noise:.3}, {share:.3} seen"
            );
            // Pixels between others have less noise.
            let is_near = apart - noise < 0.25 * (unmoved - noise);
            assert!(is_near && share > 0.85, "{degrees}: {apart}, {unmoved}, {noise}, {share}");
        }
    }

    #[test]
    fn what_is_in_front_hides_what_is_behind() {
        let key = |depth: f32, index: u64| u64::from(depth.to_bits()) << 32 | index;
        // A gap of two columns in what is in front.
        let gap = [key(1.0, 0), key(1.0, 1), key(3.0, 9), key(3.0, 9), key(1.0, 4), key(1.0, 5)];
        let found =
            |row: [u64; 6], at: usize| source_of(&[row; 6].concat(), 6, 18 + at).map(index_of);
        assert_eq!([1, 2, 3].map(|at| found(gap, at)), [Some(1), Some(0), Some(1)]);
        // Its edge.
        let edge = [key(1.0, 0), key(1.0, 1), key(1.0, 2), key(3.0, 3), key(3.0, 4), key(3.0, 5)];
        assert_eq!([2, 3].map(|at| found(edge, at)), [Some(2), Some(3)]);
        assert_eq!(found([NOTHING, key(1.0, 1), NOTHING, NOTHING, NOTHING, NOTHING], 3), Some(1));
        assert_eq!(found([NOTHING; 6], 3), None);
        let edge = without_outlines(&[1.0, 1.0, 2.0, 4.0, 4.0, 4.0], 6);
        assert_eq!((&edge[..3], edge[5]), ([1.0; 3].as_slice(), 4.0));
        assert!(edge[3].is_nan(), "{edge:?}");
    }
}
