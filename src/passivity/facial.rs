//! Facial reduction of (45): what every solution must satisfy exactly is solved exactly, and leaves the problem.
//!
//! D + Dᵀ is singular for diode circuits. With N a basis of its kernel, Q(P) ⪯ 0 forces PBN = CᵀN. Writing M = BN,
//! R = CᵀN and M = U₁ΣVᵀ, the symmetric solutions of PM = R are
//!
//! ```text
//! P = U [ P₁₁  P₁₂ ] Uᵀ,   [P₁₁; P₁₂ᵀ] = UᵀRVΣ⁻¹,   P₂₂ = P₂₂ᵀ free,   U = [U₁ U₂],
//!       [ P₁₂ᵀ P₂₂ ]
//! ```
//!
//! and they exist iff R vanishes on ker M and NᵀBᵀCᵀN = MᵀR is symmetric; P ≻ 0 needs P₁₁ ≻ 0 as well.

use nalgebra::{DMatrix, DVector};

use super::{System, Witness, lmi, scale};

/// Size, in balanced units, above which an inconsistency of the equalities counts as real.
const INCONSISTENT: f64 = 1e-8;

/// Dual eigenvalues (relative to the largest) above which a direction is exposed: the dual of a margin that is zero is
/// of rank one or more, with a gap of many decades below.
const EXPOSED: f64 = 1e-5;

/// Eigenvalues of F at a solution (relative to the largest) that count as zero when the exposed face is sharpened.
const NEARLY_NULL: f64 = 1e-7;

/// The affine set of P = P₀ + Σ zₖEₖ and the subspace W on which F(z) = −WᵀQ(P)W must still be made positive definite.
#[derive(Debug, Clone)]
pub struct Face {
    system: System,
    p0: DMatrix<f64>,
    basis: Vec<DMatrix<f64>>,
    w: DMatrix<f64>,
}

/// The kernel equalities have no solution.
#[derive(Debug, Clone)]
pub(super) enum Inconsistent {
    /// With a witness, in balanced units.
    Witness(Witness),
    /// By less than what counts as real.
    Rounding(String),
}

/// Eᵢⱼ + Eⱼᵢ in an orthonormal basis U: the symmetric matrices of U P₂₂ Uᵀ.
fn symmetric_basis(u: &DMatrix<f64>) -> Vec<DMatrix<f64>> {
    let k = u.ncols();
    (0..k)
        .flat_map(|i| (0..=i).map(move |j| (i, j)))
        .map(|(i, j)| {
            let outer = u.column(i) * u.column(j).transpose();
            scale::symmetric(&outer)
        })
        .collect()
}

impl Face {
    /// The solutions of PBN = CᵀN, N = ker(D + Dᵀ), of a balanced system.
    pub(super) fn kernel(system: &System) -> Result<Self, Inconsistent> {
        let (n, m) = (system.n(), system.m());
        let (values, vectors) = scale::eigen(&(&system.d + system.d.transpose()));
        let size = system.d.amax().max(f64::MIN_POSITIVE);
        let kernel: Vec<usize> = (0..m)
            .filter(|&i| values[i].abs() <= scale::RANK * size)
            .collect();
        let rest: Vec<usize> = (0..m)
            .filter(|&i| values[i].abs() > scale::RANK * size)
            .collect();
        let null = vectors.select_columns(&kernel);
        let (p0, u2) = equalities(&(&system.b * &null), &(system.c.transpose() * &null), &null)?;
        let mut w = DMatrix::zeros(n + m, n + rest.len());
        w.view_mut((0, 0), (n, n)).fill_with_identity();
        w.view_mut((n, n), (m, rest.len()))
            .copy_from(&vectors.select_columns(&rest));
        Ok(Self {
            system: system.clone(),
            p0,
            basis: symmetric_basis(&u2),
            w,
        })
    }

    /// Number of free unknowns z.
    #[must_use]
    pub fn unknowns(&self) -> usize {
        self.basis.len()
    }

    /// P(z) = P₀ + Σ zₖEₖ.
    #[must_use]
    pub fn p(&self, z: &DVector<f64>) -> DMatrix<f64> {
        self.basis
            .iter()
            .zip(z.iter())
            .fold(self.p0.clone(), |p, (e, &z)| p + e * z)
    }

    /// The constant and linear parts of P.
    pub(super) fn p_parts(&self) -> (&DMatrix<f64>, &[DMatrix<f64>]) {
        (&self.p0, &self.basis)
    }

    /// The constant and linear parts of F(z) = −WᵀQ(P(z))W.
    pub(super) fn f_parts(&self) -> (DMatrix<f64>, Vec<DMatrix<f64>>) {
        let at = |p: &DMatrix<f64>| -(self.w.transpose() * lmi::matrix(&self.system, p) * &self.w);
        let zero = at(&DMatrix::zeros(self.p0.nrows(), self.p0.nrows()));
        (
            at(&self.p0),
            self.basis.iter().map(|e| at(e) - &zero).collect(),
        )
    }

    /// The projector onto the eigenvectors of −WᵀQ(P)W that nearly vanish: a sharper exposing matrix than the dual.
    pub(super) fn nearly_null(&self, p: &DMatrix<f64>) -> DMatrix<f64> {
        let f = -(self.w.transpose() * lmi::matrix(&self.system, p) * &self.w);
        let (values, vectors) = scale::eigen(&f);
        let top = values.amax();
        let null: Vec<usize> = (0..values.len())
            .filter(|&i| values[i] < NEARLY_NULL * top)
            .collect();
        let v = vectors.select_columns(&null);
        &v * v.transpose()
    }

    /// The smaller face that a dual solution X ⪰ 0 with ⟨X, F(z)⟩ = 0 exposes: F(z)V = 0 for V = range X.
    /// `None` if nothing is exposed or the equalities have no solution.
    pub(super) fn expose(&self, dual: &DMatrix<f64>) -> Option<Self> {
        let (values, vectors) = scale::eigen(dual);
        let top = values.iter().copied().last().filter(|&v| v > 0.0)?;
        let exposed: Vec<usize> = (0..values.len())
            .filter(|&i| values[i] > EXPOSED * top)
            .collect();
        let kept: Vec<usize> = (0..values.len())
            .filter(|&i| values[i] <= EXPOSED * top)
            .collect();
        let v = vectors.select_columns(&exposed);
        let (f0, f) = self.f_parts();
        let rhs = -(f0 * &v);
        let mut columns = DMatrix::zeros(rhs.len(), f.len());
        for (k, fk) in f.iter().enumerate() {
            columns.set_column(k, &DVector::from_column_slice((fk * &v).as_slice()));
        }
        let parts = scale::split(&columns, scale::RANK);
        let target = DVector::from_column_slice(rhs.as_slice());
        let along = parts.range.transpose() * &target;
        if (&target - &parts.range * &along).amax() > INCONSISTENT {
            return None;
        }
        let z0 = &parts.row_space * along.component_div(&parts.values);
        let basis = (0..parts.kernel.ncols())
            .map(|k| {
                let zero = DMatrix::zeros(self.p0.nrows(), self.p0.nrows());
                self.basis
                    .iter()
                    .zip(parts.kernel.column(k).iter())
                    .fold(zero, |p, (e, &z)| p + e * z)
            })
            .collect();
        Some(Self {
            system: self.system.clone(),
            p0: self.p(&z0),
            basis,
            w: &self.w * vectors.select_columns(&kept),
        })
    }
}

/// P₀ and U₂ of the symmetric solutions P = P₀ + U₂ZU₂ᵀ of PM = R (M = BN, R = CᵀN, balanced units).
pub(super) fn equalities(
    m: &DMatrix<f64>,
    r: &DMatrix<f64>,
    null: &DMatrix<f64>,
) -> Result<(DMatrix<f64>, DMatrix<f64>), Inconsistent> {
    let n = m.nrows();
    if m.ncols() == 0 {
        return Ok((DMatrix::zeros(n, n), DMatrix::identity(n, n)));
    }
    let size = m.amax().max(r.amax()).max(f64::MIN_POSITIVE);
    let parts = scale::split(m, scale::RANK * size);
    let unseen = r * &parts.kernel;
    if unseen.amax() > INCONSISTENT * size {
        let port = null * &parts.kernel;
        let worst = (0..unseen.ncols())
            .max_by(|&i, &j| unseen.column(i).norm().total_cmp(&unseen.column(j).norm()));
        let direction = port.column(worst.unwrap_or(0)).into_owned();
        return Err(Inconsistent::Witness(Witness::Unreached {
            direction: direction.as_slice().to_vec(),
        }));
    }
    let gram = m.transpose() * r;
    if (&gram - gram.transpose()).amax() > INCONSISTENT * size * size {
        return Err(Inconsistent::Witness(Witness::Asymmetric {
            ports: null.clone(),
        }));
    }
    let (values, vectors) = scale::eigen(&gram);
    if values[0] < -INCONSISTENT * size * size {
        let direction = null * vectors.column(0);
        return Err(Inconsistent::Witness(Witness::Markov {
            direction: direction.as_slice().to_vec(),
        }));
    }
    let inverse = DMatrix::from_diagonal(&parts.values.map(f64::recip));
    let known = r * &parts.row_space * inverse;
    let p11 = scale::symmetric(&(parts.range.transpose() * &known));
    if !p11.is_empty() && p11.clone().cholesky().is_none() {
        return Err(Inconsistent::Rounding(
            "P B N = CᵀN on ker(D + Dᵀ) leaves P semidefinite at best: some state stores no energy"
                .into(),
        ));
    }
    let p12 = parts.left_kernel.transpose() * &known;
    let cross = &parts.left_kernel * &p12 * parts.range.transpose();
    let fixed = &parts.range * &p11 * parts.range.transpose() + &cross + cross.transpose();
    // A positive definite start: the Schur complement of the free block is the identity.
    let inner = p11.clone().try_inverse().map_or_else(
        || DMatrix::zeros(p12.nrows(), p12.nrows()),
        |inverse| &p12 * inverse * p12.transpose(),
    );
    let free = inner + DMatrix::identity(p12.nrows(), p12.nrows());
    let p0 = fixed + &parts.left_kernel * free * parts.left_kernel.transpose();
    Ok((p0, parts.left_kernel))
}
