//! Asking for memory before it is needed.

/// Has the processor fetch a value while it does something else; nothing where it cannot.
pub(crate) fn prefetch<T>(value: &T) {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: a hint, without effect on what the program does, at the address of a reference.
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(value).cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = value;
}

/// The same for numbers of about a cache line, which may lie in two.
pub(crate) fn prefetch_ends<T>(values: &[T]) {
    values.first().into_iter().chain(values.last()).for_each(prefetch);
}
