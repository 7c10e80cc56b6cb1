//! The codec.

use meshopt::ffi;

use super::packed::{Filter, Mode, Packed};
use crate::scene::gltf::limits::Fallible;

/// Unpacks `bytes`; `unpacked` has room for as many elements of as many bytes as `packed` says, which are
/// such as the mode and the filter allow.
pub(super) fn decode(packed: &Packed, bytes: &[u8], unpacked: &mut [u8]) -> Fallible<()> {
    let (to, from) = (unpacked.as_mut_ptr().cast(), bytes.as_ptr());
    let (count, stride, length) = (packed.count as usize, packed.byte_stride, bytes.len());
    // SAFETY: `to` has room for `count` elements of `stride` bytes, `from` holds `length` bytes, and
    // the strides are those that the decoders and filters ask for.
    let status = unsafe {
        match packed.mode {
            Mode::Attributes => ffi::meshopt_decodeVertexBuffer(to, count, stride, from, length),
            Mode::Triangles => ffi::meshopt_decodeIndexBuffer(to, count, stride, from, length),
            Mode::Indices => ffi::meshopt_decodeIndexSequence(to, count, stride, from, length),
        }
    };
    if status != 0 {
        return Err("its meshopt data are damaged".into());
    }
    if matches!(packed.mode, Mode::Attributes) {
        // SAFETY: as above.
        unsafe {
            match packed.filter {
                Filter::None => {}
                Filter::Octahedral => ffi::meshopt_decodeFilterOct(to, count, stride),
                Filter::Quaternion => ffi::meshopt_decodeFilterQuat(to, count, stride),
                Filter::Exponential => ffi::meshopt_decodeFilterExp(to, count, stride),
                Filter::Color => ffi::meshopt_decodeFilterColor(to, count, stride),
            }
        }
    }
    Ok(())
}
