//! The surface behind every pixel: what overlays, the inspector and focusing ask for.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::view::View;
use crate::bvh::{Ray, offset_origin};
use crate::path::World;

/// Panes and leaves that a look passes at most.
const MAX_PASSES: u32 = 32;

/// A point of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// World position in metres.
    pub position: Vec3,
    /// Unit geometric normal towards the viewer.
    pub normal: Vec3,
    /// Material index.
    pub material: u32,
}

/// What the middle of every pixel shows.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceMap {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `None` where no surface is.
    pub spots: Vec<Option<Spot>>,
}

impl SurfaceMap {
    /// Looks through the middle of every pixel.
    pub fn of(world: &World, view: &View) -> Self {
        let rays = view.rays();
        let width = view.width.max(1);
        let spot = |i: u32| {
            let pixel = Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
            look(world, rays.ray(pixel, Vec2::splat(0.5)))
        };
        let spots = (0..width * view.height).into_par_iter().map(spot).collect();
        Self { width: view.width, height: view.height, spots }
    }
}

/// The first surface along a camera ray that is mostly not seen through.
pub(crate) fn look(world: &World, mut ray: Ray) -> Option<Spot> {
    for _ in 0..MAX_PASSES {
        let point = world.point(&world.closest_hit(&ray, true)?, ray.direction);
        if world.straight_through(&point, ray.direction).max_element() < 0.5 {
            let (position, normal) = (point.position, point.geometric_normal);
            return Some(Spot { position, normal, material: point.material });
        }
        ray.origin = offset_origin(point.position, -point.geometric_normal);
    }
    None
}

/// The surface seen at a place of the picture, both coordinates in `[0,1]`.
pub(crate) fn look_at_place(world: &World, view: &View, place: Vec2) -> Option<Spot> {
    let pixel = place * Vec2::new(view.width as f32, view.height as f32);
    look(world, view.rays().ray(pixel, Vec2::splat(0.5)))
}
