//! Eigenvalues of a small dense real matrix: Hessenberg form, then Francis' double-shift QR steps.
//!
//! After EISPACK's `hqr` (Martin, Peters, Wilkinson, Numer. Math. 14 (1970)): an off-diagonal entry is zero where it is rounding
//! of its neighbours *or*, where they vanish, of the whole matrix, and every tenth step of one eigenvalue takes an exceptional
//! shift. Equal strings, meshes and phases have eigenvalues that repeat many times; without either the iteration stands still
//! on them.

use nalgebra::{Complex, DMatrix, linalg::Hessenberg};

/// Steps for one eigenvalue (or pair) before the iteration is given up.
const MOST_STEPS: u32 = 120;
/// So many steps between exceptional shifts.
const EXCEPTIONAL: u32 = 10;
/// Wilkinson's exceptional shift: trace 1.5 s and determinant s², s the size of the last two off-diagonal entries.
const SHIFT: (f64, f64) = (0.75, -0.4375);

/// All eigenvalues of a square matrix, in no particular order; `None` where its entries are not finite or the iteration does
/// not converge.
pub(crate) fn eigenvalues(matrix: &DMatrix<f64>) -> Option<Vec<Complex<f64>>> {
    let n = matrix.nrows();
    if !matrix.iter().all(|v| v.is_finite()) {
        return None;
    }
    if n < 2 {
        return Some(matrix.iter().map(|&v| Complex::new(v, 0.0)).collect());
    }
    let graded = graded(matrix);
    let mut h = Hessenberg::new(graded).h();
    let norm = h.iter().map(|v| v.abs()).sum::<f64>();
    let mut found = Vec::with_capacity(n);
    // What the exceptional shifts have taken off the diagonal.
    let mut shifted = 0.0;
    let (mut end, mut steps) = (n, 0);
    while end > 0 {
        let last = end - 1;
        let first = block(&mut h, last, norm);
        if first == last {
            found.push(Complex::new(h[(last, last)] + shifted, 0.0));
            (end, steps) = (end - 1, 0);
        } else if first + 1 == last {
            found.extend(pair(&h, last, shifted));
            (end, steps) = (end - 2, 0);
        } else {
            if steps == MOST_STEPS {
                return None;
            }
            let corner = h[(last, last)];
            let before = h[(last - 1, last - 1)];
            let product = h[(last, last - 1)] * h[(last - 1, last)];
            let mut shift = (corner, before, product);
            if steps > 0 && steps.is_multiple_of(EXCEPTIONAL) {
                shifted += corner;
                (0..end).for_each(|i| h[(i, i)] -= corner);
                let size = h[(last, last - 1)].abs() + h[(last - 1, last - 2)].abs();
                shift = (SHIFT.0 * size, SHIFT.0 * size, SHIFT.1 * size * size);
            }
            francis(&mut h, first, last, shift);
            steps += 1;
        }
    }
    Some(found)
}

/// Rows and columns from the largest to the smallest: the small eigenvalues of a graded matrix are then found last, to their own
/// accuracy.
fn graded(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let n = matrix.nrows();
    let mut order: Vec<usize> = (0..n).collect();
    let sizes: Vec<f64> = matrix.row_iter().map(|row| row.amax()).collect();
    order.sort_by(|&a, &b| sizes[b].total_cmp(&sizes[a]));
    DMatrix::from_fn(n, n, |i, j| matrix[(order[i], order[j])])
}

/// Where the unreduced block that ends at `last` begins.
fn block(h: &mut DMatrix<f64>, last: usize, norm: f64) -> usize {
    for k in (1..=last).rev() {
        let neighbours = h[(k - 1, k - 1)].abs() + h[(k, k)].abs();
        let size = if neighbours == 0.0 { norm } else { neighbours };
        if h[(k, k - 1)].abs() <= f64::EPSILON * size {
            h[(k, k - 1)] = 0.0;
            return k;
        }
    }
    0
}

/// The eigenvalues of the last two rows of a block.
fn pair(h: &DMatrix<f64>, last: usize, shifted: f64) -> [Complex<f64>; 2] {
    let (x, y) = (h[(last, last)], h[(last - 1, last - 1)]);
    let product = h[(last, last - 1)] * h[(last - 1, last)];
    let half = 0.5 * (y - x);
    let square = half * half + product;
    let root = square.abs().sqrt();
    let x = x + shifted;
    if square >= 0.0 {
        let far = half + root.copysign(half);
        let near = if far == 0.0 { 0.0 } else { product / far };
        [Complex::new(x + far, 0.0), Complex::new(x - near, 0.0)]
    } else {
        [root, -root].map(|imaginary| Complex::new(x + half, imaginary))
    }
}

/// One double-shift step on the block `first..=last`, whose shifts are the eigenvalues of a 2×2 matrix with this diagonal and
/// product of the other entries.
fn francis(h: &mut DMatrix<f64>, first: usize, last: usize, (x, y, product): (f64, f64, f64)) {
    // The step may begin where two off-diagonal entries in a row are small.
    let mut start = last - 2;
    let mut column;
    loop {
        let (here, below) = (h[(start, start)], h[(start + 1, start + 1)]);
        let (r, s) = (x - here, y - here);
        column = [
            (r * s - product) / h[(start + 1, start)] + h[(start, start + 1)],
            below - here - r - s,
            h[(start + 2, start + 1)],
        ];
        let size: f64 = column.iter().map(|v| v.abs()).sum();
        if size > 0.0 {
            column.iter_mut().for_each(|v| *v /= size);
        }
        if start == first {
            break;
        }
        let left = h[(start, start - 1)].abs() * (column[1].abs() + column[2].abs());
        let above = h[(start - 1, start - 1)].abs();
        let right = column[0].abs() * (above + here.abs() + below.abs());
        if left <= f64::EPSILON * right {
            break;
        }
        start -= 1;
    }
    for i in start + 2..=last {
        h[(i, i - 2)] = 0.0;
        if i > start + 2 {
            h[(i, i - 3)] = 0.0;
        }
    }
    for k in start..last {
        // A reflection of three rows, of two at the end.
        let three = k + 1 < last;
        let mut size = 1.0;
        if k > start {
            column = [
                h[(k, k - 1)],
                h[(k + 1, k - 1)],
                if three { h[(k + 2, k - 1)] } else { 0.0 },
            ];
            size = column.iter().map(|v| v.abs()).sum();
            if size == 0.0 {
                continue;
            }
            column.iter_mut().for_each(|v| *v /= size);
        }
        let [p, q, r] = column;
        let length = p.hypot(q).hypot(r).copysign(p);
        if length == 0.0 {
            continue;
        }
        if k > start {
            h[(k, k - 1)] = -length * size;
        } else if first != start {
            h[(k, k - 1)] = -h[(k, k - 1)];
        }
        let axis = [(p + length) / length, q / length, r / length];
        let weight = [1.0, q / (p + length), r / (p + length)];
        let rows = if three { 3 } else { 2 };
        for j in k..=last {
            let sum: f64 = (0..rows).map(|i| weight[i] * h[(k + i, j)]).sum();
            for i in 0..rows {
                h[(k + i, j)] -= sum * axis[i];
            }
        }
        for i in first..=last.min(k + 3) {
            let sum: f64 = (0..rows).map(|j| axis[j] * h[(i, k + j)]).sum();
            for j in 0..rows {
                h[(i, k + j)] -= sum * weight[j];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The eigenvalues in the order of (real, |imaginary|).
    fn sorted(matrix: &DMatrix<f64>) -> Vec<Complex<f64>> {
        let mut found = eigenvalues(matrix).expect("eigenvalues");
        found.sort_by(|a, b| a.re.total_cmp(&b.re).then(a.im.total_cmp(&b.im)));
        found
    }

    /// x' = Q D Q⁻¹ with Q a product of reflections.
    fn similar(blocks: &DMatrix<f64>, seed: u64) -> DMatrix<f64> {
        let n = blocks.nrows();
        let mut state = seed;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
        };
        let mut found = blocks.clone();
        for _ in 0..3 {
            let v = nalgebra::DVector::from_fn(n, |_, _| random()).normalize();
            let reflection = DMatrix::identity(n, n) - 2.0 * &v * v.transpose();
            found = &reflection * found * &reflection;
        }
        found
    }

    #[test]
    fn equal_strings_converge() {
        // n inductors into one capacitor: n − 1 equal eigenvalues beside a pair.
        for n in 2..60 {
            let a = DMatrix::from_fn(n + 1, n + 1, |i, j| match (i, j) {
                (0, 0) => -100.0,
                (0, _) => 1e3,
                (_, 0) => -1e3,
                _ if i == j => -1e12,
                _ => 0.0,
            });
            let found = sorted(&a);
            let turning = found.iter().map(|v| v.im.abs()).fold(0.0, f64::max);
            let rounding = n as f64 * f64::EPSILON * 1e12;
            assert!(turning < rounding, "{n}: {turning}");
            assert!((found[n].re + 100.0).abs() < rounding, "{n}: {}", found[n]);
            assert!((found[0].re / -1e12 - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn zeros_and_identities_are_their_own_eigenvalues() {
        for n in 1..9 {
            assert!(
                sorted(&DMatrix::zeros(n, n))
                    .iter()
                    .all(|v| v.norm() == 0.0)
            );
            assert!(
                sorted(&DMatrix::identity(n, n))
                    .iter()
                    .all(|v| *v == Complex::new(1.0, 0.0))
            );
        }
        assert!(eigenvalues(&DMatrix::from_element(2, 2, f64::NAN)).is_none());
        // A rotation of five: the step that stands still without an exceptional shift.
        let cycle = DMatrix::from_fn(5, 5, |i, j| f64::from(u8::from((i + 1) % 5 == j)));
        assert!(
            sorted(&cycle)
                .iter()
                .all(|v| (v.norm() - 1.0).abs() < 1e-14)
        );
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: Some(Box::new(proptest::test_runner::FileFailurePersistence::WithSource("regressions"))), ..ProptestConfig::default() })]
        #[test]
        fn eigenvalues_of_similar_matrices_are_the_same(
            real in prop::collection::vec(-3_i32..3, 0..5),
            turning in prop::collection::vec((-3_i32..3, 1_i32..3), 0..4),
            seed in any::<u64>(),
        ) {
            let n = real.len() + 2 * turning.len();
            prop_assume!(n > 0);
            let mut blocks = DMatrix::zeros(n, n);
            let mut expected = Vec::new();
            for (i, &v) in real.iter().enumerate() {
                blocks[(i, i)] = f64::from(v);
                expected.push(Complex::new(f64::from(v), 0.0));
            }
            for (k, &(re, im)) in turning.iter().enumerate() {
                let i = real.len() + 2 * k;
                let (re, im) = (f64::from(re), f64::from(im));
                blocks[(i, i)] = re;
                blocks[(i + 1, i + 1)] = re;
                blocks[(i, i + 1)] = im;
                blocks[(i + 1, i)] = -im;
                expected.extend([Complex::new(re, im), Complex::new(re, -im)]);
            }
            // Of a normal matrix they are as well known as its entries.
            let mut found = eigenvalues(&similar(&blocks, seed)).expect("eigenvalues");
            for value in expected {
                let near = |k: &usize| (found[*k] - value).norm();
                let at = (0..found.len()).min_by(|a, b| near(a).total_cmp(&near(b))).expect("one");
                prop_assert!(near(&at) < 1e-13, "{value} in {found:?}");
                found.swap_remove(at);
            }
        }
    }
}
