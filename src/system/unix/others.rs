//! What is asked of a system of which nothing more is known.

use std::ops::Range;

/// Nothing has to be prepared.
pub(crate) fn prepare_process() {}

/// Not known.
pub(crate) fn available_memory() -> Option<u64> {
    None
}

/// Left to the allocator.
pub(crate) fn return_large_arrays() {}

/// Left to the allocator.
pub(crate) fn return_freed() {}

/// Left to the system.
pub(crate) fn advise_huge_pages(_: Range<usize>) {}

/// Left to the system.
pub(crate) fn lower_thread_priority() {}
