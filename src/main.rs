//! The `lightgrid` binary: everything is in the library's [`lightgrid::cli`].

use lightgrid::cli::Allocator;

#[global_allocator]
static ALLOCATOR: Allocator = Allocator;

fn main() -> std::process::ExitCode {
    lightgrid::cli::main()
}
