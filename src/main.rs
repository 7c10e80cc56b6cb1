//! The `lightgrid` binary: everything is in the library's [`lightgrid::cli`].

#[cfg(unix)]
mod refused {
    //! Where memory is short and nobody has asked for it before, libraries abort or panic. That is no fault of the
    //! program, which ends as it does for any other cause: with a sentence.

    use std::alloc::{GlobalAlloc, Layout, System};
    use std::io::Write;
    use std::sync::atomic::{AtomicBool, Ordering};

    /// Whether the system has refused memory.
    static REFUSED: AtomicBool = AtomicBool::new(false);

    /// The system's allocator, with its refusals noted: some callers take them as an answer.
    struct Noting;

    #[global_allocator]
    static ALLOCATOR: Noting = Noting;

    /// Who asks for less takes no refusal for an answer.
    const SMALL: usize = 64 << 10;

    /// More than a thread needs, and less than anything goes on with.
    const LITTLE: usize = 4 << 20;

    /// More of the stack than commands use in the main thread.
    const STACK: usize = 1 << 20;

    fn noted(memory: *mut u8, size: usize) -> *mut u8 {
        if memory.is_null() {
            REFUSED.store(true, Ordering::Relaxed);
            // Telling of a fault takes memory too, and under a lock, for which a second fault would wait.
            if size < SMALL || std::thread::panicking() || lightgrid::cli::is_refusal_the_end() {
                end(size);
            }
        }
        memory
    }

    /// Ends the process as an error, in words that take no memory.
    fn end(size: usize) -> ! {
        // Other threads may have been refused memory, too: one of them says so.
        while !lightgrid::cli::has_last_word() {
            // SAFETY: it only waits.
            unsafe { libc::pause() };
        }
        lightgrid::cli::remove_unfinished();
        let mut words = [0; 80];
        let mut rest = &mut words[..];
        let _ = writeln!(rest, "lightgrid: memory is short: {size} bytes more cannot be had");
        let left = rest.len();
        // SAFETY: so much of `words` is there. Nobody can be told if it cannot be written.
        unsafe {
            let _ = libc::write(libc::STDERR_FILENO, words.as_ptr().cast(), words.len() - left);
            libc::_exit(1)
        }
    }

    // SAFETY: all is left to the system's allocator, and noting takes no memory.
    unsafe impl GlobalAlloc for Noting {
        unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
            // SAFETY: as the caller promises.
            noted(unsafe { System.alloc(layout) }, layout.size())
        }

        unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
            // SAFETY: as the caller promises.
            noted(unsafe { System.alloc_zeroed(layout) }, layout.size())
        }

        unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
            // SAFETY: as the caller promises.
            noted(unsafe { System.realloc(memory, layout, size) }, size)
        }

        unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
            // SAFETY: as the caller promises.
            unsafe { System.dealloc(memory, layout) }
        }
    }

    /// Ends the process: as an error if memory was refused, else as an abort.
    extern "C" fn on_abort(signal: libc::c_int) {
        // SAFETY: these may be called from a handler. The signal comes again when it returns.
        unsafe {
            if REFUSED.load(Ordering::Relaxed) {
                lightgrid::cli::remove_unfinished();
                libc::_exit(1);
            }
            libc::signal(signal, libc::SIG_DFL);
            libc::raise(signal);
        }
    }

    /// Whether so much cannot be had.
    fn is_short(bytes: usize) -> bool {
        let (flags, rights) =
            (libc::MAP_PRIVATE | libc::MAP_ANONYMOUS, libc::PROT_READ | libc::PROT_WRITE);
        // SAFETY: nothing else is there, and it is given back at once.
        unsafe {
            let memory = libc::mmap(std::ptr::null_mut(), bytes, rights, flags, -1, 0);
            memory == libc::MAP_FAILED || libc::munmap(memory, bytes) != 0
        }
    }

    /// Has the main thread's stack grow now: where the system refuses that later, it kills the process without
    /// a word.
    #[inline(never)]
    fn take_stack(bytes: usize) {
        const STEP: usize = 16 << 10;
        std::hint::black_box(&mut [0_u8; STEP]);
        if let Some(left) = bytes.checked_sub(STEP) {
            take_stack(left);
        }
        // Nothing is returned from here at once, or there would be but one frame.
        std::hint::black_box(bytes);
    }

    /// What the main thread may have for its stack.
    fn most_stack() -> usize {
        let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
        // SAFETY: the limit is written there.
        unsafe { libc::getrlimit(libc::RLIMIT_STACK, &raw mut limit) };
        usize::try_from(limit.rlim_cur).unwrap_or(usize::MAX)
    }

    pub(super) fn is_an_error() {
        let stack = STACK.min(most_stack() / 4);
        if is_short(stack) {
            end(stack);
        }
        take_stack(stack);
        let tell = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            // Stacks of threads are not the allocator's, and starting one panics where there is no room for it.
            if lightgrid::cli::is_refusal_the_end() && is_short(LITTLE) {
                end(LITTLE);
            }
            tell(panic);
        }));
        let handler = on_abort as extern "C" fn(libc::c_int);
        // SAFETY: the handler calls nothing that may not be called from one.
        unsafe {
            libc::signal(libc::SIGABRT, handler as libc::sighandler_t);
        }
    }
}

fn main() -> std::process::ExitCode {
    #[cfg(unix)]
    refused::is_an_error();
    #[cfg(target_os = "linux")]
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // Outside a desktop session Mesa's Vulkan layer would complain on stderr that Wayland, which
        // it asks for the preferred device, is not there.
        // SAFETY: no other thread runs yet.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
    lightgrid::cli::main()
}
