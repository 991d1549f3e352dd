//! Writes a reduction as compressed rows of doubles.

use std::ops::Range;

use super::publish::{port, state};
use super::{Position, Reduction};
use crate::algebra::{Field, SparseRow, entry, part};
use crate::lcs::sparse::{Csr, Readings, SparseLcs, SparseRows};
use crate::mna::StaticMultiport;

/// Counts the numbers that are not known well enough.
struct Rounding {
    imprecise: usize,
}

impl Rounding {
    fn number<F: Field>(&mut self, x: &F) -> f64 {
        self.imprecise += usize::from(!x.is_precise());
        x.to_f64()
    }

    fn matrix<'r, F: Field + 'r>(
        &mut self,
        rows: impl IntoIterator<Item = &'r SparseRow<F>>,
        columns: Range<usize>,
    ) -> Csr {
        let mut matrix = Csr::new(columns.len());
        for row in rows {
            let entries = part(row, columns.clone()).iter();
            matrix.push(entries.map(|(c, x)| (c - columns.start, self.number(x))));
        }
        matrix
    }

    fn vector<'r, F: Field + 'r>(
        &mut self,
        rows: impl IntoIterator<Item = &'r SparseRow<F>>,
        column: usize,
    ) -> Vec<f64> {
        let number = |row: &'r SparseRow<F>| entry(row, column).map_or(0.0, |x| self.number(x));
        rows.into_iter().map(number).collect()
    }
}

/// The columns of [x | λ | u | u' | 1].
struct Layout {
    x: Range<usize>,
    lambda: Range<usize>,
    u: Range<usize>,
    du: Range<usize>,
    one: usize,
}

impl Rounding {
    fn rows<'r, F: Field + 'r>(
        &mut self,
        rows: &[&'r SparseRow<F>],
        columns: &Layout,
    ) -> SparseRows {
        let mut block = |columns: &Range<usize>| self.matrix(rows.iter().copied(), columns.clone());
        SparseRows {
            x: block(&columns.x),
            lambda: block(&columns.lambda),
            u: block(&columns.u),
            du: block(&columns.du),
            one: self.vector(rows.iter().copied(), columns.one),
        }
    }
}

/// The system as doubles, and what a run reads besides.
pub(super) fn publish<F: Field>(
    behaviour: &StaticMultiport,
    position: &Position,
    r: &Reduction<F>,
) -> (SparseLcs, Readings) {
    let (n, m, p) = (r.states.len(), r.pairs.len(), behaviour.sources.len());
    let (lambda, u) = (n..n + m, n + m..n + m + p);
    let (du, one) = (u.end..u.end + p, u.end + p);
    let columns = Layout {
        x: 0..n,
        lambda: lambda.clone(),
        u: u.clone(),
        du,
        one,
    };
    let probes = &behaviour.observed[..behaviour.probes];
    let reading = |k: usize| &r.readings[k].0;
    let some = |which: &mut dyn Iterator<Item = usize>| -> Vec<&SparseRow<F>> {
        which.map(reading).collect()
    };
    let q = behaviour.storage.len();
    let mut round = Rounding { imprecise: 0 };
    let mut system = SparseLcs {
        title: behaviour.title.clone(),
        states: r.states.iter().map(|&k| state(behaviour, k)).collect(),
        inputs: behaviour.sources.iter().map(|s| s.input.clone()).collect(),
        ports: (r.pairs.iter())
            .map(|&(k, role)| port(behaviour, k, role))
            .collect(),
        a: round.matrix(&r.rates, 0..n),
        b: round.matrix(&r.rates, lambda.clone()),
        c: round.matrix(&r.y, 0..n),
        d: round.matrix(&r.y, lambda.clone()),
        e: round.matrix(&r.rates, u.clone()),
        g: round.matrix(&r.y, u.clone()),
        e0: round.vector(&r.rates, one),
        f: round.vector(&r.y, one),
        shift: round.matrix(&r.shift, u.clone()),
        energy: round.matrix(&r.energy, 0..n),
        inject: round.matrix(&r.inject, 0..q),
        inject_one: round.vector(&r.inject, q),
        outputs: (probes.iter())
            .map(|probe| (probe.name.clone(), probe.unit))
            .collect(),
        output_rows: round.rows(&some(&mut (0..probes.len())), &columns),
        switches: (behaviour.switches.iter())
            .zip(&position.switches)
            .map(|(switch, on)| (switch.name.clone(), *on))
            .collect(),
        notes: r.notes.clone(),
        imprecise: 0,
    };
    system.imprecise = round.imprecise;
    let power = behaviour.power.iter();
    let mut metric = vec![SparseRow::new(); q];
    for (a, b, x) in &r.metric {
        metric[*a].push((*b, x.clone()));
    }
    metric
        .iter_mut()
        .for_each(|row| row.sort_by_key(|(b, _)| *b));
    let s: Vec<&SparseRow<F>> = r.s.iter().collect();
    let readings = Readings {
        storage_of: r.states.clone(),
        controls: round.rows(
            &some(&mut behaviour.switches.iter().map(|s| s.control)),
            &columns,
        ),
        power: power.clone().map(|w| w.kind).collect(),
        power_v: round.rows(&some(&mut power.clone().map(|w| w.v)), &columns),
        power_i: round.rows(&some(&mut power.map(|w| w.i)), &columns),
        storage: round.rows(&s, &columns),
        metric: round.matrix(&metric, 0..q),
    };
    (system, readings)
}
