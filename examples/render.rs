//! Renders a scene under a map into a picture:
//!
//!     cargo run --release --no-default-features --example render -- office sky:sunset office.png

use std::path::Path;
use std::sync::atomic::AtomicBool;

use lightgrid::environment::{Environment, EnvironmentOptions};
use lightgrid::error::Result;
use lightgrid::output::{PictureOptions, write_picture};
use lightgrid::path::{World, framing};
use lightgrid::render::{Driver, Session, StopRule, View};
use lightgrid::sources;

fn main() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let word = |i: usize, default| words.get(i).map_or(default, String::as_str);
    let (scene, map, picture) = (word(0, "office"), word(1, "sky:sunset"), word(2, "office.png"));

    // A file or something built in.
    let world = World::new(sources::scene(scene)?);
    let (map, _) = sources::map(map)?;
    let environment = Environment::new(map, &EnvironmentOptions::default())?;

    let size = [320, 180];
    let camera = world.scene.cameras.first().cloned();
    let camera = camera.unwrap_or_else(|| framing::frame(&world, 16.0 / 9.0));
    let session = Session::new(&world, &environment, View::new(camera, size));

    // It learns first, then adds samples to every pixel.
    let rule = StopRule { samples: Some(16), ..StopRule::default() };
    let (mut driver, never) = (Driver::new(session, rule), AtomicBool::new(false));
    while !driver.step(&never)? {}
    let film = driver.session.film();
    write_picture(Path::new(picture), &PictureOptions::default(), film.into(), Vec::new())
}
