//! Where the shared test data lies, how its absence is said, how much is tried, and how an .exr begins.

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

/// How much is tried: in seconds, or where `LIGHTGRID_NIGHTLY` is set as long as that takes.
pub(crate) fn count(quick: u64, nightly: u64) -> u64 {
    if std::env::var_os("LIGHTGRID_NIGHTLY").is_some() { nightly } else { quick }
}

/// What an .exr begins with: half floats in scan lines, not compressed. Channels have names and, of pixels, one
/// in so many each way; the windows of data and of what is seen end at these pixels.
pub(crate) fn exr_header(channels: &[(&str, u8)], data: [u32; 2], display: [u32; 2]) -> Vec<u8> {
    let mut file = vec![0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0];
    let mut attribute = |name: &str, kind: &str, value: &[u8]| {
        file.extend(name.bytes().chain([0]).chain(kind.bytes()).chain([0]));
        file.extend((value.len() as u32).to_le_bytes());
        file.extend(value);
    };
    let mut list = Vec::new();
    for &(name, step) in channels {
        list.extend(name.bytes());
        list.extend([0, 1, 0, 0, 0, 0, 0, 0, 0, step, 0, 0, 0, step, 0, 0, 0]);
    }
    list.push(0);
    attribute("channels", "chlist", &list);
    attribute("compression", "compression", &[0]);
    let window = |[x, y]: [u32; 2]| [0, 0, x, y].map(u32::to_le_bytes).concat();
    attribute("dataWindow", "box2i", &window(data));
    attribute("displayWindow", "box2i", &window(display));
    attribute("lineOrder", "lineOrder", &[0]);
    attribute("pixelAspectRatio", "float", &1.0_f32.to_le_bytes());
    attribute("screenWindowCenter", "v2f", &[0; 8]);
    attribute("screenWindowWidth", "float", &1.0_f32.to_le_bytes());
    file.push(0);
    file
}
