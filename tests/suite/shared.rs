//! Where the shared test data lies, and how its absence is said.

use std::path::PathBuf;

/// A path under the shared data folder (`LIGHTGRID_SHARED`, else `../shared` beside the checkout),
/// or `None` with a message on stderr: the caller then skips.
#[allow(dead_code, reason = "each test module uses what it needs")]
pub(crate) fn shared(relative: &str) -> Option<PathBuf> {
    let root = std::env::var_os("LIGHTGRID_SHARED")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared"), PathBuf::from);
    let path = root.join(relative);
    if path.exists() {
        return Some(path);
    }
    eprintln!("SKIPPED: {} is not there", path.display());
    None
}
