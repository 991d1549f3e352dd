//! The one step that integrates every form: implicit in the state and in λ (Moreau's catching-up algorithm).
//!
//! ```text
//! x' = f(t, x) + B(x) λ,   y = c(t, x) + D λ,   0 ≤ λ ⟂ y ≥ 0
//! ```
//!
//! is stepped by x⁺ = x + h f(t⁺, x⁺) + B(x⁺) p, y⁺ = c(t⁺, x⁺) + D p/h with the impulse p = hλ. For D = 0, f = 0 this is
//! the projection of x onto {c(t⁺, ·) ≥ 0} in the metric that makes B the gradient of c. Nonlinear f and c are linearised
//! at the iterate until it stands still; affine ones take one complementarity problem.

use nalgebra::{DMatrix, DVector};

use super::FormError;
use crate::settings::Settings;
use crate::settings::tolerances::theorems::LINEARISED;
use crate::solve::{Driver, Status};

/// Iterations of the linearisation.
const ITERATIONS: usize = 50;

/// A system of complementary pairs with n states and m ports.
pub trait Complementarity {
    /// (n, m).
    fn size(&self) -> (usize, usize);
    /// f(t, x), n.
    fn drift(&self, t: f64, x: &DVector<f64>) -> DVector<f64>;
    /// ∂f/∂x, n×n.
    fn drift_jacobian(&self, t: f64, x: &DVector<f64>) -> DMatrix<f64>;
    /// B(x), n×m.
    fn input(&self, x: &DVector<f64>) -> DMatrix<f64>;
    /// c(t, x), m.
    fn constraint(&self, t: f64, x: &DVector<f64>) -> DVector<f64>;
    /// ∂c/∂x, m×n.
    fn constraint_jacobian(&self, t: f64, x: &DVector<f64>) -> DMatrix<f64>;
    /// D, m×m.
    fn feedthrough(&self) -> DMatrix<f64>;
    /// Whether f and c are affine in x and B is constant: then one linearisation is exact.
    fn is_affine(&self) -> bool;
}

/// The end of a step.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// x⁺.
    pub x: DVector<f64>,
    /// λ = p/h; large where the step contains a jump.
    pub lambda: DVector<f64>,
    /// y⁺.
    pub y: DVector<f64>,
}

/// One step from x at t to t + h.
///
/// # Errors
/// [`FormError::Step`] if the complementarity problem has no solution or the linearisation does not settle.
pub fn step(
    system: &impl Complementarity,
    t: f64,
    x: &DVector<f64>,
    h: f64,
) -> Result<Step, FormError> {
    let t = t + h;
    let fail = |reason| FormError::Step { t, reason };
    let mut at = x.clone();
    let (n, m) = system.size();
    for _ in 0..ITERATIONS {
        let implicit = DMatrix::identity(n, n) - system.drift_jacobian(t, &at) * h;
        let lu = implicit.lu();
        let b = system.input(&at);
        let jacobian = system.constraint_jacobian(t, &at);
        let residual = x + system.drift(t, &at) * h - &at;
        let solve = |r: &DMatrix<f64>| lu.solve(r).ok_or_else(|| fail("I − hA is singular"));
        let free = &at + solve(&DMatrix::from_columns(&[residual]))?.column(0);
        let lambda = if m == 0 {
            DVector::zeros(0)
        } else {
            let reach = solve(&b)? * h;
            let problem = system.feedthrough() + &jacobian * &reach;
            let q = system.constraint(t, &at) + &jacobian * (&free - &at);
            // Solutions are homogeneous in q: solve at size one, so that a state that dies away stays solvable.
            let size = if q.amax() > 0.0 { q.amax() } else { 1.0 };
            let mut driver = Driver::new(problem, Settings::default().lcp_residual);
            let solution = driver.solve(&(&q / size));
            match solution.status {
                Status::Solved => solution.lambda * size,
                Status::Infeasible(_) => return Err(fail("the constraints cannot be met")),
                Status::Failed => return Err(fail("the complementarity problem was not solved")),
            }
        };
        let next = &free + solve(&DMatrix::from_columns(&[&b * &lambda * h]))?.column(0);
        let change = (&next - &at).amax();
        let size = next.amax().max(x.amax());
        if !change.is_finite() {
            return Err(fail("the iteration diverged"));
        }
        at = next;
        if system.is_affine() || change <= LINEARISED * size {
            let y = system.constraint(t, &at) + system.feedthrough() * &lambda;
            return Ok(Step { x: at, lambda, y });
        }
    }
    Err(fail("the linearisation did not settle"))
}

/// The states at the grid points t₀ + kh.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trajectory {
    /// Times.
    pub t: Vec<f64>,
    /// x at those times; the first is the start as given.
    pub x: Vec<DVector<f64>>,
    /// λ of the step that ended there (zero at the start).
    pub lambda: Vec<DVector<f64>>,
    /// y at those times (c(t₀, x₀) at the start).
    pub y: Vec<DVector<f64>>,
}

impl Trajectory {
    /// The last state.
    #[must_use]
    pub fn last(&self) -> Option<&DVector<f64>> {
        self.x.last()
    }
}

/// `steps` equal steps from x₀ at t₀ to t₁.
///
/// # Errors
/// Those of [`step`].
pub fn integrate(
    system: &impl Complementarity,
    (t0, t1): (f64, f64),
    x0: &DVector<f64>,
    steps: usize,
) -> Result<Trajectory, FormError> {
    let h = (t1 - t0) / steps.max(1) as f64;
    let (_, m) = system.size();
    let mut trajectory = Trajectory {
        t: vec![t0],
        x: vec![x0.clone()],
        lambda: vec![DVector::zeros(m)],
        y: vec![system.constraint(t0, x0)],
    };
    let mut x = x0.clone();
    for k in 0..steps {
        let end = step(system, t0 + k as f64 * h, &x, h)?;
        x = end.x.clone();
        trajectory.t.push(t0 + (k + 1) as f64 * h);
        trajectory.x.push(end.x);
        trajectory.lambda.push(end.lambda);
        trajectory.y.push(end.y);
    }
    Ok(trajectory)
}
