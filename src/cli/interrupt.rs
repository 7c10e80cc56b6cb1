//! Ctrl-C: once to finish early and keep what is done, twice to leave at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A flag that becomes true at the first Ctrl-C (or termination request), if nobody else has set it
/// before; the second one ends the process with status 130. What will happen is said when it does.
pub(super) fn flag(what: &'static str) -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let handler = Arc::clone(&flag);
    let was_asked = AtomicBool::new(false);
    let set = ctrlc::set_handler(move || {
        if was_asked.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        handler.store(true, Ordering::Relaxed);
        eprintln!("\nlightgrid: {what} (again: leave now)");
    });
    if set.is_err() {
        eprintln!("lightgrid: Ctrl-C cannot be caught here and will end the process at once");
    }
    flag
}
