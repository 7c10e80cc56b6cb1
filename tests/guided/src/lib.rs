//! What the coverage-guided targets share. Inputs are read and judged by the code of `tests/fuzz`.

#[path = "../../fuzz/corpus.rs"]
#[allow(dead_code, reason = "command lines are no target")]
mod corpus;
#[cfg(target_arch = "x86_64")]
mod cpp;
mod gltf;
mod kept;
mod memory;
#[path = "../../fuzz/mutate.rs"]
#[allow(dead_code, reason = "most is left to libFuzzer")]
mod mutate;
#[path = "../../suite/packed.rs"]
#[allow(dead_code, reason = "only what is packed is needed")]
mod packed;
#[path = "../../fuzz/read.rs"]
mod read;
mod seeds;
#[cfg(feature = "window")]
#[path = "../../fuzz/settings.rs"]
mod settings;
#[path = "../../suite/shared.rs"]
#[allow(dead_code, reason = "only random numbers are needed")]
mod shared;
mod targets;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

pub use gltf::mutate_gltf;
use read::Found;

/// Memory an input may take beside four times its honest size, as in `tests/fuzz`.
const ALLOWANCE_BYTES: u64 = 64 << 20;

/// A folder in memory, where there is one: some targets read files.
static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let memory = PathBuf::from("/dev/shm");
    let above = if memory.is_dir() { memory } else { std::env::temp_dir() };
    remove_left_over(&above);
    let folder = above.join(format!("{FOLDER_NAME}{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a folder");
    folder
});

const FOLDER_NAME: &str = "lightgrid-guided-";

/// Removes folders of processes that are gone: libFuzzer ends its own without a word.
fn remove_left_over(above: &Path) {
    let entries = fs::read_dir(above).into_iter().flatten().flatten();
    for folder in entries.map(|entry| entry.path()) {
        let name = folder.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        let Some(process) = name.strip_prefix(FOLDER_NAME) else { continue };
        if Path::new("/proc/self").exists() && !Path::new("/proc").join(process).exists() {
            // Another may have been faster.
            let _ = fs::remove_dir_all(&folder);
        }
    }
}

/// Fills a target's empty corpus before it is read.
pub fn begin(target: &str) {
    // All work on this thread: what an input takes is then known, and nobody waits for others.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread();
    pool.build_global().expect("the first pool");
    let corpus = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("corpus").join(target);
    fs::create_dir_all(&corpus).expect("a folder");
    if fs::read_dir(&corpus).expect("a folder").next().is_none() {
        let kept = kept::all().into_iter().filter(|(of, _)| *of == target);
        let inputs = seeds::of(target).into_iter().chain(kept.map(|(_, input)| input.to_vec()));
        for (number, input) in inputs.enumerate() {
            fs::write(corpus.join(format!("seed-{number}")), input).expect("written");
        }
    }
}

/// Reads an input. Whatever is wrong with what comes of it is a panic.
pub fn judge(target: &str, bytes: &[u8]) {
    let before = memory::watch();
    let found = targets::read(target, bytes, &FOLDER).expect("a target");
    let asked = memory::peak().saturating_sub(before);
    let length = bytes.len() as u64;
    let honest = match found {
        Found::Accepted { honest_bytes, is_sound } => {
            assert!(is_sound, "accepted, but out of bounds");
            length.max(honest_bytes)
        }
        Found::Refused(sentence) => {
            assert!(!sentence.is_empty() && !sentence.contains('\n'), "refused with {sentence:?}");
            length
        }
    };
    let most = 4 * honest + ALLOWANCE_BYTES;
    if asked > most {
        let again = || drop(targets::read(target, bytes, &FOLDER));
        let taken = memory::resident(again).unwrap_or(asked);
        assert!(taken <= most, "took {taken} bytes, and its honest size is {honest}");
    }
}
