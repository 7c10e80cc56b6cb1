//! The `lightgrid` binary: everything is in the library's [`lightgrid::cli`].

fn main() -> std::process::ExitCode {
    lightgrid::cli::main()
}
