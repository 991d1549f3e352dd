//! Sections 2 and 3 without jumps: the linear system as a sweeping process, its set, its one solution, feedthrough.

use std::rc::Rc;

use circ::check::program::Inequalities;
use circ::forms::cone::ConeComplementarity;
use circ::forms::sweeping::SweepingProcess;
use circ::forms::{Complementarity, FormError, Linear, Polyhedron, Signal, constant, integrate};
use circ::passivity::System;
use circ::solve::{Lcp, enumerate};
use nalgebra::{DMatrix, DVector, dmatrix, dvector};

use super::super::{Random, every_solution_of_a_step, filter};
use super::gradient_type;

/// 3(sin 3t), 2(cos 5t): sweeps a set in every direction.
fn swing() -> Signal {
    Rc::new(|t: f64| dvector![3.0 * (3.0 * t).sin(), 2.0 * (5.0 * t).cos()])
}

/// (10)-(15): x' = Ax + Bζ + e with 0 ≤ ζ ⟂ w ≥ 0, the inclusion with N(S(t); z) and the variational inequality are the same at any
/// point: true together, false together. x ∈ K(t) (12) iff Rx ∈ S(t) (14).
/// x' = λ, y = x: a point that a half line pushes.
fn half_line() -> System {
    System {
        a: dmatrix![0.0],
        b: dmatrix![1.0],
        c: dmatrix![1.0],
        d: dmatrix![0.0],
    }
}

#[test]
fn equations_10_to_15_are_the_same_problem() {
    let mut random = Random(10);
    let (mut yes, mut no) = (0, 0);
    for _ in 0..40 {
        let (linear, p) = gradient_type(&mut random, (3, 2), swing());
        let process = SweepingProcess::of(&linear, Some(&p)).unwrap();
        let t = random.next().abs();
        let set = process.set(t);
        let z = set.project(&(random.vector(3) * 4.0)).unwrap().0;
        let x = &process.r_inverse * &z;
        let w = linear.constraint(t, &x);
        assert!(w.min() > -1e-9);
        for outside in [&x * 3.0, random.vector(3) * 3.0] {
            let in_k = linear.constraint(t, &outside).min() >= 0.0;
            assert_eq!(in_k, set.contains(&(&process.r * &outside), 0.0));
        }
        let zeta = random.vector(2);
        let complementary = (0..2).all(|j| zeta[j] >= 0.0 && (zeta[j] == 0.0 || w[j] < 1e-9));
        for (zeta, complementary) in [(zeta.clone(), complementary), (zeta.map(f64::abs), false)] {
            // Only what the active constraints carry is ζ ⟂ w.
            let supported = zeta.map_with_location(|j, _, v| if w[j] < 1e-9 { v } else { 0.0 });
            for (zeta, complementary) in [
                (supported.clone(), supported.min() >= 0.0),
                (zeta, complementary),
            ] {
                let complementary = complementary
                    || zeta.min() >= 0.0 && (0..2).all(|j| zeta[j] == 0.0 || w[j] < 1e-9);
                let velocity = &process.r * (linear.drift(t, &x) + &linear.system.b * &zeta);
                let force = &velocity - process.drift(t, &z).unwrap();
                let off = set.distance_to_normal(&z, &-&force).unwrap();
                let violation = process.violation(t, &z, &velocity).unwrap();
                // The inequality below (15) at many v ∈ S(t).
                let least = (0..40)
                    .map(|_| set.project(&(&z + random.vector(3))).unwrap().0)
                    .map(|v| force.dot(&(v - &z)))
                    .fold(f64::INFINITY, f64::min);
                if complementary {
                    assert!(
                        off < 1e-9 && violation < 1e-9 && least > -1e-9,
                        "{off} {violation} {least}"
                    );
                    yes += usize::from(zeta.amax() > 0.0);
                } else {
                    assert!(off > 1e-4 && violation > 1e-5, "{off} {violation}");
                    no += 1;
                }
            }
        }
    }
    assert!(yes > 20 && no > 40, "{yes} {no}");
}

#[test]
fn equation_9_a_p_matrix_feedthrough_is_a_differential_equation() {
    // Figure 2.1 with the sign of u in w corrected: w = −u/R − z/(RC) + ζ/R ⇒ z' = max(w₀, 0) with w₀ = −u/R − z/(RC).
    let (r, c) = (2.0, 0.5);
    let u = |t: f64| (3.0 * t).sin();
    let system = System {
        a: dmatrix![-1.0 / (r * c)],
        b: dmatrix![1.0 / r],
        c: dmatrix![-1.0 / (r * c)],
        d: dmatrix![1.0 / r],
    };
    let drive: Signal = Rc::new(move |t| dvector![-u(t) / r]);
    let linear = Linear::new(system, drive.clone(), drive).unwrap();
    let steps = 20_000;
    let run = linear.integrate((0.0, 4.0), &dvector![0.0], steps).unwrap();
    // The same by explicit steps of the differential equation (9).
    let (mut z, h) = (0.0_f64, 4.0 / steps as f64);
    for k in 0..steps {
        let t = k as f64 * h;
        z += h * (-u(t) / r - z / (r * c)).max(0.0);
    }
    assert!(z > 0.1, "the diode conducts at some time");
    assert!(
        (run.last().unwrap()[0] - z).abs() < 1e-3,
        "{} {z}",
        run.last().unwrap()[0]
    );
}

#[test]
fn example_3_1_inductor_swept_by_a_current_source() {
    // −x' ∈ N([i(t), ∞); x): x(t) = max(x₀, max over s ≤ t of i(s)).
    let source = |t: f64| (2.0 * t).sin() * (1.0 + t);
    let system = half_line();
    let linear = Linear::new(
        system,
        constant(dvector![0.0]),
        Rc::new(move |t| dvector![-source(t)]),
    )
    .unwrap();
    let process = SweepingProcess::of(&linear, None).unwrap();
    assert!((process.p[(0, 0)] - 1.0).abs() < 1e-12);
    let steps = 1000;
    let run = integrate(&process, (0.0, 6.0), &dvector![0.2], steps).unwrap();
    let mut running = 0.2_f64;
    for k in 1..=steps {
        running = running.max(source(run.t[k]));
        assert!((run.x[k][0] - running).abs() < 1e-9, "t = {}", run.t[k]);
    }
    assert!(running > 1.0);
}

#[test]
fn assumption_1_1_failures_are_reported_with_their_size() {
    let indefinite = System {
        a: dmatrix![0.0],
        b: dmatrix![1.0],
        c: dmatrix![-1.0],
        d: dmatrix![0.0],
    };
    let wrong = SweepingProcess::of(&Linear::autonomous(indefinite.clone()).unwrap(), None);
    assert!(
        matches!(wrong, Err(FormError::Hypothesis { condition: "no P = Pᵀ ≻ 0 with PB = Cᵀ", size, .. }) if size > 1.0)
    );
    let fed = System {
        d: dmatrix![0.5],
        c: dmatrix![1.0],
        ..indefinite
    };
    let wrong = SweepingProcess::of(&Linear::autonomous(fed).unwrap(), None);
    assert!(
        matches!(wrong, Err(FormError::Hypothesis { condition: "D = 0 fails", size, .. }) if size == 0.5)
    );
}

/// The largest 1/σ_min over independent sets of rows: how far {Cx ≥ b} moves at most for a change of b by one (Hoffman; Lemma A.1).
fn hoffman(c: &DMatrix<f64>) -> f64 {
    (1..1_usize << c.nrows())
        .map(|mask| -> Vec<usize> { (0..c.nrows()).filter(|j| mask >> j & 1 == 1).collect() })
        .filter(|rows| rows.len() <= c.ncols())
        .map(|rows| 1.0 / c.select_rows(&rows).singular_values().min())
        .filter(|g| *g < 1e6)
        .fold(0.0, f64::max)
}

/// How far `one` is from `other`, at points of the first near the origin.
fn excess(random: &mut Random, one: &Polyhedron, other: &Polyhedron) -> f64 {
    let n = one.g.ncols();
    (0..30)
        .filter_map(|_| Some(one.project(&(random.vector(n) * 4.0)).ok()?.0))
        .map(|z| (other.project(&z).unwrap().0 - z).norm())
        .fold(0.0, f64::max)
}

/// Proposition 3.2: haus(S(t), S(s)) ≤ γ‖R‖‖Gu(t) − Gu(s)‖ with γ of C alone, for any C (more rows than columns) and any P. The bound is
/// attained where a wedge of two nearly opposite constraints moves.
#[test]
fn proposition_3_2_the_set_moves_no_faster_than_the_input() {
    let mut random = Random(32);
    let mut closest = 0.0_f64;
    for _ in 0..30 {
        // Rows around (1, 0, 0): all of them can be met at once (22).
        let mut cone = random.matrix(4, 3);
        cone.column_mut(0).fill(1.5);
        let root = random.matrix(3, 3) + DMatrix::identity(3, 3) * 2.0;
        let p = &root * root.transpose();
        let system = System {
            a: DMatrix::zeros(3, 3),
            b: p.clone().try_inverse().unwrap() * cone.transpose(),
            c: cone.clone(),
            d: DMatrix::zeros(4, 4),
        };
        let direction = random.vector(4);
        let drive: Signal = Rc::new(move |t| &direction * t.sin());
        let linear = Linear::new(system, constant(DVector::zeros(3)), drive).unwrap();
        let process = SweepingProcess::of(&linear, Some(&p)).unwrap();
        let (s, t) = (random.next(), random.next());
        let moved = ((linear.f)(t) - (linear.f)(s)).norm();
        let bound = hoffman(&cone) * process.r.singular_values().max() * moved;
        let (there, here) = (process.set(t), process.set(s));
        let apart = excess(&mut random, &here, &there).max(excess(&mut random, &there, &here));
        assert!(apart <= bound * (1.0 + 1e-9), "{apart} {bound}");
        // In z the constant of CR⁻¹ itself is enough.
        let own = hoffman(&here.g) * moved;
        assert!(apart <= own * (1.0 + 1e-9) && own <= bound * (1.0 + 1e-9));
        closest = closest.max(apart / own);
    }
    assert!(closest > 0.2, "{closest}");
    // |x₁| ≤ εx₂ + δ: the tip moves by δ/ε, and so does the bound.
    for e in [0.1, 1e-2] {
        let wedge = |d: f64| Polyhedron {
            g: dmatrix![1.0, e; -1.0, e],
            h: dvector![d, d],
        };
        let tip = wedge(1.0).project(&dvector![0.0, -2.0 / e]).unwrap().0;
        let distance = (wedge(0.0).project(&tip).unwrap().0 - tip).norm();
        let bound = hoffman(&wedge(0.0).g) * 2.0_f64.sqrt();
        assert!((distance / bound - 1.0).abs() < 1e-9, "{distance} {bound}");
    }
}

#[test]
fn appendix_a_7_constraint_qualification_without_full_rank() {
    // C = [I; a b] with min{a, b} < 0 has rank 2 < 3 and still fulfils (22); with a, b > 0 it does, too; with the row
    // −(1, 1) replaced so that zᵀC = 0 for some z ≥ 0, z ≠ 0, it does not.
    let qualified = |a: f64, b: f64| {
        let g = dmatrix![1.0, 0.0; 0.0, 1.0; a, b];
        Inequalities {
            g,
            h: DVector::zeros(3),
            strict: vec![true; 3],
        }
        .widest()
        .unwrap()
        .is_strict()
    };
    assert!(qualified(-1.0, 0.5));
    assert!(qualified(1.0, 2.0));
    // The printed condition min{a, b} < 0 alone is not enough: a = b = −1 has z = (1, 1, 1) ≥ 0 with Cᵀz = 0.
    assert!(!qualified(-1.0, -1.0));
}

/// Theorem 3.5: one absolutely continuous solution. Two motions part by exp(βt) at most, β the largest growth of RAR⁻¹; the state of each
/// step is that of every solution of its complementarity problem; an explicit scheme comes to the same motion with order one; and the
/// velocities fulfil (15).
#[test]
fn theorem_3_5_uniqueness_by_contraction_and_absolute_continuity() {
    let mut random = Random(35);
    let mut swept = 0;
    for _ in 0..5 {
        let (linear, p) = gradient_type(&mut random, (3, 2), swing());
        let process = SweepingProcess::of(&linear, Some(&p)).unwrap();
        let steps = 1000;
        let h = 2.0 / steps as f64;
        let start = |random: &mut Random| process.jump(0.0, &random.vector(3)).unwrap();
        let (a, b) = (start(&mut random), start(&mut random));
        let (one, other) = (
            integrate(&process, (0.0, 2.0), &a, steps).unwrap(),
            integrate(&process, (0.0, 2.0), &b, steps).unwrap(),
        );
        let flow = &process.r * &linear.system.a * &process.r_inverse;
        let beta = (&flow + flow.transpose()).symmetric_eigenvalues().max() / 2.0;
        let mut largest = 0.0_f64;
        for k in 1..=steps {
            let gap = |k: usize| (&one.x[k] - &other.x[k]).norm();
            assert!(gap(k) <= gap(k - 1) / (1.0 - beta * h) * (1.0 + 1e-9) + 1e-12);
            assert!(process.set(one.t[k]).contains(&one.x[k], 1e-9));
            let velocity = (&one.x[k] - &one.x[k - 1]) / h;
            assert!(process.violation(one.t[k], &one.x[k], &velocity).unwrap() < 1e-9);
            largest = largest.max(velocity.norm());
        }
        assert!(largest < 20.0, "{largest}");
        swept += usize::from(one.lambda.iter().any(|l| l.amax() > 0.0));
        for k in (1..steps).step_by(50) {
            let found = every_solution_of_a_step(&process, one.t[k - 1], &one.x[k - 1], h);
            assert!(!found.is_empty());
            assert!(found.iter().all(|(z, _)| (z - &one.x[k]).norm() < 1e-8));
        }
        // Moreau's catching up, explicit in the drift.
        let distance = |steps: usize| {
            let h = 2.0 / steps as f64;
            let implicit = integrate(&process, (0.0, 2.0), &a, steps).unwrap();
            let (mut z, mut worst) = (a.clone(), 0.0_f64);
            for k in 0..steps {
                z = process.catch_up(k as f64 * h, &z, h).unwrap();
                worst = worst.max((&z - &implicit.x[k + 1]).norm());
            }
            worst
        };
        let (d1, d2) = (distance(500), distance(1000));
        assert!(d2 < 0.05 && (1.7..2.3).contains(&(d1 / d2)), "{d1} {d2}");
    }
    assert!(swept >= 3);
}

/// Remark 3.6: of Eu nothing is asked but that it is integrable. x' = e + ζ, x ≥ i(t) with e = ±1/(2√|t − s|) has the solution
/// x = E + max(x₀, max of i − E) (Skorokhod), E = ∫e; the steps come to it with order ½.
#[test]
fn remark_3_6_an_integrable_drift() {
    let s = std::f64::consts::FRAC_1_SQRT_2;
    let e = move |t: f64| -0.5 / (t - s).abs().max(1e-300).sqrt();
    let integral = move |t: f64| -s.sqrt() - (t - s).signum() * (t - s).abs().sqrt();
    let floor = |t: f64| 0.5 * (4.0 * t).sin();
    let system = half_line();
    let linear = Linear::new(
        system,
        Rc::new(move |t| dvector![e(t)]),
        Rc::new(move |t| dvector![-floor(t)]),
    )
    .unwrap();
    let process = SweepingProcess::of(&linear, None).unwrap();
    let error = |steps: usize| {
        let run = integrate(&process, (0.0, 2.0), &dvector![0.3], steps).unwrap();
        let (mut pushed, mut worst) = (0.3_f64, 0.0_f64);
        for k in 1..=steps {
            // The maximum between grid points is second order.
            pushed = pushed.max(floor(run.t[k]) - integral(run.t[k]));
            worst = worst.max((run.x[k][0] - integral(run.t[k]) - pushed).abs());
        }
        assert!(run.lambda.iter().any(|l| l[0] > 0.1));
        worst
    };
    let (e1, e2) = (error(2000), error(32_000));
    assert!(e2 < 2e-2 && e2 < 0.5 * e1, "{e1} {e2}");
}

/// Section 3.3, (27)-(30): D = diag(D₁, 0) with D₁ a P-matrix, here neither symmetric nor positive semidefinite. ζ₁ is the one solution
/// of its problem, and the sweeping process (30) and the complementarity system have the same motion.
#[test]
fn section_3_3_block_feedthrough_is_a_sweeping_process() {
    let mut random = Random(303);
    let d1 = dmatrix![0.7, 2.5; -0.1, 0.6];
    assert!((&d1 + d1.transpose()).symmetric_eigenvalues().min() < -0.5);
    for _ in 0..5 {
        let drive = constant(dvector![-0.3, 0.2, 0.1, 0.3]);
        let (linear, p) = gradient_type(&mut random, (3, 4), drive);
        let mut system = linear.system.clone();
        // Ports 0 and 1 get D₁ and gains of their own; ports 2, 3 keep PB = Cᵀ.
        system.d.view_mut((0, 0), (2, 2)).copy_from(&d1);
        system.b.columns_mut(0, 2).copy_from(&random.matrix(3, 2));
        let linear = Linear::new(system, linear.e, linear.f).unwrap();
        let process = SweepingProcess::with_feedthrough(&linear, Some(&p)).unwrap();
        assert_eq!(
            (process.fed.clone(), process.free.clone()),
            (vec![0, 1], vec![2, 3])
        );
        for _ in 0..10 {
            let x = random.vector(3) * 2.0;
            let q = (linear.constraint(0.0, &x)).rows(0, 2).into_owned();
            let all = enumerate::solve(&Lcp { m: d1.clone(), q }, 1e-12);
            assert_eq!(all.len(), 1);
            assert!((process.zeta(0.0, &x).unwrap() - &all[0]).norm() < 1e-9);
        }
        let start = process.jump(0.0, &(random.vector(3) * 2.0)).unwrap();
        let distance = |steps: usize| {
            let x0 = &process.r_inverse * &start;
            let implicit = linear.integrate((0.0, 1.0), &x0, steps).unwrap();
            let (mut z, mut worst) = (start.clone(), 0.0_f64);
            for k in 0..steps {
                let h = 1.0 / steps as f64;
                z = process.catch_up(k as f64 * h, &z, h).unwrap();
                worst = worst.max((&process.r_inverse * &z - &implicit.x[k + 1]).norm());
            }
            worst
        };
        let (d1, d2) = (distance(500), distance(1000));
        assert!(d2 < 2e-2 && (1.7..2.3).contains(&(d1 / d2)), "{d1} {d2}");
    }
    // D₁ must be a P-matrix.
    let system = System {
        a: dmatrix![0.0],
        b: dmatrix![1.0],
        c: dmatrix![1.0],
        d: dmatrix![-1.0],
    };
    assert!(SweepingProcess::with_feedthrough(&Linear::autonomous(system).unwrap(), None).is_err());
}

/// Lemma 3.8: (5) is the cone complementarity system (31), whose cones are dual.
#[test]
fn lemma_3_8_cone_complementarity_of_a_singular_feedthrough() {
    let mut random = Random(38);
    let linear = Linear::autonomous(filter()).unwrap();
    let cone = ConeComplementarity::orthogonal(&linear).unwrap();
    assert_eq!(cone.rank, 2);
    assert!((&cone.v * &cone.d_bar * cone.v.transpose() - &linear.system.d).amax() < 1e-12);
    // Solutions of the steps of (5) solve (31), and back.
    let run = linear.integrate((0.0, 1e-3), &dvector![-3.0], 20).unwrap();
    for k in 1..run.t.len() {
        let (zeta, w) = cone.variables(&run.lambda[k], &run.y[k]);
        assert!(
            cone.violation(run.t[k], &run.x[k], &zeta, &w) < 1e-9 * (1.0 + run.lambda[k].amax())
        );
        let (lambda, y) = cone.original(&zeta, &w);
        assert!((lambda - &run.lambda[k]).amax() < 1e-9 && (y - &run.y[k]).amax() < 1e-9);
    }
    // The two cones are dual: ⟨ζ̄, w̄⟩ ≥ 0 for members, and what is outside of one makes less than 0 with a member of the other.
    for _ in 0..50 {
        let (lambda, y) = (random.vector(4), random.vector(4).map(f64::abs));
        let (zeta, w) = cone.variables(&lambda, &y);
        let (members, _) = cone.variables(&lambda.map(f64::abs), &y);
        assert!(members.dot(&w) >= -1e-12);
        let worst = lambda.imin();
        if lambda[worst] < 0.0 {
            let unit = DVector::from_fn(4, |j, _| if j == worst { 1.0 } else { 0.0 });
            assert!(zeta.dot(&cone.variables(&lambda, &unit).1) < 0.0);
        }
    }
    // Each part of (31) by itself. At x = 0 y = Dλ is orthogonal to λ for skew D: only the cones are left to be violated.
    for _ in 0..20 {
        let lambda = random.vector(4);
        let y = &linear.system.d * &lambda;
        let (zeta, w) = cone.variables(&lambda, &y);
        let outside = (-lambda.min()).max(-y.min()).max(0.0);
        let found = cone.violation(0.0, &dvector![0.0], &zeta, &w);
        assert!((found - outside).abs() < 1e-12, "{found} {outside}");
    }
    // λ = e₁ at x > 0: in the cones, y = Cx + Dλ ≥ 0, and λᵀy = x.
    let x = dvector![0.4];
    let lambda = dvector![1.0, 0.0, 0.0, 0.0];
    let y = &linear.system.c * &x + &linear.system.d * &lambda;
    let (zeta, w) = cone.variables(&lambda, &y);
    assert!(y.min() >= 0.0 && (cone.violation(0.0, &x, &zeta, &w) - 0.4).abs() < 1e-12);
    // The equation: w off by something.
    let aside = &w + dvector![0.0, 0.3, 0.0, 0.0];
    assert!(cone.violation(0.0, &x, &zeta, &aside) > 0.2);
    // Driven systems with symmetric D of rank one: (31) along their motions, with both kinds of variables in contact.
    let mut contacts = [0, 0];
    for _ in 0..5 {
        let drive: Signal = Rc::new(|t: f64| dvector![(3.0 * t).sin(), (5.0 * t).cos(), -0.2]);
        let (linear, _) = gradient_type(&mut random, (3, 3), drive);
        let w = random.vector(3);
        let mut system = linear.system.clone();
        system.d = &w * w.transpose();
        let linear = Linear::new(system, linear.e, linear.f).unwrap();
        let cone = ConeComplementarity::orthogonal(&linear).unwrap();
        assert_eq!(cone.rank, 1);
        let run = linear
            .integrate((0.0, 2.0), &random.vector(3), 100)
            .unwrap();
        for k in 1..=100 {
            let (zeta, w) = cone.variables(&run.lambda[k], &run.y[k]);
            let size = 1.0 + run.lambda[k].amax() * (1.0 + run.y[k].amax());
            assert!(cone.violation(run.t[k], &run.x[k], &zeta, &w) < 1e-8 * size);
            contacts[0] += usize::from(run.lambda[k].amax() > 1e-3);
            contacts[1] += usize::from(run.y[k].amax() > 1e-3);
        }
    }
    assert!(contacts.iter().all(|&c| c > 100), "{contacts:?}");
    // A V that does not block-diagonalise D is refused.
    assert!(ConeComplementarity::with(&linear, &DMatrix::identity(4, 4)).is_err());
}
