//! Class-ordered elimination of the port behaviour: from `N [ports; 1] = 0` to (A, B, C, D, E, F, G).
//!
//! The same code makes the complementarity system (all devices free) and the linear system of a mode (all devices held
//! as 0 V or 0 A sources).

use nalgebra::{DMatrix, DVector};

use super::{Held, Hold, Lcs, Outputs, PowerTerm, Role, Rows, State, Storage};
use crate::algebra::{Field, Matrix, eliminate, eliminate_more};
use crate::mna::{Behaviour, Reduced};

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
    /// Capacitors open (i = 0), inductors short (v = 0).
    Static,
}

impl Position {
    /// All devices free, the given switch positions.
    #[must_use]
    pub fn free(behaviour: &Behaviour, switches: Vec<bool>) -> Self {
        Self {
            devices: vec![Hold::Free; behaviour.pairs.len()],
            switches,
            storage: StorageHold::Dynamic,
        }
    }
}

/// Why a behaviour has no system of the wanted form.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ReduceError {
    /// Sources fix each other.
    #[error("the sources {} fix each other: {what}", names.join(", "))]
    SourceConflict {
        /// The sources.
        names: Vec<String>,
        /// Loop of voltage sources or cut-set of current sources.
        what: &'static str,
    },
    /// A constant contradicts itself.
    #[error("the circuit contradicts itself: {0} cannot hold")]
    Contradiction(String),
    /// A device has no role as a port.
    #[error("device {0} is not determined by the circuit around it")]
    UndeterminedPort(String),
    /// A state derivative is not determined.
    #[error(
        "the derivative of {0} is not determined: its capacitor loop or inductor cut-set is singular"
    )]
    SingularStorage(String),
    /// A capacitor voltage or inductor current depends directly on a device.
    #[error(
        "{0} depends directly on a device quantity and on other storage: the system has a higher index"
    )]
    HigherIndex(String),
}

/// Reduces a behaviour in a position.
///
/// Class order of columns, each class exhausted before the next: i_V and v_I; i_C and v_L; device forward quantities;
/// device reverse quantities of devices not used yet; v_C and i_L, those first whose partner stayed free; source values.
/// A column that gets a pivot is dependent, what stays free is x, λ and u.
///
/// # Errors
///
/// See [`ReduceError`].
pub fn reduce(behaviour: &Behaviour, position: &Position) -> Result<Lcs, ReduceError> {
    match reduce_in(behaviour, behaviour.ball(), position)? {
        Some(lcs) => Ok(lcs),
        None => Ok(reduce_in(behaviour, behaviour.rational(), position)?.unwrap_or_default()),
    }
}

/// Relative error of an entry above which the reduction is repeated in rationals.
const ENTRY_ERROR: f64 = 1e-14;

/// Converts exact numbers to doubles and remembers whether any was too uncertain.
struct Reader {
    uncertain: bool,
}

impl Reader {
    fn read<F: Field>(&mut self, number: &F) -> f64 {
        if number.is_zero() {
            return 0.0;
        }
        let value = number.to_f64();
        self.uncertain |= !(number.error() <= ENTRY_ERROR * value.abs());
        value
    }
}

/// `None` when floating balls are too uncertain.
fn reduce_in<F: Field>(
    behaviour: &Behaviour,
    reduced: &Reduced<F>,
    position: &Position,
) -> Result<Option<Lcs>, ReduceError> {
    let layout = Layout::new(behaviour, reduced, position);
    let solved = layout.solve(behaviour, reduced, position)?;
    let mut reader = Reader { uncertain: false };
    let lcs = solved.system(behaviour, position, &layout, &mut reader)?;
    Ok((!reader.uncertain).then_some(lcs))
}

/// Where the columns of a position stand.
struct Layout {
    /// Places of x candidates and their partners, per storage.
    state: Vec<usize>,
    flow: Vec<usize>,
    value: Vec<usize>,
    other: Vec<usize>,
    pairs: Vec<(usize, usize)>,
    one: usize,
    order: Vec<Vec<usize>>,
}

/// The eliminated system still in the field: every quantity as a row over [x | λ | u | u' | 1], x unshifted.
struct Solved<F> {
    /// Storage that are states.
    states: Vec<usize>,
    /// Free pairs and whether λ is the forward quantity.
    ports: Vec<(usize, bool)>,
    /// x' rows.
    rate: Vec<Vec<F>>,
    /// y rows.
    y: Vec<Vec<F>>,
    /// One row per storage: its state quantity.
    storage: Vec<Vec<F>>,
    /// One row per observed quantity, then one per held pair.
    readings: Vec<Vec<F>>,
    /// Loose directions of the readings.
    loose: Vec<Vec<F>>,
    /// Rows that must vanish.
    constraints: Vec<Vec<F>>,
    /// n×q and n: x⁺ = J s⁻ + j.
    inject: Vec<Vec<F>>,
    inject_one: Vec<F>,
    metric: Matrix<F>,
}

impl Layout {
    fn new<F: Field>(behaviour: &Behaviour, reduced: &Reduced<F>, position: &Position) -> Self {
        let place = |c: usize| reduced.place[c].unwrap_or(usize::MAX);
        let mut layout = Self {
            state: behaviour.storage.iter().map(|s| place(s.state)).collect(),
            flow: behaviour.storage.iter().map(|s| place(s.flow)).collect(),
            value: behaviour.sources.iter().map(|s| place(s.value)).collect(),
            other: behaviour.sources.iter().map(|s| place(s.other)).collect(),
            pairs: behaviour
                .pairs
                .iter()
                .map(|p| (place(p.reverse), place(p.forward)))
                .collect(),
            one: place(Behaviour::ONE),
            order: Vec::new(),
        };
        let dynamic = position.storage == StorageHold::Dynamic;
        let mut forward = Vec::new();
        let mut reverse = Vec::new();
        for (k, &(r, f)) in layout.pairs.iter().enumerate() {
            match position.devices[k] {
                Hold::Free if behaviour.pairs[k].fixed_role => forward.push(r),
                Hold::Free => {}
                Hold::Closed => forward.push(f),
                Hold::Open => reverse.push(r),
            }
        }
        for (switch, &on) in behaviour.switches.iter().zip(&position.switches) {
            let (v, i) = (place(switch.v), place(switch.i));
            if on && switch.ron.f64 == 0.0 {
                forward.push(i);
            } else if !on && switch.roff.is_none() {
                reverse.push(v);
            } else {
                forward.push(i);
                reverse.push(v);
            }
        }
        layout.order = vec![layout.other.clone()];
        if dynamic {
            layout.order.push(layout.flow.clone());
        } else {
            // Open capacitors keep an unknown voltage, shorted inductors an unknown current.
            for (k, s) in behaviour.storage.iter().enumerate() {
                if s.capacitor {
                    reverse.push(layout.state[k])
                } else {
                    forward.push(layout.state[k])
                }
            }
        }
        layout.order.push(forward);
        layout.order.push(reverse);
        layout
    }

    /// Columns that are zero in this position.
    fn zeros(
        &self,
        behaviour: &Behaviour,
        reduced_place: &[Option<usize>],
        position: &Position,
    ) -> Vec<usize> {
        let mut zeros = Vec::new();
        for (&(r, f), hold) in self.pairs.iter().zip(&position.devices) {
            match hold {
                Hold::Free => {}
                Hold::Closed => zeros.push(r),
                Hold::Open => zeros.push(f),
            }
        }
        for (switch, &on) in behaviour.switches.iter().zip(&position.switches) {
            if on && switch.ron.f64 == 0.0 {
                zeros.extend(reduced_place[switch.v]);
            } else if !on && switch.roff.is_none() {
                zeros.extend(reduced_place[switch.i]);
            }
        }
        if position.storage == StorageHold::Static {
            zeros.extend(&self.flow);
        }
        zeros
    }

    #[allow(clippy::too_many_lines)]
    fn solve<F: Field>(
        &self,
        behaviour: &Behaviour,
        reduced: &Reduced<F>,
        position: &Position,
    ) -> Result<Solved<F>, ReduceError> {
        let dynamic = position.storage == StorageHold::Dynamic;
        // The port equations, the lines of resistive switches, and the observed rows carried along.
        let resistive: Vec<(usize, usize, F)> = behaviour
            .switches
            .iter()
            .zip(&position.switches)
            .filter_map(|(s, &on)| {
                let (v, i) = (reduced.place[s.v]?, reduced.place[s.i]?);
                match (on, s.roff) {
                    (true, _) if s.ron.f64 != 0.0 => Some((v, i, F::value(s.ron))),
                    (false, Some(roff)) => Some((v, i, F::value(roff))),
                    _ => None,
                }
            })
            .collect();
        let candidates = reduced.ports.rows + resistive.len();
        let cols = reduced.ports.cols;
        let mut m = Matrix::zeros(candidates + reduced.observed.rows, cols);
        for i in 0..reduced.ports.rows {
            for j in 0..cols {
                m.set(i, j, reduced.ports.at(i, j).clone());
            }
        }
        for (k, (v, i, r)) in resistive.iter().enumerate() {
            m.set(reduced.ports.rows + k, *v, F::one());
            m.set(reduced.ports.rows + k, *i, r.neg());
        }
        for i in 0..reduced.observed.rows {
            for j in 0..cols {
                m.set(candidates + i, j, reduced.observed.at(i, j).clone());
            }
        }
        for j in self.zeros(behaviour, &reduced.place, position) {
            for i in 0..m.rows {
                m.set(i, j, F::zero());
            }
        }
        // Classes up to the forward quantities, then free pairs, then reverse, then states and source values.
        let mut pivots: Vec<Option<usize>> = vec![None; cols];
        let mut used = vec![false; candidates];
        let run = |m: &mut Matrix<F>,
                   order: &[usize],
                   pivots: &mut Vec<Option<usize>>,
                   used: &mut Vec<bool>| {
            eliminate_more(m, candidates, order, pivots, used);
        };
        for class in &self.order[..self.order.len() - 1] {
            run(&mut m, class, &mut pivots, &mut used);
        }
        let free: Vec<usize> = (0..self.pairs.len())
            .filter(|&k| position.devices[k] == Hold::Free)
            .collect();
        let swappable = |k: &&usize| !behaviour.pairs[**k].fixed_role;
        let forward: Vec<usize> = free
            .iter()
            .filter(swappable)
            .map(|&k| self.pairs[k].1)
            .collect();
        run(&mut m, &forward, &mut pivots, &mut used);
        let unused: Vec<usize> = free
            .iter()
            .filter(swappable)
            .filter(|&&k| pivots[self.pairs[k].1].is_none())
            .map(|&k| self.pairs[k].0)
            .collect();
        let mut reverse = unused;
        reverse.extend(self.order.last().into_iter().flatten());
        run(&mut m, &reverse, &mut pivots, &mut used);
        if dynamic {
            let (first, second): (Vec<usize>, Vec<usize>) =
                (0..self.state.len()).partition(|&k| pivots[self.flow[k]].is_none());
            let order: Vec<usize> = first
                .into_iter()
                .chain(second)
                .map(|k| self.state[k])
                .collect();
            run(&mut m, &order, &mut pivots, &mut used);
        }
        run(&mut m, &self.value, &mut pivots, &mut used);

        let mut ports = Vec::new();
        for &k in &free {
            let (r, f) = self.pairs[k];
            match (pivots[r].is_some(), pivots[f].is_some()) {
                (false, true) => ports.push((k, false)),
                (true, false) => ports.push((k, true)),
                _ => {
                    return Err(ReduceError::UndeterminedPort(
                        behaviour.pairs[k].port.device.clone(),
                    ));
                }
            }
        }
        let held_any = position.devices.iter().any(|h| *h != Hold::Free);
        let states: Vec<usize> = if dynamic {
            (0..self.state.len())
                .filter(|&k| pivots[self.state[k]].is_none())
                .collect()
        } else {
            Vec::new()
        };

        // The columns of the rows to come: [x | λ | u | u' | 1], then the loose unknowns f.
        let (n, mm, p) = (states.len(), ports.len(), self.value.len());
        let lambda: Vec<usize> = ports
            .iter()
            .map(|&(k, fwd)| {
                if fwd {
                    self.pairs[k].1
                } else {
                    self.pairs[k].0
                }
            })
            .collect();
        let mut role = vec![None; cols];
        for (j, &k) in states.iter().enumerate() {
            role[self.state[k]] = Some(j);
        }
        for (j, &c) in lambda.iter().enumerate() {
            role[c] = Some(n + j);
        }
        for (j, &c) in self.value.iter().enumerate() {
            if pivots[c].is_none() {
                role[c] = Some(n + mm + j);
            }
        }
        role[self.one] = Some(n + mm + 2 * p);
        let width = n + mm + 2 * p + 1;
        let zero_columns = self.zeros(behaviour, &reduced.place, position);
        let loose: Vec<usize> = (0..cols)
            .filter(|&c| pivots[c].is_none() && role[c].is_none() && !zero_columns.contains(&c))
            .collect();
        let mut loose_at = vec![None; cols];
        for (j, &c) in loose.iter().enumerate() {
            loose_at[c] = Some(j);
        }
        let nf = loose.len();
        // A quantity (column) or a carried row as a row over `width + nf` columns.
        let combine = |sign_minus: bool, row: &[F], skip: Option<usize>| -> Vec<F> {
            let mut out = vec![F::zero(); width + nf];
            for (c, v) in row.iter().enumerate() {
                if Some(c) == skip || v.is_zero() {
                    continue;
                }
                let v = if sign_minus { v.neg() } else { v.clone() };
                if let Some(j) = role[c] {
                    out[j] = v;
                } else if let Some(j) = loose_at[c] {
                    out[width + j] = v;
                }
            }
            out
        };
        let quantity = |c: usize| -> Vec<F> {
            if let Some(r) = pivots[c] {
                return combine(true, m.row(r), Some(c));
            }
            let mut out = vec![F::zero(); width + nf];
            if let Some(j) = role[c] {
                out[j] = F::one();
            } else if let Some(j) = loose_at[c] {
                out[width + j] = F::one();
            }
            out
        };

        // What must vanish: dependent source values and rows without a pivot.
        let mut constraints = Vec::new();
        for (k, &c) in self.value.iter().enumerate() {
            let Some(row) = pivots[c] else { continue };
            let mut residual = combine(true, m.row(row), Some(c));
            residual[n + mm + k] = residual[n + mm + k].sub(&F::one());
            if !held_any && position.storage == StorageHold::Dynamic
                || (dynamic && ports.len() == self.pairs.len())
            {
                let names: Vec<usize> = (0..p)
                    .filter(|&j| !residual[n + mm + j].is_zero())
                    .collect();
                let identical = names.len() == 2
                    && names.iter().all(|&j| {
                        behaviour.sources[j].input.source
                            == behaviour.sources[names[0]].input.source
                    })
                    && residual[n + mm + names[0]]
                        .add(&residual[n + mm + names[1]])
                        .is_zero();
                if !identical {
                    let voltage = behaviour.sources[k].input.unit == "V";
                    return Err(ReduceError::SourceConflict {
                        names: names
                            .iter()
                            .map(|&j| behaviour.sources[j].input.name.clone())
                            .collect(),
                        what: if voltage {
                            "a loop of voltage sources"
                        } else {
                            "a cut-set of current sources"
                        },
                    });
                }
            } else {
                constraints.push(residual);
            }
        }
        for row in (0..candidates).filter(|&r| !used[r]) {
            let residual = combine(false, m.row(row), None);
            if residual.iter().any(|v| !v.is_zero()) {
                if !held_any {
                    return Err(ReduceError::Contradiction("a constant equation".into()));
                }
                constraints.push(residual);
            }
        }

        // Storage rows and the dynamic equations P s' = flow.
        let q = self.state.len();
        let storage: Vec<Vec<F>> = (0..q).map(|k| quantity(self.state[k])).collect();
        let mut metric = Matrix::<F>::zeros(q, q);
        for &(i, j, value) in &behaviour.metric {
            metric.set(i, j, value.in_field());
        }
        let mut rate = Vec::new();
        let mut inject = Vec::new();
        let mut inject_one = Vec::new();
        let mut loose_rows: Vec<Option<Vec<F>>> = vec![None; nf];
        if dynamic {
            for (k, row) in storage.iter().enumerate() {
                let direct = row[n..n + mm]
                    .iter()
                    .chain(&row[width..])
                    .any(|v| !v.is_zero());
                if pivots[self.state[k]].is_some() && direct {
                    return Err(ReduceError::HigherIndex(behaviour.storage[k].name.clone()));
                }
            }
            // Unknowns [x' | f]; knowns [x | λ | u | u' | 1 | s⁻ | 1 for the jump].
            let known = n + nf;
            let mut a = Matrix::zeros(q, known + width + q + 1);
            for k in 0..q {
                for l in 0..q {
                    let w = metric.at(k, l).clone();
                    if w.is_zero() {
                        continue;
                    }
                    for j in 0..n {
                        a.add_to(k, j, &w.mul(&storage[l][j]));
                    }
                    for j in 0..p {
                        // P S_u u' stands on the left.
                        a.add_to(k, known + n + mm + p + j, &w.mul(&storage[l][n + mm + j]));
                    }
                    a.add_to(k, known + width + l, &w.neg());
                    a.add_to(k, known + width + q, &w.mul(&storage[l][width - 1]));
                }
                for (j, v) in quantity(self.flow[k]).into_iter().enumerate() {
                    if j < width {
                        a.add_to(k, known + j, &v.neg());
                    } else {
                        a.add_to(k, n + j - width, &v.neg());
                    }
                }
            }
            let found = eliminate(&mut a, q, 0..known);
            for (j, &k) in states.iter().enumerate() {
                let Some(r) = found[j] else {
                    return Err(ReduceError::SingularStorage(
                        behaviour.storage[k].name.clone(),
                    ));
                };
                if (n..known).any(|c| found[c].is_none() && !a.at(r, c).is_zero()) {
                    return Err(ReduceError::SingularStorage(
                        behaviour.storage[k].name.clone(),
                    ));
                }
                rate.push((0..width).map(|c| a.at(r, known + c).neg()).collect());
                inject.push((0..q).map(|c| a.at(r, known + width + c).neg()).collect());
                inject_one.push(a.at(r, known + width + q).neg());
            }
            for j in 0..nf {
                loose_rows[j] = found[n + j].map(|r| {
                    let mut row: Vec<F> = (0..width).map(|c| a.at(r, known + c).neg()).collect();
                    row.extend((0..nf).map(|c| {
                        if c == j {
                            F::zero()
                        } else {
                            a.at(r, n + c).neg()
                        }
                    }));
                    row
                });
            }
            let spare: Vec<usize> = (0..q).filter(|r| !found.contains(&Some(*r))).collect();
            for r in spare {
                if (0..width).any(|c| !a.at(r, known + c).is_zero()) {
                    let names = behaviour
                        .storage
                        .iter()
                        .map(|s| s.name.as_str())
                        .collect::<Vec<_>>()
                        .join(", ");
                    return Err(ReduceError::HigherIndex(names));
                }
            }
        }
        // Put the solved f back into every row; what is still loose spans the kernel.
        let kernel: Vec<usize> = (0..nf).filter(|&j| loose_rows[j].is_none()).collect();
        let close = |row: Vec<F>| -> (Vec<F>, Vec<F>) {
            let mut out = row[..width].to_vec();
            let mut rest: Vec<F> = kernel.iter().map(|&j| row[width + j].clone()).collect();
            for (j, solved) in loose_rows.iter().enumerate() {
                let (Some(solved), factor) = (solved, &row[width + j]) else {
                    continue;
                };
                if factor.is_zero() {
                    continue;
                }
                for (c, o) in out.iter_mut().enumerate() {
                    *o = o.add(&factor.mul(&solved[c]));
                }
                for (r, &jj) in rest.iter_mut().zip(&kernel) {
                    *r = r.add(&factor.mul(&solved[width + jj]));
                }
            }
            (out, rest)
        };
        let mut readings = Vec::new();
        let mut loose_readings = Vec::new();
        let mut push = |row: Vec<F>| {
            let (out, rest) = close(row);
            readings.push(out);
            loose_readings.push(rest);
        };
        for i in 0..reduced.observed.rows {
            push(combine(false, m.row(candidates + i), None));
        }
        for (k, hold) in position.devices.iter().enumerate() {
            match hold {
                Hold::Free => {}
                Hold::Closed => push(quantity(self.pairs[k].1)),
                Hold::Open => push(quantity(self.pairs[k].0)),
            }
        }
        let y = ports
            .iter()
            .map(|&(k, fwd)| {
                close(quantity(if fwd {
                    self.pairs[k].0
                } else {
                    self.pairs[k].1
                }))
                .0
            })
            .collect();
        Ok(Solved {
            states,
            ports,
            rate,
            y,
            storage: storage.into_iter().map(|r| close(r).0).collect(),
            readings,
            loose: loose_readings,
            constraints: constraints.into_iter().map(|r| close(r).0).collect(),
            inject,
            inject_one,
            metric,
        })
    }
}

impl<F: Field> Solved<F> {
    fn system(
        &self,
        behaviour: &Behaviour,
        position: &Position,
        layout: &Layout,
        reader: &mut Reader,
    ) -> Result<Lcs, ReduceError> {
        let (n, m, p, q) = (
            self.states.len(),
            self.ports.len(),
            layout.value.len(),
            self.storage.len(),
        );
        // x = x_shifted + T u, T the u' columns of x'.
        let t = |i: usize, j: usize| &self.rate[i][n + m + p + j];
        let shifted = |rows: &[Vec<F>], reader: &mut Reader| -> Rows {
            let count = rows.len();
            let mut out = Rows {
                x: DMatrix::zeros(count, n),
                lambda: DMatrix::zeros(count, m),
                u: DMatrix::zeros(count, p),
                du: DMatrix::zeros(count, p),
                one: DVector::zeros(count),
            };
            for (i, row) in rows.iter().enumerate() {
                for j in 0..n {
                    out.x[(i, j)] = reader.read(&row[j]);
                }
                for j in 0..m {
                    out.lambda[(i, j)] = reader.read(&row[n + j]);
                }
                for j in 0..p {
                    let moved = (0..n).fold(row[n + m + j].clone(), |s, k| {
                        if row[k].is_zero() || t(k, j).is_zero() {
                            s
                        } else {
                            s.add(&row[k].mul(t(k, j)))
                        }
                    });
                    out.u[(i, j)] = reader.read(&moved);
                    out.du[(i, j)] = reader.read(&row[n + m + p + j]);
                }
                out.one[i] = reader.read(&row[n + m + 2 * p]);
            }
            out
        };
        let rate = shifted(&self.rate, reader);
        let y = shifted(&self.y, reader);
        let storage = shifted(&self.storage, reader);
        let mut readings = shifted(&self.readings, reader);
        let constraints = shifted(&self.constraints, reader);
        let held: Vec<usize> = (0..position.devices.len())
            .filter(|&k| position.devices[k] != Hold::Free)
            .collect();
        let observed = behaviour.observed.len();
        let kernel_all = DMatrix::from_fn(
            self.readings.len(),
            self.loose.first().map_or(0, Vec::len),
            |i, j| reader.read(&self.loose[i][j]),
        );
        least_norm(&mut readings, &kernel_all, observed);

        let shift = DMatrix::from_fn(n, p, |i, j| reader.read(t(i, j)));
        let metric = DMatrix::from_fn(q, q, |i, j| reader.read(self.metric.at(i, j)));
        let inject = DMatrix::from_fn(n, q, |i, j| reader.read(&self.inject[i][j]));
        let inject_one = DVector::from_fn(n, |i, _| reader.read(&self.inject_one[i]));
        let states = self
            .states
            .iter()
            .map(|&k| State {
                name: behaviour.storage[k].name.clone(),
                unit: if behaviour.storage[k].capacitor {
                    "V"
                } else {
                    "A"
                },
            })
            .collect();
        let ports = self
            .ports
            .iter()
            .map(|&(k, forward)| {
                let pair = &behaviour.pairs[k];
                let mut port = pair.port.clone();
                let (lambda, y) = if forward {
                    (&pair.forward_name, &pair.reverse_name)
                } else {
                    (&pair.reverse_name, &pair.forward_name)
                };
                port.lambda.clone_from(lambda);
                port.y.clone_from(y);
                port.role = match (pair.fixed_role, forward) {
                    (true, _) => Role::Function,
                    (false, true) => Role::Current,
                    (false, false) => Role::Voltage,
                };
                port
            })
            .collect();
        let select = |rows: &Rows, which: &[usize]| Rows {
            x: rows.x.select_rows(which),
            lambda: rows.lambda.select_rows(which),
            u: rows.u.select_rows(which),
            du: rows.du.select_rows(which),
            one: rows.one.select_rows(which),
        };
        let probes: Vec<usize> = (0..behaviour.probes).collect();
        let energy = storage.x.transpose() * &metric * &storage.x;
        Ok(Lcs {
            title: behaviour.title.clone(),
            states,
            inputs: behaviour.sources.iter().map(|s| s.input.clone()).collect(),
            ports,
            a: rate.x,
            b: rate.lambda,
            c: y.x,
            d: y.lambda,
            e: rate.u,
            g: y.u,
            e0: rate.one,
            f: y.one,
            shift,
            energy,
            outputs: Outputs {
                names: probes
                    .iter()
                    .map(|&k| behaviour.observed[k].name.clone())
                    .collect(),
                units: probes.iter().map(|&k| behaviour.observed[k].unit).collect(),
                rows: select(&readings, &probes),
                power: behaviour
                    .power
                    .iter()
                    .map(|w| PowerTerm {
                        element: w.element.clone(),
                        kind: w.kind,
                    })
                    .collect(),
                power_v: select(
                    &readings,
                    &behaviour.power.iter().map(|w| w.v).collect::<Vec<_>>(),
                ),
                power_i: select(
                    &readings,
                    &behaviour.power.iter().map(|w| w.i).collect::<Vec<_>>(),
                ),
            },
            storage: Storage {
                names: behaviour.storage.iter().map(|s| s.name.clone()).collect(),
                x: storage.x,
                lambda: storage.lambda,
                u: storage.u,
                one: storage.one,
                metric,
                inject,
                inject_one,
                initial: DVector::from_iterator(
                    q,
                    behaviour.storage.iter().map(|s| s.initial.unwrap_or(0.0)),
                ),
            },
            switches: behaviour
                .switches
                .iter()
                .map(|s| s.name.clone())
                .zip(position.switches.iter().copied())
                .collect(),
            controls: select(
                &readings,
                &behaviour
                    .switches
                    .iter()
                    .map(|s| s.control)
                    .collect::<Vec<_>>(),
            ),
            held: Held {
                guard: select(
                    &readings,
                    &(observed..observed + held.len()).collect::<Vec<_>>(),
                ),
                kernel: kernel_all.rows(observed, held.len()).into_owned(),
                pairs: held,
                constraints,
            },
        })
    }
}

/// Adds the combination of kernel columns that makes the held readings (all readings where nothing is held) smallest.
fn least_norm(readings: &mut Rows, kernel: &DMatrix<f64>, observed: usize) {
    if kernel.ncols() == 0 {
        return;
    }
    let held = readings.one.len() - observed;
    let (from, count) = if held > 0 {
        (observed, held)
    } else {
        (0, observed)
    };
    let part = kernel.rows(from, count).into_owned();
    let svd = part.svd(true, true);
    let threshold =
        svd.singular_values.max() * f64::EPSILON * (kernel.nrows().max(kernel.ncols()) as f64);
    let Ok(inverse) = svd.pseudo_inverse(threshold) else {
        return;
    };
    let correction = kernel * inverse;
    let project = |m: &mut DMatrix<f64>| {
        let seen = m.rows(from, count).into_owned();
        *m -= &correction * seen;
    };
    project(&mut readings.x);
    project(&mut readings.lambda);
    project(&mut readings.u);
    project(&mut readings.du);
    let seen = readings.one.rows(from, count).into_owned();
    readings.one -= &correction * seen;
}
