//! macOS.

use std::ops::Range;

/// Nothing has to be prepared.
pub(crate) fn prepare_process() {}

/// Bytes of memory that nobody uses, or that can be taken back without writing them; `None` if the system does not say.
#[expect(deprecated, reason = "a crate more for the name of one function is not worth it")]
pub(crate) fn available_memory() -> Option<u64> {
    // SAFETY: all zero is such a structure; the call writes no more than `count` words of it.
    let (outcome, pages, page) = unsafe {
        let mut pages: libc::vm_statistics64 = std::mem::zeroed();
        let mut count = libc::HOST_VM_INFO64_COUNT;
        let host = libc::mach_host_self();
        let at = (&raw mut pages).cast();
        let outcome = libc::host_statistics64(host, libc::HOST_VM_INFO64, at, &raw mut count);
        (outcome, pages, libc::sysconf(libc::_SC_PAGESIZE))
    };
    let free = [pages.free_count, pages.inactive_count, pages.purgeable_count];
    let page = u64::try_from(page).ok().filter(|_| outcome == libc::KERN_SUCCESS)?;
    Some(page * free.into_iter().map(u64::from).sum::<u64>())
}

/// This system's allocator gives large arrays back as they are freed.
pub(crate) fn return_large_arrays() {}

/// See [`return_large_arrays`].
pub(crate) fn return_freed() {}

/// Apple's processors have no larger pages to ask for.
pub(crate) fn advise_huge_pages(_: Range<usize>) {}

/// Lets other threads go first: those of the window before those that render.
pub(crate) fn lower_thread_priority() {
    let class = libc::qos_class_t::QOS_CLASS_UTILITY;
    // SAFETY: plain system call on the calling thread; failing is harmless.
    unsafe { libc::pthread_set_qos_class_self_np(class, 0) };
}
