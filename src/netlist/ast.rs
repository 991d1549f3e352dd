//! What a netlist says, card by card: nothing evaluated, nothing derived, every piece with its place in the text.

use std::fmt;

use crate::algebra::Value;
use crate::diagnostic::{Diagnostic, Span};

/// A name as SPICE compares it: lower case.
#[derive(Clone, PartialEq, Eq)]
pub struct Name {
    /// Lower-case text.
    pub text: String,
    /// Where it stands.
    pub span: Span,
}

impl fmt::Debug for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// A netlist: its title line and all cards, includes read in place.
#[derive(Debug, Clone, PartialEq)]
pub struct Netlist {
    /// The title line without its comment mark.
    pub title: String,
    /// Everything at the top level.
    pub body: Block,
    /// The last place of the root file, for findings about the whole.
    pub end: Span,
}

/// Cards that share a scope: the top level, a subcircuit or a branch of `.if`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Block {
    /// The cards in file order.
    pub statements: Vec<Statement>,
    /// What is wrong here; inside a subcircuit or a branch these are errors only if it is used.
    pub faults: Vec<Diagnostic>,
}

/// One card, or a block of cards.
#[derive(Debug, Clone, PartialEq)]
pub enum Statement {
    /// An element card.
    Element(Element),
    /// `.model`.
    Model(Model),
    /// `.param a=1 b={2*a}`.
    Param(Vec<Assign>),
    /// `.func f(x) {…}`.
    Func(Func),
    /// `.subckt … .ends`.
    Subckt(Subckt),
    /// `.if … .elseif … .else … .endif`.
    If(Vec<Branch>),
    /// `.tran`, or a `tran` command inside `.control`.
    Tran(Tran),
    /// `.op`, `.ac`, `.dc` …: some analysis other than `.tran`.
    Analysis(Span),
    /// `.ic`.
    Ic(Vec<(Signal, Expr)>),
    /// `.save`, `.print`, `.probe`, `.plot`.
    Save(Vec<Wanted>),
    /// `.global`.
    Global(Vec<Name>),
}

/// An element card.
#[derive(Debug, Clone, PartialEq)]
pub struct Element {
    /// Its name; the first letter says what it is.
    pub name: Name,
    /// The nodes it connects (not the controlling ones).
    pub nodes: Vec<Name>,
    /// The rest of the card.
    pub device: Device,
    /// The whole card.
    pub span: Span,
}

/// What follows the nodes on an element card.
#[derive(Debug, Clone, PartialEq)]
pub enum Device {
    /// R, C, L: at most two of value and model name, then `name=value`.
    Passive {
        /// Value and model name in any order; a bare name may be either.
        values: Vec<Expr>,
        /// `R=`, `IC=`, `Rser=`, `tc1=`, …
        args: Vec<Assign>,
    },
    /// V, I.
    Source {
        /// The `DC` value.
        dc: Option<Expr>,
        /// `SIN(…)`, `PULSE(…)`, …
        wave: Option<WaveCall>,
        /// `Rser=`, `Cpar=`, `r=`, `td=`, `load`, …
        args: Vec<Assign>,
    },
    /// K.
    Coupling {
        /// Two or more inductors.
        inductors: Vec<Name>,
        /// The coefficient.
        k: Expr,
    },
    /// E, G, F, H, B.
    Controlled {
        /// Whether the output is a voltage (E, H, `V=`) or a current (G, F, `I=`).
        voltage: bool,
        /// What it follows.
        control: Control,
        /// `Rpar=`, `tc1=`, …
        args: Vec<Assign>,
    },
    /// D.
    Diode {
        /// The model name.
        model: Name,
        /// The area factor.
        area: Option<Expr>,
        /// `off`, `ic=`, `m=`, …
        args: Vec<Assign>,
    },
    /// S, W.
    Switch {
        /// What switches it.
        control: Control,
        /// The model name.
        model: Name,
        /// `ON`, `OFF`.
        initial: Option<bool>,
    },
    /// X.
    Call {
        /// The subcircuit.
        subckt: Name,
        /// Its parameters.
        args: Vec<Assign>,
    },
    /// An element that is known to SPICE but not to this program.
    Unsupported {
        /// What it is: "a MOSFET", …
        what: &'static str,
    },
}

/// What a controlled element follows.
#[derive(Debug, Clone, PartialEq)]
pub enum Control {
    /// `POLY(n)` or the plain linear form (one pair, one gain): controlling node pairs and coefficients.
    Nodes(Vec<(Name, Name)>, Vec<Expr>),
    /// The same with currents of voltage sources.
    Currents(Vec<Name>, Vec<Expr>),
    /// `VALUE={…}`, `V=…`, `I=…`.
    Expression(Expr),
    /// `TABLE {…} = (x,y) …`.
    Table(Expr, Vec<(Expr, Expr)>),
    /// `LAPLACE`, `FREQ`, …: recognised only.
    Other(Name),
}

/// `SIN(0 5 50)`.
#[derive(Debug, Clone, PartialEq)]
pub struct WaveCall {
    /// `sin`, `pulse`, `pwl`, `exp`, `sffm`, `am`, …
    pub name: Name,
    /// Its arguments; in PWL a time written `+1m` counts from the one before.
    pub args: Vec<WaveArg>,
}

/// One argument of a waveform.
#[derive(Debug, Clone, PartialEq)]
pub struct WaveArg {
    /// The value.
    pub value: Expr,
    /// Whether it was written with a leading `+`.
    pub plus: bool,
}

/// `.model name type (…)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// Its name.
    pub name: Name,
    /// `d`, `sw`, `csw`, `vswitch`, …
    pub kind: Name,
    /// `ako: other`: the model it extends.
    pub base: Option<Name>,
    /// Its parameters; flags have no value.
    pub params: Vec<Assign>,
}

/// `name=value`, or a flag alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Assign {
    /// The name.
    pub name: Name,
    /// The value.
    pub value: Option<Expr>,
}

/// `.func f(x,y) {…}`.
#[derive(Debug, Clone, PartialEq)]
pub struct Func {
    /// Its name.
    pub name: Name,
    /// Formal arguments.
    pub args: Vec<Name>,
    /// The body.
    pub body: Expr,
}

/// `.subckt name nodes params … .ends`.
#[derive(Debug, Clone, PartialEq)]
pub struct Subckt {
    /// Its name.
    pub name: Name,
    /// Its terminals.
    pub nodes: Vec<Name>,
    /// Parameters with defaults.
    pub params: Vec<Assign>,
    /// Its cards.
    pub body: Block,
}

/// A branch of `.if`.
#[derive(Debug, Clone, PartialEq)]
pub struct Branch {
    /// `None` for `.else`.
    pub condition: Option<Expr>,
    /// Its cards.
    pub body: Block,
}

/// `.tran` as written.
#[derive(Debug, Clone, PartialEq)]
pub struct Tran {
    /// One to four numbers.
    pub args: Vec<Expr>,
    /// `uic`.
    pub uic: bool,
    /// LTspice's `startup`.
    pub startup: bool,
    /// Written as a command inside `.control`.
    pub command: bool,
    /// The whole card.
    pub span: Span,
}

/// `v(a)`, `v(a,b)` or `i(d1)`.
#[derive(Clone, PartialEq, Eq)]
pub enum Signal {
    /// v(a) or v(a) − v(b).
    Voltage(Name, Option<Name>),
    /// The current of an element.
    Current(Name),
}

impl Signal {
    /// Where it stands.
    #[must_use]
    pub fn span(&self) -> Span {
        match self {
            Self::Voltage(a, Some(b)) => a.span.to(b.span),
            Self::Voltage(a, None) | Self::Current(a) => a.span,
        }
    }
}

impl fmt::Display for Signal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Voltage(a, Some(b)) => write!(f, "v({},{})", a.text, b.text),
            Self::Voltage(a, None) => write!(f, "v({})", a.text),
            Self::Current(name) => write!(f, "i({})", name.text),
        }
    }
}

impl fmt::Debug for Signal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// What an output card asks for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Wanted {
    /// One signal.
    Signal(Signal),
    /// A bare name: a node (`.save out`) or `@d1[i]`, `v1#branch`.
    Bare(Name),
    /// `all`, `v(*)`, `alli`: the default set.
    All(Span),
    /// An expression or quantity that is not supported.
    Other(Name),
}

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
    Signal(Signal),
    /// A function.
    Call(Name, Vec<Expr>),
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
            ExprKind::Number(value) => write!(f, "{:?}", value.f64),
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
