//! What reading a file may take, and how its parts say why they cannot be read.

use crate::memory;

/// Most triangles a scene may hold, baked instances counted one by one.
pub(super) const MAX_TRIANGLES: u64 = 200_000_000;

/// Refuses more than so many of something.
pub(super) fn check_count(count: u64, most: u64, there_are: &str, what: &str) -> Fallible<()> {
    match count > most {
        true => Err(format!("{there_are} more than {} million {what}", most / 1_000_000)),
        false => Ok(()),
    }
}

/// Memory is asked for so much at once: in steps, so that many small things do not each ask for it.
const STEP: u64 = 1 << 26;

/// Whether there is memory for so many more bytes of what grows bit by bit.
pub(super) fn check_growth(present: u64, added: u64) -> Fallible<()> {
    let is_asked = present / STEP != present.saturating_add(added) / STEP;
    if is_asked { memory::check(added.max(STEP)) } else { Ok(()) }
}

/// A result whose error is the cause alone; the file's name is put before it in one place.
pub(super) type Fallible<T> = Result<T, String>;
