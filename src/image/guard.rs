//! Decoders of other people take much memory for some files, or panic; here such a panic becomes a value.

use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;

use crate::error::Decoded;

/// Most bytes that decoding a picture file of `file_bytes` may take: what deflate, the densest of the
/// codecs in use on real pictures, could make of it (1032 to 1), and some room for tables.
pub(crate) fn decoder_bytes(file_bytes: u64) -> u64 {
    (16 << 20) + file_bytes.saturating_mul(1100)
}

/// Limits of a decoder: pixels a side, bytes, and what a file of `file_bytes` may take.
pub(super) fn limits(side: u32, bytes: u64, file_bytes: u64) -> image::Limits {
    let mut limits = image::Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(side), Some(side));
    limits.max_alloc = Some(bytes.min(decoder_bytes(file_bytes)));
    limits
}

thread_local! {
    static QUIET: Cell<bool> = const { Cell::new(false) };
}

static HOOK: Once = Once::new();

/// What `decode` returns, or `None` if it panicked. Nothing is printed for such a panic; panics of
/// other threads are reported as before.
///
/// `decode` must own what it changes: after a panic that is dropped with it.
pub(crate) fn catch_panic<T>(decode: impl FnOnce() -> T) -> Option<T> {
    HOOK.call_once(|| {
        let previous = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !QUIET.get() {
                previous(info);
            }
        }));
    });
    let outer = QUIET.replace(true);
    let result = panic::catch_unwind(AssertUnwindSafe(decode)).ok();
    QUIET.set(outer);
    result
}

/// What a decoder of others returns, or a sentence if it panics.
pub(super) fn guarded<T>(decode: impl FnOnce() -> Decoded<T>) -> Decoded<T> {
    catch_panic(decode).unwrap_or_else(|| Err("is damaged: its decoder failed".into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_none_and_the_flag_is_restored() {
        assert_eq!(catch_panic(|| 3), Some(3));
        let empty: &[u8] = &[];
        assert_eq!(catch_panic(|| empty[empty.len()]), None);
        assert!(!QUIET.get());
    }
}
