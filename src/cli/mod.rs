//! The command line: the only code that prints or opens files of results.

pub mod args;
pub mod exit;
pub mod ngspice;
pub mod output;
mod render;
pub mod streams;

pub use render::render;

/// x
pub fn main() -> exit::Exit { exit::Exit::Done }
