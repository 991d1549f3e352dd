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
use crate::settings::tolerances::passivity::{EXPOSED, INCONSISTENT, NEARLY_NULL};
use crate::settings::tolerances::ranks::RANK;

/// A margin problem: F(z) = F₀ + Σ zₖFₖ and P(z) = P₀ + Σ zₖPₖ, both to be made positive definite.
///
/// After facial reduction z is a part of the original unknowns: original = `z0` + `directions`·z.
#[derive(Debug, Clone)]
pub struct Face {
    f0: DMatrix<f64>,
    f: Vec<DMatrix<f64>>,
    p0: DMatrix<f64>,
    p: Vec<DMatrix<f64>>,
    z0: DVector<f64>,
    directions: DMatrix<f64>,
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

/// M₀ + Σ zₖMₖ.
fn affine(m0: &DMatrix<f64>, m: &[DMatrix<f64>], z: &DVector<f64>) -> DMatrix<f64> {
    m.iter()
        .zip(z.iter())
        .fold(m0.clone(), |sum, (mk, &zk)| sum + mk * zk)
}

impl Face {
    /// The whole problem, nothing reduced yet.
    #[must_use]
    pub fn new(
        f0: DMatrix<f64>,
        f: Vec<DMatrix<f64>>,
        p0: DMatrix<f64>,
        p: Vec<DMatrix<f64>>,
    ) -> Self {
        let unknowns = f.len();
        Self {
            f0,
            f,
            p0,
            p,
            z0: DVector::zeros(unknowns),
            directions: DMatrix::identity(unknowns, unknowns),
        }
    }

    /// F = −WᵀQ(P)W over the solutions of PBN = CᵀN, N = ker(D + Dᵀ), W its complement; of a balanced system.
    pub(super) fn kernel(system: &System) -> Result<Self, Inconsistent> {
        let n = system.n();
        let (null, rest) = lossless(&system.d);
        let (p0, u2) = equalities(&(&system.b * &null), &(system.c.transpose() * &null), &null)?;
        let mut w = DMatrix::zeros(n + rest.nrows(), n + rest.ncols());
        w.view_mut((0, 0), (n, n)).fill_with_identity();
        w.view_mut((n, n), rest.shape()).copy_from(&rest);
        let at = |p: &DMatrix<f64>| -(w.transpose() * lmi::matrix(system, p) * &w);
        let zero = at(&DMatrix::zeros(n, n));
        let p = symmetric_basis(&u2);
        Ok(Self::new(
            at(&p0),
            p.iter().map(|e| at(e) - &zero).collect(),
            p0,
            p,
        ))
    }

    /// The same face with its own unknowns as the original ones.
    pub(super) fn rebased(&self) -> Self {
        Self::new(
            self.f0.clone(),
            self.f.clone(),
            self.p0.clone(),
            self.p.clone(),
        )
    }

    /// Number of free unknowns z.
    #[must_use]
    pub fn unknowns(&self) -> usize {
        self.f.len()
    }

    /// The original unknowns of a z.
    #[must_use]
    pub fn original(&self, z: &DVector<f64>) -> DVector<f64> {
        &self.z0 + &self.directions * z
    }

    /// P(z).
    #[must_use]
    pub fn p(&self, z: &DVector<f64>) -> DMatrix<f64> {
        affine(&self.p0, &self.p, z)
    }

    /// F(z).
    #[must_use]
    pub fn f(&self, z: &DVector<f64>) -> DMatrix<f64> {
        affine(&self.f0, &self.f, z)
    }

    /// The constant and linear parts of P.
    pub(super) fn p_parts(&self) -> (&DMatrix<f64>, &[DMatrix<f64>]) {
        (&self.p0, &self.p)
    }

    /// The constant and linear parts of F.
    pub(super) fn f_parts(&self) -> (&DMatrix<f64>, &[DMatrix<f64>]) {
        (&self.f0, &self.f)
    }

    /// The projector onto the eigenvectors of F(z) that nearly vanish: a sharper exposing matrix than the dual.
    #[must_use]
    pub fn nearly_null(&self, z: &DVector<f64>) -> DMatrix<f64> {
        let (values, vectors) = scale::eigen(&self.f(z));
        let top = values.amax();
        let null: Vec<usize> = (0..values.len())
            .filter(|&i| values[i] < NEARLY_NULL * top)
            .collect();
        let v = vectors.select_columns(&null);
        &v * v.transpose()
    }

    /// The smaller face that a dual solution X ⪰ 0 with ⟨X, F(z)⟩ = 0 exposes: F(z)V = 0 for V = range X.
    /// `None` if nothing is exposed or the equalities have no solution.
    #[must_use]
    pub fn expose(&self, dual: &DMatrix<f64>) -> Option<Self> {
        let (values, vectors) = scale::eigen(dual);
        let top = values.iter().copied().last().filter(|&v| v > 0.0)?;
        let exposed: Vec<usize> = (0..values.len())
            .filter(|&i| values[i] > EXPOSED * top)
            .collect();
        let kept: Vec<usize> = (0..values.len())
            .filter(|&i| values[i] <= EXPOSED * top)
            .collect();
        let v = vectors.select_columns(&exposed);
        let rhs = -(&self.f0 * &v);
        let mut columns = DMatrix::zeros(rhs.len(), self.f.len());
        for (k, fk) in self.f.iter().enumerate() {
            columns.set_column(k, &DVector::from_column_slice((fk * &v).as_slice()));
        }
        let parts = scale::split(&columns, RANK);
        let target = DVector::from_column_slice(rhs.as_slice());
        let along = parts.range.transpose() * &target;
        if (&target - &parts.range * &along).amax() > INCONSISTENT {
            return None;
        }
        let z0 = &parts.row_space * along.component_div(&parts.values);
        let free = |m: &[DMatrix<f64>]| -> Vec<DMatrix<f64>> {
            let zero = m.first().map_or_else(|| DMatrix::zeros(0, 0), |m| m * 0.0);
            parts
                .kernel
                .column_iter()
                .map(|direction| affine(&zero, m, &direction.into_owned()))
                .collect()
        };
        let w = vectors.select_columns(&kept);
        let restrict = |m: &DMatrix<f64>| w.transpose() * m * &w;
        Some(Self {
            f0: restrict(&self.f(&z0)),
            f: free(&self.f).iter().map(restrict).collect(),
            p0: self.p(&z0),
            p: free(&self.p),
            z0: self.original(&z0),
            directions: &self.directions * &parts.kernel,
        })
    }
}

/// Orthonormal bases of ker(D + Dᵀ) and of its complement.
pub(super) fn lossless(d: &DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
    let (values, vectors) = scale::eigen(&(d + d.transpose()));
    let size = d.amax().max(f64::MIN_POSITIVE);
    let (kernel, rest): (Vec<usize>, Vec<usize>) =
        (0..values.len()).partition(|&i| values[i].abs() <= RANK * size);
    (
        vectors.select_columns(&kernel),
        vectors.select_columns(&rest),
    )
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
    let parts = scale::split(m, RANK * size);
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
