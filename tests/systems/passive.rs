//! Passive systems (A, B, C, D): the bridges of RR-7158 and random ones, for the tests of the papers and of the library.
#![allow(
    dead_code,
    missing_docs,
    unreachable_pub,
    reason = "every user takes its part"
)]

use circ::passivity::System;
use nalgebra::{DMatrix, DVector, dmatrix};

/// Uniform numbers in (−1, 1) from a fixed seed (xorshift64*).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    pub fn below(&mut self, n: usize) -> usize {
        ((self.next() + 1.0) / 2.0 * n as f64) as usize
    }

    pub fn matrix(&mut self, rows: usize, columns: usize) -> DMatrix<f64> {
        DMatrix::from_fn(rows, columns, |_, _| self.next())
    }

    pub fn vector(&mut self, n: usize) -> DVector<f64> {
        DVector::from_fn(n, |_, _| self.next())
    }
}

/// A random passive system with its storage matrix: x' = (J − R)Hx + (G − K)λ, y = (G + K)ᵀHx + (S + T)λ, J, T skew,
/// [[R, K], [Kᵀ, S]] = FFᵀ with `rank` columns, plus `damping`·I; H is diagonal within spread^±1.
pub fn passive(
    random: &mut Random,
    (n, m): (usize, usize),
    rank: usize,
    damping: f64,
    spread: f64,
) -> (System, DMatrix<f64>) {
    let h = DMatrix::from_diagonal(&random.vector(n).map(|v| spread.powf(v)));
    let factor = random.matrix(n + m, rank);
    let loss = &factor * factor.transpose() + DMatrix::identity(n + m, n + m) * damping;
    let (j, t, g) = (
        random.matrix(n, n),
        random.matrix(m, m),
        random.matrix(n, m),
    );
    let k = loss.view((0, n), (n, m)).into_owned();
    let system = System {
        a: (&j - j.transpose() - loss.view((0, 0), (n, n))) * &h,
        b: &g - &k,
        c: (&g + &k).transpose() * &h,
        d: loss.view((n, n), (m, m)) + (&t - t.transpose()),
    };
    (system, h)
}

pub const C: f64 = 1e-6;
pub const L: f64 = 1e-2;
pub const R: f64 = 1e3;

/// RR-7158 (36)-(37): the four-diode bridge across an LC tank.
pub fn bridge() -> System {
    System {
        a: dmatrix![0.0, -1.0 / C; 1.0 / L, 0.0],
        b: dmatrix![0.0, 0.0, -1.0 / C, 1.0 / C; 0.0, 0.0, 0.0, 0.0],
        c: dmatrix![0.0, 0.0; 0.0, 0.0; -1.0, 0.0; 1.0, 0.0],
        d: dmatrix![
            1.0 / R, 1.0 / R, -1.0, 0.0;
            1.0 / R, 1.0 / R, 0.0, -1.0;
            1.0, 0.0, 0.0, 0.0;
            0.0, 1.0, 0.0, 0.0
        ],
    }
}

/// RR-7158 (38): the bridge with a capacitor filter, skew-symmetric D.
pub fn filter() -> System {
    System {
        a: dmatrix![-1.0 / (R * C)],
        b: dmatrix![1.0 / C, 0.0, 1.0 / C, 0.0],
        c: dmatrix![1.0; 0.0; 1.0; 0.0],
        d: dmatrix![0.0, -1.0, 0.0, 0.0; 1.0, 0.0, 1.0, -1.0; 0.0, -1.0, 0.0, 0.0; 0.0, 1.0, 0.0, 0.0],
    }
}
