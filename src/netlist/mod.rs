//! Text to a [`Netlist`]: what the cards say, with the place of every piece. LTspice's schematics are read as the cards they stand for.
//!
//! The reader never stops at the first fault. It knows the dialects of SPICE3, ngspice, LTspice and PSpice; the
//! accepted language is listed in `docs/netlist.md`. Nothing is evaluated here:
//! [`elaborate`](crate::circuit::elaborate) does that.

pub mod ast;
mod block;
pub(crate) mod card;
mod code;
mod control;
mod data;
mod decode;
mod dot;
mod expr;
mod include;
mod lex;
mod operand;
mod read;
mod schematic;
mod stepped;
mod suffix;
pub(crate) mod suggest;
pub mod value;

pub use ast::Netlist;
pub(crate) use code::BUILT_IN;
pub use decode::decode;
pub use expr::expression;
pub use include::Files;
pub use read::{parse, parse_among};

pub use crate::circuit::load::{Loaded, load, load_read};
