//! What kind of matrix the feedthrough D is: it decides whether λ is determined by the state and whether states can jump.

use crate::settings::tolerances::ranks::RANK;
use nalgebra::DMatrix;
use petgraph::algo::tarjan_scc;
use petgraph::graph::DiGraph;

/// Order up to which all 2ᵐ − 1 principal minors are computed (per strongly connected block).
const EXACT_ORDER: usize = 14;

/// Principal minors tried at random beyond that, from a fixed seed; they can refute, not prove. At most this many, and at
/// most this many operations (m³ each).
const RANDOM_MINORS: usize = 4000;
const OPERATIONS: usize = 200_000_000;

/// The class of D (m×m). `None` is "not decided".
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Feedthrough {
    /// D = 0.
    pub zero: bool,
    /// D + Dᵀ ⪰ 0.
    pub psd: bool,
    /// D + Dᵀ ≻ 0.
    pub pd: bool,
    /// D + Dᵀ = 0.
    pub skew: bool,
    /// Numerical rank of the equilibrated D.
    pub rank: usize,
    /// All principal minors positive: LCP(q, D) has exactly one solution for every q.
    pub p_matrix: Option<bool>,
    /// All principal minors nonnegative.
    pub p0_matrix: Option<bool>,
}

impl Feedthrough {
    /// Classifies D.
    ///
    /// # Cost
    /// 2ᵏ determinants for the largest strongly connected block of order k ≤ 14, else a few thousand.
    #[must_use]
    pub fn of(d: &DMatrix<f64>) -> Self {
        let m = d.nrows();
        let unit = equilibrated(d);
        let symmetric = (&unit + unit.transpose()) * 0.5;
        let smallest = if m == 0 {
            0.0
        } else {
            symmetric.clone().symmetric_eigenvalues().min()
        };
        let psd = smallest >= -RANK * m as f64;
        let pd = m > 0 && smallest > RANK * m as f64;
        let singular = if m == 0 {
            Vec::new()
        } else {
            unit.clone().singular_values().as_slice().to_vec()
        };
        let top = singular.iter().copied().fold(0.0, f64::max);
        let (p_matrix, p0_matrix) = if m == 0 {
            (Some(true), Some(true))
        } else {
            minors(&unit, psd, pd)
        };
        Self {
            zero: d.amax() == 0.0 || m == 0,
            psd,
            pd: pd || m == 0,
            skew: symmetric.amax() <= RANK,
            rank: singular.iter().filter(|&&s| s > RANK * top).count(),
            p_matrix,
            p0_matrix,
        }
    }
}

/// SDS with a positive diagonal S (powers of two), rows and columns of size about one. Signs of principal minors and
/// definiteness are unchanged.
fn equilibrated(d: &DMatrix<f64>) -> DMatrix<f64> {
    let mut unit = d.clone();
    for _ in 0..20 {
        for j in 0..unit.nrows() {
            let size = unit.row(j).amax().max(unit.column(j).amax());
            if size > 0.0 {
                let f = (-0.5 * size.log2()).round().exp2();
                unit.row_mut(j).scale_mut(f);
                unit.column_mut(j).scale_mut(f);
            }
        }
    }
    unit
}

/// (P, P0). A principal minor is the product of the minors of the strongly connected blocks, so blocks decide.
fn minors(d: &DMatrix<f64>, psd: bool, pd: bool) -> (Option<bool>, Option<bool>) {
    let mut p = Some(true);
    let mut p0 = Some(true);
    for block in blocks(d) {
        let sub = d.select_rows(&block).select_columns(&block);
        let (block_p, block_p0) = if block.len() <= EXACT_ORDER {
            let (p, p0) = all_minors(&sub);
            (Some(p), Some(p0))
        } else {
            sampled_minors(&sub)
        };
        p = both(p, block_p);
        p0 = both(p0, block_p0);
    }
    // A positive (semi)definite matrix, symmetric or not, is a P (P0) matrix.
    if pd {
        p = p.or(Some(true));
    }
    if psd {
        p0 = p0.or(Some(true));
    }
    (p, p0)
}

/// False wins, then "not decided".
fn both(a: Option<bool>, b: Option<bool>) -> Option<bool> {
    match (a, b) {
        (Some(false), _) | (_, Some(false)) => Some(false),
        (Some(true), Some(true)) => Some(true),
        _ => None,
    }
}

/// Strongly connected components of the sparsity pattern, each sorted.
fn blocks(d: &DMatrix<f64>) -> Vec<Vec<usize>> {
    let m = d.nrows();
    let mut graph = DiGraph::<(), ()>::new();
    let nodes: Vec<_> = (0..m).map(|_| graph.add_node(())).collect();
    for i in 0..m {
        for j in 0..m {
            if i != j && d[(i, j)] != 0.0 {
                graph.add_edge(nodes[i], nodes[j], ());
            }
        }
    }
    tarjan_scc(&graph)
        .into_iter()
        .map(|component| {
            let mut block: Vec<usize> = component.into_iter().map(|node| node.index()).collect();
            block.sort_unstable();
            block
        })
        .collect()
}

/// The sign (−1, 0, 1) of det D_αα, zero within rounding of the Hadamard bound.
fn sign(d: &DMatrix<f64>, set: &[usize]) -> i8 {
    let sub = d.select_rows(set).select_columns(set);
    let bound: f64 = sub.row_iter().map(|row| row.norm()).product();
    let value = sub.determinant();
    if value.abs() <= RANK * bound {
        0
    } else if value > 0.0 {
        1
    } else {
        -1
    }
}

fn all_minors(d: &DMatrix<f64>) -> (bool, bool) {
    let m = d.nrows();
    let (mut p, mut p0) = (true, true);
    for mask in 1..1_usize << m {
        let set: Vec<usize> = (0..m).filter(|j| mask >> j & 1 == 1).collect();
        match sign(d, &set) {
            1 => {}
            0 => p = false,
            _ => return (false, false),
        }
    }
    p &= p0;
    p0 |= p;
    (p, p0)
}

/// Diagonal entries, 2×2 minors and random subsets: `Some(false)` where one refutes, else `None`.
fn sampled_minors(d: &DMatrix<f64>) -> (Option<bool>, Option<bool>) {
    let m = d.nrows();
    let mut p = None;
    let mut state = 0x9E37_79B9_7F4A_7C15_u64;
    let mut bit = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state >> 40 & 1 == 1
    };
    let singles = (0..m).map(|j| vec![j]);
    let pairs = (0..m).flat_map(|i| (0..i).map(move |j| vec![j, i]));
    let random: Vec<Vec<usize>> = (0..RANDOM_MINORS.min(OPERATIONS / (m * m * m)))
        .map(|_| (0..m).filter(|_| bit()).collect())
        .collect();
    for set in singles
        .chain(pairs)
        .chain(random)
        .filter(|set| !set.is_empty())
    {
        match sign(d, &set) {
            1 => {}
            // Small against the Hadamard bound says little about a large minor; a zero diagonal entry is exact.
            0 if set.len() == 1 => p = Some(false),
            0 => {}
            _ => return (Some(false), Some(false)),
        }
    }
    (p, None)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(rows: &[&[f64]]) -> DMatrix<f64> {
        DMatrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
    }

    #[test]
    fn the_bridge_is_semidefinite_p0_and_of_full_rank() {
        let g = 1e-3;
        let d = matrix(&[
            &[g, g, -1.0, 0.0],
            &[g, g, 0.0, -1.0],
            &[1.0, 0.0, 0.0, 0.0],
            &[0.0, 1.0, 0.0, 0.0],
        ]);
        let class = Feedthrough::of(&d);
        assert!(class.psd && !class.pd && !class.skew && !class.zero);
        assert_eq!(
            (class.rank, class.p_matrix, class.p0_matrix),
            (4, Some(false), Some(true))
        );
    }

    #[test]
    fn the_capacitor_filter_bridge_is_skew_of_rank_two() {
        let d = matrix(&[
            &[0.0, -1.0, 0.0, 0.0],
            &[1.0, 0.0, 1.0, -1.0],
            &[0.0, -1.0, 0.0, 0.0],
            &[0.0, 1.0, 0.0, 0.0],
        ]);
        let class = Feedthrough::of(&d);
        assert!(class.psd && class.skew);
        assert_eq!(
            (class.rank, class.p_matrix, class.p0_matrix),
            (2, Some(false), Some(true))
        );
    }

    #[test]
    fn a_p_matrix_need_not_be_semidefinite() {
        let class = Feedthrough::of(&matrix(&[&[1.0, 5.0], &[0.0, 1.0]]));
        assert!(!class.psd);
        assert_eq!(class.p_matrix, Some(true));
        let class = Feedthrough::of(&matrix(&[&[1.0, 2.0], &[2.0, 1.0]]));
        assert_eq!(
            (class.p_matrix, class.p0_matrix),
            (Some(false), Some(false))
        );
    }

    #[test]
    fn large_matrices_are_proved_refuted_or_left_open() {
        // Upper triangular of order 30: blocks of order one decide.
        let triangular = DMatrix::from_fn(30, 30, |i, j| {
            if i == j {
                1.0
            } else if j > i {
                3.0
            } else {
                0.0
            }
        });
        assert_eq!(Feedthrough::of(&triangular).p_matrix, Some(true));
        // Definite of order 30: proof. One negative diagonal entry: refuted.
        let mut definite =
            DMatrix::from_fn(
                30,
                30,
                |i, j| if i == j { 40.0 } else { ((i * j) as f64).sin() },
            );
        assert_eq!(Feedthrough::of(&definite).p_matrix, Some(true));
        definite[(3, 3)] = -1.0;
        assert_eq!(Feedthrough::of(&definite).p0_matrix, Some(false));
        // Row-diagonally dominant but indefinite in its symmetric part: neither proved nor refuted by samples.
        let open = DMatrix::from_fn(30, 30, |i, j| {
            if i == j {
                1.0
            } else {
                f64::from(j == (i + 1) % 30) * 3.0
            }
        });
        assert!(!Feedthrough::of(&open).psd);
        assert_eq!(Feedthrough::of(&open).p_matrix, None);
    }

    #[test]
    fn no_ports_is_every_class() {
        let class = Feedthrough::of(&DMatrix::zeros(0, 0));
        assert!(class.zero && class.psd && class.skew && class.p_matrix == Some(true));
        assert_eq!(class.rank, 0);
    }
}
