//! Matrices that fall into blocks without an entry between them.

use nalgebra::DMatrix;

/// The blocks of a square matrix: each the rows (and columns) that entries connect, in order; blocks in the order of their first rows.
pub(crate) fn connected(m: &DMatrix<f64>) -> Vec<Vec<usize>> {
    let size = m.nrows();
    let mut open: Vec<usize> = (0..size).rev().collect();
    let mut blocks = Vec::new();
    while let Some(first) = open.pop() {
        let mut block = vec![first];
        let mut next = 0;
        while let Some(&i) = block.get(next) {
            next += 1;
            open.retain(|&j| {
                let joined = m[(i, j)] != 0.0 || m[(j, i)] != 0.0;
                if joined {
                    block.push(j);
                }
                !joined
            });
        }
        block.sort_unstable();
        blocks.push(block);
    }
    blocks
}

/// The least and the largest eigenvalue of a symmetric matrix, block by block; zeros of an empty one.
pub(crate) fn extreme_eigenvalues(symmetric: &DMatrix<f64>) -> [f64; 2] {
    let blocks = connected(symmetric);
    let of = |block: &Vec<usize>| match block[..] {
        [i] => [symmetric[(i, i)]; 2],
        _ => {
            let part = symmetric.select_rows(block).select_columns(block);
            let eigenvalues = part.symmetric_eigenvalues();
            [eigenvalues.min(), eigenvalues.max()]
        }
    };
    let extremes = blocks.iter().map(of);
    extremes
        .reduce(|[least, largest], [low, high]| [least.min(low), largest.max(high)])
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_what_entries_connect() {
        let m = nalgebra::dmatrix![
            1.0, 0.0, 2.0, 0.0;
            0.0, 3.0, 0.0, 0.0;
            0.0, 0.0, 1.0, 0.0;
            0.0, 0.0, 0.0, -4.0
        ];
        assert_eq!(connected(&m), [vec![0, 2], vec![1], vec![3]]);
        let symmetric = &m + m.transpose();
        // [2, 2; 2, 2], 6 and −8
        let [least, largest] = extreme_eigenvalues(&symmetric);
        assert!((least + 8.0).abs() < 1e-14 && (largest - 6.0).abs() < 1e-14);
        assert_eq!(extreme_eigenvalues(&DMatrix::zeros(0, 0)), [0.0, 0.0]);
    }
}
