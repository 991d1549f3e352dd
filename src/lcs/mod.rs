//! The complementarity system of a circuit, with names and units for every row and column.

mod checked;
pub mod format;
pub mod json;
pub mod reduce;
pub mod siconos;
pub mod sparse;
pub mod sparse_format;
#[cfg(test)]
mod tests;

pub use checked::{Lcs, LcsError};
pub use reduce::{Position, ReduceError, StorageHold, reduce};
pub(crate) use reduce::{fast_states, is_coupled, reduce_apart};
pub use sparse::{Csr, SparseLcs};

use nalgebra::{DMatrix, DVector};

use crate::circuit::Source;
use crate::law::Law;

/// What an [`Lcs`] is made of: x' = A x + B λ + E u + e,  y = C x + D λ + G u + F,  −λ_j ∈ ∂φ_j(y_j).
///
/// Power into the linear network is yᵀλ for device ports whatever their roles. `x` is the *shifted* state: the physical
/// value of state k is `x[k] + shift.row(k)·u` (only capacitor loops with sources and inductor cut-sets have a shift).
/// n states, m ports, p inputs, q storage elements; a matrix without entries may have any shape.
#[derive(Debug, Clone, Default)]
pub struct LcsParts {
    /// The netlist's title.
    pub title: String,
    /// Names and units of x.
    pub states: Vec<State>,
    /// Numbers of the states that stand for what decays fast, apart from the others; none in the basis of these names.
    pub fast: Vec<usize>,
    /// Names, units and waveforms of u.
    pub inputs: Vec<Input>,
    /// The pairs (λ, y) and their laws.
    pub ports: Vec<Port>,
    /// n×n, 1/s.
    pub a: DMatrix<f64>,
    /// n×m.
    pub b: DMatrix<f64>,
    /// m×n.
    pub c: DMatrix<f64>,
    /// m×m.
    pub d: DMatrix<f64>,
    /// n×p.
    pub e: DMatrix<f64>,
    /// m×p.
    pub g: DMatrix<f64>,
    /// n: the constant term of x'.
    pub e0: DVector<f64>,
    /// m: the constant term of y.
    pub f: DVector<f64>,
    /// n×p: physical state = x + shift·u.
    pub shift: DMatrix<f64>,
    /// n×n symmetric: stored energy at u = 0 is ½ xᵀ P x (folded capacitors and inductors included). Empty where it is not known.
    pub energy: DMatrix<f64>,
    /// Everything that can be read from the system, as rows over [x | λ | u | u' | 1].
    pub outputs: Outputs,
    /// The storage elements behind the states, s = (all capacitor voltages, all inductor currents).
    pub storage: Storage,
    /// Switch names and the position this system was assembled for.
    pub switches: Vec<(String, bool)>,
    /// One row per switch: its control value.
    pub controls: Rows,
    /// What holding devices fixed left behind (empty when every device is a port).
    pub held: Held,
    /// What the ideal model leaves open and a least-norm choice has settled, in words.
    pub notes: Vec<String>,
}

/// A device pair as the reduction sees it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Hold {
    /// A port of the system: λ is free, y is given by it.
    Free,
    /// Conducting: a 0 V source.
    Closed,
    /// Blocking: a 0 A source.
    Open,
}

/// Readings of devices that were held conducting or blocking, for guards.
#[derive(Debug, Clone, Default)]
pub struct Held {
    /// Indices of the held pairs, in order.
    pub pairs: Vec<usize>,
    /// One row per held pair: the quantity that must stay ≥ 0: i of a conducting pair, −v of a blocking one. Where the
    /// circuit does not determine it (parallel conducting diodes, a node between blocking ones) the least-norm choice.
    pub guard: Rows,
    /// pairs×k: adding any combination of these columns to the guards satisfies the circuit as well.
    pub kernel: DMatrix<f64>,
    /// Rows over [x | u | u' | 1] that must vanish for this position to exist (a conducting diode across a source).
    pub constraints: Rows,
    /// For each constraint the elements whose loop or cut-set it is.
    pub constrained: Vec<Vec<String>>,
    /// pairs×q: areas of the guards' impulses when the storage vector changes from s⁻ to s⁺: `impulse · (s⁻ − s⁺)`.
    pub impulse: DMatrix<f64>,
}

/// A row of x.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct State {
    /// `v(c1)` or `i(l1)`.
    pub name: String,
    /// `V` or `A`.
    pub unit: &'static str,
}

/// A column of u.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// The source's name, `v1`.
    pub name: String,
    /// `V` or `A`.
    pub unit: &'static str,
    /// Its value over time.
    pub source: Source,
}

/// Which of a device's two quantities is λ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// λ = i(device), y = −v(device).
    Current,
    /// λ = −v(device), y = i(device).
    Voltage,
    /// λ = output of a function block, y = its input.
    Function,
}

/// A pair (λ, y).
#[derive(Debug, Clone, PartialEq)]
pub struct Port {
    /// The device, `d1`.
    pub device: String,
    /// Which quantity is λ.
    pub role: Role,
    /// `i(d1)`, `-v(d1)` or `e1.out`.
    pub lambda: String,
    /// `-v(d1)`, `i(d1)` or the input, `v(a,b)`.
    pub y: String,
    /// The law between them.
    pub law: Law,
}

/// Rows over the columns [x | λ | u | u' | 1]: value = X x + Λ λ + U u + U' u' + k.
#[derive(Debug, Clone, Default)]
pub struct Rows {
    /// rows×n.
    pub x: DMatrix<f64>,
    /// rows×m.
    pub lambda: DMatrix<f64>,
    /// rows×p.
    pub u: DMatrix<f64>,
    /// rows×p: only currents of folded capacitors (voltages of folded inductors) have it; at an edge of u it is an impulse.
    pub du: DMatrix<f64>,
    /// rows.
    pub one: DVector<f64>,
}

/// Named readings of the system.
#[derive(Debug, Clone, Default)]
pub struct Outputs {
    /// `v(out)`, `i(d1)`: the requested probes, in order.
    pub names: Vec<String>,
    /// `V` or `A`.
    pub units: Vec<&'static str>,
    /// One row per name.
    pub rows: Rows,
    /// names×q: areas of the outputs' impulses when the storage vector changes from s⁻ to s⁺: `impulse · (s⁻ − s⁺)`.
    pub impulse: DMatrix<f64>,
    /// Power terms for the energy balance.
    pub power: Vec<PowerTerm>,
    /// Rows of the two factors of each power term: `power_v` row k times `power_i` row k is the power (W) *into* the element.
    pub power_v: Rows,
    /// See `power_v`.
    pub power_i: Rows,
}

/// What a power term counts as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PowerKind {
    /// Independent and controlled sources; power out of them is "source".
    Source,
    /// Resistors, switches and devices; power into them is "dissipated".
    Dissipated,
    /// The ports of transmission lines, which store what enters them until it leaves.
    Line,
    /// Parts of gates and flip-flops whose volts and amperes are numbers: no power.
    Logic,
}

/// One element of the energy balance.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PowerTerm {
    /// Element name.
    pub element: String,
    /// Which side of the balance.
    pub kind: PowerKind,
}

/// The physical storage vector s and its relation to x.
#[derive(Debug, Clone, Default)]
pub struct Storage {
    /// `v(c1)`, … `i(l1)` for *all* capacitors and inductors (flux states for coupled ones), in circuit order.
    pub names: Vec<String>,
    /// The elements themselves, `c1`, `l1` (states of a system without a circuit behind it).
    pub elements: Vec<String>,
    /// `V` or `A`, of each.
    pub units: Vec<&'static str>,
    /// q×n: s = X x + Λ λ + U u + k.
    pub x: DMatrix<f64>,
    /// q×m: zero (or empty) but for operating points, where storage is open or short and devices decide its values.
    pub lambda: DMatrix<f64>,
    /// q×p.
    pub u: DMatrix<f64>,
    /// q.
    pub one: DVector<f64>,
    /// q×q: block-diagonal C and L; stored energy is ½ sᵀ M s. Empty at an operating point, which stores nothing anew.
    pub metric: DMatrix<f64>,
    /// n×q: the state after a change to this system from storage s⁻ by conservation of charge and flux, x⁺ = J s⁻ + j.
    /// For u = 0 this is the projection in the energy metric.
    pub inject: DMatrix<f64>,
    /// n: the constant part of x⁺.
    pub inject_one: DVector<f64>,
    /// q: initial values from `IC=` cards (0 where none), used by `uic`.
    pub initial: DVector<f64>,
}

impl LcsParts {
    /// Number of states n.
    #[must_use]
    pub fn n(&self) -> usize {
        self.states.len()
    }

    /// Number of ports m.
    #[must_use]
    pub fn m(&self) -> usize {
        self.ports.len()
    }

    /// The switches with the positions that the system is of, as text; empty without switches.
    pub(crate) fn held_switches(&self) -> String {
        let held = self.switches.iter();
        let held = held.map(|(name, on)| format!("{name}={}", if *on { "on" } else { "off" }));
        held.collect::<Vec<_>>().join(", ")
    }

    /// Number of inputs p.
    #[must_use]
    pub fn p(&self) -> usize {
        self.inputs.len()
    }
}

impl Outputs {
    /// Leaves the probes with these numbers (each below the number of names), in this order.
    pub fn keep(&mut self, kept: &[usize]) {
        self.names = kept.iter().map(|&k| self.names[k].clone()).collect();
        self.units = kept.iter().map(|&k| self.units[k]).collect();
        let rows = &mut self.rows;
        rows.x = rows.x.select_rows(kept);
        rows.lambda = rows.lambda.select_rows(kept);
        rows.u = rows.u.select_rows(kept);
        rows.du = rows.du.select_rows(kept);
        rows.one = rows.one.select_rows(kept);
        if !self.impulse.is_empty() {
            self.impulse = self.impulse.select_rows(kept);
        }
    }
}
