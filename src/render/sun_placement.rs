//! The rotation of a map by which its sun shines on a place of the picture.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::surface_map::{Spot, SurfaceMap, look_at_place};
use super::view::View;
use crate::bvh::{Ray, offset_origin};
use crate::environment::sun::Sun;
use crate::error::{Error, Result};
use crate::path::World;

/// Azimuths tried, evenly around the vertical.
const AZIMUTHS: u16 = 720;
/// The sun is turned so far into an opening through which it shines, if that is wide enough.
const MARGIN_DEGREES: f64 = 5.0;
/// Least cosine between the sun and a surface's normal: a grazing sun lights nothing.
const MIN_COSINE: f32 = 0.05;
/// Azimuths tried where the sun is to come near a place.
const AZIMUTHS_NEAR: u16 = 180;
/// Pixels across the picture whose surfaces are tried then.
const COLUMNS_NEAR: u32 = 48;
/// What counts as near, as a share of the median distance to what is in view.
const NEARNESS: f32 = 0.25;

/// How a map is to be turned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SunPlacement {
    /// Rotation of the map in degrees, `[0,360)`.
    pub rotation_degrees: f32,
    /// From the place that was asked for to the nearest one that the sun can reach, in metres of the file; 0 if it
    /// reaches the first.
    pub distance: f32,
    /// Elevation of the sun in degrees.
    elevation_degrees: f64,
}

impl SunPlacement {
    /// Turns a map from its present rotation as little as necessary, so that its sun shines on the surface seen at
    /// `place`, both coordinates in `[0,1]`. Where no rotation does that, one is taken by which it shines on as much as
    /// possible near the place. Smooth glass counts as if it bent no light.
    ///
    /// # Errors
    /// If the map is black, no surface is seen there, or the sun reaches none in view.
    pub fn find(
        world: &World,
        view: &View,
        sun: Option<&Sun>,
        place: Vec2,
        rotation_degrees: f32,
    ) -> Result<Self> {
        let sun = sun.ok_or_else(|| Error::new("the map is black: it has no sun"))?;
        let sky = "there is no surface for the sun to shine on, only the map";
        let asked = look_at_place(world, view, place).ok_or_else(|| Error::new(sky))?;
        let present = f64::from(rotation_degrees);
        let at_place = rotation_for(world, sun, &asked, present).map(|rotation| (rotation, 0.0));
        let found = at_place.or_else(|| rotation_near(world, view, sun, asked.position));
        let (rotation, distance) = found.ok_or_else(|| {
            Error::new(format!(
                "the sun, {:.0}° above the horizon, reaches nothing in view, however the map is turned",
                sun.elevation_degrees
            ))
        })?;
        Ok(Self {
            // As people name it.
            rotation_degrees: ((10.0 * rotation).round() / 10.0) as f32 % 360.0,
            distance: world.scene.frame.length_in_file(distance),
            elevation_degrees: sun.elevation_degrees,
        })
    }

    /// A sentence where the sun cannot reach what was asked for.
    pub fn notice(&self) -> Option<String> {
        (self.distance > 0.0).then(|| {
            format!(
                "the sun, {:.0}° above the horizon, cannot reach this place; it shines {:.2} m beside it",
                self.elevation_degrees, self.distance
            )
        })
    }
}

/// Whether the sun of a map that is turned by `rotation_degrees` shines on a spot.
pub(crate) fn is_sunlit(world: &World, sun: &Sun, spot: &Spot, rotation_degrees: f64) -> bool {
    let direction = sun.direction(rotation_degrees);
    if spot.normal.dot(direction) < MIN_COSINE {
        return false;
    }
    let origin = offset_origin(spot.position, spot.normal);
    let ray = Ray { origin, direction, t_min: 0.0, t_max: f32::INFINITY };
    world.transmittance_but_for_glass(&ray).0 != Vec3::ZERO
}

/// The least turn from the present rotation by which the sun shines on a spot, as the rotation in degrees.
fn rotation_for(world: &World, sun: &Sun, spot: &Spot, present: f64) -> Option<f64> {
    let step = 360.0 / f64::from(AZIMUTHS);
    let is_free = |i| is_sunlit(world, sun, spot, present + step * f64::from(i));
    let free: Vec<bool> = (0..AZIMUTHS).map(is_free).collect();
    least_turn(&free).map(|steps| (present + step * steps).rem_euclid(360.0))
}

/// The rotation in degrees by which the sun shines on most of what is in view near a position, and how far from that the
/// nearest sunlit place is.
fn rotation_near(world: &World, view: &View, sun: &Sun, position: Vec3) -> Option<(f64, f32)> {
    let rows = (COLUMNS_NEAR * view.height).div_ceil(view.width.max(1));
    let seen = SurfaceMap::of(world, &view.of_size(COLUMNS_NEAR, rows));
    let spots = seen.spots.into_iter().flatten();
    let mut spots: Vec<(Spot, f32)> =
        spots.map(|spot| (spot, spot.position.distance(position))).collect();
    spots.sort_by(|a, b| a.1.total_cmp(&b.1));
    let near = NEARNESS * spots.get(spots.len() / 2)?.1;
    let step = 360.0 / f64::from(AZIMUTHS_NEAR);
    let rotations = (0..AZIMUTHS_NEAR).into_par_iter().map(|i| step * f64::from(i));
    let rated = rotations.filter_map(|rotation| {
        let direction = sun.direction(rotation);
        let lit = spots.iter().filter(|(spot, _)| is_sunlit(world, sun, spot, rotation));
        let lit: Vec<&(Spot, f32)> = lit.collect();
        let weight = |&&(spot, distance): &&(Spot, f32)| {
            spot.normal.dot(direction) / (1.0 + (distance / near).powi(4))
        };
        Some((lit.iter().map(weight).sum::<f32>(), rotation, lit.first()?.1))
    });
    let (_, rotation, nearest) = rated.max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some((rotation, nearest))
}

/// Steps, in either direction around a circle, from the first place to the nearest that lies well inside of a run of
/// free ones.
fn least_turn(free: &[bool]) -> Option<f64> {
    let count = free.len();
    let Some(blocked) = free.iter().position(|free| !free) else { return Some(0.0) };
    let margin = MARGIN_DEGREES / 360.0 * count as f64;
    let mut best: Option<f64> = None;
    let mut run = 0;
    // Once around, from a blocked place to the same.
    for i in blocked + 1..=blocked + count {
        if free[i % count] {
            run += 1;
        } else if run > 0 {
            let (first, last) = ((i - run) as f64, (i - 1) as f64);
            let inset = margin.min((last - first) / 2.0);
            let turn = |start: f64| start.clamp(first + inset, last - inset) - start;
            let turns = [0.0, count as f64].map(turn).into_iter().chain(best);
            (best, run) = (turns.min_by(|a, b| a.abs().total_cmp(&b.abs())), 0);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::WorldBuilder;
    use crate::scene::{Camera, Material};

    #[test]
    fn the_least_turn_ends_well_inside_of_the_nearest_opening() {
        let around = |free: &[(usize, usize)]| {
            let is_free = |i| free.iter().any(|&(first, end)| (first..end).contains(&i));
            let free: Vec<bool> = (0..360).map(is_free).collect();
            least_turn(&free)
        };
        assert_eq!(around(&[]), None);
        assert_eq!(around(&[(0, 360)]), Some(0.0));
        // A narrow one is entered to its middle.
        assert_eq!(around(&[(40, 45)]), Some(42.0));
        assert_eq!(around(&[(40, 101)]), Some(45.0));
        assert_eq!(around(&[(40, 101), (330, 341)]), Some(-25.0));
        // It lies around the present place, which is at its edge or inside of it.
        assert_eq!(around(&[(0, 20), (350, 360)]), Some(0.0));
        assert_eq!(around(&[(0, 20), (358, 360)]), Some(3.0));
        assert_eq!(around(&[(0, 3), (300, 360)]), Some(-3.0));
    }

    /// A room of 4 x 3 x 4 metres without its wall towards +X, seen from above.
    fn room() -> (World, View) {
        let [low, high] = [Vec3::new(-2.0, 0.0, -2.0), Vec3::new(2.0, 3.0, 2.0)];
        let world = WorldBuilder::default().faces(&Material::lambert(0.5), low, high, 1..6);
        let camera = Camera::look_at(Vec3::new(0.0, 2.5, 0.01), Vec3::ZERO, 2.4);
        (world.build(), View::new(camera, [64, 64]))
    }

    fn sun(azimuth_degrees: f64, elevation_degrees: f64) -> Sun {
        Sun {
            texel: [0, 0],
            azimuth_degrees,
            elevation_degrees,
            energy_share: 0.5,
            max_luminance: 1e4,
            mean_luminance: 1.0,
        }
    }

    #[test]
    fn the_sun_is_turned_to_where_it_shines_through_the_opening() {
        let (world, view) = room();
        let middle = Vec2::splat(0.5);
        let find = |sun: &Sun, now| SunPlacement::find(&world, &view, Some(sun), middle, now);
        // From the floor's middle the opening is seen over 45 degrees at either side of +X.
        let low = sun(100.0, 20.0);
        for (now, expected) in [(0.0, 300.0), (200.0, 220.0), (260.0, 260.0)] {
            let found = find(&low, now).expect("it shines in");
            assert!((found.rotation_degrees - expected).abs() < 1.0, "{now}: {found:?}");
            assert_eq!((found.distance, found.notice()), (0.0, None));
        }
        // So high that it passes under the ceiling's edge only near the opening: 3 / tan(70) = 1.09 metres from it.
        let found = find(&sun(100.0, 70.0), 0.0).expect("it shines in elsewhere");
        assert!((found.distance - 0.91).abs() < 0.15, "{found:?}");
        assert!(found.notice().is_some_and(|it| it.starts_with("the sun, 70° above the horizon")));
        let none = find(&sun(100.0, -89.0), 0.0).expect_err("it is below the floor");
        assert!(none.to_string().contains("reaches nothing in view"), "{none}");
    }
}
