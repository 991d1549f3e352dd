//! Newton's method on the resolvents of curved laws, without allocation: what most stages of a step need.
//!
//! The equation is that of [`lawful`](super::lawful), R(w) = M'λ'(w) + q' − y'(w) = 0 with R' = M' S + (I − S). Started from an extrapolation
//! one or two steps solve it; R' stays factored as long as it contracts (simplified Newton: P. Deuflhard, "Newton Methods for Nonlinear
//! Problems", Springer 2004, section 2.1). Where steps do not contract the caller asks the methods that always end.

use nalgebra::DMatrix;

use super::lawful::PortLaw;
use super::lcp::Scaling;
use crate::law::{Junction, Law, Resolvent};
use crate::settings::tolerances::complementarity::{
    CONTRACTS, CONTRACTS_NO_MORE, EQUATION_ROUNDING, MONOTONE, ROUNDING_STEPS, RUNAWAY, SMALL_W,
};

/// Steps from one start; those that need more are better started elsewhere.
const STEPS: u32 = 25;
/// Up to so many ports R' is factored at every step: that costs no more than the laws.
const SMALL: usize = 6;

/// A port as its resolvent is evaluated, in equilibrated variables.
#[derive(Debug, Clone)]
enum Port {
    /// λ' = max(w, 0); λ' = w where it is held on its conducting side, λ' = 0 where on the other.
    Ideal { held: Option<bool> },
    /// A junction: λ' = i/d where `current`, else y' = d i.
    Junction {
        junction: Junction,
        /// ρ, Ω.
        rho: f64,
        current: bool,
        /// The least v + ρ i, V, and what holds below.
        from: f64,
        law: Box<PortLaw>,
    },
    /// Any other law.
    Other(Box<PortLaw>),
}

/// A solver for many right-hand sides of one matrix M.
#[derive(Debug, Clone)]
pub(crate) struct Newton {
    size: usize,
    /// M', row by row.
    m: Vec<f64>,
    d: Vec<f64>,
    ports: Vec<Port>,
    w: Vec<f64>,
    lambda: Vec<f64>,
    y: Vec<f64>,
    /// dλ'/dw.
    slope: Vec<f64>,
    q: Vec<f64>,
    step: Vec<f64>,
    /// R' in its factors, row by row, and the rows' order.
    lu: Vec<f64>,
    order: Vec<usize>,
    factored: bool,
    /// The least size that w' counts with.
    least: f64,
    /// Factorisations of R' so far.
    pub(crate) factorisations: u64,
}

impl Newton {
    /// Prepares M.
    pub(crate) fn new(m: &DMatrix<f64>, laws: &[PortLaw]) -> Self {
        Self::near(m, laws, &vec![1.0; m.nrows()], 0.0)
    }

    /// Prepares M, with ports that it leaves free scaled by powers of two, λ = d λ' and y = y'/d, and steps below a part of the size `least` of w' taken
    /// for rounding.
    pub(crate) fn near(m: &DMatrix<f64>, laws: &[PortLaw], scales: &[f64], least: f64) -> Self {
        let size = m.nrows();
        let scaled = DMatrix::from_fn(size, size, |i, j| scales[i] * m[(i, j)] * scales[j]);
        let d = Scaling::of(&scaled).d;
        let d: Vec<f64> = d.iter().zip(scales).map(|(d, scale)| d * scale).collect();
        let port = |(law, d): (&PortLaw, &f64)| match law.law {
            _ if law.law.is_ideal_diode() => Port::Ideal { held: None },
            Law::Exponential(exponential) => {
                let rho = if law.current { 1.0 / (d * d) } else { d * d };
                match exponential.behind(rho) {
                    Some((junction, from)) => Port::Junction {
                        junction,
                        rho,
                        current: law.current,
                        from,
                        law: Box::new(law.clone()),
                    },
                    None => Port::Other(Box::new(law.clone())),
                }
            }
            _ => Port::Other(Box::new(law.clone())),
        };
        let row = |k: usize| {
            let (i, j) = (k / size, k % size);
            d[i] * m[(i, j)] * d[j]
        };
        Self {
            size,
            m: (0..size * size).map(row).collect(),
            ports: laws.iter().zip(&d).map(port).collect(),
            w: vec![0.0; size],
            lambda: vec![0.0; size],
            y: vec![0.0; size],
            slope: vec![0.0; size],
            q: vec![0.0; size],
            step: vec![0.0; size],
            lu: vec![0.0; size * size],
            order: (0..size).collect(),
            factored: false,
            least,
            factorisations: 0,
            d,
        }
    }

    /// Holds every ideal port on the side that it has in an active set, whatever sign that gives λ and y there; `None` holds none.
    pub(crate) fn hold(&mut self, active: Option<&[bool]>) {
        for (j, port) in self.ports.iter_mut().enumerate() {
            if let Port::Ideal { held } = port {
                let wanted = active.map(|active| active[j]);
                self.factored &= *held == wanted;
                *held = wanted;
            }
        }
    }

    /// Solves for one q from a guess of (λ, y), which the solution replaces; the last step is below the part `wanted` of every w, or
    /// below the part `granted` of the largest where rounding lets steps shrink no further. `false`: the steps do not contract, and what is there is no solution.
    pub(crate) fn solve(
        &mut self,
        q: &[f64],
        lambda: &mut [f64],
        y: &mut [f64],
        parts: (f64, f64),
    ) -> bool {
        for j in 0..self.size {
            self.q[j] = q[j] * self.d[j];
            self.w[j] = lambda[j] / self.d[j] - y[j] * self.d[j];
        }
        let found = self.descend(parts);
        if found {
            for j in 0..self.size {
                lambda[j] = self.lambda[j] * self.d[j];
                y[j] = self.y[j] / self.d[j];
            }
        }
        found
    }

    /// The same for q' from a guess of w', both equilibrated; where it is `false` the guess is as it was.
    pub(crate) fn refine(&mut self, q: &[f64], w: &mut [f64], parts: (f64, f64)) -> bool {
        self.q.copy_from_slice(q);
        self.w.copy_from_slice(w);
        let found = self.descend(parts);
        if found {
            w.copy_from_slice(&self.w);
        }
        found
    }

    /// dλ and dy where q moves by dq, at the solution found last and by the factors that found it.
    pub(crate) fn response(&mut self, dq: &[f64], lambda: &mut [f64], y: &mut [f64]) {
        if !self.factored {
            lambda.fill(0.0);
            y.fill(0.0);
            return;
        }
        for ((step, dq), d) in self.step.iter_mut().zip(dq).zip(&self.d) {
            *step = -dq * d;
        }
        self.substitute();
        for j in 0..self.size {
            let (dw, slope) = (self.step[j], self.slope[j]);
            lambda[j] = self.d[j] * slope * dw;
            y[j] = (slope - 1.0) * dw / self.d[j];
        }
    }

    /// |dλ| at the solution found last that the rounding of the terms may be which its equations are sums of.
    pub(crate) fn rounding(&mut self, lambda: &mut [f64]) {
        lambda.fill(0.0);
        if !self.factored {
            return;
        }
        for i in 0..self.size {
            let row = &self.m[i * self.size..(i + 1) * self.size];
            let terms = row.iter().zip(&self.lambda).map(|(m, l)| (m * l).abs());
            let terms = terms.sum::<f64>() + self.q[i].abs();
            self.step.fill(0.0);
            self.step[i] = EQUATION_ROUNDING * terms;
            self.substitute();
            let parts = self.step.iter().zip(&self.slope).zip(&self.d);
            for (lambda, ((dw, slope), d)) in lambda.iter_mut().zip(parts) {
                *lambda += (d * slope * dw).abs();
            }
        }
    }

    fn descend(&mut self, (wanted, granted): (f64, f64)) -> bool {
        let largest = |values: &[f64]| values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        self.evaluate();
        let start = largest(&self.w).max(largest(&self.q)).max(self.least);
        let mut before = f64::INFINITY;
        for k in 0..STEPS {
            let fresh = !self.factored || self.size <= SMALL;
            if fresh && !self.factor() {
                return false;
            }
            self.residual();
            self.substitute();
            let norm = largest(&self.step);
            if !norm.is_finite() {
                return false;
            }
            for (w, step) in self.w.iter_mut().zip(&self.step) {
                *w += step;
            }
            self.evaluate();
            let scale = largest(&self.w).max(largest(&self.q)).max(self.least);
            // Far out the voltages of junctions are rounding of their currents, and every step is small.
            if scale > RUNAWAY * start {
                return false;
            }
            let rate = norm / before;
            // A junction behind an inductor has a w of its own size, whose noise would be the error of the state.
            let of_port = |(step, w): (&f64, &f64)| step.abs() / w.abs().max(SMALL_W * scale);
            let own = self
                .step
                .iter()
                .zip(&self.w)
                .map(of_port)
                .fold(0.0, f64::max);
            // What is left after this step is a geometric series at most.
            if own <= wanted || k > 0 && rate < CONTRACTS && own * rate / (1.0 - rate) <= wanted {
                return true;
            }
            if rate > ROUNDING_STEPS && norm <= granted * scale {
                return true;
            }
            if rate > CONTRACTS_NO_MORE && !fresh {
                self.factored = false;
            }
            before = norm;
        }
        false
    }

    /// λ', y' and the slopes at w.
    fn evaluate(&mut self) {
        for j in 0..self.size {
            let (w, d) = (self.w[j], self.d[j]);
            let (lambda, y, slope) = match &mut self.ports[j] {
                Port::Ideal { held } => {
                    if held.unwrap_or(w > 0.0) {
                        (w, 0.0, 1.0)
                    } else {
                        (0.0, -w, 0.0)
                    }
                }
                Port::Junction {
                    current, from, law, ..
                } if (if *current { w / d } else { -w * d }) < *from => law.at(d, w),
                Port::Junction {
                    junction,
                    rho,
                    current: true,
                    ..
                } => {
                    // λ' = i/d, −y' = d v, so w/d = v + ρ i.
                    let (i, di) = junction.at(w / d);
                    (i / d, i / d - w, di * *rho)
                }
                Port::Junction {
                    junction,
                    rho,
                    current: false,
                    ..
                } => {
                    // λ' = −v/d, −y' = −d i, so −d w = v + ρ i.
                    let (i, di) = junction.at(-w * d);
                    (w + d * i, d * i, 1.0 - di * *rho)
                }
                Port::Other(port) => port.at(d, w),
            };
            self.lambda[j] = lambda;
            self.y[j] = y;
            self.slope[j] = slope;
        }
    }

    /// −R into `step`.
    fn residual(&mut self) {
        for (i, row) in self.m.chunks_exact(self.size).enumerate() {
            let sum: f64 = row.iter().zip(&self.lambda).map(|(m, l)| m * l).sum();
            self.step[i] = self.y[i] - sum - self.q[i];
        }
    }

    /// Factors R' with row pivoting; `false` where it is singular.
    fn factor(&mut self) -> bool {
        let n = self.size;
        self.factorisations += 1;
        self.factored = true;
        for (row, m) in self.lu.chunks_exact_mut(n).zip(self.m.chunks_exact(n)) {
            for ((entry, m), slope) in row.iter_mut().zip(m).zip(&self.slope) {
                *entry = m * slope;
            }
        }
        for j in 0..n {
            self.lu[j * n + j] += 1.0 - self.slope[j] + MONOTONE * self.slope[j];
            self.order[j] = j;
        }
        for k in 0..n {
            let largest = (k..n).fold(k, |best, i| {
                if self.lu[i * n + k].abs() > self.lu[best * n + k].abs() {
                    i
                } else {
                    best
                }
            });
            if largest != k {
                self.order.swap(k, largest);
                for j in 0..n {
                    self.lu.swap(k * n + j, largest * n + j);
                }
            }
            let (above, below) = self.lu.split_at_mut((k + 1) * n);
            let pivot_row = &above[k * n..];
            let pivot = pivot_row[k];
            if pivot == 0.0 || !pivot.is_finite() {
                self.factored = false;
                return false;
            }
            for row in below.chunks_exact_mut(n) {
                if row[k] == 0.0 {
                    continue;
                }
                let factor = row[k] / pivot;
                row[k] = factor;
                for (entry, above) in row[k + 1..].iter_mut().zip(&pivot_row[k + 1..]) {
                    *entry -= factor * above;
                }
            }
        }
        true
    }

    /// R'⁻¹ of `step`, in place.
    fn substitute(&mut self) {
        let n = self.size;
        // y is evaluated anew after the step; until then it holds the right-hand side in the order of the pivots.
        for (k, &row) in self.order.iter().enumerate() {
            self.y[k] = self.step[row];
        }
        for i in 0..n {
            let row = &self.lu[i * n..i * n + i];
            let sum: f64 = row.iter().zip(&self.y).map(|(a, b)| a * b).sum();
            self.y[i] -= sum;
        }
        for i in (0..n).rev() {
            let row = &self.lu[i * n..(i + 1) * n];
            let sum: f64 = (row[i + 1..].iter().zip(&self.y[i + 1..]))
                .map(|(a, b)| a * b)
                .sum();
            self.y[i] = (self.y[i] - sum) / row[i];
        }
        self.step.copy_from_slice(&self.y);
    }
}

impl PortLaw {
    /// λ', y' and dλ'/dw at w, where λ = d λ' and y = y'/d.
    pub(super) fn at(&self, d: f64, w: f64) -> (f64, f64, f64) {
        if self.current {
            let rho = 1.0 / (d * d);
            let Resolvent { v, i, di, .. } = self.law.resolvent(rho, w / d);
            (i / d, -v * d, di * rho)
        } else {
            let Resolvent { v, i, dv, .. } = self.law.resolvent(d * d, -w * d);
            (-v / d, i * d, dv)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::{Breakdown, Exponential};

    /// y = λ − 1 has λ = 1 on the laws; held on the blocking side it has y = −1, and where both ports are held on sides that contradict
    /// the signs, what these make of it.
    #[test]
    fn a_held_port_stays_on_its_side_whatever_the_signs() {
        let laws =
            [Law::ideal_diode(), Law::ideal_diode()].map(|law| PortLaw { law, current: true });
        let mut newton = Newton::new(&DMatrix::identity(2, 2), &laws);
        let mut solved = |held: Option<&[bool]>| {
            newton.hold(held);
            let (mut lambda, mut y) = ([0.5, 0.5], [0.0, 0.0]);
            assert!(newton.solve(&[-1.0, 1.0], &mut lambda, &mut y, (1e-14, 1e-14)));
            (
                lambda.map(|l| (l * 1e12).round() / 1e12),
                y.map(|y| (y * 1e12).round() / 1e12),
            )
        };
        assert_eq!(solved(None), ([1.0, 0.0], [0.0, 1.0]));
        assert_eq!(solved(Some(&[false, true])), ([0.0, -1.0], [-1.0, 0.0]));
        assert_eq!(solved(None), ([1.0, 0.0], [0.0, 1.0]));
    }

    /// Steps never come to 1e-30 of the solution: those that shrink no more are rounding, and end where that is granted.
    #[test]
    fn rounding_ends_the_steps_where_it_is_granted() {
        let law = Law::Exponential(Exponential {
            is: 1e-14,
            slope: 0.026,
            rs: 0.0,
            leak: 0.0,
            breakdown: None,
        });
        let port = || PortLaw {
            law: law.clone(),
            current: true,
        };
        let m = DMatrix::from_row_slice(3, 3, &[3.1, 0.7, 0.2, 0.7, 2.3, 0.9, 0.2, 0.9, 1.7]);
        let mut newton = Newton::new(&m, &[port(), port(), port()]);
        let mut solves = |granted: f64| {
            let (mut lambda, mut y) = ([0.0; 3], [5.3, 7.1, -1.9]);
            newton.solve(&[-5.3, -7.1, 1.9], &mut lambda, &mut y, (1e-30, granted))
        };
        assert!(solves(1e-9) && !solves(1e-30));
    }

    /// A diode that breaks down at 5 V, forward, leaking and broken down, is on its law: the junction alone serves down to where the other
    /// exponential is rounding.
    #[test]
    fn a_junction_with_a_breakdown_is_on_its_law_on_both_sides_of_where_that_begins() {
        let law = Law::Exponential(Exponential {
            is: 1e-12,
            slope: 0.03,
            rs: 0.1,
            leak: 0.0,
            breakdown: Some(Breakdown {
                bv: 5.0,
                ibv: 1e-3,
                slope: 0.03,
            }),
        });
        let ohms = 10.0;
        let port = PortLaw {
            law: law.clone(),
            current: true,
        };
        let mut newton = Newton::new(&DMatrix::from_element(1, 1, ohms), &[port]);
        for volts in [-20.0, -5.2, -4.9, -3.6, -3.4, -1.0, -1e-3, 0.5, 2.0, 20.0] {
            // y = R i − V and y = −v: the diode behind a source of V.
            let (mut i, mut y) = ([0.0], [-volts]);
            assert!(
                newton.solve(&[-volts], &mut i, &mut y, (1e-14, 1e-12)),
                "{volts}"
            );
            let Resolvent { v, i: expected, .. } = law.resolvent(ohms, volts);
            assert!(
                (i[0] - expected).abs() <= 1e-11 * expected.abs() + 1e-26,
                "{volts}: {} {expected}",
                i[0]
            );
            assert!(
                (y[0] + v).abs() <= 1e-11 * volts.abs(),
                "{volts}: {} {v}",
                -y[0]
            );
        }
    }

    /// λ' − y' = w on the curve i(v), where λ' = λ/d and y' = d y are (i/d, −d v), or (−v/d, d i); and the slope is a difference.
    #[test]
    fn a_port_is_on_its_curve_whichever_quantity_is_lambda() {
        let law = Law::Exponential(Exponential {
            is: 1e-3,
            slope: 0.1,
            rs: 0.0,
            leak: 0.0,
            breakdown: Some(Breakdown {
                bv: 2.0,
                ibv: 1e-3,
                slope: 0.1,
            }),
        });
        let current_at = |v: f64| match &law {
            Law::Exponential(diode) => diode.current(v),
            _ => unreachable!("it is one"),
        };
        for current in [true, false] {
            let port = PortLaw {
                law: law.clone(),
                current,
            };
            for d in [0.25, 1.0, 4.0] {
                for w in [-2.0, -0.1, 0.3, 2.0] {
                    let (lambda, y, slope) = port.at(d, w);
                    assert!((lambda - y - w).abs() < 1e-14, "{current} {d} {w}");
                    let (v, i) = if current {
                        (-y / d, lambda * d)
                    } else {
                        (-lambda * d, y / d)
                    };
                    let law = current_at(v);
                    assert!(
                        (i - law).abs() < 1e-11 * (1.0 + law.abs()),
                        "{current} {d} {w}: {i} {law}"
                    );
                    let h = 1e-6;
                    let change = (port.at(d, w + h).0 - port.at(d, w - h).0) / (2.0 * h);
                    assert!(
                        (slope - change).abs() < 1e-6,
                        "{current} {d} {w}: {slope} {change}"
                    );
                }
            }
        }
    }
}
