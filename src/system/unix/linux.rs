//! Linux.

use std::fs;
use std::ops::Range;
use std::path::Path;

/// Prepares the process, of which no other thread runs yet.
pub(crate) fn prepare_process() {
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // Outside a desktop session Mesa's Vulkan layer would complain on stderr that Wayland, which
        // it asks for the preferred device, is not there.
        // SAFETY: no other thread runs yet.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}

/// The least of what the machine, this process' address space and its control group have left; `None`
/// where nothing is known.
pub(crate) fn available_memory() -> Option<u64> {
    let machine = kilobytes("/proc/meminfo", "MemAvailable:");
    [machine, address_space(), control_group()].into_iter().flatten().min()
}

/// The number after a name in one of the kernel's lists, which count in 1024 bytes.
fn kilobytes(file: &str, name: &str) -> Option<u64> {
    let text = fs::read_to_string(file).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse::<u64>().ok()?.checked_mul(1024)
}

/// What `ulimit -v` leaves.
fn address_space() -> Option<u64> {
    let limits = fs::read_to_string("/proc/self/limits").ok()?;
    let line = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    let limit: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(limit.saturating_sub(kilobytes("/proc/self/status", "VmSize:")?))
}

/// What the limits of a container, a batch system or a service leave: those of this process' own group and of all
/// that it is in.
fn control_group() -> Option<u64> {
    const ALL: &str = "/sys/fs/cgroup";
    let own = fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    let own = own.lines().find_map(|line| line.strip_prefix("0::/")).unwrap_or_default();
    let own = Path::new(ALL).join(own);
    let groups = own.ancestors().take_while(|group| group.starts_with(ALL));
    groups.filter_map(left_in_group).min()
}

/// Bytes left in a control group. The page cache is not counted as used: the kernel drops it first.
fn left_in_group(group: &Path) -> Option<u64> {
    let read = |name| fs::read_to_string(group.join(name)).ok();
    let number = |name| read(name)?.trim().parse::<u64>().ok();
    let (limit, used) = (number("memory.max")?, number("memory.current")?);
    let files = read("memory.stat")?;
    let files = files.lines().find_map(|line| line.strip_prefix("inactive_file "))?;
    Some(limit.saturating_sub(used.saturating_sub(files.parse().ok()?)))
}

/// Arenas of the GNU allocator: what works on pixels seldom asks it for memory.
#[cfg(target_env = "gnu")]
const MAX_ARENAS: libc::c_int = 2;
/// Bytes of an array that is given back as soon as it is freed.
#[cfg(target_env = "gnu")]
const LARGE: libc::c_int = 16 << 20;

/// Has large arrays, such as films, given back to the system as soon as they are freed. The GNU allocator
/// would take the first one as a sign to keep those of up to 32 MiB, two to an arena, which then is seldom
/// empty; and there would be up to eight arenas for each core.
pub(crate) fn return_large_arrays() {
    #[cfg(target_env = "gnu")]
    // SAFETY: numbers for the allocator, which may be set at any time.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, LARGE);
        libc::mallopt(libc::M_ARENA_MAX, MAX_ARENAS);
    }
}

/// Gives back to the system what was freed between small things that are still in use: scenes, programs of
/// a software device. Without it a window that shows one scene after another grows by as much as they
/// leave in pieces.
pub(crate) fn return_freed() {
    #[cfg(target_env = "gnu")]
    // SAFETY: it may be called at any time, by any thread.
    unsafe {
        libc::malloc_trim(0);
    }
}

/// Asks for huge pages behind memory that has not been touched yet, and that one allocation owns.
pub(crate) fn advise_huge_pages(memory: Range<usize>) {
    // As large as pages are anywhere.
    const PAGE: usize = 1 << 16;
    let start = memory.start.next_multiple_of(PAGE);
    if memory.end > start {
        // SAFETY: advice changes no contents. A refusal is harmless.
        unsafe {
            libc::madvise(start as *mut libc::c_void, memory.end - start, libc::MADV_HUGEPAGE)
        };
    }
}

/// Lets other threads go first: those of the window before those that render.
pub(crate) fn lower_thread_priority() {
    // SAFETY: plain system call; 0 names the calling thread, and failing is harmless.
    unsafe { libc::setpriority(libc::PRIO_PROCESS, 0, 5) };
}
