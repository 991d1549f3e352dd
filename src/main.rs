//! The command `circ`: parses arguments, runs, returns the exit status.

use std::process::ExitCode;

fn main() -> ExitCode {
    circ::cli::main().into()
}
