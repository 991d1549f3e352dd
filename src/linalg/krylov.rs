//! Linear systems and leading eigenvalues of what is known by its products alone.
//!
//! With an orthonormal basis V of r, A r, A² r, … (Arnoldi, orthogonalised twice) A V_m = V_{m+1} H̄. GMRES takes the x = V_m y with the least ‖b − A x‖ (Y. Saad, M. H. Schultz, SIAM J. Sci. Stat.
//! Comput. 7 (1986)); eigenvalues θ of H are those of A to |h_{m+1,m} y_m|, y their eigenvectors of length 1 (Y. Saad, "Numerical Methods for Large Eigenvalue Problems", 2nd ed., 2011,
//! section 6.2).

use nalgebra::{Complex, DMatrix, DVector};

use super::eigenvalues::eigenvalues;
use crate::settings::tolerances::krylov::{BREAKDOWN, CLEAR_OF_EIGENVALUE, FAINT_RITZ, RITZ};

/// So many more vectors before eigenvalues are looked at again.
const LOOK: usize = 4;

/// A v.
pub(crate) type Product<'a, E> = dyn FnMut(&DVector<f64>) -> Result<DVector<f64>, E> + 'a;

/// A V_m = V_{m+1} H̄.
struct Basis {
    vectors: Vec<DVector<f64>>,
    /// By column: what of A v_j lies along v_1 … v_{j+1}.
    columns: Vec<DVector<f64>>,
}

impl Basis {
    fn of(first: &DVector<f64>, size: f64) -> Self {
        Self {
            vectors: vec![first / size],
            columns: Vec::new(),
        }
    }

    /// Takes in A v of the last vector; whether there is another direction in it.
    fn grow(&mut self, mut image: DVector<f64>) -> bool {
        let m = self.vectors.len();
        let size = image.norm();
        let mut column = DVector::zeros(m + 1);
        for _ in 0..2 {
            for (k, v) in self.vectors.iter().enumerate() {
                let along = v.dot(&image);
                column[k] += along;
                image.axpy(-along, v, 1.0);
            }
        }
        let rest = image.norm();
        let grows = rest > BREAKDOWN * size;
        if grows {
            column[m] = rest;
            self.vectors.push(image / rest);
        }
        self.columns.push(column);
        grows
    }

    fn combine(&self, y: &DVector<f64>) -> DVector<f64> {
        let mut x = DVector::zeros(self.vectors[0].len());
        for (v, y) in self.vectors.iter().zip(y) {
            x.axpy(*y, v, 1.0);
        }
        x
    }

    fn hessenberg(&self) -> DMatrix<f64> {
        let m = self.columns.len();
        DMatrix::from_fn(m, m, |i, j| self.columns[j].get(i).copied().unwrap_or(0.0))
    }
}

/// The x of the least ‖b − A x‖ in a basis of at most `most` vectors, or the first one that leaves less than the part `reduction` of ‖b‖; without what A shrinks to less than the part
/// `neutral` of itself.
///
/// # Errors
/// Those of the products.
pub(crate) fn gmres<E>(
    product: &mut Product<'_, E>,
    b: &DVector<f64>,
    (reduction, neutral): (f64, f64),
    most: usize,
) -> Result<DVector<f64>, E> {
    let size = b.norm();
    if !(size > 0.0 && size.is_finite()) {
        return Ok(DVector::zeros(b.len()));
    }
    let mut basis = Basis::of(b, size);
    // What rotations of H̄ to a triangle leave of ‖b‖ e_1 is what x leaves of b.
    let (mut turns, mut rest) = (Vec::<(f64, f64)>::new(), size);
    for m in 0..most.min(b.len()) {
        let image = product(&basis.vectors[m])?;
        let grows = basis.grow(image);
        let mut column = basis.columns[m].clone();
        for (k, (c, s)) in turns.iter().enumerate() {
            let (a, b) = (column[k], column[k + 1]);
            (column[k], column[k + 1]) = (c * a + s * b, c * b - s * a);
        }
        let r = column[m].hypot(column[m + 1]);
        if !(r > 0.0 && r.is_finite()) {
            break;
        }
        let (c, s) = (column[m] / r, column[m + 1] / r);
        turns.push((c, s));
        rest *= s.abs();
        if !grows || rest <= reduction * size {
            break;
        }
    }
    let m = basis.columns.len();
    let matrix = DMatrix::from_fn(m + 1, m, |i, j| {
        basis.columns[j].get(i).copied().unwrap_or(0.0)
    });
    let mut right = DVector::zeros(m + 1);
    right[0] = size;
    let y = matrix.svd(true, true).solve(&right, neutral);
    Ok(y.map_or_else(|_| DVector::zeros(b.len()), |y| basis.combine(&y)))
}

/// Solutions of (e − A) x = b for one number e of size 1 after the other: what was multiplied for one of them serves all.
///
/// In a basis V with its images W = A V the y of the least ‖b − (e V − W) y‖ is that of the normal equations, improved by what it leaves; as long as that is too much, both parts of it are
/// further vectors, as in GMRES.
pub(crate) struct Recycled {
    vectors: Vec<DVector<f64>>,
    images: Vec<DVector<f64>>,
    /// Vᵀ W and Wᵀ W.
    along: DMatrix<f64>,
    sizes: DMatrix<f64>,
}

impl Recycled {
    /// Without a vector yet.
    pub(crate) fn new() -> Self {
        Self {
            vectors: Vec::new(),
            images: Vec::new(),
            along: DMatrix::zeros(0, 0),
            sizes: DMatrix::zeros(0, 0),
        }
    }

    /// The first x found that leaves less than the part `reduction` of b; `None` where `most` vectors do not. A basis that others have filled begins anew.
    ///
    /// # Errors
    /// Those of the products.
    pub(crate) fn solve<E>(
        &mut self,
        product: &mut Product<'_, E>,
        (e, b): (Complex<f64>, &DVector<Complex<f64>>),
        (reduction, most): (f64, usize),
    ) -> Result<Option<DVector<Complex<f64>>>, E> {
        let size = b.norm();
        let mut own = self.vectors.is_empty();
        loop {
            let (x, left) = self.best(e, b);
            if left.norm() <= reduction * size {
                return Ok(Some(x));
            }
            let before = self.vectors.len();
            for part in [left.map(|v| v.re), left.map(|v| v.im)] {
                self.grow(product, part)?;
            }
            let ends = self.vectors.len() == before || self.vectors.len() > most;
            if !left.norm().is_finite() || (ends && own) {
                return Ok(None);
            }
            if ends {
                *self = Self::new();
                own = true;
            }
        }
    }

    /// The x of the least ‖b − (e − A) x‖ that the basis knows, and what it leaves of b.
    fn best(
        &self,
        e: Complex<f64>,
        b: &DVector<Complex<f64>>,
    ) -> (DVector<Complex<f64>>, DVector<Complex<f64>>) {
        let k = self.vectors.len();
        if k == 0 {
            return (DVector::zeros(b.len()), b.clone());
        }
        let normal = DMatrix::from_fn(k, k, |i, j| {
            let own = f64::from(u8::from(i == j)) * e.norm_sqr();
            let cross = e.conj() * self.along[(i, j)] + e * self.along[(j, i)];
            Complex::from(own + self.sizes[(i, j)]) - cross
        });
        let factors = normal.lu();
        let (mut x, mut left) = (DVector::zeros(b.len()), b.clone());
        for _ in 0..3 {
            let dot = |v: &DVector<f64>| -> Complex<f64> {
                v.iter().zip(&left).map(|(v, left)| left * *v).sum()
            };
            let pairs = self.vectors.iter().zip(&self.images);
            let right = pairs.map(|(v, w)| e.conj() * dot(v) - dot(w));
            let right = DVector::from_iterator(k, right);
            let Some(y) = factors.solve(&right) else {
                break;
            };
            for ((v, w), y) in self.vectors.iter().zip(&self.images).zip(&y) {
                for (k, (v, w)) in v.iter().zip(w).enumerate() {
                    x[k] += y * *v;
                    left[k] -= y * (e * *v - *w);
                }
            }
        }
        (x, left)
    }

    /// Takes in a direction, if it is another one.
    fn grow<E>(&mut self, product: &mut Product<'_, E>, mut v: DVector<f64>) -> Result<(), E> {
        let size = v.norm();
        for _ in 0..2 {
            for own in &self.vectors {
                let along = own.dot(&v);
                v.axpy(-along, own, 1.0);
            }
        }
        let rest = v.norm();
        if rest.is_nan() || rest <= BREAKDOWN * size {
            return Ok(());
        }
        let v = v / rest;
        let w = product(&v)?;
        self.vectors.push(v);
        self.images.push(w);
        let k = self.vectors.len();
        let (vectors, images) = (&self.vectors, &self.images);
        let extended = |known: &DMatrix<f64>, left: &[DVector<f64>]| {
            DMatrix::from_fn(k, k, |i, j| {
                let known = known.get((i, j)).filter(|_| i + 1 < k && j + 1 < k);
                known.copied().unwrap_or_else(|| left[i].dot(&images[j]))
            })
        };
        let along = extended(&self.along, vectors);
        let sizes = extended(&self.sizes, images);
        (self.along, self.sizes) = (along, sizes);
        Ok(())
    }
}

/// An eigenvalue that a basis tells.
#[derive(Debug, Clone)]
pub(crate) struct Ritz {
    pub(crate) value: Complex<f64>,
    /// ‖A v − θ v‖ for its eigenvector v of length 1.
    pub(crate) left: f64,
    /// The real part of its eigenvector.
    pub(crate) vector: DVector<f64>,
}

impl Ritz {
    /// Whether it is one of the matrix to [`RITZ`] of itself.
    pub(crate) fn has_converged(&self) -> bool {
        self.left <= RITZ * self.value.norm().max(FAINT_RITZ)
    }
}

/// The `wanted` eigenvalues of largest size that a basis of at most `most` vectors tells, the largest first: all bases are asked until the largest one has converged. `None` where they are
/// not found.
///
/// # Errors
/// Those of the products.
pub(crate) fn leading<E>(
    product: &mut Product<'_, E>,
    n: usize,
    (wanted, most): (usize, usize),
) -> Result<Option<Vec<Ritz>>, E> {
    // What a product leaves of a vector of all directions; the same one in each run.
    let first = product(&scattered(n))?;
    let size = first.norm();
    if !size.is_finite() {
        return Ok(None);
    }
    if size == 0.0 {
        let zero = Ritz {
            value: Complex::new(0.0, 0.0),
            left: 0.0,
            vector: first,
        };
        return Ok(Some(vec![zero]));
    }
    let mut basis = Basis::of(&first, size);
    let most = most.min(n);
    loop {
        let m = basis.columns.len();
        let image = product(&basis.vectors[m])?;
        let ends = !basis.grow(image) || m + 1 >= most;
        if !ends && !(m + 1).is_multiple_of(LOOK) {
            continue;
        }
        let Some(found) = ritz(&basis, wanted) else {
            return Ok(None);
        };
        let known = m + 1 > LOOK && found.first().is_some_and(Ritz::has_converged);
        if ends || known {
            return Ok(Some(found));
        }
    }
}

fn ritz(basis: &Basis, wanted: usize) -> Option<Vec<Ritz>> {
    let h = basis.hessenberg();
    let m = h.nrows();
    let below = basis.columns.last().map_or(0.0, |column| column[m]);
    let mut values = eigenvalues(&h)?;
    values.sort_by(|a, b| {
        let size = b.norm().total_cmp(&a.norm());
        size.then(b.re.total_cmp(&a.re)).then(b.im.total_cmp(&a.im))
    });
    // Both of a pair.
    let mut count = wanted.min(m);
    if count < m && values[count - 1].im > 0.0 {
        count += 1;
    }
    let scale = h.norm().max(f64::MIN_POSITIVE);
    let one = |value: Complex<f64>| {
        let shift = value + CLEAR_OF_EIGENVALUE * scale;
        let shifted = DMatrix::from_fn(m, m, |i, j| {
            let diagonal = if i == j {
                shift
            } else {
                Complex::new(0.0, 0.0)
            };
            Complex::new(h[(i, j)], 0.0) - diagonal
        });
        let factors = shifted.lu();
        let mut y = DVector::from_element(m, Complex::new(1.0, 0.0));
        for _ in 0..2 {
            y = factors.solve(&y)?;
            let size = y.norm();
            if !(size > 0.0 && size.is_finite()) {
                return None;
            }
            y.unscale_mut(size);
        }
        let real = y.map(|v| v.re);
        Some(Ritz {
            value,
            left: (below * y[m - 1].norm()).abs(),
            vector: basis.combine(&real),
        })
    };
    values.into_iter().take(count).map(one).collect()
}

/// A vector with something of each direction, by the linear congruential sequence of D. E. Knuth's MMIX.
fn scattered(n: usize) -> DVector<f64> {
    let mut state = 1_u64;
    DVector::from_fn(n, |_, _| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        0.5 + (state >> 11) as f64 / (1_u64 << 53) as f64
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(n: usize) -> DMatrix<f64> {
        DMatrix::from_fn(n, n, |i, j| {
            let near = if i + 1 == j { 0.3 } else { 0.0 };
            let own = if i == j {
                0.9_f64.powi(i as i32 + 1)
            } else {
                0.0
            };
            own + near - if j + 7 == i { 0.05 } else { 0.0 }
        })
    }

    #[test]
    fn systems_are_solved() {
        let a = DMatrix::identity(40, 40) - matrix(40);
        let b = DVector::from_fn(40, |i, _| (i as f64).sin());
        let mut product = |v: &DVector<f64>| Ok::<_, ()>(&a * v);
        let x = gmres(&mut product, &b, (1e-12, 1e-9), 60).expect("a solution");
        assert!((&a * &x - &b).norm() < 1e-11 * b.norm());
        let short = gmres(&mut product, &b, (1e-12, 1e-9), 5).expect("a solution");
        assert!((&a * &short - &b).norm() < b.norm());
        let none = gmres(&mut product, &DVector::zeros(40), (1e-12, 1e-9), 5).expect("zero");
        assert_eq!(none.norm(), 0.0);
    }

    #[test]
    fn shifted_systems_share_their_products() {
        let a = matrix(40);
        let b = DVector::from_fn(40, |i, _| Complex::new((i as f64).sin(), (i as f64).cos()));
        let (mut recycled, mut products) = (Recycled::new(), 0);
        for k in 0..50 {
            let e = Complex::from_polar(1.0, 0.1 * f64::from(k));
            let mut product = |v: &DVector<f64>| {
                products += 1;
                Ok::<_, ()>(&a * v)
            };
            let x = recycled
                .solve(&mut product, (e, &b), (1e-11, 60))
                .expect("products");
            let x = x.expect("a solution");
            let left = &x * e - a.map(Complex::from) * &x - &b;
            assert!(left.norm() < 1e-10 * b.norm(), "{k}: {:e}", left.norm());
        }
        assert!(products <= 40, "{products}");
        let mut product = |v: &DVector<f64>| Ok::<_, ()>(&a * v);
        let mut solve = |recycled: &mut Recycled, b: &_, most| {
            let found = recycled.solve(&mut product, (Complex::from(1.0), b), (1e-11, most));
            found.expect("products").is_some()
        };
        assert!(!solve(&mut Recycled::new(), &b, 5));
        // A basis that is full of what another one needed.
        let [mut full, mut alone] = [Recycled::new(), Recycled::new()];
        let one = DVector::from_fn(40, |i, _| Complex::from(f64::from(u8::from(i == 39))));
        let other = DVector::from_fn(40, |i, _| Complex::from(f64::from(u8::from(i < 3))));
        assert!(solve(&mut full, &one, 40) && solve(&mut alone, &other, 40));
        let most = full.vectors.len().max(alone.vectors.len());
        assert!(solve(&mut full, &other, most), "{most}");
    }

    /// Where nothing solves the equation, what does not can be left is left, and the vector does not grow out of rounding.
    #[test]
    fn what_is_neutral_is_left_alone() {
        let diagonal = DVector::from_fn(10, |i, _| if i == 3 { 1e-13 } else { 1.0 + i as f64 });
        let mut product = |v: &DVector<f64>| Ok::<_, ()>(v.component_mul(&diagonal));
        let b = DVector::from_element(10, 1.0);
        let x = gmres(&mut product, &b, (1e-12, 1e-9), 10).expect("a solution");
        assert!(x.amax() < 2.0 && (x[0] - 1.0).abs() < 1e-6, "{x}");
    }

    #[test]
    fn leading_eigenvalues_are_those_of_the_matrix() {
        let a = matrix(40);
        let mut all = eigenvalues(&a).expect("eigenvalues");
        all.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
        let mut product = |v: &DVector<f64>| Ok::<_, ()>(&a * v);
        let found = leading(&mut product, 40, (4, 40)).expect("products");
        let found = found.expect("eigenvalues");
        assert!(found[0].has_converged());
        assert!((found[0].value.norm() - all[0].norm()).abs() < 1e-6);
        let v = &found[0].vector;
        if found[0].value.im == 0.0 {
            assert!((&a * v - v * found[0].value.re).norm() < 1e-5 * v.norm());
        }
    }
}
