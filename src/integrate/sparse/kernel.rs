//! One implicit step of a system without its zeros, and the active set it ends in.
//!
//! ```text
//! x = r + h A x + h B λ,      y = C x + D λ + q,      0 ≤ λ ⟂ y ≥ 0
//! ```
//!
//! On an active set a (λ_j = 0 outside of it, y_j = 0 in it) this is one linear system in (x, λ),
//!
//! ```text
//! [I − hA   −hB ] [x]   [ r ]
//! [ C_a     D_a ] [λ] = [−q_a],      λ_j = 0 for j ∉ a,
//! ```
//!
//! whose pattern is the same for every h and a, so that the order of its elimination is found once. States are measured in √energy and ports so that the diagonal of
//! D + hCB is one. The active set is that of the step before, and where it does not hold all ports that disagree change sides, at last one at a time (J. J.
//! Júdice, F. M. Pires, "A block principal pivoting algorithm for large-scale strictly monotone linear complementarity problems", Computers & Operations
//! Research 21, 1994). Where that finds none, M = D + hC(I − hA)⁻¹B is made as a dense matrix and solved by [`Driver`].

use nalgebra::{DMatrix, DVector};

use crate::integrate::error::Reason;
use crate::lcs::SparseLcs;
use crate::linalg::sparse_lu::{Pattern, SparseLu};
use crate::settings::Settings;
use crate::settings::tolerances::events::STEP_GUARD;
use crate::settings::tolerances::sparse::{KEPT, LONE, MOST_DENSE, PATIENCE};
use crate::solve::{Driver, Status};

/// A place of the matrix and what makes it.
#[derive(Debug, Clone, Copy)]
struct Entry {
    row: usize,
    column: usize,
    /// Of A, B, C or D.
    value: f64,
}

/// Factors for one step length and active set.
#[derive(Debug)]
struct Kept {
    h: f64,
    active: Vec<bool>,
    factors: SparseLu,
    used: u64,
}

/// See the [module](self).
#[derive(Debug)]
pub(super) struct Kernel {
    n: usize,
    entries: Vec<Entry>,
    places: Vec<usize>,
    pattern: Pattern,
    /// √P_ii.
    state_scale: Vec<f64>,
    /// |D_jj| and Σ_k |C_jk B_kj|.
    diagonals: Vec<(f64, f64)>,
    port_scale: Vec<f64>,
    kept: Vec<Kept>,
    dense: Option<Dense>,
    clock: u64,
    slack: f64,
    most_kept: usize,
    room: usize,
    tolerance: f64,
    solution: Vec<f64>,
    work: Vec<f64>,
    /// Ports whose λ or y the ideal model leaves open.
    pub(super) shared: Vec<usize>,
    /// Factorisations and changes of the active set so far.
    pub(super) factorisations: u64,
    pub(super) pivotings: u64,
}

/// M of a step length, with h (I − hA)⁻¹ B.
#[derive(Debug)]
struct Dense {
    h: f64,
    driver: Driver,
    response: DMatrix<f64>,
}

/// What a step starts from and ends in.
#[derive(Debug, Clone, Default)]
pub(super) struct Step {
    /// r, then x.
    pub(super) x: Vec<f64>,
    /// q.
    pub(super) q: Vec<f64>,
    /// λ.
    pub(super) lambda: Vec<f64>,
    /// The ports with λ ≥ 0 and y = 0.
    pub(super) active: Vec<bool>,
}

impl Kernel {
    pub(super) fn new(lcs: &SparseLcs, settings: &Settings) -> Self {
        let (n, m) = (lcs.states.len(), lcs.ports.len());
        let mut entries = Vec::new();
        // Every row has an entry on the diagonal.
        let mut push = |row: usize, of: &mut dyn Iterator<Item = (usize, f64)>| {
            let mut has_diagonal = false;
            for (column, value) in of {
                has_diagonal |= column == row;
                entries.push(Entry { row, column, value });
            }
            if !has_diagonal {
                entries.push(Entry {
                    row,
                    column: row,
                    value: 0.0,
                });
            }
        };
        let shifted = move |(column, value): (usize, f64)| (n + column, value);
        for i in 0..n {
            push(i, &mut lcs.a.row(i).chain(lcs.b.row(i).map(shifted)));
        }
        for j in 0..m {
            push(n + j, &mut lcs.c.row(j).chain(lcs.d.row(j).map(shifted)));
        }
        let at: Vec<(usize, usize)> = entries.iter().map(|e| (e.row, e.column)).collect();
        let (pattern, places) = Pattern::new(n + m, &at);
        let mut diagonals = vec![(0.0_f64, 0.0_f64); m];
        for (j, (d, cb)) in diagonals.iter_mut().enumerate() {
            *d = entry(lcs.d.row(j), j).abs();
            for (k, c) in lcs.c.row(j) {
                *cb += (c * entry(lcs.b.row(k), j)).abs();
            }
        }
        let scale = |i: usize| {
            let energy = entry(lcs.energy.row(i), i);
            if energy > 0.0 { energy.sqrt() } else { 1.0 }
        };
        Self {
            n,
            entries,
            places,
            pattern,
            state_scale: (0..n).map(scale).collect(),
            diagonals,
            port_scale: vec![1.0; m],
            kept: Vec::new(),
            dense: None,
            clock: 0,
            slack: 0.0,
            most_kept: settings.max_kept,
            room: KEPT,
            tolerance: settings.lcp_residual,
            solution: vec![0.0; n + m],
            work: Vec::new(),
            shared: Vec::new(),
            factorisations: 0,
            pivotings: 0,
        }
    }

    /// Bytes of the factors kept.
    pub(super) fn bytes(&self) -> usize {
        self.kept.iter().map(|kept| kept.factors.bytes()).sum()
    }

    /// Gives up what can be made again.
    pub(super) fn forget(&mut self) {
        self.kept = Vec::new();
        self.dense = None;
    }

    /// Keeps so many factors, if there is memory for them.
    pub(super) fn keep(&mut self, room: usize) {
        self.room = room;
    }

    /// √(Σ P_ii x_i²).
    pub(super) fn size(&self, x: &[f64]) -> f64 {
        let parts = x.iter().zip(&self.state_scale);
        parts
            .map(|(x, scale)| (x * scale).powi(2))
            .sum::<f64>()
            .sqrt()
    }

    /// The same of what is linear in states.
    pub(super) fn size_of_form(&self, g: &[f64]) -> f64 {
        let parts = g.iter().zip(&self.state_scale);
        parts
            .map(|(g, scale)| (g / scale).powi(2))
            .sum::<f64>()
            .sqrt()
    }

    /// √P_ii of every state.
    pub(super) fn state_scale(&self) -> &[f64] {
        &self.state_scale
    }

    /// Makes the step of h, which factors serve that were made for one that differs by no more than `slack`, from r and q, with the active set to try first in `step`.
    ///
    /// # Errors
    /// No active set that was looked at holds, or the matrix is singular.
    pub(super) fn step(
        &mut self,
        lcs: &SparseLcs,
        (h, slack): (f64, f64),
        step: &mut Step,
    ) -> Result<(), (Reason, Option<usize>)> {
        self.measure(h, slack);
        let (mut fewest, mut patience) = (usize::MAX, PATIENCE);
        let mut asking = Vec::new();
        for round in 0..LONE * (1 + step.active.len()) {
            if !self.solve(h, step) {
                break;
            }
            self.disagreeing(lcs, step, &mut asking);
            if asking.is_empty() {
                let n = self.n;
                for (x, (value, scale)) in
                    (step.x.iter_mut()).zip(self.solution.iter().zip(&self.state_scale))
                {
                    *x = value / scale;
                }
                let ports = self.solution[n..].iter().zip(&self.port_scale);
                for (lambda, (value, scale)) in step.lambda.iter_mut().zip(ports) {
                    *lambda = (value * scale).max(0.0);
                }
                return Ok(());
            }
            self.pivotings += u64::from(round == 0);
            if asking.len() < fewest {
                (fewest, patience) = (asking.len(), PATIENCE);
            } else if patience > 0 {
                patience -= 1;
            } else if let Some(last) = asking.pop() {
                asking.clear();
                asking.push(last);
            }
            for &j in &asking {
                step.active[j] = !step.active[j];
            }
        }
        self.densely(lcs, h, step)
    }

    /// What a change of r makes of x where the active set stays as it is, in place; whether that is known.
    pub(super) fn change(&mut self, h: (f64, f64), active: &[bool], x: &mut [f64]) -> bool {
        self.change_with(h, active, x, (&[], &mut Vec::new()))
    }

    /// The same with a change of q, where there is one, and what becomes of λ.
    pub(super) fn change_with(
        &mut self,
        (h, slack): (f64, f64),
        active: &[bool],
        x: &mut [f64],
        (q, lambda): (&[f64], &mut Vec<f64>),
    ) -> bool {
        self.measure(h, slack);
        let Some(at) = self.factored(h, active) else {
            return false;
        };
        let (states, ports) = self.solution.split_at_mut(self.n);
        for (value, (x, scale)) in states.iter_mut().zip(x.iter().zip(&self.state_scale)) {
            *value = x * scale;
        }
        ports.fill(0.0);
        let driven = q.iter().zip(active).zip(&self.port_scale);
        for (value, ((q, active), scale)) in ports.iter_mut().zip(driven) {
            *value = if *active { -q * scale } else { 0.0 };
        }
        self.kept[at]
            .factors
            .solve_quickly(&mut self.solution, &mut self.work);
        let ports = self.solution[self.n..].iter().zip(&self.port_scale);
        lambda.clear();
        lambda.extend(ports.map(|(value, scale)| value * scale));
        for (x, (value, scale)) in x
            .iter_mut()
            .zip(self.solution.iter().zip(&self.state_scale))
        {
            *x = value / scale;
        }
        x.iter().all(|v| v.is_finite())
    }

    /// The transpose of [`Self::change_with`]: from what x and λ weigh, in place what r weighs, and what q does; whether that is known.
    pub(super) fn back(
        &mut self,
        (h, slack): (f64, f64),
        active: &[bool],
        x: &mut [f64],
        lambda: &mut [f64],
    ) -> bool {
        self.measure(h, slack);
        let Some(at) = self.factored(h, active) else {
            return false;
        };
        let (states, ports) = self.solution.split_at_mut(self.n);
        for (value, (x, scale)) in states.iter_mut().zip(x.iter().zip(&self.state_scale)) {
            *value = x / scale;
        }
        for (value, (of, scale)) in ports.iter_mut().zip(lambda.iter().zip(&self.port_scale)) {
            *value = of * scale;
        }
        self.kept[at]
            .factors
            .solve_transposed(&mut self.solution, &mut self.work);
        let (states, ports) = self.solution.split_at(self.n);
        for (x, (value, scale)) in x.iter_mut().zip(states.iter().zip(&self.state_scale)) {
            *x = value * scale;
        }
        let ports = ports.iter().zip(&self.port_scale).zip(active);
        for (of, ((value, scale), active)) in lambda.iter_mut().zip(ports) {
            *of = if *active { -value * scale } else { 0.0 };
        }
        x.iter().all(|v| v.is_finite())
    }

    /// Units of the ports for a step length, which factors for others by no more than `slack` serve.
    fn measure(&mut self, h: f64, slack: f64) {
        self.slack = slack;
        for (scale, (d, cb)) in self.port_scale.iter_mut().zip(&self.diagonals) {
            let size = d + h * cb;
            *scale = if size > 0.0 { size.sqrt().recip() } else { 1.0 };
        }
    }

    /// The solution of the linear system of an active set in the kernel's units; whether it is regular.
    fn solve(&mut self, h: f64, step: &Step) -> bool {
        let Some(at) = self.factored(h, &step.active) else {
            return false;
        };
        let n = self.n;
        for (k, value) in self.solution.iter_mut().enumerate() {
            *value = if k < n {
                step.x[k] * self.state_scale[k]
            } else if step.active[k - n] {
                -step.q[k - n] * self.port_scale[k - n]
            } else {
                0.0
            };
        }
        self.kept[at]
            .factors
            .solve(&mut self.solution, &mut self.work);
        self.solution.iter().all(|v| v.is_finite())
    }

    /// Where the factors for h and an active set stand, made where they are not known.
    fn factored(&mut self, h: f64, active: &[bool]) -> Option<usize> {
        self.clock += 1;
        let (clock, slack) = (self.clock, self.slack);
        let found = self.kept.iter_mut().enumerate();
        let mut found = found.filter(|(_, k)| (k.h - h).abs() <= slack && k.active == active);
        if let Some((at, kept)) = found.next() {
            kept.used = clock;
            return Some(at);
        }
        self.fill(h, active);
        self.factorisations += 1;
        let factors = self.pattern.factors()?;
        let most = (self.most_kept / factors.bytes().max(1)).clamp(1, self.room);
        while self.kept.len() >= most {
            let oldest = (0..self.kept.len()).min_by_key(|&k| self.kept[k].used);
            self.kept.swap_remove(oldest.unwrap_or(0));
        }
        self.kept.push(Kept {
            h,
            active: active.to_vec(),
            factors,
            used: clock,
        });
        Some(self.kept.len() - 1)
    }

    /// Writes the matrix of h and an active set.
    fn fill(&mut self, h: f64, active: &[bool]) {
        let n = self.n;
        let (states, ports) = (&self.state_scale, &self.port_scale);
        let values = self.pattern.values();
        for (entry, &place) in self.entries.iter().zip(&self.places) {
            let &Entry { row, column, value } = entry;
            let one = f64::from(u8::from(row == column));
            values[place] = match (row < n, column < n) {
                (true, true) => one - h * value * states[row] / states[column],
                (true, false) => -h * value * states[row] * ports[column - n],
                (false, _) if !active[row - n] => one,
                (false, true) => value * ports[row - n] / states[column],
                (false, false) => value * ports[row - n] * ports[column - n],
            };
        }
    }

    /// The ports whose λ or y is below zero by more than it is known. The terms of its own row are known to rounding, and so is λ_j, as the diagonal is one: what others carry says
    /// nothing of it, as decades of resistance may lie between them. Ports without resistance share what keeps the states on their constraints: of these λ is known to the
    /// residual of a solution beside the largest.
    fn disagreeing(&self, lcs: &SparseLcs, step: &Step, asking: &mut Vec<usize>) {
        asking.clear();
        let (states, lambda) = self.solution.split_at(self.n);
        let resists = |j: usize| self.diagonals[j].0 > 0.0;
        let bare = (0..lambda.len()).filter(|&j| !resists(j));
        let most = bare.fold(0.0_f64, |most, j| most.max(lambda[j].abs()));
        for (j, &own) in lambda.iter().enumerate() {
            let scale = self.port_scale[j];
            let x = (lcs.c.row(j)).map(|(k, c)| c * states[k] / self.state_scale[k] * scale);
            let ports = (lcs.d.row(j)).map(|(k, d)| d * lambda[k] * self.port_scale[k] * scale);
            let constant = step.q[j] * scale;
            let sum = |(sum, size): (f64, f64), term: f64| (sum + term, size + term.abs());
            let (y, size) = x.chain(ports).fold((constant, constant.abs()), sum);
            let (value, noise) = match (step.active[j], resists(j)) {
                (true, false) => (own, self.tolerance * most),
                (true, true) => (own, STEP_GUARD * size),
                (false, _) => (y, STEP_GUARD * size),
            };
            if value < -noise {
                asking.push(j);
            }
        }
    }

    /// The same by the dense matrix of the complementarity problem.
    #[cold]
    fn densely(
        &mut self,
        lcs: &SparseLcs,
        h: f64,
        step: &mut Step,
    ) -> Result<(), (Reason, Option<usize>)> {
        let (n, m) = (self.n, step.q.len());
        let none = vec![false; m];
        let singular = || (Reason::Singular { h }, None);
        let Some(at) = self.factored(h, &none) else {
            return Err(singular());
        };
        if n * m > MOST_DENSE {
            let (residual, tolerance) = (f64::NAN, self.tolerance);
            return Err((
                Reason::Residual {
                    residual,
                    tolerance,
                },
                None,
            ));
        }
        if self.dense.as_ref().is_none_or(|dense| dense.h != h) {
            let mut response = DMatrix::zeros(n, m);
            for (i, j, value) in lcs.b.entries() {
                response[(i, j)] = h * value * self.state_scale[i];
            }
            let mut column = vec![0.0; n + m];
            for mut of in response.column_iter_mut() {
                column[..n].copy_from_slice(of.clone_owned().as_slice());
                column[n..].fill(0.0);
                self.kept[at].factors.solve(&mut column, &mut self.work);
                for (k, value) in of.iter_mut().enumerate() {
                    *value = column[k] / self.state_scale[k];
                }
            }
            let mut matrix = DMatrix::zeros(m, m);
            for (i, j, value) in lcs.d.entries() {
                matrix[(i, j)] += value;
            }
            for (i, k, value) in lcs.c.entries() {
                for j in 0..m {
                    matrix[(i, j)] += value * response[(k, j)];
                }
            }
            self.dense = Some(Dense {
                h,
                driver: Driver::new(matrix, self.tolerance),
                response,
            });
        }
        let free = Step {
            active: none,
            ..step.clone()
        };
        if !self.solve(h, &free) {
            return Err(singular());
        }
        let Some(dense) = &mut self.dense else {
            return Err(singular());
        };
        let scaled = self.solution[..n].iter().zip(&self.state_scale);
        let x: Vec<f64> = scaled.map(|(value, scale)| value / scale).collect();
        let mut q = step.q.clone();
        lcs.c.add_times(1.0, &x, &mut q);
        let q = DVector::from_vec(q);
        dense.driver.suggest(&step.active);
        let found = dense.driver.solve(&q);
        match found.status {
            Status::Solved => {}
            Status::Infeasible(ray) => return Err((Reason::Infeasible, Some(ray.imax()))),
            Status::Failed => {
                let off = found.lambda.zip_map(&found.y, |l, y| l.min(y).abs());
                let (residual, tolerance) = (found.residual, self.tolerance);
                return Err((
                    Reason::Residual {
                        residual,
                        tolerance,
                    },
                    Some(off.imax()),
                ));
            }
        }
        // Which ports share what is asked once. Steps go on with the solution that was found: the least-norm one is none of a basis.
        if self.shared.is_empty() {
            self.shared = dense.driver.least_norm(&q, &found).chosen;
        }
        step.x = (DVector::from_vec(x) + &dense.response * &found.lambda)
            .as_slice()
            .to_vec();
        step.lambda.copy_from_slice(found.lambda.as_slice());
        step.active.copy_from_slice(&found.basis);
        Ok(())
    }
}

/// The entry of a column in a row; zero where there is none.
fn entry(mut row: impl Iterator<Item = (usize, f64)>, column: usize) -> f64 {
    row.find(|(c, _)| *c == column)
        .map_or(0.0, |(_, value)| value)
}
