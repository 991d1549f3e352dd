//! Section 3.1 and 3.2: systems with one solution (Theorems 1 and 2, their corollaries and remarks), transformed systems, the order of steps.

use circ::forms::inequality::VariationalInequality;
use circ::forms::lure::{Lure, Phi};
use circ::forms::projected::Map;
use circ::forms::sweeping::SweepingProcess;
use circ::forms::unilateral::Unilateral;
use circ::forms::{Linear, constant, integrate};
use circ::passivity::{self, Origin, System};
use nalgebra::{DMatrix, DVector, dmatrix, dvector};

use super::super::reference::Projected;
use super::super::{C, L, R, Random, bridge, energy, every_solution_of_a_step, filter};
use super::figure_2;

/// Figure 2 with constant sources in its meshes, and the inequality (17) that it is.
fn fed_figure_2() -> (Lure, VariationalInequality, DMatrix<f64>) {
    let (system, p) = figure_2();
    let sources = constant(dvector![0.3, -0.2, 0.0]);
    let linear = Linear::new(system, sources, constant(DVector::zeros(2))).unwrap();
    let lure = Lure::new(linear, vec![Phi::HalfLine, Phi::HalfLine]).unwrap();
    let inequality = VariationalInequality::of(&lure, Some(&p)).unwrap();
    (lure, inequality, p)
}

/// (17), section 3.1.4: the implicit steps on Figure 2 fulfil the variational inequality at every test point of dom Ξ, to rounding.
#[test]
fn section_3_1_4_theorem_1_on_the_circuit_of_figure_2() {
    let (lure, inequality, p) = fed_figure_2();
    let verdict = passivity::decide(&lure.linear.system, Some(&p));
    assert_eq!(
        verdict.certificate().map(|c| c.from),
        Some(Origin::StoredEnergy)
    );
    assert_eq!(
        (&inequality.multivalued[..], &inequality.single[..]),
        (&[0][..], &[1][..])
    );
    let steps = 1000;
    let h = 4.0 / steps as f64;
    let run = lure
        .integrate((0.0, 4.0), &dvector![0.5, 1.0, 0.4], steps)
        .unwrap();
    let mut random = Random(17);
    let mut active = [0, 0];
    for k in (1..=steps).step_by(3) {
        let z = &inequality.v * &run.x[k];
        let velocity = &inequality.v * (&run.x[k] - &run.x[k - 1]) / h;
        for _ in 0..5 {
            let mut x = random.vector(3);
            x[2] = x[2].abs();
            let left = inequality
                .left_side(run.t[k], &z, &velocity, &(&inequality.v * x), 1e-9)
                .unwrap();
            assert!(left >= -1e-9, "{left}");
        }
        for (count, lambda) in active.iter_mut().zip(run.lambda[k].iter()) {
            *count += usize::from(*lambda > 1e-6);
        }
    }
    assert!(active[0] > 5 && active[1] > 5, "{active:?}");
    // A velocity that is wrong by any δ violates it, at the test point on its other side.
    for k in [200, 600, 1000] {
        let z = &inequality.v * &run.x[k];
        for _ in 0..10 {
            let off = random.vector(3) * 1e-3;
            let velocity = inequality.drift(run.t[k], &z).unwrap() + &off;
            let aside = &z - &off;
            if inequality.xi(run.t[k], &aside, 0.0).is_finite() && run.x[k][2] > 1e-3 {
                let left = inequality
                    .left_side(run.t[k], &z, &velocity, &aside, 1e-9)
                    .unwrap();
                assert!(left < -0.5 * off.norm_squared(), "{left}");
            }
        }
    }
    // Assumption 4 is checked: the bridge has p_I = 0 and D neither definite nor a P-matrix.
    let other = Lure::new(
        Linear::autonomous(bridge()).unwrap(),
        vec![Phi::HalfLine; 4],
    )
    .unwrap();
    assert!(VariationalInequality::of(&other, None).is_err());
}

/// A mass on a spring, x₁' = x₂, x₂' = −x₁ + λ, y = x₂, with dry friction of ½.
fn mass_with_friction() -> (System, Phi) {
    let system = System {
        a: dmatrix![0.0, 1.0; -1.0, 0.0],
        b: dmatrix![0.0; 1.0],
        c: dmatrix![0.0, 1.0],
        d: dmatrix![0.0],
    };
    (system, Phi::Relay { gain: 0.5 })
}

/// (17) with a φ that is no indicator function: Ξ(v) − Ξ(X) counts. A mass on a spring with dry friction of ½; the force of friction the
/// other way round violates it.
#[test]
fn equation_17_with_friction() {
    let (system, friction) = mass_with_friction();
    let lure = Lure::new(Linear::autonomous(system.clone()).unwrap(), vec![friction]).unwrap();
    let inequality = VariationalInequality::of(&lure, None).unwrap();
    assert!((&inequality.v - DMatrix::identity(2, 2)).amax() < 1e-12);
    let (steps, h) = (600, 0.02);
    let run = lure
        .integrate((0.0, 12.0), &dvector![3.3, 0.0], steps)
        .unwrap();
    let mut random = Random(170);
    let mut refused = 0;
    for k in 1..=steps {
        let x = &run.x[k];
        let velocity = (x - &run.x[k - 1]) / h;
        let reversed = &velocity - &system.b * &run.lambda[k] * 2.0;
        for _ in 0..5 {
            let v = x + random.vector(2);
            let left = |velocity: &DVector<f64>| {
                inequality
                    .left_side(run.t[k], x, velocity, &v, 0.0)
                    .unwrap()
            };
            assert!(left(&velocity) >= -1e-9);
            refused += usize::from(left(&reversed) < -1e-3);
        }
    }
    assert!(refused > steps, "{refused}");
}

/// Remark 2: X ∈ Dom(∂Ξ) iff C_I x ∈ Dom(∂Φ_I): Ξ is finite where y_I ≥ 0.
#[test]
fn remark_2_the_domain_in_x() {
    let (_, inequality, _) = fed_figure_2();
    let mut random = Random(2);
    for _ in 0..50 {
        let x = random.vector(3);
        let finite = inequality.xi(0.0, &(&inequality.v * &x), 0.0).is_finite();
        assert_eq!(finite, x[2] >= 0.0);
    }
}

/// Theorem 1 and Corollaries 2 (p_I = p) and 3 (p_II = p): one solution. Every solution of every step's problem leads to the same state,
/// the explicit scheme of the form comes to the same motion with order one, and neighbours part no faster than the drift allows.
#[test]
fn theorem_1_and_corollaries_2_and_3_solutions_are_unique() {
    let (mixed, _) = figure_2();
    let free = System {
        a: mixed.a.clone(),
        b: dmatrix![0.0; 0.0; 2.0],
        c: dmatrix![0.0, 0.0, 1.0],
        d: dmatrix![0.0],
    };
    let fed = System {
        a: mixed.a.clone(),
        b: dmatrix![0.5; 0.0; 0.0],
        c: dmatrix![-2.0, 1.0, 0.0],
        d: dmatrix![0.5],
    };
    let start = dvector![0.6, -0.8, 0.5];
    for (system, energy) in [(free, None), (mixed, Some(figure_2().1)), (fed, None)] {
        let sources = constant(dvector![0.6, -0.5, -6.0]);
        let zero = constant(DVector::zeros(system.m()));
        let linear = Linear::new(system.clone(), sources, zero).unwrap();
        let phi = vec![Phi::HalfLine; system.m()];
        let lure = Lure::new(linear.clone(), phi).unwrap();
        let inequality = VariationalInequality::of(&lure, energy.as_ref()).unwrap();
        // z⁺ = nearest point of dom Ξ to z + h(VAV⁻¹z + Λ(z)): explicit in the drift.
        let process = SweepingProcess::with_feedthrough(&linear, energy.as_ref()).unwrap();
        let distance = |steps: usize| {
            let h = 2.0 / steps as f64;
            let run = linear.integrate((0.0, 2.0), &start, steps).unwrap();
            let (mut z, mut worst) = (&process.r * &start, 0.0_f64);
            for k in 0..steps {
                let drift = inequality.drift(run.t[k], &(&inequality.v * &process.r_inverse * &z));
                let x_dot = &inequality.v_inverse * drift.unwrap();
                z = process
                    .jump(run.t[k + 1], &(&z + &process.r * x_dot * h))
                    .unwrap();
                worst = worst.max((&process.r_inverse * &z - &run.x[k + 1]).norm());
            }
            worst
        };
        let (d1, d2) = (distance(400), distance(800));
        assert!(d2 < 2e-2 && (1.8..2.2).contains(&(d1 / d2)), "{d1} {d2}");
        let run = linear.integrate((0.0, 2.0), &start, 200).unwrap();
        assert!((0..system.m()).all(|j| run.lambda.iter().any(|l| l[j] > 1e-2)));
        for k in (1..200).step_by(5) {
            let found = every_solution_of_a_step(&linear, run.t[k - 1], &run.x[k - 1], 1e-2);
            assert!(!found.is_empty());
            assert!(found.iter().all(|(x, _)| (x - &run.x[k]).norm() < 1e-9));
        }
    }
}

/// Remarks 1, 3, 4 and 5: with rank B = p λ is unique and given by Bλ = x' − Ax − f; with two diodes in parallel (rank 1) it is not, while Bλ,
/// x and y are; with a single-valued operator λ is its value.
#[test]
fn remarks_3_to_5_uniqueness_of_lambda_and_y() {
    let mut random = Random(35);
    let h = 1e-2;
    for twice in [false, true] {
        let b = random.matrix(3, 2);
        let b = if twice {
            DMatrix::from_columns(&[b.column(0), b.column(0)])
        } else {
            b
        };
        let system = System {
            a: random.matrix(3, 3),
            c: b.transpose(),
            b: b.clone(),
            d: DMatrix::zeros(2, 2),
        };
        let pull = constant(-(&b * dvector![1.0, 1.0]) * 2.0);
        let linear =
            Linear::new(system.clone(), pull.clone(), constant(DVector::zeros(2))).unwrap();
        let run = linear
            .integrate((0.0, 1.0), &DVector::zeros(3), 100)
            .unwrap();
        let mut choices = 0;
        for k in 1..=100 {
            let forced = (&run.x[k] - &run.x[k - 1]) / h - &system.a * &run.x[k] - pull(run.t[k]);
            assert!((&b * &run.lambda[k] - &forced).norm() < 1e-9);
            if !twice {
                let inverse = (b.transpose() * &b).try_inverse().unwrap() * b.transpose();
                assert!((inverse * &forced - &run.lambda[k]).norm() < 1e-8);
            }
            let found = every_solution_of_a_step(&linear, run.t[k - 1], &run.x[k - 1], h);
            for (x, lambda) in &found {
                assert!((x - &run.x[k]).norm() < 1e-9);
                assert!((&b * (lambda - &run.lambda[k])).norm() < 1e-8);
                choices += usize::from((lambda - &run.lambda[k]).norm() > 1e-6);
            }
        }
        assert_eq!(choices > 0, twice, "{choices}");
        assert!(run.lambda.iter().any(|l| l.amax() > 0.5));
    }
    // Remark 5.
    let (lure, inequality, _) = fed_figure_2();
    let run = lure
        .integrate((0.0, 1.0), &dvector![0.5, 1.0, 0.4], 100)
        .unwrap();
    for k in 1..=100 {
        let lambda = inequality.lambda(run.t[k], &run.x[k]).unwrap();
        assert!((lambda[0] - run.lambda[k][1]).abs() < 1e-9);
    }
}

/// (3), (4): λ ∈ −M∂Φ(y) is the system with BM, DM and λ̄ = M⁻¹λ. Relays of gain one behind M = diag(2, ½) are relays of those gains.
#[test]
fn equations_3_and_4_multipliers_behind_a_matrix() {
    let mut random = Random(34);
    for _ in 0..5 {
        let gains = dmatrix![2.0, 0.0; 0.0, 0.5];
        let b = random.matrix(3, 2);
        let system = System {
            a: random.matrix(3, 3),
            c: b.transpose(),
            b: b.clone(),
            d: DMatrix::identity(2, 2) * 0.3,
        };
        let behind = System {
            b: &b * &gains,
            d: &system.d * &gains,
            ..system.clone()
        };
        let run = |system: System, gains: [f64; 2]| {
            let phi = gains.map(|gain| Phi::Relay { gain }).to_vec();
            let lure = Lure::new(Linear::autonomous(system).unwrap(), phi).unwrap();
            lure.integrate((0.0, 2.0), &dvector![1.0, -0.5, 0.7], 100)
                .unwrap()
        };
        let (one, other) = (run(system, [2.0, 0.5]), run(behind, [1.0, 1.0]));
        for k in 1..=100 {
            assert!((&one.x[k] - &other.x[k]).norm() < 1e-9);
            assert!((&one.lambda[k] - &gains * &other.lambda[k]).norm() < 1e-8);
        }
        assert!(one.lambda.iter().any(|l| l[0].abs() > 1.0));
    }
}

/// Section 2, last paragraph: Ax may be a Lipschitz A(x). A pendulum whose velocity a diode holds above −½, against its motion mode by mode.
#[test]
fn a_lipschitz_drift_in_place_of_ax() {
    let pendulum = |x: &DVector<f64>| dvector![x[1], -2.0 * x[0].sin() - 0.1 * x[1]];
    let field = Map::new(
        move |x| -pendulum(x),
        |x| dmatrix![0.0, -1.0; 2.0 * x[0].cos(), 0.1],
    );
    let floor = Map::affine(dmatrix![0.0, -1.0], dvector![-0.5]);
    let system = Unilateral::new(field, constant(DVector::zeros(2)), &floor, 2).unwrap();
    let start = dvector![2.0, 0.0];
    let v = |_: f64, x: &DVector<f64>| pendulum(x);
    let flow = Projected {
        v: &v,
        c: &|x| dvector![x[1] + 0.5],
        g: &|_| dmatrix![0.0, 1.0],
    };
    let exact = flow.integrate(&start, 6.0, 1600);
    assert!(exact.events.len() >= 2);
    let error = |steps: usize| {
        let run = integrate(&system, (0.0, 6.0), &start, steps).unwrap();
        (0..=steps)
            .map(|k| (&run.x[k] - &exact.x[k * 1600 / steps]).norm())
            .fold(0.0, f64::max)
    };
    let (e1, e2) = (error(800), error(1600));
    assert!(e2 < 2e-2 && (1.8..2.2).contains(&(e1 / e2)), "{e1} {e2}");
}

/// Theorem 2: one Lipschitz solution; two of them never part in the metric P, and all solutions of a step lead to the same state. With a
/// constant E in y as well.
#[test]
fn theorem_2_bridges_have_one_lipschitz_solution() {
    for (system, p, x0, end) in [
        (
            bridge(),
            DMatrix::from_diagonal(&dvector![C, L]),
            dvector![10.0, 0.0],
            1e-3,
        ),
        (filter(), dmatrix![C], dvector![5.0], 1e-3),
    ] {
        let verdict = passivity::decide(&system, Some(&p));
        assert_eq!(verdict.answer(), Some(true));
        assert!((&p * &system.b - system.c.transpose()).amax() < 1e-15);
        let linear = Linear::autonomous(system).unwrap();
        let run = |steps| linear.integrate((0.0, end), &x0, steps).unwrap();
        let (coarse, fine) = (run(2000), run(4000));
        let gap = |k: usize| energy(&p, &(&coarse.x[k] - &fine.x[2 * k]));
        let size = energy(&p, &x0);
        assert!((0..=2000).all(|k| gap(k) < 1e-2 * size));
        // Lipschitz: the increments shrink with the step.
        let largest = |t: &circ::forms::Trajectory| {
            t.x.windows(2)
                .map(|w| energy(&p, &(&w[1] - &w[0])))
                .fold(0.0, f64::max)
                .sqrt()
        };
        assert!(largest(&fine) < 0.6 * largest(&coarse));
        // Other starts, other solutions of the step, and constants in y (forward drops).
        for drop in [0.0, 0.7] {
            let m = linear.system.m();
            let f = constant(DVector::from_element(m, drop));
            let n = linear.system.n();
            let linear =
                Linear::new(linear.system.clone(), constant(DVector::zeros(n)), f).unwrap();
            let near = &x0 * 0.8;
            let run = |x: &DVector<f64>| linear.integrate((0.0, end), x, 200).unwrap();
            let (one, other) = (run(&x0), run(&near));
            let gap = |k: usize| energy(&p, &(&one.x[k] - &other.x[k]));
            for k in 1..=200 {
                assert!(gap(k) <= gap(k - 1) * (1.0 + 1e-9));
            }
            for k in (1..200).step_by(10) {
                let found =
                    every_solution_of_a_step(&linear, one.t[k - 1], &one.x[k - 1], end / 200.0);
                assert!(!found.is_empty());
                assert!(
                    found
                        .iter()
                        .all(|(x, _)| (x - &one.x[k]).norm() < 1e-7 * x0.norm())
                );
            }
        }
    }
}

/// Remark 6: P ≻ 0 with PB = Cᵀ exists only where CB is symmetric positive semidefinite (and vanishes where B does). The search for P finds
/// one for such C, and none for C made unsymmetric or indefinite; with D = 0, p = 1 the relative degree is one: CB > 0.
#[test]
fn remark_6_markov_parameter_is_symmetric_semidefinite() {
    let mut random = Random(6);
    for _ in 0..20 {
        let b = random.matrix(4, 3);
        let root = random.matrix(3, 3);
        // C = S(BᵀB)⁻¹Bᵀ has CB = S, for S of any kind.
        let left = (b.transpose() * &b).try_inverse().unwrap() * b.transpose();
        let with_markov = |s: &DMatrix<f64>| passivity::gradient::storage(&b, &(s * &left), None);
        let s = &root * root.transpose() + DMatrix::identity(3, 3) * 0.1;
        let p = with_markov(&s).expect("CB ≻ 0");
        assert!(p.clone().cholesky().is_some());
        assert!((&p * &b - (&s * &left).transpose()).amax() < 1e-8 * p.amax());
        // A candidate counts if it fits, and not otherwise.
        let among = |candidate: &DMatrix<f64>| {
            passivity::gradient::storage(&b, &(&s * &left), Some(candidate)).expect("CB ≻ 0")
        };
        assert_eq!(among(&p), p);
        let other = among(&DMatrix::identity(4, 4));
        assert!((&other * &b - (&s * &left).transpose()).amax() < 1e-8 * other.amax());
        let mut skewed = s.clone();
        skewed[(0, 1)] += 0.05;
        assert!(with_markov(&skewed).is_none());
        let least = s.clone().symmetric_eigenvalues().min();
        let indefinite = &s - DMatrix::identity(3, 3) * (least + 0.05);
        assert!(with_markov(&indefinite).is_none());
    }
    for (cb, exists) in [(1.0, true), (1e-6, true), (0.0, false), (-1.0, false)] {
        let (b, c) = (dmatrix![1.0; 0.0], dmatrix![cb, 1.0]);
        assert_eq!(
            passivity::gradient::storage(&b, &c, None).is_some(),
            exists,
            "CB = {cb}"
        );
    }
}

/// Remark 7: order one where all φ are indicator functions, here on the bridge (36), a parallel RLC for its tank.
#[test]
fn remark_7_order_one_for_complementary_pairs() {
    // The bridge (36) is a parallel RLC for the tank: v = 10 e^{−at}(cos wt − (a/w) sin wt), a = 1/(2RC).
    let linear = Linear::autonomous(bridge()).unwrap();
    let (a, end) = (1.0 / (2.0 * R * C), 2e-4);
    let w = (1.0 / (L * C) - a * a).sqrt();
    let exact = 10.0 * (-a * end).exp() * ((w * end).cos() - a / w * (w * end).sin());
    let error = |steps| {
        let run = linear
            .integrate((0.0, end), &dvector![10.0, 0.0], steps)
            .unwrap();
        (run.last().unwrap()[0] - exact).abs()
    };
    let (e1, e2, e3) = (error(500), error(1000), error(2000));
    for ratio in [e1 / e2, e2 / e3] {
        assert!((1.9..2.1).contains(&ratio), "order one: {e1} {e2} {e3}");
    }
}

/// Remark 7: order ½ at least for other φ. A mass on a spring with dry friction, x₁' = x₂, x₂' = −x₁ + λ, −λ ∈ ½ Sgn(x₂): half swings around
/// ±½, each shorter by one, until it sticks at −0.3. The error of implicit steps is visible all the way and falls by more than
/// √4 = 2 for a quarter of the step.
#[test]
fn remark_7_order_of_implicit_euler_with_friction() {
    let (system, friction) = mass_with_friction();
    let mass = Lure::new(Linear::autonomous(system).unwrap(), vec![friction]).unwrap();
    let exact = |t: f64| {
        let half = (t / std::f64::consts::PI).floor();
        if half >= 3.0 {
            return dvector![-0.3, 0.0];
        }
        let side = if half as i32 % 2 == 0 { 1.0 } else { -1.0 };
        let (size, phase) = (3.3 - half - 0.5, t - half * std::f64::consts::PI);
        dvector![
            side * (0.5 + size * phase.cos()),
            -side * size * phase.sin()
        ]
    };
    let error = |steps: usize| {
        let run = mass
            .integrate((0.0, 12.0), &dvector![3.3, 0.0], steps)
            .unwrap();
        for k in 1..=steps {
            assert!(friction.relates(run.lambda[k][0], run.y[k][0], 1e-9));
        }
        // Sticking, the friction balances the spring.
        assert!(run.y[steps][0].abs() < 1e-9);
        assert!((run.lambda[steps][0] - run.x[steps][0]).abs() < 1e-9);
        let gap = |(t, x): (&f64, &DVector<f64>)| (x - exact(*t)).norm();
        run.t.iter().zip(&run.x).map(gap).fold(0.0, f64::max)
    };
    let (e1, e2) = (error(3000), error(12_000));
    assert!(e1 > 1e-3 && e2 > 1e-4, "the error is visible: {e1} {e2}");
    assert!(e1 / e2 > 2.0, "order ½ at least: {e1} {e2}");
    assert!(
        (3.0..5.0).contains(&(e1 / e2)),
        "order one is attained here: {e1} {e2}"
    );
}
