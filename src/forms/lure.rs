//! The multivalued Lur'e system x' = Ax + Bλ + e, y = Cx + Dλ + f, −λⱼ ∈ ∂φⱼ(yⱼ) (RR-7158 (2)) with piecewise linear ∂φ.

use nalgebra::{DMatrix, DVector};

use super::{Complementarity, FormError, Linear, Signal, Trajectory};
use crate::passivity::System;
use crate::settings::Settings;
use crate::solve::{Driver, Status};

/// A convex, proper, lower semicontinuous φ: R → R ∪ {+∞}.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Phi {
    /// The indicator of [0, ∞): 0 ≤ λ ⟂ y ≥ 0.
    HalfLine,
    /// The indicator of [low, high].
    Interval {
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// g|y|: the relay −λ ∈ g Sgn(y).
    Relay {
        /// g > 0.
        gain: f64,
    },
    /// ½ r y²: the linear element λ = −r y.
    Quadratic {
        /// r ≥ 0.
        stiffness: f64,
    },
}

impl Phi {
    /// φ(y).
    #[must_use]
    pub fn value(&self, y: f64) -> f64 {
        match *self {
            Self::HalfLine => {
                if y >= 0.0 {
                    0.0
                } else {
                    f64::INFINITY
                }
            }
            Self::Interval { low, high } => {
                if (low..=high).contains(&y) {
                    0.0
                } else {
                    f64::INFINITY
                }
            }
            Self::Relay { gain } => gain * y.abs(),
            Self::Quadratic { stiffness } => 0.5 * stiffness * y * y,
        }
    }

    /// φ^{*,−}(z) = sup_y (−zy − φ(y)), RR-7158 (5).
    #[must_use]
    pub fn conjugate(&self, z: f64) -> f64 {
        match *self {
            Self::HalfLine => {
                if z >= 0.0 {
                    0.0
                } else {
                    f64::INFINITY
                }
            }
            Self::Interval { low, high } => (-z * low).max(-z * high),
            Self::Relay { gain } => {
                if z.abs() <= gain {
                    0.0
                } else {
                    f64::INFINITY
                }
            }
            Self::Quadratic { stiffness } => {
                if stiffness > 0.0 {
                    0.5 * z * z / stiffness
                } else if z == 0.0 {
                    0.0
                } else {
                    f64::INFINITY
                }
            }
        }
    }

    /// Whether −λ ∈ ∂φ(y), by Fenchel's equality φ(y) + φ^{*,−}(λ) = −λy up to `tolerance`.
    #[must_use]
    pub fn relates(&self, lambda: f64, y: f64, tolerance: f64) -> bool {
        // Points off the domain by rounding are moved onto it.
        let (y, lambda) = match *self {
            Self::HalfLine => (
                snap(y, 0.0, f64::INFINITY, tolerance),
                snap(lambda, 0.0, f64::INFINITY, tolerance),
            ),
            Self::Interval { low, high } => (snap(y, low, high, tolerance), lambda),
            Self::Relay { gain } => (y, snap(lambda, -gain, gain, tolerance)),
            Self::Quadratic { .. } => (y, lambda),
        };
        (self.value(y) + self.conjugate(lambda) + lambda * y).abs()
            <= tolerance * (1.0 + lambda.abs() + y.abs())
    }
}

fn snap(v: f64, low: f64, high: f64, tolerance: f64) -> f64 {
    if v < low && v > low - tolerance {
        low
    } else if v > high && v < high + tolerance {
        high
    } else {
        v
    }
}

/// A multivalued Lur'e system.
#[derive(Debug, Clone)]
pub struct Lure {
    /// The linear part with its driven terms.
    pub linear: Linear,
    /// φⱼ, one per port.
    pub phi: Vec<Phi>,
}

/// The complementarity system that a Lur'e system expands to, and how to read λ back: λ = L·μ + l.
#[derive(Debug, Clone)]
pub struct Expansion {
    /// The system of the pairs μ.
    pub linear: Linear,
    /// L, m×(number of pairs).
    pub map: DMatrix<f64>,
    /// l, m.
    pub offset: DVector<f64>,
}

impl Lure {
    /// A Lur'e system.
    ///
    /// # Errors
    /// [`FormError::Shape`] unless there is one φ per port.
    pub fn new(linear: Linear, phi: Vec<Phi>) -> Result<Self, FormError> {
        if phi.len() != linear.system.m() {
            return Err(FormError::Shape {
                what: "φ",
                rows: phi.len(),
                columns: 1,
            });
        }
        Ok(Self { linear, phi })
    }

    /// As a linear complementarity system: an interval is two pairs (μ₁ ⟂ y − low, μ₂ ⟂ high − y, λ = μ₁ − μ₂), a relay is
    /// λ = μ₁ − g with μ₁ ⟂ y + μ₂ and μ₂ ⟂ 2g − μ₁, a quadratic closes the loop λ = −ry.
    ///
    /// # Errors
    /// [`FormError::Hypothesis`] if closing the quadratic loops is not possible (1 + rD singular).
    pub fn expand(&self) -> Result<Expansion, FormError> {
        let System { a, b, c, d } = &self.linear.system;
        let (n, m) = (a.nrows(), d.nrows());
        // λ = Kλ' + … first: λ = λ' − R y for the quadratic ports (R diagonal), y = T(Cx + Dλ' + f).
        let r = self.stiffness();
        let loops = DMatrix::identity(m, m) + d * &r;
        let t = loops.clone().try_inverse().ok_or(FormError::Hypothesis {
            statement: "quadratic φ",
            condition: "1 + DR is singular",
            size: loops.determinant(),
        })?;
        let kappa = DMatrix::identity(m, m) - &r * &t * d;
        let (a, c) = (a - b * &r * &t * c, &t * c);
        let (b, d) = (b * &kappa, &t * d);
        // Rows (w = S y + w_μ μ + w₀) and columns (λ' = Lμ + l) of the pairs.
        let mut pairs: Vec<(usize, f64, f64)> = Vec::new();
        let mut offset = DVector::zeros(m);
        let mut relays = Vec::new();
        for (j, phi) in self.phi.iter().enumerate() {
            match *phi {
                Phi::HalfLine => pairs.push((j, 1.0, 0.0)),
                Phi::Interval { low, high } => pairs.extend([(j, 1.0, -low), (j, -1.0, high)]),
                Phi::Relay { gain } => {
                    offset[j] = -gain;
                    relays.push((pairs.len(), gain));
                    pairs.extend([(j, 1.0, 0.0), (j, 0.0, 2.0 * gain)]);
                }
                Phi::Quadratic { .. } => {}
            }
        }
        let k = pairs.len();
        let mut map = DMatrix::zeros(m, k);
        let mut constant = DVector::zeros(k);
        for (i, &(j, sign, w0)) in pairs.iter().enumerate() {
            map[(j, i)] = sign;
            constant[i] = w0;
        }
        let select = map.transpose();
        let mut extra = DMatrix::zeros(k, k);
        for &(i, _) in &relays {
            extra[(i, i + 1)] = 1.0;
            extra[(i + 1, i)] = -1.0;
        }
        let system = System {
            b: &b * &map,
            c: &select * &c,
            d: &select * &d * &map + extra,
            a,
        };
        let (e, f) = (self.linear.e.clone(), self.linear.f.clone());
        let (rt, b_raw, t2) = (&r * &t, self.linear.system.b.clone(), t.clone());
        let shift_x = &b * &offset;
        let shift_y = &select * (&d * &offset) + constant;
        let f_x = f.clone();
        let signal_e: Signal =
            std::rc::Rc::new(move |time| e(time) - &b_raw * (&rt * f_x(time)) + &shift_x);
        let signal_f: Signal = std::rc::Rc::new(move |time| &select * (&t2 * f(time)) + &shift_y);
        debug_assert_eq!(system.n(), n);
        Ok(Expansion {
            linear: Linear::new(system, signal_e, signal_f)?,
            map,
            offset,
        })
    }

    /// λ and y at a state, where the state determines them: (D + ∂Φ^{*,−})⁻¹(−Cx − f) and Cx + Dλ + f.
    ///
    /// # Errors
    /// Those of [`Lure::expand`]; [`FormError::Step`] if λ was not found.
    pub fn ports(
        &self,
        t: f64,
        x: &DVector<f64>,
    ) -> Result<(DVector<f64>, DVector<f64>), FormError> {
        let expansion = self.expand()?;
        let pairs = &expansion.linear;
        let q = pairs.constraint(t, x);
        let mu = if q.is_empty() {
            q
        } else {
            let mut driver = Driver::new(pairs.system.d.clone(), Settings::default().lcp_residual);
            let solution = driver.solve(&q);
            if solution.status != Status::Solved {
                return Err(FormError::Step {
                    t,
                    reason: "λ of the ports was not found",
                });
            }
            solution.lambda
        };
        self.read_back(&expansion, t, x, &mu)
    }

    /// λ and y of the ports from the μ of the pairs. For quadratic φ λ = λ' − ry with y = Cx + Dλ + f.
    fn read_back(
        &self,
        expansion: &Expansion,
        t: f64,
        x: &DVector<f64>,
        mu: &DVector<f64>,
    ) -> Result<(DVector<f64>, DVector<f64>), FormError> {
        let system = &self.linear.system;
        let free = &expansion.map * mu + &expansion.offset;
        let base = &system.c * x + (self.linear.f)(t);
        let (r, m) = (self.stiffness(), system.m());
        if m == 0 {
            return Ok((free, base));
        }
        let y = (DMatrix::identity(m, m) + &system.d * &r)
            .lu()
            .solve(&(base + &system.d * &free))
            .ok_or(FormError::Step {
                t,
                reason: "1 + DR is singular",
            })?;
        Ok((free - r * &y, y))
    }

    /// R, m×m: the stiffness of the quadratic φ, zero for the others.
    fn stiffness(&self) -> DMatrix<f64> {
        let of = |phi: &Phi| match phi {
            Phi::Quadratic { stiffness } => *stiffness,
            _ => 0.0,
        };
        DMatrix::from_diagonal(&DVector::from_iterator(
            self.phi.len(),
            self.phi.iter().map(of),
        ))
    }

    /// `steps` implicit steps from x₀; λ and y of the trajectory are those of the Lur'e system's own ports.
    ///
    /// # Errors
    /// Those of [`Lure::expand`] and of the steps.
    pub fn integrate(
        &self,
        span: (f64, f64),
        x0: &DVector<f64>,
        steps: usize,
    ) -> Result<Trajectory, FormError> {
        let expansion = self.expand()?;
        let mut trajectory = expansion.linear.integrate(span, x0, steps)?;
        for k in 0..trajectory.t.len() {
            let (t, x, mu) = (trajectory.t[k], &trajectory.x[k], &trajectory.lambda[k]);
            let (lambda, y) = self.read_back(&expansion, t, x, mu)?;
            trajectory.lambda[k] = lambda;
            trajectory.y[k] = y;
        }
        Ok(trajectory)
    }
}
