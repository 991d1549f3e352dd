//! The command `circ`: parses arguments, runs, returns the exit status.

use std::process::ExitCode;

/// Modes and their reductions are many small allocations.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    circ::cli::main().into()
}
