//! What the Light Grid has learned at a place of the picture: which tiles of the map it chooses there.
//!
//!     cargo run --release --no-default-features --example light_grid -- office

#![allow(clippy::print_stdout, reason = "who runs this reads it")]

use std::sync::atomic::AtomicBool;

use glam::Vec2;
use lightgrid::environment::{Environment, EnvironmentOptions};
use lightgrid::error::{Error, Result};
use lightgrid::light_grid::WHOLE_MAP;
use lightgrid::path::{World, framing};
use lightgrid::render::{Phase, Session, View};
use lightgrid::sources;

fn main() -> Result<()> {
    let scene = std::env::args().nth(1).unwrap_or_else(|| "office".to_owned());
    let world = World::new(sources::scene(&scene)?);
    let (map, _) = sources::map("sky:sunset")?;
    let environment = Environment::new(map, &EnvironmentOptions::default())?;
    let camera = framing::frame(&world, 16.0 / 9.0);
    let mut session = Session::new(&world, &environment, View::new(camera, [320, 180]));
    while session.phase() == Phase::Learning {
        session.advance(1, &AtomicBool::new(false))?;
    }

    // What the camera sees in the middle of the picture.
    let ray = session.view().rays().ray(Vec2::new(160.0, 90.0), Vec2::ZERO);
    let hit = world.closest_hit(&ray, true).ok_or_else(|| Error::new("there is only sky"))?;
    let point = world.point(&hit, ray.direction);
    println!("{:?} facing {:?}", point.position, point.geometric_normal);

    let Some(light_grid) = session.grid() else { return Err(Error::new("the map is black")) };
    let cell = light_grid.grid().map(|grid| grid.cell_of(point.position, point.geometric_normal));
    let distribution = cell.map_or(WHOLE_MAP, |cell| light_grid.distribution_of_cell(cell));
    let mut tiles: Vec<(f32, u32)> = (0..environment.tile_count())
        .map(|tile| (light_grid.probability(distribution, tile), tile))
        .collect();
    tiles.sort_by(|a, b| b.0.total_cmp(&a.0));
    println!(
        "cell {cell:?} has distribution {distribution}; its likeliest of {} tiles:",
        tiles.len()
    );
    for (probability, tile) in &tiles[..5] {
        println!("  tile {tile}: {:.1} %", 100.0 * probability);
    }
    Ok(())
}
