//! (P + jωQ) x = b with real P and Q without their zeros, for one frequency after the other.
//!
//! Written in real numbers, (re x_k, im x_k) in the places 2k and 2k + 1, each entry is the block `[p, −ωq; ωq, p]`, so that the sparse factors for real matrices serve; the order of
//! elimination is found once. Rows are levelled, as those of different resistances are decades apart.

use nalgebra::Complex;

use super::sparse_lu::{Pattern, SparseLu};

/// A place of both matrices.
#[derive(Debug, Clone, Copy)]
struct Entry {
    row: usize,
    column: usize,
    p: f64,
    q: f64,
    /// Where its block stands among the values: p twice, then −ωq and ωq.
    own: Option<[usize; 2]>,
    turned: Option<[usize; 2]>,
}

/// See the [module](self).
#[derive(Debug, Clone)]
pub(crate) struct Pencil {
    entries: Vec<Entry>,
    pattern: Pattern,
    n: usize,
}

/// The factors for one frequency.
#[derive(Debug)]
pub(crate) struct At<'a> {
    pencil: &'a Pencil,
    omega: f64,
    factors: SparseLu,
    /// 1 over the largest entry of each row.
    levels: Vec<f64>,
}

impl Pencil {
    /// Entries (row, column, p, q) of n×n matrices, each place named once.
    pub(crate) fn new(n: usize, entries: &[(usize, usize, f64, f64)]) -> Self {
        let mut at = Vec::new();
        let mut block = |there: bool, places: [(usize, usize); 2]| {
            there.then(|| {
                at.extend(places);
                [at.len() - 2, at.len() - 1]
            })
        };
        let entry = |&(row, column, p, q): &(usize, usize, f64, f64)| {
            let (i, j) = (2 * row, 2 * column);
            Entry {
                row,
                column,
                p,
                q,
                own: block(p != 0.0 || row == column, [(i, j), (i + 1, j + 1)]),
                turned: block(q != 0.0, [(i, j + 1), (i + 1, j)]),
            }
        };
        let mut entries: Vec<Entry> = entries.iter().map(entry).collect();
        let (pattern, places) = Pattern::new(2 * n, &at);
        for entry in &mut entries {
            for block in [&mut entry.own, &mut entry.turned].into_iter().flatten() {
                *block = block.map(|k| places[k]);
            }
        }
        Self {
            entries,
            pattern,
            n,
        }
    }

    /// Factors of P + jωQ; `None` where it is singular.
    pub(crate) fn at(&mut self, omega: f64) -> Option<At<'_>> {
        let mut levels = vec![0.0_f64; self.n];
        for entry in &self.entries {
            let size = entry.p.hypot(omega * entry.q);
            levels[entry.row] = levels[entry.row].max(size);
        }
        for level in &mut levels {
            *level = if *level > 0.0 { level.recip() } else { 1.0 };
        }
        let values = self.pattern.values();
        for entry in &self.entries {
            let level = levels[entry.row];
            for place in entry.own.into_iter().flatten() {
                values[place] = level * entry.p;
            }
            if let Some([above, below]) = entry.turned {
                let turned = level * omega * entry.q;
                (values[above], values[below]) = (-turned, turned);
            }
        }
        Some(At {
            omega,
            factors: self.pattern.factors()?,
            levels,
            pencil: self,
        })
    }
}

impl At<'_> {
    /// x, improved once by what it leaves of b; `None` where it is not finite.
    pub(crate) fn solve(&self, b: &[Complex<f64>]) -> Option<Vec<Complex<f64>>> {
        let mut x = self.once(b);
        let mut left = b.to_vec();
        for entry in &self.pencil.entries {
            left[entry.row] -= self.value(entry) * x[entry.column];
        }
        for (x, by) in x.iter_mut().zip(self.once(&left)) {
            *x += by;
        }
        x.iter().all(|x| x.is_finite()).then_some(x)
    }

    /// What entries that are off by ε of themselves make of a solution, a sample: all of a row in one direction, rows in directions without order.
    pub(crate) fn rounding(&self, x: &[Complex<f64>]) -> Vec<Complex<f64>> {
        let mut off = vec![0.0; x.len()];
        for entry in &self.pencil.entries {
            off[entry.row] += self.value(entry).norm() * x[entry.column].norm();
        }
        let golden = std::f64::consts::TAU * 0.618_033_988_749_894_9;
        let turned = off.iter().enumerate();
        let turned =
            turned.map(|(k, off)| Complex::from_polar(f64::EPSILON * off, golden * k as f64));
        self.once(&turned.collect::<Vec<_>>())
    }

    fn value(&self, entry: &Entry) -> Complex<f64> {
        Complex::new(entry.p, self.omega * entry.q)
    }

    fn once(&self, b: &[Complex<f64>]) -> Vec<Complex<f64>> {
        let levelled = b.iter().zip(&self.levels);
        let mut both: Vec<f64> = levelled
            .flat_map(|(b, level)| [b.re * level, b.im * level])
            .collect();
        self.factors.solve(&mut both, &mut Vec::new());
        let pairs = both.chunks_exact(2);
        pairs.map(|pair| Complex::new(pair[0], pair[1])).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    #[test]
    fn a_pencil_is_its_dense_matrix() {
        // A lossless tank between resistors of nine decades, and a row that has nothing on its diagonal.
        let entries = [
            (0, 0, 0.0, 1e-6),
            (0, 1, -1.0, 0.0),
            (1, 0, 1.0, 0.0),
            (1, 1, 0.0, 1e-3),
            (1, 2, 0.0, 2e-4),
            (2, 2, 1e-9, 1e-12),
            (2, 3, 1.0, 0.0),
            (3, 2, -1.0, 0.0),
            (3, 0, 1.0, 0.0),
        ];
        let mut pencil = Pencil::new(4, &entries);
        let b: Vec<_> = (0..4).map(|k| Complex::new(1.0, f64::from(k))).collect();
        for omega in [0.0, 1.0, 1e5, 1e9] {
            let mut dense = DMatrix::<Complex<f64>>::zeros(4, 4);
            for &(i, j, p, q) in &entries {
                dense[(i, j)] += Complex::new(p, omega * q);
            }
            let expected = dense
                .lu()
                .solve(&DVector::from_vec(b.clone()))
                .expect("regular");
            let at = pencil.at(omega).expect("regular");
            let found = at.solve(&b).expect("finite");
            let rounding = at.rounding(&found);
            for ((a, b), off) in found.iter().zip(&expected).zip(&rounding) {
                assert!(
                    (a - b).norm() <= 1e-13 * expected.camax(),
                    "{omega}: {a} {b}"
                );
                assert!(off.norm() < 1e-12 * expected.camax(), "{omega}: {off}");
            }
        }
        assert!(Pencil::new(1, &[(0, 0, 0.0, 1.0)]).at(0.0).is_none());
    }
}
