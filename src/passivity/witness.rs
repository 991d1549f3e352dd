//! Verified reasons why a system is *not* passive.
//!
//! For a storage function ½ xᵀPx, P ≻ 0, every complex (s, x, v) with sx = Ax + Bv and Re s ≥ 0 satisfies
//! `Re(s) x*Px ≤ Re(v*(Cx + Dv))`: the input λ(t) = Re(v eˢᵗ) from x(0) = Re x drives a motion that grows (or stays), so
//! it must be paid for. A motion that supplies energy instead refutes every P at once.

use nalgebra::{Complex, DMatrix, DVector};

use super::mixture::Mixture;
use super::scale::{self, Balanced};
use super::{System, sweep};
use crate::settings::tolerances::passivity::ENTRIES;
use crate::settings::tolerances::passivity::KERNEL;

pub(super) type C = Complex<f64>;

/// States beyond which only the feedthrough is searched: the sweep takes hundreds of factorisations.
const LARGEST: usize = 150;

/// Why no storage function exists. Vectors are in the units of the system they were found for.
#[derive(Debug, Clone, PartialEq)]
pub enum Witness {
    /// vᵀDv < 0: a port current (voltage) pattern that gains energy through the resistive part alone.
    Feedthrough {
        /// v.
        direction: Vec<f64>,
        /// vᵀDv.
        power: f64,
    },
    /// sx = Ax + Bv with Re s ≥ 0 and Re(v*(Cx + Dv)) < 0, or = 0 with Re s > 0 and v = 0 (an unstable free motion).
    Motion {
        /// s, 1/s (rad/s in the imaginary part).
        s: C,
        /// x.
        state: Vec<C>,
        /// v.
        input: Vec<C>,
        /// Re(v*(Cx + Dv)).
        supply: f64,
    },
    /// v ∈ ker(D + Dᵀ) with Bv = 0 but Cᵀv ≠ 0: the input cv, c → ±∞, moves no state and draws unlimited energy.
    Unreached {
        /// v.
        direction: Vec<f64>,
    },
    /// NᵀCBN is not symmetric on N = ker(D + Dᵀ): PBN = CᵀN has no symmetric solution.
    Asymmetric {
        /// N, m×k.
        ports: DMatrix<f64>,
    },
    /// v ∈ ker(D + Dᵀ) with vᵀCBv < 0: PBN = CᵀN has no positive semidefinite solution.
    Markov {
        /// v.
        direction: Vec<f64>,
    },
    /// A dual solution of (45): several motions that together grow and gain energy.
    Mixture(Mixture),
}

impl Witness {
    /// In words, one sentence.
    #[must_use]
    pub fn describe(&self) -> String {
        match self {
            Self::Feedthrough { power, .. } => {
                format!("the resistive part supplies power: vᵀDv = {power:.3e} for some port pattern v")
            }
            Self::Motion { s, input, .. } if input.iter().all(|v| v.norm() == 0.0) => {
                format!("a free motion grows like exp({:.6e} t) without any supply", s.re)
            }
            Self::Motion { s, supply, .. } => format!(
                "the ports gain energy at s = {:.6e} {:+.6e}j: Re v*H(s)v = {supply:.3e} < 0 (positive-realness fails)",
                s.re, s.im
            ),
            Self::Unreached { .. } => {
                "a lossless port pattern that reaches no state sees one: it can draw unlimited energy".into()
            }
            Self::Asymmetric { .. } => "C B is not symmetric on the lossless ports: P B = Cᵀ has no solution".into(),
            Self::Markov { .. } => "C B is not positive semidefinite on the lossless ports: P B = Cᵀ has no P ≻ 0".into(),
            Self::Mixture(mixture) => format!(
                "{} motions whose second moments grow together gain energy at the ports: Σ vᵀy = {:.3e} < 0 (the inequality (45) \
                 is infeasible by duality)",
                mixture.states.ncols(),
                mixture.supply
            ),
        }
    }

    /// Whether it holds for this system and every system whose entries differ by rounding.
    #[must_use]
    pub fn verify(&self, system: &System) -> bool {
        let shape = |len: usize| len == system.m();
        match self {
            Self::Feedthrough { direction, .. } => {
                let v = DVector::from_column_slice(direction);
                let size = v.abs().dot(&(system.d.abs() * v.abs()));
                shape(v.len()) && v.dot(&(&system.d * &v)) < -ENTRIES * size
            }
            Self::Motion {
                s, state, input, ..
            } => {
                shape(input.len())
                    && state.len() == system.n()
                    && verify_motion(system, *s, state, input)
            }
            Self::Unreached { direction } => {
                let v = DVector::from_column_slice(direction);
                shape(v.len()) && lossless(system, &v) && {
                    let reached = &system.b * &v;
                    let size = system.b.abs() * v.abs();
                    let seen = system.c.transpose() * &v;
                    let seen_size = system.c.abs().transpose() * v.abs();
                    (0..reached.len()).all(|i| reached[i].abs() <= KERNEL * size[i])
                        && (0..seen.len())
                            .any(|i| seen[i].abs() > KERNEL.sqrt() * seen_size[i] && seen[i] != 0.0)
                }
            }
            Self::Asymmetric { ports } => {
                let gram = |b: &DMatrix<f64>, c: &DMatrix<f64>, n: &DMatrix<f64>| {
                    n.transpose() * c * b * n
                };
                let value = gram(&system.b, &system.c, ports);
                let size = gram(&system.b.abs(), &system.c.abs(), &ports.abs());
                let difference = &value - value.transpose();
                let bound = (&size + size.transpose()) * KERNEL;
                shape(ports.nrows())
                    && (0..ports.ncols()).all(|j| lossless(system, &ports.column(j).into_owned()))
                    && difference
                        .iter()
                        .zip(bound.iter())
                        .any(|(d, b)| d.abs() > *b && d.abs() > 0.0)
            }
            Self::Markov { direction } => {
                let v = DVector::from_column_slice(direction);
                let value = v.dot(&(&system.c * (&system.b * &v)));
                let size = v.abs().dot(&(system.c.abs() * (system.b.abs() * v.abs())));
                shape(v.len()) && lossless(system, &v) && value < -KERNEL * size
            }
            Self::Mixture(mixture) => mixture.verify(system),
        }
    }

    /// The witness of the original system from one of the balanced system.
    pub(super) fn unbalanced(self, balanced: &Balanced) -> Self {
        let port = |v: Vec<f64>| {
            v.iter()
                .zip(balanced.ports.iter())
                .map(|(v, s)| v * s)
                .collect()
        };
        match self {
            Self::Feedthrough { direction, power } => Self::Feedthrough {
                direction: port(direction),
                power: power * balanced.omega,
            },
            Self::Motion {
                s,
                state,
                input,
                supply,
            } => Self::Motion {
                s: s * balanced.omega,
                state: state
                    .iter()
                    .zip(balanced.states.iter())
                    .map(|(x, t)| x * t)
                    .collect(),
                input: input
                    .iter()
                    .zip(balanced.ports.iter())
                    .map(|(v, s)| v * s)
                    .collect(),
                supply: supply * balanced.omega,
            },
            Self::Unreached { direction } => Self::Unreached {
                direction: port(direction),
            },
            Self::Asymmetric { ports } => Self::Asymmetric {
                ports: DMatrix::from_diagonal(&balanced.ports) * ports,
            },
            Self::Markov { direction } => Self::Markov {
                direction: port(direction),
            },
            Self::Mixture(mixture) => Self::Mixture(Mixture {
                states: DMatrix::from_diagonal(&balanced.states) * mixture.states,
                inputs: DMatrix::from_diagonal(&balanced.ports) * mixture.inputs,
                supply: mixture.supply * balanced.omega,
            }),
        }
    }
}

/// vᵀ(D + Dᵀ)v = 0 to rounding.
fn lossless(system: &System, v: &DVector<f64>) -> bool {
    let loss = (&system.d * v).dot(v).abs();
    loss <= KERNEL * v.abs().dot(&(system.d.abs() * v.abs()))
}

pub(super) fn complex(m: &DMatrix<f64>) -> DMatrix<C> {
    m.map(|v| C::new(v, 0.0))
}

/// sI − A.
pub(super) fn resolvent(a: &DMatrix<f64>, s: C) -> DMatrix<C> {
    let mut r = complex(&-a);
    for i in 0..a.nrows() {
        r[(i, i)] += s;
    }
    r
}

/// The supply (or growth) must stay negative (positive) under relative errors [`ENTRIES`] of all entries, by first-order
/// perturbation with the adjoint.
fn verify_motion(system: &System, s: C, state: &[C], input: &[C]) -> bool {
    if s.re.is_nan()
        || s.re < 0.0
        || state
            .iter()
            .chain(input)
            .any(|v| !v.re.is_finite() || !v.im.is_finite())
    {
        return false;
    }
    let x = DVector::from_column_slice(state);
    let v = DVector::from_column_slice(input);
    let (ax, av) = (x.map(|z| z.norm()), v.map(|z| z.norm()));
    let shift = resolvent(&system.a, s);
    let terms = system.a.abs() * &ax + system.b.abs() * &av + &ax * s.norm();
    let residual = (&shift * &x - complex(&system.b) * &v).map(|z| z.norm());
    if av.amax() == 0.0 {
        // A free motion: the eigenvalue's first-order error is |w|ᵀ(ε|A||x| + |r|)/|w*x| with the left eigenvector w.
        if ax.amax() == 0.0 || s.re <= 0.0 {
            return false;
        }
        let Some(w) = inverse_iteration(&shift.adjoint(), system.a.amax()) else {
            return false;
        };
        let overlap = w.dotc(&x).norm();
        let error = w.map(|z| z.norm()).dot(&(terms * ENTRIES + residual));
        return s.re * overlap > error;
    }
    let supply = v
        .dotc(&(complex(&system.c) * &x + complex(&system.d) * &v))
        .re;
    let Some(adjoint) = shift
        .adjoint()
        .lu()
        .solve(&(complex(&system.c).transpose() * &v))
    else {
        return false;
    };
    let error = adjoint.map(|z| z.norm()).dot(&(terms * ENTRIES + residual))
        + ENTRIES * av.dot(&(system.c.abs() * &ax + system.d.abs() * &av));
    supply.is_finite() && supply < -error
}

/// A vector that the (nearly singular) sI − A maps to (nearly) zero; `size` is the size of A's entries.
fn inverse_iteration(m: &DMatrix<C>, size: f64) -> Option<DVector<C>> {
    let n = m.nrows();
    let mut nudged = m.clone();
    for i in 0..n {
        nudged[(i, i)] += C::new(f64::EPSILON * size, 0.0);
    }
    let lu = nudged.lu();
    let mut x = DVector::from_fn(n, |i, _| {
        C::new(1.0 + 0.1 * i as f64, 0.3 - 0.05 * i as f64)
    });
    for _ in 0..3 {
        x = lu.solve(&x)?;
        let norm = x.norm();
        if !(norm.is_finite() && norm > 0.0) {
            return None;
        }
        x /= C::new(norm, 0.0);
    }
    Some(x)
}

/// Looks for a violation: in the feedthrough, in the free motion, in the transfer matrix over Re s ≥ 0.
#[must_use]
pub fn search(system: &System) -> Option<Witness> {
    let balanced = scale::balance(system);
    let accept = |witness: Witness| {
        let witness = witness.unbalanced(&balanced);
        witness.verify(system).then_some(witness)
    };
    if let Some(witness) = feedthrough(&balanced.system).and_then(accept) {
        return Some(witness);
    }
    if system.n() > LARGEST {
        return None;
    }
    unstable(&balanced.system)
        .into_iter()
        .find_map(accept)
        .or_else(|| sweep::violation(&balanced.system, accept))
}

/// The direction of the smallest eigenvalue of D + Dᵀ.
fn feedthrough(system: &System) -> Option<Witness> {
    let (values, vectors) = scale::eigen(&(&system.d + system.d.transpose()));
    let power = values.iter().copied().next().filter(|&v| v < 0.0)? / 2.0;
    Some(Witness::Feedthrough {
        direction: vectors.column(0).as_slice().to_vec(),
        power,
    })
}

/// Free motions with Re s > 0.
fn unstable(system: &System) -> Vec<Witness> {
    let n = system.n();
    eigenvalues(&system.a)
        .into_iter()
        .filter(|s| s.re > 0.0 && s.im >= 0.0)
        .filter_map(|s| {
            let x = inverse_iteration(&resolvent(&system.a, s), system.a.amax())?;
            // Rayleigh quotient: the eigenvalue to the accuracy of the vector.
            let s = x.dotc(&(complex(&system.a) * &x));
            Some(Witness::Motion {
                s,
                state: x.as_slice().to_vec(),
                input: vec![C::new(0.0, 0.0); system.m()],
                supply: 0.0,
            })
        })
        .filter(|_| n > 0)
        .collect()
}

/// Eigenvalues of a real matrix; empty for 0×0.
pub(crate) fn eigenvalues(a: &DMatrix<f64>) -> Vec<C> {
    if a.is_empty() || !a.iter().all(|v| v.is_finite()) {
        return Vec::new();
    }
    a.complex_eigenvalues().iter().copied().collect()
}
