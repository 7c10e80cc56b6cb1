//! In the place of the codec where the feature `meshopt` is not built in.

use super::packed::Packed;
use crate::scene::gltf::limits::Fallible;

pub(super) fn decode(_: &Packed, _: &[u8], _: &mut [u8]) -> Fallible<()> {
    Err("it needs meshopt, which this lightgrid was built without (feature `meshopt`)".into())
}
