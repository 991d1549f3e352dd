//! From port behaviour to the complementarity system of one position.
//!
//! The columns of the behaviour are eliminated in class order: quantities nobody prescribes, rates of
//! storage (i_C, v_L), device currents, device voltages of devices not yet used, states. What stays free are the
//! sources, the states x, one of (v, i) per device = λ, and the undetermined quantities f: rates of storage that
//! depends on other storage, held quantities that the position pins only through the states. With s = S_x x + S_u u + k all
//! storage quantities, P their energy matrix and P s' = K_x x + K_f f + K_λ λ + K_u u + k' their rates,
//!
//! ```text
//! [P S_x, −K_f] [x'; f] = K_x x + K_λ λ + K_u u + k' − P S_u u'
//! [P S_x, −K_f] [x⁺; F] = P s⁻ − P S_u u − P k
//! ```
//!
//! give the flow and, with the same matrix, the state x⁺ after charge and flux are conserved (F = ∫ f are the impulses).
//! The part of x that follows u' is the shift: x_physical = x + Σ u, so that no derivative appears in x'.

mod compressed;
mod eliminated;
mod exchange;
mod flow;
mod frame;
mod publish;
mod roles;
mod separate;
mod system;

use std::collections::BTreeSet;

use crate::algebra::{Field, LongBall, SparseRow};
use crate::diagnostic::Internal;
use crate::mna::{Reduced, StaticMultiport};

use super::sparse::Readings;
use super::{Hold, Lcs, LcsError, LcsParts, Role, SparseLcs};
use eliminated::Eliminated;
use publish::publish;
use roles::Digits;
pub(crate) use separate::{fast_states, is_coupled};

/// What each device and switch is held as.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Position {
    /// One entry per device pair.
    pub devices: Vec<Hold>,
    /// On or off, one entry per switch.
    pub switches: Vec<bool>,
    /// Whether capacitors and inductors are storage or, for an operating point, open and short.
    pub storage: StorageHold,
}

/// How storage elements enter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum StorageHold {
    /// C v' = i, L i' = v.
    Dynamic,
    /// Capacitors are open (i = 0) and inductors short (v = 0): the operating point. The system has no states; the storage
    /// vector is read from [`Storage`](super::Storage).
    Static,
}

impl Position {
    /// All devices free, the given switch positions.
    #[must_use]
    pub fn free(behaviour: &StaticMultiport, switches: Vec<bool>) -> Self {
        Self {
            devices: vec![Hold::Free; behaviour.pairs.len()],
            switches,
            storage: StorageHold::Dynamic,
        }
    }
}

/// Why a position has no system.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ReduceError {
    /// Numbers of devices or switches differ from the behaviour's.
    #[error("a position with {given} {what} for a circuit with {expected}")]
    Position {
        /// `devices` or `switches`.
        what: &'static str,
        /// In the position.
        given: usize,
        /// In the circuit.
        expected: usize,
    },
    /// Only ideal pairs can be held conducting or blocking.
    #[error("{device} is not an ideal pair and cannot be held; standardise its law first")]
    NotIdeal {
        /// The device.
        device: String,
    },
    /// A loop of voltage sources or a cut-set of current sources.
    #[error("{}", conflict(.elements))]
    Sources {
        /// The sources, and what joins them.
        elements: Vec<String>,
    },
    /// The two quantities of a device are not free of each other.
    #[error("the circuit prescribes both voltage and current around {}", .elements.join(", "))]
    Port {
        /// The devices.
        elements: Vec<String>,
    },
    /// A dependent storage element follows λ, so that the system would contain λ'.
    #[error("{storage} follows {} without delay, so its {} would be a derivative", .ports.join(", "), if .storage.starts_with('v') { "current" } else { "voltage" })]
    Feedthrough {
        /// `v(c1)`.
        storage: String,
        /// The devices.
        ports: Vec<String>,
    },
    /// A quantity of a port contains the derivative of a source.
    #[error("{port} depends on the derivative of {}", .sources.join(", "))]
    SourceRate {
        /// The port.
        port: String,
        /// The sources.
        sources: Vec<String>,
    },
    /// The rates of these storage elements are not determined.
    #[error("the rates of {} are not determined: the storage matrix is singular", .elements.join(", "))]
    Singular {
        /// Storage labels.
        elements: Vec<String>,
    },
    /// Its matrices are none that doubles hold.
    #[error(transparent)]
    Unfit(#[from] LcsError),
    /// A broken invariant.
    #[error("{0}")]
    Internal(Internal),
}

impl ReduceError {
    /// The elements it accuses, or parts of them.
    #[must_use]
    pub fn elements(&self) -> Vec<&str> {
        let (first, rest): (Option<&str>, &[String]) = match self {
            Self::Position { .. } | Self::Unfit(_) | Self::Internal(_) => (None, &[]),
            Self::NotIdeal { device } => (Some(device), &[]),
            Self::Sources { elements } | Self::Port { elements } => (None, elements),
            Self::Feedthrough { storage, ports } => (Some(storage), ports),
            Self::SourceRate { port, sources } => (Some(port), sources),
            Self::Singular { elements } => (None, elements),
        };
        // Of a storage label `v(c1)` the element.
        let element = |label| {
            let inner = |(_, rest): (&str, _)| str::strip_suffix(rest, ')');
            str::split_once(label, '(').and_then(inner).unwrap_or(label)
        };
        let all = first.into_iter().chain(rest.iter().map(String::as_str));
        all.map(element).collect()
    }
}

fn conflict(elements: &[String]) -> String {
    match elements {
        [one] => format!("{one} is shorted, or its current has no way back"),
        _ => format!(
            "{} contradict each other: a loop of voltage sources and shorts or a cut-set of current sources and open \
             branches",
            elements.join(", ")
        ),
    }
}

/// Reduces a behaviour to the system of one position.
///
/// With all devices [`Hold::Free`] this is the complementarity system; with all held it is the linear system of that
/// mode, whose guards stand in [`held`](LcsParts::held).
///
/// # Errors
/// [`ReduceError`], naming elements, where the position has no such system.
pub fn reduce(behaviour: &StaticMultiport, position: &Position) -> Result<Lcs, ReduceError> {
    reduce_in(behaviour, position, None)
}

/// As [`reduce`], with fast states apart from slow ones, those that move within `span` seconds: x is another basis than that of its
/// names. What reads x through [`Storage`](super::Storage) and rows sees no difference but digits.
///
/// # Errors
/// As [`reduce`].
pub(crate) fn reduce_apart(
    behaviour: &StaticMultiport,
    position: &Position,
    span: f64,
) -> Result<Lcs, ReduceError> {
    reduce_in(behaviour, position, Some(span))
}

/// See [`SparseLcs::of`].
pub(in crate::lcs) fn reduce_sparse(
    behaviour: &StaticMultiport,
    position: &Position,
) -> Result<(SparseLcs, Readings), ReduceError> {
    check(behaviour, position)?;
    let reduction = reduction(behaviour, behaviour.ball(), position)?;
    Ok(compressed::publish(behaviour, position, &reduction))
}

fn reduce_in(
    behaviour: &StaticMultiport,
    position: &Position,
    apart: Option<f64>,
) -> Result<Lcs, ReduceError> {
    check(behaviour, position)?;
    let (parts, precise) = published(behaviour, behaviour.ball(), position, apart)?;
    let parts = if precise || behaviour.inexact || behaviour.rough {
        parts
    } else {
        exact(behaviour, position, apart)?
    };
    Ok(Lcs::new(parts)?)
}

/// The system reduced over rationals. Fractions double their length with each fast state that is taken apart, so that this is done to 75 digits;
/// where they are too few nothing is taken apart.
fn exact(
    behaviour: &StaticMultiport,
    position: &Position,
    apart: Option<f64>,
) -> Result<LcsParts, ReduceError> {
    let exact = reduction(behaviour, behaviour.rational(), position)?;
    if let Some(span) = apart {
        let mut long = exact.over(LongBall::from_rational);
        long.separate(span);
        let (parts, precise) = publish(behaviour, position, &long, apart);
        if precise {
            return Ok(parts);
        }
    }
    Ok(publish(behaviour, position, &exact, None).0)
}

fn published<F: Field>(
    behaviour: &StaticMultiport,
    reduced: &Reduced<F>,
    position: &Position,
    apart: Option<f64>,
) -> Result<(LcsParts, bool), ReduceError> {
    let mut reduction = reduction(behaviour, reduced, position)?;
    if let Some(span) = apart {
        reduction.separate(span);
    }
    Ok(publish(behaviour, position, &reduction, apart))
}

fn reduction<F: Field>(
    behaviour: &StaticMultiport,
    reduced: &Reduced<F>,
    position: &Position,
) -> Result<Reduction<F>, ReduceError> {
    let mut reduction = in_some_order(behaviour, reduced, position)?;
    let mut exchanged = BTreeSet::new();
    let mut of = Digits::All;
    while let Some(lost) = roles::lost(behaviour, &reduction, of) {
        of = Digits::Leaks;
        let known = exchanged.len();
        exchanged.extend(lost);
        if exchanged.len() == known {
            break;
        }
        match in_some_order(&roles::exchanged(behaviour, &exchanged), reduced, position) {
            Ok(other) => reduction = other,
            Err(_) => break,
        }
    }
    Ok(reduction)
}

fn check(behaviour: &StaticMultiport, position: &Position) -> Result<(), ReduceError> {
    let counts = [
        ("devices", position.devices.len(), behaviour.pairs.len()),
        (
            "switches",
            position.switches.len(),
            behaviour.switches.len(),
        ),
    ];
    for (what, given, expected) in counts {
        if given != expected {
            return Err(ReduceError::Position {
                what,
                given,
                expected,
            });
        }
    }
    for (pair, hold) in behaviour.pairs.iter().zip(&position.devices) {
        let ideal = !pair.fixed_role && pair.port.law.is_ideal_diode();
        if *hold != Hold::Free && !ideal {
            return Err(ReduceError::NotIdeal {
                device: pair.port.device.clone(),
            });
        }
    }
    Ok(())
}

/// The order of the classes. Greedy order alone can accuse a sound active network, so others are tried before an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ClassOrder {
    /// That of the module.
    Standard,
    /// Of each device first the quantity that is otherwise second choice.
    OtherRole,
    /// Devices before the rates of storage.
    DevicesFirst,
    /// Both.
    OtherRoleFirst,
}

/// The reduction over one field.
fn in_some_order<F: Field>(
    behaviour: &StaticMultiport,
    reduced: &Reduced<F>,
    position: &Position,
) -> Result<Reduction<F>, ReduceError> {
    let first = Eliminated::new(behaviour, reduced, position, ClassOrder::Standard)?.system();
    let Err(mut error) = first else { return first };
    let is_port = |error: &ReduceError| matches!(error, ReduceError::Port { .. });
    if matches!(error, ReduceError::Sources { .. }) || position.storage == StorageHold::Static {
        return Err(error);
    }
    for order in [
        ClassOrder::OtherRole,
        ClassOrder::DevicesFirst,
        ClassOrder::OtherRoleFirst,
    ] {
        match Eliminated::new(behaviour, reduced, position, order).and_then(Eliminated::system) {
            // The port was accused as the order was unfortunate.
            Err(rate @ ReduceError::SourceRate { .. }) if is_port(&error) => error = rate,
            Err(_) => {}
            found => return found,
        }
    }
    Err(error)
}

/// A row over [x | λ | u | u' | 1] that must vanish, and the elements whose loop or cut-set it is.
type Constraint<F> = (SparseRow<F>, Vec<String>);

/// A system over a field, before it is written as doubles.
#[derive(Debug)]
struct Reduction<F> {
    /// Storage indices of the states.
    states: Vec<usize>,
    /// States that stand for what decays fast, in order of elimination.
    fast: Vec<usize>,
    /// The free pairs and their roles.
    pairs: Vec<(usize, Role)>,
    /// Rows over [x | λ | u | u' | 1]: x', one per state.
    rates: Vec<SparseRow<F>>,
    /// y, one per free pair.
    y: Vec<SparseRow<F>>,
    /// s, one per storage quantity.
    s: Vec<SparseRow<F>>,
    /// One per observed quantity, each with its impulse row over s⁻ − s⁺.
    readings: Vec<(SparseRow<F>, SparseRow<F>)>,
    /// One per held pair, in the same way.
    guards: Vec<(SparseRow<F>, SparseRow<F>)>,
    /// Guards × undetermined directions.
    kernel: Vec<SparseRow<F>>,
    /// How many undetermined directions the objectives of a least-norm choice see.
    undetermined: usize,
    /// Rows that must vanish, and the elements that make them.
    constraints: Vec<Constraint<F>>,
    /// n rows over the columns of u.
    shift: Vec<SparseRow<F>>,
    /// n×(q + 1): J and the constant.
    inject: Vec<SparseRow<F>>,
    /// n×n.
    energy: Vec<SparseRow<F>>,
    /// q×q entries.
    metric: Vec<(usize, usize, F)>,
    /// What a least-norm choice has settled.
    notes: Vec<String>,
}

impl<F> Reduction<F> {
    /// The same with other numbers.
    fn over<G>(&self, number: impl Fn(&F) -> G) -> Reduction<G> {
        let row = |row: &SparseRow<F>| -> SparseRow<G> {
            row.iter().map(|(column, x)| (*column, number(x))).collect()
        };
        let rows = |rows: &[SparseRow<F>]| rows.iter().map(row).collect();
        let pairs = |pairs: &[(SparseRow<F>, SparseRow<F>)]| {
            pairs.iter().map(|(a, b)| (row(a), row(b))).collect()
        };
        let constraint = |(a, elements): &Constraint<F>| (row(a), elements.clone());
        Reduction {
            states: self.states.clone(),
            fast: self.fast.clone(),
            pairs: self.pairs.clone(),
            rates: rows(&self.rates),
            y: rows(&self.y),
            s: rows(&self.s),
            readings: pairs(&self.readings),
            guards: pairs(&self.guards),
            kernel: rows(&self.kernel),
            undetermined: self.undetermined,
            constraints: self.constraints.iter().map(constraint).collect(),
            shift: rows(&self.shift),
            inject: rows(&self.inject),
            energy: rows(&self.energy),
            metric: (self.metric.iter())
                .map(|(a, b, x)| (*a, *b, number(x)))
                .collect(),
            notes: self.notes.clone(),
        }
    }
}

#[cfg(test)]
pub(super) mod oracle {
    use super::*;

    type Published = Result<(LcsParts, bool), ReduceError>;

    /// The system over balls (with whether it is precise) and over rationals.
    pub(in crate::lcs) fn both(
        behaviour: &StaticMultiport,
        position: &Position,
    ) -> (Published, Published) {
        let ball = in_some_order(behaviour, behaviour.ball(), position);
        let exact = in_some_order(behaviour, behaviour.rational(), position);
        (
            ball.map(|r| publish(behaviour, position, &r, None)),
            exact.map(|r| publish(behaviour, position, &r, None)),
        )
    }

    /// Whether the standard order of classes suffices.
    pub(in crate::lcs) fn standard_order_suffices(
        behaviour: &StaticMultiport,
        position: &Position,
    ) -> bool {
        let order = ClassOrder::Standard;
        Eliminated::new(behaviour, behaviour.ball(), position, order)
            .and_then(Eliminated::system)
            .is_ok()
    }
}

#[cfg(test)]
mod tests {
    use crate::mna::behaviour;
    use crate::mna::fixture::circuit;

    use nalgebra::DMatrix;

    use super::*;

    /// Two rectifiers on one supply, whose inductors share the current through 1 MΩ; which of their diodes conduct.
    fn rectifiers(which: &str, ground: &str) -> (StaticMultiport, Position) {
        let mut netlist =
            "va a 0 1\n vb b 0 2\n vc c 0 3\n la a sa 0.1m\n lb b sb 0.1m\n lc c sc 0.1m\n"
                .to_string();
        for k in 0..2 {
            for phase in ["a", "b", "c"] {
                netlist += &format!(
                    "l{phase}{k} s{phase} m{phase}{k} 1.0{k}m\n r{phase}{k} m{phase}{k} x{phase}{k} 50m\n \
                     du{phase}{k} x{phase}{k} p{k}\n dd{phase}{k} n{k} x{phase}{k}\n"
                );
            }
            netlist +=
                &format!("c{k} p{k} n{k} 1m\n r{k} p{k} n{k} 3{k}\n rg{k} n{k} 0 {ground}\n");
        }
        let behaviour = behaviour(&circuit(&netlist)).unwrap();
        let hold = |c| if c == '#' { Hold::Closed } else { Hold::Open };
        let position = Position {
            devices: which.chars().map(hold).collect(),
            switches: Vec::new(),
            storage: StorageHold::Dynamic,
        };
        (behaviour, position)
    }

    #[test]
    fn states_taken_apart_to_75_digits_are_those_of_fractions() {
        for which in ["#..##.#..##.", "#..#..#..##.", "#..#..#..#.."] {
            let (behaviour, position) = rectifiers(which, "1meg");
            let span = 2e-3;
            let found = exact(&behaviour, &position, Some(span)).unwrap();
            let mut fractions = reduction(&behaviour, behaviour.rational(), &position).unwrap();
            fractions.separate(span);
            let (known, _) = publish(&behaviour, &position, &fractions, Some(span));
            assert!(found.fast.len() >= 2, "{which}: {:?}", found.fast);
            let same = |a: &DMatrix<f64>, b: &DMatrix<f64>| {
                assert_eq!(a.shape(), b.shape());
                let close = |(a, b): (&f64, &f64)| (a - b).abs() <= f64::EPSILON * b.abs();
                a.iter().zip(b.iter()).all(close)
            };
            assert!(same(&found.a, &known.a), "{which}: {} {}", found.a, known.a);
            assert!(same(&found.e, &known.e), "{which}: {} {}", found.e, known.e);
            assert!(same(&found.storage.x, &known.storage.x));
            assert!(same(&found.held.guard.x, &known.held.guard.x));
        }
    }

    #[test]
    fn what_75_digits_do_not_know_is_not_taken_apart() {
        let (behaviour, position) = rectifiers("#..##.#..##.", "1e80");
        let found = exact(&behaviour, &position, Some(2e-3)).unwrap();
        let known = exact(&behaviour, &position, None).unwrap();
        assert!(found.fast.is_empty());
        assert_eq!(found.a, known.a);
    }
}
