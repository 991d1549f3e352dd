//! State observers for multivalued Lur'e systems (RR-7158 (39)-(42)).
//!
//! ```text
//! ξ' = Aξ + Bγ + e + L(z − Gξ − Fγ),   −γ ∈ ∂Φ(Cξ + Dγ + f),   measured: z = Gx + Fλ
//! ```
//!
//! The error e = x − ξ obeys (42), the passive interconnection of (A − LG, B − LF, C, D) with a monotone relation: if that
//! quadruple is strictly passive with rate α, the error decays like exp(−αt).

use std::rc::Rc;

use nalgebra::{DMatrix, DVector};

use super::{FormError, Linear};
use crate::passivity::facial::Face;
use crate::passivity::{Residuals, System, barrier, lmi, scale, verify};
use crate::settings::tolerances::theorems::LARGEST_GAIN;

/// A gain with its certificate.
#[derive(Debug, Clone, PartialEq)]
pub struct Observer {
    /// L, n×k.
    pub gain: DMatrix<f64>,
    /// P of the error system.
    pub p: DMatrix<f64>,
    /// The decay rate α that P certifies, 1/s.
    pub decay_rate: f64,
    /// How well it was verified.
    pub residuals: Residuals,
}

/// [[states, coupling], [couplingᵀ, ports]].
pub(super) fn blocks(
    states: &DMatrix<f64>,
    coupling: &DMatrix<f64>,
    ports: &DMatrix<f64>,
) -> DMatrix<f64> {
    let (n, m) = coupling.shape();
    let mut q = DMatrix::zeros(n + m, n + m);
    q.view_mut((0, 0), (n, n)).copy_from(states);
    q.view_mut((0, n), (n, m)).copy_from(coupling);
    q.view_mut((n, 0), (m, n)).copy_from(&coupling.transpose());
    q.view_mut((n, n), (m, m)).copy_from(ports);
    q
}

/// diag(P, [[ρI, K], [Kᵀ, ρI]]): positive definite where P is and K is bounded by ρ.
pub(super) fn bounded(p: &DMatrix<f64>, k: &DMatrix<f64>, rho: f64) -> DMatrix<f64> {
    let (n, r, c) = (p.nrows(), k.nrows(), k.ncols());
    let mut m = DMatrix::zeros(n + r + c, n + r + c);
    m.view_mut((0, 0), (n, n)).copy_from(p);
    m.view_mut((n, n + r), (r, c)).copy_from(k);
    m.view_mut((n + r, n), (c, r)).copy_from(&k.transpose());
    for i in n..n + r + c {
        m[(i, i)] = rho;
    }
    m
}

/// The unit symmetric matrices of order n, then the unit r×c matrices.
pub(super) fn units(n: usize, r: usize, c: usize) -> Vec<(DMatrix<f64>, DMatrix<f64>)> {
    let mut list = Vec::new();
    for i in 0..n {
        for j in 0..=i {
            let mut p = DMatrix::zeros(n, n);
            (p[(i, j)], p[(j, i)]) = (1.0, 1.0);
            list.push((p, DMatrix::zeros(r, c)));
        }
    }
    for i in 0..r {
        for j in 0..c {
            let mut k = DMatrix::zeros(r, c);
            k[(i, j)] = 1.0;
            list.push((DMatrix::zeros(n, n), k));
        }
    }
    list
}

/// Σ zₖ uₖ.
pub(super) fn combine(
    list: &[(DMatrix<f64>, DMatrix<f64>)],
    z: &DVector<f64>,
    (n, r, c): (usize, usize, usize),
) -> (DMatrix<f64>, DMatrix<f64>) {
    list.iter().zip(z.iter()).fold(
        (DMatrix::zeros(n, n), DMatrix::zeros(r, c)),
        |(p, k), ((up, uk), &z)| (p + up * z, k + uk * z),
    )
}

impl Observer {
    /// A gain for which (A − LG, B − LF, C, D) is strictly passive with rate at least `rate` (1/s), from the inequality
    /// (46) in P and K = PL.
    ///
    /// # Errors
    /// Shapes, or where the search for a gain ended.
    pub fn design(
        system: &System,
        g: &DMatrix<f64>,
        f: &DMatrix<f64>,
        rate: f64,
    ) -> Result<Self, FormError> {
        let (n, m, k) = (system.n(), system.m(), g.nrows());
        for (what, matrix, shape) in [("G", g, (k, n)), ("F", f, (k, m))] {
            if matrix.shape() != shape {
                return Err(FormError::Shape {
                    what,
                    rows: matrix.nrows(),
                    columns: matrix.ncols(),
                });
            }
        }
        let balanced = scale::balance(system);
        let s = &balanced.system;
        let mut g_hat = g * DMatrix::from_diagonal(&balanced.states);
        let mut f_hat = f * DMatrix::from_diagonal(&balanced.ports);
        let mut sizes = DVector::from_element(k, 1.0);
        for i in 0..k {
            let size = g_hat.row(i).amax().max(f_hat.row(i).amax());
            if size > 0.0 {
                sizes[i] = size;
                g_hat.row_mut(i).scale_mut(1.0 / size);
                f_hat.row_mut(i).scale_mut(1.0 / size);
            }
        }
        let alpha = rate / balanced.omega;
        let ports = &s.d + s.d.transpose();
        let at = |p: &DMatrix<f64>, gain: &DMatrix<f64>, constant: f64| {
            let states = p * &s.a - gain * &g_hat + p * alpha;
            let coupling = p * &s.b - gain * &f_hat - s.c.transpose() * constant;
            -blocks(
                &(&states + states.transpose()),
                &coupling,
                &(-&ports * constant),
            )
        };
        let list = units(n, n, k);
        let zero = (DMatrix::zeros(n, n), DMatrix::zeros(n, k));
        let whole = Face::new(
            at(&zero.0, &zero.1, 1.0),
            list.iter().map(|(p, gain)| at(p, gain, 0.0)).collect(),
            bounded(&zero.0, &zero.1, LARGEST_GAIN),
            list.iter().map(|(p, gain)| bounded(p, gain, 0.0)).collect(),
        );
        let face = expose_lossless(&whole, &scale::split(&ports, 0.0).kernel, n).ok_or(
            FormError::Hypothesis {
                statement: "RR-7158 section 3.2.3",
                condition: "no P, L fulfil the equalities on ker(D + Dᵀ)",
                size: 1.0,
            },
        )?;
        lmi::search(&face, barrier::maximise, |z| {
            let (p_hat, gain_hat) = combine(&list, &face.original(z), (n, n, k));
            let l_hat = p_hat.clone().try_inverse().ok_or("P is singular")? * gain_hat;
            let gain = DMatrix::from_fn(n, k, |i, j| balanced.omega * balanced.states[i] * l_hat[(i, j)] / sizes[j]);
            let t = balanced.states.map(f64::recip);
            let p = scale::scaled(&p_hat, &t, &t);
            let error = Self::error_system(system, g, f, &gain);
            let residuals = verify::check(&error.shifted(rate), &p).map_err(|failure| failure.to_string())?;
            Ok(Self { gain, p, decay_rate: rate, residuals })
        })
        .map_err(|_| FormError::Hypothesis {
            statement: "RR-7158 section 3.2.3",
            condition: "no gain was found for which the error system is strictly passive with the given rate",
            size: rate,
        })
    }

    /// (A − LG, B − LF, C, D).
    #[must_use]
    pub fn error_system(
        system: &System,
        g: &DMatrix<f64>,
        f: &DMatrix<f64>,
        gain: &DMatrix<f64>,
    ) -> System {
        System {
            a: &system.a - gain * g,
            b: &system.b - gain * f,
            c: system.c.clone(),
            d: system.d.clone(),
        }
    }

    /// Plant and observer together, (x, ξ) driven by (λ, γ): (2) with (40).
    ///
    /// # Errors
    /// [`FormError::Shape`].
    pub fn with_plant(
        &self,
        plant: &Linear,
        g: &DMatrix<f64>,
        f: &DMatrix<f64>,
    ) -> Result<Linear, FormError> {
        let s = &plant.system;
        let (n, m) = (s.n(), s.m());
        let error = Self::error_system(s, g, f, &self.gain);
        let mut joint = System {
            a: DMatrix::zeros(2 * n, 2 * n),
            b: DMatrix::zeros(2 * n, 2 * m),
            c: DMatrix::zeros(2 * m, 2 * n),
            d: DMatrix::zeros(2 * m, 2 * m),
        };
        joint.a.view_mut((0, 0), (n, n)).copy_from(&s.a);
        joint
            .a
            .view_mut((n, 0), (n, n))
            .copy_from(&(&self.gain * g));
        joint.a.view_mut((n, n), (n, n)).copy_from(&error.a);
        joint.b.view_mut((0, 0), (n, m)).copy_from(&s.b);
        joint
            .b
            .view_mut((n, 0), (n, m))
            .copy_from(&(&self.gain * f));
        joint.b.view_mut((n, m), (n, m)).copy_from(&error.b);
        for k in 0..2 {
            joint.c.view_mut((k * m, k * n), (m, n)).copy_from(&s.c);
            joint.d.view_mut((k * m, k * m), (m, m)).copy_from(&s.d);
        }
        let twice = |signal: &super::Signal| -> super::Signal {
            let signal = signal.clone();
            Rc::new(move |t| {
                let v = signal(t);
                DVector::from_iterator(2 * v.len(), v.iter().chain(v.iter()).copied())
            })
        };
        Linear::new(joint, twice(&plant.e), twice(&plant.f))
    }
}

/// The face F(z)[0; N] = 0 for orthonormal port patterns N that no unknown can make lossy.
pub(super) fn expose_lossless(whole: &Face, null: &DMatrix<f64>, n: usize) -> Option<Face> {
    if null.ncols() == 0 {
        return Some(whole.clone());
    }
    let mut v = DMatrix::zeros(n + null.nrows(), null.ncols());
    v.view_mut((n, 0), null.shape()).copy_from(null);
    whole.expose(&(&v * v.transpose()))
}
