//! The `lightgrid` binary: everything is in the library's [`lightgrid::cli`].

#[cfg(unix)]
mod refused {
    //! Where memory is short and nobody has asked for it before, the standard library says how much was
    //! refused and aborts. That is no fault of the program, which then ends as it does for any other cause.

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

    fn noted(memory: *mut u8, size: usize) -> *mut u8 {
        if memory.is_null() {
            REFUSED.store(true, Ordering::Relaxed);
            // Telling of a fault takes memory too, and under a lock, for which a second fault would wait.
            if size < SMALL || std::thread::panicking() {
                end(size);
            }
        }
        memory
    }

    /// Ends the process as an error, in words that take no memory.
    fn end(size: usize) -> ! {
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
                libc::_exit(1);
            }
            libc::signal(signal, libc::SIG_DFL);
            libc::raise(signal);
        }
    }

    pub(super) fn is_an_error() {
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
