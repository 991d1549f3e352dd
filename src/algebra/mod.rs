//! Exact numbers and the class-ordered elimination written once over them.
//!
//! Which column can be a pivot is decided without a tolerance (DESIGN 3); [`Value`] is a number as the netlist wrote it.

mod value;

pub use value::Value;
