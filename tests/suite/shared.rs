//! Where the shared test data lies, how its absence is said, how much is tried, random numbers for tests, and
//! how an .exr begins.

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

/// SplitMix64: the same on every machine, and not the renderer's own sampler.
pub(crate) struct SplitMix(pub(crate) u64);

impl SplitMix {
    /// The next 64 bits.
    pub(crate) fn next_bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Below `count`, which is not 0.
    pub(crate) fn below(&mut self, count: usize) -> usize {
        ((u128::from(self.next_bits()) * count as u128) >> 64) as usize
    }

    /// The next f32 in `[0,1)`.
    pub(crate) fn next_f32(&mut self) -> f32 {
        (self.next_bits() >> 40) as f32 / (1u64 << 24) as f32
    }

    /// The next f64 in `[0,1)`.
    pub(crate) fn next_f64(&mut self) -> f64 {
        (self.next_bits() >> 11) as f64 / (1u64 << 53) as f64
    }
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
