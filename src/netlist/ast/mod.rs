//! What a netlist says, card by card: nothing evaluated, nothing derived, every piece with its place in the text.

mod expr;
mod measure;
mod sweep;

use crate::algebra::Value;
use std::fmt;

pub use expr::{Binary, Expr, ExprKind, Unary};
pub use measure::{Four, Meas, MeasAnalysis};
pub use sweep::{Frequencies, Points, Spacing, Sweep, Target};

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
    /// The last line of the root file, for findings about the whole.
    pub end: Span,
    /// How it is drawn, of a schematic.
    pub sheet: Option<Sheet>,
}

/// A place on a sheet, in LTspice's units (16 between points of its grid), y down.
pub type Spot = (i64, i64);

/// What a schematic shows.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Sheet {
    /// Both ends of each wire.
    pub wires: Vec<(Spot, Spot)>,
    /// Names of nets, `0` for ground.
    pub labels: Vec<(Spot, String)>,
    /// What stands for cards.
    pub symbols: Vec<PlacedSymbol>,
}

/// A symbol on a sheet.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlacedSymbol {
    /// The name of its card, in lower case.
    pub name: String,
    /// Its pins in the order of the card's nodes: of an `A` device which of its eight terminals (from 1), and where.
    pub pins: Vec<(usize, Spot)>,
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
    /// `.op`: an analysis other than `.tran`.
    Analysis(Span),
    /// `.ic`.
    Ic(Vec<(Signal, Expr)>),
    /// `.nodeset`.
    Nodeset(Vec<(Signal, Expr)>),
    /// `.temp t`, `.options temp=t`, °C.
    Temperature(Expr),
    /// `.options tnom=t`, °C.
    Nominal(Expr),
    /// `.options gmin=g`, S.
    Gmin(Expr),
    /// `.thermal`.
    Thermal(Thermal),
    /// `.save`, `.print`, `.probe`, `.plot` of every analysis.
    Save(Vec<Wanted>),
    /// `.print tran`, `.plot tran`.
    SaveTran(Vec<Wanted>),
    /// `.print dc`, `.plot dc`.
    SaveDc(Vec<Wanted>),
    /// `.global`.
    Global(Vec<Name>),
    /// `.meas tran`, or a `meas` command inside `.control`.
    Meas(Box<Meas>),
    /// `.four`.
    Four(Box<Four>),
    /// `.step`.
    Step(Box<Sweep>),
    /// `.dc`: the first sweep is the innermost.
    Dc(Vec<Sweep>),
    /// `.ac`.
    Ac(Frequencies),
    /// `.pss`.
    Pss(Box<Pss>),
    /// `alter` inside `.control`, before the run.
    Alter(Alter),
}

/// `.thermal node device …`: where the heat of devices goes.
#[derive(Debug, Clone, PartialEq)]
pub struct Thermal {
    /// A node whose voltage is a temperature, V for °C.
    pub node: Name,
    /// The devices whose cases stand there.
    pub devices: Vec<Name>,
}

/// `alter r1 = 100`, `alter @v1[dc] = 5`.
#[derive(Debug, Clone, PartialEq)]
pub struct Alter {
    /// The element.
    pub name: Name,
    /// What of it, where that is written.
    pub quantity: Option<String>,
    /// Its value from then on.
    pub value: Value,
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
        wave: Option<Box<WaveCall>>,
        /// `AC magnitude phase`: no, one or two values.
        ac: Option<Vec<Expr>>,
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
    /// M, Q, J, Z: drain, gate and source (collector, base and emitter) are the element's nodes.
    Transistor {
        /// A bulk or substrate node or none, the model name, an area factor or none.
        words: Vec<Name>,
        /// The last word as a value: the area factor, unless that word is the model.
        area: Option<Expr>,
        /// `w=`, `l=`, `m=`, `off`, …
        args: Vec<Assign>,
    },
    /// T.
    Line {
        /// `z0=`, `td=`, `f=`, `nl=`.
        args: Vec<Assign>,
        /// `ic=v1,i1,v2,i2`.
        ic: Vec<Expr>,
    },
    /// A, until the netlist is read as a whole.
    Code {
        /// The pins.
        ports: Vec<PinGroup>,
        /// The model, or LTspice's function.
        model: Name,
        /// LTspice's parameters.
        args: Vec<Assign>,
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

/// A pin group of an `A` card: a node, a pair, or a vector of either.
#[derive(Debug, Clone, PartialEq)]
pub struct PinGroup {
    /// `%vd`, `%i`, …, without the sign; none where nothing stands there.
    pub sort: Option<Name>,
    /// Its elements, of one node or two.
    pub elements: Vec<Vec<Name>>,
    /// Whether it stands in brackets.
    pub vector: bool,
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
    /// LTspice's `steady`.
    pub steady: bool,
    /// Written as a command inside `.control`.
    pub command: bool,
    /// The whole card.
    pub span: Span,
}

/// ngspice's `.pss gfreq tstab oscnob psspoints harms sciter steadycoeff uic`.
#[derive(Debug, Clone, PartialEq)]
pub struct Pss {
    /// About how often the circuit repeats, Hz.
    pub frequency: Expr,
    /// How long a transient without sources is looked at, s.
    pub settling: Expr,
    /// Rows of a period.
    pub points: Expr,
    /// `uic`.
    pub uic: bool,
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
    All(Name),
    /// A pattern or an expression.
    Other(Name),
}
