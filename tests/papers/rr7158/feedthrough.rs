//! Section 3.1.2: when λ_II, or B_II λ_II, is a Lipschitz function of the state. Propositions 1 to 3, Corollary 1.

use circ::check::Feedthrough;
use circ::forms::inequality::VariationalInequality;
use circ::forms::lure::{Lure, Phi};
use circ::forms::{Linear, constant};
use circ::law::{Curve, Law};
use circ::passivity::System;
use circ::solve::{Lcp, enumerate};
use nalgebra::{DMatrix, DVector, dmatrix, dvector};

use super::super::{Random, circuit, value};
use super::solution;

/// A random system with the given D and laws, as the inequality (17) with p_I = 0.
fn fed(random: &mut Random, d: &DMatrix<f64>, phi: Vec<Phi>) -> VariationalInequality {
    let m = d.nrows();
    let system = System {
        a: random.matrix(3, 3),
        b: random.matrix(3, m),
        c: random.matrix(m, 3),
        d: d.clone(),
    };
    let linear = Linear::new(
        system,
        constant(random.vector(3)),
        constant(random.vector(m)),
    );
    VariationalInequality::of(&Lure::new(linear.unwrap(), phi).unwrap(), None).unwrap()
}

fn definite(random: &mut Random, m: usize) -> DMatrix<f64> {
    let (factor, skew) = (random.matrix(m, m), random.matrix(m, m));
    &factor * factor.transpose() + DMatrix::identity(m, m) * 0.1 + (&skew - skew.transpose())
}

/// Proposition 1: for D_II ≻ 0 and any φ the operator q ↦ λ is single-valued and Lipschitz with 2/λ_1(D + Dᵀ), and so is the drift of
/// (17). Half lines, intervals, relays and quadratic φ in one system.
#[test]
fn proposition_1_positive_definite_feedthrough_is_lipschitz() {
    let mut random = Random(1);
    let laws = |random: &mut Random, m: usize| -> Vec<Phi> {
        (0..m)
            .map(|_| match random.below(4) {
                0 => Phi::HalfLine,
                1 => Phi::Interval {
                    low: -0.3,
                    high: 0.5,
                },
                2 => Phi::Relay { gain: 0.7 },
                _ => Phi::Quadratic { stiffness: 2.0 },
            })
            .collect()
    };
    let mut tight = 0.0_f64;
    for _ in 0..60 {
        let m = 1 + random.below(4);
        let d = definite(&mut random, m);
        let lambda_1 = (&d + d.transpose()).symmetric_eigenvalues().min();
        let phi = laws(&mut random, m);
        let inequality = fed(&mut random, &d, phi.clone());
        let system = inequality.lure.linear.system.clone();
        let (x1, x2) = (random.vector(3) * 2.0, random.vector(3) * 2.0);
        let [z1, z2] = [&x1, &x2].map(|x| inequality.lambda(0.0, x).unwrap());
        // Each of them fulfils its law, by Fenchel's equality.
        for (x, z) in [(&x1, &z1), (&x2, &z2)] {
            let y = &system.c * x + &d * z + (inequality.lure.linear.f)(0.0);
            for j in 0..m {
                assert!(
                    phi[j].relates(z[j], y[j], 1e-7),
                    "{:?} {} {}",
                    phi[j],
                    z[j],
                    y[j]
                );
            }
        }
        let gap = (&system.c * (&x1 - &x2)).norm();
        assert!((&z1 - &z2).norm() <= 2.0 / lambda_1 * gap * (1.0 + 1e-9));
        tight = tight.max((&z1 - &z2).norm() / (2.0 / lambda_1 * gap));
        let moved = inequality.drift(0.0, &x1).unwrap() - inequality.drift(0.0, &x2).unwrap();
        let operator = moved - &system.a * (&x1 - &x2);
        assert!(operator.norm() <= system.b.norm() * 2.0 / lambda_1 * gap * (1.0 + 1e-9));
        // Single-valued: enumeration finds no second solution for half lines.
        let q = random.vector(m);
        assert_eq!(enumerate::solve(&Lcp { m: d, q }, 1e-9).len(), 1);
    }
    assert!(tight > 0.3, "{tight}");
}

#[test]
fn proposition_2_p_matrix_feedthrough_is_lipschitz() {
    let mut random = Random(2);
    let mut indefinite = 0;
    for _ in 0..60 {
        // Triangular with positive diagonal and large couplings: a P-matrix, mostly not positive semidefinite.
        let m = 2 + random.below(3);
        let d = DMatrix::from_fn(m, m, |i, j| {
            if i == j {
                1.0
            } else if j > i {
                4.0 * random.next()
            } else {
                0.0
            }
        });
        let class = Feedthrough::of(&d);
        assert_eq!(class.p_matrix, Some(true));
        indefinite += usize::from(!class.psd);
        let (q1, q2) = (random.vector(m), random.vector(m));
        for q in [&q1, &q2] {
            assert_eq!(
                enumerate::solve(
                    &Lcp {
                        m: d.clone(),
                        q: q.clone()
                    },
                    1e-9
                )
                .len(),
                1
            );
        }
        // Lipschitz with the largest ‖D_αα⁻¹‖ over the index sets.
        let constant = (1..1_usize << m)
            .map(|mask| {
                let set: Vec<usize> = (0..m).filter(|j| mask >> j & 1 == 1).collect();
                let block = d.select_rows(&set).select_columns(&set);
                1.0 / block.singular_values().min()
            })
            .fold(0.0, f64::max);
        let gap = (solution(&d, &q1) - solution(&d, &q2)).norm();
        assert!(gap <= constant * (&q1 - &q2).norm() * (1.0 + 1e-9));
    }
    assert!(indefinite > 20);
    // Without the P property: no solution for some q, two for others.
    assert!(
        enumerate::solve(
            &Lcp {
                m: dmatrix![-1.0],
                q: dvector![-1.0]
            },
            1e-9
        )
        .is_empty()
    );
    assert_eq!(
        enumerate::solve(
            &Lcp {
                m: dmatrix![-1.0],
                q: dvector![1.0]
            },
            1e-9
        )
        .len(),
        2
    );
}

/// Proposition 3 and Corollary 1 through the checker and by all solutions. D = wwᵀ, C = w cᵀ, B = b wᵀ with w = Sv, v > 0: the kernel of
/// D has no vector in the cone K* = S·R₊ᵐ, so (20) and (21) hold for the laws of K and λ is not unique, but Bλ = b·max(0, −cᵀx).
/// With the laws of the orthant and w of both signs the kernel meets the cone.
#[test]
fn proposition_3_and_corollary_1_semidefinite_feedthrough() {
    let mut random = Random(3);
    let reversed = || {
        let ray = |v: f64, i: f64| (value(v), value(i));
        Law::Curve(Curve {
            kind: "table",
            vertices: vec![ray(0.0, 0.0)],
            first: ray(0.0, 1.0),
            last: ray(1.0, 0.0),
        })
    };
    let mut other_cones = 0;
    for _ in 0..20 {
        let signs: Vec<f64> = (0..3).map(|_| random.next().signum()).collect();
        let v = random.vector(3).map(|v| 1.0 + 0.5 * v);
        let w = DVector::from_fn(3, |j, _| signs[j] * v[j]);
        let (b, c) = (random.vector(2), random.vector(2));
        let system = System {
            a: -DMatrix::identity(2, 2),
            b: &b * w.transpose(),
            c: &w * c.transpose(),
            d: &w * w.transpose(),
        };
        let laws = |signs: &[f64]| -> Vec<Law> {
            let of = |s: &f64| {
                if *s > 0.0 {
                    Law::ideal_diode()
                } else {
                    reversed()
                }
            };
            signs.iter().map(of).collect()
        };
        let verdict = |laws: &[Law]| {
            let report = circ::check::system(&circuit(&system, &DMatrix::identity(2, 2), laws));
            let found = report
                .theorems
                .iter()
                .find(|t| t.statement == "RR-7158 Theorem 1");
            let theorem = found.expect("in the report");
            (theorem.holds, theorem.because.clone())
        };
        let (holds, because) = verdict(&laws(&signs));
        assert_eq!(holds, Some(true), "{because}");
        assert!(because.contains("Proposition 3"), "{because}");
        let mixed = signs.iter().any(|s| *s != signs[0]);
        if mixed {
            let (holds, because) = verdict(&laws(&[1.0; 3]));
            assert!(
                holds == Some(false) && because.contains("(20) fails"),
                "{because}"
            );
            other_cones += 1;
        }
        // In λ' = Sλ, y' = Sy the cone is the orthant. Every split of σ = max(0, −cᵀx) is a solution, and Bλ the same.
        let x = random.vector(2) * 3.0;
        let q = &v * c.dot(&x);
        let d = &v * v.transpose();
        let sigma = (-c.dot(&x)).max(0.0);
        let apart = DVector::from_fn(3, |j, _| signs[j]);
        let b_signed = &system.b * DMatrix::from_diagonal(&apart);
        let splits =
            (0..3).map(|j| DVector::from_fn(3, |k, _| if k == j { sigma / v[j] } else { 0.0 }));
        for lambda in splits.chain([solution(&d, &q)]) {
            let y = &d * &lambda + &q;
            assert!(lambda.min() >= -1e-12 && y.min() > -1e-8 && y.dot(&lambda).abs() < 1e-8);
            assert!((&b_signed * &lambda - &b * sigma).norm() < 1e-7);
        }
    }
    assert!(other_cones > 5);
}

/// (21) as printed, R(D + Dᵀ) ⊂ ker B, is fulfilled by D = ½[[1, −1], [−1, 1]] and B = (1, 1), for which Bλ is not determined.
#[test]
fn equation_21_as_printed_determines_nothing() {
    let d = dmatrix![1.0, -1.0; -1.0, 1.0] * 0.5;
    // The printed inclusion R(D + Dᵀ) ⊂ ker B is fulfilled by B = (1, 1) per row, for which Bλ is not determined.
    let b = dmatrix![1.0, 1.0];
    assert!((&b * (&d + d.transpose())).amax() < 1e-15);
    let q = dvector![0.0, 0.0];
    let (z, other) = (dvector![0.0, 0.0], dvector![1.0, 1.0]);
    for candidate in [&z, &other] {
        let y = &d * candidate + &q;
        assert!(y.amin() >= 0.0 && y.dot(candidate) == 0.0);
    }
    assert!((b * (other - z)).norm() > 1.0);
}
