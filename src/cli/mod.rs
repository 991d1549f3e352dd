//! The command line.

mod render;

pub use render::render;
