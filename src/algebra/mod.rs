//! Exact numbers and the class-ordered elimination written once over them.
//!
//! Which column can be a pivot is decided without a tolerance; [`Value`] is a number as the netlist wrote it.
//! Two fields carry the elimination: [`Ball`], fast, with exact zeros and an error bound, and [`Rational`], exact
//! throughout, which takes over where a ball is too wide and is the oracle in tests. What is done with its result where
//! fractions would grow without bound is done in a [`LongBall`].

mod ball;
mod double;
mod eliminate;
mod field;
mod long;
mod rational;
mod sparse;
mod value;

pub use ball::{Ball, Interval, LongBall};
pub use double::Double;
pub use eliminate::{Elimination, Table};
pub use field::{Digits, Field};
pub use long::Long;
pub use rational::{Rational, rational};
pub(crate) use sparse::add_term;
pub use sparse::{SparseRow, add_scaled, eliminate_sparse, entry, part, sparse, subtract, summed};
pub use value::Value;
