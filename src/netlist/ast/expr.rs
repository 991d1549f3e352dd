//! Expressions as trees.

use std::fmt;

use super::{Name, Signal};
use crate::algebra::Value;
use crate::diagnostic::Span;

/// An expression.
#[derive(Clone, PartialEq)]
pub struct Expr {
    /// What it is.
    pub kind: ExprKind,
    /// Where it stands.
    pub span: Span,
}

/// The kinds of expression.
#[derive(Clone, PartialEq)]
pub enum ExprKind {
    /// A literal.
    Number(Value),
    /// A parameter, formal argument or constant.
    Name(String),
    /// A quoted text or a word that is no number, such as `mfg="KEMET"`.
    Text(String),
    /// A voltage or current of the circuit.
    Signal(Box<Signal>),
    /// A function.
    Call(Box<Name>, Vec<Expr>),
    /// `-x`, `!x`.
    Unary(Unary, Box<Expr>),
    /// `x + y`, …
    Binary(Binary, Box<Expr>, Box<Expr>),
    /// `condition ? then : otherwise`.
    If(Box<[Expr; 3]>),
}

/// Operators of one operand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unary {
    /// −x.
    Minus,
    /// 1 if x is not above one half, else 0 (SPICE's logic: true is above 0.5).
    Not,
}

/// Operators of two operands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Binary {
    /// `+`
    Add,
    /// `-`
    Sub,
    /// `*`
    Mul,
    /// `/`
    Div,
    /// `%`
    Rem,
    /// `^`, `**`
    Pow,
    /// `<`
    Less,
    /// `<=`
    LessEqual,
    /// `>`
    Greater,
    /// `>=`
    GreaterEqual,
    /// `==`
    Equal,
    /// `!=`, `<>`
    NotEqual,
    /// `&&`, `&`
    And,
    /// `||`, `|`
    Or,
}

impl Binary {
    /// As it is written.
    #[must_use]
    pub const fn symbol(self) -> &'static str {
        match self {
            Self::Add => "+",
            Self::Sub => "-",
            Self::Mul => "*",
            Self::Div => "/",
            Self::Rem => "%",
            Self::Pow => "^",
            Self::Less => "<",
            Self::LessEqual => "<=",
            Self::Greater => ">",
            Self::GreaterEqual => ">=",
            Self::Equal => "==",
            Self::NotEqual => "!=",
            Self::And => "&&",
            Self::Or => "||",
        }
    }
}

impl fmt::Display for Expr {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.kind {
            ExprKind::Number(value) => {
                let text = format!("{:?}", value.f64);
                f.write_str(text.strip_suffix(".0").unwrap_or(&text))
            }
            ExprKind::Name(name) => f.write_str(name),
            ExprKind::Text(text) => write!(f, "{text:?}"),
            ExprKind::Signal(signal) => write!(f, "{signal}"),
            ExprKind::Call(name, args) => {
                write!(f, "{}(", name.text)?;
                for (i, arg) in args.iter().enumerate() {
                    write!(f, "{}{arg}", if i > 0 { ", " } else { "" })?;
                }
                f.write_str(")")
            }
            ExprKind::Unary(Unary::Minus, x) => write!(f, "-{x}"),
            ExprKind::Unary(Unary::Not, x) => write!(f, "!{x}"),
            ExprKind::Binary(op, x, y) => write!(f, "({x} {} {y})", op.symbol()),
            ExprKind::If(parts) => {
                let [condition, then, otherwise] = &**parts;
                write!(f, "({condition} ? {then} : {otherwise})")
            }
        }
    }
}

impl fmt::Debug for Expr {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl fmt::Debug for ExprKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(value) => write!(f, "Number({value:?})"),
            Self::Name(name) => write!(f, "Name({name})"),
            Self::Text(text) => write!(f, "Text({text:?})"),
            Self::Signal(signal) => write!(f, "{signal}"),
            Self::Call(name, args) => write!(f, "Call({}, {args:?})", name.text),
            Self::Unary(op, x) => write!(f, "Unary({op:?}, {x})"),
            Self::Binary(op, x, y) => write!(f, "Binary({x} {} {y})", op.symbol()),
            Self::If(parts) => write!(f, "If({parts:?})"),
        }
    }
}
