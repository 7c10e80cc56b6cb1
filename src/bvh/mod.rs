//! What a ray hits: an eight-wide bounding volume hierarchy over triangles and instances.
//!
//! Watertight: a ray that starts inside a closed mesh of shared vertices hits it. Hits are the same
//! bits on all machines: neither the vector instructions in use nor the shape of the tree matters.

mod build;
pub(crate) mod compressed;
mod instance;
mod items;
mod lanes;
mod ray;
mod traverse;
mod tree;
mod triangle;
mod weighing;
mod wide;

#[cfg(target_arch = "x86_64")]
mod avx2;

pub(crate) use instance::InstanceWords;
pub use instance::{Instance, Shared};
pub use ray::{Hit, Ray, offset_origin};
pub use tree::Bvh;
