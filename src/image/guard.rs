//! Decoders of other people panic on some damaged files; here such a panic becomes a value.

use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;

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
