//! The storage equations: x', the undetermined quantities, the shift and the injection.

use crate::algebra::{Elimination, Field, SparseRow, Table, add_scaled, entry, part, summed};

use super::ReduceError;
use super::eliminated::Eliminated;
use super::frame::Frame;

/// x' and f over [x | λ | u | u' | 1 | s⁻].
pub(super) struct Flow<F> {
    /// Number of storage quantities.
    q: usize,
    /// Physical x' and x⁺.
    states: Vec<SparseRow<F>>,
    /// f and F; undetermined ones are 0 until [`Flow::least_norm`] has chosen.
    f: Vec<SparseRow<F>>,
    /// For each f its coefficients on the undetermined ones, by their number.
    on_loose: Vec<SparseRow<F>>,
    /// How many are undetermined.
    loose: usize,
    /// Σ, each row over the columns of u.
    pub(super) shift: Vec<SparseRow<F>>,
}

impl<F: Field> Flow<F> {
    pub(super) fn solve(
        e: &Eliminated<F>,
        frame: &Frame,
        s: &[SparseRow<F>],
        is_static: bool,
    ) -> Result<Self, ReduceError> {
        let (n, nf, base) = (frame.n, frame.f.len(), frame.base);
        let q = if is_static { 0 } else { s.len() };
        let known = n + nf;
        let mut rows: Vec<SparseRow<F>> = Vec::with_capacity(q);
        for (j, image) in e.times_metric(s).iter().enumerate().take(q) {
            let mut row = SparseRow::new();
            for (c, x) in frame.express(e, e.rate[j]) {
                let at = c.checked_sub(base).map_or(known + c, |k| n + k);
                row.push((at, x.neg()));
            }
            // The rate of a source stands where the source does in P s.
            let of_sources = part(image, frame.u()).iter();
            let rates = of_sources.map(|(c, x)| (known + frame.p + c, x.clone()));
            row.extend(part(image, 0..n).iter().cloned().chain(rates));
            rows.push(row);
        }
        for (a, b, x) in e.reduced.metric.iter().filter(|_| q > 0) {
            rows[*a].push((known + base + b, x.neg()));
        }
        let rows = rows.into_iter().map(summed).collect();
        let mut table = Table::new(rows, known + base + q);
        let mut found = Elimination::new(q, table.cols());
        for c in 0..known {
            table.eliminate(c, &mut found);
        }
        table.settle(&found);
        let singular = |rows: Vec<usize>| ReduceError::Singular {
            elements: rows.into_iter().map(|k| e.storage_label(k)).collect(),
        };
        if found.used.iter().any(|used| !used) {
            let rows = (0..q).filter(|&r| !found.used[r]).collect();
            return Err(singular(rows));
        }
        let loose: Vec<usize> = (0..nf).filter(|k| found.pivot[n + k].is_none()).collect();
        let solution = |c: usize| -> (SparseRow<F>, SparseRow<F>) {
            match found.pivot[c] {
                Some(r) => {
                    let row = table.row(r);
                    let given = part(row, known..known + base + q).iter();
                    let place = |c: usize| loose.binary_search(&(c - n)).ok();
                    let open = part(row, n..known).iter();
                    (
                        given.map(|(c, x)| (c - known, x.neg())).collect(),
                        open.filter_map(|(c, x)| Some((place(*c)?, x.neg())))
                            .collect(),
                    )
                }
                None => {
                    let place = c.checked_sub(n).and_then(|k| loose.binary_search(&k).ok());
                    (
                        SparseRow::new(),
                        place.map(|z| (z, F::one())).into_iter().collect(),
                    )
                }
            }
        };
        let mut states = Vec::with_capacity(n);
        for k in 0..n {
            let (row, on_loose) = solution(k);
            if found.pivot[k].is_none() || !on_loose.is_empty() {
                return Err(singular(vec![frame.states[k]]));
            }
            states.push(row);
        }
        let (f, on_loose) = (n..known).map(solution).unzip();
        let shift = |row: &SparseRow<F>| {
            let rates = part(row, frame.du()).iter();
            rates.map(|(c, x)| (c - frame.p, x.clone())).collect()
        };
        Ok(Self {
            q,
            shift: states.iter().map(shift).collect(),
            states,
            f,
            on_loose,
            loose: loose.len(),
        })
    }

    /// The coefficients of a frame row on the undetermined quantities `which`.
    pub(super) fn along(&self, frame: &Frame, row: &[(usize, F)], which: &[usize]) -> SparseRow<F> {
        let mut sum = SparseRow::new();
        for (c, x) in part(row, frame.base..usize::MAX) {
            add_scaled(&mut sum, x, &self.on_loose[c - frame.base]);
        }
        let place = |z: usize| which.binary_search(&z).ok();
        sum.into_iter()
            .filter_map(|(z, x)| Some((place(z)?, x)))
            .collect()
    }

    /// A frame row with f put in: over [x | λ | u | u' | 1 | s⁻], physical x.
    fn substitute(&self, frame: &Frame, mut row: SparseRow<F>) -> SparseRow<F> {
        let undetermined = row.split_off(row.partition_point(|(c, _)| *c < frame.base));
        for (c, x) in undetermined {
            add_scaled(&mut row, &x, &self.f[c - frame.base]);
        }
        row
    }

    /// A frame row over [x | λ | u | u' | 1] with shifted x, and its impulse over s⁻ − s⁺.
    pub(super) fn finish(&self, frame: &Frame, row: SparseRow<F>) -> (SparseRow<F>, SparseRow<F>) {
        let mut result = self.substitute(frame, row);
        let impulse = result.split_off(result.partition_point(|(c, _)| *c < frame.base));
        self.shift_states(frame, &mut result);
        let impulse = impulse.into_iter().map(|(c, x)| (c - frame.base, x));
        (result, impulse.collect())
    }

    /// Replaces physical x by x + Σ u.
    fn shift_states(&self, frame: &Frame, row: &mut SparseRow<F>) {
        let states = part(row, 0..frame.n).iter();
        let shifted: Vec<(usize, F)> = states
            .filter(|(k, _)| !self.shift[*k].is_empty())
            .cloned()
            .collect();
        for (k, x) in shifted {
            add_scaled(row, &x, &self.shift[k]);
        }
    }

    /// x' of the shifted state; what stands at u' is the rate of its shift and no part of it.
    pub(super) fn rates(&self, frame: &Frame) -> Vec<SparseRow<F>> {
        let mut rates = Vec::with_capacity(self.states.len());
        for row in &self.states {
            let mut row = part(row, 0..frame.base).to_vec();
            self.shift_states(frame, &mut row);
            rates.push(row);
        }
        rates
    }

    /// J, and −J k as a last column.
    pub(super) fn inject(&self, frame: &Frame, s: &[SparseRow<F>]) -> Vec<SparseRow<F>> {
        let mut inject = Vec::with_capacity(self.states.len());
        for row in &self.states {
            let given = part(row, frame.base..usize::MAX).iter();
            let mut j: SparseRow<F> = given.map(|(c, x)| (c - frame.base, x.clone())).collect();
            let mut constant = F::zero();
            for (k, x) in &j {
                if let Some(one) = entry(&s[*k], frame.one()) {
                    constant.sub_mul(x, one);
                }
            }
            if !constant.is_zero() {
                j.push((self.q, constant));
            }
            inject.push(j);
        }
        inject
    }

    /// Chooses the undetermined quantities z so that the sum of squares of an objective is least, GᵀG z = −Gᵀ g₀; what the first one leaves
    /// open the next one chooses. Returns those that the objectives see, and notes that name what was chosen.
    pub(super) fn least_norm(
        &mut self,
        frame: &Frame,
        objectives: &[Vec<(String, SparseRow<F>)>],
    ) -> (Vec<usize>, Vec<String>) {
        let nz = self.loose;
        let all: Vec<usize> = (0..nz).collect();
        if nz == 0 {
            return (Vec::new(), Vec::new());
        }
        // z over [what is still open of it | the rest].
        let mut values: Vec<SparseRow<F>> = (0..nz).map(|z| vec![(z, F::one())]).collect();
        let mut seen = Vec::new();
        let mut chosen = Vec::new();
        for objective in objectives {
            let mut normal = vec![SparseRow::new(); nz];
            for (name, row) in objective {
                let g = self.along(frame, row, &all);
                if g.is_empty() {
                    continue;
                }
                chosen.push(name.clone());
                let rest = self.substitute(frame, row.clone()).into_iter();
                let mut whole: SparseRow<F> = rest.map(|(c, x)| (nz + c, x)).collect();
                for (z, x) in &g {
                    add_scaled(&mut whole, x, &values[*z]);
                }
                for (z, x) in part(&whole, 0..nz) {
                    add_scaled(&mut normal[*z], x, &whole);
                }
            }
            let mut normal = Table::new(normal, nz + frame.base + self.q);
            let mut found = Elimination::new(nz, normal.cols());
            for z in 0..nz {
                normal.eliminate(z, &mut found);
            }
            normal.settle(&found);
            for (z, r) in (0..nz).filter_map(|z| Some((z, found.pivot[z]?))) {
                seen.push(z);
                for value in &mut values {
                    if let Some(part) = entry(value, z).map(F::neg) {
                        add_scaled(value, &part, normal.row(r));
                    }
                }
            }
        }
        for (f, on_loose) in self.f.iter_mut().zip(&self.on_loose) {
            for (z, x) in on_loose {
                let value = part(&values[*z], nz..usize::MAX).iter();
                let value: SparseRow<F> = value.map(|(c, x)| (c - nz, x.clone())).collect();
                add_scaled(f, x, &value);
            }
        }
        seen.sort_unstable();
        let notes = if chosen.is_empty() {
            Vec::new()
        } else {
            let list = chosen.join(", ");
            vec![format!(
                "the ideal model does not determine {list}: least-norm values are shown"
            )]
        };
        (seen, notes)
    }
}
