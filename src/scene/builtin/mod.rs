//! Scenes made by code: places to render without any file.
//!
//! | name | what it is | light |
//! |---|---|---|
//! | `living-room` | furnished room | a large window that the sun enters, a round opening |
//! | `evening` | the same room | its lamps, and the window |
//! | `office` | closed office | two small windows, 3 % of the walls, no direct sun |
//! | `bathroom` | bathroom with a mirror | double glazing that the sun enters, lamps in globes of glass |
//! | `exterior` | a street with arcade, trees and a café | the sky, partly occluded |
//! | `fog` | the same street along its lamps, in mist | as `exterior`, scattered on its way |
//! | `open` | sculptures on a terrace | the whole sky, nothing occludes |
//! | `materials` | a still life with every kind of material | the sky, a wall behind |
//! | `crack` | brick store room | a slit of 1.5 m x 2 cm |

mod bathroom;
mod crack;
mod curved;
mod desktop;
mod facade;
mod fittings;
mod furniture;
mod lamps;
mod living_room;
mod materials;
mod mesh;
mod objects;
mod office;
mod open;
mod plants;
mod reliefs;
mod room;
mod seating;
mod still_life;
mod street;
mod tableware;
mod tangents;
mod textures;

use std::sync::LazyLock;

use crate::error::{Error, Result};
use crate::scene::Scene;

/// The scene shown when none is asked for.
pub const DEFAULT_SCENE: &str = "living-room";

/// Name, default sky and builder of a scene.
type BuiltIn = (&'static str, &'static str, fn(&str) -> Scene);

static SCENES: [BuiltIn; 9] = [
    ("living-room", "sky:day", |name| living_room::build(name, [0.0; 3])),
    // `sky:night` adds less than a thousandth of the light of a wall by the window.
    ("evening", "sky:night", |name| living_room::build(name, [0.6, 25.0, 40.0])),
    ("office", "sky:day", |_| office::build()),
    ("bathroom", "sky:day", |_| bathroom::build()),
    ("exterior", "sky:day", |_| street::exterior()),
    ("fog", "sky:sunset", |_| street::fog()),
    ("open", "sky:day", |_| open::build()),
    ("materials", "sky:hallway", |_| still_life::build()),
    ("crack", "sky:day", |_| crack::build()),
];

fn find(name: &str) -> Option<&'static BuiltIn> {
    SCENES.iter().find(|scene| scene.0 == name)
}

/// Names of the built-in scenes.
pub fn names() -> &'static [&'static str] {
    static NAMES: LazyLock<Vec<&str>> =
        LazyLock::new(|| SCENES.iter().map(|scene| scene.0).collect());
    &NAMES
}

/// The default built-in sky of a scene, built in or not.
pub fn sky(name: &str) -> &'static str {
    find(name).map_or("sky:day", |scene| scene.1)
}

/// Builds the scene called `name`; an error lists the names there are.
pub fn build(name: &str) -> Result<Scene> {
    let (.., build) = find(name).ok_or_else(|| {
        let names = names().join(", ");
        Error::new(format!("there is no built-in scene called \"{name}\"; there are {names}"))
    })?;
    Ok(build(name))
}
