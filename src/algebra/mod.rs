//! Exact numbers and the class-ordered elimination written once over them.
//!
//! Which column can be a pivot is decided without a tolerance (DESIGN 3); [`Value`] is a number as the netlist wrote it.

mod ball;
mod eliminate;
mod field;
mod rational;
mod value;

pub use ball::Ball;
pub use eliminate::{Matrix, eliminate, eliminate_more};
pub use field::Field;
pub use rational::Rational;
pub use value::Value;
