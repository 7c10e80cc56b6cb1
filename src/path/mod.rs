//! The path tracing loop: random numbers in, radiance out.
//!
//! A path is a chain of vertices on surfaces and in media. At each of at most `bounces` vertices
//! light is gathered by next event estimation (NEE) from the environment map, and from local lights
//! if there are any, and the path goes on in a direction the BSDF or the phase function chooses; what
//! a path then runs into counts with the balance heuristic. Perfect reflections and refractions scatter
//! nothing and are not counted among these vertices. Alpha and smooth thin glass are passed
//! straight through, by paths and shadow rays alike, and are no vertices: so NEE and BSDF sampling see
//! the same light behind a pane. Smooth solid glass refracts both (`shadows`).

mod aim;
pub(crate) mod aim_targets;
pub mod background;
mod body;
pub(crate) mod cached;
pub mod camera;
mod draw;
pub mod framing;
mod gather;
mod learn;
pub(crate) mod light_tree;
mod lights;
pub(crate) mod limits;
pub(crate) mod lit_targets;
mod looks;
mod materials;
mod ray_clock;
pub(crate) mod shadows;
pub mod sharing;
pub(crate) mod splitting;
mod tracer;
pub(crate) mod train;
mod triangles;
mod vertex;
mod world;
mod world_builder;

pub use background::Background;
pub(crate) use learn::MAX_COUNTED;
pub use light_tree::Receiver;
pub use lights::{LightChoice, LightSample, LocalLights};
pub use limits::PathLimits;
pub use looks::FirstHit;
pub use tracer::{PathResult, PathTracer};
pub(crate) use train::TRAINING_VERTICES;
pub use world::{Lit, World};
pub use world_builder::WorldBuilder;
