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

use crate::error::{Error, Result};
use crate::scene::Scene;

/// The scene shown when none is asked for.
pub const DEFAULT_SCENE: &str = "living-room";

/// Names of the built-in scenes.
pub fn names() -> &'static [&'static str] {
    &[
        "living-room",
        "evening",
        "office",
        "bathroom",
        "exterior",
        "fog",
        "open",
        "materials",
        "crack",
    ]
}

/// The default built-in sky of a scene, built in or not.
pub fn sky(name: &str) -> &'static str {
    match name {
        "evening" => "sky:night",
        "fog" => "sky:sunset",
        "materials" => "sky:hallway",
        _ => "sky:day",
    }
}

/// Builds the scene called `name`; an error lists the names there are.
pub fn build(name: &str) -> Result<Scene> {
    match name {
        "living-room" => Ok(living_room::build(name, [0.0; 3])),
        // `sky:night` adds less than a thousandth of the light of a wall by the window.
        "evening" => Ok(living_room::build(name, [0.6, 25.0, 40.0])),
        "office" => Ok(office::build()),
        "bathroom" => Ok(bathroom::build()),
        "exterior" => Ok(street::exterior()),
        "fog" => Ok(street::fog()),
        "open" => Ok(open::build()),
        "materials" => Ok(still_life::build()),
        "crack" => Ok(crack::build()),
        _ => Err(Error::new(format!(
            "there is no built-in scene called \"{name}\"; there are {}",
            names().join(", ")
        ))),
    }
}
