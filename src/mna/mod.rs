//! Modified nodal analysis: the port behaviour of everything that is neither storage, source nor device.
//!
//! Capacitors, inductors, devices, switches and independent sources are taken out as *ports* with two columns each,
//! voltage and current. What is left (resistors, controlled sources, ideal transformers of perfectly coupled windings)
//! is the static multiport `N [v; i; 1] = 0`, stated as a list of exact equations.

mod assemble;
mod clocked;
mod couple;
#[cfg(test)]
pub(crate) mod fixture;
mod graph;
mod parts;
mod perturbed;
mod readings;
mod sliding;
mod standard;
mod system;
pub mod topology;

use std::sync::OnceLock;

use crate::algebra::{Ball, Field, Rational, SparseRow, Table, Value, eliminate_sparse};
use crate::diagnostic::Diagnostic;
use crate::lcs::{Input, Port, PowerKind, Role};

pub use assemble::behaviour;
pub(crate) use clocked::SourceControl;
pub(crate) use parts::Part;
pub(crate) use perturbed::Perturbation;
pub use standard::StandardMultiport;

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
    /// The value over a double.
    Ratio(Value, f64),
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
            Self::Ratio(a, b) => F::value(a).div(&F::value(Value::binary(b))),
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
            Self::Ratio(a, b) => Self::Ratio(a.negated(), b),
            Self::Pair(hi, lo) => Self::Pair(-hi, -lo),
        }
    }

    /// The ball around a coefficient that is a measured double rather than an exact number.
    fn measured(self) -> Ball {
        match self {
            Self::Plus(v) => Ball::inexact(v.f64),
            Self::Minus(v) => Ball::inexact(-v.f64),
            other => other.in_field(),
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
    /// The column of its derivative, in a system given as matrices whose outputs contain it.
    pub rate: Option<Column>,
}

/// A complementary or lawful pair of columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// The device and its law; the role is the one to take where the circuit allows both.
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

impl Pair {
    /// Which quantity is to be y where the circuit allows both; the other is λ.
    pub(crate) fn prefers_current_as_y(&self) -> bool {
        self.port.role == Role::Voltage
    }
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
    /// A switch inside a thyristor.
    pub latch: Option<LatchPort>,
}

/// See [`Latch`](crate::circuit::Latch); switches are given by their indices.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LatchPort {
    /// On while a gate is, then as long as it holds itself.
    Hold {
        /// The switches that turn it on.
        gates: Vec<usize>,
        /// Name of the device in series.
        valve: String,
    },
    /// On while this latch is off.
    Rest(usize),
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
pub struct StaticMultiport {
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
    /// The graph of the circuit, for messages; empty for a system given as matrices.
    pub graph: Vec<topology::Edge>,
    /// The coefficients are measured doubles: what cancels to less than their rounding counts as 0.
    pub inexact: bool,
    /// Fewer digits do: rationals do not stand in for balls that are wide.
    pub(crate) rough: bool,
    ball: OnceLock<Reduced<Ball>>,
    rational: OnceLock<Reduced<Rational>>,
}

/// The port equations left after the internal columns are gone.
#[derive(Debug, Clone)]
pub(crate) struct Reduced<F> {
    /// Place of each column in the matrix below; `None` for columns that are gone.
    pub(crate) place: Vec<Option<usize>>,
    /// The port equations, = 0.
    pub(crate) equations: Table<F>,
    /// The value of each observed quantity.
    pub(crate) readings: Vec<SparseRow<F>>,
    /// Internal columns that no equation determines; they keep a place.
    pub(crate) free: Vec<Column>,
    /// Entries of the energy matrix.
    pub(crate) metric: Vec<(usize, usize, F)>,
    /// Ron and Roff (`None` is open) of every switch.
    pub(crate) switches: Vec<(F, Option<F>)>,
}

impl StaticMultiport {
    /// The constant-1 column.
    pub const ONE: Column = 0;

    /// Adds a column.
    pub(crate) fn column(&mut self, name: impl Into<String>) -> Column {
        self.columns.push(name.into());
        self.columns.len() - 1
    }

    /// Names of internal columns that the circuit leaves undetermined in every position.
    #[must_use]
    pub fn undetermined(&self) -> Vec<&str> {
        self.ball()
            .free
            .iter()
            .map(|&c| self.columns[c].as_str())
            .collect()
    }

    pub(crate) fn ball(&self) -> &Reduced<Ball> {
        self.ball.get_or_init(|| {
            if self.inexact {
                self.reduced(Coefficient::measured)
            } else {
                self.reduced(Coefficient::in_field)
            }
        })
    }

    pub(crate) fn rational(&self) -> &Reduced<Rational> {
        self.rational
            .get_or_init(|| self.reduced(Coefficient::in_field))
    }

    /// Eliminates the internal columns.
    fn reduced<F: Field>(&self, number: impl Fn(Coefficient) -> F) -> Reduced<F> {
        let count = self.columns.len();
        // Internal columns first, then ports, then observed quantities, which occur only in their definitions.
        let mut sort = vec![1; count];
        self.internal.iter().for_each(|&c| sort[c] = 0);
        self.observed.iter().for_each(|o| sort[o.column] = 2);
        let mut order: Vec<Column> = (0..count).collect();
        order.sort_by_key(|&c| sort[c]);
        let mut rank = vec![0; count];
        order.iter().enumerate().for_each(|(k, &c)| rank[c] = k);
        let internal = sort.iter().filter(|s| **s == 0).count();
        let visible = count - self.observed.len();
        let mut observed: Vec<usize> = (0..self.observed.len()).collect();
        observed.sort_by_key(|&k| self.observed[k].column);

        let mut rows = Vec::with_capacity(self.equations.len());
        let mut readings: Vec<SparseRow<F>> = vec![Vec::new(); self.observed.len()];
        for equation in &self.equations {
            let mut row: SparseRow<F> = Vec::with_capacity(equation.len());
            let mut terms: Vec<(usize, Coefficient)> =
                equation.iter().map(|&(x, c)| (rank[c], x)).collect();
            terms.sort_by_key(|term| term.0);
            for (c, x) in terms {
                match row.last_mut() {
                    Some(last) if last.0 == c => last.1 = last.1.add(&number(x)),
                    _ => row.push((c, number(x))),
                }
            }
            row.retain(|(_, x)| !x.is_zero());
            match row.last() {
                // value = Σ terms is written Σ terms − value = 0.
                Some(last) if last.0 >= visible => {
                    let k = observed[last.0 - visible];
                    row.pop();
                    readings[k] = row;
                }
                _ => rows.push(row),
            }
        }
        let equations = rows.len();
        rows.append(&mut readings);
        let equations = eliminate_sparse(&mut rows, equations, internal);

        let mut loose: Vec<usize> = rows
            .iter()
            .flatten()
            .map(|(c, _)| *c)
            .filter(|&c| c < internal)
            .collect();
        loose.sort_unstable();
        loose.dedup();
        let width = visible - internal + loose.len();
        let position = |c: usize| {
            if c >= internal {
                Some(c - internal)
            } else {
                loose.binary_search(&c).ok().map(|k| visible - internal + k)
            }
        };
        let placed = |row: SparseRow<F>| {
            let entries = row.into_iter();
            let mut row: SparseRow<F> = entries
                .filter_map(|(c, x)| Some((position(c)?, x)))
                .collect();
            row.sort_unstable_by_key(|(k, _)| *k);
            row
        };
        let readings = rows.split_off(equations).into_iter().map(placed).collect();
        let equations = Table::new(rows.into_iter().map(placed).collect(), width);
        let mut place = vec![None; count];
        for (k, &c) in order.iter().enumerate().take(visible) {
            place[c] = position(k);
        }
        let resistance = |r: Value| number(Coefficient::Plus(r));
        Reduced {
            place,
            equations,
            readings,
            free: loose.iter().map(|&c| order[c]).collect(),
            metric: self
                .metric
                .iter()
                .map(|&(a, b, x)| (a, b, number(x)))
                .collect(),
            switches: (self.switches.iter())
                .map(|s| (resistance(s.ron), s.roff.map(resistance)))
                .collect(),
        }
    }
}
