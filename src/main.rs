//! The `lightgrid` binary: everything is in the library's [`lightgrid::cli`].

fn main() -> std::process::ExitCode {
    #[cfg(target_os = "linux")]
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // Outside a desktop session Mesa's Vulkan layer would complain on stderr that Wayland, which
        // it asks for the preferred device, is not there.
        // SAFETY: no other thread runs yet.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
    lightgrid::cli::main()
}
