//! Writes a reduction as matrices of doubles with names and units.

use nalgebra::{DMatrix, DVector};

use crate::algebra::{Field, SparseRow, entry, part};
use crate::lcs::{Held, Hold, LcsParts, Outputs, Port, PowerTerm, Role, Rows, State, Storage};
use crate::mna::StaticMultiport;

use super::{Position, Reduction, StorageHold};

/// Rounds numbers to doubles and remembers whether all of them were known well enough.
struct Rounding {
    precise: bool,
}

impl Rounding {
    fn number<F: Field>(&mut self, x: &F) -> f64 {
        if x.is_zero() {
            return 0.0;
        }
        self.precise &= x.is_precise();
        x.to_f64()
    }

    /// Columns `columns` of some rows.
    fn matrix<F: Field>(
        &mut self,
        rows: &[&[(usize, F)]],
        columns: std::ops::Range<usize>,
    ) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(rows.len(), columns.len());
        for (r, row) in rows.iter().enumerate() {
            for (c, x) in part(row, columns.clone()) {
                matrix[(r, c - columns.start)] = self.number(x);
            }
        }
        matrix
    }

    /// A over [x | …], known to 1e-14 of each entry or, where `span` is given, well enough that the flow over so many seconds is: what
    /// the radius ρ of A_ij moves, ρ √(W_ii/W_jj) span in units of √energy, is rounding of the state.
    fn rates<F: Field>(
        &mut self,
        rates: &[&[(usize, F)]],
        energy: &[&[(usize, F)]],
        span: Option<f64>,
    ) -> DMatrix<f64> {
        let n = rates.len();
        let stored = |i: usize| {
            let stored = energy.get(i).and_then(|row| entry(row, i));
            stored.map_or(0.0, |stored| stored.to_f64().sqrt())
        };
        let mut matrix = DMatrix::zeros(n, n);
        for (i, row) in rates.iter().enumerate() {
            for (j, rate) in part(row, 0..n) {
                let moved = |span: f64| rate.radius() * span * stored(i) / stored(*j);
                matrix[(i, *j)] = if span.is_some_and(|span| moved(span) <= f64::EPSILON) {
                    rate.to_f64()
                } else {
                    self.number(rate)
                };
            }
        }
        matrix
    }

    fn vector<F: Field>(&mut self, rows: &[&[(usize, F)]], column: usize) -> DVector<f64> {
        let number = |row: &&[(usize, F)]| entry(row, column).map_or(0.0, |x| self.number(x));
        DVector::from_iterator(rows.len(), rows.iter().map(number))
    }

    fn rows<F: Field>(&mut self, rows: &[&[(usize, F)]], n: usize, m: usize, p: usize) -> Rows {
        Rows {
            x: self.matrix(rows, 0..n),
            lambda: self.matrix(rows, n..n + m),
            u: self.matrix(rows, n + m..n + m + p),
            du: self.matrix(rows, n + m + p..n + m + 2 * p),
            one: self.vector(rows, n + m + 2 * p),
        }
    }
}

fn slices<F>(rows: &[SparseRow<F>]) -> Vec<&[(usize, F)]> {
    rows.iter().map(Vec::as_slice).collect()
}

/// The system as doubles, and whether every entry is within 1e-14 of the exact one; of A, for a flow over `span` seconds, what such a flow
/// sees of it.
pub(super) fn publish<F: Field>(
    behaviour: &StaticMultiport,
    position: &Position,
    reduction: &Reduction<F>,
    span: Option<f64>,
) -> (LcsParts, bool) {
    let r = reduction;
    let (n, m, p, q) = (
        r.states.len(),
        r.pairs.len(),
        behaviour.sources.len(),
        behaviour.storage.len(),
    );
    let mut round = Rounding { precise: true };
    let (rates, y, s) = (slices(&r.rates), slices(&r.y), slices(&r.s));
    let energy = slices(&r.energy);
    let (values, impulses): (Vec<_>, Vec<_>) = r
        .readings
        .iter()
        .map(|(row, impulse)| (row.as_slice(), impulse.as_slice()))
        .unzip();
    let pick = |which: &mut dyn Iterator<Item = usize>| -> Vec<&[(usize, F)]> {
        which.filter_map(|k| values.get(k).copied()).collect()
    };
    // An operating point has no impulses.
    let stored = if position.storage == StorageHold::Static {
        0
    } else {
        q
    };
    let width = |rows: &[&[(usize, F)]], width: usize| if rows.is_empty() { 0 } else { width };
    let probes = &behaviour.observed[..behaviour.probes];
    let outputs = Outputs {
        names: probes.iter().map(|probe| probe.name.clone()).collect(),
        units: probes.iter().map(|probe| probe.unit).collect(),
        rows: round.rows(&values[..probes.len()], n, m, p),
        impulse: round.matrix(&impulses[..probes.len()], 0..width(&impulses, stored)),
        power: (behaviour.power.iter())
            .map(|w| PowerTerm {
                element: w.element.clone(),
                kind: w.kind,
            })
            .collect(),
        power_v: round.rows(&pick(&mut behaviour.power.iter().map(|w| w.v)), n, m, p),
        power_i: round.rows(&pick(&mut behaviour.power.iter().map(|w| w.i)), n, m, p),
    };
    let controls = pick(&mut behaviour.switches.iter().map(|s| s.control));
    let guards: Vec<&[(usize, F)]> = r.guards.iter().map(|g| g.0.as_slice()).collect();
    let guard_impulses: Vec<&[(usize, F)]> = r.guards.iter().map(|g| g.1.as_slice()).collect();
    let constraints: Vec<&[(usize, F)]> = r.constraints.iter().map(|c| c.0.as_slice()).collect();
    let kernel = slices(&r.kernel);
    let held_pairs = (position.devices.iter().enumerate())
        .filter(|(_, hold)| **hold != Hold::Free)
        .map(|(k, _)| k)
        .collect();
    let held = Held {
        pairs: held_pairs,
        guard: round.rows(&guards, n, m, p),
        kernel: round.matrix(&kernel, 0..width(&kernel, r.undetermined)),
        constraints: round.rows(&constraints, n, m, p),
        constrained: r.constraints.iter().map(|c| c.1.clone()).collect(),
        impulse: round.matrix(&guard_impulses, 0..width(&guard_impulses, stored)),
    };
    // What is stored takes no part in an operating point.
    let mut metric = DMatrix::zeros(stored, stored);
    for (a, b, x) in r.metric.iter().filter(|_| stored > 0) {
        metric[(*a, *b)] = round.number(x);
    }
    let inject = slices(&r.inject);
    let has_dynamics = n > 0;
    let storage = Storage {
        names: behaviour.storage.iter().map(|s| s.name.clone()).collect(),
        elements: (behaviour.storage.iter())
            .map(|s| s.element.clone())
            .collect(),
        units: (behaviour.storage.iter())
            .map(|s| if s.capacitor { "V" } else { "A" })
            .collect(),
        x: round.matrix(&s, 0..n),
        lambda: round.matrix(&s, n..n + m),
        u: round.matrix(&s, n + m..n + m + p),
        one: round.vector(&s, n + m + 2 * p),
        metric,
        inject: if has_dynamics {
            round.matrix(&inject, 0..q)
        } else {
            DMatrix::zeros(n, q)
        },
        inject_one: if has_dynamics {
            round.vector(&inject, q)
        } else {
            DVector::zeros(n)
        },
        initial: DVector::from_iterator(
            q,
            behaviour.storage.iter().map(|s| s.initial.unwrap_or(0.0)),
        ),
    };
    let parts = LcsParts {
        title: behaviour.title.clone(),
        fast: r.fast.clone(),
        states: r.states.iter().map(|&k| state(behaviour, k)).collect(),
        inputs: behaviour.sources.iter().map(|s| s.input.clone()).collect(),
        ports: r
            .pairs
            .iter()
            .map(|&(k, role)| port(behaviour, k, role))
            .collect(),
        a: round.rates(&rates, &energy, span),
        b: round.matrix(&rates, n..n + m),
        c: round.matrix(&y, 0..n),
        d: round.matrix(&y, n..n + m),
        e: round.matrix(&rates, n + m..n + m + p),
        g: round.matrix(&y, n + m..n + m + p),
        e0: round.vector(&rates, n + m + 2 * p),
        f: round.vector(&y, n + m + 2 * p),
        shift: round.matrix(&slices(&r.shift), n + m..n + m + p),
        energy: round.matrix(&energy, 0..n),
        outputs,
        storage,
        switches: (behaviour.switches.iter())
            .zip(&position.switches)
            .map(|(switch, on)| (switch.name.clone(), *on))
            .collect(),
        controls: round.rows(&controls, n, m, p),
        held,
        notes: r.notes.clone(),
    };
    (parts, round.precise)
}

pub(super) fn state(behaviour: &StaticMultiport, k: usize) -> State {
    let storage = &behaviour.storage[k];
    State {
        name: storage.name.clone(),
        unit: if storage.capacitor { "V" } else { "A" },
    }
}

pub(super) fn port(behaviour: &StaticMultiport, k: usize, role: Role) -> Port {
    let pair = &behaviour.pairs[k];
    let (lambda, y) = match role {
        Role::Voltage => (&pair.reverse_name, &pair.forward_name),
        Role::Current | Role::Function => (&pair.forward_name, &pair.reverse_name),
    };
    Port {
        role,
        lambda: lambda.clone(),
        y: y.clone(),
        ..pair.port.clone()
    }
}

#[cfg(test)]
mod tests {
    use crate::mna::behaviour;
    use crate::mna::fixture::circuit;

    use super::super::in_some_order;
    use super::*;

    /// Three inductors share the current through 1 MΩ beside loads of 50 Ω: in what is slow the balls lose more digits than an entry is to
    /// have, and none that a run of 60 ms sees.
    #[test]
    fn balls_know_the_rates_that_a_run_sees() {
        let netlist = "va a 0 1\n vb b 0 2\n vc c 0 3\n la a a1 1m\n lb b b1 1m\n lc c c1 1m\n d1 a1 p\n d3 b1 p\n d5 c1 p\n \
                       d4 n a1\n d6 n b1\n d2 n c1\n cd p n 1m\n r1 p n 50\n rg n 0 1meg";
        let behaviour = behaviour(&circuit(netlist)).unwrap();
        let [mut known, mut unknown] = [0, 0];
        for which in 0..1_u32 << behaviour.pairs.len() {
            let hold = |k: usize| {
                if which >> k & 1 == 1 {
                    Hold::Closed
                } else {
                    Hold::Open
                }
            };
            let position = Position {
                devices: (0..behaviour.pairs.len()).map(hold).collect(),
                switches: Vec::new(),
                storage: StorageHold::Dynamic,
            };
            let span = 60e-3;
            let Ok(mut reduction) = in_some_order(&behaviour, behaviour.ball(), &position) else {
                continue;
            };
            reduction.separate(span);
            let precise = |span| publish(&behaviour, &position, &reduction, span).1;
            match [precise(Some(span)), precise(None)] {
                [true, true] => {}
                // Over rationals without what the run sees.
                [true, false] => known += 1,
                [false, _] => unknown += 1,
            }
        }
        assert!(known >= 7 && unknown <= 3, "{known} {unknown}");
    }
}
