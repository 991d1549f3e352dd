//! The storage equations: x', the undetermined quantities, the shift and the injection.

use crate::algebra::{Elimination, Field, Matrix};

use super::ReduceError;
use super::eliminated::Eliminated;
use super::frame::Frame;

/// x' and f over [x | λ | u | u' | 1 | s⁻].
pub(super) struct Flow<F> {
    /// Number of storage quantities.
    q: usize,
    /// Physical x' and x⁺.
    states: Vec<Vec<F>>,
    /// f and F; undetermined ones are 0 until [`Flow::least_norm`] has chosen.
    f: Vec<Vec<F>>,
    /// For each f its coefficients on the undetermined ones, and which those are.
    on_loose: Vec<Vec<F>>,
    /// n×p: Σ.
    pub(super) shift: Vec<Vec<F>>,
}

impl<F: Field> Flow<F> {
    pub(super) fn solve(
        e: &Eliminated<F>,
        frame: &Frame,
        s: &[Vec<F>],
        is_static: bool,
    ) -> Result<Self, ReduceError> {
        let (n, nf, base) = (frame.n, frame.f.len(), frame.base);
        let q = if is_static { 0 } else { s.len() };
        let known = n + nf;
        let mut table = Matrix::zeros(q, known + base + q);
        let image = e.times_metric(s);
        for (j, image) in image.iter().enumerate().take(q) {
            let rate = frame.express(e, e.rate[j]);
            let row = table.row_mut(j);
            row[..n].clone_from_slice(&image[..n]);
            for k in 0..nf {
                row[n + k] = rate[base + k].neg();
            }
            for (k, value) in rate[..base].iter().enumerate() {
                row[known + k] = value.neg();
            }
            for (du, u) in frame.du().zip(frame.u()) {
                row[known + du] = row[known + du].add(&image[u]);
            }
        }
        for (a, b, x) in e.reduced.metric.iter().filter(|_| q > 0) {
            let entry = table.at_mut(*a, known + base + b);
            *entry = entry.add(&x.neg());
        }
        let mut found = Elimination::new(q, table.cols());
        for c in 0..known {
            table.eliminate(c, &mut found);
        }
        let singular = |rows: Vec<usize>| ReduceError::Singular {
            elements: rows.into_iter().map(|k| e.storage_label(k)).collect(),
        };
        if found.used.iter().any(|used| !used) {
            let rows = (0..q).filter(|&r| !found.used[r]).collect();
            return Err(singular(rows));
        }
        let loose: Vec<usize> = (0..nf).filter(|k| found.pivot[n + k].is_none()).collect();
        let solution = |c: usize| -> (Vec<F>, Vec<F>) {
            match found.pivot[c] {
                Some(r) => {
                    let row = table.row(r);
                    (
                        row[known..].iter().map(F::neg).collect(),
                        loose.iter().map(|k| row[n + k].neg()).collect(),
                    )
                }
                None => {
                    let is = |k: &usize| if n + k == c { F::one() } else { F::zero() };
                    (vec![F::zero(); base + q], loose.iter().map(is).collect())
                }
            }
        };
        let mut states = Vec::with_capacity(n);
        for k in 0..n {
            let (row, on_loose) = solution(k);
            if found.pivot[k].is_none() || on_loose.iter().any(|x| !x.is_zero()) {
                return Err(singular(vec![frame.states[k]]));
            }
            states.push(row);
        }
        let (f, on_loose) = (n..known).map(solution).unzip();
        let shift = states.iter().map(|row| row[frame.du()].to_vec()).collect();
        Ok(Self {
            q,
            states,
            f,
            on_loose,
            shift,
        })
    }

    /// The coefficients of a frame row on the undetermined quantities `which`.
    pub(super) fn along(&self, frame: &Frame, row: &[F], which: &[usize]) -> Vec<F> {
        which
            .iter()
            .map(|&z| {
                let mut sum = F::zero();
                for (k, x) in row[frame.base..]
                    .iter()
                    .enumerate()
                    .filter(|(_, x)| !x.is_zero())
                {
                    sum = sum.add(&x.mul(&self.on_loose[k][z]));
                }
                sum
            })
            .collect()
    }

    /// A frame row with f put in: over [x | λ | u | u' | 1 | s⁻], physical x.
    fn substitute(&self, frame: &Frame, row: &[F]) -> Vec<F> {
        let mut result = Vec::with_capacity(frame.base + self.q);
        result.extend_from_slice(&row[..frame.base]);
        result.resize(frame.base + self.q, F::zero());
        for (x, f) in row[frame.base..]
            .iter()
            .zip(&self.f)
            .filter(|(x, _)| !x.is_zero())
        {
            add_scaled(&mut result, x, f);
        }
        result
    }

    /// A frame row over [x | λ | u | u' | 1] with shifted x, and its impulse over s⁻ − s⁺.
    pub(super) fn finish(&self, frame: &Frame, row: &[F]) -> (Vec<F>, Vec<F>) {
        let mut result = self.substitute(frame, row);
        let impulse = result.split_off(frame.base);
        self.shift_states(frame, &mut result);
        (result, impulse)
    }

    /// Replaces physical x by x + Σ u.
    fn shift_states(&self, frame: &Frame, row: &mut [F]) {
        for (k, shift) in self.shift.iter().enumerate() {
            if !row[k].is_zero() {
                let x = row[k].clone();
                add_scaled(&mut row[frame.u()], &x, shift);
            }
        }
    }

    /// x' of the shifted state.
    pub(super) fn rates(&self, frame: &Frame) -> Vec<Vec<F>> {
        let mut rates = Vec::with_capacity(self.states.len());
        for row in &self.states {
            let mut row = row[..frame.base].to_vec();
            row[frame.du()].fill(F::zero());
            self.shift_states(frame, &mut row);
            rates.push(row);
        }
        rates
    }

    /// J, and −J k as a last column.
    pub(super) fn inject(&self, frame: &Frame, s: &[Vec<F>]) -> Vec<Vec<F>> {
        let mut inject = Vec::with_capacity(self.states.len());
        for row in &self.states {
            let mut j = row[frame.base..].to_vec();
            let mut constant = F::zero();
            for (x, s) in j.iter().zip(s) {
                constant.sub_mul(x, &s[frame.one()]);
            }
            j.push(constant);
            inject.push(j);
        }
        inject
    }

    /// Chooses the undetermined quantities z so that the sum of squares of an objective is least, GᵀG z = −Gᵀ g₀; what the first one leaves
    /// open the next one chooses. Returns those that the objectives see, and notes that name what was chosen.
    pub(super) fn least_norm(
        &mut self,
        frame: &Frame,
        objectives: &[Vec<(String, Vec<F>)>],
    ) -> (Vec<usize>, Vec<String>) {
        let nz = self.on_loose.first().map_or(0, Vec::len);
        let all: Vec<usize> = (0..nz).collect();
        if nz == 0 {
            return (Vec::new(), Vec::new());
        }
        let width = frame.base + self.q;
        // z over [what is still open of it | the rest].
        let mut values: Vec<Vec<F>> = Vec::with_capacity(nz);
        for z in 0..nz {
            let mut value = vec![F::zero(); nz + width];
            value[z] = F::one();
            values.push(value);
        }
        let mut seen = Vec::new();
        let mut chosen = Vec::new();
        for objective in objectives {
            let mut normal = Matrix::zeros(nz, nz + width);
            for (name, row) in objective {
                let g = self.along(frame, row, &all);
                if g.iter().all(F::is_zero) {
                    continue;
                }
                chosen.push(name.clone());
                let mut whole = vec![F::zero(); nz];
                whole.extend(self.substitute(frame, row));
                for (x, value) in g.iter().zip(&values).filter(|(x, _)| !x.is_zero()) {
                    add_scaled(&mut whole, x, value);
                }
                for (z, x) in whole[..nz].iter().enumerate().filter(|(_, x)| !x.is_zero()) {
                    add_scaled(normal.row_mut(z), x, &whole);
                }
            }
            let mut found = Elimination::new(nz, nz + width);
            for z in 0..nz {
                normal.eliminate(z, &mut found);
            }
            for (z, r) in (0..nz).filter_map(|z| Some((z, found.pivot[z]?))) {
                seen.push(z);
                for value in values.iter_mut().filter(|value| !value[z].is_zero()) {
                    let part = value[z].neg();
                    add_scaled(value, &part, normal.row(r));
                }
            }
        }
        for (f, on_loose) in self.f.iter_mut().zip(&self.on_loose) {
            for (x, value) in on_loose.iter().zip(&values).filter(|(x, _)| !x.is_zero()) {
                add_scaled(f, x, &value[nz..]);
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

/// target ← target + scale · row.
pub(super) fn add_scaled<F: Field>(target: &mut [F], scale: &F, row: &[F]) {
    let minus = scale.neg();
    for (t, x) in target.iter_mut().zip(row).filter(|(_, x)| !x.is_zero()) {
        t.sub_mul(&minus, x);
    }
}
