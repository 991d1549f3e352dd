//! The eight BLAS and LAPACK routines that clarabel's semidefinite cone calls, by their Fortran names, on nalgebra.
//!
//! clarabel leaves the choice of a LAPACK to the linker. A system library would be one more thing to install, a vendored
//! one needs a Fortran compiler; for matrices of order below a few hundred neither is faster here than the rest of the
//! interior point iteration. Only what clarabel asks for is there: real double precision, all eigenvalues, thin SVD.
#![allow(unsafe_code)]

use std::ffi::{c_char, c_int};

use nalgebra::DMatrix;

/// Addresses of the routines: a reference that makes the linker take them.
pub(super) static ROUTINES: [fn() -> usize; 8] = [
    || dgemm_ as *const () as usize,
    || dsyrk_ as *const () as usize,
    || dsyr2k_ as *const () as usize,
    || dpotrf_ as *const () as usize,
    || dpotrs_ as *const () as usize,
    || dsyevr_ as *const () as usize,
    || dgesdd_ as *const () as usize,
    || dgesvd_ as *const () as usize,
];

/// Reads a rows×columns matrix stored by columns with leading dimension `ld`.
///
/// # Safety
/// `data` must point to `ld·columns` readable numbers (the last column may end after `rows`).
unsafe fn read(data: *const f64, rows: usize, columns: usize, ld: c_int) -> DMatrix<f64> {
    // SAFETY: the caller vouches for the extent.
    DMatrix::from_fn(rows, columns, |i, j| unsafe {
        *data.add(i + j * ld as usize)
    })
}

/// Writes a matrix where `keep(i, j)` says so.
///
/// # Safety
/// As [`read`], writable.
unsafe fn write(data: *mut f64, ld: c_int, m: &DMatrix<f64>, keep: impl Fn(usize, usize) -> bool) {
    for j in 0..m.ncols() {
        for i in 0..m.nrows() {
            if keep(i, j) {
                // SAFETY: the caller vouches for the extent.
                unsafe { *data.add(i + j * ld as usize) = m[(i, j)] };
            }
        }
    }
}

fn is(flag: c_char, letter: u8) -> bool {
    (flag as u8).eq_ignore_ascii_case(&letter)
}

/// The operand op(X) of a product, op(X) being rows×columns.
///
/// # Safety
/// As [`read`] for the stored orientation.
unsafe fn operand(
    trans: c_char,
    data: *const f64,
    rows: usize,
    columns: usize,
    ld: c_int,
) -> DMatrix<f64> {
    // SAFETY: the caller vouches for the extent.
    unsafe {
        if is(trans, b'N') {
            read(data, rows, columns, ld)
        } else {
            read(data, columns, rows, ld).transpose()
        }
    }
}

fn in_triangle(uplo: c_char) -> impl Fn(usize, usize) -> bool {
    let upper = is(uplo, b'U');
    move |i, j| if upper { i <= j } else { i >= j }
}

/// Adds βC to a product in the triangle (or everywhere) and stores it in C.
///
/// # Safety
/// As [`read`], writable.
unsafe fn update(
    c: *mut f64,
    ld: c_int,
    mut product: DMatrix<f64>,
    beta: f64,
    keep: impl Fn(usize, usize) -> bool,
) {
    // SAFETY: the caller vouches for the extent.
    unsafe {
        if beta != 0.0 {
            product += read(c, product.nrows(), product.ncols(), ld) * beta;
        }
        write(c, ld, &product, keep);
    }
}

/// C ← α op(A) op(B) + βC.
#[unsafe(no_mangle)]
unsafe extern "C" fn dgemm_(
    trans_a: *const c_char,
    trans_b: *const c_char,
    m: *const c_int,
    n: *const c_int,
    k: *const c_int,
    alpha: *const f64,
    a: *const f64,
    lda: *const c_int,
    b: *const f64,
    ldb: *const c_int,
    beta: *const f64,
    c: *mut f64,
    ldc: *const c_int,
) {
    // SAFETY: the arguments are BLAS's, with its extents.
    unsafe {
        let (m, n, k) = (*m as usize, *n as usize, *k as usize);
        let a = operand(*trans_a, a, m, k, *lda);
        let b = operand(*trans_b, b, k, n, *ldb);
        update(c, *ldc, a * b * *alpha, *beta, |_, _| true);
    }
}

/// C ← α op(A) op(A)ᵀ + βC in one triangle.
#[unsafe(no_mangle)]
unsafe extern "C" fn dsyrk_(
    uplo: *const c_char,
    trans: *const c_char,
    n: *const c_int,
    k: *const c_int,
    alpha: *const f64,
    a: *const f64,
    lda: *const c_int,
    beta: *const f64,
    c: *mut f64,
    ldc: *const c_int,
) {
    // SAFETY: the arguments are BLAS's, with its extents.
    unsafe {
        let a = operand(*trans, a, *n as usize, *k as usize, *lda);
        update(
            c,
            *ldc,
            &a * a.transpose() * *alpha,
            *beta,
            in_triangle(*uplo),
        );
    }
}

/// C ← α (op(A) op(B)ᵀ + op(B) op(A)ᵀ) + βC in one triangle.
#[unsafe(no_mangle)]
unsafe extern "C" fn dsyr2k_(
    uplo: *const c_char,
    trans: *const c_char,
    n: *const c_int,
    k: *const c_int,
    alpha: *const f64,
    a: *const f64,
    lda: *const c_int,
    b: *const f64,
    ldb: *const c_int,
    beta: *const f64,
    c: *mut f64,
    ldc: *const c_int,
) {
    // SAFETY: the arguments are BLAS's, with its extents.
    unsafe {
        let a = operand(*trans, a, *n as usize, *k as usize, *lda);
        let b = operand(*trans, b, *n as usize, *k as usize, *ldb);
        let product = &a * b.transpose();
        update(
            c,
            *ldc,
            (&product + product.transpose()) * *alpha,
            *beta,
            in_triangle(*uplo),
        );
    }
}

/// The symmetric matrix whose triangle is stored.
///
/// # Safety
/// As [`read`].
unsafe fn symmetric(uplo: c_char, a: *const f64, n: usize, lda: c_int) -> DMatrix<f64> {
    // SAFETY: the caller vouches for the extent.
    let stored = unsafe { read(a, n, n, lda) };
    let keep = in_triangle(uplo);
    DMatrix::from_fn(n, n, |i, j| {
        if keep(i, j) {
            stored[(i, j)]
        } else {
            stored[(j, i)]
        }
    })
}

/// A ← its Cholesky factor in the given triangle; `info` > 0 if A is not positive definite.
#[unsafe(no_mangle)]
unsafe extern "C" fn dpotrf_(
    uplo: *const c_char,
    n: *const c_int,
    a: *mut f64,
    lda: *const c_int,
    info: *mut c_int,
) {
    // SAFETY: the arguments are LAPACK's, with its extents.
    unsafe {
        let Some(factor) = symmetric(*uplo, a, *n as usize, *lda).cholesky() else {
            *info = 1;
            return;
        };
        let l = if is(*uplo, b'U') {
            factor.l().transpose()
        } else {
            factor.l()
        };
        write(a, *lda, &l, in_triangle(*uplo));
        *info = 0;
    }
}

/// B ← A⁻¹B from the factor of [`dpotrf_`].
#[unsafe(no_mangle)]
unsafe extern "C" fn dpotrs_(
    uplo: *const c_char,
    n: *const c_int,
    nrhs: *const c_int,
    a: *const f64,
    lda: *const c_int,
    b: *mut f64,
    ldb: *const c_int,
    info: *mut c_int,
) {
    // SAFETY: the arguments are LAPACK's, with its extents.
    unsafe {
        let stored = read(a, *n as usize, *n as usize, *lda);
        let l = if is(*uplo, b'U') {
            stored.transpose()
        } else {
            stored
        };
        let rhs = read(b, *n as usize, *nrhs as usize, *ldb);
        let solved = l
            .solve_lower_triangular(&rhs)
            .and_then(|x| l.tr_solve_lower_triangular(&x));
        *info = match solved {
            Some(x) => {
                write(b, *ldb, &x, |_, _| true);
                0
            }
            None => 1,
        };
    }
}

/// All eigenvalues (ascending) and, for `jobz` = V, eigenvectors of a symmetric matrix.
#[unsafe(no_mangle)]
unsafe extern "C" fn dsyevr_(
    jobz: *const c_char,
    _range: *const c_char,
    uplo: *const c_char,
    n: *const c_int,
    a: *mut f64,
    lda: *const c_int,
    _vl: *const f64,
    _vu: *const f64,
    _il: *const c_int,
    _iu: *const c_int,
    _abstol: *const f64,
    m: *mut c_int,
    w: *mut f64,
    z: *mut f64,
    ldz: *const c_int,
    _isuppz: *mut c_int,
    work: *mut f64,
    lwork: *const c_int,
    iwork: *mut c_int,
    _liwork: *const c_int,
    info: *mut c_int,
) {
    // SAFETY: the arguments are LAPACK's, with its extents.
    unsafe {
        *info = 0;
        if *lwork == -1 {
            (*work, *iwork) = (1.0, 1);
            return;
        }
        let (values, vectors) =
            crate::passivity::scale::eigen(&symmetric(*uplo, a, *n as usize, *lda));
        *m = *n;
        for (k, &value) in values.iter().enumerate() {
            *w.add(k) = value;
        }
        if is(*jobz, b'V') {
            write(z, *ldz, &vectors, |_, _| true);
        }
    }
}

/// The thin SVD A = U diag(s) Vᵀ, s descending, or the workspace it needs where `lwork` asks for that; returns `info`.
///
/// # Safety
/// LAPACK's extents.
unsafe fn svd(
    (m, n): (c_int, c_int),
    (a, lda): (*const f64, c_int),
    s: *mut f64,
    (u, ldu): (*mut f64, c_int),
    (vt, ldvt): (*mut f64, c_int),
    (work, lwork): (*mut f64, c_int),
) -> c_int {
    // SAFETY: the caller vouches for the extents.
    unsafe {
        if lwork == -1 {
            *work = 1.0;
            return 0;
        }
        let svd = read(a, m as usize, n as usize, lda).svd(true, true);
        let (Some(left), Some(right)) = (svd.u, svd.v_t) else {
            return 1;
        };
        for (k, &value) in svd.singular_values.iter().enumerate() {
            *s.add(k) = value;
        }
        write(u, ldu, &left, |_, _| true);
        write(vt, ldvt, &right, |_, _| true);
        0
    }
}

/// [`svd`] under the name of the divide-and-conquer driver.
#[unsafe(no_mangle)]
unsafe extern "C" fn dgesdd_(
    _jobz: *const c_char,
    m: *const c_int,
    n: *const c_int,
    a: *mut f64,
    lda: *const c_int,
    s: *mut f64,
    u: *mut f64,
    ldu: *const c_int,
    vt: *mut f64,
    ldvt: *const c_int,
    work: *mut f64,
    lwork: *const c_int,
    _iwork: *mut c_int,
    info: *mut c_int,
) {
    // SAFETY: the arguments are LAPACK's, with its extents.
    unsafe {
        *info = svd(
            (*m, *n),
            (a, *lda),
            s,
            (u, *ldu),
            (vt, *ldvt),
            (work, *lwork),
        );
    }
}

/// [`svd`] under the name of the QR driver.
#[unsafe(no_mangle)]
unsafe extern "C" fn dgesvd_(
    _jobu: *const c_char,
    _jobvt: *const c_char,
    m: *const c_int,
    n: *const c_int,
    a: *mut f64,
    lda: *const c_int,
    s: *mut f64,
    u: *mut f64,
    ldu: *const c_int,
    vt: *mut f64,
    ldvt: *const c_int,
    work: *mut f64,
    lwork: *const c_int,
    info: *mut c_int,
) {
    // SAFETY: the arguments are LAPACK's, with its extents.
    unsafe {
        *info = svd(
            (*m, *n),
            (a, *lda),
            s,
            (u, *ldu),
            (vt, *ldvt),
            (work, *lwork),
        );
    }
}
