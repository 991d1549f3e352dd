//! Modified nodal analysis: the port behaviour of everything that is neither storage, source nor device.
//!
//! Capacitors, inductors, devices, switches and independent sources are taken out as *ports* with two columns each,
//! voltage and current. What is left (resistors, controlled sources, ideal transformers of perfectly coupled windings)
//! is the static multiport `N [v; i; 1] = 0`, stated as a list of exact equations.

mod assemble;
mod couple;
mod standard;
mod system;

use std::sync::OnceLock;

use crate::algebra::{Ball, Field, Matrix, Rational, Value, eliminate};
use crate::diagnostic::Diagnostic;
use crate::lcs::{Input, Port, PowerKind};

pub use assemble::behaviour;

/// An exact coefficient of an equation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Coefficient {
    /// The value.
    Plus(Value),
    /// Minus the value.
    Minus(Value),
    /// One over the value.
    Inverse(Value),
    /// Minus one over the value.
    MinusInverse(Value),
    /// The exact sum of two doubles (square roots of coupled inductances).
    Pair(f64, f64),
}

impl Coefficient {
    /// 1.
    pub const ONE: Self = Self::Plus(Value::decimal(1.0, 1, 0));
    /// −1.
    pub const MINUS_ONE: Self = Self::Minus(Value::decimal(1.0, 1, 0));

    /// The same number in a field.
    #[must_use]
    pub fn in_field<F: Field>(self) -> F {
        match self {
            Self::Plus(v) => F::value(v),
            Self::Minus(v) => F::value(v).neg(),
            Self::Inverse(v) => F::one().div(&F::value(v)),
            Self::MinusInverse(v) => F::one().div(&F::value(v)).neg(),
            Self::Pair(hi, lo) => F::value(Value::binary(hi)).add(&F::value(Value::binary(lo))),
        }
    }

    /// The negative.
    #[must_use]
    pub const fn negated(self) -> Self {
        match self {
            Self::Plus(v) => Self::Minus(v),
            Self::Minus(v) => Self::Plus(v),
            Self::Inverse(v) => Self::MinusInverse(v),
            Self::MinusInverse(v) => Self::Inverse(v),
            Self::Pair(hi, lo) => Self::Pair(-hi, -lo),
        }
    }
}

/// A column of the behaviour, as an index.
pub type Column = usize;

/// `Σ coefficient · column = 0`.
pub type Equation = Vec<(Coefficient, Column)>;

/// A storage element as the reduction sees it: its two columns.
#[derive(Debug, Clone, PartialEq)]
pub struct StoragePort {
    /// `v(c1)` or `i(l1)`.
    pub name: String,
    /// The element.
    pub element: String,
    /// Capacitor (state is the voltage) or inductor (state is the current).
    pub capacitor: bool,
    /// The column of the state quantity: v of a capacitor, i of an inductor.
    pub state: Column,
    /// The column of the other: i of a capacitor, v of an inductor.
    pub flow: Column,
    /// `IC=`.
    pub initial: Option<f64>,
}

/// An independent source: its value is an input, its other quantity an unknown.
#[derive(Debug, Clone, PartialEq)]
pub struct SourcePort {
    /// Name, unit and waveform.
    pub input: Input,
    /// The column of its value.
    pub value: Column,
    /// The column of its other quantity.
    pub other: Column,
}

/// A complementary or lawful pair of columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// The device and its law; the role is decided by the reduction.
    pub port: Port,
    /// The column of the reverse quantity: −v of a device (of a function block: its input).
    pub reverse: Column,
    /// The column of the forward quantity: i of a device (of a function block: its output).
    pub forward: Column,
    /// A function block's pair has one role only: λ is the output.
    pub fixed_role: bool,
    /// Names of the two quantities when they are λ or y.
    pub reverse_name: String,
    /// See `reverse_name`.
    pub forward_name: String,
    /// Units of the two quantities.
    pub units: (&'static str, &'static str),
}

/// A switch with its two columns.
#[derive(Debug, Clone, PartialEq)]
pub struct SwitchPort {
    /// Name.
    pub name: String,
    /// Column of its voltage.
    pub v: Column,
    /// Column of its current.
    pub i: Column,
    /// Ω, zero for a short.
    pub ron: Value,
    /// Ω, `None` for open.
    pub roff: Option<Value>,
    /// Turns on above.
    pub on_above: f64,
    /// Turns off below.
    pub off_below: f64,
    /// `ON`/`OFF` on the card.
    pub initial: Option<bool>,
    /// Index of its control among the observed quantities.
    pub control: usize,
}

/// A quantity that can be read: a combination of columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Observed {
    /// `v(out)`, `i(d1)`.
    pub name: String,
    /// `V` or `A`.
    pub unit: &'static str,
    /// Its column, dependent by construction.
    pub column: Column,
}

/// An element of the energy balance: the observed indices of its voltage and current.
#[derive(Debug, Clone, PartialEq)]
pub struct Power {
    /// Element name.
    pub element: String,
    /// Side of the balance.
    pub kind: PowerKind,
    /// Observed index of v.
    pub v: usize,
    /// Observed index of i.
    pub i: usize,
}

/// The static multiport with its ports, `N [ports; 1] = 0`.
#[derive(Debug, Clone, Default)]
pub struct Behaviour {
    /// The netlist's title.
    pub title: String,
    /// All columns, by name, for messages; column 0 is the constant 1.
    pub columns: Vec<String>,
    /// All equations.
    pub equations: Vec<Equation>,
    /// Columns eliminated once and for all (node potentials, internal currents), in order.
    pub internal: Vec<Column>,
    /// Capacitors and inductors.
    pub storage: Vec<StoragePort>,
    /// Upper triangle of the storage metric beyond the diagonal: (row, column, value) with diagonal included.
    pub metric: Vec<(usize, usize, Coefficient)>,
    /// Independent sources.
    pub sources: Vec<SourcePort>,
    /// Devices.
    pub pairs: Vec<Pair>,
    /// Switches.
    pub switches: Vec<SwitchPort>,
    /// What can be read; the first `probes` are the circuit's probes.
    pub observed: Vec<Observed>,
    /// How many of `observed` are probes.
    pub probes: usize,
    /// The energy balance.
    pub power: Vec<Power>,
    /// Things the user should know (references of islands).
    pub notes: Vec<Diagnostic>,
    ball: OnceLock<Reduced<Ball>>,
    rational: OnceLock<Reduced<Rational>>,
}

/// The port equations left after the internal columns are gone.
#[derive(Debug, Clone)]
pub(crate) struct Reduced<F> {
    /// Place of each column in the matrices below; `None` for internal and observed ones.
    pub(crate) place: Vec<Option<usize>>,
    /// Port equations, = 0.
    pub(crate) ports: Matrix<F>,
    /// One row per observed quantity: its value.
    pub(crate) observed: Matrix<F>,
    /// Internal columns that no equation determines (taken as zero).
    pub(crate) free: Vec<Column>,
}

impl Behaviour {
    /// The constant-1 column.
    pub const ONE: Column = 0;

    /// Adds a column.
    pub(crate) fn column(&mut self, name: impl Into<String>) -> Column {
        self.columns.push(name.into());
        self.columns.len() - 1
    }

    /// Names of internal columns that the circuit leaves undetermined (they are taken as zero).
    #[must_use]
    pub fn undetermined(&self) -> Vec<&str> {
        self.ball()
            .free
            .iter()
            .map(|&c| self.columns[c].as_str())
            .collect()
    }

    pub(crate) fn ball(&self) -> &Reduced<Ball> {
        self.ball.get_or_init(|| self.reduced())
    }

    pub(crate) fn rational(&self) -> &Reduced<Rational> {
        self.rational.get_or_init(|| self.reduced())
    }

    fn reduced<F: Field>(&self) -> Reduced<F> {
        let mut matrix = Matrix::<F>::zeros(self.equations.len(), self.columns.len());
        for (i, equation) in self.equations.iter().enumerate() {
            for &(coefficient, column) in equation {
                matrix.add_to(i, column, &coefficient.in_field());
            }
        }
        let eliminated: Vec<Column> = self
            .internal
            .iter()
            .copied()
            .chain(self.observed.iter().map(|o| o.column))
            .collect();
        let rows = matrix.rows;
        let pivots = eliminate(&mut matrix, rows, eliminated.iter().copied());
        let free = self
            .internal
            .iter()
            .copied()
            .filter(|&c| pivots[c].is_none())
            .collect();

        let mut is_live = vec![true; matrix.cols];
        let mut is_port_row = vec![true; matrix.rows];
        for &c in &eliminated {
            is_live[c] = false;
            if let Some(row) = pivots[c] {
                is_port_row[row] = false;
            }
        }
        let live: Vec<Column> = (0..matrix.cols).filter(|&c| is_live[c]).collect();
        let mut place = vec![None; matrix.cols];
        for (k, &c) in live.iter().enumerate() {
            place[c] = Some(k);
        }
        let port_rows: Vec<usize> = (0..matrix.rows).filter(|&r| is_port_row[r]).collect();
        let mut ports = Matrix::zeros(port_rows.len(), live.len());
        for (i, &r) in port_rows.iter().enumerate() {
            for (k, &c) in live.iter().enumerate() {
                ports.set(i, k, matrix.at(r, c).clone());
            }
        }
        let mut observed = Matrix::zeros(self.observed.len(), live.len());
        for (i, o) in self.observed.iter().enumerate() {
            let Some(r) = pivots[o.column] else { continue };
            for (k, &c) in live.iter().enumerate() {
                observed.set(i, k, matrix.at(r, c).neg());
            }
        }
        Reduced {
            place,
            ports,
            observed,
            free,
        }
    }
}
