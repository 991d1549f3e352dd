//! Brogliato, Thibault 2010: existence and uniqueness for non-autonomous complementarity dynamical systems.

use std::rc::Rc;

use circ::check::program::Inequalities;
use circ::forms::cone::ConeComplementarity;
use circ::forms::nonlinear::NonlinearComplementarity;
use circ::forms::projected::Map;
use circ::forms::sweeping::SweepingProcess;
use circ::forms::{FormError, Linear, Signal, constant, integrate, step};
use circ::passivity::System;
use nalgebra::{DMatrix, DVector, dmatrix, dvector};

use super::{C, Random, energy, filter};

/// A random system with D = 0 and PB = Cᵀ, P not the identity, with the driven term f(t).
fn gradient_type(random: &mut Random, (n, m): (usize, usize), f: Signal) -> (Linear, DMatrix<f64>) {
    let root = random.matrix(n, n) + DMatrix::identity(n, n) * 2.0;
    let p = &root * root.transpose();
    let b = random.matrix(n, m);
    let system = System {
        a: random.matrix(n, n),
        c: b.transpose() * &p,
        b,
        d: DMatrix::zeros(m, m),
    };
    (
        Linear::new(system, constant(random.vector(n)), f).unwrap(),
        p,
    )
}

/// ⌊2t⌋ odd: the square wave of period one.
fn square(t: f64) -> f64 {
    f64::from((2.0 * t).floor() as i64 % 2 != 0)
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
    let system = System {
        a: dmatrix![0.0],
        b: dmatrix![1.0],
        c: dmatrix![1.0],
        d: dmatrix![0.0],
    };
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

#[test]
fn proposition_3_2_the_set_moves_no_faster_than_the_input() {
    // haus(S(t), S(s)) ≤ γ‖R‖‖Gu(t) − Gu(s)‖; for C with orthonormal rows γ = 1.
    let mut random = Random(32);
    for _ in 0..20 {
        let q = random.matrix(4, 4).qr().q();
        let system = System {
            a: DMatrix::zeros(4, 4),
            b: q.rows(0, 3).transpose(),
            c: q.rows(0, 3).into_owned(),
            d: DMatrix::zeros(3, 3),
        };
        let direction = random.vector(3);
        let linear = Linear::new(
            system,
            constant(DVector::zeros(4)),
            Rc::new(move |t| &direction * t.sin()),
        )
        .unwrap();
        let process = SweepingProcess::of(&linear, None).unwrap();
        let (s, t) = (random.next(), random.next());
        let moved = ((linear.f)(t) - (linear.f)(s)).norm();
        for _ in 0..10 {
            let point = process.jump(s, &(random.vector(4) * 3.0)).unwrap();
            let distance = (process.jump(t, &point).unwrap() - &point).norm();
            assert!(distance <= moved * (1.0 + 1e-9) + 1e-12);
        }
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

#[test]
fn theorem_3_5_uniqueness_by_contraction_and_absolute_continuity() {
    let mut random = Random(35);
    let mut swept = 0;
    for _ in 0..5 {
        let drive: Signal =
            Rc::new(|t: f64| dvector![3.0 * (3.0 * t).sin(), 2.0 * (5.0 * t).cos()]);
        let (linear, p) = gradient_type(&mut random, (3, 2), drive);
        let process = SweepingProcess::of(&linear, Some(&p)).unwrap();
        let steps = 2000;
        let h = 2.0 / steps as f64;
        let start = |random: &mut Random| process.jump(0.0, &random.vector(3)).unwrap();
        let (a, b) = (start(&mut random), start(&mut random));
        let (one, other) = (
            integrate(&process, (0.0, 2.0), &a, steps).unwrap(),
            integrate(&process, (0.0, 2.0), &b, steps).unwrap(),
        );
        // |z₁ − z₂|² ≤ exp(2βt)|z₁(0) − z₂(0)|² with β = ‖RAR⁻¹‖: one solution from each start.
        let beta = (&process.r * &linear.system.a * &process.r_inverse).norm();
        for k in 0..=steps {
            let grown = (1.0 / (1.0 - beta * h)).powi(k as i32);
            assert!((&one.x[k] - &other.x[k]).norm() <= grown * (&a - &b).norm() * (1.0 + 1e-9));
            assert!(process.set(one.t[k]).contains(&one.x[k], 1e-9));
        }
        // No jumps: the steps shrink with h. And (15) holds: the velocity violates the inequality by O(h).
        for k in 1..=steps {
            let velocity = (&one.x[k] - &one.x[k - 1]) / h;
            assert!(velocity.norm() < 1000.0);
            assert!(process.violation(one.t[k], &one.x[k], &velocity).unwrap() < 500.0 * h);
        }
        swept += usize::from(one.lambda.iter().any(|l| l.amax() > 0.0));
    }
    assert!(swept >= 3);
}

#[test]
fn theorem_3_5_and_remark_3_7_jumps_are_projections() {
    // Gu of bounded variation: at an edge z⁺ = prox[S(t⁺); z⁻] (25), the minimiser (26), and −z⁺ + z⁻ ∈ N (24).
    let mut random = Random(37);
    for _ in 0..10 {
        let height = random.vector(2) * 2.0;
        let drive: Signal = Rc::new(move |t| -&height * square(t));
        let (linear, p) = gradient_type(&mut random, (3, 2), drive);
        let process = SweepingProcess::of(&linear, Some(&p)).unwrap();
        let before = process.jump(0.4, &random.vector(3)).unwrap();
        let h = 1e-9;
        let t = 0.5 - 0.5 * h;
        let after = step(&process, t, &before, h).unwrap().x;
        let projected = process.jump(0.5, &before).unwrap();
        assert!((&after - &projected).norm() < 1e-6);
        // (26) by the interior point method, and in the state x with the metric P.
        assert!((process.set(0.5).nearest(&before).unwrap() - &projected).norm() < 1e-5);
        let x = |z: &DVector<f64>| &process.r_inverse * z;
        let moved = step(&linear, t, &x(&before), h).unwrap().x;
        assert!((&moved - x(&projected)).norm() < 1e-6);
        let metric = energy(&p, &(&moved - x(&before)));
        assert!((metric - (&projected - &before).norm_squared()).abs() < 1e-5);
        // (24).
        assert!(
            process
                .set(0.5)
                .distance_to_normal(&projected, &(&before - &projected))
                .unwrap()
                < 1e-6
        );
    }
}

#[test]
fn equation_33_energy_lost_at_jumps() {
    let mut random = Random(33);
    let mut lossy = 0;
    for _ in 0..20 {
        // A cone (F = 0): 0 ∈ S, where (33) says that V does not increase.
        let (linear, p) = gradient_type(&mut random, (3, 2), constant(DVector::zeros(2)));
        let process = SweepingProcess::of(&linear, Some(&p)).unwrap();
        let before = random.vector(3);
        let (after, impulse) = process.set(0.0).project(&before).unwrap();
        let v = |z: &DVector<f64>| 0.5 * z.norm_squared();
        assert!(v(&after) <= v(&before) + 1e-12);
        lossy += usize::from(v(&after) < v(&before) - 1e-6);
        // ΔV = ½ ζ̄ᵀCR⁻¹(z⁺ + z⁻): the printed difference z⁺ − z⁻ is a misprint.
        let g = &process.set(0.0).g;
        let supplied = 0.5 * impulse.dot(&(g * (&after + &before)));
        assert!((v(&after) - v(&before) - supplied).abs() < 1e-9);
    }
    assert!(lossy > 10);
}

#[test]
fn section_3_3_block_feedthrough_is_a_sweeping_process() {
    let mut random = Random(303);
    for _ in 0..5 {
        let (linear, p) = gradient_type(&mut random, (3, 3), constant(dvector![0.2, 0.1, 0.3]));
        let mut system = linear.system.clone();
        // Port 0 gets feedthrough, a gain of its own and no symmetry; ports 1, 2 keep PB = Cᵀ.
        system.d[(0, 0)] = 0.7;
        system.b.set_column(0, &random.vector(3));
        let linear = Linear::new(system, linear.e, linear.f).unwrap();
        let process = SweepingProcess::with_feedthrough(&linear, Some(&p)).unwrap();
        assert_eq!(
            (process.fed.clone(), process.free.clone()),
            (vec![0], vec![1, 2])
        );
        let start = process.jump(0.0, &random.vector(3)).unwrap();
        let mut distances = Vec::new();
        for steps in [500, 2000] {
            let implicit = linear
                .integrate((0.0, 1.0), &(&process.r_inverse * &start), steps)
                .unwrap();
            let mut z = start.clone();
            for k in 0..steps {
                let h = 1.0 / steps as f64;
                z = process.catch_up(k as f64 * h, &z, h).unwrap();
            }
            distances.push((&process.r_inverse * z - implicit.last().unwrap()).norm());
        }
        assert!(
            distances[1] < 0.5 * distances[0] + 1e-9 && distances[1] < 2e-2,
            "{distances:?}"
        );
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
    // The two cones are dual: ⟨ζ̄, w̄⟩ ≥ 0 for members; the violation sees what is not one.
    for _ in 0..50 {
        let (zeta, w) = cone.variables(
            &random.vector(4).map(f64::abs),
            &random.vector(4).map(f64::abs),
        );
        assert!(zeta.dot(&w) >= -1e-12);
    }
    let outside = cone.variables(&-random.vector(4).map(f64::abs), &DVector::zeros(4));
    assert!(cone.violation(0.0, &dvector![0.0], &outside.0, &outside.1) > 1e-3);
    // A V that does not block-diagonalise D is refused.
    assert!(ConeComplementarity::with(&linear, &DMatrix::identity(4, 4)).is_err());
}

#[test]
fn capacitor_filter_jumps_to_its_projection() {
    // CIRCUITS 3.3 at t = 0+ in (38) alone: v_f = −3 V is inadmissible, the bridge conducts an impulse to 0 V.
    let linear = Linear::autonomous(filter()).unwrap();
    let end = step(&linear, 0.0, &dvector![-3.0], 1e-12).unwrap();
    assert!(end.x[0].abs() < 1e-6, "{}", end.x);
    let charge = (end.lambda[0] + end.lambda[2]) * 1e-12;
    assert!((charge / (3.0 * C) - 1.0).abs() < 1e-5, "{charge}");
}

/// (54) with its storage V = x²/2.
fn example_4_5(u: impl Fn(f64) -> f64 + Clone + 'static) -> NonlinearComplementarity {
    let (v, w) = (u.clone(), u.clone());
    NonlinearComplementarity {
        field: Rc::new(move |t, x| dvector![-x[0].powi(3) + (x[0] * x[0] + 1.0) * u(t)]),
        field_jacobian: Rc::new(move |t, x| dmatrix![-3.0 * x[0] * x[0] + 2.0 * x[0] * v(t)]),
        b: dmatrix![1.0],
        c: Map::affine(dmatrix![1.0], dvector![0.0]),
        g: Rc::new(move |t| dvector![w(t).sin()]),
        hessian: Rc::new(|_| dmatrix![1.0]),
    }
}

#[test]
fn example_4_5_scalar_system_with_cubic_drift() {
    let points: Vec<DVector<f64>> = (-5..6).map(|k| dvector![f64::from(k) * 0.5]).collect();
    // Without input: x' = −x³, x(t) = x₀/√(1 + 2x₀²t), never touching the constraint.
    let free = example_4_5(|_| 0.0);
    free.check_storage(&points).unwrap();
    assert_eq!(free.prox_regularity(&points, 0.0).unwrap(), f64::INFINITY);
    let run = integrate(&free, (0.0, 2.0), &dvector![1.5], 20_000).unwrap();
    let exact = 1.5 / (1.0 + 2.0 * 1.5 * 1.5 * 2.0_f64).sqrt();
    assert!((run.last().unwrap()[0] - exact).abs() < 1e-4);
    // From outside S = [0, ∞) the first step lands on its boundary.
    assert!(step(&free, 0.0, &dvector![-1.0], 1e-9).unwrap().x[0].abs() < 1e-9);
    // With input: solutions from two admissible starts approach each other on the boundary and stay admissible.
    let u = |t: f64| -(2.0 * t).sin();
    let driven = example_4_5(u);
    let one = integrate(&driven, (0.0, 3.0), &dvector![0.0], 6000).unwrap();
    let other = integrate(&driven, (0.0, 3.0), &dvector![1.0], 6000).unwrap();
    for (t, x) in one.t.iter().zip(&one.x).skip(1) {
        assert!(x[0] + u(*t).sin() >= -1e-9);
    }
    assert!(one.lambda.iter().any(|l| l[0] > 1e-3));
    let gap = |k: usize| (one.x[k][0] - other.x[k][0]).abs();
    assert!(gap(6000) < 0.2 * gap(0));
    // One solution: half the step changes it by O(h).
    let coarse = integrate(&driven, (0.0, 3.0), &dvector![0.0], 3000).unwrap();
    assert!((one.last().unwrap() - coarse.last().unwrap()).norm() < 5e-3);
}

#[test]
fn example_4_6_quadratic_storage_gives_convex_sets() {
    let mut random = Random(46);
    let (linear, p) = gradient_type(&mut random, (3, 2), constant(DVector::zeros(2)));
    let (a, g) = (random.matrix(3, 3), random.matrix(3, 3));
    let (a2, g2) = (a.clone(), g.clone());
    let system = NonlinearComplementarity {
        field: Rc::new(move |_, x| &a * x * x.dot(&(&g * x))),
        field_jacobian: Rc::new(move |_, x| {
            &a2 * x.dot(&(&g2 * x)) + &a2 * x * (x.transpose() * (&g2 + g2.transpose()))
        }),
        b: linear.system.b.clone(),
        c: Map::affine(linear.system.c.clone(), DVector::zeros(2)),
        g: Rc::new(|t: f64| dvector![0.05 - 0.5 * (4.0 * t).sin(), 0.3 * (3.0 * t).cos()]),
        hessian: Rc::new({
            let p = p.clone();
            move |_| p.clone()
        }),
    };
    let points: Vec<DVector<f64>> = (0..5).map(|_| random.vector(3)).collect();
    system.check_storage(&points).unwrap();
    assert_eq!(system.prox_regularity(&points, 0.0).unwrap(), f64::INFINITY);
    // z = Rx: the state map is linear.
    let process = SweepingProcess::of(&linear, Some(&p)).unwrap();
    for x in &points {
        assert!((system.state_map(x).unwrap() - &process.r * x).norm() < 1e-9);
    }
    // (34) in x and (40) in z are the same motion.
    let x0 = random.vector(3) * 0.05;
    let in_x = integrate(&system, (0.0, 1.0), &x0, 150).unwrap();
    let in_z = integrate(
        &system.in_z(&x0).unwrap(),
        (0.0, 1.0),
        &(&process.r * &x0),
        150,
    )
    .unwrap();
    assert!((&process.r * in_x.last().unwrap() - in_z.last().unwrap()).norm() < 1e-8);
    assert!(in_x.lambda.iter().any(|l| l.amax() > 0.0));
}

/// V = cosh x₁ + cosh x₂, B = (1, 1)ᵀ, c = sinh x₁ + sinh x₂, S = {sinh x₁ + sinh x₂ ≥ 2} in z: not convex.
fn nonconvex(level: Signal) -> NonlinearComplementarity {
    NonlinearComplementarity {
        field: Rc::new(|_, x| dvector![-x[0] - 1.0, -0.5 * x[1]]),
        field_jacobian: Rc::new(|_, _| dmatrix![-1.0, 0.0; 0.0, -0.5]),
        b: dmatrix![1.0; 1.0],
        c: Map::new(
            |x| dvector![x[0].sinh() + x[1].sinh()],
            |x| dmatrix![x[0].cosh(), x[1].cosh()],
        ),
        g: level,
        hessian: Rc::new(|x| DMatrix::from_diagonal(&x.map(f64::cosh))),
    }
}

#[test]
fn theorem_4_3_prox_regular_sets_and_their_radius() {
    let system = nonconvex(constant(dvector![-2.0]));
    // k''ᵢ = ½ tanh xᵢ in z, so sup ‖k''‖ = ½; ρ = min √(cosh x₁ + cosh x₂) ≥ √2; r = ρ/sup ‖k''‖ (44).
    let boundary: Vec<DVector<f64>> = (-6..=9)
        .map(|k| f64::from(k) * 0.25)
        .map(|x: f64| dvector![x, (2.0 - x.sinh()).asinh()])
        .collect();
    system.check_storage(&boundary).unwrap();
    let r = system.prox_regularity(&boundary, 0.5).unwrap();
    let at = |x: &DVector<f64>| (x[0].cosh() + x[1].cosh()).sqrt();
    let expected = boundary.iter().map(at).fold(f64::INFINITY, f64::min) / 0.5;
    assert!((r / expected - 1.0).abs() < 1e-9);
    let z: Vec<DVector<f64>> = boundary
        .iter()
        .map(|x| system.state_map(x).unwrap())
        .collect();
    let normal: Vec<DVector<f64>> = boundary
        .iter()
        .map(|x| -(system.lambda(x).unwrap() * dvector![1.0, 1.0]).normalize())
        .collect();
    let mut nonconvex_pairs = 0;
    for i in 0..z.len() {
        for j in 0..z.len() {
            // Characterisation of r-prox-regularity: ⟨v₁ − v₂, z₁ − z₂⟩ ≥ −‖z₁ − z₂‖² for normals shorter than r.
            let (v1, v2) = (&normal[i] * (0.999 * r), &normal[j] * (0.999 * r));
            let product = (&v1 - &v2).dot(&(&z[i] - &z[j]));
            assert!(product >= -(&z[i] - &z[j]).norm_squared() - 1e-9, "{i} {j}");
            nonconvex_pairs += usize::from(product < -1e-6);
        }
    }
    assert!(nonconvex_pairs > 0, "a convex set would test nothing");
    // (a)-(c): one absolutely continuous solution; halving the step changes it by O(h).
    let x0 = dvector![0.5, 1.6];
    let z0 = system.state_map(&x0).unwrap();
    let run = |steps| integrate(&system.in_z(&x0).unwrap(), (0.0, 2.0), &z0, steps).unwrap();
    let (coarse, fine, finest) = (run(50), run(100), run(200));
    let d1 = (coarse.last().unwrap() - fine.last().unwrap()).norm();
    let d2 = (fine.last().unwrap() - finest.last().unwrap()).norm();
    assert!(d2 < 0.7 * d1 && d2 < 1e-2, "{d1} {d2}");
    assert!(finest.lambda.iter().any(|l| l[0] > 0.1));
    // Without (38) there is no radius: B = 0 moves nothing.
    let still = NonlinearComplementarity {
        b: dmatrix![0.0; 0.0],
        ..system
    };
    assert!(still.prox_regularity(&boundary, 0.5).is_err());
}

#[test]
fn theorem_4_4_small_jumps_of_the_input_are_unique_projections() {
    let level: Signal = Rc::new(|t| dvector![if t < 0.5 { -2.0 } else { -2.6 }]);
    let system = nonconvex(level);
    let x0 = dvector![0.9, (2.0 - 0.9_f64.sinh()).asinh()];
    let z0 = system.state_map(&x0).unwrap();
    let jumped = step(&system.in_z(&x0).unwrap(), 0.5 - 1e-9, &z0, 1e-9 + 1e-12)
        .unwrap()
        .x;
    // The nearest point of S(t⁺), by scanning its boundary.
    let distance = |s: f64| {
        let x = dvector![s, (2.6 - s.sinh()).asinh()];
        (system.state_map(&x).unwrap() - &z0).norm()
    };
    let (mut low, mut high) = (0.0, 2.0);
    for _ in 0..100 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if distance(a) < distance(b) {
            high = b
        } else {
            low = a
        }
    }
    let nearest = distance(0.5 * (low + high));
    assert!(
        ((&jumped - &z0).norm() - nearest).abs() < 1e-6,
        "{} {nearest}",
        (&jumped - &z0).norm()
    );
    // The jump is smaller than r/4, as the theorem asks.
    assert!(
        nearest
            < system
                .prox_regularity(std::slice::from_ref(&x0), 0.5)
                .unwrap()
                / 4.0
    );
    // The jump along B in x is another point: the metric of V'' decides.
    let along_b = step(&system, 0.5 - 1e-9, &x0, 1e-9 + 1e-12).unwrap().x;
    assert!((system.state_map(&along_b).unwrap() - &jumped).norm() > 1e-4);
}
