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

/// The same for a few cache lines of numbers.
pub(crate) fn prefetch_all<T>(values: &[T]) {
    const LINE: usize = 64;
    values.chunks((LINE / size_of::<T>().max(1)).max(1)).for_each(|line| prefetch(&line[0]));
    values.last().into_iter().for_each(prefetch);
}
