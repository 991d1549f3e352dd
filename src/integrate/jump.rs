//! State jumps: what an impulse of the devices does to the state in no time.
//!
//! The limit h → 0 of the step problem. A port's λ and y fill intervals, from the bounds λ⁻ and y⁻ up where there are bounds
//! ([`Law::least_current`](crate::law::Law::least_current), [`Law::greatest_voltage`](crate::law::Law::greatest_voltage); both 0 for an ideal
//! pair). An impulse p_j of λ_j is met by a finite y_j: it needs a bound y⁻_j, and y_j stays there. The impulse η = Dp of y_j is
//! met by a finite λ_j: it needs a bound λ⁻_j, and λ_j stays there. So impulses form the cone
//!
//! ```text
//! Q = { p : (D + Dᵀ)p = 0, p_j ≥ 0 and p_j = 0 without y⁻_j, (Dp)_j ≥ 0 and (Dp)_j = 0 without λ⁻_j },
//! ```
//!
//! for ideal pairs the solutions of LCP(0, D). The state x⁺ = x + Bp is admissible where finite λ ≥ λ⁻, y ≥ y⁻ have
//! y = Cx⁺ + Dλ + Gu⁺ + F, and for D ⪰ 0 such λ, y exist on the laws, or next to them, if and only if
//!
//! ```text
//! w(x⁺) = Cx⁺ + Gu⁺ + F + Dλ⁻ − y⁻ ∈ Q* (bounds that are missing are 0 here),      and ⟨w(x⁺), p⟩ = 0.
//! ```
//!
//! For a passive network, where PBp = Cᵀp on ker(D + Dᵀ), this is the projection x⁺ = argmin ½‖x⁺ − x‖²_P onto the closure of the
//! states from which the circuit can go on; Brogliato-Thibault (24)-(26) is the case D = 0 with ideal pairs. With
//! p = N z, N a basis of the subspace of Q's equations in which z are some of the components of p themselves, and V those rows of
//! [N; DN] whose sign z ≥ 0 does not settle, the conditions are the monotone complementarity problem
//!
//! ```text
//! 0 ≤ z ⟂ NᵀCBN z + Nᵀw(x) − Vᵀ s ≥ 0,   0 ≤ s ⟂ V z ≥ 0.
//! ```
//!
//! An ideal diode beside an exponential one shows why the finite λ of curved laws count: where a switch interrupts an inductor, the
//! current goes through the exponential diode, and no impulse opens the ideal one.

mod basis;

use nalgebra::{DMatrix, DVector};

use self::basis::{is_semidefinite, kernel, levelled, reduced};

use crate::diagnostic::Internal;
use crate::integrate::{Note, energy};
use crate::lcs::{Lcs, Role};
use crate::linalg::whole::{largest, magnitudes, scaled, transposed, with_transposed};
use crate::settings::tolerances::jumps::{FORWARD, NO_JUMP, RIVAL};
use crate::settings::tolerances::ranks::RANK;
use crate::solve::lcp::Scaling;
use crate::solve::{Driver, Status};

/// Prepared jump problem of one system.
#[derive(Debug, Clone)]
pub struct JumpProblem {
    /// m×k: N in the ports' own units; p = sigma · basis · z.
    basis: DMatrix<f64>,
    /// The unit of z, which brings the jump matrix near 1 (time has no scale in a jump).
    sigma: f64,
    driver: Driver,
    /// k×k: NᵀCBN, scaled.
    coupling: DMatrix<f64>,
    /// Whether D + Dᵀ and the jump matrix NᵀCBN are positive semidefinite, as for every passive network. If not, the jump is
    /// not given by this problem.
    pub monotone: bool,
    /// Whether MBN = CᵀN with the energy M of the state, as between passive elements: then a jump is a projection in the metric M.
    pub projects: bool,
    /// m: Dλ⁻ − y⁻.
    bounds: DVector<f64>,
    /// m: the units of the equilibrated λ.
    units: DVector<f64>,
}

/// What a jump did.
#[derive(Debug, Clone, PartialEq)]
pub struct Jump {
    /// n: the state after.
    pub x: DVector<f64>,
    /// m: impulses of λ, in units of λ times s.
    pub p: DVector<f64>,
    /// Ports that compete for the jump, see `JumpProblem::rivals`; empty where the jump is the limit of all resistances.
    pub rivals: Vec<usize>,
    /// What part of p may only make up for rounding.
    pub rounding: f64,
}

impl Jump {
    /// What a user should know of a jump at t between [`rivals`](Self::rivals).
    #[must_use]
    pub fn note(&self, lcs: &Lcs, t: f64) -> Option<Note> {
        let mut names: Vec<&str> = Vec::new();
        for &port in &self.rivals {
            let name = lcs.ports[port].device.as_str();
            if !names.contains(&name) {
                names.push(name);
            }
        }
        (!names.is_empty()).then(|| rivals_note(&names, t))
    }
}

/// What a user should know of a jump at t for which these elements compete.
pub(crate) fn rivals_note(names: &[&str], t: f64) -> Note {
    let text = format!(
        "at t = {t:e} s {} compete for an impulse: how they share it depends on the ratios of the resistances that the ideal \
         model leaves out; the state that least energy separates from the one before is shown",
        names.join(", ")
    );
    Note::of("rival-impulses", names.iter().copied(), text)
}

impl JumpProblem {
    /// Prepares the jump problem; `None` where no impulse can flow (D + Dᵀ positive definite, or no ports): then the plan
    /// leaves jumps out.
    #[must_use]
    pub fn new(lcs: &Lcs, tolerance: f64) -> Option<Self> {
        let m = lcs.m();
        if m == 0 || lcs.n() == 0 {
            return None;
        }
        let ends: Vec<Ends> = (0..m).map(|j| Ends::of(lcs, j)).collect();
        let carriers: Vec<usize> = (0..m).filter(|&j| ends[j].y.is_some()).collect();
        if carriers.is_empty() {
            return None;
        }
        let cb = &lcs.c * &lcs.b;
        // Levelled with CB where D is zero, so that ports without feedthrough have a scale too.
        let scaling = Scaling::of(&levelled(&lcs.d, &cb));
        let feedthrough = scaled(&lcs.d, &scaling.d);
        let carried = feedthrough.select_rows(&carriers).select_columns(&carriers);
        let symmetric = with_transposed(&carried);
        let lossless = symmetric.iter().all(|v| *v == 0.0);
        // Q lies in ker(D + Dᵀ) only for D + Dᵀ ⪰ 0; else the problem below is not used (see `monotone`).
        let semidefinite = lossless || is_semidefinite(&symmetric);
        let kernel = if semidefinite && !lossless {
            kernel(symmetric)
        } else {
            DMatrix::identity(carriers.len(), carriers.len())
        };
        let mut n = DMatrix::zeros(m, kernel.ncols());
        for (row, &j) in kernel.row_iter().zip(&carriers) {
            n.set_row(j, &row);
        }
        let (n, v) = reduced(n, &feedthrough, &ends);
        let k = n.ncols();
        let basis = DMatrix::from_fn(m, k, |i, j| scaling.d[i] * n[(i, j)]);
        if k == 0 || largest((&lcs.b * &basis).as_slice()) == 0.0 {
            return None;
        }
        let h = transposed(&basis) * &cb * &basis;
        let size = largest(h.as_slice());
        let sigma = if size > 0.0 { 1.0 / size } else { 1.0 };
        let coupling = h * sigma;
        let matrix = if v.nrows() > 0 {
            bordered(&coupling, &v)
        } else {
            coupling.clone()
        };
        let driver = Driver::new(matrix, tolerance);
        let monotone = semidefinite && driver.is_monotone();
        let projects = monotone && is_reciprocal(lcs, &basis);
        Some(Self {
            basis,
            sigma,
            driver,
            coupling,
            monotone,
            projects,
            bounds: bounds(lcs, &ends),
            units: scaling.d,
        })
    }

    /// The jump from state `x` under inputs `u` (right limits). `Ok(None)` where the state is admissible as it is.
    ///
    /// # Errors
    /// [`Infeasible`] where no admissible state can be reached.
    pub fn solve(
        &mut self,
        lcs: &Lcs,
        x: &DVector<f64>,
        u: &DVector<f64>,
    ) -> Result<Option<Jump>, Infeasible> {
        let k = self.basis.ncols();
        let right = transposed(&self.basis) * (&lcs.c * x + &lcs.g * u + &lcs.f + &self.bounds);
        if largest(right.as_slice()) == 0.0 {
            return Ok(None);
        }
        let solution = self
            .driver
            .solve(&right.clone().resize_vertically(self.driver.size(), 0.0));
        let worst = match &solution.status {
            Status::Solved => None,
            Status::Infeasible(ray) => Some(ray.clone()),
            Status::Failed => Some(solution.lambda.zip_map(&solution.y, |l, y| l.min(y).abs())),
        };
        if let Some(worst) = worst {
            return Err(Infeasible {
                port: (&self.basis * worst.rows(0, k)).iamax(),
            });
        }
        let z = solution.lambda.rows(0, k);
        let p = &self.basis * z * self.sigma;
        let change = &lcs.b * &p;
        let moved = |i: usize| change[i].abs() > NO_JUMP * x[i].abs().max(change.amax());
        let rounding = self.rounding(lcs, x, u, &p);
        if !(0..x.len()).any(moved) || rounding >= 1.0 {
            return Ok(None);
        }
        let after = x + change;
        // A projection loses energy. Where Ron and Roff are 20 decades apart, rounding can pass for a path of impulses; what they
        // bring then gives it away.
        let is_stored = lcs.energy.nrows() == lcs.n();
        if self.monotone && is_stored && energy::loss_of_jump(lcs, x, &after, u, &p, true) < 0.0 {
            return Ok(None);
        }
        let z: Vec<f64> = z.iter().copied().collect();
        Ok(Some(Jump {
            x: after,
            p,
            rivals: self.rivals(&z, &right),
            rounding,
        }))
    }

    /// The ports between which a limit of vanishing resistances would depend on the ratios of these. With resistances an impulse
    /// only grows, ż_i = max(0, −(Hz + q)_i)/R_i with H = NᵀCBN. Where H_ij ≤ 0 between all z that move, every z ends at the least
    /// solution of the complementarity problem, whatever the R. Where H_ij > 0, what i conducts takes from j, and the first may have
    /// conducted more than the projection says.
    fn rivals(&self, z: &[f64], q: &DVector<f64>) -> Vec<usize> {
        let h = &self.coupling;
        let largest = z.iter().fold(0.0_f64, |a, z| a.max(*z));
        let moves = |i: &usize| z[*i] > RIVAL * largest || q[*i] < -RIVAL * q.amax();
        let moving: Vec<usize> = (0..z.len()).filter(moves).collect();
        let competes = |&i: &usize| {
            let with =
                |&j: &usize| i != j && h[(i, j)] > RIVAL * (h[(i, i)] * h[(j, j)]).abs().sqrt();
            moving.iter().any(with)
        };
        let competing: Vec<usize> = moving.iter().copied().filter(competes).collect();
        let carries = |&port: &usize| competing.iter().any(|&i| self.basis[(port, i)] != 0.0);
        (0..self.basis.nrows()).filter(carries).collect()
    }

    /// Whether no device has an impulse of voltage across it in its forward direction: it would take a current before.
    ///
    /// # Errors
    /// The device with the largest; the jump is wrong then, whatever the circuit.
    pub fn verify(&self, lcs: &Lcs, Jump { p, rounding, .. }: &Jump) -> Result<(), Internal> {
        let through = &lcs.d * p;
        let scaled = |j: usize| (p[j] / self.units[j], through[j] * self.units[j]);
        let largest = (0..p.len()).fold(0.0_f64, |a, j| {
            let (p, y) = scaled(j);
            a.max(p.abs()).max(y.abs())
        });
        let reverse = |j: usize| match lcs.ports[j].role {
            Role::Voltage => (scaled(j).0, p[j]),
            Role::Current => (scaled(j).1, through[j]),
            Role::Function => (0.0, 0.0),
        };
        let worst = (0..p.len()).min_by(|&a, &b| reverse(a).0.total_cmp(&reverse(b).0));
        match worst {
            Some(port) if reverse(port).0 < -FORWARD.max(*rounding) * largest => {
                let (device, area) = (&lcs.ports[port].device, -reverse(port).1);
                let what = format!("a jump puts a forward impulse of {area:e} V s across {device}");
                Err(Internal::new("integrate::jump", what))
            }
            _ => Ok(()),
        }
    }

    /// What part of p may only make up for rounding in Cx + Gu + F.
    fn rounding(&self, lcs: &Lcs, x: &DVector<f64>, u: &DVector<f64>, p: &DVector<f64>) -> f64 {
        let terms = lcs.c.abs() * x.abs() + lcs.g.abs() * u.abs() + lcs.f.abs() + self.bounds.abs();
        let corrected = &lcs.c * (&lcs.b * p);
        let rows = corrected.iter().zip(terms.iter());
        let parts = rows
            .filter(|(c, _)| **c != 0.0)
            .map(|(c, t)| NO_JUMP * t / c.abs());
        parts.fold(f64::INFINITY, f64::min)
    }
}

/// [H, −Vᵀ; V, 0].
#[inline(never)]
fn bordered(h: &DMatrix<f64>, v: &DMatrix<f64>) -> DMatrix<f64> {
    let (rows, k) = v.shape();
    let mut matrix = DMatrix::zeros(k + rows, k + rows);
    matrix.view_mut((0, 0), (k, k)).copy_from(h);
    matrix
        .view_mut((0, k), (k, rows))
        .copy_from(&-v.transpose());
    matrix.view_mut((k, 0), (rows, k)).copy_from(v);
    matrix
}

/// The bounds λ⁻ and y⁻ of a port.
#[derive(Debug, Clone, Copy)]
struct Ends {
    lambda: Option<f64>,
    y: Option<f64>,
}

impl Ends {
    fn of(lcs: &Lcs, j: usize) -> Self {
        let law = &lcs.ports[j].law;
        // + 0: what is no bound of an ideal pair is 0 and not −0.
        let (current, voltage) = (law.least_current(), law.greatest_voltage().map(|v| 0.0 - v));
        match lcs.ports[j].role {
            Role::Voltage => Self {
                lambda: voltage,
                y: current,
            },
            Role::Current | Role::Function => Self {
                lambda: current,
                y: voltage,
            },
        }
    }
}

/// Whether the impulses of a basis push the state where its ports see it: MBN = CᵀN, up to the rounding of their entries. A source that
/// is controlled by the state breaks it.
fn is_reciprocal(lcs: &Lcs, basis: &DMatrix<f64>) -> bool {
    if lcs.energy.nrows() != lcs.n() {
        return true;
    }
    let pushed = &lcs.energy * &lcs.b * basis;
    let seen = lcs.c.tr_mul(basis);
    let [energy, b, c, size] = [&lcs.energy, &lcs.b, &lcs.c, basis].map(magnitudes);
    let sizes = energy * b * &size + c.tr_mul(&size);
    (pushed - seen)
        .iter()
        .zip(sizes.iter())
        .all(|(off, size)| off.abs() <= RANK * size)
}

/// Dλ⁻ − y⁻.
fn bounds(lcs: &Lcs, ends: &[Ends]) -> DVector<f64> {
    let vector = |of: fn(&Ends) -> Option<f64>| {
        DVector::from_iterator(ends.len(), ends.iter().map(|e| of(e).unwrap_or(0.0)))
    };
    &lcs.d * vector(|e| e.lambda) - vector(|e| e.y)
}

/// No admissible state can be reached by an impulse of the devices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Infeasible {
    /// The port with the largest part in the contradiction.
    pub port: usize,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::fixtures;
    use crate::law::{Breakdown, Exponential, Law};
    use crate::lcs::{Outputs, Storage};
    use nalgebra::{dmatrix, dvector};

    #[test]
    fn bridge_with_capacitor_filter_shares_charge() {
        let lcs = fixtures::bridge_cap_filter();
        let mut jumps = JumpProblem::new(&lcs, 1e-9).unwrap();
        assert!(jumps.monotone);
        let x = dvector![10.0, 0.0, 0.0];
        let jump = jumps.solve(&lcs, &x, &DVector::zeros(0)).unwrap().unwrap();
        // 1 µF at 10 V onto 0.3 µF at 0 V: 10/1.3 V on both, 0.3 µF · 10/1.3 V moved.
        assert!(
            (&jump.x - dvector![10.0 / 1.3, 0.0, 10.0 / 1.3]).norm() < 1e-13,
            "{jump:?}"
        );
        assert!((jump.p[2] - 3e-6 / 1.3).abs() < 1e-19, "{jump:?}");
        assert_eq!(jumps.solve(&lcs, &jump.x, &DVector::zeros(0)), Ok(None));
    }

    #[test]
    fn bridge_with_resistor_only_needs_no_jump_logic() {
        // Every impulse that D + Dᵀ would let pass is stopped by Dp ≥ 0.
        assert!(JumpProblem::new(&fixtures::bridge(), 1e-9).is_none());
    }

    #[test]
    fn half_wave_rectifier_with_resistor_needs_no_jump_logic() {
        assert!(JumpProblem::new(&fixtures::rlcd(), 1e-9).is_none());
    }

    #[test]
    fn diode_across_a_reversed_capacitor_is_infeasible_only_without_a_path() {
        // A diode across C with v = −(−3): y = −v must be ≥ 0; the impulse discharges it to 0.
        let lcs = fixtures::clamped_capacitor();
        let mut jumps = JumpProblem::new(&lcs, 1e-9).unwrap();
        let jump = jumps
            .solve(&lcs, &dvector![3.0], &DVector::zeros(0))
            .unwrap()
            .unwrap();
        assert!(jump.x[0].abs() < 1e-15);
        assert!((jump.p[0] - 3e-6).abs() < 1e-18);
        assert_eq!(
            jumps.solve(&lcs, &dvector![-3.0], &DVector::zeros(0)),
            Ok(None)
        );
    }

    /// A diode from 1 µF to two large capacitors in series against each other: y = −v_1 + v_2 − v_3. A difference of 10 V and its neighbour
    /// among the doubles moves nothing, though it is all that v_1 = 0 would have.
    #[test]
    fn what_only_rounding_forbids_is_no_jump() {
        let lcs = fixtures::system(
            &[("v(c1)", "V"), ("v(c2)", "V"), ("v(c3)", "V")],
            &[("d1", Role::Current)],
            [
                DMatrix::zeros(3, 3),
                dmatrix![-1e6; 0.0; 0.0],
                dmatrix![-1.0, 1.0, -1.0],
                dmatrix![0.0],
            ],
            &[1e-6, 1e3, 1e3],
        );
        let mut jumps = JumpProblem::new(&lcs, 1e-9).unwrap();
        let mut after = |v3: f64| {
            let jump = jumps.solve(&lcs, &dvector![0.0, 10.0, v3], &DVector::zeros(0));
            jump.unwrap().map(|jump| jump.x[0])
        };
        assert_eq!(after(10.0_f64.next_up()), None);
        assert!((after(10.5).unwrap() + 0.5).abs() < 1e-15);
    }

    /// An inductor of 1 mH whose current comes out of the anodes of devices in parallel: λ is the current of the first and the voltage of
    /// the last.
    fn inductor_into(laws: [Law; 2]) -> Lcs {
        let lcs = fixtures::bridge();
        // x' = (−v)/L, v = −λ₂; y₁ = −v = λ₂, y₂ = x − λ₁.
        let [first, last] = laws;
        let port = |law: Law, role| crate::lcs::Port {
            law,
            role,
            ..lcs.ports[0].clone()
        };
        let ports = vec![port(first, Role::Current), port(last, Role::Voltage)];
        let changed = lcs.changed(|parts| {
            parts.ports = ports;
            parts.states.truncate(1);
            parts.a = dmatrix![0.0];
            (parts.e, parts.shift) = (DMatrix::zeros(1, 0), DMatrix::zeros(1, 0));
            parts.e0 = DVector::zeros(1);
            parts.b = dmatrix![0.0, 1e3];
            parts.c = dmatrix![0.0; 1.0];
            parts.d = dmatrix![0.0, 1.0; -1.0, 0.0];
            parts.g = DMatrix::zeros(2, 0);
            parts.f = DVector::zeros(2);
            parts.energy = dmatrix![1e-3];
            parts.storage = Storage {
                inject_one: DVector::zeros(1),
                ..Storage::default()
            };
            parts.outputs = Outputs::default();
        });
        changed.unwrap()
    }

    fn exponential(is: f64, bv: Option<f64>) -> Law {
        Law::Exponential(Exponential {
            is,
            slope: 0.026,
            rs: 0.0,
            leak: 0.0,
            breakdown: bv.map(|bv| Breakdown {
                bv,
                ibv: 1e-3,
                slope: 0.026,
            }),
        })
    }

    fn jumped(laws: [Law; 2], i: f64) -> Option<Jump> {
        let lcs = inductor_into(laws);
        let mut jumps = JumpProblem::new(&lcs, 1e-9)?;
        assert!(jumps.monotone);
        let found = jumps.solve(&lcs, &dvector![i], &DVector::zeros(0)).unwrap();
        if let Some(jump) = &found {
            assert_eq!(jumps.verify(&lcs, jump), Ok(()));
        }
        found
    }

    #[test]
    fn a_curved_law_takes_an_interrupted_current_forward() {
        let curved = || exponential(1e-6, None);
        for laws in [
            [curved(), Law::ideal_diode()],
            [Law::ideal_diode(), curved()],
            [curved(), curved()],
        ] {
            assert_eq!(jumped(laws.clone(), 1.0), None);
            // In reverse the current is that of the leakages at once, by an impulse of L times the change.
            let leaks: f64 = laws.iter().map(|law| law.least_current().unwrap()).sum();
            let jump = jumped(laws, -1.0).unwrap();
            assert!((1e-12..1e-11).contains(&jump.rounding), "{jump:?}");
            assert!((jump.x[0] - leaks).abs() < 1e-15, "{jump:?}");
            assert!((jump.p[1] - 1e-3 * (1.0 + leaks)).abs() < 1e-15, "{jump:?}");
        }
        // Breakdown takes the current in reverse, too.
        for laws in [
            [exponential(1e-6, Some(5.0)), Law::ideal_diode()],
            [curved(), exponential(1e-6, Some(5.0))],
        ] {
            assert_eq!(jumped(laws, -1.0), None);
        }
    }

    #[test]
    fn a_curved_law_joins_no_capacitors_in_no_time() {
        let lcs = fixtures::clamped_capacitor();
        let at = |lcs: &Lcs| {
            let x = dvector![3.0];
            JumpProblem::new(lcs, 1e-9)?
                .solve(lcs, &x, &DVector::zeros(0))
                .unwrap()
        };
        assert!(at(&lcs).is_some());
        let curved = lcs.changed(|parts| parts.ports[0].law = exponential(1e-14, None));
        assert_eq!(at(&curved.unwrap()), None);
    }

    #[test]
    fn a_forward_impulse_is_an_error() {
        let lcs = inductor_into([exponential(1e-6, None), Law::ideal_diode()]);
        let jumps = JumpProblem::new(&lcs, 1e-9).unwrap();
        // Opening the ideal diode against the exponential one.
        let verify = |p: DVector<f64>, rounding: f64| {
            let (x, rivals) = (dvector![0.0], vec![]);
            let jump = Jump {
                x,
                p,
                rivals,
                rounding,
            };
            jumps.verify(&lcs, &jump)
        };
        let wrong = verify(dvector![0.0, -1e-3], 0.0).unwrap_err();
        assert!(
            wrong.what.contains("forward impulse of 1e-3 V s"),
            "{wrong}"
        );
        assert_eq!(verify(dvector![0.0, 1e-3], 0.0), Ok(()));
        assert_eq!(verify(dvector![1.0, 0.0], 0.0), Ok(()));
        // What is rounding has no sign.
        assert!(verify(dvector![1.0, -1e-3], 0.0).is_err());
        assert_eq!(verify(dvector![1.0, -1e-3], 1e-2), Ok(()));
    }

    /// D + Dᵀ and the jump matrix CB must both be semidefinite for a jump to be the solution of a monotone problem.
    #[test]
    fn a_jump_problem_is_monotone_where_both_of_its_matrices_are() {
        let is_monotone = |c: DMatrix<f64>, d: DMatrix<f64>| {
            let lcs = fixtures::system(
                &[("v(c1)", "V"), ("v(c2)", "V")],
                &[("d1", Role::Current), ("d2", Role::Current)],
                [DMatrix::zeros(2, 2), -DMatrix::identity(2, 2), c, d],
                &[1.0, 1.0],
            );
            JumpProblem::new(&lcs, 1e-9).unwrap().monotone
        };
        let (passive, turned) = (
            dmatrix![-1.0, 0.0; 0.0, -1.0],
            dmatrix![-1.0, 0.0; 0.0, 1.0],
        );
        let (none, indefinite) = (DMatrix::zeros(2, 2), dmatrix![0.0, -1.0; 0.0, 0.0]);
        assert!(is_monotone(passive.clone(), none.clone()));
        assert!(!is_monotone(passive, indefinite));
        assert!(!is_monotone(turned, none));
    }
}
