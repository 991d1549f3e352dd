//! Section 4, sets that are not convex: Lemma 4.2, Theorems 4.3 and 4.4, (40), (44), (45).

use std::rc::Rc;

use circ::forms::nonlinear::NonlinearComplementarity;
use circ::forms::projected::Map;
use circ::forms::{Signal, constant, integrate, step};
use nalgebra::{DMatrix, DVector, dmatrix, dvector};

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

/// The point of the boundary {sinh x₁ + sinh x₂ = level} with x₁ = s.
fn edge(level: f64, s: f64) -> DVector<f64> {
    dvector![s, (level - s.sinh()).asinh()]
}

/// The nearest point of S = {sinh x₁ + sinh x₂ ≥ level} to z, by scanning its boundary and thirds: (x, distance).
fn nearest(system: &NonlinearComplementarity, level: f64, z: &DVector<f64>) -> (DVector<f64>, f64) {
    let distance = |s: f64| (system.state_map(&edge(level, s)).unwrap() - z).norm();
    let scan = |k: usize| -4.0 + 0.2 * k as f64;
    let best = (0..=40).min_by(|&a, &b| distance(scan(a)).total_cmp(&distance(scan(b))));
    let centre = scan(best.unwrap());
    let (mut low, mut high) = (centre - 0.2, centre + 0.2);
    for _ in 0..45 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if distance(a) < distance(b) {
            high = b;
        } else {
            low = a;
        }
    }
    let s = 0.5 * (low + high);
    (edge(level, s), distance(s))
}

/// Steps of the measure inclusion (45) by hand: z⁺ is the nearest point of S(t + h) to z + hΛ(x)a(x). In x.
fn catch_up(
    system: &NonlinearComplementarity,
    level: &dyn Fn(f64) -> f64,
    x0: &DVector<f64>,
    end: f64,
    steps: usize,
) -> Vec<DVector<f64>> {
    let h = end / steps as f64;
    let mut path = vec![x0.clone()];
    for k in 0..steps {
        let (t, x) = (k as f64 * h, &path[k]);
        let root = system.lambda(x).unwrap();
        let z = system.state_map(x).unwrap() + root * (system.field)(t, x) * h;
        let free = system.inverse_state_map(&z, x).unwrap();
        let inside = (system.c.value)(&free)[0] >= level(t + h);
        path.push(if inside {
            free
        } else {
            nearest(system, level(t + h), &z).0
        });
    }
    path
}

/// Lemma 4.2: v ↦ d(ŷ, k⁻¹(R₊ᵐ − v)) is finite and Lipschitz with constant 1/ρ. Here k⁻¹(R₊ − v) = {sinh x₁ + sinh x₂ ≥ −v} and ρ = √2,
/// which is attained at the origin.
#[test]
fn lemma_4_2_distances_are_lipschitz_in_the_level() {
    let system = nonconvex(constant(dvector![0.0]));
    let rho = system.slope(&dvector![0.0, 0.0]).unwrap();
    assert!((rho - 2.0_f64.sqrt()).abs() < 1e-12);
    let mut steepest = 0.0_f64;
    for from in [dvector![0.0, 0.0], dvector![-1.0, 0.5], dvector![1.0, -2.0]] {
        let z = system.state_map(&from).unwrap();
        let own = (system.c.value)(&from)[0];
        let distance = |level: f64| {
            if own >= level {
                0.0
            } else {
                nearest(&system, level, &z).1
            }
        };
        let levels: Vec<f64> = (-4..=6).map(|k| f64::from(k) * 0.5).collect();
        for w in levels.windows(2) {
            let slope = (distance(w[1]) - distance(w[0])).abs() / (w[1] - w[0]);
            assert!(slope <= 1.0 / rho + 1e-6, "{slope} at {w:?}");
            steepest = steepest.max(slope);
        }
    }
    assert!(steepest > 0.95 / rho, "{steepest}");
}

/// Theorem 4.3 (b), (44): S(t) is r-prox-regular with r = ρ/sup ‖k''‖.
#[test]
fn theorem_4_3_prox_regular_sets_and_their_radius() {
    let system = nonconvex(constant(dvector![-2.0]));
    // k''ᵢ = ½ tanh xᵢ in z (by differences of ∇k = BᵀΛ along zᵢ), so sup ‖k''‖ = ½; ρ = min √(cosh x₁ + cosh x₂) ≥ √2; r = ρ/sup ‖k''‖ (44).
    let boundary: Vec<DVector<f64>> = (-6..=9)
        .map(|k| f64::from(k) * 0.25)
        .map(|x: f64| dvector![x, (2.0 - x.sinh()).asinh()])
        .collect();
    let slope = |x: &DVector<f64>| system.b.transpose() * system.lambda(x).unwrap();
    for x in &boundary {
        for i in 0..2 {
            let mut aside = DVector::zeros(2);
            aside[i] = 1e-5 / x[i].cosh().sqrt();
            let second = (slope(&(x + &aside)) - slope(&(x - &aside)))[i] / 2e-5;
            assert!((second - 0.5 * x[i].tanh()).abs() < 1e-8, "{second}");
        }
    }
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
    // Without (38) there is no radius: B = 0 moves nothing.
    let still = NonlinearComplementarity {
        b: dmatrix![0.0; 0.0],
        ..system
    };
    assert!(still.prox_regularity(&boundary, 0.5).is_err());
}

/// Theorem 4.3 (a)-(c): one absolutely continuous solution of (40). Whatever x the inversion of the state map starts from the steps go the
/// same way; steps with the nearest point by hand come to the same motion with order one; and so do steps of (34) in x.
#[test]
fn theorem_4_3_one_solution_whatever_the_start_of_the_solver() {
    let system = nonconvex(constant(dvector![-2.0]));
    let x0 = dvector![0.5, 1.6];
    let z0 = system.state_map(&x0).unwrap();
    let run = |hint: &DVector<f64>, steps| {
        integrate(&system.in_z(hint).unwrap(), (0.0, 2.0), &z0, steps).unwrap()
    };
    let usual = run(&x0, 100);
    assert!(usual.lambda.iter().any(|l| l[0] > 0.1));
    for hint in [dvector![3.0, -3.0], dvector![-1.0, 2.5], dvector![0.0, 0.0]] {
        let other = run(&hint, 100);
        assert!(
            usual
                .x
                .iter()
                .zip(&other.x)
                .all(|(a, b)| (a - b).norm() < 1e-9)
        );
    }
    let distance = |steps: usize| {
        let implicit = run(&x0, steps);
        let by_hand = catch_up(&system, &|_| 2.0, &x0, 2.0, steps);
        let in_x = integrate(&system, (0.0, 2.0), &x0, steps).unwrap();
        let gap = |path: &[DVector<f64>]| {
            let each = path.iter().zip(&implicit.x);
            each.map(|(x, z)| (system.state_map(x).unwrap() - z).norm())
                .fold(0.0, f64::max)
        };
        [gap(&by_hand), gap(&in_x.x)]
    };
    let (coarse, fine) = (distance(40), distance(80));
    for (d1, d2) in coarse.iter().zip(&fine) {
        assert!(
            *d2 < 5e-2 && *d2 > 1e-6 && (1.5..2.6).contains(&(d1 / d2)),
            "{coarse:?} {fine:?}"
        );
    }
}

/// Theorem 4.4: at a jump of the input z⁺ is the nearest point of S(t⁺), for jumps below r/4 (b) and below r/2 (a).
#[test]
fn theorem_4_4_small_jumps_of_the_input_are_unique_projections() {
    let x0 = edge(2.0, 0.9);
    for (level, quarters) in [(2.6, 1.0), (4.2, 2.0)] {
        let drive: Signal = Rc::new(move |t| dvector![if t < 0.5 { -2.0 } else { -level }]);
        let system = nonconvex(drive);
        let z0 = system.state_map(&x0).unwrap();
        let jump = |hint: &DVector<f64>| {
            let form = system.in_z(hint).unwrap();
            step(&form, 0.5 - 1e-9, &z0, 1e-9 + 1e-12).unwrap().x
        };
        let jumped = jump(&x0);
        let (x, distance) = nearest(&system, level, &z0);
        assert!(((&jumped - &z0).norm() - distance).abs() < 1e-6);
        assert!((&jumped - system.state_map(&x).unwrap()).norm() < 1e-4);
        for hint in [dvector![2.0, 2.0], dvector![-1.0, 3.0]] {
            assert!(
                (jump(&hint) - &jumped).norm() < 1e-6,
                "from another start of the solver"
            );
        }
        let r = system
            .prox_regularity(std::slice::from_ref(&x0), 0.5)
            .unwrap();
        assert!(
            distance < quarters * r / 4.0 && distance > (quarters - 1.0) * r / 4.0,
            "{distance} {r}"
        );
        // The jump along B in x is another point: the metric of V'' decides.
        let along_b = step(&system, 0.5 - 1e-9, &x0, 1e-9 + 1e-12).unwrap().x;
        assert!((system.state_map(&along_b).unwrap() - &jumped).norm() > 1e-4);
    }
}

/// Beyond the radius the nearest point is not unique: from the diagonal a large jump has two, left and right of it.
#[test]
fn large_jumps_have_two_projections() {
    let system = nonconvex(constant(dvector![0.0]));
    let x0 = dvector![-2.0, -2.0];
    let z0 = system.state_map(&x0).unwrap();
    let level = 12.0;
    let (one, distance) = nearest(&system, level, &z0);
    let other = dvector![one[1], one[0]];
    let apart = |x: &DVector<f64>| (system.state_map(x).unwrap() - &z0).norm();
    assert!((&one - &other).norm() > 0.1, "{one}");
    assert!((apart(&one) - apart(&other)).abs() < 1e-9);
    let middle = dvector![(level / 2.0).asinh(), (level / 2.0).asinh()];
    assert!(apart(&middle) > distance + 1e-4);
    let r = system.prox_regularity(&[x0, one, middle], 0.5).unwrap();
    assert!(distance > r / 2.0, "{distance} {r}");
}

/// (45): drift, contact and a jump of the level together, against steps with the nearest point by hand.
#[test]
fn equation_45_a_motion_with_a_jump() {
    let level = |t: f64| if t < 0.5 { 2.0 } else { 2.6 };
    let drive: Signal = Rc::new(move |t| dvector![-level(t)]);
    let system = nonconvex(drive);
    let x0 = edge(2.0, 0.9);
    let distance = |steps: usize| {
        let z0 = system.state_map(&x0).unwrap();
        let run = integrate(&system.in_z(&x0).unwrap(), (0.0, 1.0), &z0, steps).unwrap();
        let by_hand = catch_up(&system, &level, &x0, 1.0, steps);
        let gap =
            |(x, z): (&DVector<f64>, &DVector<f64>)| (system.state_map(x).unwrap() - z).norm();
        by_hand.iter().zip(&run.x).map(gap).fold(0.0, f64::max)
    };
    let (d1, d2) = (distance(40), distance(80));
    assert!(
        d2 < 5e-2 && d2 > 1e-6 && (1.5..2.6).contains(&(d1 / d2)),
        "{d1} {d2}"
    );
}
