//! A dense logarithmic barrier for "how positive definite can F(z) and P(z) be made at once": Cholesky factors only.
//!
//! ```text
//! maximise t   subject to   F(z) − tI ⪰ 0,   P(z) − tI ⪰ 0,   ρI − P(z) ⪰ 0,   t ≤ 1
//! ```
//!
//! is followed along μ → 0 by Newton's method on −t/μ − Σ log det. At a centred point X = μ(F − tI)⁻¹ is dual feasible
//! with gap μ(q + 2n + 1). (On these problems it is faster than a general cone solver and better at its dual.)

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::facial::Face;
use crate::settings::tolerances::passivity::SHORTEST_STEP;
use crate::settings::tolerances::passivity::{CENTRED, GAP, RADIUS, SHRINK, SIGN};

/// Newton steps of one centring.
const NEWTON_STEPS: usize = 60;

/// How the search for the largest margin ended. All numbers are in balanced units.
#[derive(Debug, Clone)]
pub enum Outcome {
    /// t > 0: both blocks are positive definite.
    Interior {
        /// z.
        z: DVector<f64>,
        /// t.
        margin: f64,
    },
    /// The largest margin is zero to the duality gap.
    Boundary {
        /// z.
        z: DVector<f64>,
        /// t.
        margin: f64,
        /// X, the multiplier of F ⪰ tI: ⟨X, F⟩ = 0 on every solution.
        dual: DMatrix<f64>,
    },
    /// The largest margin is negative.
    Infeasible {
        /// z.
        z: DVector<f64>,
        /// t.
        margin: f64,
        /// X, the multiplier of F ⪰ tI; zero by zero if it was lost.
        dual: DMatrix<f64>,
    },
    /// The search broke off.
    Stalled {
        /// The last z.
        z: DVector<f64>,
        /// Why.
        reason: &'static str,
    },
}

impl Outcome {
    /// The z it ended with.
    #[must_use]
    pub const fn unknowns(&self) -> &DVector<f64> {
        match self {
            Self::Interior { z, .. }
            | Self::Boundary { z, .. }
            | Self::Infeasible { z, .. }
            | Self::Stalled { z, .. } => z,
        }
    }
}

/// One block S(z, t) = S₀ + Σ zₖSₖ + t S_t ≻ 0.
struct Block {
    constant: DMatrix<f64>,
    linear: Vec<DMatrix<f64>>,
    t: f64,
}

impl Block {
    fn at(&self, z: &DVector<f64>, t: f64) -> DMatrix<f64> {
        let mut s = self.constant.clone();
        for (k, sk) in self.linear.iter().enumerate() {
            s += sk * z[k];
        }
        for i in 0..s.nrows() {
            s[(i, i)] += self.t * t;
        }
        s
    }

    fn factor(&self, z: &DVector<f64>, t: f64) -> Option<Cholesky<f64, Dyn>> {
        self.at(z, t).cholesky()
    }
}

/// Maximises the margin t over a face.
#[must_use]
pub fn maximise(face: &Face) -> Outcome {
    let (p0, basis) = face.p_parts();
    let (f0, f) = face.f_parts();
    let unknowns = basis.len();
    let (q, n) = (f0.nrows(), p0.nrows());
    let rho = RADIUS * p0.amax().max(1.0) * n.max(1) as f64;
    let blocks = [
        Block {
            constant: f0.clone(),
            linear: f.to_vec(),
            t: -1.0,
        },
        Block {
            constant: p0.clone(),
            linear: basis.to_vec(),
            t: -1.0,
        },
        Block {
            constant: DMatrix::identity(n, n) * rho - p0,
            linear: basis.iter().map(|e| -e).collect(),
            t: 0.0,
        },
    ];
    let mut z = DVector::zeros(unknowns);
    let mut t = -1.0;
    while blocks.iter().any(|b| b.factor(&z, t).is_none()) {
        t *= 4.0;
        if t < -1e30 {
            return Outcome::Stalled {
                z,
                reason: "the barrier found no starting point",
            };
        }
    }
    let weight = (q + 2 * n + 1) as f64;
    let mut mu = (1.0 - t).max(1.0);
    loop {
        if !centre(&blocks, &mut z, &mut t, mu) {
            // The rounding of the Newton system bounds the accuracy of t: judge by the gap reached so far.
            return judge(&blocks, z, t, mu * SHRINK, weight);
        }
        let gap = mu * weight;
        if t > gap {
            return Outcome::Interior { z, margin: t };
        }
        if t + gap < 0.0 && t < -SIGN * gap {
            return judge(&blocks, z, t, mu, weight);
        }
        if gap < GAP {
            return judge(&blocks, z, t, mu, weight);
        }
        mu /= SHRINK;
    }
}

fn judge(blocks: &[Block; 3], z: DVector<f64>, t: f64, mu: f64, weight: f64) -> Outcome {
    let gap = mu * weight;
    if t > 0.0 {
        return Outcome::Interior { z, margin: t };
    }
    let dual = blocks[0].factor(&z, t).map(|f| f.inverse() * mu);
    match dual {
        dual if t < -SIGN * gap => Outcome::Infeasible {
            z,
            margin: t,
            dual: dual.unwrap_or_default(),
        },
        Some(dual) => Outcome::Boundary { z, margin: t, dual },
        None => Outcome::Stalled {
            z,
            reason: "the barrier lost its interior point",
        },
    }
}

/// Newton's method to the analytic centre for μ. False if it could not get there.
fn centre(blocks: &[Block; 3], z: &mut DVector<f64>, t: &mut f64, mu: f64) -> bool {
    let unknowns = z.len();
    for _ in 0..NEWTON_STEPS {
        let mut gradient = DVector::zeros(unknowns + 1);
        let mut hessian = DMatrix::zeros(unknowns + 1, unknowns + 1);
        for block in blocks {
            if block.constant.is_empty() {
                continue;
            }
            let Some(factor) = block.factor(z, *t) else {
                return false;
            };
            let inverse = factor.inverse();
            // Columns vec(L⁻¹SₖL⁻ᵀ): the Hessian is their Gram matrix.
            let lower = factor.l();
            let whiten = |s: &DMatrix<f64>| -> Option<DMatrix<f64>> {
                let half = lower.solve_lower_triangular(s)?;
                lower.solve_lower_triangular(&half.transpose())
            };
            let size = block.constant.len();
            let mut columns = DMatrix::zeros(size, unknowns + 1);
            for (k, s) in block.linear.iter().enumerate() {
                gradient[k] -= inverse.dot(s);
                let Some(white) = whiten(s) else { return false };
                columns.column_mut(k).copy_from_slice(white.as_slice());
            }
            if block.t != 0.0 {
                gradient[unknowns] -= block.t * inverse.trace();
                let Some(white) =
                    whiten(&(DMatrix::identity(inverse.nrows(), inverse.nrows()) * block.t))
                else {
                    return false;
                };
                columns
                    .column_mut(unknowns)
                    .copy_from_slice(white.as_slice());
            }
            hessian += columns.tr_mul(&columns);
        }
        gradient[unknowns] += 1.0 / (1.0 - *t) - 1.0 / mu;
        hessian[(unknowns, unknowns)] += (1.0 - *t).powi(-2);
        let Some(step) = solve(&hessian, &-&gradient) else {
            return false;
        };
        let decrement = (-gradient.dot(&step)).max(0.0).sqrt();
        let mut length = if decrement > 0.25 {
            1.0 / (1.0 + decrement)
        } else {
            1.0
        };
        loop {
            let next = &*z + step.rows(0, unknowns) * length;
            let t_next = *t + step[unknowns] * length;
            if t_next < 1.0 && blocks.iter().all(|b| b.factor(&next, t_next).is_some()) {
                (*z, *t) = (next, t_next);
                break;
            }
            length *= 0.5;
            if length < SHORTEST_STEP {
                return false;
            }
        }
        if decrement < CENTRED {
            return true;
        }
    }
    false
}

/// Solves Hx = r for H ⪰ 0 after scaling to unit diagonal, with the least ridge that makes it definite.
fn solve(h: &DMatrix<f64>, r: &DVector<f64>) -> Option<DVector<f64>> {
    let d = h
        .diagonal()
        .map(|v| if v > 0.0 { 1.0 / v.sqrt() } else { 1.0 });
    let mut unit = DMatrix::from_fn(h.nrows(), h.ncols(), |i, j| d[i] * h[(i, j)] * d[j]);
    let mut ridge = 0.0;
    for _ in 0..6 {
        if let Some(factor) = unit.clone().cholesky() {
            return Some(factor.solve(&r.component_mul(&d)).component_mul(&d));
        }
        let next = if ridge == 0.0 {
            f64::EPSILON
        } else {
            ridge * 100.0
        };
        for i in 0..unit.nrows() {
            unit[(i, i)] += next - ridge;
        }
        ridge = next;
    }
    None
}
