//! Asking for memory before taking it: a program that is refused memory ends, one that asks can say so.

use std::cell::Cell;
#[cfg(target_os = "linux")]
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use crate::error::Decoded;

/// What is got without asking.
const SMALL: u64 = 16 << 20;

/// Whether memory that is refused ends the process, unless somebody asks.
static REFUSAL_ENDS: AtomicBool = AtomicBool::new(false);

thread_local! {
    /// Whether this thread takes a refusal for an answer.
    static ASKS: Cell<bool> = const { Cell::new(false) };
}

/// From now on memory that is refused ends the process, unless it is asked for by [`reserved`]. Some libraries
/// panic at a refusal, others abort, and a command has nothing to go on with, as a window has.
pub(crate) fn refusal_ends() {
    REFUSAL_ENDS.store(true, Ordering::Relaxed);
}

/// Whether nobody would take a refusal of memory for an answer. Takes none itself.
pub(crate) fn is_refusal_the_end() -> bool {
    REFUSAL_ENDS.load(Ordering::Relaxed) && !ASKS.get()
}

/// Whether this thread says why the process ends: the first that asks. Others may have failed for the same cause, and
/// have nothing to add. Takes no memory.
pub(crate) fn has_last_word() -> bool {
    /// Where something lies that the speaker alone has.
    static SPEAKER: AtomicUsize = AtomicUsize::new(0);
    let own = ASKS.with(|asks| std::ptr::from_ref(asks).addr());
    match SPEAKER.compare_exchange(0, own, Ordering::Relaxed, Ordering::Relaxed) {
        Ok(_) => true,
        Err(speaker) => speaker == own,
    }
}

/// Whether so many more bytes can be had, as far as the system says.
///
/// # Errors
/// A cause with both numbers.
pub(crate) fn check(needed: u64) -> Decoded<()> {
    // Asking takes longer than getting so little.
    if needed < SMALL {
        return Ok(());
    }
    match available() {
        Some(left) if needed > left => {
            Err(format!("needs {} of memory, and {} are left", in_units(needed), in_units(left)))
        }
        _ => Ok(()),
    }
}

/// An empty list with room for `count` elements.
///
/// # Errors
/// As [`check`].
pub(crate) fn reserved<T>(count: u64) -> Decoded<Vec<T>> {
    let bytes = count.saturating_mul(size_of::<T>() as u64);
    check(bytes)?;
    let mut list = Vec::new();
    ASKS.set(true);
    let reserved = usize::try_from(count).ok().map(|count| list.try_reserve_exact(count));
    ASKS.set(false);
    reserved
        .and_then(Result::ok)
        .ok_or_else(|| format!("needs {} of memory, which cannot be had", in_units(bytes)))?;
    Ok(list)
}

/// `count` copies of an element.
///
/// # Errors
/// As [`check`].
pub(crate) fn filled<T: Clone>(count: u64, value: T) -> Decoded<Vec<T>> {
    let mut list = reserved(count)?;
    list.resize(count as usize, value);
    Ok(list)
}

/// Arenas of the GNU allocator: what works on pixels seldom asks it for memory.
#[cfg(all(feature = "window", target_os = "linux", target_env = "gnu"))]
const MAX_ARENAS: libc::c_int = 2;

/// Has large arrays, such as films, given back to the system as soon as they are freed. The GNU allocator
/// would take the first one as a sign to keep those of up to 32 MiB, two to an arena, which then is seldom
/// empty; and there would be up to eight arenas for each core.
#[cfg(feature = "window")]
pub(crate) fn return_large_arrays() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: numbers for the allocator, which may be set at any time.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, SMALL as libc::c_int);
        libc::mallopt(libc::M_ARENA_MAX, MAX_ARENAS);
    }
}

/// Gives back to the system what was freed between small things that are still in use: scenes, programs of
/// a software device. Without it a window that shows one scene after another grows by as much as they
/// leave in pieces.
#[cfg(feature = "window")]
pub(crate) fn return_freed() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: it may be called at any time, by any thread.
    unsafe {
        libc::malloc_trim(0);
    }
}

/// Bytes in the largest unit that leaves a whole number of some size.
fn in_units(bytes: u64) -> String {
    match bytes {
        0..10_000 => format!("{bytes} bytes"),
        10_000..10_000_000 => format!("{} kB", bytes / 1000),
        10_000_000..10_000_000_000 => format!("{} MB", bytes / 1_000_000),
        _ => format!("{:.1} GB", bytes as f64 / 1e9),
    }
}

/// The least of what the machine, this process' address space and its control group have left; `None`
/// where nothing is known.
#[cfg(target_os = "linux")]
fn available() -> Option<u64> {
    let machine = kilobytes("/proc/meminfo", "MemAvailable:");
    [machine, address_space(), control_group()].into_iter().flatten().min()
}

#[cfg(not(target_os = "linux"))]
fn available() -> Option<u64> {
    None
}

/// The number after a name in one of the kernel's lists, which count in 1024 bytes.
#[cfg(target_os = "linux")]
fn kilobytes(file: &str, name: &str) -> Option<u64> {
    let text = std::fs::read_to_string(file).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse::<u64>().ok()?.checked_mul(1024)
}

/// What `ulimit -v` leaves.
#[cfg(target_os = "linux")]
fn address_space() -> Option<u64> {
    let limits = std::fs::read_to_string("/proc/self/limits").ok()?;
    let line = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    let limit: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(limit.saturating_sub(kilobytes("/proc/self/status", "VmSize:")?))
}

/// What the limits of a container, a batch system or a service leave: those of this process' own group and of all
/// that it is in.
#[cfg(target_os = "linux")]
fn control_group() -> Option<u64> {
    const ALL: &str = "/sys/fs/cgroup";
    let own = std::fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    let own = own.lines().find_map(|line| line.strip_prefix("0::/")).unwrap_or_default();
    let own = Path::new(ALL).join(own);
    let groups = own.ancestors().take_while(|group| group.starts_with(ALL));
    groups.filter_map(left_in_group).min()
}

/// What is left in one; pages of files that were read do not count, for they go first.
#[cfg(target_os = "linux")]
fn left_in_group(group: &Path) -> Option<u64> {
    let read = |name| std::fs::read_to_string(group.join(name)).ok();
    let number = |name| read(name)?.trim().parse::<u64>().ok();
    let (limit, used) = (number("memory.max")?, number("memory.current")?);
    let files = read("memory.stat")?;
    let files = files.lines().find_map(|line| line.strip_prefix("inactive_file "))?;
    Some(limit.saturating_sub(used.saturating_sub(files.parse().ok()?)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_had_is_refused_with_the_numbers() {
        let refusal = reserved::<[f32; 3]>(1 << 50).unwrap_err();
        assert!(refusal.starts_with("needs 13510798.9 GB of memory, and "), "{refusal}");
        assert!(refusal.ends_with(" are left"), "{refusal}");
        assert_eq!(filled(3, 7), Ok(vec![7; 3]));
        assert!(reserved::<u64>(u64::MAX).is_err());
    }

    #[test]
    fn one_thread_has_the_last_word() {
        let all = std::sync::Barrier::new(8);
        let asked_twice = || {
            let answers = [has_last_word(), has_last_word()];
            // Nobody leaves before: where one thread lay another could lie.
            all.wait();
            answers
        };
        let answers = std::thread::scope(|scope| {
            let threads = [0; 8].map(|_| scope.spawn(asked_twice));
            threads.map(|thread| thread.join().expect("no panic"))
        });
        let spoke = answers.iter().filter(|answers| **answers == [true; 2]).count();
        assert_eq!(spoke, 1, "{answers:?}");
        assert!(answers.iter().all(|[first, second]| first == second));
    }
}
