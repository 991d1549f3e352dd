//! `.step` and `.dc` as written.

use super::{Expr, Name};
use crate::diagnostic::Span;

/// One quantity and the values it takes.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// What changes.
    pub target: Target,
    /// Through which values.
    pub points: Points,
    /// From the target to the last value.
    pub span: Span,
}

/// What a sweep changes.
#[derive(Debug, Clone, PartialEq)]
pub enum Target {
    /// `param name`.
    Param(Name),
    /// `v1`: the DC value of a source, or a resistance.
    Element(Name),
    /// `npn 2n2222(bf)`: a parameter of a model, which is not of the top level where this is left.
    Model(Name, Name),
    /// `temp`.
    Temperature(Span),
}

impl Target {
    /// The name of a parameter, or of an element.
    pub(crate) fn name(&self) -> Option<&Name> {
        match self {
            Self::Param(name) | Self::Element(name) => Some(name),
            Self::Model(..) | Self::Temperature(_) => None,
        }
    }
}

impl Points {
    /// The first value.
    pub(crate) fn first(&self) -> Option<&Expr> {
        match self {
            Self::Linear([first, ..])
            | Self::Logarithmic {
                range: [first, ..], ..
            } => Some(first),
            Self::List(list) => list.first(),
        }
    }
}

/// The values of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub enum Points {
    /// `start stop increment`.
    Linear([Expr; 3]),
    /// `dec start stop n`, `oct start stop n`: n values per factor of ten or two.
    Logarithmic {
        /// 10 or 2.
        base: u32,
        /// `start stop n`.
        range: [Expr; 3],
    },
    /// `list a b c …`.
    List(Vec<Expr>),
}

/// `.ac dec 10 1 1meg`.
#[derive(Debug, Clone, PartialEq)]
pub struct Frequencies {
    /// How the frequencies follow each other.
    pub spacing: Spacing,
    /// A number of points, the first and the last frequency; of a list the frequencies, Hz.
    pub values: Vec<Expr>,
    /// The whole card.
    pub span: Span,
}

/// How frequencies follow each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spacing {
    /// So many points in all, with equal distances.
    Linear,
    /// So many points in each step by this factor: 10 or 2.
    Logarithmic(u32),
    /// One by one.
    List,
}
