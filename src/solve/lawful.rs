//! Ports with any maximal monotone law: y = M λ + q with every (λ_j, y_j) on its law.
//!
//! In equilibrated variables λ', y' every law is given by one number w_j = λ'_j − y'_j (Minty): λ'_j is the resolvent of w_j, a
//! nondecreasing, nonexpansive function, and so is −y'_j = w_j − λ'_j. What is left is one equation,
//!
//! ```text
//! R(w) = M' λ'(w) + q' − y'(w) = 0,      R' = M' S + (I − S),   S = diag(dλ'/dw) ∈ [0, 1].
//! ```
//!
//! The steps are measured by ‖(I + M')⁻¹R(w)‖₂, which the third of these methods never increases:
//!
//! 1. Semismooth Newton on R, with a line search where full steps lead astray (L. Qi, J. Sun, "A nonsmooth version of Newton's method", Mathematical
//!    Programming 58, 1993). R' is regular for M + Mᵀ ⪰ 0 where no law is on a horizontal or vertical piece.
//! 2. Newton for the curved laws only, with the linear complementarity problem of the ideal ports solved as such
//!    (N. H. Josephy, 1979): corners and rank deficient conducting sets cannot mislead it.
//! 3. Douglas–Rachford splitting, w ← w − (I + M')⁻¹R(w), which converges for every monotone problem that has a solution
//!    (P.-L. Lions, B. Mercier, SIAM J. Numer. Anal. 16, 1979); after a number of iterations 1 and 2 have their turn again,
//!    also inside the proximal point method, λ̂ ← solution for M' + μ and q' − μ λ̂ (R. T. Rockafellar, SIAM J. Control 14, 1976).
//!
//! Transistors make M' active, and no theorem covers 2 and 3; where they fail the solution is followed from M' + μ to M'.
//!
//! The laws hold to rounding at every w, so R alone decides: each of its entries relative to ‖q'‖∞ or to the largest term it is
//! a sum of.

use nalgebra::{DMatrix, DVector};

use super::driver::Driver;
use super::lcp::{Answered, Scaling, Solution, Status};
use super::newton::Newton;
use crate::law::{Law, Resolvent};
use crate::settings::tolerances::complementarity::{
    BARELY, BLOCKED, CONTINUED, CONTINUED_RATIO, DECREASE, MONOTONE, NEWTON_ENDS, NEWTON_SETTLES,
    ON_LAWS, PROXIMAL, SMALL_PORT, TERMS_ROUNDING, UNDETERMINED,
};
use crate::settings::tolerances::steps::SOLVED;

/// The law of a port and which of its quantities is λ.
#[derive(Debug, Clone, PartialEq)]
pub struct PortLaw {
    /// The law between v and i.
    pub law: Law,
    /// λ = i and y = −v; else λ = −v and y = i.
    pub current: bool,
}

/// A solver for many right-hand sides of one matrix M.
#[derive(Debug, Clone)]
pub(super) struct Lawful {
    /// M', equilibrated.
    m: DMatrix<f64>,
    scaling: Scaling,
    ports: Vec<PortLaw>,
    /// Ports with 0 ≤ λ ⟂ y ≥ 0, and the others.
    ideal: Vec<usize>,
    curved: Vec<usize>,
    /// Newton's method alone.
    plain: Newton,
    /// w of the last solution.
    w: DVector<f64>,
    /// (I + M')⁻¹.
    averaged: DMatrix<f64>,
    /// The largest voltage in which a law bends, in equilibrated variables.
    bend: f64,
    tolerance: f64,
}

/// A point w with everything that belongs to it.
#[derive(Clone)]
struct Point {
    w: DVector<f64>,
    /// λ'.
    lambda: DVector<f64>,
    /// y'.
    y: DVector<f64>,
    /// dλ'/dw and −dy'/dw.
    slope: DVector<f64>,
    rest: DVector<f64>,
    residual: DVector<f64>,
    /// max_j |R_j| relative to its largest term, what w's rounding makes of them, or [`SMALL_PORT`] of the largest entry of q' or bend
    /// of a law.
    size: f64,
    /// The same without what [`Lawful::off_laws`] adds.
    of_terms: f64,
    /// (I + M')⁻¹R.
    step: DVector<f64>,
}

/// Steps from one start: those on corners are bounded by the number of ports, those on curves converge quadratically.
const STEPS: usize = 60;
/// Halvings of a step in the line search.
const HALVINGS: u32 = 12;
/// Full Newton steps that may go astray before the line search takes over: coming down an exponential each lowers v by one
/// slope.
const CHAIN: u32 = 60;
/// Rounds of splitting, from w = 0 on, each followed by Newton; each takes twice as many iterations as the one before.
const ROUNDS: u32 = 11;
const SPLITTINGS: u32 = 8;
/// Proximal points at most.
const PROXIMAL_STEPS: u32 = 50;

impl Lawful {
    /// Prepares M.
    pub(super) fn new(
        m: &DMatrix<f64>,
        scaling: &Scaling,
        ports: Vec<PortLaw>,
        tolerance: f64,
    ) -> Self {
        let size = m.nrows();
        let d = &scaling.d;
        let is_ideal = |j: &usize| ports[*j].law.is_ideal_diode();
        let bends = ports.iter().zip(d.iter()).map(|(port, d)| {
            let volts = port.law.bend();
            if port.current { volts * d } else { volts / d }
        });
        let bend = bends.fold(0.0, f64::max);
        let plain = Newton::new(m, &ports);
        let m = DMatrix::from_fn(size, size, |i, j| d[i] * m[(i, j)] * d[j]);
        let identity = || DMatrix::identity(size, size);
        // I + M' is regular for every monotone M'; for others the splitting has no meaning, and any measure serves.
        let averaged = (identity() + &m).try_inverse().unwrap_or_else(identity);
        let (ideal, curved) = (0..size).partition(is_ideal);
        Self {
            plain,
            m,
            scaling: scaling.clone(),
            ports,
            ideal,
            curved,
            w: DVector::zeros(size),
            averaged,
            bend,
            tolerance,
        }
    }

    /// Proposes a solution to start from.
    pub(super) fn suggest(&mut self, lambda: &[f64], y: &[f64]) {
        for (j, w) in self.w.iter_mut().enumerate() {
            *w = lambda[j] / self.scaling.d[j] - y[j] * self.scaling.d[j];
        }
    }

    /// Solves for one q near the last one, by full steps of Newton's method from its solution, which take no memory; `None` where these do not come to an end.
    pub(super) fn solve_near(&mut self, q: &DVector<f64>) -> Option<Solution> {
        let q = q.component_mul(&self.scaling.d);
        let found = self.near(&q)?;
        Some(self.solution(found, Answered::Newton))
    }

    fn near(&mut self, q: &DVector<f64>) -> Option<Point> {
        let mut start = self.w.clone();
        let parts = (SOLVED, self.tolerance);
        let found = self.plain.refine(q.as_slice(), start.as_mut_slice(), parts);
        found.then(|| self.descend(self.at(start, q), q))
    }

    /// Solves for one q.
    pub(super) fn solve(&mut self, q: &DVector<f64>) -> Solution {
        let q = q.component_mul(&self.scaling.d);
        let mut by = Answered::Newton;
        let mut found = match self.near(&q) {
            Some(found) => found,
            None => self.descend(self.at(self.w.clone(), &q), &q),
        };
        let mut split = None;
        for round in 0..ROUNDS {
            if found.size <= self.tolerance {
                break;
            }
            let mut from = split.unwrap_or_else(|| self.at(DVector::zeros(q.len()), &q));
            if round > 0 {
                by = Answered::Splitting;
                from = self.split(from, &q, SPLITTINGS << round);
            }
            let mut next = self.descend(from.clone(), &q);
            if next.size > self.tolerance {
                next = self.proximal(from.clone(), &q);
            }
            if round == 0 && next.size > self.tolerance {
                next = self.continued(&from, &q);
            }
            if next.size < found.size {
                found = next;
            }
            split = Some(from);
        }
        self.solution(found, by)
    }

    /// Proximal points λ̂ ← λ, each the solution for M' + μ and q' − μ λ̂, whose R' is regular whatever the laws do.
    fn proximal(&self, start: Point, q: &DVector<f64>) -> Point {
        let size = start.w.len();
        let stronger = Self {
            m: &self.m + DMatrix::identity(size, size) * PROXIMAL,
            ..self.clone()
        };
        let mut now = start;
        for _ in 0..PROXIMAL_STEPS {
            let shifted = q - &now.lambda * PROXIMAL;
            let next = stronger.descend(stronger.at(now.w.clone(), &shifted), &shifted);
            let solved = next.size <= self.tolerance;
            now = self.at(next.w, q);
            if !solved || now.size <= self.tolerance {
                break;
            }
        }
        self.descend(now, q)
    }

    /// Solutions for M' + μ, from a large μ down to none, each the start of the next: SPICE's gmin stepping, in both roles.
    fn continued(&self, start: &Point, q: &DVector<f64>) -> Point {
        let size = start.w.len();
        let (mut w, mut mu) = (start.w.clone(), CONTINUED);
        while mu > MONOTONE {
            let stronger = Self {
                m: &self.m + DMatrix::identity(size, size) * mu,
                ..self.clone()
            };
            w = stronger.descend(stronger.at(w, q), q).w;
            mu *= CONTINUED_RATIO;
        }
        self.descend(self.at(w, q), q)
    }

    /// Newton steps, plain or around the complementarity problem, until the residual is rounding or no step shrinks it.
    fn descend(&self, start: Point, q: &DVector<f64>) -> Point {
        let mut now = start;
        for _ in 0..STEPS {
            if now.size <= NEWTON_ENDS {
                break;
            }
            // Near rounding only single steps gain. Above it what would be accepted may still be far from the solution along a direction in which
            // large terms cancel.
            let chain = if now.size <= NEWTON_SETTLES { 1 } else { CHAIN };
            let mut next = self.leap(&now, q, chain);
            if next.is_none() && now.size > self.tolerance {
                next = self.search(&now, self.newton_step(&now), q);
                if next.is_none() && !self.ideal.is_empty() {
                    next = self.search(&now, self.josephy_step(&now, q), q);
                }
            }
            match next {
                Some(next) => now = next,
                None => break,
            }
        }
        now
    }

    /// The first point nearer to a solution on a chain of full Newton steps. Where a law bends sharply a step may go far beyond the
    /// bend, and the next one, from the straight side, comes back to the right place.
    fn leap(&self, now: &Point, q: &DVector<f64>, chain: u32) -> Option<Point> {
        let before = now.step.norm();
        let mut next = now.clone();
        for _ in 0..chain {
            next = self.at(self.moved(&next, &self.newton_step(&next)?), q);
            if next.step.norm() <= (1.0 - DECREASE) * before {
                return Some(next);
            }
        }
        None
    }

    /// w after a step. A junction that begins to conduct goes no further than to the current that its line has there, or to the knee of its law: the exponential of a
    /// voltage that is too high would take a step for every slope on the way back (L. W. Nagel, "SPICE2", Memorandum ERL-M520, 1975).
    fn moved(&self, from: &Point, step: &DVector<f64>) -> DVector<f64> {
        let at = |j: usize| {
            let (port, d, to) = (&self.ports[j], self.scaling.d[j], from.w[j] + step[j]);
            let Law::Exponential(diode) = &port.law else {
                return to;
            };
            // z = v + ρ i, and i with its slope in z.
            let (volts, rho, i, slope) = if port.current {
                (1.0 / d, 1.0 / (d * d), from.lambda[j] * d, from.slope[j])
            } else {
                (-d, d * d, from.y[j] / d, from.rest[j])
            };
            let rise = step[j] * volts;
            if rise <= 2.0 * diode.slope {
                return to;
            }
            let expected = (i + slope / rho * rise).max(diode.slope / rho);
            let limit = diode.slope * (expected / diode.is).ln_1p() + (diode.rs + rho) * expected;
            if limit < to * volts {
                limit / volts
            } else {
                to
            }
        };
        DVector::from_fn(from.w.len(), |j, _| at(j))
    }

    /// The first point on a step, halved again and again, that is nearer to a solution.
    fn search(&self, now: &Point, step: Option<DVector<f64>>, q: &DVector<f64>) -> Option<Point> {
        let step = step?;
        let before = now.step.norm();
        let mut part = 1.0;
        for _ in 0..=HALVINGS {
            let next = self.at(&now.w + &step * part, q);
            if next.step.norm() <= (1.0 - DECREASE * part) * before {
                return Some(next);
            }
            part *= 0.5;
        }
        None
    }

    fn solution(&mut self, at: Point, by: Answered) -> Solution {
        // The best that was found may be as good as rounding lets it where nothing but leakage flows.
        let solved = at.of_terms <= self.tolerance && at.size <= BARELY * self.tolerance;
        let d = &self.scaling.d;
        let zero = self.tolerance * at.lambda.amax().max(at.y.amax());
        let mut active = vec![None; at.w.len()];
        let mut basis = vec![false; at.w.len()];
        for &j in &self.ideal {
            basis[j] = at.lambda[j] > at.y[j];
            active[j] = (at.w[j].abs() > zero).then_some(basis[j]);
        }
        if solved {
            self.w.copy_from(&at.w);
        }
        Solution {
            status: if solved {
                Status::Solved
            } else {
                Status::Failed
            },
            lambda: at.lambda.component_mul(d),
            y: at.y.component_div(d),
            residual: at.size,
            active,
            basis,
            by: if solved { by } else { Answered::Nobody },
        }
    }

    /// λ', −y' and their slopes at one w_j.
    fn law(&self, j: usize, w: f64) -> (f64, f64, f64, f64) {
        let (port, d) = (&self.ports[j], self.scaling.d[j]);
        if port.current {
            // λ' = i/d, −y' = d v, so w/d = v + i/d².
            let rho = 1.0 / (d * d);
            let Resolvent { v, i, dv, di } = port.law.resolvent(rho, w / d);
            (i / d, v * d, di * rho, dv)
        } else {
            // λ' = −v/d, −y' = −d i, so −d w = v + d² i.
            let rho = d * d;
            let Resolvent { v, i, dv, di } = port.law.resolvent(rho, -w * d);
            (-v / d, -i * d, dv, di * rho)
        }
    }

    fn at(&self, w: DVector<f64>, q: &DVector<f64>) -> Point {
        let size = w.len();
        let mut point = Point {
            lambda: DVector::zeros(size),
            y: DVector::zeros(size),
            slope: DVector::zeros(size),
            rest: DVector::zeros(size),
            residual: DVector::zeros(0),
            size: 0.0,
            of_terms: 0.0,
            step: DVector::zeros(0),
            w,
        };
        for j in 0..size {
            let (lambda, minus_y, slope, rest) = self.law(j, point.w[j]);
            point.lambda[j] = lambda;
            point.y[j] = -minus_y;
            point.slope[j] = slope;
            point.rest[j] = rest;
        }
        point.residual = &self.m * &point.lambda + q - &point.y;
        point.step = &self.averaged * &point.residual;
        let floor = SMALL_PORT * q.amax().max(self.bend);
        for j in 0..size {
            let known =
                |value: f64, slope: f64, k: usize| value.abs().max(slope * point.w[k].abs());
            let terms = (0..size)
                .map(|k| self.m[(j, k)].abs() * known(point.lambda[k], point.slope[k], k))
                .chain([q[j].abs(), known(point.y[j], point.rest[j], j)]);
            let part = point.residual[j].abs() / terms.fold(floor, f64::max);
            if point.residual[j] != 0.0 {
                point.size = if part.is_nan() {
                    f64::INFINITY
                } else {
                    part.max(point.size)
                };
            }
        }
        point.of_terms = point.size;
        if point.size > TERMS_ROUNDING {
            point.size = point
                .size
                .max(self.tolerance / ON_LAWS * self.off_laws(&point));
        }
        point
    }

    /// How far y is off the laws, relative to the largest current or voltage of the ports: a residual that is small beside the terms that it is a sum of, as
    /// voltages across milliohms are that cancel, may be all that a port has.
    fn off_laws(&self, at: &Point) -> f64 {
        let (mut largest, mut off) = ([0.0_f64; 2], [0.0_f64; 2]);
        for (j, port) in self.ports.iter().enumerate() {
            let d = self.scaling.d[j];
            let (of_lambda, of_y) = if port.current { (0, 1) } else { (1, 0) };
            largest[of_lambda] = largest[of_lambda].max((at.lambda[j] * d).abs());
            largest[of_y] = largest[of_y].max((at.y[j] / d).abs());
            off[of_y] = off[of_y].max((at.residual[j] / d).abs());
        }
        let part = |k: usize| {
            if off[k] == 0.0 {
                0.0
            } else {
                off[k] / largest[k]
            }
        };
        part(0).max(part(1))
    }

    /// −R'⁻¹ R, for M' + μ with a μ that is lost in rounding everywhere but on the kernel of M'.
    fn newton_step(&self, at: &Point) -> Option<DVector<f64>> {
        self.against(&at.slope, &at.rest, &at.residual)
    }

    /// −R'⁻¹ b, from dλ'/dw and −dy'/dw.
    fn against(
        &self,
        slope: &DVector<f64>,
        rest: &DVector<f64>,
        b: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        let mut matrix = self.m.clone();
        for (mut column, slope) in matrix.column_iter_mut().zip(slope.iter()) {
            column *= *slope;
        }
        for (j, (rest, slope)) in rest.iter().zip(slope.iter()).enumerate() {
            matrix[(j, j)] += rest + MONOTONE * slope;
        }
        solved(matrix, &-b)
    }

    /// dλ for a change dq from a solution (λ, y): −S R'⁻¹ dq.
    pub(super) fn response(
        &self,
        lambda: &DVector<f64>,
        y: &DVector<f64>,
        dq: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        let d = &self.scaling.d;
        let laws = (0..d.len()).map(|j| self.law(j, lambda[j] / d[j] - y[j] * d[j]));
        let (slope, rest): (Vec<f64>, Vec<f64>) = laws.map(|(_, _, s, r)| (s, r)).unzip();
        let (slope, rest) = (DVector::from_vec(slope), DVector::from_vec(rest));
        let dw = self.against(&slope, &rest, &dq.component_mul(d))?;
        Some(dw.component_mul(&slope).component_mul(d))
    }

    /// The step to the solution of the problem in which the curved laws are straight and the ideal ones as they are.
    fn josephy_step(&self, at: &Point, q: &DVector<f64>) -> Option<DVector<f64>> {
        let (p, s) = (&self.ideal, &self.curved);
        let block = |a: &[usize], b: &[usize]| self.m.select_rows(a).select_columns(b);
        // Curved: (M_ss S + I − S) Δw = −(M_ss λ_s + q_s − y_s) − M_sp λ_p.
        let mut matrix = block(s, s);
        for (k, &j) in s.iter().enumerate() {
            let scaled = matrix.column(k) * at.slope[j];
            matrix.set_column(k, &scaled);
            matrix[(k, k)] += at.rest[j].max(BLOCKED);
        }
        let lambda_s = at.lambda.select_rows(s);
        let offset = block(s, s) * &lambda_s + q.select_rows(s) - at.y.select_rows(s);
        let mut right = DMatrix::zeros(s.len(), p.len() + 1);
        right.columns_mut(0, p.len()).copy_from(&-block(s, p));
        right.set_column(p.len(), &-offset);
        let response = if s.is_empty() {
            right
        } else {
            matrix.lu().solve(&right)?
        };
        // λ_s + S Δw, as an affine function of λ_p.
        let mut moved = response.clone();
        for (k, &j) in s.iter().enumerate() {
            let scaled = moved.row(k) * at.slope[j];
            moved.set_row(k, &scaled);
        }
        let into = block(p, s);
        let m = block(p, p) + &into * moved.columns(0, p.len());
        let q = q.select_rows(p) + into * (lambda_s + moved.column(p.len()));
        if m.iter().chain(q.iter()).any(|x| !x.is_finite()) {
            return None;
        }
        let mut driver = Driver::new(m, self.tolerance);
        let found = driver.solve(&q);
        if found.status != Status::Solved {
            return None;
        }
        let change = response.columns(0, p.len()) * &found.lambda + response.column(p.len());
        let mut step = DVector::zeros(at.w.len());
        for (k, &j) in s.iter().enumerate() {
            step[j] = change[k];
        }
        for (k, &j) in p.iter().enumerate() {
            step[j] = found.lambda[k] - found.y[k] - at.w[j];
        }
        Some(step)
    }

    /// Iterations of Douglas–Rachford; the last of them.
    fn split(&self, start: Point, q: &DVector<f64>, count: u32) -> Point {
        let mut now = start;
        for _ in 0..count {
            now = self.at(&now.w - &now.step, q);
            if now.size <= self.tolerance {
                break;
            }
        }
        now
    }
}

/// The solution of a system whose matrix may be nearly singular: then every pivot is raised by [`UNDETERMINED`] of the largest entry.
fn solved(matrix: DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    let finite = |x: &DVector<f64>| x.iter().all(|x| x.is_finite());
    if let Some(x) = matrix.clone().lu().solve(right).filter(finite) {
        return Some(x);
    }
    let raised = UNDETERMINED * matrix.amax().max(1.0);
    let size = matrix.nrows();
    (matrix + DMatrix::identity(size, size) * raised)
        .lu()
        .solve(right)
        .filter(finite)
}

#[cfg(test)]
mod tests;
