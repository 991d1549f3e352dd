//! Fast states that owe nothing to the others.
//!
//! A mode's system may come with fast states F apart from the others S, x and sources alike (`lcs::reduce`), coupled by no more than what is
//! slow. With
//!
//! ```text
//! 𝒜 = [S B; C F],   C + F Q = Q S + Q B Q,   P F̃ = B + S̃ P,   S̃ = S + B Q,   F̃ = F − Q B,
//! w = T ξ,   T = [I, P; Q, I + Q P],   T⁻¹ = [I + P Q, −P; −Q, I]:   T⁻¹ 𝒜 T = [S̃ 0; 0 F̃].
//! ```
//!
//! Q and P are small where F is fast, and fixed points of iterations that gain as many digits a round as S and F are apart (the slow
//! manifold w_F = Q w_S; G. W. Stewart, SIAM Review 15 (1973)). In ξ what is fast decays to nothing, so that neither guards nor
//! exponentials are differences of large numbers.

use super::levelled::Levelled;
use crate::settings::tolerances::exponentials::DECOUPLED;
use nalgebra::DMatrix;

/// Rounds of either iteration; S and F are apart by 10³ at least.
const ROUNDS: usize = 12;

/// The change of basis.
#[derive(Debug, Clone)]
pub(crate) struct Decoupled {
    /// T⁻¹ 𝒜 T.
    pub(crate) generator: DMatrix<f64>,
    /// What the entries of its slow part were summed from.
    pub(crate) sizes: DMatrix<f64>,
    /// T.
    pub(crate) to: DMatrix<f64>,
    /// T⁻¹.
    pub(crate) from: DMatrix<f64>,
}

/// The basis in which these states owe nothing to the others; `None` where the iterations do not end.
pub(crate) fn decoupled(generator: &DMatrix<f64>, fast: &[usize]) -> Option<Decoupled> {
    let dim = generator.nrows();
    let slow: Vec<usize> = (0..dim).filter(|j| !fast.contains(j)).collect();
    let part =
        |rows: &[usize], columns: &[usize]| generator.select_rows(rows).select_columns(columns);
    let (s, b) = (part(&slow, &slow), part(&slow, fast));
    let (c, f) = (part(fast, &slow), part(fast, fast));
    let of_f = Levelled::new(&f);
    let q = settled(DMatrix::zeros(fast.len(), slow.len()), |q| {
        of_f.solve(q * &s + q * &b * q - &c)
    })?;
    let (slow_part, fast_part) = (&s + &b * &q, &f - &q * &b);
    let turned = Levelled::new(&fast_part.transpose());
    let p = settled(DMatrix::zeros(slow.len(), fast.len()), |p| {
        Some(turned.solve((&b + &slow_part * p).transpose())?.transpose())
    })?;
    let slow_sizes = s.abs() + b.abs() * q.abs();
    let (mut block, mut sizes) = (DMatrix::zeros(dim, dim), DMatrix::zeros(dim, dim));
    let (mut to, mut from) = (DMatrix::identity(dim, dim), DMatrix::identity(dim, dim));
    let (qp, pq) = (&q * &p, &p * &q);
    let put = |into: &mut DMatrix<f64>,
               rows: &[usize],
               columns: &[usize],
               values: &DMatrix<f64>,
               sign: f64| {
        for (i, &row) in rows.iter().enumerate() {
            for (j, &column) in columns.iter().enumerate() {
                into[(row, column)] += sign * values[(i, j)];
            }
        }
    };
    put(&mut block, &slow, &slow, &slow_part, 1.0);
    put(&mut sizes, &slow, &slow, &slow_sizes, 1.0);
    put(&mut block, fast, fast, &fast_part, 1.0);
    put(&mut to, &slow, fast, &p, 1.0);
    put(&mut to, fast, &slow, &q, 1.0);
    put(&mut to, fast, fast, &qp, 1.0);
    put(&mut from, &slow, &slow, &pq, 1.0);
    put(&mut from, &slow, fast, &p, -1.0);
    put(&mut from, fast, &slow, &q, -1.0);
    Some(Decoupled {
        generator: block,
        sizes,
        to,
        from,
    })
}

/// The fixed point of a contraction.
fn settled(
    mut x: DMatrix<f64>,
    next: impl Fn(&DMatrix<f64>) -> Option<DMatrix<f64>>,
) -> Option<DMatrix<f64>> {
    for _ in 0..ROUNDS {
        let y = next(&x)?;
        let still = y.row_iter().zip(x.row_iter()).all(|(y, x)| {
            let size = y.amax();
            size.is_finite() && (y - x).amax() <= DECOUPLED * size
        });
        x = y;
        if still {
            return Some(x);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fast_state_is_left_alone() {
        let a = DMatrix::from_row_slice(
            4,
            4,
            &[
                -1.0, 2.0, 0.5, 1.0, 3.0, -1e12, 4.0, 2.0, -0.3, 1.0, -2.0, 5.0, 0.0, 0.0, 0.0, 0.0,
            ],
        );
        let found = decoupled(&a, &[1]).expect("a gap of 12 decades");
        let Decoupled {
            generator,
            to,
            from,
            ..
        } = found;
        let identity = DMatrix::identity(4, 4);
        assert!((&to * &from - identity).amax() < 1e-15);
        // The slow manifold to first order, the second being 1e12 times less, and what it adds to the slow part.
        assert!((to[(1, 0)] - 3e-12).abs() < 1e-22 && (to[(1, 3)] - 2e-12).abs() < 1e-22);
        assert!((generator[(0, 0)] + 1.0 - 6e-12).abs() < 1e-15);
        assert!((generator[(0, 1)], generator[(1, 3)]) == (0.0, 0.0));
        assert!(decoupled(&DMatrix::from_row_slice(2, 2, &[1.0, 2.0, 2.0, 1.0]), &[1]).is_none());
    }
}
