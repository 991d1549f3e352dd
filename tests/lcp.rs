//! Solvers × problems: every method on every problem, with the failures that are expected and why.
#![allow(missing_docs, reason = "tests")]

use circ::solve::lcp::{Answered, Lcp, Scaling, Status};
use circ::solve::lemke::{self, Lemke};
use circ::solve::{Driver, active::ActiveSolve, convex, enumerate, norm, pivot};
use nalgebra::{DMatrix, DVector, dmatrix, dvector};
use proptest::prelude::*;

const TOLERANCE: f64 = 1e-9;

struct Problem {
    name: &'static str,
    m: DMatrix<f64>,
    q: DVector<f64>,
    /// Methods that fail here, and why.
    fails: &'static [(&'static str, &'static str)],
}

/// Murty's example: 1 on the diagonal, 2 below, q = −1; Lemke and Murty take exponentially many pivots in general.
fn murty(size: usize) -> (DMatrix<f64>, DVector<f64>) {
    let m = DMatrix::from_fn(size, size, |i, j| match i.cmp(&j) {
        std::cmp::Ordering::Less => 0.0,
        std::cmp::Ordering::Equal => 1.0,
        std::cmp::Ordering::Greater => 2.0,
    });
    (m, DVector::from_element(size, -1.0))
}

fn problems() -> Vec<Problem> {
    const SINGULAR: &str = "the violated pairs alone have a singular M_aa";
    let bridge = dmatrix![1e-3, 1e-3, -1.0, 0.0; 1e-3, 1e-3, 0.0, -1.0; 1.0, 0.0, 0.0, 0.0; 0.0, 1.0, 0.0, 0.0];
    let filter =
        dmatrix![0.0, -1.0, 0.0, 0.0; 1.0, 0.0, 1.0, -1.0; 0.0, -1.0, 0.0, 0.0; 0.0, 1.0, 0.0, 0.0];
    let step =
        dmatrix![3.3, 0.0, 3.3, 0.0; 0.0, 0.0, 0.0, 0.0; 3.3, 0.0, 4.3, -1.0; 0.0, 0.0, -1.0, 1.0];
    let (m6, q6) = murty(6);
    let scales = DMatrix::from_diagonal(&dvector![1e-6, 3e4, 1.0]);
    let dense = dmatrix![4.0, 1.0, -2.0; -1.0, 3.0, 1.0; 2.0, 0.5, 5.0];
    let problem = |name, m, q, fails| Problem { name, m, q, fails };
    vec![
        problem(
            "positive definite",
            dmatrix![4.0, 1.0; 1.0, 3.0],
            dvector![-5.0, -6.0],
            &[],
        ),
        problem(
            "q nonnegative",
            dmatrix![0.0, -1.0; 1.0, 0.0],
            dvector![0.0, 2.0],
            &[],
        ),
        problem(
            "bridge, D",
            bridge.clone(),
            dvector![0.0, 0.0, -10.0, 10.0],
            &[("block", SINGULAR)],
        ),
        problem(
            "bridge, D, reversed",
            bridge,
            dvector![0.0, 0.0, 3.0, -3.0],
            &[("block", SINGULAR)],
        ),
        problem(
            "capacitor filter, h·CB = 1e-6",
            &filter + &step * 1e-6,
            dvector![0.0, 0.0, -10.0, 10.0],
            &[],
        ),
        problem(
            "skew pair",
            dmatrix![0.0, -1.0; 1.0, 0.0],
            dvector![2.0, -3.0],
            &[("block", SINGULAR)],
        ),
        problem(
            "degenerate: both zero",
            dmatrix![2.0, 1.0; 1.0, 2.0],
            dvector![-2.0, -1.0],
            &[],
        ),
        problem(
            "duplicated rows",
            dmatrix![1.0, 1.0, 0.5; 1.0, 1.0, 0.5; 0.5, 0.5, 2.0],
            dvector![-2.0, -2.0, -1.0],
            &[("block", SINGULAR)],
        ),
        problem("Murty's exponential example", m6, q6, &[]),
        problem(
            "scaled 1e-12 … 1e9",
            &scales * dense * &scales,
            &scales * dvector![-1.0, -2.0, 1.5],
            &[],
        ),
    ]
}

fn attempt(method: &str, lcp: &Lcp) -> Option<DVector<f64>> {
    let scaling = Scaling::of(&lcp.m);
    let scaled = scaling.apply(lcp);
    let size = lcp.size();
    let on = |set: &[bool]| ActiveSolve::new(&scaled.m, set).refined(&scaled);
    let lambda = match method {
        "block" => pivot::solve(&scaled, &vec![false; size], 1e-14)?.0,
        "lemke" => match lemke::solve(&scaled, &DVector::from_element(size, 1.0)) {
            Lemke::Basis(set) => on(&set),
            Lemke::Ray(_) | Lemke::Limit => return None,
        },
        "convex" => {
            let rough = convex::solve(&scaled)?;
            let y = scaled.y(&rough);
            on(&(0..size).map(|j| rough[j] > y[j]).collect::<Vec<_>>())
        }
        "enumerate" => enumerate::solve(lcp, TOLERANCE)
            .into_iter()
            .next()?
            .component_div(&scaling.d),
        _ => Driver::new(lcp.m.clone(), TOLERANCE)
            .solve(&lcp.q)
            .lambda
            .component_div(&scaling.d),
    };
    let lambda = scaling.unscale(&lambda);
    (scaling.residual(lcp, &lambda, &lcp.y(&lambda)) < 1e-12).then_some(lambda)
}

#[test]
fn every_method_on_every_problem() {
    let mut wrong = Vec::new();
    for problem in problems() {
        let lcp = Lcp::new(problem.m, problem.q).expect("a problem");
        for method in ["driver", "block", "lemke", "convex", "enumerate"] {
            let expected = problem.fails.iter().find(|(m, _)| *m == method);
            let solved = attempt(method, &lcp).is_some();
            if solved == expected.is_some() {
                wrong.push(format!("{method} on {}: solved = {solved}", problem.name));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn infeasible_problems_carry_a_certificate() {
    let cases = [
        (dmatrix![0.0], dvector![-1.0]),
        (dmatrix![0.0, 0.0; 0.0, 1.0], dvector![-1e-3, 3.0]),
        (dmatrix![0.0, 1.0; -1.0, 0.0], dvector![1.0, -1.0]),
        (
            dmatrix![1e6, -1e6, 0.0; -1e6, 1e6, 0.0; 0.0, 0.0, 1e-6],
            dvector![-1.0, -1.0, 1.0],
        ),
    ];
    for (m, q) in cases {
        let solution = Driver::new(m.clone(), TOLERANCE).solve(&q);
        let Status::Infeasible(v) = solution.status else {
            panic!("{m} {q}: {solution:?}")
        };
        assert!(v.iter().all(|v| *v >= 0.0));
        assert!((q.dot(&v) + 1.0).abs() < 1e-12);
        let columns = m.transpose() * &v;
        assert!(columns.max() <= 1e-9 * m.amax() * v.amax(), "{columns}");
    }
}

/// λ = (0, 2) has Mλ + q = (0, 1) ≥ 0, but nothing is complementary. Lemke ends on the ray (1, 0) with qᵀv = −2, which proves nothing:
/// Mᵀv = (−1, 1).
#[test]
fn a_ray_that_proves_nothing_is_no_certificate() {
    let (m, q) = (dmatrix![-1.0, 1.0; -1.0, 1.0], dvector![-2.0, -1.0]);
    assert!((&m * dvector![0.0, 2.0] + &q).min() >= 0.0);
    let ray = lemke::solve(
        &Lcp {
            m: m.clone(),
            q: q.clone(),
        },
        &dvector![1.0, 1.0],
    );
    assert_eq!(ray, Lemke::Ray(dvector![1.0, 0.0]));
    assert_eq!(Driver::new(m, TOLERANCE).solve(&q).status, Status::Failed);
}

/// The kernel of a matrix with fewer rows than columns, and of one with more.
#[test]
fn kernels_have_what_rows_leave() {
    for (a, dimension) in [
        (dmatrix![1.0, 1.0, 0.0], 2),
        (dmatrix![1.0, 2.0; 2.0, 4.0; 3.0, 6.0], 1),
        (dmatrix![1.0, 2.0; 2.0, 1.0], 0),
    ] {
        let kernel = norm::kernel(&a);
        assert_eq!(kernel.ncols(), dimension, "{a}");
        assert!(
            (&a * &kernel).iter().all(|v| v.abs() < 1e-14),
            "{a}{kernel}"
        );
        let unit = kernel.transpose() * &kernel - DMatrix::identity(dimension, dimension);
        assert!(unit.iter().all(|v| v.abs() < 1e-14), "{kernel}");
    }
}

/// Three diodes in a ring: M is singular but for rounding.
#[test]
fn degenerate_ports_leave_a_singular_set() {
    let m = dmatrix![
        9.765608416423303e-1, -4.637459906335678e-6, -2.441355729506762e-1;
        -4.637459906335678e-6, 9.765106919136114e-1, -9.765095325486348e-1;
        -2.441355729506762e-1, -9.765095325486348e-1, 1.0375434257863039
    ];
    let q = dvector![
        1.634684698349708e-5,
        3.37842142228853e-4,
        -3.419288539786958e-4
    ];
    let solution = Driver::new(m, TOLERANCE).solve(&q);
    assert_eq!(solution.status, Status::Solved);
    assert_eq!(solution.basis, [true, false, true]);
}

/// q of a ring must be orthogonal to its loop; rounding of large terms behind a small q contradicts that.
#[test]
fn a_contradiction_within_the_uncertainty_of_q_is_none() {
    let m = dmatrix![2.0, -1.0, -1.0; -1.0, 1.0, 0.0; -1.0, 0.0, 1.0];
    let q = dvector![-2e-6, 1e-6, 1e-6 - 1e-13];
    let mut driver = Driver::new(m, TOLERANCE);
    assert_ne!(driver.solve(&q).status, Status::Solved);
    driver.blur(&dvector![1e-12, 1e-12, 1e-12]);
    let solution = driver.solve(&q);
    assert_eq!(solution.status, Status::Solved);
    assert!(solution.lambda.amax() < 3e-6, "{}", solution.lambda);
    driver.blur(&dvector![1e-15, 1e-15, 1e-15]);
    assert_ne!(driver.solve(&q).status, Status::Solved);
}

#[test]
fn the_driver_says_who_answered() {
    let mut driver = Driver::new(dmatrix![2.0, 1.0; 1.0, 2.0], TOLERANCE);
    assert_eq!(driver.solve(&dvector![1.0, 1.0]).by, Answered::Warm);
    assert_eq!(driver.solve(&dvector![-5.0, -6.0]).by, Answered::Block);
    assert_eq!(driver.solve(&dvector![-5.1, -6.0]).by, Answered::Warm);
    let mut skew = Driver::new(dmatrix![0.0, -1.0; 1.0, 0.0], TOLERANCE);
    assert_eq!(skew.solve(&dvector![2.0, -3.0]).by, Answered::Lemke);
    assert_eq!(skew.solve(&dvector![2.0, -3.5]).by, Answered::Warm);
}

#[test]
fn nothing_is_accepted_that_is_no_solution() {
    // −1 λ − 1 ≥ 0 with λ ≥ 0 has no solution, and M is not monotone: no certificate either.
    let solution = Driver::new(dmatrix![-1.0], TOLERANCE).solve(&dvector![-1.0]);
    assert_ne!(solution.status, Status::Solved);
    assert!(solution.residual > 0.1);
}

/// A problem of a passive circuit: M = S + K with S ⪰ 0 of low rank, K skew with entries 0, ±1, and a known solution; in units that
/// differ by up to 2^(6 reach) in each port.
fn passive(
    size: usize,
    reach: i32,
) -> impl Strategy<Value = (DMatrix<f64>, DVector<f64>, DVector<f64>)> {
    let entries = proptest::collection::vec(-1.0..1.0_f64, size * size.div_ceil(2));
    let signs = proptest::collection::vec(-1..=1_i32, size * size);
    let parts = proptest::collection::vec((0..3_u8, 0.1..10.0_f64), size);
    let scales = proptest::collection::vec(-reach..=reach, size);
    (entries, signs, parts, scales).prop_map(move |(entries, signs, parts, scales)| {
        let f = DMatrix::from_iterator(size, size.div_ceil(2), entries);
        let k = DMatrix::from_fn(size, size, |i, j| match i.cmp(&j) {
            std::cmp::Ordering::Less => f64::from(signs[i * size + j]),
            std::cmp::Ordering::Equal => 0.0,
            std::cmp::Ordering::Greater => -f64::from(signs[j * size + i]),
        });
        let d = DMatrix::from_diagonal(&DVector::from_fn(size, |i, _| 2_f64.powi(3 * scales[i])));
        let m = &d * (&f * f.transpose() + k) * &d;
        let lambda = DVector::from_fn(size, |i, _| {
            if parts[i].0 == 0 {
                parts[i].1 / d[(i, i)]
            } else {
                0.0
            }
        });
        let y = DVector::from_fn(size, |i, _| {
            if parts[i].0 == 1 {
                parts[i].1 * d[(i, i)]
            } else {
                0.0
            }
        });
        let q = y - &m * &lambda;
        (m, q, lambda)
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: Some(Box::new(proptest::test_runner::FileFailurePersistence::WithSource("regressions"))), ..ProptestConfig::default() })]

    #[test]
    fn passive_problems_are_solved_to_rounding((m, q, known) in (1..9_usize).prop_flat_map(|size| passive(size, 6))) {
        let solution = Driver::new(m.clone(), TOLERANCE).solve(&q);
        prop_assert_eq!(&solution.status, &Status::Solved);
        prop_assert!(solution.residual < 1e-11, "{}", solution.residual);
        // The symmetric part of Mλ is unique for monotone problems.
        let difference = &solution.lambda - &known;
        let power = difference.dot(&(&m * &difference));
        let scaling = Scaling::of(&m);
        let scale = scaling.apply(&Lcp { m, q }).q.amax();
        prop_assert!(power.abs() <= 1e-9 * scale * scale, "{power}");
    }

    #[test]
    fn the_oracle_agrees((m, q, _) in (1..6_usize).prop_flat_map(|size| passive(size, 3))) {
        let mut driver = Driver::new(m.clone(), TOLERANCE);
        let solution = driver.solve(&q);
        let found = driver.least_norm(&q, &solution);
        let least = found.solution.lambda;
        let lcp = Lcp { m: m.clone(), q };
        let mut all = enumerate::solve(&lcp, 1e-10);
        prop_assert!(!all.is_empty());
        // What solves to fewer digits may lie elsewhere.
        let scaling = Scaling::of(&m);
        all.retain(|l| scaling.residual(&lcp, l, &lcp.y(l)) < 1e-12);
        let both = |l: &DVector<f64>| l.norm().hypot(lcp.y(l).norm());
        let smallest = all.iter().map(both).fold(f64::INFINITY, f64::min);
        // Rounding is that of the equilibrated problem; the least norm is in its own units.
        let d = scaling.d;
        let largest = least.component_div(&d).amax().max(lcp.q.component_mul(&d).amax());
        let rounding = 1e-9 * largest * d.amax().max(1.0 / d.amin());
        prop_assert!(both(&least) <= smallest * (1.0 + 1e-7) + rounding, "{} {smallest}", both(&least));
        let size = |l: &DVector<f64>| l.component_div(&d).norm();
        if found.unique {
            prop_assert!(found.chosen.is_empty());
            for other in &all {
                prop_assert!(size(&(other - &least)) <= 1e-6 * size(&least).max(1e-300), "{other} {least}");
            }
        }
    }

    #[test]
    fn least_norm_solves((m, q, _) in (1..8_usize).prop_flat_map(|size| passive(size, 6))) {
        let mut driver = Driver::new(m.clone(), TOLERANCE);
        let solution = driver.solve(&q);
        let least = driver.least_norm(&q, &solution).solution.lambda;
        let lcp = Lcp { m: m.clone(), q };
        prop_assert!(Scaling::of(&m).residual(&lcp, &least, &lcp.y(&least)) < TOLERANCE);
    }
}

#[test]
fn kernel_of_nothing_is_everything() {
    assert_eq!(norm::kernel(&DMatrix::zeros(2, 2)).ncols(), 2);
}
